"""Unilateral normal spring with a planar friction spring: the vector of the friction forces is limited."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import COUPLED_TANGENTS, OPEN, SLIP, STICK, law_kernel
from stickslip.contact.laws.parameter_checks import check_any_stiffness
from stickslip.contact.laws.quantities import friction_coefficient, normal_stiffness
from stickslip.units import check_quantities, quantity


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Return the trial force to the Coulomb disc along its radius; the state is the position of the slider in the plane."""
    k, k_n, mu, preload = parameters
    pressure = preload - k_n * displacement[2]
    if pressure < 0.0:
        status[:] = OPEN
        force[:] = 0.0
        for d in range(2):
            new_state[d] = displacement[d]
            jac[3 + d, d] = 1.0
        return
    force[2] = -pressure
    jac[2, 2] = k_n
    limit = mu * pressure
    trial_t = k * (displacement[0] - state[0])
    trial_w = k * (displacement[1] - state[1])
    size = np.hypot(trial_t, trial_w)
    if size <= limit:
        status[:] = STICK
        force[0], force[1] = trial_t, trial_w
        for d in range(2):
            new_state[d] = state[d]
            jac[d, d] = k
            jac[d, 6 + d] = -k
            jac[3 + d, 6 + d] = 1.0
        return
    status[:] = SLIP
    direction = (trial_t / size, trial_w / size)
    share = limit / size  # of the stiffness left across the direction of slip
    for a in range(2):
        force[a] = limit * direction[a]
        new_state[a] = displacement[a] - force[a] / k
        jac[a, 2] = -mu * k_n * direction[a]
        jac[3 + a, 2] = mu * k_n / k * direction[a]
        for b in range(2):
            across = share * ((1.0 if a == b else 0.0) - direction[a] * direction[b])
            jac[a, b] = k * across
            jac[a, 6 + b] = -k * across
            jac[3 + a, b] = (1.0 if a == b else 0.0) - across
            jac[3 + a, 6 + b] = across


@dataclass(frozen=True, slots=True, kw_only=True)
class CoupledCoulomb:
    """Contact that sticks, slips in any direction of its plane and lifts off.

    ``N = max(0, preload - k_n g_n)`` as of `ElasticCoulomb`, but one spring of the same stiffness in every direction of the
    plane, whose force is limited as a vector: ``T_t² + T_w² <= (mu N)²``. Over a step the slider moves along the radius of the disc
    (radial return, the implicit form of Coulomb's rule that slip is opposed by the force). Does not depend on the
    orientation of t and w in the plane.

    Parameters
    ----------
    k_t
        Contact stiffness along every direction of the contact plane, N/m.
    k_n
        Normal contact stiffness, N/m.
    mu
        Friction coefficient.
    preload
        Normal force at zero normal gap, N; negative for a contact with a clearance. With ``k_n = 0`` the normal force is constant.

    Raises
    ------
    InputError
        If a parameter is not finite or out of its range.
    """

    k_t: float = quantity(
        "stiffness in every direction of the contact plane",
        "n_per_m",
        key="tangential_stiffness",
        least=0,
        shared=True,
    )
    k_n: float = normal_stiffness()
    mu: float = friction_coefficient()
    preload: float = 0.0

    kernel: ClassVar[Any] = law_kernel(_step)
    pairs: ClassVar[int] = COUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_n")

    def parameters(self) -> FloatArray:
        """Return the (4,) k_t, k_n, mu and preload."""
        return np.array([self.k_t, self.k_n, self.mu, self.preload])

    def initial_state(self) -> FloatArray:
        """Return the (2,) position of the slider before t = 0, m: the spring is unstretched at zero displacement."""
        return np.zeros(2)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n of the contact that neither slips nor opens, N/m."""
        return np.array([self.k_t, self.k_t, self.k_n])
