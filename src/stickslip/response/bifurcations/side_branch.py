"""Branches beside the forced response: with doubled period, with less symmetry, or isolated subharmonic ones.

Branch switching finds the directions of the crossing branches and the first point of each.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.bifurcations.found import Bifurcation
from stickslip.response.bifurcations.period_multiplied import every_sector, in_periods, over_periods
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point, with_stiffness
from stickslip.solve.branch import Following, Point, measure_at, reversed_point
from stickslip.solve.continuation import advance, start_point, step_to
from stickslip.solve.steps import take_step
from stickslip.units import HZ, millimetres

POINTS = 80  # largest number of points of a branch
ALIKE = 1e-3  # relative difference from the original branch below which a motion belongs to it
CLOSED = 0.5  # largest distance of the first point from the line between two points of a closing branch, in steps
MIN_POINTS_BEFORE_CLOSING = 6
TURNS = 24  # points within a small share of the longest step that show a branch stuck at a corner
SHORT = 0.02  # this share
CLOSES = "it closes in itself"
LEAVES = "it leaves the range of frequencies"
AWAY = (
    0.05,
    0.1,
    0.2,
    0.02,
    0.4,
    0.01,
    0.003,
    0.001,
)  # distances along the new branch at which its first point is sought, relative to the motion
ROUNDS = 6  # of inverse iteration: the smallest singular value is well separated
BESIDE = 1e-12  # shift over the largest entry, against division by zero in a singular matrix


def _never() -> str:
    """Return no reason to end a branch."""
    return ""


@dataclass(frozen=True, eq=False)
class SideBranch:
    """Branch of motions beside a forced response.

    Parameters
    ----------
    problem
        Forced response of its points: over several periods of the load, of all sectors of a wheel, or the original one.
    periods
        Periods of the load in one period of the motion.
    points
        Points along the branch, from the first one found. Their frequency is the load frequency over `periods`.
    end
        Reason for the end of the branch, in words.
    sector_of
        (n_retained,) sector of each retained coordinate of a wheel; None for other structures.
    """

    problem: ForcedProblem
    periods: int
    points: tuple[ForcedPoint, ...]
    end: str
    sector_of: IntArray | None = None

    @property
    def omegas(self) -> FloatArray:
        """(points,) frequencies of the load, rad/s."""
        return self.periods * np.array([p.omega for p in self.points])

    @property
    def amplitudes(self) -> FloatArray:
        """(points,) amplitudes over the driven harmonics, m."""
        return np.array([self.problem.amplitude(p) for p in self.points])

    def amplitude(self, point: ForcedPoint, output: int) -> float:
        """Return the amplitude of an output over the driven harmonics, m; on a wheel the largest of all sectors."""
        where = [self.problem.amplitude_of(point.omega, point.coefficients, o) for o in self._of_all(output)]
        return float(max(where))

    def subharmonic(self, point: ForcedPoint, output: int = 0) -> float:
        """Return the amplitude of an output over all subharmonic terms, m; on a wheel the largest of all sectors."""
        motion = self.problem.low.linear.recover(point.omega, point.coefficients)
        rows = motion[:, self.problem.system.outputs[self._of_all(output)]]
        rows[:: self.periods] = 0.0
        return float(np.linalg.norm(rows, axis=0).max())

    def _of_all(self, output: int) -> list[int]:
        """Return the positions of an output in all sectors."""
        if self.sector_of is None:
            return [output]
        each = self.problem.system.outputs.size // (int(self.sector_of.max()) + 1)
        return list(range(output, self.problem.system.outputs.size, each))

    def localisation(self, point: ForcedPoint) -> float:
        """Return the share of the squared amplitudes in the most active sector.

        Without a wheel it refers to the most active coordinate.
        """
        size = np.sum(np.abs(point.coefficients[1:]) ** 2, axis=0)
        group = np.arange(size.size) if self.sector_of is None else self.sector_of
        each = np.bincount(group, size)
        return float(each.max() / each.sum())

    @property
    def sentence(self) -> str:
        """Description of the branch."""
        kind = f"with a period of {self.periods} periods of the load" if self.periods > 1 else "of less symmetry"
        if not self.points:
            return f"no branch {kind} was found: {self.end}"
        ends = self.omegas / HZ
        return (
            f"branch {kind}, {len(self.points)} points between {ends.min():.6g} and {ends.max():.6g} Hz, "
            f"amplitude up to {millimetres(self.amplitudes.max())}; {self.end}"
        )


@by_one_thread
def side_branches(problem: ForcedProblem, bifurcation: Bifurcation, *, points: int = POINTS) -> list[SideBranch]:
    """Follow the branches that leave a forced response at a bifurcation.

    At a period doubling the motion covers two periods of the load. At a branch point of a tuned wheel every sector may
    move differently. Branches leave along the null directions of the Jacobian. They are followed by arc length, with
    fixed harmonics, until they return, leave the frequency range, or reach the largest number of points.

    Parameters
    ----------
    problem
        The forced response with the bifurcation.
    bifurcation
        A period doubling, a branch point, or a jump of a real multiplier.
    points
        Largest number of points of each branch.

    Raises
    ------
    InputError
        At a fold, where no other branch leaves, and at a Neimark-Sacker bifurcation, whose motions are not periodic.
    """
    periods = _periods(bifurcation)
    point, group, own = bifurcation.point, None, problem
    if problem.system.structure.wheel is not None:
        wheel = every_sector(problem)
        own, point, group = wheel.problem, wheel.spread(point), wheel.sector_of
    if periods > 1:
        own, point = over_periods(own, periods, point.order), in_periods(point, periods)
    balance = with_stiffness(own.balance(point.support))
    following = own.following(balance)
    x = balance.unknowns(point.coefficients)
    main = start_point(balance, x, point.omega, following)
    if not main.solution.status.converged:
        return [SideBranch(own, periods, (), "the bifurcation is no solution there", group)]
    count = max(1, bifurcation.multiplicity)
    open_ways = open_directions(balance, main, following, count)
    way = _Way(own, balance, following, points)
    made: list[SideBranch] = []
    begun: list[Point] = []
    for direction in candidates(open_ways, balance, group):
        first = first_point(balance, main, direction, following, way.ends[1])
        if first is None or _same(balance, first, begun, group):
            continue
        begun.append(first)
        found, end = way.followed(first, _Apart(balance, following, main, first))
        made.append(SideBranch(own, periods, tuple(map(way.point, found)), end, group))
    nothing = "no solution lies beside the bifurcation in the directions that its equations leave open"
    return made or [SideBranch(own, periods, (), nothing, group)]


@by_one_thread
def subharmonic_branch(
    problem: ForcedProblem, omega: float, periods: int, start: ComplexArray, *, points: int = POINTS
) -> SideBranch:
    """Follow subharmonic motions from a given one in both directions; they may be isolated from the forced response.

    Parameters
    ----------
    problem
        The forced response, of one structure.
    omega
        Frequency of the load at the start, rad/s.
    periods
        Periods of the load in one period of the motion: 3 for a motion of ω/3.
    start
        (H+1, n_retained) coefficients of a motion near the branch, m, in harmonics of ω / `periods`, from a time
        integration or a guess.
    points
        Largest number of points.

    Raises
    ------
    InputError
        If `start` has another number of coordinates than are retained.
    """
    order = (
        problem.sweep.high_harmonics[-1]
        if not problem.sweep.auto
        else problem.sweep.supports[min(1, len(problem.sweep.supports) - 1)][-1]
    )
    own = over_periods(problem, periods, order)
    balance = own.low
    given = np.asarray(start, dtype=complex)
    if given.ndim != 2 or given.shape[1] != balance.linear.n:
        raise input_error(
            "subharmonic_branch: start",
            f"has shape {given.shape}, the retained coordinates are {balance.linear.n}",
            "Give coefficients (harmonics, retained coordinates), harmonic 0 first.",
        )
    following = own.following(balance)
    patient = replace(following, newton=problem.sweep.newton)
    first = start_point(balance, balance.unknowns(given), omega / periods, patient)
    if not first.solution.status.converged:
        said = f"no motion was found from the start ({first.solution.status.advice})"
        return SideBranch(own, periods, (), said)
    made = SideBranch(own, periods, (_point(balance, first),), "")
    if made.subharmonic(made.points[0]) <= ALIKE * own.amplitude(made.points[0]):
        return replace(made, points=(), end="the start leads to the motion of the load's own period")
    along, end = both_ways(own, balance, following, first, points)
    return replace(made, points=tuple(along), end=end)


def both_ways(
    problem: ForcedProblem,
    balance: Balance,
    following: Following,
    first: Point,
    points: int,
    over: Callable[[], str] = _never,
) -> tuple[list[ForcedPoint], str]:
    """Follow a branch from one of its points in both directions.

    Return at most `points` points in their order, and the reason for the end.

    `over` is called before each step; a non-empty result ends the branch and is the reason.
    """
    way = _Way(problem, balance, following, points, over)
    upward, end = way.followed(first, way.closes(first))
    ends = [end]
    downward: list[Point] = []
    if end != CLOSES and len(upward) < points:
        left = replace(way, points=points - len(upward) + 1)
        downward, other = left.followed(reversed_point(first), None)
        ends.insert(0, other)
    return [way.point(p) for p in (*downward[:0:-1], *upward)], "; ".join(dict.fromkeys(ends))


Stop = Callable[[Point, Point], str]


@dataclass(frozen=True, eq=False)
class _Way:
    """Continuation of the branches of a problem."""

    problem: ForcedProblem
    balance: Balance
    following: Following
    points: int
    over: Callable[[], str] = _never

    @property
    def ends(self) -> tuple[float, float]:
        """Frequency range, rad/s."""
        return self.problem.sweep.omega_range

    def point(self, point: Point) -> ForcedPoint:
        """Return a point of the continuation as a point of the response."""
        return _point(self.balance, point)

    def followed(self, first: Point, stops: Stop | None) -> tuple[list[Point], str]:
        """Follow a branch from a first point along its tangent; return its points and the reason for the end."""
        low, high = self.ends
        found = [first]
        while len(found) < self.points:
            here = found[-1]
            end = high if here.tangent[-1] > 0.0 else low
            if not low < here.p < high:
                return found, LEAVES
            if why := self.over():
                return found, why
            after = advance(self.balance, here, end, self.following)
            if not after.solution.status.converged:
                return found, f"lost at {here.p * self._load / HZ:.6g} Hz ({after.solution.status.advice})"
            why = stops(here, after) if stops else ""
            if why:
                return found, why
            found.append(after)
            if self._stuck(found):
                return found[:-TURNS], "its contacts hold it at a corner, where it turns to and fro"
        return found, "it goes on beyond as many points as were allowed"

    def _stuck(self, found: list[Point]) -> bool:
        """Whether the last points lie within a small share of the longest step."""
        if len(found) <= 2 * TURNS:
            return False
        last = found[-TURNS:]
        measure = measure_at(last[0].x, self.following)
        far = max(measure.of(p.y - last[0].y) for p in last)
        return far < SHORT * self.following.control.largest

    @property
    def _load(self) -> float:
        """Load periods in one period of the motion."""
        return float(min(h for h, f in self.problem.low.linear.load.harmonics.items() if np.any(f)))

    def closes(self, first: Point) -> Stop:
        """Return a stop condition for a branch that returns to its first point in the same direction."""
        count = [0]

        def stop(before: Point, after: Point) -> str:
            count[0] += 1
            measure = measure_at(first.x, self.following)
            step, left = after.y - before.y, first.y - before.y
            length = measure.of(step)
            share = float(measure.row(step) @ left) / length**2
            passed = 0.0 <= share <= 1.0
            near = measure.of(left - share * step) <= CLOSED * length
            alike = measure.cosine(first.tangent, after.tangent) > 0.0
            return CLOSES if count[0] >= MIN_POINTS_BEFORE_CLOSING and passed and near and alike else ""

        return stop


@dataclass(eq=False)
class _Apart:
    """Difference of a branch from the original branch at the same frequency.

    It passes zero where the branch returns.
    """

    balance: Balance
    following: Following
    main: Point
    first: Point

    def __post_init__(self) -> None:
        self.before: FloatArray | None = self._apart(self.first)

    def _apart(self, point: Point) -> FloatArray | None:
        main = self.main if self.main.tangent[-1] > 0.0 else reversed_point(self.main)
        beside = step_to(self.balance, main, point.p, self.following)
        if not beside.solution.status.converged:
            return None
        self.main = beside
        return np.asarray(point.x - beside.x)

    def __call__(self, before: Point, after: Point) -> str:
        apart, had = self._apart(after), self.before
        self.before = apart
        if apart is None or had is None:
            return ""
        size = float(np.linalg.norm(apart))
        back = apart @ had < 0.0 or size <= ALIKE * float(np.linalg.norm(after.x))
        return "it comes back to the branch that it left" if back else ""


def _periods(bifurcation: Bifurcation) -> int:
    """Return the load periods in one period of the emanating motion."""
    value = bifurcation.multiplier
    smooth = bifurcation.kind in ("period doubling", "branch point")
    if not smooth and (bifurcation.kind != "jump of multipliers" or abs(value.imag) > 0.0):
        raise input_error(
            "side_branches: bifurcation",
            f"is a {bifurcation.kind}, where no branch of periodic motions leaves",
            "Beyond a fold the branch itself goes on; motions of two frequencies are asked for with [quasi_periodic].",
        )
    return 2 if value.real < 0.0 else 1


def _same(balance: Balance, first: Point, others: list[Point], group: IntArray | None) -> bool:
    """Whether the beginning of a branch equals another one's with renumbered sectors."""
    own = _sizes(balance, first, group)
    return any(
        np.allclose(own, _sizes(balance, other, group), rtol=1e-6) and np.isclose(first.p, other.p, rtol=1e-9)
        for other in others
    )


