"""Spring with linear and cubic stiffness, as in the Duffing oscillator."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.law import UNCOUPLED_TANGENTS
from stickslip.contact.laws.polynomial_spring import polynomial_step
from stickslip.contact.laws.quantities import (
    axial_stiffness,
    check_any_stiffness,
    normal_stiffness,
    tangential_stiffness,
)
from stickslip.units import check_quantities, quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class CubicSpring:
    """Elastic spring ``force = k g + cubic g³`` along each direction, without memory and without friction.

    Parameters
    ----------
    cubic_t, cubic_w, cubic_n
        Cubic coefficients along t, w and n, N/m³; negative for a spring that softens.
    k_t, k_w, k_n
        Linear stiffnesses along t, w and n, N/m.

    Raises
    ------
    InputError
        If a coefficient is not finite, a linear stiffness is negative, or all are zero.
    """

    cubic_t: float = quantity(
        "cubic coefficient along the tangent t; negative: the spring softens",
        "n_per_m3",
        key="cubic_tangential",
        default=0.0,
        shared=True,
    )
    cubic_w: float = quantity(
        "cubic coefficient along the tangent w; negative: the spring softens",
        "n_per_m3",
        key="cubic_axial",
        default=0.0,
        shared=True,
    )
    cubic_n: float = quantity(
        "cubic coefficient along the normal; negative: the spring softens",
        "n_per_m3",
        key="cubic_normal",
        default=0.0,
        shared=True,
    )
    k_t: float = tangential_stiffness(default=0.0)
    k_w: float = axial_stiffness(default=0.0)
    k_n: float = normal_stiffness(default=0.0)

    kernel = polynomial_step
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "cubic_t", "cubic_w", "cubic_n", "k_t", "k_w", "k_n")

    def parameters(self) -> FloatArray:
        """Return the (9,) coefficients of g, g² and g³ along t, w and n."""
        linear = (self.k_t, self.k_w, self.k_n)
        cubic = (self.cubic_t, self.cubic_w, self.cubic_n)
        return np.array([[k, 0.0, c] for k, c in zip(linear, cubic, strict=True)]).reshape(-1)

    def initial_state(self) -> FloatArray:
        """Return the (0,) state: the spring has no memory."""
        return np.zeros(0)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) linear stiffnesses along t, w, n, N/m."""
        return np.array([self.k_t, self.k_w, self.k_n])

    def restores(self) -> BoolArray:
        """Return the (3,) directions t, w, n along which the force opposes every large displacement."""
        linear, cubic = (
            np.array(v) for v in ((self.k_t, self.k_w, self.k_n), (self.cubic_t, self.cubic_w, self.cubic_n))
        )
        return np.asarray((cubic > 0.0) | ((cubic == 0.0) & (linear > 0.0)))
