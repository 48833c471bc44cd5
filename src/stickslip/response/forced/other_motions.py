"""Search for coexisting motions: Newton's method from linear vibrations, and time integration from rest."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import StickslipError
from stickslip.harmonic.factors import solved, with_contacts
from stickslip.harmonic.harmonic_set import to_complex
from stickslip.harmonic.harmonics_per_dof import AnyBalance
from stickslip.response.continuation.starting_solutions import at_rest
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_point
from stickslip.response.time.settling import overflowed, period_harmonics
from stickslip.response.time.start import start_from_harmonics
from stickslip.response.time.stepping.marcher import prepared, step_work
from stickslip.solve.newton_method import Newton, Solution, newton

NO_MOTION = (StickslipError, np.linalg.LinAlgError, FloatingPointError)
ANOTHER = 0.01  # relative difference of amplitudes of two motions
NEWTON_STEPS = 30  # from each start
FEW = 3  # highest harmonic of the first attempt: most starts lead to the known motion, or nowhere
SAME_MOTION_RTOL = 1e-3  # relative difference up to which two motions with few harmonics are the same
STEPS = 256  # time steps in a period: Newton's method makes the motion exact
PERIODS = 60  # largest number of periods from rest
FEWEST_PERIODS = 12  # smallest useful number of periods
REPEATS = 1e-4  # relative change of the gaps' harmonics from period to period that ends the integration
MARCHED = 0.4  # work of all time integrations over the work of the response's solutions
# of a Newton step, constant and for each unknown; measured with contacts from 200 to 2200 unknowns
NEWTON_FLOPS, FLOPS_AN_UNKNOWN = 3e6, 2e5
JUDGED = 6  # Newton steps that take as long as the judgement of a solution
LONGER = 6.0  # time for an operation in a time step over a Newton step: six with 734 coordinates, two with 140


@dataclass(frozen=True, eq=False)
class OtherMotion:
    """Another motion at a frequency of the response.

    Attributes
    ----------
    start
        Start of the search: ``contacts stuck``, ``contacts open`` or ``rest``.
    point
        The motion.
    amplitude, known
        Amplitudes of the motion and of the response, m.
    """

    start: str
    point: ForcedPoint
    amplitude: float
    known: float


def other_motions(
    problem: ForcedProblem, points: Sequence[ForcedPoint], solved_points: Sequence[ForcedPoint], output: int
) -> Iterator[OtherMotion]:
    """Yield motions whose amplitude differs from the response.

    Parameters
    ----------
    problem
        The forced response.
    points
        Points at whose frequencies to search, the most important one first.
    solved_points
        All solved points. Their work limits the time integrations.
    output
        Number of the output whose amplitude is compared.
    """
    if problem.system.interface.rigid or not problem.system.structure.reduced:
        return
    allowed = _allowed(problem, solved_points)
    options = replace(problem.sweep.newton, max_iterations=NEWTON_STEPS)
    for point in points:
        seen: list[float] = [problem.amplitude(point, output)]
        balance = problem.balance(point.support)
        periods = _affordable(problem, allowed)
        starts = [*_linear_starts(problem, point, options)]
        if periods >= FEWEST_PERIODS:
            marched, taken = _from_rest(problem, balance, point.omega, periods)
            allowed -= taken * _period_work(problem)
            starts += [] if marched is None else [("rest", marched)]
        for start, x in starts:
            found = _solved(balance, point.omega, x, options)
            if not found.status.converged:
                continue
            made = forced_point(balance, found, "point", point.index, point.omega, 0.0)
            size = problem.amplitude(made, output)
            if all(abs(size - other) > ANOTHER * max(size, other) for other in seen):
                seen.append(size)
                yield OtherMotion(start, made, size, seen[0])


def _linear_starts(problem: ForcedProblem, point: ForcedPoint, options: Newton) -> Iterator[tuple[str, FloatArray]]:
    """Yield linear vibrations that may lead to another motion, as scaled unknowns of the point's harmonics.

    Each is solved with few harmonics first, and omitted if this fails or leads to the known motion.
    """
    whole = problem.balance(point.support)
    few = problem.balance(tuple(h for h in point.support if h <= max(FEW, *problem.driven)))
    known = None
    if len(few.harmonics) < len(whole.harmonics):
        own = _solved(few, point.omega, few.unknowns(point.coefficients), options)
        known = few.coefficients(own.x) if own.status.converged else None
    for name, make in (("contacts stuck", _stuck), ("contacts open", _open)):
        try:
            x = make(problem, few, point.omega)
        except NO_MOTION:
            continue
        if known is not None:
            found = _solved(few, point.omega, x, options)
            motion = few.coefficients(found.x)
            apart = np.linalg.norm(motion - known) > SAME_MOTION_RTOL * np.linalg.norm(known)
            if not (found.status.converged and apart):
                continue
            x = found.x
        yield name, whole.unknowns(few.coefficients(x))


def _solved(balance: AnyBalance, omega: float, x: FloatArray, options: Newton) -> Solution:
    return newton(lambda v: balance.linearise(v, omega), x, options)


def _stuck(problem: ForcedProblem, balance: AnyBalance, omega: float) -> FloatArray:
    motion = balance.coefficients(bonded_start(balance, omega, problem.system))
    motion[:1] = at_rest(problem.system, balance, omega)
    return balance.unknowns(motion)


def _open(problem: ForcedProblem, balance: AnyBalance, omega: float) -> FloatArray:
    """Return the vibration without contacts about the static equilibrium."""
    load, rows = to_complex(balance.linear_load(omega)), balance.rows
    none = np.zeros((problem.system.interface.n_contacts, 3, 3))
    motion = np.zeros((balance.order + 1, balance.linear.n), dtype=complex)
    motion[:1] = at_rest(problem.system, balance, omega)
    for place, h in enumerate(balance.harmonics):
        if h and np.any(load[place]):
            motion[h] = solved(with_contacts(balance.linear_block(omega, h), none, rows), load[place])
    return balance.unknowns(motion)


def _from_rest(
    problem: ForcedProblem, balance: AnyBalance, omega: float, periods: int
) -> tuple[FloatArray | None, int]:
    """Integrate in time from rest under the static loads.

    Returns
    -------
    tuple
        Unknowns for the harmonics of the last period, None if the motion overflows or has no initial state; and the
        number of integrated periods.
    """
    system, linear = problem.system.at(omega), balance.linear
    interface = system.interface
    try:
        still = linear.recover(omega, at_rest(problem.system, balance, omega))
    except NO_MOTION:
        return None, 0
    start = start_from_harmonics(still, omega, interface.gap_operator, interface.laws)
    marcher = prepared(
        system.structure, interface.gap_operator, interface.laws, linear.load_at(omega), omega, STEPS, interface.weights
    )
    state, record = marcher.begun(start), marcher.record()
    before, taken = None, 0
    for taken in range(1, periods + 1):
        if marcher.march(state, record) < 0 or overflowed(state.x, record.motion):
            return None, taken
        gaps = record.gap.reshape(marcher.steps, -1)
        now = period_harmonics(gaps[-1], gaps, balance.order)
        size = float(np.linalg.norm(now[1:]))
        if before is not None and float(np.linalg.norm(now - before)) <= REPEATS * size:
            break
        before = now
    motion = record.motion @ marcher.modes.basis.T
    every = period_harmonics(motion[-1], motion, balance.order)
    return balance.unknowns(np.asarray(every[:, linear.retained])), taken


def _allowed(problem: ForcedProblem, solved_points: Sequence[ForcedPoint]) -> float:
    """Return the operations that all time integrations may take together.

    It is 0 if the structure has no equations in time.
    """
    structure = problem.system.structure
    if structure.wheel is not None or structure.of_harmonic(1).loss is not None:
        return 0.0
    return MARCHED * sum(
        (p.iterations + JUDGED) * (NEWTON_FLOPS + FLOPS_AN_UNKNOWN * p.unknowns) for p in solved_points
    )


def _affordable(problem: ForcedProblem, allowed: float) -> int:
    """Return the number of affordable periods."""
    return min(PERIODS, int(allowed / _period_work(problem)))


def _period_work(problem: ForcedProblem) -> float:
    structure, interface = problem.system.structure, problem.system.interface
    return STEPS * LONGER * step_work(structure.n, 3 * interface.n_contacts)
