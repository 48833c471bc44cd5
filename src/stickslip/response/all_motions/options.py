"""Options of a search for all motions, and its forced response."""

from dataclasses import dataclass, field

import numpy as np

from stickslip.contact.compiled import Evaluator
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.bifurcations.period_multiplied import over_periods
from stickslip.response.forced.problem import ForcedProblem, forced_problem
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton


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
