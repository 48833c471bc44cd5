"""What a period of a marched motion tells: its harmonics, and whether it has become periodic."""

from collections.abc import Sequence

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray

LONGEST_MEMORY = (
    1e4  # periods; a decay slower than this (damping ratio 1.6e-5) is not credited to any structure
)


def remaining_change(changes: Sequence[float]) -> float:
    """Estimate what is left of a decaying sequence of changes per period: the sum of those still to come.

    The largest changes of two successive stretches, each a third of the record and at least four periods, give the
    ratio ρ of the decay per period; the rest is ``d ρ / (1 - ρ)``. The stretches grow with the record so that slow
    beating is seen as such, and no sum is cut short by a small last change alone: a lightly damped transient that
    changes by 1e-6 a period may still have 1e-3 to go. Where no decay can be seen, as at the level of rounding, the
    slowest decay that is credited to a structure is assumed.
    """
    stretch = max(4, len(changes) // 3)
    if len(changes) < 2 * stretch:
        return np.inf
    late, early = max(changes[-stretch:]), max(changes[-2 * stretch : -stretch])
    if late == 0.0:
        return 0.0
    ratio = (late / early) ** (1.0 / stretch) if early > 0.0 else 1.0
    return late * (min(ratio / (1.0 - ratio), LONGEST_MEMORY) if ratio < 1.0 else LONGEST_MEMORY)


def period_harmonics(began: FloatArray, samples: FloatArray, order: int) -> ComplexArray:
    """Fourier coefficients 0..order of a period by the trapezoidal rule, its ends counted half each."""
    period = np.vstack([(began + samples[-1]) / 2, samples[:-1]])
    coefficients = np.fft.rfft(period, axis=0)[: order + 1] * (2.0 / len(period))
    coefficients[0] /= 2.0
    return np.asarray(coefficients)
