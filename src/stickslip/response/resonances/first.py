"""Initial resonance peaks: maxima of one sweep, and subharmonic resonances on isolated branches.

For a subharmonic resonance, Newton's method starts from the period-one response plus the motion of least resistance at
the lower frequency, with various amplitudes and phases. The branch of a solution is then followed over the frequency in
both directions.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import get_args

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import check_choice, input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import one_structure
from stickslip.harmonic.parameters import BalanceAt
from stickslip.harmonic.peak import Driven, Peak, PeakProblem, driven_by
from stickslip.response.continuation.branch import following_vibration, steps_through
from stickslip.response.continuation.starting_solutions import plain_sweep, without_branch
from stickslip.response.parameter import Discretisation, Parameter, parameter_family, system_at
from stickslip.response.resonances.point import PeakPoint
from stickslip.response.system import System
from stickslip.solve.branch import Following
from stickslip.solve.continuation import Point, reversed_point, start_point, trace
from stickslip.solve.krylov import to_tolerance
from stickslip.solve.linear import factorised
from stickslip.solve.newton_method import Newton, newton

FREQUENCIES = 9  # of the search within the range
AMPLITUDES = (1.0, 2.0, 4.0, 8.0, 0.5, 16.0)  # over the amplitude of the period-one response
PHASES = 6  # within the range of distinct phases; beyond, the motion is the same some load periods later
LEAST = 1e-3  # share of the lowest harmonic in the motion, below which it is the period-one response
CLOSED = 0.02  # distance from its start, relative to the motion and to the range, at which a branch has closed ...
FEW = 8  # ... after at least this number of points
BESIDE = 0.1  # distance of a branch beyond the range, over the range
POINTS = 200  # of a branch in each direction
SWEEP_POINTS = 40  # smallest number of points of the sweep
STEPS = 12  # Newton steps from peak to peak
EVALUATIONS_BESIDE = 2  # evaluations for a point of a sweep in addition to one for each Newton step: start and tangent
EXACT = 1e-12  # relative residual of sensitivities from an iterative solver ...
STEP = 1e-6  # ... and of Newton steps, each of which costs three evaluations and two sensitivities
FOLD_OVERLAP_LOG_OMEGA = 1e-6  # distance in ln ω of a peak beyond its neighbours at a fold
SWEEPS = 8  # largest number of sweeps, at values spread over the range of peaks followed back
SAG = 0.02  # largest relative height of a peak above the neighbouring sweep points; at most 0.5 % for 80 peaks
STANDS_OUT = 1.01  # smallest ratio of a maximum to the higher one of the minima beside it


@dataclass(frozen=True, eq=False)
class PeakSearch:
    """Resonance to follow, and its defining condition.

    Parameters
    ----------
    system, load, parameter, omega_range, by, output, how
        As in `track_peak`; `how` is its discretisation.
    harmonic
        Harmonic whose amplitude peaks, for example in a superharmonic resonance; None: the driven harmonics.
    periods
        Periods of the load after which the motion repeats; 2 or more for subharmonic resonances. Harmonics, energies
        and phases then refer to the lower frequency, and the default harmonic is the lowest one. `omega_range` always
        refers to the load.

    Raises
    ------
    InputError
        If the condition, the output or the harmonic is unknown, or the range is empty.
    """

    system: System
    load: HarmonicLoad
    parameter: Parameter
    omega_range: tuple[float, float]
    by: Peak = "horizontal_tangent"
    output: int = 0
    how: Discretisation = field(default_factory=Discretisation)
    harmonic: int | None = None
    periods: int = 1

    def __post_init__(self) -> None:
        check_choice("by", self.by, get_args(Peak))
        if not 0 <= self.output < self.system.outputs.size:
            have = self.system.outputs.size
            raise input_error("output", f"is {self.output}, of {have} outputs", f"Give 0 to {have - 1}.")
        begin, end = self.omega_range
        if not 0.0 < begin < end < np.inf:
            raise input_error("omega_range", f"must be positive and growing, got {begin} to {end} rad/s", "Swap them.")
        if self.harmonic is not None and not 1 <= self.harmonic <= self.how.order:
            raise input_error(
                "harmonic",
                f"is {self.harmonic}, of {self.how.order} harmonics",
                "Give one of them, or take more harmonics.",
            )

        if self.periods < 1 or self.periods > self.how.order:
            raise input_error(
                "periods",
                f"is {self.periods}, of {self.how.order} harmonics",
                "Give 1 or more, and at least as many harmonics: the load is in that one.",
            )
        if self.periods > 1:
            one_structure(self.system.structure, "a subharmonic resonance")

    @property
    def peaking(self) -> int | None:
        """Harmonic whose amplitude peaks; None for the driven ones."""
        return 1 if self.harmonic is None and self.periods > 1 else self.harmonic

    @property
    def lower_range(self) -> tuple[float, float]:
        """Range of the first harmonic's frequency, rad/s."""
        begin, end = self.omega_range
        return begin / self.periods, end / self.periods

    @property
    def peaking_dof(self) -> int:
        """Dof whose amplitude peaks."""
        return int(self.system.outputs[self.output])

    def family(self, first: float) -> BalanceAt:
        """Return the balances as a function of the parameter, scaled as for the `first` value."""
        return parameter_family(
            self.system,
            self.load,
            self.parameter,
            first,
            lambda s, f: self.how.balance(s, f.over_periods(self.periods), np.array([self.peaking_dof])),
        )

    def problem(self, first: float) -> PeakProblem:
        """Return the equation of a peak, with frequencies scaled by the end of the range."""
        family = self.family(first)
        balance = family(first)
        harmonics, phase = driven_by(balance.linear.load)
        if self.peaking is not None:
            times = self.peaking / harmonics[0]
            if self.by == "phase_quadrature" and times % 2 != 1:
                raise input_error(
                    "by",
                    f"is phase_quadrature for harmonic {self.peaking} under a load in harmonic {harmonics[0]}",
                    "Only odd multiples of the load's harmonic peak in quadrature with it: take horizontal_tangent or variable_phase.",
                )
            own = balance.linear.load.harmonics.get(self.peaking)
            # a driven harmonic has the phase of its force; another one shifts with the origin of time like the load
            phase = phase * times if own is None else float(np.angle(own[np.argmax(np.abs(own))]))
            harmonics = (self.peaking,)
        position = int(np.searchsorted(balance.linear.retained, self.peaking_dof))
        invert = partial(factorised, to_tolerance(self.how.newton.linear, EXACT))
        driven = Driven(position, harmonics)
        scale = self.lower_range[1]
        return PeakProblem(family, self.by, driven, phase, scale, invert)


