"""Proportional damping."""

import math

from stickslip.errors import input_error
from stickslip.model.structure import Structure


def rayleigh_damping(
    structure: Structure, ratio: float, between_hz: tuple[float, float]
) -> Structure:
    """Return the structure with ``C = α M + β K``.

    Parameters
    ----------
    structure
        Its own damping matrix is replaced.
    ratio
        Damping ratio (fraction of critical) at both frequencies; it is lower between them.
    between_hz
        Two different frequencies in Hz.
    """
    low, high = between_hz
    if not (math.isfinite(ratio) and ratio >= 0):
        raise input_error("damping ratio", f"must not be negative, got {ratio}", "0.001 is 0.1 %.")
    if not 0 < low < high < math.inf:
        raise input_error(
            "damping between_hz", f"needs 0 < low < high, got {between_hz}", "Give hertz."
        )
    total = 2 * math.pi * (low + high)
    alpha = 2 * ratio * (2 * math.pi) ** 2 * low * high / total
    beta = 2 * ratio / total
    return structure.with_damping(alpha * structure.mass + beta * structure.stiffness)
