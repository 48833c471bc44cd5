"""The page: contents in the templates of `assets`, which escape all foreign markup."""

import re
from base64 import b64decode, b64encode
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from plotly.io import to_html
from plotly.offline import get_plotlyjs

from stickslip.report.plot import Plot
from stickslip.report.section import Card, Chooser, Content, Table, Words
from stickslip.study.file.case_names import CASE, shortened
from stickslip.study.store.atomic_write import write_whole
from stickslip.study.verdict import JOINT, Verdict, likewise, of_kinds, once, worst_first

_CONFIG = {
    "responsive": True,
    "displaylogo": False,
    "modeBarButtonsToRemove": ["select2d", "lasso2d"],
    # pictures are saved for print, at twice the size on the screen
    "toImageButtonOptions": {"scale": 2},
}
MOST_IN_NARROW = 6  # columns of numbers that a map shows on a narrow screen
LONGEST_LINE = 28  # letters of a line of a legend
PLURAL = ("note", "warning")  # words of verdicts with a plural; the others are levels
_BOLD, _CODE = re.compile(r"\*\*(.+?)\*\*"), re.compile(r"`([^`]+)`")


Kind = Literal["figure", "table", "words", "chooser"]


@dataclass(frozen=True)
class Placed:
    """One element of the page. A figure has a number, a drawing, and a flag to scroll on a narrow screen."""

    own: Content
    kind: Kind
    number: int = 0
    drawing: Markup = field(default_factory=Markup)
    wide: bool = False


@dataclass(frozen=True)
class CaseBody:
    """Content of a chapter while one case is chosen."""

    index: int
    label: str
    shown: Sequence[Placed]


@dataclass(frozen=True)
class Chapter:
    """A chapter of the page: the content common to all cases, then the content of each case."""

    key: str
    title: str
    shown: Sequence[Placed]
    cases: Sequence[CaseBody] = ()
    folded: bool = False


@dataclass(frozen=True)
class Cause:
    """Verdicts of one kind: the first in full, the others on request."""

    verdict: Verdict
    others: Sequence[Verdict] = ()

    @property
    def likewise(self) -> str:
        """The places of the other verdicts; empty for none."""
        return likewise(self.others)


@dataclass(frozen=True)
class Conclusion:
    """Head of the page: one line, and folded below it the verdicts by cause, the worst first, and the trusted answers.

    Parameters
    ----------
    told
        The line.
    kind
        Colour of the line.
    counts
        Numbers of doubts, warnings and notes, in words; empty for none.
    causes
        Verdicts with a doubt, a warning or a remedy.
    good
        Trusted answers with their checks.
    """

    told: str
    kind: Literal["good", "some", "bad"]
    counts: str
    causes: Sequence[Cause]
    good: Sequence[Verdict]


@dataclass
class Placing:
    """Numbering of the figures of a page, in their order."""

    figures: int = field(default=0)

    def __call__(self, contents: Iterable[Content]) -> list[Placed]:
        """Return the contents as elements of the page, figures with number and drawing."""
        return [self._placed(own) for own in contents]

    def _placed(self, own: Content) -> Placed:
        if not isinstance(own, Plot):
            return Placed(_with_short_names(own), _kind(own))
        self.figures += 1
        drawing = to_html(
            _slim(_in_short_lines(own.figure.to_dict())),
            config=_CONFIG,
            full_html=False,
            include_plotlyjs=False,
            div_id=f"plot-{anchor(own.key)}",
            validate=False,
        )
        ends = [axis.domain[1] for axis in own.figure.select_xaxes() if axis.domain]
        columns = max(
            (len(map_.x) for map_ in own.figure.select_traces({"type": "heatmap"}) if map_.text is not None), default=0
        )
        beside = len(list(own.figure.select_scenes())) > 1 or (
            any("polar" in trace.type for trace in own.figure.data) and bool(ends)
        )
        wide = min(ends, default=1.0) < 0.9 or beside or columns > MOST_IN_NARROW
        return Placed(own, "figure", self.figures, Markup(drawing), wide)


def _in_short_lines(drawn: dict[str, Any]) -> dict[str, Any]:
    """Return a plotly figure with legend entries broken between the parts of long names."""
    for trace in drawn["data"]:
        if trace.get("showlegend") is not False and len(trace.get("name") or "") > LONGEST_LINE:
            trace["name"] = _broken(trace["name"])
    return drawn


def _broken(name: str) -> str:
    lines = [""]
    for part in name.split(JOINT):
        if lines[-1] and len(lines[-1]) + len(part) > LONGEST_LINE:
            lines.append("")
        lines[-1] += f"{JOINT}{part}" if lines[-1] else part
    return ",<br>".join(lines)


