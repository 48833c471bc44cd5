"""Jenkins element: a spring in series with a slider of constant limit."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.element import element, element_step, slider_start
from stickslip.contact.law import UNCOUPLED_TANGENTS
from stickslip.contact.laws.quantities import (
    axial_stiffness,
    check_any_stiffness,
    normal_stiffness,
    slip_limit,
    tangential_stiffness,
)
from stickslip.units import check_quantities


@dataclass(frozen=True, slots=True, kw_only=True)
class Jenkins:
    """Elastic, perfectly plastic friction: ``dT = k dg`` while ``|T| <= limit`` (Griffin 1980).

    The law acts independently along t and w, with the same limit; along n it is a linear spring in tension and
    compression.

    Parameters
    ----------
    k_t
        Stiffness along t, N/m.
    limit
        Friction force at which the slider moves, N.
    k_w
        Stiffness along w, N/m.
    k_n
        Stiffness of the linear normal spring, N/m.
    slider
        Tangential gaps (t, w) at which the springs are unstretched before t = 0, m; None: zero.

    Raises
    ------
    InputError
        If a parameter is negative or not finite, or all stiffnesses are zero.
    """

    k_t: float = tangential_stiffness()
    limit: float = slip_limit()
    k_w: float = axial_stiffness(default=0.0)
    k_n: float = normal_stiffness(default=0.0)
    slider: tuple[float, float] | None = None

    kernel = element_step
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_w", "k_n")

    def parameters(self) -> FloatArray:
        """Return the (7,) row of an elementary contact with constant limit."""
        return element(k_t=self.k_t, k_w=self.k_w, k_n=self.k_n, mu=1.0, preload=self.limit, unilateral=False)

    def elements(self) -> FloatArray:
        """Return the (1, 7) rows of elementary contacts whose sum is the law."""
        return self.parameters()[None]

    def initial_state(self) -> FloatArray:
        """Return the (2,) slider positions before t = 0, m."""
        return slider_start(None, self.slider)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n of the contact that does not slip, N/m."""
        return np.array([self.k_t, self.k_w, self.k_n])
