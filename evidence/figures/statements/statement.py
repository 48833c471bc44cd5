"""One row of the table, and the words that all rows share."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from evidence.figures.solve import Pair
from evidence.figures.timing import Share
from stickslip.arrays import FloatArray

Verdict = Literal["holds", "does not hold", "not tested", "undecided"]
THRESHOLD = 0.05
SMALL, LARGE = 0.005, 0.05  # the band in which predicted and actual error are said to be alike
ZERO = 1e-9  # an error, or a change of a Jacobian, that counts as none
OVERLAP = 0.01  # relative difference of two curves that cannot be seen
ONE_PERCENT = 0.01


@dataclass(frozen=True, kw_only=True)
class Statement:
    """One row of the table.

    Attributes
    ----------
    section
        Section of the paper that says it; rows stand in the order of the paper.
    place
        Figure, where there is one.
    claim
        What the paper says.
    number
        Its number.
    own
        What this package finds.
    verdict
        Whether that agrees; ``not tested``: the case does not do what the statement is about; ``undecided``: within the spread of times,
        or both of what the paper may mean.
    by
        By how much it does or does not; of what is not tested, what is missing.
    why
        What explains a disagreement, with a number.
    """

    section: str
    claim: str
    own: str
    verdict: Verdict
    place: str = ""
    number: str = "no number"
    by: str = ""
    why: str = ""

    @property
    def said(self) -> str:
        """Verdict in words."""
        return f"{self.verdict}: {self.by}" if self.by else self.verdict


def judged(holds: bool) -> Verdict:
    """Return the word of a comparison."""
    return "holds" if holds else "does not hold"


def below(share: Share, limit: float, by_counts: float | None = None) -> Verdict:
    """Judge whether a time is at most a share of another one: undecided within the spread, or where counts say the opposite."""
    if share.first <= limit < share.last:
        return "undecided"
    holds = share.last <= limit
    if by_counts is not None and (by_counts <= limit) != holds:
        return "undecided"
    return judged(holds)


def numbered(rows: Sequence[Statement]) -> list[tuple[str, Statement]]:
    """Return each row with its name: section, and place in it."""
    count: dict[str, int] = {}
    out = []
    for row in rows:
        count[row.section] = count.get(row.section, 0) + 1
        out.append((f"{row.section}-{count[row.section]}", row))
    return out


def tally(rows: Sequence[Statement]) -> str:
    """Return the counts of the verdicts in words."""
    verdicts = [row.verdict for row in rows]
    words = ("holds", "does not hold", "not tested", "undecided")
    hold, do_not, untested, undecided = (verdicts.count(word) for word in words)  # type: ignore[arg-type]
    return f"{hold} hold, {do_not} do not, {untested} are not tested, {undecided} undecided"


def percent(value: float, digits: int = 3) -> str:
    """Return a fraction in per cent; large ones in whole numbers."""
    large = abs(100 * value) >= 10**digits - 0.5
    return f"{100 * value:.0f} %" if large else f"{100 * value:.{digits}g} %"


def signed(value: float) -> str:
    """Return a fraction in per cent with its sign."""
    return f"{100 * value:+.0f} %" if abs(value) >= 0.995 else f"{100 * value:+.2g} %"


def span(values: Sequence[float] | FloatArray, digits: int = 3) -> str:
    """Return the range of fractions in per cent."""
    if not len(values):
        return "none"
    least, most = (percent(float(v), digits)[:-2] for v in (np.min(values), np.max(values)))
    return f"{least} to {most} %"


def interval(hertz: Sequence[float]) -> str:
    """Return the range of frequencies in words."""
    if not len(hertz):
        return "nowhere"
    if min(hertz) == max(hertz):
        return f"{min(hertz):.2f} Hz"
    return f"{min(hertz):.2f} to {max(hertz):.2f} Hz"


def listed(values: Sequence[float]) -> str:
    """Return ratios in words."""
    return ", ".join(f"{v:g}" for v in values) or "none"


def sentence(text: str) -> str:
    """Return a text with a capital letter and a full stop."""
    return text[0].upper() + text[1:] + "." if text else ""


def median(values: Sequence[float]) -> float:
    """Return the median; NaN of nothing."""
    return float(np.median(values)) if len(values) else float("nan")


def rank_correlation(x: Sequence[float], y: Sequence[float]) -> float:
    """Return Spearman's coefficient."""
    ranks = [np.argsort(np.argsort(v)) for v in (x, y)]
    return float(np.corrcoef(ranks)[0, 1]) if len(x) > 2 else float("nan")


def states_said(alike: Sequence[Pair], apart: Sequence[Pair]) -> str:
    """Say how much the contact states of one and five harmonics differ, where a prediction is right and where it is not."""
    parts = [
        f"{percent(median([p.states for p in some]), 2)} where it {word} ({len(some)} frequencies)"
        for word, some in (("does not hold", apart), ("holds", alike))
        if some
    ]
    return (
        "share of contact directions and instants whose state differs between one and five harmonics, medians: "
        + ", ".join(parts)
    )
