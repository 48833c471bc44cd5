"""Verdicts: trusted, doubtful or wrong, with reason and remedy."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
import xarray as xr

Level = Literal["trusted", "doubtful", "wrong"]
LEVELS: tuple[Level, ...] = get_args(Level)  # the number of a level in a dataset is its place
UNSTABLE = "unstable"  # of a point: an answer, which a machine does not stay at
POINT_LEVELS = (*LEVELS, UNSTABLE)  # numbers of the verdict on a point
ATTRIBUTE = "verdicts"  # of the dataset of an analysis
ALIKE = 20  # characters that two verdicts of one kind share before their first number, at least
_NUMBER = re.compile(r"\d")
INCOMPLETE = "the run is not complete"


@dataclass(frozen=True)
class Verdict:
    """What is to be thought of an answer, or of a point of it.

    Verdicts are ordered by their levels: `max` of several is the worst one.

    Parameters
    ----------
    level
        ``trusted``, ``doubtful`` or ``wrong``.
    case
        Label of the case; empty: the only one, or all of them.
    frequency_hz
        Of the point; None: the case as a whole.
    why
        Half a sentence or more, without a full stop.
    remedy
        What to do, in whole sentences; empty where nothing is to be done.
    warns
        Whether an answer that is trusted tells of danger: a wheel that flutters.
    """

    level: Level
    case: str = ""
    frequency_hz: float | None = None
    why: str = ""
    remedy: str = ""
    warns: bool = False

    @property
    def rank(self) -> int:
        """Number of the level: 0 trusted, 1 doubtful, 2 wrong."""
        return LEVELS.index(self.level)

    @property
    def told(self) -> bool:
        """Whether the user is told of it unasked: it is not trusted, or there is something to do or to know."""
        return self.rank > 0 or self.warns or bool(self.remedy)

    @property
    def word(self) -> str:
        """What begins it wherever it is shown: its level; of what is trusted ``warning`` or ``note`` where there is something to do or to know."""
        if self.warns and not self.rank:
            return "warning"
        return "note" if self.told and not self.rank else self.level

    @property
    def finding(self) -> str:
        """The verdict in words, but for its level and what to do."""
        hertz = self.frequency_hz
        place = "" if hertz is None else f"{hertz:.2f} Hz: " if hertz >= 1.0 else f"{hertz:.4g} Hz: "
        return said(self.case, f"{place}{self.why}.")

    @property
    def place(self) -> str:
        """Its case and frequency."""
        hertz = "" if self.frequency_hz is None else f"{self.frequency_hz:.6g} Hz"
        return f"{self.case} ({hertz})" if self.case and hertz else self.case or hertz

    @property
    def sentence(self) -> str:
        """The verdict in words, but for its level."""
        return f"{self.finding} {self.remedy}".rstrip()

    def __str__(self) -> str:
        return f"{self.word.upper()}: {self.sentence}"

    def __lt__(self, other: "Verdict") -> bool:
        return self.rank < other.rank


def said(label: str, text: str) -> str:
    """Return a sentence about a case, with its label where there are several."""
    return f"{label}: {text}" if label else text[:1].upper() + text[1:]


def doubt(text: str, case: str = "") -> Verdict:
    """Return the verdict ``doubtful`` with what a whole sentence, or several, says."""
    return Verdict("doubtful", case, None, text.removesuffix("."))


def worst(levels: Iterable[Level]) -> Level:
    """Return the worst of several levels, ``trusted`` of none."""
    return max(levels, key=LEVELS.index, default="trusted")


def of_all_cases(each: Sequence[Verdict], labels: Sequence[str]) -> tuple[Verdict, ...]:
    """Return verdicts in their order, and once without a case what holds as a whole for each of several."""
    cases: dict[tuple[Any, ...], list[str]] = {}
    for v in each:
        cases.setdefault((v.level, v.frequency_hz, v.why, v.remedy, v.warns), []).append(v.case)
    found: dict[Verdict, None] = {}
    for v in each:
        known = set(cases[v.level, v.frequency_hz, v.why, v.remedy, v.warns])
        everywhere = v.told and v.frequency_hz is None and len(labels) > 1 and known >= set(labels)
        found[replace(v, case="") if everywhere else v] = None
    return tuple(found)


def worst_first(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Return verdicts as they are read: wrong, doubtful, warnings, notes, trusted; the order of the cases within each."""
    return sorted(verdicts, key=lambda v: (-v.rank, not v.warns, not v.told))


