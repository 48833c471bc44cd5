"""Other motions at frequencies of a response: Newton's method from linear vibrations, and the motion in time from rest."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import StickslipError
from stickslip.harmonic.factors import solved, with_contacts
from stickslip.harmonic.fourier import to_complex
from stickslip.harmonic.local import AnyBalance
from stickslip.harmonic.sparse_stiffness import Unreduced
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_point
from stickslip.response.ladder import at_rest
from stickslip.response.time.marcher import prepared, step_work
from stickslip.response.time.settling import overflowed, period_harmonics
from stickslip.response.time.start import start_from_harmonics
from stickslip.solve.newton_method import newton

NO_MOTION = (StickslipError, np.linalg.LinAlgError, FloatingPointError)
ANOTHER = 0.01  # relative difference of amplitudes of two motions
NEWTON_STEPS = 30  # from each start
STEPS = 256  # of a period in time: Newton's method makes the motion exact
PERIODS = 60  # marched from rest, at most
FEWEST_PERIODS = 12  # fewer lead nowhere
REPEATS = (
    1e-4  # change of the gaps' harmonics from period to period, of their size, that ends the march
)
SOLVER_STEP_FLOPS = 3e6  # of a Newton step, however few unknowns it has


@dataclass(frozen=True, eq=False)
class OtherMotion:
    """A motion that is not that of the response.

    Attributes
    ----------
    start
        What it was found from: ``contacts stuck``, ``contacts open``, ``rest``.
    point
        It.
    amplitude, known
        Of it and of the response there, m.
    """

    start: str
    point: ForcedPoint
    amplitude: float
    known: float


def other_motions(
    problem: ForcedProblem,
    points: Sequence[ForcedPoint],
    solved_points: Sequence[ForcedPoint],
    output: int,
) -> Iterator[OtherMotion]:
    """Yield motions of another amplitude than that of the response.

    Parameters
    ----------
    problem
        The forced response.
    points
        Where they are looked for, the most important one first.
    solved_points
        All that were solved: a march takes no more work than they did together.
    output
        Position of the output whose amplitude counts.
    """
    if problem.system.interface.rigid or isinstance(problem.system.structure, Unreduced):
        return
    periods = _affordable(problem, solved_points, len(points))
    for point in points:
        seen: list[float] = [problem.amplitude(point, output)]
        balance = problem.balance(point.support)
        for start, x in _starts(problem, balance, point, periods):
            options = replace(problem.sweep.newton, max_iterations=NEWTON_STEPS)
            found = newton(lambda v: balance.linearise(v, point.omega), x, options)  # noqa: B023
            if not found.status.converged:
                continue
            made = forced_point(balance, found, "point", point.index, point.omega, 0.0)
            size = problem.amplitude(made, output)
            if all(abs(size - other) > ANOTHER * max(size, other) for other in seen):
                seen.append(size)
                yield OtherMotion(start, made, size, seen[0])


def _starts(
    problem: ForcedProblem, balance: AnyBalance, point: ForcedPoint, periods: int
) -> Iterator[tuple[str, FloatArray]]:
    """Yield what each start is and its scaled unknowns; what cannot be had is left out."""
    for name, make in (
        ("contacts stuck", _stuck),
        ("contacts open", _open),
    ):
        try:
            yield name, make(problem, balance, point.omega)
        except NO_MOTION:
            continue
    if periods >= FEWEST_PERIODS:
        try:
            start = _from_rest(problem, balance, point.omega, periods)
        except NO_MOTION:
            return
        if start is not None:
            yield "rest", start


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
            motion[h] = solved(
                with_contacts(balance.linear_block(omega, h), none, rows), load[place]
            )
    return balance.unknowns(motion)


def _from_rest(
    problem: ForcedProblem, balance: AnyBalance, omega: float, periods: int
) -> FloatArray | None:
    """Return the harmonics of the last period of a march from rest under the static loads; None where it grows beyond all numbers."""
    system, linear = problem.system.at(omega), balance.linear
    interface = system.interface
    still = linear.recover(omega, at_rest(problem.system, balance, omega))
    start = start_from_harmonics(still, omega, interface.gap_operator, interface.laws)
    marcher = prepared(
        system.structure, interface.gap_operator, interface.laws, linear.load_at(omega), omega,
        STEPS, interface.weights,
    )  # fmt: skip
    state, record = marcher.begun(start), marcher.record()
    before = None
    for _ in range(periods):
        if marcher.march(state, record) < 0 or overflowed(state.x, record.motion):
            return None
        gaps = record.gap.reshape(marcher.steps, -1)
        now = period_harmonics(gaps[-1], gaps, balance.order)
        size = float(np.linalg.norm(now[1:]))
        if before is not None and float(np.linalg.norm(now - before)) <= REPEATS * size:
            break
        before = now
    motion = record.motion @ marcher.modes.basis.T
    every = period_harmonics(motion[-1], motion, balance.order)
    return balance.unknowns(np.asarray(every[:, linear.retained]))


def _affordable(problem: ForcedProblem, solved_points: Sequence[ForcedPoint], starts: int) -> int:
    """Return how many periods may be marched from each start: all together no more work than the points took."""
    structure, interface = problem.system.structure, problem.system.interface
    if isinstance(structure, TunedWheel) or structure.of_harmonic(1).loss is not None:
        return 0
    spent = sum(p.iterations * (SOLVER_STEP_FLOPS + float(p.unknowns) ** 3) for p in solved_points)
    step = step_work(structure.n, 3 * interface.n_contacts)
    return min(PERIODS, int(spent / (STEPS * step * max(starts, 1))))
