"""Results of a search for all motions: branches, motions at each searched frequency, and basins."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.response.all_motions.basins import Basins
from stickslip.response.all_motions.options import MotionSearch
from stickslip.response.bifurcations.side_branch import CLOSES
from stickslip.response.forced.problem import ForcedProblem

Origin = Literal["sweep", "deflation", "time"]
Kind = Literal["branch", "searched", "starts", "motions"]


@dataclass(frozen=True, eq=False)
class Stage:
    """A part of a search, arrays and numbers only, so that it can be written down and given back.

    Attributes
    ----------
    kind
        ``branch``: a branch that was followed; ``searched``: deflation at a frequency is over; ``starts``: so are the starts in time there;
        ``motions``: the motions at a frequency, each once.
    place
        Number of the frequency; -1 for the sweep.
    origin
        How a branch was found: by the ``sweep``, by ``deflation``, or in ``time``.
    end
        Why a branch ends, in words; for starts whether the budget ended them.
    omega
        (k,) rad/s, of the period of the motion: along the branch, of the motions, of the starts.
    coefficients
        (k, H+1, n_retained) amplitudes of the retained coordinates, m; of starts those at their end, NaN where no period repeats.
    branch
        (k,) of motions the number of their branch; of starts the number of their motion or what `Basins` says; else empty.
    multiplier, error
        (k,) of motions: modulus of the multiplier that decides and its error; NaN where it was not examined.
    change
        (k,) of motions: what more harmonics would change in it, relative to its vibration; infinite where no motion with more is near.
    words
        Of motions, ``stable``, ``unstable``, ``undecided`` or ``not examined``, separated by ``;``.
    tries
        Deflated solves, or starts, since the last stage.
    seconds
        What it took.
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
    """A branch of motions.

    Attributes
    ----------
    origin
        How it was found.
    end
        Why it ends, in words.
    omega, amplitude
        (points,) rad/s, and of the first output over the harmonics that the load drives, m; of motions of several periods over all.
    coefficients
        (points, H+1, n_retained), m.
    """

    origin: Origin
    end: str
    omega: FloatArray
    amplitude: FloatArray
    coefficients: ComplexArray

    @property
    def isola(self) -> bool:
        """Whether it closes in itself, and no sweep meets it."""
        return self.origin != "sweep" and self.end == CLOSES

    @property
    def peak(self) -> float:
        """Its largest amplitude, m, between its points by a parabola; 0 without a point."""
        return self._turning(self.amplitude)[0] if self.omega.size else 0.0

    @property
    def peak_omega(self) -> float:
        """Frequency there, rad/s; NaN without a point."""
        return self._turning(self.amplitude)[1] if self.omega.size else np.nan

    @property
    def extent(self) -> tuple[float, float]:
        """Its lowest and highest frequency, rad/s, where it folds between its points by a parabola; NaN without a point."""
        if not self.omega.size:
            return np.nan, np.nan
        return -self._turning(-self.omega)[0], self._turning(self.omega)[0]

    def _turning(self, values: FloatArray) -> tuple[float, float]:
        """Return the largest of the values along the branch, and the frequency there."""
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
    """A motion at a frequency that was searched.

    Attributes
    ----------
    branch
        Number of its branch.
    amplitude
        Of the first output over the harmonics that the load drives, m; of motions of several periods over all.
    coefficients
        (H+1, n_retained), m.
    stability
        ``stable``, ``unstable``, ``undecided`` or ``not examined``.
    multiplier, error
        Modulus of the multiplier that decides, and its error.
    change
        What more harmonics would change in the motion, relative to its vibration; infinite where no motion with more is near, NaN where it
        was not examined.
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
    """What was found at a frequency: motions in the order of their branches, and where starts end.

    Attributes
    ----------
    omega
        Of the load, rad/s.
    motions, basins
        What was found, and where starts end.
    tries
        Deflated solves there.
    spent
        Whether the budget ended the deflation or the starts there.
    """

    omega: float
    motions: tuple[MotionAt, ...]
    basins: Basins
    tries: int
    spent: bool


@dataclass(frozen=True, eq=False)
class AllMotions:
    """What a search found; nothing proves that there is no other motion.

    Attributes
    ----------
    branches
        The first one is that of the sweep.
    at
        The frequencies that were searched.
    tries, starts
        Deflated solves, and starts in time.
    seconds
        What the search took.
    solves
        Deflated solves, starts and points of branches together.
    spent
        Whether the budget ended it before all was tried that was asked for.
    unmarched
        Why nothing was started in time, nor its stability examined; empty where it was.
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
        """Branches that close in themselves, and that no sweep meets."""
        return tuple(b for b in self.branches if b.isola)


def gathered(problem: ForcedProblem, stages: list[Stage], search: MotionSearch) -> AllMotions:
    """Return what the stages of a search tell together; frequencies are those of the load."""
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
    """Return what a stage counts in the budget: deflated solves or starts in time, and the points of a branch."""
    return stage.tries + (stage.omega.size if stage.kind == "branch" else 0)


def _amplitudes(problem: ForcedProblem, stage: Stage, periods: int) -> FloatArray:
    """Return the amplitudes of the first output; of motions of several periods over all harmonics."""
    pairs = zip(stage.omega, stage.coefficients, strict=True)
    if periods == 1:
        return np.array([problem.amplitude_of(float(w), q) for w, q in pairs])
    first, linear = problem.system.outputs[0], problem.low.linear
    return np.array([np.linalg.norm(linear.recover(float(w), q)[1:, first]) for w, q in pairs])
