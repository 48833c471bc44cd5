"""Periodic motion as a function of the slider positions, and the gradient of an amplitude.

The sliders s enter through the gaps only, ``r(x, s) = Z x + Bᵀ T(B x - s) - F``, so that ``∂r/∂s`` is minus the column
of the contact derivatives for the mean gap. One adjoint system gives the gradient by all starts, ``dA/ds = -(∂r/∂s)ᵀ
J⁻ᵀ ∂A/∂x``. Springs that slip, open, or were dragged to their position have forgotten their start: their column is
zero.

The admissible slider positions of a planar contact are the intersection of the discs of all instants: in units of force
the slider is at ``z = K s``, and rests while ``|K x(t) - z| <= μN(t)``.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.initial_sliders import Starts
from stickslip.contact.law import PAIRS
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.judging import covers, judging_balance
from stickslip.harmonic.peak import Driven
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.harmonic.selection.strategy import ErrorMeasure
from stickslip.solve.krylov import to_tolerance
from stickslip.solve.linear import factorised
from stickslip.solve.newton_method import Newton, newton

ALERT_TOLERANCE = 1e-6  # relative residual of the predicting step with more harmonics
HALVINGS = 4  # of the path between two starts after a failure of Newton's method
INSIDE = 1e-7  # distance of a slider from the ends of its interval for a gradient, over the half width
RESTS = 1e-7  # movement of a slider over a period, over the largest stretch, up to which it rests
CENTRING = 200  # steps to a point deep inside all discs
RAYS = 720  # in the search for the edge
CLOSER = 2  # refinements about the best ray, with rays a hundredth as far apart


@dataclass(frozen=True, eq=False)
class Room:
    """Admissible rest positions of the sliders of a motion.

    Attributes
    ----------
    sticks
        (n, 2) whether a spring sticks throughout, so that its slider keeps its start.
    slider
        (n, 2) rest position, m; zero for other springs.
    middle, half
        (n, 2) middle and half width of the interval in which the slider may rest, m; for a planar contact, a point deep
        inside all discs and its distance from the edge.
    multiplier
        (n, 2) traction at t = 0 over the friction limit; NaN for springs that do not stick.
    centres, limits
        (n, 2, samples) tangential gaps, m, and (n, samples) friction limits, N.
    """

    sticks: np.ndarray
    slider: FloatArray
    middle: FloatArray
    half: FloatArray
    multiplier: FloatArray
    centres: FloatArray
    limits: FloatArray


@dataclass(frozen=True, eq=False)
class TractionState:
    """Periodic motion from initial slider positions.

    Attributes
    ----------
    problem
        The solved problem.
    omega
        Frequency, rad/s.
    sliders
        (n, 2) initial slider positions, m.
    x
        Scaled unknowns.
    """

    problem: "TractionProblem"
    omega: float
    sliders: FloatArray
    x: FloatArray

    @property
    def amplitude(self) -> float:
        """Norm of the output over the driven harmonics, m."""
        return float(np.linalg.norm(self.problem.driven.motion(self.problem.balance, self.x)))

    @property
    def coefficients(self) -> ComplexArray:
        """(H+1, n) displacement of all dofs, m."""
        balance = self.problem.balance
        return balance.linear.recover(self.omega, balance.coefficients(self.x))

    @cached_property
    def room(self) -> Room:
        """Actual and admissible rest positions of the sliders."""
        balance = self.problem.at(self.sliders)
        return room_of(self.problem.starts, balance.contacts(self.x, self.omega))

    @property
    def error(self) -> float:
        """Predicted relative change of the output by the judging set.

        It is 0 without forces on this set, and NaN if a wheel lacks the waves.
        """
        problem = self.problem
        low = problem.at(self.sliders)
        high = judging_balance(low)
        if not covers(low, high):
            return float("nan")
        dof = low.linear.retained[problem.driven.position]
        measure = ErrorMeasure(np.array([dof]), problem.driven.harmonics)
        solve = to_tolerance(problem.newton.linear, ALERT_TOLERANCE).solve
        return jacobian_alert(low, high, self.x, self.omega, measure, solve).error

    def inside(self) -> FloatArray:
        """Return the sliders (n, 2), moved slightly inside if they are at an end of their interval.

        The gradient is then two-sided.
        """
        room = self.room
        off = room.slider - room.middle
        most = (1.0 - INSIDE) * room.half
        within = np.clip(off, -most, most)
        planar = self.problem.starts.planar[:, None] & (room.half > 0.0)
        inner = room.middle + np.where(planar, (1.0 - INSIDE) * off, within)
        return np.where(room.sticks, inner, self.sliders)

    def farthest(self, slope: FloatArray) -> FloatArray:
        """Return the admissible positions (n, 2) with the largest ``slope · s``, m.

        Sliders with zero slope are not moved.
        """
        room, starts = self.room, self.problem.starts
        end = room.middle + np.sign(slope) * room.half
        for c in np.flatnonzero(starts.planar & np.any(slope != 0.0, axis=1)):
            if np.all(room.half[c] > 0.0):
                k = np.maximum(starts.stiffness[c], 1e-300)
                end[c] = (
                    farthest_in_discs(room.middle[c] * k, room.centres[c] * k[:, None], room.limits[c], slope[c] / k)
                    / k
                )
        return np.where(room.sticks & (slope != 0.0), end, room.slider)

    def gradient(self) -> tuple[FloatArray, float]:
        """Return the (n, 2) derivatives of ``ln A`` by the sliders, 1/m, and the derivative by ``ln ω``."""
        problem, balance = self.problem, self.problem.at(self.sliders)
        period = balance.forces(self.x, self.omega)
        at = balance.linearise(self.x, self.omega, period)
        inverse = factorised(problem.newton.linear, at.jac)
        right = problem.driven.gradient(balance, self.x)
        adjoint = None if inverse is None else inverse(right, transposed=True)
        if adjoint is None:
            return np.zeros(self.sliders.shape), 0.0
        gaps = balance.rows.gaps(adjoint.reshape(balance.n_rows, balance.linear.n))
        seen = gaps.reshape(balance.n_rows, -1, 3)
        out = np.zeros((seen.shape[1], 3))
        for k, (a, b) in enumerate(PAIRS[: period.blocks.shape[1]]):
            out[:, b] += np.einsum("pc,cp->c", seen[:, :, a], period.blocks[:, k, :, 0])
        by_slider = np.where(problem.starts.stiffness > 0.0, out[:, :2] / balance.force_scale, 0.0)
        return by_slider, -self.omega * float(adjoint @ at.jac_p)


@dataclass(slots=True)
class Spent:
    """Cost of a search so far."""

    solves: int = 0
    failures: int = 0


@dataclass(frozen=True, eq=False)
class TractionProblem:
    """Periodic problem as a function of the initial sliders of its springs, with the amplitude of one output.

    Parameters
    ----------
    balance
        Balance of `starts.interface`, whose springs have no initial positions.
    starts
        The springs.
    driven
        The output among the retained coordinates, in the driven harmonics.
    newton
        Corrector options.
    spent
        Numbers of solves and failures.
    """

    balance: HarmonicBalance
    starts: Starts
    driven: Driven
    newton: Newton
    spent: Spent = field(default_factory=Spent)

    def at(self, sliders: FloatArray) -> HarmonicBalance:
        """Return the periodic problem with initial slider positions `sliders` (n, 2)."""
        moved = np.zeros((len(sliders), 3))
        moved[:, :2] = np.where(self.starts.stiffness > 0.0, sliders, 0.0)
        return replace(self.balance, compiled=replace(self.balance.compiled, sliders=moved))

    def solved(self, sliders: FloatArray, omega: float, near: Iterable[TractionState]) -> TractionState | None:
        """Return the motion for initial sliders; None without convergence.

        The starts are the motions `near`, of which the first that converges counts.
        """
        for begin in near:
            found = self._from(sliders, omega, begin, HALVINGS)
            if found is not None:
                return found
        self.spent.failures += 1
        return None

    def _from(self, sliders: FloatArray, omega: float, begin: TractionState, halvings: int) -> TractionState | None:
        balance = self.at(sliders)
        self.spent.solves += 1
        solution = newton(partial(balance.linearise, omega=omega), begin.x, self.newton)
        if solution.status.converged:
            return TractionState(self, omega, sliders, solution.x)
        if halvings == 0:
            return None
        half = 0.5 * (begin.sliders + sliders)
        between = self._from(half, 0.5 * (begin.omega + omega), begin, halvings - 1)
        return None if between is None else self._from(sliders, omega, between, halvings - 1)


def room_of(starts: Starts, period: ContactPeriod) -> Room:
    """Return the actual and admissible rest positions of the sliders, from sampled contacts over a period."""
    factors = starts.interface.factors
    gap, force = period.gap[:, :2], period.force / factors[:, None, None]
    stiffness = np.maximum(starts.stiffness, 1e-300)[:, :, None]
    springs = starts.stiffness > 0.0
    limit = starts.limits(-force[:, 2])
    reach = limit[:, None, :] / stiffness
    sliders = gap - force[:, :2] / stiffness
    slider = sliders[:, :, 0]
    # a slider that was dragged to the end of its interval rests up to rounding, whatever the state of a sample
    sticks = springs & (np.ptp(sliders, axis=2) <= RESTS * np.max(reach, axis=2))
    sticks[starts.planar] &= np.all(sticks[starts.planar] | ~springs[starts.planar], axis=1)[:, None]
    low, high = np.max(gap - reach, axis=2), np.min(gap + reach, axis=2)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    for c in np.flatnonzero(starts.planar & sticks.any(axis=1)):
        k = stiffness[c, :, 0]
        place, depth = in_all_discs(gap[c] * k[:, None], limit[c])
        middle[c], half[c] = place / k, depth / k
    share = force[:, :2, 0] / np.maximum(limit[:, None, 0], 1e-300)
    kept = sticks & (half > 0.0)
    return Room(
        sticks,
        np.where(sticks, slider, 0.0),
        np.where(kept, middle, slider),
        np.where(kept, half, 0.0),
        np.where(sticks, share, np.nan),
        gap,
        limit,
    )


def in_all_discs(centres: FloatArray, radii: FloatArray) -> tuple[FloatArray, float]:
    """Return a point (2,) deep inside all discs, and its distance from the nearest edge.

    The discs have `centres` (2, n) and `radii` (n,).
    """
    at = centres.mean(axis=1)
    best, depth = at, -np.inf
    for step in range(CENTRING):
        away = at[:, None] - centres
        inside = radii - np.hypot(*away)
        worst = int(np.argmin(inside))
        if inside[worst] > depth:
            best, depth = at, float(inside[worst])
        way = -away[:, worst] / max(float(np.hypot(*away[:, worst])), 1e-300)
        at = at + way * float(np.ptp(inside)) / (step + 2.0)
    return best, depth


def farthest_in_discs(inside: FloatArray, centres: FloatArray, radii: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the point (2,) in all discs with the largest ``slope · z``.

    Parameters
    ----------
    inside
        (2,) point inside all discs.
    centres, radii
        (2, n) centres and (n,) radii of the discs.
    slope
        (2,) nonzero gradient.
    """
    away = inside[:, None] - centres
    room = radii**2 - np.sum(away**2, axis=0)
    middle, width = float(np.arctan2(slope[1], slope[0])), np.pi
    best = inside
    for _ in range(1 + CLOSER):
        angles = middle + np.linspace(-width, width, RAYS)
        rays = np.stack([np.cos(angles), np.sin(angles)])
        along = rays.T @ away
        length = np.min(np.sqrt(along**2 + room) - along, axis=1)
        ends = inside[:, None] + length * rays
        top = int(np.argmax(slope @ ends))
        best, middle, width = ends[:, top], float(angles[top]), 0.01 * width
    return np.asarray(best)