def _slim(drawn: Any) -> Any:
    """Return a plotly figure with its 64-bit numbers as 32-bit ones (seven digits), which halves the page."""
    if isinstance(drawn, list):
        return [_slim(each) for each in drawn]
    if not isinstance(drawn, dict):
        return drawn
    if drawn.get("dtype") == "f8":
        values = np.frombuffer(b64decode(drawn["bdata"]), dtype="<f8").astype("<f4")
        return {**drawn, "dtype": "f4", "bdata": b64encode(values.tobytes()).decode("ascii")}
    return {key: _slim(value) for key, value in drawn.items()}


def _with_short_names(own: Table | Words | Chooser) -> Table | Words | Chooser:
    """Return a table or a choice of cases without the words that long names have in common; its heading has them."""
    if isinstance(own, Table) and own.rows and list(own.head[:1]) == [CASE]:
        heading, names = shortened([row[0] for row in own.rows])
        rows = [[name, *row[1:]] for name, row in zip(names, own.rows, strict=True)]
        return replace(own, head=[heading, *own.head[1:]], rows=rows)
    if isinstance(own, Chooser) and own.heading == CASE:
        heading, names = shortened([case.short for case in own.cases])
        cases = tuple(replace(case, label=name) for case, name in zip(own.cases, names, strict=True))
        return replace(own, heading=heading, cases=cases)
    return own


def _kind(own: Table | Words | Chooser) -> Kind:
    if isinstance(own, Table):
        return "table"
    return "words" if isinstance(own, Words) else "chooser"


def concluded(verdicts: Sequence[Verdict], told: str, *, bad: bool) -> Conclusion:
    """Sort the verdicts of a result for its head.

    Parameters
    ----------
    verdicts
        All verdicts of the result.
    told
        The conclusion: last line of a run on the terminal.
    bad
        Whether a case or an analysis is not trusted.
    """
    every = worst_first(verdicts)
    told_of = [v for v in once(every) if v.told]
    warns = any(v.rank or v.warns for v in told_of)
    kind: Literal["good", "some", "bad"] = "bad" if bad else "some" if warns else "good"
    words = Counter(v.word for v in told_of)
    counts = ", ".join(f"{n} {word}{'s' * (n > 1 and word in PLURAL)}" for word, n in words.items())
    causes = [Cause(first, others) for first, *others in of_kinds(told_of)]
    return Conclusion(told, kind, counts, causes, once(v for v in every if not v.told))


def anchor(key: str) -> str:
    """Return a name as part of an anchor; names of bodies may contain any character."""
    return re.sub(r"[^\w-]", "_", key)


def inline(text: str) -> Markup:
    """Escape a text and set its **bold** words, its `code` and its line breaks."""
    if isinstance(text, Markup):
        return text
    safe = _BOLD.sub(r"<b>\1</b>", str(escape(text)))
    return Markup(_CODE.sub(r"<code>\1</code>", safe).replace("\n", "<br>"))


@cache
def _templates() -> Environment:
    found = Environment(
        loader=PackageLoader("stickslip.report", "assets"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters |= {"inline": inline, "anchor": anchor}
    return found


def page_html(
    title: str,
    made: str,
    chapters: Sequence[Chapter],
    *,
    cards: Sequence[Card] = (),
    answer: Sequence[Placed] = (),
    conclusion: Conclusion | None = None,
) -> str:
    """Return a whole page, which needs neither network nor other files.

    Parameters
    ----------
    title, made
        Heading of the page, and the line below it.
    chapters
        Chapters in the order of the page.
    cards
        Numbers at the top: first the answer, then the numbers below its figure.
    answer
        Figure of the answer, and words below it; empty for none.
    conclusion
        Verdicts above all else; None for a page without verdicts.
    """
    return (
        _templates()
        .get_template("page.html")
        .render(
            title=title,
            made=made,
            chapters=chapters,
            cards=cards,
            answer=answer,
            conclusion=conclusion,
            style=_asset("page.css"),
            plotly=Markup(get_plotlyjs()),
            scripts=_asset("page.js") + _asset("shapes.js"),
        )
    )


def _asset(name: str) -> Markup:
    return Markup(files("stickslip.report").joinpath("assets", name).read_text(encoding="utf-8"))


def write_page(page: str, path: Path) -> None:
    """Write a page atomically; an `InputError` names the reason if the file cannot be written."""
    write_whole(path, page.encode("utf-8", errors="replace"))
