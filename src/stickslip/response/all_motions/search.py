"""Search for all motions by a sweep, deflation and random states in time; each new motion is followed as a branch."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from time import perf_counter

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.all_motions.basins import (
    ALIKE,
    APERIODIC,
    DIVERGED,
    PERIODIC,
    drawn,
    in_time,
    not_marched,
    sampler,
)
from stickslip.response.all_motions.deflation import Distance, deflated_newton, distance_among
from stickslip.response.all_motions.found import (
    SPENT,
    AllMotions,
    Kind,
    MotionSearch,
    Origin,
    Stage,
    gathered,
    search_problem,
    work_of,
)
from stickslip.response.all_motions.from_modes import mode_starts
from stickslip.response.bifurcations.side_branch import both_ways
from stickslip.response.continuation.branch import following_vibration, steps_through, vibration_weights
from stickslip.response.continuation.starting_solutions import plain_sweep
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_point, with_stiffness
from stickslip.response.stability.missing_harmonics import corrected
from stickslip.response.stability.multipliers import stability
from stickslip.response.system import System
from stickslip.response.time.transient import TimeStepping
from stickslip.solve.continuation import start_point
from stickslip.solve.newton_method import Newton, newton

ITERATIONS = 60  # of a deflated solve
SHARE = 0.5  # share of the budget for deflation; the rest is left to integration in time
SCALES = (
    0.25,
    64.0,
)  # factors on known motions as starts: motions beyond a resonance may be tens of times as large
OTHER = 0.5  # share of the starts with another harmonic
GUESSES = (0.5, 2.0, -1.0)
WHOLE = "it reaches the end of the range"
LONGEST = 6  # largest number of points of a branch, over the sweep's
STEPS_OF_A_SOLVE = 20  # typical number of Newton steps of a deflated solve
PERIODS_OF_A_START = 100  # typical number of periods until a motion repeats
TIMED = 3  # periods of the time measurement


@by_one_thread
def all_motions(system: System, load: HarmonicLoad, search: MotionSearch) -> AllMotions:
    """Search for all periodic motions with the period of the load.

    Parameters
    ----------
    system, load
        Structure with contacts, and static and harmonic forces on all dofs, N.
    search
        Range, budget and discretisation.

    Raises
    ------
    InputError
        If a contact is rigid.
    """
    problem = search_problem(system, load, search)
    return gathered(problem, list(search_stages(problem, search)), search)


def search_stages(problem: ForcedProblem, search: MotionSearch, done: Sequence[Stage] = ()) -> Iterator[Stage]:
    """Yield the stages of a search that are not in `done`, in their order; the budget counts the work of `done`."""
    yield from _Search(problem, search, list(done)).run()


@dataclass(eq=False)
class _Search:
    problem: ForcedProblem
    search: MotionSearch
    stages: list[Stage]

    def __post_init__(self) -> None:
        self.order = self.search.periods * self.search.harmonics
        self.places = [omega / self.search.periods for omega in self.search.places]
        whole = with_stiffness(self.problem.balance(harmonics_of(self.order)))
        # deflation adds a dense rank-one term to the Jacobian
        self.balance: HarmonicBalance = replace(whole, jacobian="dense")
        self.weights = vibration_weights(self.balance)
        self.now = 0  # work since the last stage
        self.mark = perf_counter()

    def run(self) -> Iterator[Stage]:
        """Yield the stages of the whole search."""
        if not self._branches():
            yield self._kept(self._swept())
        for place, omega in enumerate(self.places):
            if not self._has("searched", place):
                yield from self._deflated(place, omega)
        for place, omega in enumerate(self.places):
            if not self._has("starts", place):
                yield from self._started(place, omega)
        for place, omega in enumerate(self.places):
            if not self._has("motions", place):
                yield self._kept(self._motions(place, omega))

    # --- results so far -----------------------------------------------------------------------

    def _has(self, kind: str, place: int) -> bool:
        return any(s.kind == kind and s.place == place for s in self.stages)

    def _branches(self) -> list[Stage]:
        return [s for s in self.stages if s.kind == "branch"]

    def _kept(self, stage: Stage) -> Stage:
        now = perf_counter()
        stage = replace(stage, seconds=now - self.mark)
        self.mark = now
        self.stages.append(stage)
        self.now = 0
        return stage

    def _spent(self, share: float = 1.0) -> bool:
        return self.now + sum(work_of(s) for s in self.stages) >= share * self.search.solves

    def _counted(self) -> bool:
        """Count a point of a branch; return whether the budget is spent."""
        self.now += 1
        return self._spent()

    def _at(self, omega: float, but: int = -1) -> list[tuple[int, FloatArray]]:
        """Return the distinct solutions at a frequency with the numbers of their branches.

        Branches found in time at the place `but` are left out.
        """
        found: list[tuple[int, FloatArray]] = []
        for number, stage in enumerate(self._branches()):
            if but >= 0 and (stage.origin, stage.place) == ("time", but):
                continue
            for guess in self._crossings(stage, omega):
                solved = newton(lambda v: self.balance.linearise(v, omega), guess, self.search.newton)
                if solved.status.converged and not self._known(solved.x, [z for _, z in found]):
                    found.append((number, solved.x))
        return found

    def _crossings(self, stage: Stage, omega: float) -> Iterator[FloatArray]:
        """Yield the unknowns at which a branch meets a frequency, interpolated between points."""
        x = [self.balance.unknowns(q) for q in stage.coefficients]
        off = stage.omega - omega
        for a in np.flatnonzero(off == 0.0):
            yield x[a]
        for a in np.flatnonzero(off[:-1] * off[1:] < 0.0):
            yield x[a] + off[a] / (off[a] - off[a + 1]) * (x[a + 1] - x[a])

    def _distance(self, known: Sequence[FloatArray]) -> Distance:
        return distance_among(self.weights, known)

    def _shifted(self, known: Sequence[FloatArray]) -> list[FloatArray]:
        """Return the solutions shifted by each load period: a subharmonic motion has several equivalent ones."""
        count, turns = self.search.periods, np.arange(self.order + 1)
        if count == 1:
            return list(known)
        shifts = [np.exp(2j * np.pi * k / count * turns)[:, None] for k in range(count)]
        every = [self.balance.unknowns(self.balance.coefficients(x) * s) for x in known for s in shifts]
        apart: list[FloatArray] = []
        distance = self._distance(known) if known else None
        for x in every:
            if distance is None or not any(distance.same(x, other) for other in apart):
                apart.append(x)
        return apart

    def _known(self, x: FloatArray, known: Sequence[FloatArray]) -> bool:
        distance = self._distance([x, *known])
        return any(distance.same(x, other) for other in self._shifted(known))

    # --- branches -----------------------------------------------------------------------------

    def _swept(self) -> Stage:
        search = self.search
        made = plain_sweep(
            self.problem.system,
            self.balance,
            self.problem.sweep.omega_range,
            search.points,
            search.newton,
            self._counted,
        )
        points = [forced_point(self.balance, f.point.solution, "point", f.index, f.p, 0.0) for f in made if f.converged]
        lost = len(made) - len(points)
        end = f"{lost} points were not found" if lost else WHOLE
        if not made or made[-1].p != self.problem.sweep.omega_range[1]:
            end = SPENT
        return self._stage("branch", -1, "sweep", points, end)

    def _branch(self, place: int, origin: Origin, x: FloatArray, omega: float) -> Stage:
        """Follow a motion as a branch."""
        search = self.search
        low, high = self.problem.sweep.omega_range
        following = following_vibration(self.balance, steps_through(high - low, search.points), search.newton)
        first = start_point(self.balance, x, omega, following)
        most = LONGEST * search.points
        points, end = both_ways(
            self.problem, self.balance, following, first, most, lambda: SPENT if self._counted() else ""
        )
        return self._stage("branch", place, origin, points, end)

    def _stage(self, kind: Kind, place: int, origin: Origin, points: Sequence[ForcedPoint], end: str) -> Stage:
        rows = np.array([p.coefficients for p in points])
        none = np.zeros((0, self.order + 1, self.balance.linear.n), dtype=complex)
        omega = np.array([p.omega for p in points])
        return Stage(kind, place, origin, end, omega, rows if points else none)

    # --- deflation ----------------------------------------------------------------------------

    def _deflated(self, place: int, omega: float) -> Iterator[Stage]:
        """Search a frequency until the requested number of starts finds no new motion."""
        options = replace(self.search.newton, max_iterations=ITERATIONS)
        while True:
            # new random numbers after each motion, so that an interrupted search continues in the same way
            known = [x for _, x in self._at(omega)]
            rng = np.random.default_rng((self.search.seed, place, len(self._branches())))
            starts = self._guesses(omega, known, rng)
            found, tries = self._another(omega, known, starts, options)
            if found is None:
                break
            yield self._kept(replace(self._branch(place, "deflation", found, omega), tries=tries))
        end = SPENT if self._spent(SHARE) else ""
        yield self._kept(replace(self._stage("searched", place, "deflation", (), end), tries=tries))

    def _another(
        self, omega: float, known: Sequence[FloatArray], starts: Iterator[FloatArray], options: Newton
    ) -> tuple[FloatArray | None, int]:
        """Return a new solution, None if the requested number of starts finds none, and the number of starts."""
        apart = self._shifted(known)
        chosen = mode_starts(self.problem, self.balance, omega, self.search.periods, known, self.search.modes)
        most = len(chosen) + self.search.tries
        for tries, start in enumerate(islice(chain(chosen, starts), most)):
            self.now = tries
            if self._spent(SHARE):
                return None, tries
            found = deflated_newton(
                lambda x: self.balance.linearise(x, omega), start, apart, self._distance(known or [start]), options
            )
            if found.status.converged and not self._known(found.x, known):
                return found.x, tries + 1
        return None, most

    def _guesses(self, omega: float, known: Sequence[FloatArray], rng: np.random.Generator) -> Iterator[FloatArray]:
        """Yield an endless sequence of starts.

        They are the stuck vibration, scaled known motions, then random scales, phases and harmonics.
        """
        stuck = bonded_start(self.balance, omega, self.problem.system)
        yield stuck
        still = np.where(self.weights == 0.0, 1.0, 0.0)
        for x in known:
            for factor in GUESSES:
                yield np.where(still > 0, x, factor * x)
        low, high = np.log(SCALES)
        every = [*known, stuck]
        turns = np.arange(self.order + 1)
        while True:
            q = self.balance.coefficients(every[int(rng.integers(len(every)))])
            scale = np.exp(rng.uniform(low, high))
            turned = np.exp(1j * turns * rng.uniform(0.0, 2.0 * np.pi))[:, None]
            other = rng.uniform() < OTHER  # harmonics absent in all known motions have to be added
            moved = q * turned * (1.0 if other else scale)
            moved[0] = q[0]
            if other:
                largest = q[1 + int(np.argmax(np.linalg.norm(q[1:], axis=1)))]
                phase = np.exp(2j * np.pi * rng.uniform())
                moved[1 + int(rng.integers(self.order))] += scale * phase * largest
            yield self.balance.unknowns(moved)

    # --- time ---------------------------------------------------------------------------------

    def _started(self, place: int, omega: float) -> Iterator[Stage]:
        """Integrate from random states, follow each new motion, and count the starts that end on each motion."""
        search = self.search
        why = not_marched(self.problem.system)
        solutions = [x for _, x in self._at(omega)]
        if why or not solutions or not search.starts:
            yield self._kept(self._stage("starts", place, "time", (), why))
            return
        stepping = TimeStepping(
            steps_per_period=search.steps,
            max_periods=search.most_periods,
            harmonics=self.order,
            tolerance=1e-4,
            every_harmonic=True,
        )
        linear = self.problem.low.linear
        # motions known when the starts began, so that an interrupted search draws the same states
        motions = [linear.recover(omega, self.balance.coefficients(x)) for _, x in self._at(omega, place)]
        own = sampler(self.problem, omega, motions, search.modes, search.spread)
        ends: list[tuple[int, ComplexArray]] = []
        states = drawn(own, search.seed, place)
        while len(ends) < search.starts and not self._spent():
            self.now = len(ends) + 1  # starts before a new branch are counted with its stage
            found = in_time(own, next(states), stepping)
            rows = found.harmonics[:, : self.balance.linear.n]
            ends.append(({"settled": PERIODIC, "unsettled": APERIODIC, "diverged": DIVERGED}[found.status], rows))
            if found.settled and self._nearest(rows, solutions) < 0:
                solved = newton(lambda v: self.balance.linearise(v, omega), self.balance.unknowns(rows), search.newton)
                new = solved.status.converged and not self._known(solved.x, solutions)
                if new and self._apart(rows, solved.x) <= ALIKE:
                    yield self._kept(self._branch(place, "time", solved.x, omega))
                    solutions = [x for _, x in self._at(omega)]
        made = self._stage("starts", place, "time", (), "" if len(ends) == search.starts else SPENT)
        numbers = [self._nearest(e, solutions) if why == PERIODIC else why for why, e in ends]
        yield self._kept(replace(made, branch=np.array(numbers, dtype=np.int64), tries=len(ends)))

    def _apart(self, rows: ComplexArray, x: FloatArray) -> float:
        """Return the distance of a motion in time from a solution, relative to the vibration."""
        every = [self.balance.coefficients(y)[1:] for y in self._shifted([x])]
        size = max(float(np.linalg.norm(every[0])), np.finfo(float).tiny)
        return min(float(np.linalg.norm(rows[1:] - known)) for known in every) / size

    def _nearest(self, rows: ComplexArray, solutions: Sequence[FloatArray]) -> int:
        """Return the number of the solution that equals a motion in time, `PERIODIC` without one."""
        apart = [self._apart(rows, x) for x in solutions]
        best = int(np.argmin(apart)) if apart else 0
        return best if apart and apart[best] <= ALIKE else PERIODIC

    # --- final motions ------------------------------------------------------------------------

    def _motions(self, place: int, omega: float) -> Stage:
        """Return the motions at a frequency with their stability, in the numbering of the starts."""
        found = self._at(omega)
        solved = [newton(lambda v: self.balance.linearise(v, omega), x, self.search.newton) for _, x in found]
        points = [forced_point(self.balance, s, "point", i, omega, 0.0) for i, s in enumerate(solved)]
        unknown = not_marched(self.problem.system)
        judged = [None if unknown else stability(self.problem, p) for p in points]
        return replace(
            self._stage("motions", place, "sweep", points, ""),
            branch=np.array([number for number, _ in found], dtype=np.int64),
            multiplier=np.array([np.nan if j is None else j.multiplier for j in judged]),
            error=np.array([np.nan if j is None else j.multiplier_error for j in judged]),
            change=np.array([self._change(p) for p in points]),
            words=";".join("not examined" if j is None else j.verdict for j in judged),
        )

    def _change(self, point: ForcedPoint) -> float:
        """Return the change of a motion by more harmonics, relative to its vibration.

        It is NaN for a wheel, whose waves limit the harmonics.
        """
        side = self.problem.system.structure
        if side.wheel is not None or side.speed_follows_frequency:
            return np.nan
        more = corrected(self.problem, point)
        if more is None:
            return np.inf
        high, factor = more
        change = high.coefficients[1:].copy()
        change[: point.order] -= point.coefficients[1:]
        size = max(float(np.linalg.norm(point.coefficients[1:])), np.finfo(float).tiny)
        return factor * float(np.linalg.norm(change)) / size


def search_seconds(problem: ForcedProblem, search: MotionSearch) -> float:
    """Estimate the time of deflated solves and starts, s, without new branches.

    The budget may end the search earlier.
    """
    order, omega = search.periods * search.harmonics, search.places[0] / search.periods
    whole = with_stiffness(problem.balance(harmonics_of(order)))
    balance = replace(whole, jacobian="dense")
    x = bonded_start(balance, omega, problem.system)
    step = start = np.inf
    for _ in range(2):  # the first compiles
        begun = perf_counter()
        balance.linearise(x, omega)
        step = min(step, perf_counter() - begun)
    solves = len(search.places) * search.tries * STEPS_OF_A_SOLVE * step
    if not_marched(problem.system) or not search.starts:
        return solves
    motion = problem.low.linear.recover(omega, balance.coefficients(x))
    own = sampler(problem, omega, [motion], search.modes, search.spread)
    stepping = TimeStepping(steps_per_period=search.steps, max_periods=TIMED, harmonics=order, tolerance=1e-4)
    for number in range(2):
        begun = perf_counter()
        in_time(own, own.draw((search.seed, 0, number)), stepping)
        start = min(start, perf_counter() - begun)
    periods = min(PERIODS_OF_A_START, search.most_periods)
    return solves + len(search.places) * search.starts * periods / TIMED * start