@dataclass(frozen=True, eq=False)
class Start:
    """Start near a peak.

    Parameters
    ----------
    problem
        Equation of the peak, with frequencies scaled by the peak's.
    y
        (size + 1,) unknowns.
    value
        Value of the parameter.
    newton
        Corrector from peak to peak.
    height
        Amplitude, m.
    """

    problem: PeakProblem
    y: FloatArray
    value: float
    newton: Newton
    height: float


def first_peaks(search: PeakSearch, value: float) -> tuple[list[Start], int]:
    """Return the peaks of the response at a parameter value, the highest first.

    The second result is the number of evaluations of the sweep.

    Raises
    ------
    InputError
        If there is no peak in the range.
    """
    if not np.isfinite(value):
        raise input_error("values", f"are empty or hold {value}", "Give finite numbers.")
    problem = search.problem(value)
    points, motions = _swept(search, problem, value)
    heights = np.linalg.norm(motions, axis=1)
    if not points or int(np.argmax(heights)) in (0, len(points) - 1):
        raise input_error(
            "omega_range",
            f"holds no peak at {value:g}: of {len(points)} solutions the first or the last is the highest",
            "Widen it, or choose another output.",
        )
    few = replace(
        search.how.newton,
        max_iterations=min(STEPS, search.how.newton.max_iterations),
        linear=to_tolerance(search.how.newton.linear, STEP),
    )
    starts = []
    for top in maxima(heights):
        x, omega = _near(problem, points, motions, top)
        own, y = replace(problem, omega_scale=omega), np.append(x, 0.0)
        here = own.state(y, value)
        own = own.sharpened(here).aligned(here)
        starts.append(Start(own, y, value, few, float(heights[top])))
    return starts, sum(p.solution.iterations + EVALUATIONS_BESIDE for p in points)


