"""Unilateral normal spring with a planar friction spring, whose force is limited as a vector."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import COUPLED_TANGENTS, kernel_in
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.quantities import KEEPS_PRELOAD, check_any_stiffness, friction_coefficient, normal_stiffness
from stickslip.units import check_quantities, quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class CoupledCoulomb:
    """Contact that sticks, slips in any direction of its plane and lifts off.

    ``N = max(0, preload - k_n g_n)`` as in `ElasticCoulomb`, but with one spring in the plane, whose force is limited
    as a vector: ``T_t² + T_w² <= (mu N)²``. During slip, the slider moves along the force. With one stiffness the law
    does not depend on the orientation of t and w in the plane.

    A step assumes that displacement and normal force change linearly from the previous step. It follows stick up to the
    limit, slip along it, opening and closing within the step.

    Parameters
    ----------
    k_t
        Contact stiffness along every direction of the contact plane or, with `k_w`, along t, N/m.
    k_n
        Normal contact stiffness, N/m.
    mu
        Friction coefficient.
    preload
        Normal force at zero normal gap, N; negative for a contact with a clearance. With ``k_n = 0`` the normal force
        is constant.
    k_w
        Contact stiffness along w, N/m; None: as along t.
    slider
        Tangential gaps (t, w) at which the spring is unstretched before t = 0, m, as returned by
        `stickslip.response.frozen_sliders`; None: zero.

    Raises
    ------
    InputError
        If a parameter is not finite or out of its range.
    """

    k_t: float = quantity(
        "stiffness in every direction of the contact plane or, with axial_stiffness, along the tangent t",
        "n_per_m",
        key="tangential_stiffness",
        least=0,
        shared=True,
    )
    k_n: float = normal_stiffness(KEEPS_PRELOAD)
    mu: float = friction_coefficient()
    preload: float = 0.0
    k_w: float | None = quantity(
        "stiffness along the tangent w; left out: as along t",
        "n_per_m",
        key="axial_stiffness",
        default=None,
        least=0,
        shared=True,
    )
    slider: tuple[float, float] | None = None

    kernel = kernel_in("coupled_coulomb")
    pairs: ClassVar[int] = COUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_w", "k_n")

    @property
    def _along_w(self) -> float:
        return self.k_t if self.k_w is None else self.k_w

    def parameters(self) -> FloatArray:
        """Return the (5,) k_t, k_w, k_n, mu and preload."""
        return np.array([self.k_t, self._along_w, self.k_n, self.mu, self.preload])

    def normal_contact(self) -> ElasticCoulomb | None:
        """Return the normal contact without friction; None if the normal force is constant."""
        if self.k_n <= 0.0:
            return None
        return ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=self.k_n, mu=0.0, preload=self.preload)

    def planar(self) -> FloatArray | None:
        """Return the (4,) k_t, k_n, mu and preload of an isotropic contact; None with two stiffnesses.

        See `contact.law.PlanarFriction`.
        """
        if self._along_w != self.k_t:
            return None
        return np.array([self.k_t, self.k_n, self.mu, self.preload])

    def initial_state(self) -> FloatArray:
        """Return the (5,) slider position, displacement (m) and normal force (N) before t = 0.

        The spring is unstretched there, and the normal force grows from zero until t = 0.
        """
        at = (0.0, 0.0) if self.slider is None else self.slider
        return np.array([*at, *at, 0.0])

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n of the contact that neither slips nor opens, N/m."""
        return np.array([self.k_t, self._along_w, self.k_n])
