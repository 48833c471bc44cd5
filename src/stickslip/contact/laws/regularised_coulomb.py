"""Coulomb friction smoothed over the velocity."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import OPEN, SLIP, STICK, UNCOUPLED_TANGENTS, law_kernel
from stickslip.contact.laws.quantities import friction_coefficient, normal_stiffness
from stickslip.units import check_quantities, quantity


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Evaluate friction along the velocity of each tangent; there is no state."""
    k_n, mu, preload, transition = parameters
    pressure = preload - k_n * displacement[2]
    if pressure < 0.0:
        status[:] = OPEN
        force[:] = 0.0
        return
    force[2] = -pressure
    jac[2, 2] = k_n
    for d in range(2):
        share = np.tanh(velocity[d] / transition)
        force[d] = mu * pressure * share
        jac[d, 2] = -mu * k_n * share
        jac[d, 3 + d] = mu * pressure * (1.0 - share * share) / transition
        status[d] = SLIP if abs(velocity[d]) > transition else STICK


@dataclass(frozen=True, slots=True, kw_only=True)
class RegularisedCoulomb:
    """Coulomb friction without sticking: ``T = mu N tanh(v / transition_velocity)``, ``N = max(0, preload - k_n g_n)``.

    The law acts independently along t and w. There is no tangential stiffness, and the contact creeps under a constant
    force. A tangent counts as sticking below the transition velocity.

    Parameters
    ----------
    mu
        Friction coefficient.
    transition_velocity
        Velocity at which the friction force is 76 % of its limit, m/s; small compared with the velocities of the
        vibration.
    k_n
        Normal contact stiffness, N/m; zero for a constant normal force.
    preload
        Normal force at zero normal gap, N; negative for a contact with a clearance.

    Raises
    ------
    InputError
        If a parameter is not finite or out of its range.
    """

    mu: float = friction_coefficient()
    transition_velocity: float = quantity(
        "velocity at which friction has reached 76 % of its limit", "m_per_s", above=0
    )
    k_n: float = normal_stiffness(default=0.0)
    preload: float = 0.0

    kernel = law_kernel(_step)
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)

    def parameters(self) -> FloatArray:
        """Return the (4,) k_n, mu, preload and transition velocity."""
        return np.array([self.k_n, self.mu, self.preload, self.transition_velocity])

    def initial_state(self) -> FloatArray:
        """Return the (0,) state: the force follows from the velocity alone."""
        return np.zeros(0)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n of the closed contact, N/m; friction has no stiffness."""
        return np.array([0.0, 0.0, self.k_n])