def met_by_a_sweep(search: PeakSearch, peaks: Sequence[PeakPoint]) -> list[bool]:
    """Return for each peak at one parameter value whether a sweep passes it.

    Parameters
    ----------
    search
        Resonance; its range of frequencies is swept once.
    peaks
        Converged peaks at the same value.
    """
    value = peaks[0].value
    problem = search.problem(value)
    points, motions = _swept(search, problem, value)
    if not points:
        return [False] * len(peaks)
    log_omega = np.log(search.periods * np.array([p.p for p in points]))
    log_height = np.log(np.linalg.norm(motions, axis=1))
    return [_goes_over(log_omega, log_height, peak) for peak in peaks]


def _goes_over(log_omega: FloatArray, log_height: FloatArray, peak: PeakPoint) -> bool:
    """Whether a curve of points passes a peak: two neighbouring points on both sides of it have its height."""
    place, height = np.log(peak.omega), np.log(peak.amplitude)
    low = np.minimum(log_omega[:-1], log_omega[1:]) - FOLD_OVERLAP_LOG_OMEGA
    high = np.maximum(log_omega[:-1], log_omega[1:]) + FOLD_OVERLAP_LOG_OMEGA
    above = np.maximum(log_height[:-1], log_height[1:])
    return bool(np.any((low <= place) & (place <= high) & (np.abs(above - height) <= SAG)))


def _swept(search: PeakSearch, problem: PeakProblem, value: float) -> tuple[list[Point], ComplexArray]:
    """Return the points of a sweep at a parameter value, and the motion of the output at each."""
    balance, how = problem.family(value), search.how
    changed = system_at(search.system, search.parameter, value, balance)
    if search.periods > 1:
        points = motions_of_several_periods(
            changed, balance, search.lower_range, search.periods, SWEEP_POINTS, how.newton
        )
    else:
        found = plain_sweep(changed, balance, search.omega_range, SWEEP_POINTS, how.newton)
        points = [f.point for f in found if f.converged]
    motions = [problem.driven.motion(balance, p.x) for p in points]
    return points, np.array(motions).reshape(len(points), -1)


def maxima(heights: FloatArray) -> list[int]:
    """Return the indices of distinct maxima of heights along a branch, the highest first, without the ends."""
    order = np.argsort(-heights)
    found = []
    for top in map(int, order):
        if top in (0, heights.size - 1):
            continue
        sides = [_descent(heights, top, way) for way in (-1, 1)]
        if heights[top] >= STANDS_OUT * max(sides) or top == order[0]:
            found.append(top)
    return found


def _descent(heights: FloatArray, top: int, way: int) -> float:
    """Return the lowest height between an index and the next higher point in a direction.

    Of equal heights the first counts as higher.
    """
    beside = heights[top + 1 :] if way > 0 else heights[top - 1 :: -1]
    higher = np.flatnonzero(beside > heights[top] if way > 0 else beside >= heights[top])
    between = beside[: higher[0]] if higher.size else beside
    return float(np.min(between, initial=heights[top]))


def _near(problem: PeakProblem, points: list[Point], motions: ComplexArray, top: int) -> tuple[FloatArray, float]:
    """Return state and frequency near a maximum of a sweep, or near the quadrature next to it."""
    if problem.by != "phase_quadrature":
        return points[top].x, points[top].p
    in_phase = np.real(motions[:, 0] * np.exp(-1j * problem.phase))
    crossings = np.flatnonzero(in_phase[:-1] * in_phase[1:] <= 0.0)
    if crossings.size == 0:
        raise input_error(
            "omega_range",
            "holds no frequency at which the output is in quadrature with the force",
            "Track the horizontal tangent.",
        )
    i = int(crossings[np.argmin(np.abs(crossings + 0.5 - top))])
    share = in_phase[i] / (in_phase[i] - in_phase[i + 1])
    a, b = points[i], points[i + 1]
    return a.x + share * (b.x - a.x), a.p + share * (b.p - a.p)


