"""Iwan's parallel-series element: many Jenkins elements side by side."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.element import ROUND_OFF, element
from stickslip.contact.law import SLIP, STICK, UNCOUPLED_TANGENTS, law_kernel
from stickslip.contact.laws.iwan_populations import Population, UniformBand
from stickslip.contact.laws.parameter_checks import check_any_stiffness
from stickslip.contact.laws.quantities import axial_stiffness, normal_stiffness, slip_limit, tangential_stiffness
from stickslip.units import check_quantities


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Advance all sliders of t, then of w, whose positions are the state."""
    n = state.size // 2
    for d in range(2):
        x, slipping = displacement[d], 0
        force[d] = 0.0
        for i in range(n):
            k, limit, row = parameters[d * n + i], parameters[2 * n + i], d * n + i
            if k == 0.0:
                new_state[row] = x
                jac[3 + row, d] = 1.0
                continue
            trial = k * (x - state[row])
            # x - s of a slider that rests at its limit is off by rounding
            if abs(trial) <= limit + ROUND_OFF * k * (abs(x) + abs(state[row])):
                new_state[row] = state[row]
                force[d] += trial
                jac[d, d] += k
                jac[d, 6 + row] = -k
                jac[3 + row, 6 + row] = 1.0
                continue
            slipping += 1
            held = limit if trial > 0.0 else -limit
            new_state[row] = x - held / k
            force[d] += held
            jac[3 + row, d] = 1.0
        status[d] = SLIP if slipping > 0 else STICK
    force[2] = parameters[3 * n] * displacement[2]
    jac[2, 2] = parameters[3 * n]


@dataclass(frozen=True, slots=True, kw_only=True)
class Iwan:
    """Jenkins elements in parallel that slip one after the other: micro-slip (Iwan 1966).

    Acts along t and w, each for itself and with the same limits; along n stands a linear spring that also pulls. A tangent
    is said to slip where at least one slider does.

    Parameters
    ----------
    k_t
        Stiffness of all sliders together along t, N/m.
    limit
        Friction force at which all have slipped, N.
    k_w
        Stiffness of all sliders together along w, N/m.
    k_n
        Stiffness of the linear normal spring, N/m.
    population
        How stiffness and limit are shared among the sliders: `UniformBand`, `FourParameter` or `FirstLoading`.

    Raises
    ------
    InputError
        If a parameter is negative or not finite, or all stiffnesses are zero.
    """

    k_t: float = tangential_stiffness()
    limit: float = slip_limit()
    k_w: float = axial_stiffness(default=0.0)
    k_n: float = normal_stiffness(default=0.0)
    population: Population = field(default_factory=UniformBand)

    kernel = law_kernel(_step)
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_w", "k_n")

    def _limits(self) -> FloatArray:
        """Return the (n,) limits of the sliders; those of elastic springs are infinite."""
        shares = self.population.sliders()[1]
        return np.array([share if np.isinf(share) else share * self.limit for share in shares])

    def parameters(self) -> FloatArray:
        """Return the (3 n + 1,) stiffnesses of the sliders along t, along w, their limits, and k_n."""
        shares = self.population.sliders()[0]
        return np.concatenate([self.k_t * shares, self.k_w * shares, self._limits(), [self.k_n]])

    def elements(self) -> FloatArray:
        """Return the (n, 7) rows of elementary contacts that the law is the sum of."""
        shares = self.population.sliders()[0]
        rows = [
            element(
                k_t=self.k_t * k,
                k_w=self.k_w * k,
                k_n=self.k_n if i == 0 else 0.0,
                mu=1.0,
                preload=limit,
                unilateral=False,
            )
            for i, (k, limit) in enumerate(zip(shares, self._limits(), strict=True))
        ]
        return np.array(rows)

    def initial_state(self) -> FloatArray:
        """Return the (2 n,) slider positions before t = 0, m: springs unstretched at zero displacement."""
        return np.zeros(2 * self.population.sliders().shape[1])

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n of the contact that does not slip, N/m."""
        return np.array([self.k_t, self.k_w, self.k_n])