def together(labels: Sequence[str]) -> str:
    """Return labels of cases in a line: values of one key behind its name."""
    keys = {label.partition(" = ")[0] for label in labels}
    if len(keys) == 1 and not any(", " in label for label in labels):
        head, *rest = labels
        return ", ".join([head, *(label.partition(" = ")[2] or label for label in rest)])
    return ", ".join(labels)


def of_kinds(verdicts: Iterable[Verdict]) -> list[list[Verdict]]:
    """Return verdicts by kind, the kinds worst first: of one kind say the same before their first number; what is only trusted of cases is one kind."""
    kinds: dict[tuple[str, ...], list[Verdict]] = {}
    for v in worst_first(verdicts):
        own: tuple[str, ...] = (v.word, _gist(v.why), _gist(v.remedy))
        if len(own[1]) < ALIKE:
            own = (str(v),)
        if v.case and not v.told:
            own = ()
        kinds.setdefault(own, []).append(v)
    return list(kinds.values())


def likewise(others: Sequence[Verdict]) -> str:
    """Say where the others of a kind are; nothing where there are none."""
    return f"Likewise: {together([v.place for v in others])}." if others else ""


def in_lines(verdicts: Iterable[Verdict], *, every: bool = False) -> list[str]:
    """Return verdicts as lines, worst first: of one kind the first one and where the others are, unless `every` one is asked for."""
    if every:
        return [str(v) for v in worst_first(verdicts)]
    lines = []
    for first, *others in of_kinds(verdicts):
        if first.case and not first.told and others:
            lines.append(f"TRUSTED: {together([v.case for v in (first, *others)])}.")
        else:
            lines.append(f"{first} {likewise(others)}".rstrip())
    return lines


def _gist(text: str) -> str:
    """Return what a sentence says before its first number."""
    return _NUMBER.split(text, maxsplit=1)[0]


def to_json(verdicts: Iterable[Verdict]) -> str:
    """Return verdicts as the text of a JSON list."""
    return json.dumps([asdict(v) for v in verdicts])


def from_json(text: str) -> tuple[Verdict, ...]:
    """Return the verdicts of a JSON list."""
    return tuple(Verdict(**own) for own in json.loads(text))


def stored(attributes: Mapping[Any, Any]) -> tuple[Verdict, ...]:
    """Return the verdicts that stand in the attributes of a dataset.

    Results of versions that knew no verdicts have sentences instead, which were warnings.
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
    """Say in a line which analyses, and which of their cases, are doubtful or wrong; empty where all are trusted."""
    aside = len(stored(tree.attrs))
    each = [INCOMPLETE] * _incomplete(tree) + [f"{aside} of the jobs set aside"] * (aside > 0)
    each += [_not_trusted(str(name), node.to_dataset()) for name, node in tree.children.items()]
    told = "; ".join(text for text in each if text)
    return f"Not to be trusted as it stands: {told}. See the verdicts." if told else ""


def conclusion(tree: xr.DataTree) -> str:
    """Say in a line whether a result is to be trusted: `not_trusted`, or else which single points are not, after how many warnings there are."""
    told = not_trusted(tree)
    if told:
        return told
    warnings = sum(v.word == "warning" for v in of_tree(tree))
    head = f"{warnings} warning{'s' * (warnings > 1)}, see the verdicts. " if warnings else ""
    found = [node["verdict"].values for node in tree.children.values() if "verdict" in node]
    every = np.concatenate([np.zeros(0, dtype=np.int64), *found])
    counts = {POINT_LEVELS[k]: int(np.sum(every == k)) for k in (2, 1, 3)}
    off = ", ".join(f"{n} {level}" for level, n in counts.items() if n)
    if not off:
        return f"{head}Every answer is trusted."
    return f"{head}Every case is trusted; of {every.size} points {off}, none of them the peak of its case."


def _not_trusted(name: str, data: xr.Dataset) -> str:
    words = name.replace("_", " ")
    if "case_verdict" not in data:
        level = worst(v.level for v in stored(data.attrs))
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
