"""Smooth hysteresis of Bouc (1967) and Wen (1976)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import UNCOUPLED_TANGENTS, kernel_in
from stickslip.contact.laws.quantities import (
    axial_stiffness,
    check_any_stiffness,
    normal_stiffness,
    tangential_stiffness,
)
from stickslip.errors import input_error
from stickslip.units import check_quantities, quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class BoucWen:
    """Smooth hysteresis ``T = alpha k x + (1 - alpha) k z``, ``dz = (a - (beta sign(z dx) + gamma) |z|ⁿ) dx`` (Wen 1976).

    The law is independent of the rate, and integrated exactly
    over each increment. It acts independently along t and w, with the same shape; along n it is a linear spring in
    tension and compression. The largest z is ``(a / (beta + gamma))^(1/n)``. A tangent counts as slipping where dz/dx
    is below half of a.

    Parameters
    ----------
    k_t
        Stiffness along t, N/m; times ``alpha + (1 - alpha) a`` at rest.
    beta, gamma
        Shape of the loop, m⁻ⁿ; ``beta > 0`` and ``-beta < gamma <= beta``, otherwise the law would generate energy.
    alpha
        Share of the stiffness that remains when z no longer grows, 0 to 1.
    a
        dz/dx at z = 0.
    exponent
        n, at least 1: sharpness of the knee; integrated to 1e-7 of the largest z up to 10.
    k_w
        Stiffness along w, N/m.
    k_n
        Stiffness of the linear normal spring, N/m.

    Raises
    ------
    InputError
        If a parameter is not finite or out of its range.
    """

    k_t: float = tangential_stiffness()
    beta: float = quantity("shape of the loop β, m to the power of minus the exponent", above=0)
    gamma: float = quantity("shape of the loop γ, above -β and at most β")
    alpha: float = quantity("share of the stiffness left at the largest force", default=0.0, least=0, most=1)
    a: float = quantity("slope of the hysteretic part at zero force", default=1.0, above=0)
    exponent: float = quantity("sharpness of the knee", default=1.0, least=1, most=20)
    k_w: float = axial_stiffness(default=0.0)
    k_n: float = normal_stiffness(default=0.0)

    kernel = kernel_in("bouc_wen")
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_w", "k_n")
        if not -self.beta < self.gamma <= self.beta:
            raise input_error(
                "BoucWen.gamma",
                f"must be above -beta and at most beta = {self.beta}, got {self.gamma}",
                "Outside, the law grows without limit or gives energy.",
            )

    @property
    def limit(self) -> float:
        """Largest force of the hysteretic part along t, N."""
        return (1.0 - self.alpha) * self.k_t * self._largest

    @property
    def _largest(self) -> float:
        return float((self.a / (self.beta + self.gamma)) ** (1.0 / self.exponent))

    def parameters(self) -> FloatArray:
        """Return the (8,) k_t, k_w, alpha, largest z, a, exponent, (beta - gamma) / (beta + gamma) and k_n."""
        ratio = (self.beta - self.gamma) / (self.beta + self.gamma)
        shape = (self.alpha, self._largest, self.a, self.exponent, ratio)
        return np.array([self.k_t, self.k_w, *shape, self.k_n])

    def initial_state(self) -> FloatArray:
        """Return the (4,) displacement and share of the largest z, for t and for w, before t = 0: all zero."""
        return np.zeros(4)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n at rest, N/m."""
        share = self.alpha + (1.0 - self.alpha) * self.a
        return np.array([share * self.k_t, share * self.k_w, self.k_n])
