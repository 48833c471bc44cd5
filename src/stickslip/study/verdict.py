"""Verdicts: trusted, doubtful or wrong, with reason and remedy."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product, takewhile
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr

Level = Literal["trusted", "doubtful", "wrong"]
LEVELS: tuple[Level, ...] = get_args(Level)  # datasets store the index of a level
UNSTABLE = "unstable"  # verdict on a point: a correct solution at which a machine does not stay
POINT_LEVELS = (*LEVELS, UNSTABLE)  # datasets store the index of the verdict on a point
ATTRIBUTE = "verdicts"  # attribute of the dataset of an analysis
JOINT = ", "  # separator of the parts of a case's name, as in `case_names`
WITH = " with "  # separator between values of several parts
ALIKE = 20  # smallest number of characters before the first number that verdicts of one kind have in common
_NUMBER = re.compile(r"\d")
INCOMPLETE = "the run is not complete"


@dataclass(frozen=True)
class Verdict:
    """Verdict on an answer or on one of its points.

    Verdicts are ordered by their levels: `max` of several is the worst one.

    Parameters
    ----------
    level
        ``trusted``, ``doubtful`` or ``wrong``.
    case
        Label of the case; empty: the only case, or all of them.
    frequency_hz
        Frequency of the point; None: the whole case.
    why
        Reason: half a sentence or more, without a full stop.
    remedy
        Remedy in whole sentences; empty for none.
    warns
        Whether a trusted answer is a warning, such as a wheel that flutters.
    not_judged
        Name of the part of a question that has no answer, such as ``EO 18 above 9368 rpm``; the rest of the answer does not depend on
        it. Empty: the verdict is on an answer.
    """

    level: Level
    case: str = ""
    frequency_hz: float | None = None
    why: str = ""
    remedy: str = ""
    warns: bool = False
    not_judged: str = ""

    @property
    def rank(self) -> int:
        """Number of the level: 0 trusted, 1 doubtful, 2 wrong."""
        return LEVELS.index(self.level)

    @property
    def told(self) -> bool:
        """Whether the verdict is shown by default: it is not trusted, or has a remedy or a warning."""
        return self.rank > 0 or self.warns or bool(self.remedy)

    @property
    def word(self) -> str:
        """Word before the sentence: the level, or ``warning`` or ``note`` for a trusted answer with a warning or a remedy."""
        if self.warns and not self.rank:
            return "warning"
        return "note" if self.told and not self.rank else self.level

    @property
    def finding(self) -> str:
        """The verdict as a sentence, without level and remedy."""
        hertz = self.frequency_hz
        place = "" if hertz is None else f"{hertz:.2f} Hz: " if hertz >= 1.0 else f"{hertz:.4g} Hz: "
        return said(self.case, f"{place}{self.why}.")

    @property
    def place(self) -> str:
        """Case and frequency."""
        hertz = "" if self.frequency_hz is None else f"{self.frequency_hz:.6g} Hz"
        return f"{self.case} ({hertz})" if self.case and hertz else self.case or hertz

    @property
    def sentence(self) -> str:
        """The verdict as a sentence, without level."""
        return f"{self.finding} {self.remedy}".rstrip()

    def __str__(self) -> str:
        return f"{self.word.upper()}: {self.sentence}"

    def __lt__(self, other: "Verdict") -> bool:
        return self.rank < other.rank


def said(label: str, text: str) -> str:
    """Return a sentence about a case, preceded by its label if there are several cases."""
    return f"{label}: {text}" if label else text[:1].upper() + text[1:]


def doubt(text: str, case: str = "") -> Verdict:
    """Return the verdict ``doubtful`` with a text of one or more sentences as its reason."""
    return Verdict("doubtful", case, None, text.removesuffix("."))


def worst(levels: Iterable[Level]) -> Level:
    """Return the worst of several levels; ``trusted`` if there are none."""
    return max(levels, key=LEVELS.index, default="trusted")


def of_all_cases(each: Sequence[Verdict], labels: Sequence[str]) -> tuple[Verdict, ...]:
    """Return verdicts in their order; a verdict that holds for every case appears once, without a case."""
    cases: dict[Verdict, list[str]] = {}
    for v in each:
        cases.setdefault(replace(v, case=""), []).append(v.case)
    found: dict[Verdict, None] = {}
    for v in each:
        known = set(cases[replace(v, case="")])
        everywhere = v.told and v.frequency_hz is None and len(labels) > 1 and known >= set(labels)
        found[replace(v, case="") if everywhere else v] = None
    return tuple(found)


def worst_first(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return verdicts in reading order: wrong, doubtful, warnings, notes, trusted; equal ones in the order of the cases."""
    return sorted(verdicts, key=lambda v: (-v.rank, not v.warns, not v.told))