def motions_of_several_periods(
    system: System,
    balance: HarmonicBalance,
    omega_range: tuple[float, float],
    periods: int,
    points: int,
    options: Newton,
) -> list[Point]:
    """Return motions that repeat after several load periods, over the frequency, in the order of their branch.

    Parameters
    ----------
    system
        System of `balance`.
    balance
        Balance at the lower frequency.
    omega_range
        Range of the lower frequency, rad/s.
    periods
        Load periods in one period of the motion.
    points
        Smallest number of steps through the range.
    options
        Corrector options.

    Raises
    ------
    InputError
        If no such motion is found.
    """
    first, last = omega_range
    way = following_vibration(balance, steps_through(last - first, points), options)
    for omega in np.linspace(first, last, FREQUENCIES + 2)[1:-1]:
        for x in _motions(system, balance, float(omega), periods, options):
            start = start_point(balance, x, float(omega), way)
            if not start.solution.status.converged:
                continue
            up = _followed(balance, start, omega_range, last, way)
            down = _followed(balance, reversed_point(start), omega_range, first, way)
            return [*down[::-1], start, *up]
    tries = FREQUENCIES * len(AMPLITUDES) * PHASES
    raise input_error(
        "omega_range",
        f"holds no motion of {periods} periods that was found from {tries} starts, which proves that there is none as little as a march in time does",
        "Give a narrower range, another value or a larger load; `bifurcations.subharmonic_branch` takes a start of your own.",
    )


def _motions(
    system: System, balance: HarmonicBalance, omega: float, periods: int, options: Newton
) -> Iterator[FloatArray]:
    """Yield motions with a lowest harmonic at a frequency."""
    plain = without_branch(system, balance, options, omega)
    if not plain.status.converged:
        return
    n = balance.linear.n
    own = slice(n, 3 * n)  # the lowest harmonic: cosine and sine parts
    jac = balance.linearise(plain.x, omega).dense_jac()[own, own]
    shape = np.linalg.svd(jac)[2][-1]
    motion = (shape[:n] - 1j * shape[n:]) / np.linalg.norm(shape)
    size = float(np.linalg.norm(plain.x[n:]))
    for amplitude in AMPLITUDES:
        for turn in np.arange(PHASES) * 2.0 * np.pi / (periods * PHASES):
            added = amplitude * size * motion * np.exp(1j * turn)
            guess = plain.x.copy()
            guess[own] += np.concatenate([added.real, -added.imag])
            found = newton(lambda v: balance.linearise(v, omega), guess, options)
            if found.status.converged and _subharmonic(balance, found.x):
                yield found.x


def _subharmonic(balance: HarmonicBalance, x: FloatArray) -> bool:
    n = balance.linear.n
    return bool(np.linalg.norm(x[n : 3 * n]) > LEAST * np.linalg.norm(x[n:]))


def _followed(
    balance: HarmonicBalance, start: Point, omega_range: tuple[float, float], end: float, way: Following
) -> list[Point]:
    """Follow the branch until it leaves the range, closes or joins the period-one response."""
    found: list[Point] = []
    first, last = omega_range
    beside = BESIDE * (last - first)
    for point in trace(balance, start, end, way):
        lost = not point.solution.status.converged or not _subharmonic(balance, point.x)
        if lost or len(found) == POINTS or not first - beside < point.p < last + beside:
            break
        found.append(point)
        near = np.linalg.norm(point.x - start.x) < CLOSED * np.linalg.norm(start.x)
        if len(found) > FEW and near and abs(point.p - start.p) < CLOSED * (last - first):
            break
    return found


def unmet_peaks(
    search: PeakSearch, points: Sequence[PeakPoint], values: Sequence[float], later: int
) -> list[tuple[int, float]]:
    """Return number and value of the peaks that no sweep has confirmed.

    Parameters
    ----------
    search
        Search of the peaks.
    points
        All points found.
    values
        Values in the order of visits; the peaks of the last one were found by a sweep.
    later
        Number of the first peak that was followed back.
    """
    back = [p for p in points if p.peak >= later and p.converged and p.is_maximum]
    places = [i for i, v in enumerate(values[:-1]) if any(p.value == v for p in back)]
    share = np.linspace(0, len(places) - 1, min(SWEEPS, len(places)))
    swept = sorted({places[int(i)] for i in share})
    met: dict[tuple[int, int], bool] = {}
    for i in swept:
        here = [p for p in back if p.value == values[i]]
        met |= {(p.peak, i): own for p, own in zip(here, met_by_a_sweep(search, here), strict=True)}

    def reached(peak: int, i: int) -> bool:
        # a peak that sweeps meet on both sides of a value would be met there as well
        before = max((j for j in swept if j <= i), default=-1)
        after = min((j for j in swept if j >= i), default=len(values) - 1)
        return met.get((peak, before), False) and met.get((peak, after), False)

    return [(p.peak, p.value) for p in back if p.value != values[-1] and not reached(p.peak, values.index(p.value))]
