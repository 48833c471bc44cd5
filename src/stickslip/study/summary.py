"""What a run says in words: a row a load case, and where the alert asked for more harmonics."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.response.forced import ForcedPoint
from stickslip.study.collect import HZ, CaseResult
from stickslip.study.verify import Check


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
    seconds: tuple[float, float, float]


@dataclass(frozen=True)
class RunSummary:
    """How a run ended.

    Parameters
    ----------
    rows
        One a load case.
    low, high
        Orders of the two passages.
    alerts
        Sentences on where and why more harmonics were asked for.
    checks
        Comparisons with time integration.
    warnings
        Sentences on what the user should know.
    result
        The result file.
    files
        Every file written.
    """

    rows: tuple[Row, ...]
    low: int
    high: int
    alerts: tuple[str, ...]
    checks: tuple[Check, ...]
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
        seconds=result.seconds,
    )


def alert_sentence(result: CaseResult, threshold_percent: float, high: int) -> str:
    """Say at which frequencies of a load case the alert asked for more harmonics, and why.

    It was asked at the points of the first passage, whatever took their places afterwards: a repeat, or a branch with many harmonics.
    """
    ratio = f"F_CL/F_HE = {result.ratio:g}"
    passage = [p for p in result.solved if p.stage == "low"]
    errors = np.array([100 * p.predicted_error for p in passage])
    if not np.any(np.isfinite(errors)):
        return f"{ratio}: the alert was not asked."
    over = np.array([bool(e > threshold_percent) for e in errors])
    if not np.any(over):
        return (
            f"{ratio}: no frequency needs more harmonics; the largest predicted error is {np.nanmax(errors):.2g} %, "
            f"below the threshold of {threshold_percent:g} %."
        )
    worst = int(np.nanargmax(errors))
    where = ", ".join(
        f"{lo:.2f}" if lo == hi else f"{lo:.2f} to {hi:.2f}" for lo, hi in _intervals(passage, over)
    )
    at = passage[worst].omega / HZ
    return (
        f"{ratio}: {int(over.sum())} of {len(over)} points repeated with {high} harmonics, at {where} Hz, because leaving "
        f"the higher harmonics out was predicted to change the first harmonic by more than {threshold_percent:g} % "
        f"(up to {errors[worst]:.3g} % at {at:.2f} Hz)."
    )


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
