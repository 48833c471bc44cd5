"""Motions with a self-excited second frequency, by instability of the forced motion or by flutter.

Beyond a Neimark-Sacker point a second tone with its own frequency grows out of the forced motion. Its phase is
arbitrary, so its frequency is an additional unknown. For a given amplitude ``a`` of the second tone, another unknown is
the *level*: the damping that is removed from all combined frequencies of the second tone to sustain it. The level is
small and negative at first, and zero where the motion sustains itself. The curve over ``a`` begins with the growing
disturbance, at the angle of its multiplier or the frequency of its mode.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray
from stickslip.errors import StickslipError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.two_frequency import TorusPath
from stickslip.model.blas_threads import by_one_thread
from stickslip.operators import Bordered, Jacobian
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.problem import forced_problem
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.quasi_periodic.problem import TorusMotion, TwoTones
from stickslip.response.stability import stability
from stickslip.solve.newton_method import Solution, newton
from stickslip.solve.status import Status

FIRST = 0.02  # initial amplitude of the second tone, over the forced motion
STEP = 1.5  # initial factor of the amplitude from one point to the next
SHORTEST, LONGEST = 1.02, 4.0  # smallest and largest such factor
FEW = 3  # Newton steps up to which the next step is longer
FARTHEST = 300.0  # last amplitude, over the forced motion
HALVINGS = 8  # of the interval with a zero of the level
WANDERED = 0.3  # |ln(ω2 / guess)| at which the second tone is lost
PATHS = 4  # largest number of adaptations of the sampling path to the frequency
STILL = 1e-6  # amplitude of a second tone over the motion, below which it has vanished
REAL = 1e-6  # rad: smallest angle of a complex multiplier, from 0 and from π
ORDER = 7  # harmonics of the motion for multipliers
HIGHEST = 3  # highest harmonic with a second frequency near it
TRIED = 3  # second frequencies to try
# relative to a frequency: beginning of a branch to it, and largest distance of the branch's points
WIDE, POINT_DISTANCE_RTOL = 0.3, 1e-3
NARROW = 1e-6  # relative half-width of the range about a single frequency


@dataclass(frozen=True, eq=False)
class Beginning:
    """Second tone at very small amplitudes.

    Attributes
    ----------
    problem
        Problem with all combined frequencies, without a load at the second one.
    omegas
        ω1 and an estimate of the second frequency, rad/s.
    forced
        Unknowns of the forced motion without a second tone.
    shape
        Unknowns of the second tone, of unit amplitude at `position`.
    position
        Position of the retained coordinate whose amplitude is prescribed.
    defect
        Smallest over largest singular value of the linearised equations of the second tone; zero at a Neimark-Sacker
        point.
    share
        Share of the uncombined second frequency in the shape.
    """

    problem: TwoTones
    omegas: tuple[float, float]
    forced: FloatArray
    shape: FloatArray
    position: int
    defect: float
    share: float


@dataclass(frozen=True, eq=False)
class ToneOfAmplitude:
    """Second tone of prescribed amplitude, sustained by a level of damping.

    Attributes
    ----------
    amplitude
        Amplitude of the prescribed coordinate, m.
    omega
        Frequency of the second tone, rad/s.
    ratio
        Damping ratio of the second tone; negative if it grows.
    x
        Unknowns of the motion.
    converged
        Whether the motion is a solution.
    """

    amplitude: float
    omega: float
    ratio: float
    x: FloatArray
    converged: bool


@dataclass(frozen=True, eq=False)
class _Evaluation:
    residual: FloatArray
    jac: Jacobian
    seconds_contact: float


@by_one_thread
def forced_motion(problem: TwoTones, omega: float, start: ComplexArray | None = None) -> TorusMotion:
    """Return the periodic motion under the first load only, as a motion without a second tone.

    Parameters
    ----------
    problem
        Problem with all combined frequencies.
    omega
        ω1, rad/s.
    start
        (H + 1, n_retained) starting coefficients, m; None: stuck contacts.
    """
    indices = tuple(i for i in problem.balance.indices if i[1] == 0)
    alone = problem.with_indices(indices)
    path = TorusPath((1, 1), 1, 2 * problem.path(1.0).samples)
    x = None
    if start is not None:
        rows = np.zeros((len(indices), problem.balance.side.n), dtype=complex)
        own = min(len(rows), len(start))
        rows[:own] = start[:own]
        x = alone.balance.unknowns(rows)
    return alone.solve((omega, np.sqrt(2.0) * omega), x, path)


def beginnings(problem: TwoTones, forced: TorusMotion, guesses: Sequence[float]) -> list[Beginning]:
    """Return starts for a second tone near given frequencies, the most likely first.

    Parameters
    ----------
    problem
        Problem with all combined frequencies.
    forced
        Result of `forced_motion`.
    guesses
        Positive frequencies, rad/s.
    """
    balance = problem.balance
    alone = problem.with_indices(forced.indices)
    x = balance.from_other(alone.balance, forced.x)
    found = []
    for guess in guesses:
        omegas = forced.omegas[0], float(guess)
        jac = balance.linearise(x, omegas, problem.path(guess / omegas[0])).dense_jac()
        second = _of_second(problem)
        _, sizes, right = np.linalg.svd(jac[np.ix_(second, second)])
        unit = np.zeros(balance.size)
        unit[second] = right[-1]
        motion = balance.coefficients(unit)
        own = motion[balance.indices.index((0, 1))]
        position = int(np.argmax(np.abs(own)))
        share = float(np.linalg.norm(own) / np.linalg.norm(motion))
        turned = _turned(balance.indices, motion, own[position])
        shape = balance.unknowns(turned / np.abs(own[position]))
        found.append(Beginning(problem, omegas, x, shape, position, float(sizes[-1] / sizes[0]), share))
    return sorted(found, key=lambda b: (-round(b.share, 2), b.defect))


@by_one_thread
def over_amplitude(beginning: Beginning) -> Iterator[ToneOfAmplitude]:
    """Yield second tones of growing amplitude, up to the end of the branch."""
    balance = beginning.problem.balance
    size = float(np.max(np.abs(balance.coefficients(beginning.forced)[1:])))
    amplitude, factor = FIRST * size, STEP
    y = np.append(beginning.forced + amplitude * beginning.shape, [0.0, 0.0])
    before: tuple[float, FloatArray] | None = None
    last: tuple[float, FloatArray] | None = None
    while amplitude < FARTHEST * size:
        solution = _of_amplitude(beginning, y, amplitude)
        if not solution.status.converged:
            factor = np.sqrt(factor)
            if last is None or factor < SHORTEST:
                yield _told(beginning, amplitude, solution)
                return
            amplitude = last[0] * factor
            y = _guess(before, last, amplitude)
            continue
        found = _told(beginning, amplitude, solution)
        yield found
        before, last = last, (amplitude, solution.x)
        factor = min(factor**1.5, LONGEST) if solution.iterations <= FEW else factor
        amplitude *= factor
        y = _guess(before, last, amplitude)


@by_one_thread
def second_tone(beginning: Beginning) -> TorusMotion | None:
    """Return the motion with a self-sustained second tone; None if there is none at any amplitude."""
    last: ToneOfAmplitude | None = None
    for tone in over_amplitude(beginning):
        if not tone.converged:
            return None
        if last is not None and (last.ratio < 0.0) != (tone.ratio < 0.0):
            return _between(beginning, last, tone)
        last = tone
    return None


def _between(beginning: Beginning, below: ToneOfAmplitude, above: ToneOfAmplitude) -> TorusMotion | None:
    """Return the self-sustained motion between two amplitudes, halving the interval while Newton's method fails."""
    for _ in range(HALVINGS):
        share = below.ratio / (below.ratio - above.ratio)
        x = below.x + share * (above.x - below.x)
        omega = below.omega + share * (above.omega - below.omega)
        found = solve_free(beginning.problem, x, (beginning.omegas[0], omega))
        if found.converged:
            return found
        amplitude = float(np.sqrt(below.amplitude * above.amplitude))
        half = (amplitude - below.amplitude) / (above.amplitude - below.amplitude)
        guess = below.x + half * (above.x - below.x)
        rest = [np.log(omega / beginning.omegas[1]), 0.0]
        solution = _of_amplitude(beginning, np.append(guess, rest), amplitude)
        if not solution.status.converged:
            return None
        middle = _told(beginning, amplitude, solution)
        if (middle.ratio < 0.0) == (below.ratio < 0.0):
            below = middle
        else:
            above = middle
    return None


