"""Unilateral normal spring with two independent Jenkins springs whose limit follows the normal force."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.element import element, element_step, slider_start
from stickslip.contact.law import UNCOUPLED_TANGENTS
from stickslip.contact.laws.quantities import (
    KEEPS_PRELOAD,
    NO_SECOND_TANGENT,
    axial_stiffness,
    check_any_stiffness,
    friction_coefficient,
    normal_stiffness,
    tangential_stiffness,
)
from stickslip.errors import input_error
from stickslip.units import check_quantities, quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class ElasticCoulomb:
    """Node-to-node contact that sticks, slips and lifts off (Gastaldi & Berruti 2017, section 5.1).

    ``N = max(0, preload - k_n g_n)``; each tangential spring is limited to ``mu N`` and is free while the contact is
    open. For a constant limit, set ``k_n = 0`` and a preload; for an initial gap, set ``preload = -k_n gap``.

    Parameters
    ----------
    k_t, k_w
        Tangential contact stiffnesses along t and w, N/m.
    k_n
        Normal contact stiffness, N/m.
    mu
        Friction coefficient.
    preload
        Normal force at zero normal gap, N; negative for a contact with a clearance.
    residual_traction
        None: each tangential spring is unstretched at zero displacement, or at `slider`. A number m in [-1, 1]: the
        tangential force just before t = 0 is ``m mu N`` (the start value of Ferhatoglu & Zucca). It selects one of the
        admissible mean forces of a contact that does not slip.
    slider
        Tangential gaps (t, w) at which the springs are unstretched before t = 0, m, as returned by
        `stickslip.response.frozen_sliders`; None: zero. Not together with a residual traction.

    Raises
    ------
    InputError
        If a parameter is not finite or out of its range.
    """

    k_t: float = tangential_stiffness()
    k_w: float = axial_stiffness(NO_SECOND_TANGENT)
    k_n: float = normal_stiffness(KEEPS_PRELOAD)
    mu: float = friction_coefficient()
    preload: float = 0.0
    residual_traction: float | None = quantity(
        "share of the friction limit that each tangential spring is stretched by before the first period; left out: unstretched at zero displacement",
        default=None,
        least=-1,
        most=1,
    )
    slider: tuple[float, float] | None = None

    kernel = element_step
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_w", "k_n")
        if self.slider is not None and self.residual_traction is not None:
            raise input_error(
                "ElasticCoulomb",
                "has both a slider and a residual traction, and each says where the springs start",
                "Give one of them.",
            )

    def parameters(self) -> FloatArray:
        """Return the (7,) row of the elementary contact."""
        return element(
            k_t=self.k_t,
            k_w=self.k_w,
            k_n=self.k_n,
            mu=self.mu,
            preload=self.preload,
            residual_traction=self.residual_traction,
        )

    def elements(self) -> FloatArray:
        """Return the (1, 7) rows of elementary contacts whose sum is the law."""
        return self.parameters()[None]

    def unstretched(self) -> "ElasticCoulomb":
        """Return the law without a residual traction at rest."""
        return replace(self, residual_traction=None)

    def initial_state(self) -> FloatArray:
        """Return the (2,) slider positions before t = 0, m."""
        return slider_start(self.residual_traction, self.slider)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n of the contact that neither slips nor opens, N/m."""
        return np.array([self.k_t, self.k_w, self.k_n])
