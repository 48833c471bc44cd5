"""Options and results of a search for all motions: branches, motions at each searched frequency, and basins."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.compiled import Evaluator
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.all_motions.basins import Basins
from stickslip.response.bifurcations.period_multiplied import over_periods
from stickslip.response.bifurcations.side_branch import CLOSES
from stickslip.response.forced.problem import ForcedProblem, forced_problem
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton

Origin = Literal["sweep", "deflation", "time"]
Kind = Literal["branch", "searched", "starts", "motions"]


@dataclass(frozen=True, kw_only=True)
class MotionSearch:
    """Options of a search for all motions.

    Parameters
    ----------
    omega_range
        Range of the sweep and of the branches, rad/s.
    at
        Searched frequencies, rad/s; empty: the centres of `frequencies` equal parts of the range.
    frequencies
        Number of searched frequencies without `at`.
    periods
        Load periods in one period of the motion; 3 includes motions of ω/3.
    harmonics
        Highest harmonic of the load's frequency, the same in the whole search.
    samples
        Samples per period for sampled contact laws.
    points
        Smallest number of points of the sweep.
    tries
        Deflated solves at a frequency after the last one that found a motion.
    starts
        Random states at each frequency.
    modes
        Number of lowest modes with stuck contacts in random states.
    spread
        Largest modal amplitude of a random state, over the largest of the known motions.
    most_periods
        Largest number of periods from a start.
    steps
        Time steps in a period of the motion.
    solves
        Budget of deflated solves, starts and branch points together; deflation leaves half of it to the starts.
    seed
        Seed of the random states.
    evaluator
        Evaluation of piecewise-linear laws.
    newton
        Corrector options.
    """

    omega_range: tuple[float, float]
    at: tuple[float, ...] = ()
    frequencies: int = 5
    periods: int = 1
    harmonics: int = 7
    samples: int = 256
    points: int = 40
    tries: int = 12
    starts: int = 20
    modes: int = 2
    spread: float = 1.5
    most_periods: int = 1000
    steps: int = 512
    solves: int = 10_000
    seed: int = 0
    evaluator: Evaluator = "events"
    newton: Newton = field(default_factory=Newton)

    def __post_init__(self) -> None:
        for name in ("frequencies", "periods", "harmonics", "points", "modes", "steps", "most_periods", "solves"):
            if getattr(self, name) < 1:
                raise input_error(f"MotionSearch.{name}", f"is {getattr(self, name)}", "Give a count from 1 on.")
        if 2 * self.periods * self.harmonics >= self.steps:
            raise input_error(
                "MotionSearch.steps",
                f"is {self.steps}, too few for {self.harmonics} harmonics over periods = {self.periods}",
                f"Give more than {2 * self.periods * self.harmonics}.",
            )
        if not self.spread > 0.0:
            raise input_error("MotionSearch.spread", f"is {self.spread}", "Give a factor above zero.")
        low, high = self.omega_range
        if not all(low <= omega <= high for omega in self.at):
            raise input_error("MotionSearch.at", f"leaves the range {low:g} to {high:g} rad/s", "Widen omega_range.")

    @property
    def places(self) -> tuple[float, ...]:
        """Searched frequencies, rad/s."""
        low, high = self.omega_range
        middle = (np.arange(self.frequencies) + 0.5) / self.frequencies
        return self.at or tuple((low + (high - low) * middle).tolist())


def search_problem(system: System, load: HarmonicLoad, search: MotionSearch) -> ForcedProblem:
    """Set up the forced response for a search; refuse rigid contacts."""
    if system.interface.rigid:
        raise input_error(
            "all motions",
            "a contact is rigid: its force is no function of the gap",
            "Give the contacts a stiffness, as elastic_coulomb.",
        )
    order = search.harmonics
    sweep = Sweep(
        omega_range=search.omega_range,
        low=order,
        high=order,
        selection="always_low",
        points=search.points,
        samples=max(search.samples, 8 * order),
        evaluator=search.evaluator,
        newton=search.newton,
    )
    problem = forced_problem(system, load, sweep)
    return problem if search.periods == 1 else over_periods(problem, search.periods, order)


@dataclass(frozen=True, eq=False)
class Stage:
    """Part of a search. It holds arrays and numbers only, so that a journal can store and restore it.

    Attributes
    ----------
    kind
        ``branch``: points of a branch; ``searched``: deflation at a frequency is finished; ``starts``: the starts in
        time at a frequency are finished; ``motions``: the distinct motions at a frequency.
    place
        Number of the frequency; -1 for the sweep.
    origin
        Method that found a branch: ``sweep``, ``deflation`` or ``time``.
    end
        Reason for the end of a branch, in words; for starts, whether the budget ended them.
    omega
        (k,) basic frequencies of the motions along the branch, or of motions or starts, rad/s.
    coefficients
        (k, H+1, n_retained) amplitudes of the retained coordinates, m; for starts at their end, NaN if the motion does
        not repeat.
    branch
        (k,) for motions the number of their branch; for starts the number of their motion or a code of `Basins`;
        otherwise empty.
    multiplier, error
        (k,) for motions: modulus of the deciding multiplier and its error; NaN if not examined.
    change
        (k,) for motions: predicted change by more harmonics, relative to the vibration; infinite without a nearby
        motion.
    words
        Stability of the motions, ``stable``, ``unstable``, ``undecided`` or ``not examined``, separated by ``;``.
    tries
        Deflated solves, or starts, since the last stage.
    seconds
        Computing time, s.
    """

    kind: Kind
    place: int
    origin: Origin
    end: str
    omega: FloatArray
    coefficients: ComplexArray
    branch: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    multiplier: FloatArray = field(default_factory=lambda: np.zeros(0))
    error: FloatArray = field(default_factory=lambda: np.zeros(0))
    change: FloatArray = field(default_factory=lambda: np.zeros(0))
    words: str = ""
    tries: int = 0
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class MotionBranch:
    """Branch of motions.

    Attributes
    ----------
    origin
        Method that found the branch.
    end
        Reason for its end, in words.
    omega, amplitude
        (points,) frequency, rad/s, and amplitude of the first output, m, over the driven harmonics; for motions of
        several periods over all harmonics.
    coefficients
        (points, H+1, n_retained) amplitudes of the retained coordinates, m.
    """

    origin: Origin
    end: str
    omega: FloatArray
    amplitude: FloatArray
    coefficients: ComplexArray

    @property
    def isola(self) -> bool:
        """Whether the branch is a closed curve off the sweep's branch."""
        return self.origin != "sweep" and self.end == CLOSES

    @property
    def peak(self) -> float:
        """Largest amplitude by parabolic interpolation between points, m; 0 without points."""
        return self._turning(self.amplitude)[0] if self.omega.size else 0.0

    @property
    def peak_omega(self) -> float:
        """Frequency of the largest amplitude, rad/s; NaN without points."""
        return self._turning(self.amplitude)[1] if self.omega.size else np.nan

    @property
    def extent(self) -> tuple[float, float]:
        """Lowest and highest frequency, rad/s, with parabolic interpolation at folds; NaN without points."""
        if not self.omega.size:
            return np.nan, np.nan
        return -self._turning(-self.omega)[0], self._turning(self.omega)[0]

    def _turning(self, values: FloatArray) -> tuple[float, float]:
        """Return the largest value along the branch, and its frequency."""
        around = np.arange(-1, 2) + int(np.argmax(values))
        if self.isola:
            around = around % values.size
        elif around[0] < 0 or around[2] >= values.size:
            return float(values[around[1]]), float(self.omega[around[1]])
        q = self.coefficients[around].reshape(3, -1)
        spans = float(np.ptp(self.omega)) or 1.0, float(np.max(np.abs(self.coefficients), initial=0.0)) or 1.0
        path = np.column_stack([self.omega[around] / spans[0], q.real / spans[1], q.imag / spans[1]])
        before, after = np.linalg.norm(np.diff(path, axis=0), axis=1)
        if before == 0.0 or after == 0.0:
            return float(values[around[1]]), float(self.omega[around[1]])
        at = np.array([-before, 0.0, after])
        bend, slope, middle = np.polyfit(at, values[around], 2)
        if bend == 0.0:
            return float(middle), float(self.omega[around[1]])
        top = float(np.clip(-slope / (2.0 * bend), at[0], at[2]))
        along = np.polyfit(at, self.omega[around], 2)
        return float(middle + top * (slope + top * bend)), float(np.polyval(along, top))