@by_one_thread
def solve_free(
    problem: TwoTones, x: FloatArray, omegas: tuple[float, float], path: TorusPath | None = None
) -> TorusMotion:
    """Solve for a motion with an unknown second frequency; the phase of the second tone is taken from the start.

    Parameters
    ----------
    problem
        Problem without a load at the second frequency.
    x
        Initial unknowns with a second tone.
    omegas
        ω1 and an estimate of ω2, rad/s.
    path
        Sampling of the torus; None: chosen from the frequencies, and adapted to the solution's ω2.
    """
    balance = problem.balance
    own = balance.coefficients(x)[balance.indices.index((0, 1))]
    position = int(np.argmax(np.abs(own)))
    turned = _turned(balance.indices, balance.coefficients(x), own[position])
    y = np.append(balance.unknowns(turned), 0.0)
    row = _row(problem) + 1

    def evaluate(v: FloatArray) -> _Evaluation:
        log_omega = float(v[-1])
        if not abs(log_omega) < WANDERED:
            return _out_of_bounds(v)
        now = omegas[0], omegas[1] * float(np.exp(log_omega))
        at = balance.linearise(v[:-1], now, used)
        place = row * balance.side.n + position
        jac = Bordered(at.jac, now[1] * at.by_second, _one_at(place, x.size), 0.0)
        held = v[place]
        return _Evaluation(np.append(at.residual, held), jac, at.seconds_contact)

    used = path or problem.path(omegas[1] / omegas[0])
    solution = newton(evaluate, y, problem.newton)
    spent = solution.iterations
    for _ in range(PATHS):
        better = path or problem.path(omegas[1] * float(np.exp(solution.x[-1])) / omegas[0])
        if not solution.status.converged or better == used:
            break
        used = better
        solution = newton(evaluate, solution.x, problem.newton)
        spent += solution.iterations
    solution = replace(solution, iterations=spent)
    now = omegas[0], omegas[1] * float(np.exp(np.clip(solution.x[-1], -WANDERED, WANDERED)))
    motion = problem.motion(solution.x[:-1], now, solution, used)
    size = float(np.max(np.abs(motion.coefficients[1:])))
    alone = [place for place, (_, k) in enumerate(motion.indices) if k != 0]
    if float(np.max(np.abs(motion.coefficients[alone]))) < STILL * size:
        # the second tone has vanished, so its frequency is undetermined
        return replace(motion, status=Status.SINGULAR)
    return motion


