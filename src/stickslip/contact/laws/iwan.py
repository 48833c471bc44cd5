"""Iwan's parallel-series element: many Jenkins elements in parallel, with published populations of sliders.

The stiffness density of sliders with break-free distance φ is ρ(φ) (Segalman 2005, eq. 5). Each cell of the density
becomes one slider with the stiffness ``∫ρ dφ`` and the limit ``∫ρ φ dφ`` of the cell, so that total stiffness and limit
are exact for any number of sliders.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.element import ROUND_OFF, element
from stickslip.contact.law import SLIP, STICK, UNCOUPLED_TANGENTS, law_kernel
from stickslip.contact.laws.quantities import (
    axial_stiffness,
    check_any_stiffness,
    normal_stiffness,
    slip_limit,
    tangential_stiffness,
)
from stickslip.errors import input_error
from stickslip.units import check_quantities, quantity


class Population(Protocol):
    """Protocol of a population of sliders."""

    def sliders(self) -> FloatArray:
        """Return (2, n) shares of the stiffness, with sum 1, and of the limit.

        Finite shares of the limit have sum 1.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class UniformBand:
    """Break-free distances spread evenly over a band about their mean (Iwan 1966).

    An elastic spring may act in parallel (Song et al. 2004).

    Parameters
    ----------
    n_sliders
        Number of sliders, without the elastic spring.
    half_width
        Half-width of the band over the mean distance, above 0 and at most 1; 1: the band begins at zero.
    elastic_share
        Share of the stiffness that never slips, from 0 to below 1; the limit does not include this spring.

    Raises
    ------
    InputError
        If a parameter is out of its range.
    """

    n_sliders: int = quantity("number of sliders", key="sliders", default=20, least=1, usual=1000)
    half_width: float = quantity("half of the band over the mean distance", default=1.0, above=0, most=1)
    elastic_share: float = quantity("share of the stiffness that never slips", default=0.0, least=0, below=1)

    def __post_init__(self) -> None:
        check_quantities(self)

    def sliders(self) -> FloatArray:
        """Return (2, n) shares of stiffness and limit."""
        middle = (2.0 * np.arange(self.n_sliders) + 1.0) / self.n_sliders - 1.0
        shares = np.full((2, self.n_sliders), 1.0 / self.n_sliders)
        shares[1] *= 1.0 + self.half_width * middle
        if self.elastic_share == 0.0:
            return shares
        shares[0] *= 1.0 - self.elastic_share
        return np.hstack([shares, [[self.elastic_share], [np.inf]]])


@dataclass(frozen=True, slots=True, kw_only=True)
class FourParameter:
    """Segalman's population (2005): ``ρ = R φ^chi`` up to φ_max and a group of sliders that all break free at φ_max.

    The other two of the four parameters are stiffness and limit of the element.

    Parameters
    ----------
    chi
        Exponent, above -1 and at most 0: energy dissipated in micro-slip grows with the power 3 + chi of the amplitude.
    beta
        Stiffness of the sliders at φ_max over the stiffness of all others, not negative.
    n_sliders
        Number of sliders below φ_max, in cells that grow geometrically from φ_max / 1000.

    Raises
    ------
    InputError
        If a parameter is out of its range.
    """

    chi: float = quantity("exponent of the distribution", above=-1, most=0)
    beta: float = quantity("stiffness of the last sliders over the stiffness of all others", least=0)
    n_sliders: int = quantity("number of sliders", key="sliders", default=20, least=1, usual=1000)

    def __post_init__(self) -> None:
        check_quantities(self)

    def sliders(self) -> FloatArray:
        """Return (2, n) shares of stiffness and limit."""
        edges = np.concatenate([[0.0], np.geomspace(1e-3, 1.0, self.n_sliders)])
        stiffness = np.diff(edges ** (self.chi + 1.0))
        limit = np.diff(edges ** (self.chi + 2.0)) * (self.chi + 1.0) / (self.chi + 2.0)
        if self.beta > 0.0:
            stiffness, limit = np.append(stiffness, self.beta), np.append(limit, self.beta)
        return np.array([stiffness / np.sum(stiffness), limit / np.sum(limit)])


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstLoading:
    """Sliders that reproduce a first-loading curve, slipping one by one at its corners (Segalman & Starr 2008).

    The curve begins at the origin; at its end all sliders slip, and the force stays constant. Only its shape matters,
    because the element scales it to its own stiffness and limit.

    Parameters
    ----------
    displacement, force
        Corners of the curve after the origin, in any units; slopes must decrease.

    Raises
    ------
    InputError
        If the corners do not form such a curve.
    """

    displacement: tuple[float, ...] = quantity("displacements of the corners after the origin")
    force: tuple[float, ...] = quantity("forces of the corners after the origin")

    def __post_init__(self) -> None:
        x, f = self.displacement, self.force
        if len(x) != len(f) or len(x) < 2 or not np.all(np.isfinite([*x, *f])):
            raise input_error(
                "FirstLoading",
                f"got {len(x)} displacements and {len(f)} forces",
                "Give two corners or more, with finite numbers.",
            )
        if np.any(np.diff([0.0, *x]) <= 0.0):
            raise input_error("FirstLoading.displacement", f"must rise from above zero, got {x}", "Sort it.")
        slopes = self._slopes()
        if slopes[-1] < 0.0 or np.any(np.diff(slopes) >= 0.0):
            raise input_error(
                "FirstLoading.force",
                f"must rise ever more slowly, got the slopes {slopes}",
                "Leave corners out that lie on a line with their neighbours or below it.",
            )

    def _slopes(self) -> FloatArray:
        """Return the slopes of the curve between its corners."""
        force, displacement = np.array([0.0, *self.force]), np.array([0.0, *self.displacement])
        return np.asarray(np.diff(force) / np.diff(displacement))

    def sliders(self) -> FloatArray:
        """Return (2, n) shares of stiffness and limit."""
        stiffness = -np.diff([*self._slopes(), 0.0])
        limit = stiffness * np.asarray(self.displacement)
        slips = stiffness > 0.0
        return np.array([stiffness / np.sum(stiffness), limit / np.sum(limit)])[:, slips]


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Advance all sliders along t, then along w; their positions are the state."""
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
            # x - s of a slider at rest on its limit is off by rounding
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

    The law acts independently along t and w, with the same limits; along n it is a linear spring in tension and
    compression. A tangent counts as slipping if at least one slider slips.

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
        Distribution of stiffness and limit among the sliders: `UniformBand`, `FourParameter` or `FirstLoading`.

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
        """Return the (n,) limits of the sliders; elastic springs have an infinite limit."""
        shares = self.population.sliders()[1]
        return np.array([share if np.isinf(share) else share * self.limit for share in shares])

    def parameters(self) -> FloatArray:
        """Return the (3 n + 1,) stiffnesses of the sliders along t, along w, their limits, and k_n."""
        shares = self.population.sliders()[0]
        return np.concatenate([self.k_t * shares, self.k_w * shares, self._limits(), [self.k_n]])

    def elements(self) -> FloatArray:
        """Return the (n, 7) rows of elementary contacts whose sum is the law."""
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