def _sizes(balance: Balance, point: Point, group: IntArray | None) -> FloatArray:
    """Return the size of the vibration of each sector, or coordinate, in ascending order."""
    size = np.sum(np.abs(balance.coefficients(point.x)[1:]) ** 2, axis=0)
    return np.sort(np.bincount(np.arange(size.size) if group is None else group, size))


def _point(balance: Balance, point: Point) -> ForcedPoint:
    return forced_point(balance, point.solution, "branch", 0, point.p, 0.0)


def open_directions(balance: HarmonicBalance, point: Point, following: Following, count: int) -> FloatArray:
    """Return the (count, n + 1) directions of crossing branches: approximate null vectors of the Jacobian.

    They are the singular vectors of the smallest singular values of the Jacobian with the branch's tangent as an
    additional row, by inverse iteration.
    """
    at = balance.linearise(point.x, point.p)
    jac = at.dense_jac()
    measure = measure_at(point.x, following)
    scale = np.append(np.full(point.x.size, np.max(measure.weights[:-1])), measure.p)
    row = measure.row(point.tangent / measure.of(point.tangent)) / scale
    matrix = np.vstack([np.column_stack([jac, at.jac_p]) / scale, row * np.max(np.abs(jac)) / scale[0]])
    matrix += BESIDE * np.max(np.abs(matrix)) * np.eye(len(matrix))
    factors = scipy.linalg.lu_factor(matrix)
    block = np.random.default_rng(0).standard_normal((len(matrix), count + 1))
    for _ in range(ROUNDS):
        block = np.linalg.qr(block)[0]
        block = scipy.linalg.lu_solve(factors, scipy.linalg.lu_solve(factors, block, trans=1))
    basis = np.linalg.qr(block)[0]
    turned = np.linalg.svd(matrix @ basis)[2]
    smallest = basis @ turned[::-1][:count].T
    return np.asarray(smallest.T / scale)