def _of_amplitude(beginning: Beginning, y: FloatArray, amplitude: float) -> Solution:
    """Solve for the motion, ln ω2 and the level of damping at an amplitude of the second tone."""
    problem = beginning.problem
    balance, (first, guess) = problem.balance, beginning.omegas
    place = _row(problem) * balance.side.n + beginning.position
    rows = place, place + balance.side.n
    target = amplitude / balance.displacement_scale
    path = problem.path(guess * float(np.exp(y[-2])) / first)

    def evaluate(v: FloatArray) -> _Evaluation:
        log_omega, level = float(v[-2]), float(v[-1])
        if not abs(log_omega) < WANDERED:
            return _out_of_bounds(v)
        omegas = first, guess * float(np.exp(log_omega))
        rate = level * guess
        x = v[:-2]
        at = balance.linearise(x, omegas, path, rate)
        by_level = guess * balance.by_damping(x, omegas, rate, 1e-4 * guess)
        columns = np.stack([omegas[1] * at.by_second, by_level], axis=1)
        own = np.stack([_one_at(place, x.size) for place in rows])
        jac = Bordered(at.jac, columns, own, np.zeros((2, 2)))
        held = [x[rows[0]] - target, x[rows[1]]]
        return _Evaluation(np.append(at.residual, held), jac, at.seconds_contact)

    return newton(evaluate, y, problem.newton)


