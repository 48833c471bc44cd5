"""Shooting: Newton's method on the map from a state to the state one period later, and the time-step error of its solution.

The map uses the compiled time step of `integrate`, so that a fixed point of the map is a settled motion of `integrate`, with
the same step error.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error
from stickslip.harmonic.linear import LinearSide
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.stability.found import UNIT_TOLERANCE, Floquet, floquet
from stickslip.response.time.sectors import WaveMotion
from stickslip.response.time.settling import overflowed, period_harmonics, remaining_change
from stickslip.response.time.start import TransientStart, check_start, rest
from stickslip.response.time.stepping.contact_step import StepState
from stickslip.response.time.stepping.marcher import Marcher, Record, prepared
from stickslip.response.time.stepping.propagator import PeriodicLoad
from stickslip.response.time.stepping.step_tangent import (
    TangentOperators,
    advanced,
    first_tangent,
    kept,
    law_derivatives,
    tangent_operators,
)
from stickslip.response.time.stepping.time_step import StepLog
from stickslip.response.time.transient import TimeStepping, check_outputs

SINGULAR = 1e-9  # relative singular value of (1 - monodromy) below which a direction is neutral


@dataclass(frozen=True, eq=False)
class Image:
    """Motion over one period.

    Parameters
    ----------
    state
        (size,) final state; NaN if the motion overflowed.
    failures
        Steps in which the contact equations were not solved to rounding; -1 if the motion overflowed.
    record
        Samples of the period.
    """

    state: FloatArray
    failures: int
    record: Record


@dataclass(frozen=True, eq=False)
class Derivative:
    """Motion over one period, with the derivative of its final by its initial state.

    Parameters
    ----------
    image
        The motion.
    monodromy
        (size, size) derivative of the final state; NaN if the motion overflowed.
    kept
        Law states that stay constant, also after a small change: sliders that stick.
    unfelt
        Law states without influence on any force.
    idle
        Law states that neither change nor act through a spring.
    """

    image: Image
    monodromy: FloatArray
    kept: IntArray
    unfelt: IntArray
    idle: IntArray

    def inverse(self) -> FloatArray:
        """Return the (size, size) pseudo-inverse of ``1 - monodromy``, which turns a defect into a correction.

        It is zero in neutral directions.

        A slider that sticks for the whole period keeps its position, which selects one motion of a family.
        """
        moves = np.setdiff1d(np.arange(len(self.monodromy)), self.kept)
        inverse = np.zeros_like(self.monodromy)
        part = np.ix_(moves, moves)
        inverse[part] = np.linalg.pinv(np.eye(moves.size) - self.monodromy[part], rcond=SINGULAR)
        return inverse


@dataclass(frozen=True, eq=False)
class PeriodMap:
    """Period map in energy coordinates: modal displacement, velocity, law states.

    A state is ``(ωs q, ωs w, c z)`` with q, w and the speeds s of `ModalCoordinates`, the law states z, and factors c
    from the contact springs. Half its squared length is the energy of modes and springs, J, so that distances are
    comparable for stiff and soft coordinates.

    Parameters
    ----------
    marcher
        The structure prepared for time integration.
    linear
        Matrices of its tangents.
    scale
        (size,) factors of (q, w, z).
    shares
        Number n of sectors of a travelling motion, in which each sector moves like another one T/n earlier: the map
        then covers T/n, followed by a shift of the sectors. Otherwise 1.
    shift
        (size, size) shift of the sectors; None without one.
    """

    marcher: Marcher
    linear: TangentOperators
    scale: FloatArray
    shares: int = 1
    shift: FloatArray | None = None

    @property
    def size(self) -> int:
        """Number of coordinates of a state."""
        return self.scale.size

    @property
    def n_motion(self) -> int:
        """Number of displacements and velocities in a state."""
        return 2 * self.marcher.n

    def start_of(self, state: FloatArray) -> StepState:
        """Return a state in the form of the time step."""
        return self._begun(state)[0]

    def state_of(self, step: StepState) -> FloatArray:
        """Return the coordinates of a state of the time step."""
        return np.asarray(self.scale * np.concatenate([step.x[: self.n_motion], step.law]))

    def image(self, state: FloatArray) -> Image:
        """Integrate one period, or the share T/n followed by the shift."""
        image = self._marched(state, self.marcher.steps // self.shares)
        return image if self.shift is None else replace(image, state=self.shift @ image.state)

    def period(self, state: FloatArray) -> Image:
        """Integrate one whole period."""
        return self._marched(state, self.marcher.steps)

    def _marched(self, state: FloatArray, steps: int) -> Image:
        step, record = self.start_of(state), self.marcher.record(steps)
        return self._ended(step, self.marcher.march(step, record), record)

    def vibration(self, image: Image) -> float:
        """Return the size of the vibration over a period in the norm of the states.

        It is at least 1e-9 of the final state.
        """
        n = self.marcher.n
        scale, motion = self.scale[:n], image.record.motion
        if self.shares == 1:
            swing = np.std(motion, axis=0)
        else:  # a share of the period of all sectors together covers the whole period
            basis = self.marcher.modes.basis
            own = (motion @ basis.T).reshape(-1, n // self.shares)
            mean = np.tile(own.mean(axis=0), self.shares)
            away = motion - self.marcher.modes.inverse @ mean
            swing = np.sqrt(np.mean(away**2, axis=0))
        size = float(np.sqrt(2.0) * np.linalg.norm(scale * swing))
        return max(size, 1e-9 * float(np.linalg.norm(image.state)), np.finfo(float).tiny)

    def derivative(self, state: FloatArray) -> Derivative:
        """Integrate one period, or its share, with tangents."""
        (step, first), record = (self._begun(state), self.marcher.record(self.marcher.steps // self.shares))
        tangent = first_tangent(first, self.linear, step.law.size)
        seen = np.zeros(first.size, dtype=bool)

        def carry(log: StepLog, rows: int) -> None:
            nonlocal tangent
            tangent = advanced(log, rows, tangent, self.linear)
            np.logical_or(seen, np.any(log.jac[:rows] != 0.0, axis=0), out=seen)

        failures = self.marcher.march_logged(step, record, carry)
        image = self._ended(step, failures, record)
        if image.failures < 0:
            nothing, none = np.full((self.size, self.size), np.nan), np.zeros(0, dtype=np.int64)
            return Derivative(image, nothing, none, none, none)
        m, k = self.n_motion, self.marcher.k
        matrix = np.vstack([tangent[:m], tangent[m + k :]])
        stays = kept(matrix, np.arange(m, self.size))
        rest = self._no_motion(seen, np.isin(np.arange(m, self.size), stays))
        matrix = self.scale[:, None] * matrix / self.scale
        if self.shift is None:
            return Derivative(image, matrix, stays, *rest)
        image = replace(image, state=self.shift @ image.state)
        return Derivative(image, self.shift @ matrix, stays[:0], *rest)

    def floquet(self, derivative: Derivative) -> Floquet:
        """Return the multipliers of a whole period: without idle states, and zero for unfelt ones."""
        none = np.concatenate([derivative.unfelt, derivative.idle])
        states = np.delete(np.arange(self.size), none)
        monodromy = derivative.monodromy[np.ix_(states, states)]
        found = floquet(np.linalg.matrix_power(monodromy, self.shares)).multipliers
        return Floquet(np.append(found, np.zeros(derivative.unfelt.size, dtype=complex)))

    def _no_motion(self, seen: BoolArray, still: BoolArray) -> tuple[IntArray, IntArray]:
        """Return the indices of unfelt and of idle states.

        `seen` marks derivatives of the laws that were not always zero, `still` the states that stayed constant.
        """
        (pattern,) = law_derivatives(seen[None].astype(float), self.linear, still.size)
        sprung = np.any(pattern.force_by_law[self.marcher.contacts.table.stuck != 0.0], axis=0)
        felt, more = np.zeros_like(still), np.any(pattern.force_by_law, axis=0)
        while not np.array_equal(felt, more):
            felt, more = more, more | np.any(pattern.law_by_law[more], axis=0)
        sectors = (self.shares, -1)  # which take turns
        felt, sprung = (np.any(a.reshape(sectors), axis=0) for a in (felt, sprung))
        idle = np.all(still.reshape(sectors), axis=0) & ~sprung
        unfelt = ~felt & ~idle
        first = self.n_motion
        return tuple(first + np.flatnonzero(np.tile(a, self.shares)) for a in (unfelt, idle))  # type: ignore[return-value]

    def _begun(self, state: FloatArray) -> tuple[StepState, FloatArray]:
        plain, m = state / self.scale, self.n_motion
        return self.marcher.begin(plain[:m], plain[m:])

    def _ended(self, step: StepState, failures: int, record: Record) -> Image:
        """Return the period that ends at `step`; all NaN if its squares would overflow."""
        state = self.state_of(step)
        if failures < 0 or overflowed(state, record.motion):
            for array in (state, record.rows):
                array.fill(np.nan)
            failures = -1
        return Image(state, failures, record)


def period_map(
    marcher: Marcher, start: TransientStart, symmetry: WaveMotion | None = None
) -> tuple[PeriodMap, FloatArray]:
    """Return the period map of a marcher and the coordinates of `start`.

    With a symmetry, the map covers a share of the period.
    """
    linear = tangent_operators(marcher)
    begin = marcher.begun(start)
    speed = marcher.modes.omega * marcher.modes.speed
    scale = np.concatenate([speed, speed, _law_scale(marcher, linear)])
    made = PeriodMap(marcher, linear, scale)
    if symmetry is not None:
        shift = scale[:, None] * _shift(marcher, symmetry) / scale
        made = replace(made, shares=symmetry.sectors, shift=shift)
    return made, made.state_of(begin)


def _shift(marcher: Marcher, symmetry: WaveMotion) -> FloatArray:
    """Return the matrix that shifts a state (q, w, z) to the represented sectors."""
    modes, n, n_states = marcher.modes, marcher.n, marcher.contacts.start.size
    moved = modes.inverse @ symmetry.shifted(modes.basis)
    turned = moved * modes.speed / modes.speed[:, None]
    states = symmetry.shifted(np.eye(n_states)) if n_states else np.zeros((0, 0))
    shift = np.zeros((2 * n + n_states,) * 2)
    for at, part in ((0, moved), (n, turned), (2 * n, states)):
        shift[at : at + len(part), at : at + len(part)] = part
    return shift


def _law_scale(marcher: Marcher, linear: TangentOperators) -> FloatArray:
    """Return (n_states,) factors of the law states: their force at rest over the root of the contact stiffness.

    A state without force at rest, as in an open contact, counts as a displacement.
    """
    contacts = marcher.contacts
    n_states = contacts.start.size
    at_rest = marcher.begin(np.zeros(2 * marcher.n), contacts.start)[1]
    (laws,) = law_derivatives(at_rest[None], linear, n_states)
    force = laws.force_by_law.reshape(contacts.n, 3, n_states)
    stiffness = np.max(contacts.table.stuck.reshape(-1, 3), axis=1, initial=0.0)
    fallback = np.max(stiffness, initial=0.0) or 1.0
    root = np.sqrt(np.where(stiffness > 0.0, stiffness, fallback))
    own = np.repeat(np.arange(contacts.n), np.diff(contacts.state_places))
    size = np.linalg.norm(force[own, :, np.arange(n_states)], axis=1)
    return np.where(size > 0.0, size, root[own] ** 2) / root[own]


ShootingStatus = Literal["converged", "coarse", "not converged", "diverged"]
TOLERANCE = 1e-9  # default distance to the orbit, relative to its vibration
MOST_CORRECTIONS = 40
WARM_UP = 2  # periods before the first correction, in which slipping contacts forget errors of the start
SHORTEST = 1.0 / 16.0  # shortest tried fraction of a correction
CONTRACTION = 0.5  # a derivative is reused while one period, which costs far less, halves the distance
FALLBACK = 8  # plain periods after a correction that fails at any length
ANEW = 8  # corrections of a renewed search: near an orbit four are enough
RESERVE = 2 * ANEW  # periods reserved for them
COARSE = 0.01  # largest step error of a valid motion, relative to the largest harmonic
NEUTRAL_DISTANCE = 0.05  # distance of the growth from 1 below which its step error is estimated
JUMP = 1.5  # change of a friction force within a step, over its largest value, that skips stick
TURNS = (
    2.0  # error over change with half the step, for a method of first order, as the derivative at reversals of a slider
)
RICHARDSON = 4.0 / 3.0  # the same ratio for a method of second order
ERRATIC = 10.0  # largest such ratio: if the second change is as large as the first, more steps need not converge


@dataclass(frozen=True, eq=False)
class ShootingResult:
    """Periodic motion and the growth of its disturbances.

    Parameters
    ----------
    status
        ``converged``; ``coarse``: periodic, but the estimated step error of the harmonics is above 1 %; ``not
        converged``: the periods ran out, or plain periods settled but the corrections from there did not, or there is
        no periodic motion nearby (a drift); ``diverged``: the motion overflowed, and all arrays are NaN.
    harmonics
        (n_h + 1, n_outputs) complex amplitudes, m.
    floquet
        Floquet multipliers of the motion, and the number of neutral ones.
    periods
        Integrated periods, with and without tangents; the last correction may exceed the allowed number by a few.
    corrections
        Periods integrated with tangents, each of which costs as much as about six others.
    residual
        Change of the state over a period, relative to the vibration of the orbit.
    distance
        Length of the last correction, relative to the vibration of the orbit.
    step_error
        Estimated step error of the harmonics, relative to the largest, from twice as many steps, and four times as many
        where a contact opens or closes. NaN without a motion.
    growth_error
        Estimated step error of the multipliers' largest modulus, where it is within 0.05 of 1 or a contact opens or
        closes. Infinite where a slider reverses within a step, which the multipliers miss, or where openings make the
        motion coarse; 0 elsewhere.
    contact_failures
        Time steps of the last period in which the contact equations were not solved to rounding.
    final
        State at t = 0 and at the end of every period.
    outputs
        (steps, n_outputs) displacements at t = T/steps, 2T/steps, ... T; m.
    gap, contact_force
        (steps, n_contacts, 3) gaps (m) and forces ``T_t, T_w, -N`` (N) at the same times.
    """

    status: ShootingStatus
    harmonics: ComplexArray
    floquet: Floquet
    periods: int
    corrections: int
    residual: float
    distance: float
    step_error: float
    growth_error: float
    contact_failures: int
    final: TransientStart
    outputs: FloatArray
    gap: FloatArray
    contact_force: FloatArray

    @property
    def converged(self) -> bool:
        """Whether the motion is periodic within the tolerance."""
        return self.status == "converged"

    @property
    def stable(self) -> bool:
        """Whether the motion is periodic and no small disturbance grows; neutral multipliers are not judged."""
        return self.converged and self.floquet.stable and not self.undecided

    @property
    def undecided(self) -> bool:
        """Whether the stability is unknown, as the step error of the growth exceeds its distance from 1.

        More steps may decide.
        """
        distance = abs(self.floquet.growth - 1.0)
        return self.converged and UNIT_TOLERANCE < distance <= self.growth_error


@dataclass(slots=True)
class _Search:
    """State of the search for a fixed point."""

    state: FloatArray
    status: ShootingStatus = "not converged"
    periods: int = 0
    corrections: int = 0
    distance: float = np.inf
    derivative: Derivative | None = None


@by_one_thread
def shoot(  # noqa: PLR0913
    structure: LinearSide,
    gap_operator: Matrix,
    laws: Sequence[ContactLaw],
    load: PeriodicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart | None = None,
    stepping: TimeStepping | None = None,
    *,
    weights: FloatArray | None = None,
    symmetry: WaveMotion | None = None,
) -> ShootingResult:
    """Find a periodic motion of ``M ü + C u̇ + K u + gap_operatorᵀ λ = f(t)`` with the period of the load.

    Newton's method solves ``P(z) = z`` for the state z at t = 0, where P is one period with the time step of
    `integrate`. Contacts that stick for the whole period allow a family of motions, one for each position of their
    sliders: the sliders keep their positions after the first periods. If the derivative of ``P(z) - z`` is singular
    otherwise, as for a free body, the shortest correction is taken. The search begins with plain periods. A correction
    that leads away from the orbit is shortened; if this does not help, plain periods replace it. If forty corrections
    do not converge, the motion is integrated from the start in ever longer blocks with a short search after each, until
    it settles or the periods run out.

    Parameters
    ----------
    structure, gap_operator, laws, load, omega, outputs
        As in `integrate`; a `HarmonicLoad` is a load.
    start
        State at t = 0, preferably from a harmonic balance (`start_from_harmonics`); rest if None.
    stepping
        Steps in a period, largest number of periods, number of harmonics; `tolerance` bounds the length of the last
        correction relative to the vibration. If None, 1024 steps and 1e-9.
    weights
        (n_contacts,) factors of the contact forces; None: ones.
    symmetry
        Symmetry of all sectors of a tuned wheel (`SectorsInTime.motion`): the map then covers the share of the period
        after which each sector has the initial state of another. Only motions that travel with the load are found.

    Raises
    ------
    InputError
        If an argument has a wrong shape or value, the mass matrix is singular, or a contact is rigid.
    """
    stepping = stepping or TimeStepping(tolerance=TOLERANCE)
    steps = stepping.steps_per_period
    if symmetry is not None and steps % symmetry.sectors:
        raise input_error(
            "shoot: stepping.steps_per_period",
            f"is {steps}, which {symmetry.sectors} sectors cannot share",
            f"Give a multiple, such as {-(-steps // symmetry.sectors) * symmetry.sectors}.",
        )
    marcher = prepared(structure, gap_operator, laws, load, omega, steps, weights, "shoot")
    check_outputs(outputs, marcher.n, "shoot")
    start = start or rest(marcher.n, laws)
    check_start(start, marcher.n, marcher.contacts, "shoot")
    mapping, state = period_map(marcher, start, symmetry)
    search = _Search(state)
    _march(mapping, search, WARM_UP)
    warm = search.state
    _search(mapping, search, stepping, MOST_CORRECTIONS)
    if search.status == "not converged":
        _march_and_search(mapping, search, stepping, warm)

    def finer(times: int) -> Marcher:
        return prepared(structure, gap_operator, laws, load, omega, times * steps, weights, "shoot")

    return _result(mapping, search, outputs, stepping, finer)


def _search(mapping: PeriodMap, search: _Search, stepping: TimeStepping, corrections: int) -> None:
    """Correct the state until it converges, or the corrections or periods run out."""
    last = search.corrections + corrections
    while search.status == "not converged" and search.corrections < last and search.periods < stepping.max_periods:
        if not _correct(mapping, search, stepping.tolerance):
            _march(mapping, search, FALLBACK)


def _march_and_search(mapping: PeriodMap, search: _Search, stepping: TimeStepping, warm: FloatArray) -> None:
    """Integrate from `warm` in blocks, each twice as long as the last, with a new search after each.

    The integration ignores the states of failed searches, so that it reaches every orbit that `integrate` reaches, in
    as many periods.
    """
    changes: list[float] = []
    block, settled = FALLBACK, False
    while search.status == "not converged" and not settled:
        room = stepping.max_periods - search.periods - RESERVE
        if room <= 0:
            return
        search.state = warm
        settled = _settle(mapping, search, min(block, room), changes, stepping.tolerance)
        warm, block = search.state, 2 * block
        _search_anew(mapping, search, stepping)


def _search_anew(mapping: PeriodMap, search: _Search, stepping: TimeStepping) -> None:
    """Take a few corrections; stop at the first that does not come nearer."""
    last = search.corrections + ANEW
    while search.status == "not converged" and search.corrections < last and search.periods < stepping.max_periods:
        if not _correct(mapping, search, stepping.tolerance):
            return


def _settle(mapping: PeriodMap, search: _Search, periods: int, changes: list[float], tolerance: float) -> bool:
    """Integrate plain periods; return whether the state has settled, by the criterion of `integrate`."""
    for _ in range(periods):
        image = mapping.image(search.state)
        search.periods += 1
        if image.failures < 0:
            search.status = "diverged"
            return False
        change = float(np.linalg.norm(image.state - search.state))
        changes.append(change / mapping.vibration(image))
        search.state = image.state
        if remaining_change(changes) < tolerance:
            return True
    return False


def _march(mapping: PeriodMap, search: _Search, periods: int) -> None:
    """Advance the state by plain periods."""
    for _ in range(periods):
        image = mapping.image(search.state)
        search.periods += 1
        if image.failures < 0:
            search.status = "diverged"
            return
        search.state = image.state


def _correct(mapping: PeriodMap, search: _Search, tolerance: float) -> bool:
    """Take one Newton correction; return whether it came nearer to an orbit, or the search has ended."""
    here = search.derivative = mapping.derivative(search.state)
    image = here.image
    search.periods += 1
    search.corrections += 1
    if image.failures < 0:
        search.status = "diverged"
        return True
    inverse = here.inverse()
    defect = image.state - search.state
    correction = inverse @ defect
    vibration = mapping.vibration(image)
    length = float(np.linalg.norm(correction))
    search.distance = length / vibration
    if search.distance <= tolerance and np.linalg.norm(defect) <= tolerance * vibration:
        search.state = search.state + correction
        search.status = "converged"
        return True
    return _approach(mapping, search, inverse, correction, tolerance * vibration)


def _approach(mapping: PeriodMap, search: _Search, inverse: FloatArray, correction: FloatArray, close: float) -> bool:
    """Correct the state, with the same derivative while it converges fast; return whether the distance decreased.

    Distances are lengths of corrections, in which weakly damped directions count fully.
    """
    length, share, nearer = float(np.linalg.norm(correction)), 1.0, False
    state = search.state
    while share >= SHORTEST:
        trial = state + share * correction
        after = mapping.image(trial)
        search.periods += 1
        following = inverse @ (after.state - trial)
        left = float(np.linalg.norm(following))
        if not left <= (1.0 - share / 4) * length:  # NaN where the motion overflowed
            if nearer:
                break
            share /= 2
            continue
        search.state, nearer = after.state, True
        if share < 1.0 or left > CONTRACTION * length or left <= close:
            break
        state, correction, length = trial, following, left
    return nearer


def _result(
    mapping: PeriodMap, search: _Search, outputs: IntArray, stepping: TimeStepping, finer: Callable[[int], Marcher]
) -> ShootingResult:
    """Integrate the reported period, and compare it with finer steps."""
    image = mapping.period(search.state)
    status: ShootingStatus = "diverged" if image.failures < 0 else search.status
    known = np.nan if status == "diverged" else 1.0
    marcher, record = mapping.marcher, image.record
    basis, final = marcher.modes.basis[outputs].T, marcher.end(mapping.start_of(search.state))
    found = search.derivative
    if found is None or status == "diverged":
        multipliers = Floquet(np.full(mapping.size, np.nan, dtype=complex))
    else:
        multipliers = mapping.floquet(found)
    errors = StepErrors(np.nan, np.nan)
    if found is not None and status == "converged":
        errors = _step_errors(mapping, finer, search.state, found, outputs, stepping.harmonics)
        status = "converged" if errors.motion <= COARSE else "coarse"
    return ShootingResult(
        status=status,
        harmonics=known * harmonics(mapping, search.state, image, outputs, stepping.harmonics),
        floquet=multipliers,
        periods=search.periods + 1,
        corrections=search.corrections,
        residual=known * float(np.linalg.norm(image.state - search.state) / mapping.vibration(image)),
        distance=known * search.distance,
        step_error=errors.motion,
        growth_error=errors.growth,
        contact_failures=image.failures,
        final=TransientStart(
            known * final.displacement, known * final.velocity, tuple(known * s for s in final.states)
        ),
        outputs=known * (record.motion @ basis),
        gap=known * record.gap,
        contact_force=known * record.force,
    )


@dataclass(frozen=True, eq=False)
class StepErrors:
    """Estimates of the time-step error.

    Parameters
    ----------
    motion
        Error of the outputs' harmonics, relative to the largest; infinite if finer steps overflow.
    growth
        Error of the multipliers' largest modulus, where it is close to 1 or a contact opens or closes; infinite where a
        slider reverses within a step, which derivatives miss; 0 elsewhere.
    """

    motion: float
    growth: float


def _step_errors(
    mapping: PeriodMap,
    finer: Callable[[int], Marcher],
    state: FloatArray,
    found: Derivative,
    outputs: IntArray,
    order: int,
) -> StepErrors:
    """Compare a periodic motion with twice as many steps, and with four times as many where a contact opens or closes.

    Parameters
    ----------
    mapping, state
        The period map and its fixed point.
    finer
        Function that returns the same structure with a multiple of the steps.
    found
        Derivative of the map at the fixed point.
    outputs, order
        Compared outputs, and the highest harmonic.
    """
    image, growth = mapping.period(state), mapping.floquet(found).growth
    known = harmonics(mapping, state, image, outputs, order)[1:]
    fine, there = _corrected(mapping, finer(2), state, found)
    moved = fine.period(there)
    if not moved.failures >= 0:
        return StepErrors(np.inf, np.inf)
    size, jumps = float(np.max(np.abs(known), initial=0.0)), _jumps(image)
    change = _change(known, harmonics(fine, there, moved, outputs, order)[1:], size)
    opens = _opens(image) or _opens(moved)
    if RICHARDSON * change > COARSE or not opens:
        error = np.inf if jumps or opens else 0.0
        if error == 0.0 and abs(growth - 1.0) < NEUTRAL_DISTANCE:
            error = TURNS * abs(fine.floquet(fine.derivative(there)).growth - growth)
        return StepErrors(RICHARDSON * change, error)
    motions, growths = [known], [growth]
    for marcher in (fine.marcher, finer(4)):
        fine, there = _corrected(mapping, marcher, state, found)
        found = fine.derivative(there)
        if not found.image.failures >= 0:
            return StepErrors(np.inf, np.inf)
        state = there + found.inverse() @ (found.image.state - there)
        motions.append(harmonics(fine, state, fine.period(state), outputs, order)[1:])
        growths.append(fine.floquet(found).growth)
    first, second = (_change(a, b, size) for a, b in pairwise(motions))
    motion = _scattered(max(first, change), second, RICHARDSON)
    error = _scattered(abs(growths[1] - growth), abs(growths[2] - growths[1]), TURNS)
    return StepErrors(motion, np.inf if jumps else error)


def _change(one: ComplexArray, other: ComplexArray, size: float) -> float:
    return float(np.max(np.abs(other - one), initial=0.0)) / size if size > 0.0 else 0.0


def _corrected(
    mapping: PeriodMap, marcher: Marcher, state: FloatArray, found: Derivative
) -> tuple[PeriodMap, FloatArray]:
    """Return the map with finer steps and the state after one correction with the known derivative."""
    fine = replace(mapping, marcher=marcher, linear=tangent_operators(marcher))
    return fine, state + found.inverse() @ (fine.image(state).state - state)


def _scattered(first: float, second: float, least: float) -> float:
    """Return the error of the first of three values from their two changes.

    The changes are partly random. The error is infinite if a change is unknown.

    Further changes are taken as a geometric series with the ratio of the two; `least` is the lower bound of its sum
    over the first change.
    """
    if not np.isfinite(first + second):
        return np.inf
    falls = first - second > first / ERRATIC
    return max(least, first / (first - second)) * first if falls else ERRATIC * max(first, second)


def _opens(image: Image) -> bool:
    """Whether a contact is open (zero normal force) for a part of the period."""
    is_open = image.record.force[:, :, 2] == 0.0
    return bool(np.any(np.any(is_open, axis=0) & ~np.all(is_open, axis=0)))


def _jumps(image: Image) -> bool:
    """Whether a friction force jumps within a step from one slip limit to the opposite one."""
    force = image.record.force[:, :, :2]
    largest = np.max(np.abs(force), axis=0, initial=0.0)
    return bool(np.any(np.abs(np.diff(force, axis=0)) > JUMP * largest[None]))


def harmonics(mapping: PeriodMap, state: FloatArray, image: Image, outputs: IntArray, order: int) -> ComplexArray:
    """Return the (order + 1, n_outputs) harmonics of the period that begins with `state`, m."""
    marcher = mapping.marcher
    began = mapping.start_of(state).x[: marcher.n]
    modal = period_harmonics(began, image.record.motion, order)
    return np.asarray(modal @ marcher.modes.basis[outputs].T)
