"""Elastic springs with a polynomial characteristic."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.law import STICK, UNCOUPLED_TANGENTS, law_kernel
from stickslip.errors import input_error
from stickslip.units import check_quantities, quantity


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Evaluate three polynomials without constant terms and their slopes by Horner's scheme."""
    degree = parameters.size // 3
    for d in range(3):
        x = displacement[d]
        value = 0.0
        slope = 0.0
        for power in range(degree, 0, -1):
            slope = slope * x + power * parameters[d * degree + power - 1]
            value = (value + parameters[d * degree + power - 1]) * x
        force[d] = value
        jac[d, d] = slope
    status[:] = STICK


polynomial_step = law_kernel(_step)


@dataclass(frozen=True, slots=True, kw_only=True)
class PolynomialSpring:
    """Elastic spring ``force = c_1 g + c_2 g² + c_3 g³ + …`` along each direction, without memory and without friction.

    The normal force has the same sign convention: it acts against a growing gap. Even powers are allowed.

    Parameters
    ----------
    along_t, along_w, along_n
        Coefficients c_1, c_2, … of each direction in N/m, N/m², …; none for a direction without force.

    Raises
    ------
    InputError
        If a coefficient is not finite, or all are zero.
    """

    along_t: tuple[float, ...] = quantity(
        "coefficients [c_1, c_2, ...] along the tangent t in N/m, N/m², ..., of a square metre with per = area",
        default=(),
        shared=True,
    )
    along_w: tuple[float, ...] = quantity(
        "coefficients [c_1, c_2, ...] along the tangent w in N/m, N/m², ..., of a square metre with per = area",
        default=(),
        shared=True,
    )
    along_n: tuple[float, ...] = quantity(
        "coefficients [c_1, c_2, ...] along the normal in N/m, N/m², ..., of a square metre with per = area",
        default=(),
        shared=True,
    )

    kernel = polynomial_step
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        if not any(c for c in (*self.along_t, *self.along_w, *self.along_n)):
            raise input_error(
                "PolynomialSpring", "all coefficients are zero", "Give at least one, or remove the contact."
            )

    def parameters(self) -> FloatArray:
        """Return the (3 degree,) coefficients along t, w and n, each padded with zeros to the highest degree."""
        directions = (self.along_t, self.along_w, self.along_n)
        degree = max(len(c) for c in directions)
        out = np.zeros((3, degree))
        for row, coefficients in zip(out, directions, strict=True):
            row[: len(coefficients)] = coefficients
        return out.reshape(-1)

    def initial_state(self) -> FloatArray:
        """Return the (0,) state: the spring has no memory."""
        return np.zeros(0)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses at zero displacement, N/m."""
        return np.array([c[0] if c else 0.0 for c in (self.along_t, self.along_w, self.along_n)])

    def restores(self) -> BoolArray:
        """Return the (3,) directions t, w, n along which the force opposes every large displacement.

        There the highest power is odd, and its coefficient positive.
        """
        last = [np.flatnonzero(c) for c in (self.along_t, self.along_w, self.along_n)]
        each = zip(last, (self.along_t, self.along_w, self.along_n), strict=True)
        return np.array([bool(k.size and k[-1] % 2 == 0 and c[k[-1]] > 0.0) for k, c in each])