def _told(beginning: Beginning, amplitude: float, solution: Solution) -> ToneOfAmplitude:
    guess = beginning.omegas[1]
    omega = guess * float(np.exp(np.clip(solution.x[-2], -WANDERED, WANDERED)))
    ratio = 0.5 * float(solution.x[-1]) * guess / omega
    return ToneOfAmplitude(amplitude, omega, ratio, solution.x[:-2], solution.status.converged)


def _guess(before: tuple[float, FloatArray] | None, last: tuple[float, FloatArray], amplitude: float) -> FloatArray:
    """Extrapolate linearly from two points; return a single point unchanged."""
    if before is None:
        return last[1]
    share = (amplitude - last[0]) / (last[0] - before[0])
    return np.asarray(last[1] + share * (last[1] - before[1]))


def _of_second(problem: TwoTones) -> BoolArray:
    """Return whether each unknown belongs to a combined frequency that contains the second one."""
    rows = [k != 0 for _, k in problem.balance.indices[1:] for _ in range(2)]
    return np.repeat([False, *rows], problem.balance.side.n)


def _turned(indices: Sequence[tuple[int, int]], motion: ComplexArray, along: complex) -> ComplexArray:
    """Return a motion with its second phase shifted so that `along`, a coefficient of (0, 1), is real and positive."""
    angle = float(np.angle(along))
    turns = np.array([np.exp(-1j * k * angle) for _, k in indices])
    return np.asarray(turns[:, None] * motion)


def _row(problem: TwoTones) -> int:
    """Return the row of the cosine part of the second frequency."""
    return 2 * problem.balance.indices.index((0, 1)) - 1


def _one_at(place: int, size: int) -> FloatArray:
    """Return the derivative (size,) of one unknown by all unknowns."""
    return np.asarray(np.eye(1, size, place)[0])


def _out_of_bounds(v: FloatArray) -> _Evaluation:
    return _Evaluation(np.full(v.size, np.inf), np.eye(v.size), 0.0)


@dataclass(frozen=True, eq=False)
class Found:
    """Result of a search for a second tone.

    Attributes
    ----------
    motion
        Motion with a second tone; None without one.
    forced
        Forced motion without a second tone.
    ratio
        Damping ratio at small amplitudes of the last examined second tone, or of a growing one if there is any; NaN if
        none was examined.
    near
        Frequency of this tone, rad/s; NaN if none was examined.
    """

    motion: TorusMotion | None
    forced: TorusMotion
    ratio: float
    near: float


@by_one_thread
def tone_beside(
    problem: TwoTones, omega: float, guesses: Sequence[float], starts: Iterable[ComplexArray] = ()
) -> Found:
    """Return the motion whose second tone grows out of the forced motion at a frequency.

    Parameters
    ----------
    problem
        Problem without a load at the second frequency.
    omega
        Frequency ω1 of the load, rad/s.
    guesses
        Estimates of the frequency of the second tone, rad/s.
    starts
        Further starts (H + 1, n_retained), m, for the forced motion, if it is not found from stuck contacts.
    """
    forced = forced_motion(problem, omega)
    for start in starts if not forced.converged else ():
        forced = forced_motion(problem, omega, start)
        if forced.converged:
            break
    ratio = near = float("nan")
    if not forced.converged:
        return Found(None, forced, ratio, near)
    for begin in beginnings(problem, forced, distinct(guesses, omega))[:TRIED]:
        first = next(over_amplitude(begin))
        if not first.converged:
            continue
        if ratio < 0.0 and first.ratio >= 0.0:
            continue  # the ratio of a growing tone is kept
        ratio, near = first.ratio, first.omega
        if ratio >= 0.0:
            continue
        motion = second_tone(begin)
        if motion is not None:
            return Found(motion, forced, ratio, near)
    return Found(None, forced, ratio, near)


