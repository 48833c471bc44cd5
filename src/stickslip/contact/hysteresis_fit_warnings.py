"""Warnings about a fitted hysteresis loop: parameters that the loop does not determine, and doubtful estimates."""

import math

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.loop_model import LoopModel

FOLLOWS = 0.3  # correlation of neighbouring residuals from which on they are no independent noise
MANY = 30  # samples below which a correlation says nothing
DRIFTS = 5.0  # standard deviations of a trend of the residuals that count
NOISY = 0.5  # of the residual: noise of the displacement, times the stiffness
_FOURTH = math.sqrt(70.0)  # standard deviation of fourth differences of noise of one


def doubts(
    model: LoopModel, fitted: FloatArray, slips: FloatArray, *, k_t: float, limit: float, least: tuple[float, float]
) -> list[str]:
    """Return a sentence for each parameter that the loops do not determine and for each doubtful estimate.

    Parameters
    ----------
    model
        The recordings.
    fitted
        (samples,) fitted forces.
    slips
        (samples,) 1 where the fitted contact slips forward, -1 backward, 0 where it sticks.
    k_t, limit
        Fitted values; NaN where the loops do not determine them.
    least
        Lower bounds of both, where the loops do not determine them.
    """
    away = model.measured - fitted
    return [
        *_untold(slips, k_t, limit, least),
        *_correlated(model, away),
        *_trend(model, away),
        *_noisy(model, away, k_t),
    ]


def _untold(slips: FloatArray, k_t: float, limit: float, least: tuple[float, float]) -> list[str]:
    told = []
    if math.isnan(limit) and not slips.any():
        told.append(
            f"No slip can be seen: the loops tell no friction coefficient. The limit force is at least {least[1]:.4g} N; move further, or "
            "press less"
        )
    elif math.isnan(limit):
        told.append(
            "The contact slips in one direction only: the limit force cannot be told from an offset of the force. Go back and forth, or, "
            "where the zero of the force is right, fit without an offset"
        )
    if math.isnan(k_t) and not math.isnan(least[0]):
        told.append(
            f"The contact slips from the first sample on: the loops tell no stiffness. It is at least {least[0]:.4g} N/m; take more "
            "samples where the motion turns"
        )
    elif math.isnan(k_t):
        told.append(
            "The contact slips from the first sample on and does not turn: the loops tell no stiffness. Go back and forth"
        )
    return told


def _parts(model: LoopModel, values: FloatArray) -> list[FloatArray]:
    return np.split(values, model.first[1:])


def _correlation(model: LoopModel, away: FloatArray) -> float:
    """Return the correlation of neighbouring residuals; 0 where they are rounding."""
    parts = _parts(model, away)
    size = sum(float(np.sum(part**2)) for part in parts)
    if size <= (1e-9 * model.swing) ** 2 * away.size:
        return 0.0
    return sum(float(np.sum(part[1:] * part[:-1])) for part in parts) / size


def _inflation(correlation: float) -> float:
    """Return the factor by which correlated residuals reduce standard deviations."""
    held = min(max(correlation, 0.0), 0.999)
    return math.sqrt((1 + held) / (1 - held))


def _correlated(model: LoopModel, away: FloatArray) -> list[str]:
    correlation = _correlation(model, away)
    if away.size < MANY or correlation < FOLLOWS:
        return []
    told = (
        f"Neighbouring residuals follow each other (correlation {correlation:.2f}): the law is not quite that of the loop, or the force "
        f"was filtered. The standard deviations are too small by a factor of about {_inflation(correlation):.1f}, and say nothing of "
        "what the law leaves out"
    )
    return [told]


def _trend(model: LoopModel, away: FloatArray) -> list[str]:
    if model.drift or away.size < MANY:
        return []
    grow = _inflation(_correlation(model, away))
    for j, part in enumerate(_parts(model, away)):
        t = np.linspace(-1.0, 1.0, part.size)
        slope = float(t @ part / (t @ t))
        noise = float(np.std(part - slope * t)) / math.sqrt(float(t @ t))
        if abs(slope) > DRIFTS * grow * noise and abs(slope) > 1e-9 * model.swing:
            of = f" of recording {j + 1}" * (len(model.loops) > 1)
            return [f"The force{of} drifts by {2 * slope:.3g} N from its first to its last sample: fit with a drift"]
    return []


def _noisy(model: LoopModel, away: FloatArray, k_t: float) -> list[str]:
    """Return a warning where the noise of the displacement, which least squares of the force neglect, is as large as the residual."""
    if math.isnan(k_t):
        return []
    rough = [np.diff(x, 4) / _FOURTH for x, _ in model.loops]
    noise = float(np.sqrt(np.mean(np.concatenate(rough) ** 2)))
    rms = float(np.sqrt(np.mean(away**2)))
    if k_t * noise < NOISY * rms or k_t * noise < 1e-3 * model.swing:
        return []
    told = (
        f"The displacement jumps by some {noise:.2g} m from sample to sample, which the stiffness makes {k_t * noise:.2g} N of: least "
        "squares take the displacement for exact. Average over cycles, or filter both signals alike"
    )
    return [told]
