"""What a run says in words: a row a load case, and where more harmonics were asked for."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.response.forced.response import ForcedPoint
from stickslip.study.chooser import Chooser
from stickslip.study.collect import HZ, CaseResult
from stickslip.study.harmonics_table import named
from stickslip.study.verify import Check

NAMED = 4  # sets of harmonics that a sentence names


@dataclass(frozen=True)
class Row:
    """A line of the closing table."""

    ratio: float
    peak_amplitude: float
    peak_frequency_hz: float
    points: int
    points_low: int
    points_high: int
    points_failed: int
    newton_steps: int
    unknowns: int
    seconds: tuple[float, float, float]


@dataclass(frozen=True)
class RunSummary:
    """How a run ended.

    Parameters
    ----------
    rows
        One a load case.
    chooser
        What chose the harmonics.
    more
        What points with other harmonics than those of the first passage are called.
    choices
        Sentences on where and why more harmonics were asked for.
    checks
        Comparisons with time integration.
    doubts
        Sentences on what more harmonics than the study keeps would change.
    warnings
        Sentences on what the user should know.
    result
        The result file.
    files
        Every file written.
    """

    rows: tuple[Row, ...]
    chooser: Chooser
    more: str
    choices: tuple[str, ...]
    checks: tuple[Check, ...]
    doubts: tuple[str, ...]
    warnings: tuple[str, ...]
    result: Path
    files: tuple[Path, ...]

    @property
    def failed(self) -> int:
        """Number of points that did not converge."""
        return sum(r.points_failed for r in self.rows)


def row(result: CaseResult) -> Row:
    """Return the table's line of a load case."""
    return Row(
        ratio=result.ratio,
        peak_amplitude=result.peak_amplitude,
        peak_frequency_hz=result.peak_frequency_hz,
        points=len(result.accepted),
        points_low=result.points_low,
        points_high=len(result.accepted) - result.points_low,
        points_failed=result.failed,
        newton_steps=result.newton_steps,
        unknowns=result.unknowns,
        seconds=result.seconds,
    )


def more_name(results: Sequence[CaseResult], chooser: Chooser) -> str:
    """Return what points with other harmonics than those of the first passage are called."""
    known = {chooser.low, chooser.high}
    alike = all(a.point.support in known for r in results for a in r.accepted)
    return f"H = {named(chooser.high)}" if alike and chooser.decides else "other H"


def choice_sentence(result: CaseResult, chooser: Chooser) -> str:
    """Say at which frequencies of a load case more harmonics were asked for, and why.

    An alert was asked at the points of the first passage, whatever took their places afterwards: a repeat, or a branch with many harmonics.
    """
    ratio = f"F_CL/F_HE = {result.ratio:g}"
    passage = [p for p in result.solved if p.stage == "low"]
    said = np.array([p.predicted_error for p in passage])
    if not chooser.is_error:
        return f"{ratio}: {_kept(result)}."
    if np.all(np.isnan(said)):
        return f"{ratio}: {chooser.name} was not asked."
    over = said > chooser.threshold
    worst = int(np.nanargmax(said))
    if not np.any(over):
        return (
            f"{ratio}: no frequency needs more harmonics; the largest predicted error is {chooser.shown(said[worst])}, "
            f"below the threshold of {chooser.limit}."
        )
    where = _listed(_intervals(passage, over))
    at = passage[worst].omega / HZ
    return (
        f"{ratio}: {int(over.sum())} of {len(over)} points repeated with {_more(result, chooser)} harmonics, at {where} Hz, because leaving "
        f"the higher harmonics out was predicted to change the response by more than {chooser.limit} "
        f"(largest: {chooser.shown(said[worst])} at {at:.2f} Hz)."
    )


def _more(result: CaseResult, chooser: Chooser) -> str:
    """Return the harmonics of the repeats as text."""
    asked = {tuple(p.asked.tolist()) for p in result.solved if p.asked.size} or {chooser.high}
    return named(chooser.high) if asked == {chooser.high} else "more"


def _kept(result: CaseResult) -> str:
    """Say which harmonics were kept how often, the most frequent ones first."""
    counts = Counter(named(a.point.harmonics) for a in result.accepted)
    each = [f"H = {own} at {n}" for own, n in counts.most_common(NAMED)]
    rest = sum(counts.values()) - sum(n for _, n in counts.most_common(NAMED))
    also = f" and others at {rest}" if rest else ""
    return f"harmonics kept: {'; '.join(each)}{also} of {len(result.accepted)} points"


def _listed(ranges: Sequence[tuple[float, float]]) -> str:
    return ", ".join(f"{lo:.2f}" if lo == hi else f"{lo:.2f} to {hi:.2f}" for lo, hi in ranges)


def _intervals(points: Sequence[ForcedPoint], over: np.ndarray) -> list[tuple[float, float]]:
    """Return the ranges (Hz) of neighbouring frequencies above the threshold."""
    order = np.argsort([p.omega for p in points])
    found: list[tuple[float, float]] = []
    inside = False
    for i in order:
        hz = points[i].omega / HZ
        if over[i]:
            found = [*found[:-1], (found[-1][0], hz)] if inside else [*found, (hz, hz)]
        inside = bool(over[i])
    return found