@dataclass(frozen=True, eq=False)
class MotionAt:
    """Motion at a searched frequency.

    Attributes
    ----------
    branch
        Number of the branch of the motion.
    amplitude
        Amplitude of the first output over the driven harmonics, m; for motions of several periods over all harmonics.
    coefficients
        (H+1, n_retained) amplitudes of the retained coordinates, m.
    stability
        ``stable``, ``unstable``, ``undecided`` or ``not examined``.
    multiplier, error
        Modulus of the deciding multiplier, and its error.
    change
        Predicted change of the motion by more harmonics, relative to its vibration; infinite without a nearby motion,
        NaN if not examined.
    """

    branch: int
    amplitude: float
    coefficients: ComplexArray
    stability: str
    multiplier: float
    error: float
    change: float


@dataclass(frozen=True, eq=False)
class AtFrequency:
    """Motions found at a frequency, in the order of their branches, and their basins.

    Attributes
    ----------
    omega
        Frequency of the load, rad/s.
    motions, basins
        The motions, and the motions on which random starts end.
    tries
        Number of deflated solves at this frequency.
    spent
        Whether the budget ended the deflation or the starts at this frequency.
    """

    omega: float
    motions: tuple[MotionAt, ...]
    basins: Basins
    tries: int
    spent: bool