def together(labels: Sequence[str]) -> str:
    """Join names of cases to one line; common first words and common parts are written once."""
    if any(WITH in label for label in labels):  # a label that already joins several cases
        return "; ".join(labels)
    if len(labels) > 1 and any(JOINT in label for label in labels):
        return _by_parts([tuple(label.split(JOINT)) for label in labels])
    words = zip(*(label.split(" ")[:-1] for label in labels), strict=False)
    common = [own[0] for own in takewhile(lambda own: len(set(own)) == 1, words)]
    if not common:
        return ", ".join(labels)
    head, *rest = labels
    return ", ".join([head, *(label.removeprefix(f"{' '.join(common)} ") for label in rest)])


def _by_parts(labels: Sequence[tuple[str, ...]]) -> str:
    """Join names that have several parts.

    If the names are all combinations of their parts, return the values of each part that differs, then the common parts. Else they are
    split by the values of that part which gives the shortest text.
    """
    if len(labels) == 1 or len({len(parts) for parts in labels}) > 1:
        return "; ".join(JOINT.join(parts) for parts in labels)
    columns = [list(dict.fromkeys(column)) for column in zip(*labels, strict=True)]
    if set(labels) != set(product(*columns)):
        several = [k for k, values in enumerate(columns) if len(values) > 1]
        split = ("; ".join(_by_parts([own for own in labels if own[k] == v]) for v in columns[k]) for k in several)
        return min(split, key=len)
    differing = WITH.join(together(values) for values in columns if len(values) > 1)
    same = JOINT.join(values[0] for values in columns if len(values) == 1)
    return f"{differing}, each{WITH}{same}" if same else differing