def candidates(directions: FloatArray, balance: HarmonicBalance, group: IntArray | None) -> list[FloatArray]:
    """Return the directions to search for branches: each one with both signs, and combinations of several.

    Where a wheel loses its symmetry by forward and backward waves at once, there are two directions, and every
    combination solves the linear equations. Branches have combinations that are symmetric about a sector or about the
    middle between two: with the largest motion of the first sector (without a wheel, of the first coordinate), with the
    smallest, and their sum.
    """
    found = list(directions)
    if len(directions) > 1:
        own = np.arange(balance.linear.n) == 0 if group is None else group == group[0]
        part = directions[:, np.append(np.tile(own, balance.n_rows), False)]
        vectors = np.linalg.eigh(part @ part.T)[1]
        most, least = vectors[:, -1] @ directions, vectors[:, 0] @ directions
        found = [most, least, most + least]
    return [sign * direction for direction in found for sign in (1.0, -1.0)]


def first_point(
    balance: HarmonicBalance, point: Point, direction: FloatArray, following: Following, end: float
) -> Point | None:
    """Return the first point of the branch in a direction; None without convergence.

    Its tangent points away from the known branch.
    """
    measure = measure_at(point.x, following)
    unit = direction / measure.of(direction)
    for away in AWAY:
        found = take_step(balance, point, unit, away, end, following)
        if found.solution.status.converged:
            leads_away = measure.row(found.y - point.y) @ found.tangent >= 0.0
            return found if leads_away else reversed_point(found)
    return None