@dataclass(frozen=True, eq=False)
class AllMotions:
    """Result of a search. Further motions may exist.

    Attributes
    ----------
    branches
        Branches of motions, the branch of the sweep first.
    at
        Results at the searched frequencies.
    tries, starts
        Number of deflated solves, and of starts in time.
    seconds
        Computing time of the search, s.
    solves
        Number of deflated solves, starts and points of branches together.
    spent
        Whether the budget ended the search early.
    unmarched
        Reason for no starts in time and no stability; empty otherwise.
    """

    branches: tuple[MotionBranch, ...]
    at: tuple[AtFrequency, ...]
    tries: int
    starts: int
    seconds: float
    solves: int
    spent: bool
    unmarched: str = ""

    @property
    def isolas(self) -> tuple[MotionBranch, ...]:
        """Branches that are closed curves off the sweep's branch."""
        return tuple(b for b in self.branches if b.isola)


def gathered(problem: ForcedProblem, stages: list[Stage], search: MotionSearch) -> AllMotions:
    """Combine the stages of a search into its result; frequencies refer to the load."""
    periods = search.periods
    branches = [
        MotionBranch(s.origin, s.end, periods * s.omega, _amplitudes(problem, s, periods), s.coefficients)
        for s in stages
        if s.kind == "branch"
    ]
    starts = {s.place: s for s in stages if s.kind == "starts"}
    at = []
    for stage in sorted((s for s in stages if s.kind == "motions"), key=lambda s: s.place):
        amplitude = _amplitudes(problem, stage, periods)
        words = stage.words.split(";")
        motions = tuple(
            MotionAt(
                int(stage.branch[i]),
                float(amplitude[i]),
                stage.coefficients[i],
                words[i],
                float(stage.multiplier[i]),
                float(stage.error[i]),
                float(stage.change[i]),
            )
            for i in range(amplitude.size)
        )
        own = starts.get(stage.place)
        ends = () if own is None else tuple(int(e) for e in own.branch)
        omega = search.places[stage.place]
        here = [s for s in stages if s.place == stage.place and s.kind in ("searched", "starts")]
        tries = sum(s.tries for s in stages if s.place == stage.place and s.kind != "starts")
        at.append(AtFrequency(omega, motions, Basins(omega, ends), tries, any(s.end == SPENT for s in here)))
    return AllMotions(
        tuple(branches),
        tuple(at),
        sum(s.tries for s in stages if s.kind != "starts"),
        sum(s.tries for s in stages if s.kind == "starts"),
        sum(s.seconds for s in stages),
        sum(work_of(s) for s in stages),
        any(SPENT in s.end for s in stages),
        next((s.end for s in starts.values() if s.end != SPENT), ""),
    )


SPENT = "the budget is spent"


def work_of(stage: Stage) -> int:
    """Return the work of a stage in units of the budget: deflated solves, starts in time, and points of a branch."""
    return stage.tries + (stage.omega.size if stage.kind == "branch" else 0)


def _amplitudes(problem: ForcedProblem, stage: Stage, periods: int) -> FloatArray:
    """Return the amplitudes of the first output; for motions of several periods, over all harmonics."""
    pairs = zip(stage.omega, stage.coefficients, strict=True)
    if periods == 1:
        return np.array([problem.amplitude_of(float(w), q) for w, q in pairs])
    first, linear = problem.system.outputs[0], problem.low.linear
    return np.array([np.linalg.norm(linear.recover(float(w), q)[1:, first]) for w, q in pairs])
