"""Springs that neither slip nor open."""

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
    tangential_stiffness,
)
from stickslip.units import check_quantities


@dataclass(frozen=True, slots=True, kw_only=True)
class Bonded:
    """Contact that never slips or opens: a linear spring along each direction, in tension and compression.

    Parameters
    ----------
    k_t, k_w, k_n
        Contact stiffnesses along t, w and n, N/m.

    Raises
    ------
    InputError
        If a stiffness is negative or not finite, or all are zero.
    """

    k_t: float = tangential_stiffness()
    k_w: float = axial_stiffness()
    k_n: float = normal_stiffness()

    kernel = element_step
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_w", "k_n")

    def parameters(self) -> FloatArray:
        """Return the (7,) row of an elementary contact whose friction limit is infinite."""
        return element(k_t=self.k_t, k_w=self.k_w, k_n=self.k_n, mu=1.0, preload=np.inf, unilateral=False)

    def elements(self) -> FloatArray:
        """Return the (1, 7) rows of elementary contacts whose sum is the law."""
        return self.parameters()[None]

    def initial_state(self) -> FloatArray:
        """Return the (2,) slider positions before t = 0, m; they never move."""
        return slider_start(None)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses along t, w, n, N/m."""
        return np.array([self.k_t, self.k_w, self.k_n])
