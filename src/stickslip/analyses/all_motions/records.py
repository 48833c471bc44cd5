"""Records of a search for all motions: branches, motions at the searched frequencies, and the record of a case."""

from dataclasses import dataclass

from stickslip.arrays import FloatArray
from stickslip.column import column, rows
from stickslip.response.all_motions.basins import APERIODIC, DIVERGED, PERIODIC
from stickslip.response.all_motions.found import AllMotions, AtFrequency, MotionBranch
from stickslip.study.analysis import Solved
from stickslip.study.store.archive import from_flat
from stickslip.units import HZ

FOUND = "found"  # note with the record of a case, written when the search is over


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundBranch:
    """A branch of motions."""

    frequency_hz: FloatArray = column("Hz", "frequency along each branch", along="point")
    amplitude: FloatArray = column(
        "m", "amplitude of the output over the harmonics that the load drives", along="point"
    )
    origin: str = column("1", "how a branch was found: sweep, deflation or time")
    end: str = column("1", "why it ends")
    isola: bool = column("1", "1: it closes in itself, and no sweep meets it")
    peak_amplitude: float = column("m", "its largest amplitude")
    peak_hz: float = column("Hz", "frequency there")
    lowest_hz: float = column("Hz", "its lowest frequency")
    highest_hz: float = column("Hz", "its highest frequency")

    @property
    def swept(self) -> bool:
        """Whether the branch was found by the sweep."""
        return self.origin == "sweep"


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundMotion:
    """A motion at a searched frequency, with its basin of attraction."""

    branch: int = column("1", "branch of each motion; -1 where there are no more")
    amplitude: float = column("m", "its amplitude")
    stability: str = column("1", "stable, unstable, undecided or not examined")
    multiplier: float = column("1", "modulus of the multiplier that decides")
    multiplier_error: float = column("1", "its error")
    change: float = column(
        "1",
        "what more harmonics would change in it, relative to its vibration; infinite where no motion with more is near",
    )
    count: int = column("1", "starts that end on it; -1 where there is no motion")
    share: float = column("1", "share of the starts that ends on it")
    share_low: float = column("1", "lower end of its 95 % interval (Clopper and Pearson)")
    share_high: float = column("1", "upper end")


@dataclass(frozen=True, eq=False, kw_only=True)
class SearchedFrequency:
    """A frequency that was searched."""

    hertz: float = column("Hz", "frequencies that were searched", "searched_hz")
    starts: int = column("1", "random states that were integrated in time")
    aperiodic: int = column("1", "starts that end on no motion of the load's period, or on none in the periods allowed")
    diverged: int = column("1", "starts that grow without bound")
    tries: int = column("1", "deflated solves at the frequency", "searched_tries")
    spent: bool = column("1", "1: the budget ended the deflation or the starts there", "searched_spent")
    unsolved: int = column("1", "starts that end on a periodic motion which is no solution with the harmonics kept")
    motions: tuple[FoundMotion, ...] = rows("motion", "motion_", beside=True)


@dataclass(frozen=True, eq=False, kw_only=True)
class FoundMotions:
    """Record of a case; without branches if its search was not finished."""

    output: str = column("1", "output whose amplitude is given", default="")
    branches: tuple[FoundBranch, ...] = rows("branch")
    places: tuple[SearchedFrequency, ...] = rows("searched")
    tries: int | None = column("1", "deflated solves", default=None)
    seconds: float | None = column("s", "what the search took", default=None)
    solves: int | None = column("1", "deflated solves, starts in time and points of branches together", default=None)
    budget: int | None = column("1", "most of them", "budget_solves", default=None)
    unmarched: str | None = column("1", "why nothing was started in time; empty where it was", default=None)
    spent: bool | None = column(
        "1", "1: the budget ended the search before all was tried that was asked for", default=None
    )

    @property
    def starts(self) -> int:
        """Number of starts in time."""
        return sum(place.starts for place in self.places)

    @property
    def isolas(self) -> int:
        """Number of isolas: closed branches that no sweep meets."""
        return sum(branch.isola for branch in self.branches)

    @property
    def swept_peak(self) -> float:
        """Largest amplitude on the branch of the sweep, m."""
        return max((b.peak_amplitude for b in self.branches if b.swept), default=0.0)

    @property
    def motions(self) -> list[tuple[SearchedFrequency, FoundMotion]]:
        """All motions, each with its frequency."""
        return [(place, motion) for place in self.places for motion in place.motions]


def answer(solved: Solved) -> FoundMotions:
    """Return the record of a case from the notes of its job."""
    if FOUND not in solved.notes:
        return FoundMotions(output=str(solved.notes.get("model", {}).get("output", "")))
    found: FoundMotions = from_flat(solved.notes[FOUND], FoundMotions)
    return found


def found_motions(found: AllMotions, budget: int, output: str) -> FoundMotions:
    """Return the record of a finished search; `budget` is the largest number of solves."""
    return FoundMotions(
        output=output,
        branches=tuple(map(_branch, found.branches)),
        places=tuple(map(_place, found.at)),
        tries=found.tries,
        seconds=found.seconds,
        solves=found.solves,
        budget=budget,
        unmarched=found.unmarched,
        spent=found.spent,
    )


def _branch(branch: MotionBranch) -> FoundBranch:
    lowest, highest = branch.extent
    return FoundBranch(
        frequency_hz=branch.omega / HZ,
        amplitude=branch.amplitude,
        origin=branch.origin,
        end=branch.end,
        isola=branch.isola,
        peak_amplitude=branch.peak,
        peak_hz=branch.peak_omega / HZ,
        lowest_hz=lowest / HZ,
        highest_hz=highest / HZ,
    )


def _place(at: AtFrequency) -> SearchedFrequency:
    basins, motions = at.basins, []
    for k, motion in enumerate(at.motions):
        low, high = basins.interval(k)
        motions.append(
            FoundMotion(
                branch=motion.branch,
                amplitude=motion.amplitude,
                stability=motion.stability,
                multiplier=motion.multiplier,
                multiplier_error=motion.error,
                change=motion.change,
                count=basins.count(k),
                share=basins.share(k),
                share_low=low,
                share_high=high,
            )
        )
    return SearchedFrequency(
        hertz=at.omega / HZ,
        starts=len(basins.ends),
        aperiodic=basins.count(APERIODIC),
        diverged=basins.count(DIVERGED),
        tries=at.tries,
        spent=at.spent,
        unsolved=basins.count(PERIODIC),
        motions=tuple(motions),
    )
