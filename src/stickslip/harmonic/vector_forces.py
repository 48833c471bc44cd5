"""Forces of a condensed structure on one motion, where the interior's modes diagonalise its damping: products with vectors, and no matrix is formed.

A corrector whose frequency changes at every step needs the residual of each trial, and the condensed matrices only of those that are accepted.
"""

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.dynamic_stiffness import CondensedStiffness
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.spectral import Blocks


def known_by_vectors(linear: DynamicStiffness) -> CondensedStiffness | None:
    """Return a condensed structure whose interior is diagonal, without structural damping and Coriolis forces; None if it is none."""
    if isinstance(linear, CondensedStiffness) and linear.diagonal and linear.loss is None:
        return linear if linear.ln is None else None
    return None


def linear_force(linear: CondensedStiffness, omega: float, q: ComplexArray) -> ComplexArray:
    """Return ``Z q - F``, (H+1, n), of a motion (H+1, n) at `omega` (rad/s)."""
    s = _frequencies(omega, q)
    near, far = linear.modal_loads(len(q) - 1)
    moved = (far - _forward(linear.nl, s, q)) / _own(linear, s)
    return _forward(linear.nn, s, q) + _back(linear.nl, s, moved) - near


def mass_damping_slope(linear: CondensedStiffness, omega: float, q: ComplexArray) -> ComplexArray:
    """Return the derivative of ``Z q``, (H+1, n), by the rate (1/s) of a damping in proportion to the mass."""
    s = _frequencies(omega, q)
    own = _own(linear, s)
    moved = -_forward(linear.nl, s, q) / own
    across, inner = linear.nl[2], np.diagonal(linear.ll[2])
    pulled = 1j * s * (q @ across + moved * inner)
    direct = 1j * s * (q @ linear.nn[2].T + moved @ across.T)
    return np.asarray(direct - _back(linear.nl, s, pulled / own))


def _frequencies(omega: float, q: ComplexArray) -> FloatArray:
    return omega * np.arange(len(q))[:, None]


def _own(linear: CondensedStiffness, s: FloatArray) -> ComplexArray:
    k, c, m = (np.diagonal(block) for block in linear.ll)
    return np.asarray(k + 1j * s * c - s**2 * m)


def _forward(blocks: Blocks, s: FloatArray, q: ComplexArray) -> ComplexArray:
    """Return the force of retained coordinates on those of the columns."""
    k, c, m = blocks
    return np.asarray(q @ k + 1j * s * (q @ c) - s**2 * (q @ m))


def _back(blocks: Blocks, s: FloatArray, q: ComplexArray) -> ComplexArray:
    """Return the force of the interior on the retained coordinates."""
    k, c, m = blocks
    return np.asarray(q @ k.T + 1j * s * (q @ c.T) - s**2 * (q @ m.T))
