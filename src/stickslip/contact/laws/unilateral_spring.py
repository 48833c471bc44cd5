"""Normal spring that pushes and cannot pull, without friction."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.element import element, element_step, slider_start
from stickslip.contact.law import UNCOUPLED_TANGENTS
from stickslip.contact.laws.quantities import check_not_negative, normal_stiffness
from stickslip.errors import input_error
from stickslip.units import check_quantities


@dataclass(frozen=True, slots=True, kw_only=True)
class UnilateralSpring:
    """Penalty spring along the normal, ``N = max(0, preload - k_n (g_n + initial_gap))``; no force along t and w.

    Parameters
    ----------
    k_n
        Normal contact stiffness, N/m.
    preload
        Normal force at zero normal gap, N.
    initial_gap
        Clearance at zero normal gap, m; not together with a preload.

    Raises
    ------
    InputError
        If a parameter is out of its range, or both a preload and an initial gap are given.
    """

    k_n: float = normal_stiffness(least=None, above=0)
    preload: float = 0.0
    initial_gap: float = 0.0

    kernel = element_step
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_not_negative(self, "preload", "initial_gap")
        if self.preload > 0.0 and self.initial_gap > 0.0:
            raise input_error(
                "UnilateralSpring",
                f"has a preload of {self.preload} N and an initial gap of {self.initial_gap} m",
                "A contact at rest is either pressed or open: give one of them.",
            )

    def at_rest(self, preload: float, gap: float) -> "UnilateralSpring":
        """Return the law with a further normal force (N) and clearance (m).

        Their sum is a preload if the contact is pressed, else a clearance.
        """
        preload, gap = self.preload + preload, self.initial_gap + gap
        clearance = gap - preload / self.k_n
        if clearance > 0.0:
            return replace(self, preload=0.0, initial_gap=clearance)
        return replace(self, preload=max(preload - self.k_n * gap, 0.0), initial_gap=0.0)

    def parameters(self) -> FloatArray:
        """Return the (7,) row of an elementary contact without tangential springs."""
        return element(k_n=self.k_n, preload=self.preload - self.k_n * self.initial_gap)

    def elements(self) -> FloatArray:
        """Return the (1, 7) rows of elementary contacts whose sum is the law."""
        return self.parameters()[None]

    def initial_state(self) -> FloatArray:
        """Return the (2,) slider positions before t = 0, which this law does not use."""
        return slider_start(None)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses along t, w, n of the closed contact, N/m."""
        return np.array([0.0, 0.0, self.k_n])
