"""Friction that approaches its limit exponentially (Dahl 1968)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import SLIP, STICK, UNCOUPLED_TANGENTS, law_kernel
from stickslip.contact.laws.quantities import (
    axial_stiffness,
    check_any_stiffness,
    normal_stiffness,
    slip_limit,
    tangential_stiffness,
)
from stickslip.units import check_quantities


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Integrate ``dT = k (1 - sign(dx) T / limit) dx`` exactly; the state is displacement and force of t, then of w."""
    limit = parameters[2]
    for d in range(2):
        k, x, before, held = parameters[d], displacement[d], state[2 * d], state[2 * d + 1]
        move = x - before
        toward = limit * np.sign(move)
        left = np.exp(-k * abs(move) / limit)  # share of the distance to the limit that remains
        force[d] = held - (toward - held) * np.expm1(-k * abs(move) / limit)
        slope = k * left * (1.0 - held * np.sign(move) / limit)
        new_state[2 * d] = x
        new_state[2 * d + 1] = force[d]
        jac[3 + 2 * d, d] = 1.0
        for row in (d, 4 + 2 * d):
            jac[row, d] = slope
            jac[row, 6 + 2 * d] = -slope
            jac[row, 7 + 2 * d] = left
        status[d] = SLIP if slope < 0.5 * k else STICK
    force[2] = parameters[3] * displacement[2]
    jac[2, 2] = parameters[3]


@dataclass(frozen=True, slots=True, kw_only=True)
class Dahl:
    """Friction whose stiffness falls as its force nears the limit: ``dT/dx = k (1 - sign(dx) T / limit)`` (Dahl 1968, exponent 1).

    The law is independent of the rate. It acts independently along t and w, with the same limit; along n it is a linear
    spring in tension and compression. A tangent counts as slipping where its stiffness is below half of its initial
    value. A nonzero mean force relaxes over many cycles, however small they are, so that the mean of the periodic force
    is zero.

    Parameters
    ----------
    k_t
        Stiffness along t at zero force, N/m.
    limit
        Limit that the friction force approaches, N.
    k_w
        Stiffness along w at zero force, N/m.
    k_n
        Stiffness of the linear normal spring, N/m.

    Raises
    ------
    InputError
        If a parameter is not finite or out of its range.
    """

    k_t: float = tangential_stiffness()
    limit: float = slip_limit(least=None, above=0)
    k_w: float = axial_stiffness(default=0.0)
    k_n: float = normal_stiffness(default=0.0)

    kernel = law_kernel(_step)
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_w", "k_n")

    def parameters(self) -> FloatArray:
        """Return the (4,) k_t, k_w, limit and k_n."""
        return np.array([self.k_t, self.k_w, self.limit, self.k_n])

    def initial_state(self) -> FloatArray:
        """Return the (4,) displacement and force along t and along w before t = 0: no force at zero displacement."""
        return np.zeros(4)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n at zero force, N/m."""
        return np.array([self.k_t, self.k_w, self.k_n])
