"""Starting frequencies of a second tone: angles of multipliers outside the unit circle, and unstable modes."""

from collections.abc import Sequence

import numpy as np

from stickslip.arrays import ComplexArray

REAL = 1e-6  # rad: an angle that is smaller, or nearer to π, is none of a second frequency


def tones_of_multipliers(multipliers: ComplexArray, omega: float, highest: int, count: int = 1) -> list[float]:
    """Return the frequencies (rad/s) of the disturbances that grow most, each beside every harmonic of the motion.

    Parameters
    ----------
    multipliers
        Floquet multipliers of a motion.
    omega
        Its frequency, rad/s.
    highest
        Harmonic up to which a frequency is looked for.
    count
        Pairs of multipliers.

    Notes
    -----
    The angle φ of a multiplier leaves open how many turns the disturbance makes in a period: ``|h ω ± φ ω / 2π|`` are all the same to it.
    """
    grow = [
        value
        for value in sorted(multipliers, key=abs, reverse=True)
        if abs(value) > 1.0 and REAL < np.angle(value) < np.pi - REAL
    ]
    return [
        abs(h + sign * float(np.angle(value)) / (2.0 * np.pi)) * omega
        for value in grow[:count]
        for h in range(highest + 1)
        for sign in ((1.0, -1.0) if h else (1.0,))
    ]


def distinct(frequencies: Sequence[float], omega: float) -> list[float]:
    """Return frequencies that are no multiples of `omega` and differ by more than a thousandth."""
    out: list[float] = []
    for one in frequencies:
        off = abs(one / omega - round(one / omega))
        if one > 0.0 and off > 1e-4 and all(abs(one / known - 1.0) > 1e-3 for known in out):
            out.append(float(one))
    return out