def once(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return verdicts in their order; verdicts that differ only in the case become one for all these cases."""
    cases: dict[Verdict, list[str]] = {}
    for v in verdicts:
        cases.setdefault(replace(v, case=""), []).append(v.case)
    return [replace(v, case=together(list(dict.fromkeys(own))) if all(own) else "") for v, own in cases.items()]


def of_kinds(verdicts: Iterable[Verdict]) -> list[list[Verdict]]:
    """Group verdicts by kind, the worst kind first; equal verdicts of several cases become one.

    Verdicts of a kind agree up to their first number; plain trusted cases form one kind.
    """
    kinds: dict[tuple[str, ...], list[Verdict]] = {}
    for v in worst_first(once(verdicts)):
        own: tuple[str, ...] = (v.word, _gist(v.why), _gist(v.remedy))
        if len(own[1]) < ALIKE:
            own = (str(v),)
        if v.case and not v.told:
            own = ()
        kinds.setdefault(own, []).append(v)
    return list(kinds.values())


def likewise(others: Sequence[Verdict]) -> str:
    """List the places of the other verdicts of a kind; empty for none."""
    return f"Likewise: {together([v.place for v in others])}." if others else ""


def in_lines(verdicts: Iterable[Verdict], *, every: bool = False) -> list[str]:
    """Return verdicts as lines, worst first: one line for each kind, with the places of all its verdicts.

    With `every`, each different verdict has a line.
    """
    if every:
        return [str(v) for v in worst_first(once(verdicts))]
    every_verdict, lines = list(verdicts), []
    trusted = list(dict.fromkeys(v.case for v in every_verdict if v.case and not v.told))
    for first, *others in of_kinds(every_verdict):
        if first.case and not first.told and others:
            lines.append(f"TRUSTED: {together(trusted)}.")
        else:
            lines.append(f"{first} {likewise(others)}".rstrip())
    return lines


def _gist(text: str) -> str:
    """Return a sentence up to its first number."""
    return _NUMBER.split(text, maxsplit=1)[0]


def to_json(verdicts: Iterable[Verdict]) -> str:
    """Return verdicts as the text of a JSON list."""
    each = (asdict(v) for v in verdicts)
    return json.dumps([{k: own[k] for k in own if own[k] or k != "not_judged"} for own in each])


def from_json(text: str) -> tuple[Verdict, ...]:
    """Return the verdicts of a JSON list."""
    return tuple(Verdict(**own) for own in json.loads(text))


def stored(attributes: Mapping[Any, Any]) -> tuple[Verdict, ...]:
    """Return the verdicts stored in the attributes of a dataset.

    Results of early versions have warnings as sentences instead; these become verdicts.
    """
    if ATTRIBUTE in attributes:
        return from_json(str(attributes[ATTRIBUTE]))
    return tuple(doubt(str(text)) for text in json.loads(str(attributes.get("warnings", "[]"))))


def _incomplete(tree: xr.DataTree) -> bool:
    nodes = [tree, *tree.children.values()]
    return any(int(node.attrs.get("complete", 1)) == 0 for node in nodes)


def of_tree(tree: xr.DataTree) -> tuple[Verdict, ...]:
    """Return the verdicts of all analyses of a result."""
    nodes = [tree, *tree.children.values()]
    found: list[Verdict] = []
    if _incomplete(tree):
        remedy = "Run the study again: it resumes where it stopped."
        found = [Verdict("doubtful", why=INCOMPLETE, remedy=remedy)]
    return tuple(dict.fromkeys([*found, *(v for node in nodes for v in stored(node.attrs))]))


def not_trusted(tree: xr.DataTree) -> str:
    """Return a line that names the doubtful and wrong analyses and cases; empty if all are trusted."""
    aside = len(stored(tree.attrs))
    each = [INCOMPLETE] * _incomplete(tree) + [f"{aside} of the jobs set aside"] * (aside > 0)
    each += [_not_trusted(str(name), node.to_dataset()) for name, node in tree.children.items()]
    told = "; ".join(text for text in each if text)
    return f"Not to be trusted as it stands: {told}. See the verdicts." if told else ""


def conclusion(tree: xr.DataTree) -> str:
    """Summarise a result in a line: `not_trusted`, or else the numbers of warnings and of single points that are not trusted."""
    told = not_trusted(tree)
    if told:
        return told
    warnings = sum(v.word == "warning" for v in of_tree(tree))
    head = f"{warnings} warning{'s' * (warnings > 1)}, see the verdicts. " if warnings else ""
    left = _not_judged(tree)
    head += f"{left} " * bool(left)
    found = [node["verdict"].values for node in tree.children.values() if "verdict" in node]
    every = np.concatenate([np.zeros(0, dtype=np.int64), *found])
    counts = {POINT_LEVELS[k]: int(np.sum(every == k)) for k in (2, 1, 3)}
    off = ", ".join(f"{n} {level}" for level, n in counts.items() if n)
    if not off:
        return f"{head}{'The rest' if left else 'Every answer'} is trusted."
    return f"{head}Every case is trusted; of {every.size} points {off}, none of them the peak of its case."


def _not_judged(tree: xr.DataTree) -> str:
    """Return a line that names the parts of questions without an answer, and their remedies; empty for none."""
    found: dict[str, list[str]] = {}
    for v in of_tree(tree):
        if v.not_judged:
            remedy = v.remedy[:1].lower() + v.remedy[1:].removesuffix(".")
            found.setdefault(remedy, []).append(said(v.case, v.not_judged))
    return "; ".join(f"{' and '.join(names)} not judged ({remedy})" for remedy, names in found.items()) + "." * bool(
        found
    )


def _not_trusted(name: str, data: xr.Dataset) -> str:
    words = name.replace("_", " ")
    if "case_verdict" not in data:
        level = worst(v.level for v in stored(data.attrs) if not v.not_judged)
        return "" if level == "trusted" else f"{words}: {level}"
    levels = data["case_verdict"].values
    if not np.any(levels):
        return ""
    bad = list(dict.fromkeys(v.case for v in stored(data.attrs) if v.level == "wrong"))
    if levels.size == 1:
        apart = "wrong at single points, the case " * bool(bad and levels[0] < 2)
        return f"{words}: {apart}{LEVELS[int(levels[0])]}"
    labels = np.array([str(x) for x in data["case_label"].values])
    beside = [label for label in bad if label in labels[levels < 2]]
    said = [f"wrong at single points of {', '.join(beside)}"] * bool(beside)
    said += [
        f"{np.sum(levels == rank)} of {levels.size} cases {LEVELS[rank]} ({together(labels[levels == rank].tolist())})"
        for rank in (2, 1)
        if np.any(levels == rank)
    ]
    return f"{words}: {', '.join(said)}"