def swept(problem: TwoTones, load: HarmonicLoad, omega: float) -> Iterator[ComplexArray]:
    """Yield forced motions (H + 1, n_retained) of a single structure at a frequency, m.

    They lie on branches from below and from above.
    """
    retained = problem.balance.side.first.retained
    ways: tuple[tuple[float, Literal["up", "down"]], ...] = ((1 - WIDE, "up"), (1 + WIDE, "down"))
    for far, direction in ways:
        ends = sorted((far * omega, omega))
        sweep = Sweep(
            omega_range=(ends[0], ends[1]),
            low=ORDER,
            high=ORDER,
            selection="always_low",
            points=10,
            peak_points=0,
            direction=direction,
        )
        try:
            forced = forced_problem(problem.system, load, sweep)
            points = accepted_points(list(forced_response(problem.system, load, sweep)))
        except (StickslipError, FloatingPointError, np.linalg.LinAlgError):
            continue
        for point in points:
            if point.converged and abs(point.omega / omega - 1.0) < POINT_DISTANCE_RTOL:
                yield forced.low.linear.recover(point.omega, point.coefficients)[:, retained]


def growing_tones(problem: TwoTones, load: HarmonicLoad, omega: float) -> tuple[list[float], str]:
    """Return the frequencies, rad/s, of growing disturbances of the forced motion, from its multipliers.

    The problem is a single structure.

    Returns
    -------
    list[float], str
        Frequencies, and the reason why the multipliers do not prove stability; an empty string if they do.
    """
    sweep = Sweep(
        omega_range=((1.0 - NARROW) * omega, (1.0 + NARROW) * omega),
        at=(omega,),
        low=ORDER,
        high=ORDER,
        selection="always_low",
        peak_points=0,
    )
    try:
        forced = forced_problem(problem.system, load, sweep)
        points = accepted_points(list(forced_response(problem.system, load, sweep)))
        known = [p for p in points if p.converged]
        if not known:
            return [], f"no multipliers: the forced motion was not found with {ORDER} harmonics"
        found = stability(forced, known[0])
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError) as error:
        return [], f"no multipliers ({str(error).removesuffix('.')})"
    multipliers = found.floquet.multipliers
    doubt = "" if found.verdict == "stable" else f"{found.verdict}: {found.reason}"
    return tones_of_multipliers(multipliers[np.isfinite(multipliers)], omega, HIGHEST), doubt


def tones_of_multipliers(multipliers: ComplexArray, omega: float, highest: int, count: int = 1) -> list[float]:
    """Return the possible frequencies, rad/s, of the fastest growing disturbances, near every harmonic of the motion.

    Parameters
    ----------
    multipliers
        Floquet multipliers of a motion.
    omega
        Frequency of the motion, rad/s.
    highest
        Highest harmonic h of the frequencies.
    count
        Number of pairs of multipliers.

    Notes
    -----
    The angle φ of a multiplier determines the frequency of the disturbance only up to multiples of ω: ``|h ω ± φ ω /
    2π|``.
    """
    grow = [
        value
        for value in sorted(multipliers, key=abs, reverse=True)
        if abs(value) > 1.0 and REAL < np.angle(value) < np.pi - REAL
    ]
    return [
        abs(h + sign * float(np.angle(value)) / (2.0 * np.pi)) * omega
        for value in grow[:count]
        for h in range(highest + 1)
        for sign in ((1.0, -1.0) if h else (1.0,))
    ]


def distinct(frequencies: Sequence[float], omega: float) -> list[float]:
    """Return the frequencies that are no multiples of `omega` and differ by more than 0.1 %."""
    out: list[float] = []
    for one in frequencies:
        off = abs(one / omega - round(one / omega))
        if one > 0.0 and off > 1e-4 and all(abs(one / known - 1.0) > 1e-3 for known in out):
            out.append(float(one))
    return out
