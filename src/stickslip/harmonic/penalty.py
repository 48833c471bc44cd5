"""Penalty stiffness of the dynamic Lagrangian method, from the structure's own stiffness along each gap."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.linear import DynamicStiffness

LOSS = 1e-13  # of the largest stiffness, as good as none
LEAST = 5  # harmonics over which the mean is taken: with one alone a resonance would rule it


@dataclass(frozen=True, eq=False)
class Penalty:
    """The penalty ε of each coordinate (n,), N/m, and its derivative by ω."""

    value: FloatArray
    slope: FloatArray


@lru_cache(maxsize=4)
def dynamic_penalty(linear: DynamicStiffness, omega: float, order: int) -> Penalty:
    """Return the geometric mean over the harmonics of ``1 / (h |H(hω)|)``, H being the compliance seen by a force along a coordinate.

    The velocity by τ = ωt has the h-fold amplitude of the displacement: a penalty of that size answers a sliding as the structure answers
    the force that stops it. It does not depend on the coordinates in which the structure is written, and changes smoothly with ω.
    The mean of h itself is taken as (order + 1) / e, to which it tends: logarithms of the order would spoil an extrapolation in it.

    Parameters
    ----------
    linear
        Condensed structure.
    omega
        Frequency, rad/s.
    order
        Highest harmonic of the problem.
    """
    highest = max(order, LEAST)
    part = linear.condensed(omega, highest)
    h = np.arange(1, highest + 1)
    stiffness = part.stiffness[h]
    largest = float(np.max(np.abs(np.diagonal(stiffness, axis1=1, axis2=2))))
    # without damping a harmonic may meet a resonance exactly, where there is no inverse
    inverse = np.linalg.inv(stiffness + 1j * LOSS * largest * np.eye(linear.n))
    compliance = np.diagonal(inverse, axis1=1, axis2=2)
    slope = -np.sum((inverse @ part.derivative[h]) * inverse.swapaxes(1, 2), axis=2)
    value = (highest + 1) / np.e * np.exp(-np.mean(np.log(h[:, None] ** 2 * np.abs(compliance)), axis=0))
    return Penalty(value, -value * np.mean((slope / compliance).real, axis=0))
