"""Forced response over several load periods, or with independent sectors of a wheel."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.linear import one_structure
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.system import System
from stickslip.response.time.sectors import SectorsInTime, all_sectors


@by_one_thread
def over_periods(problem: ForcedProblem, periods: int, order: int) -> ForcedProblem:
    """Return the forced response whose period is `periods` periods of the load.

    Its frequency is ω / `periods`. Harmonic h of the load is its harmonic `periods` · h; the harmonics between are
    subharmonic. Sweep, points and amplitudes refer to the lower frequency.

    Parameters
    ----------
    problem
        Forced response of one structure; for a tuned wheel first apply `every_sector`.
    periods
        Number of periods, 2 for a doubled period.
    order
        Highest harmonic of the load's frequency. All harmonics of the lower frequency up to `periods` times this one
        are kept.

    Raises
    ------
    InputError
        If there are fewer than two periods, or the harmonics have different structures.
    """
    if periods < 2:
        raise input_error("over_periods: periods", f"must be at least 2, got {periods}", "2 doubles the period.")
    system, sweep = problem.system, problem.sweep
    if system.structure.speed_follows_frequency:
        raise input_error(
            "over_periods: problem",
            "is that of a speed that changes with the frequency, whose matrices would be those of another speed",
            "Take the model at the speed of the bifurcation.",
        )
    one_structure(system.structure, "over_periods")
    load = problem.low.linear.load.over_periods(periods)
    most = periods * order
    first, last = sweep.omega_range
    longer = replace(
        sweep,
        omega_range=(first / periods, last / periods),
        low=most,
        high=most,
        samples=max(periods * problem.low.samples, 8 * most),
        selection="always_high",
        error_harmonics=None,
        frequencies=0,
        at=(),
    )
    return forced_problem(system, load, longer)


def in_periods(point: ForcedPoint, periods: int) -> ForcedPoint:
    """Return a point as a point of `over_periods`, whose period contains the motion several times."""
    order = point.order * periods
    coefficients = np.zeros((order + 1, point.coefficients.shape[1]), dtype=complex)
    coefficients[::periods] = point.coefficients
    return replace(
        point,
        omega=point.omega / periods,
        coefficients=coefficients,
        harmonics=np.arange(order + 1),
        kept=np.zeros((0, 0), dtype=np.int64),
    )


@dataclass(frozen=True, eq=False)
class EverySector:
    """A tuned wheel whose sectors may move differently.

    Parameters
    ----------
    problem
        Forced response of all sectors as one structure, with the outputs of sector 0, of sector 1, and so on.
    tuned
        Forced response of one sector, which represents all.
    sectors
        All sectors for time integration.
    """

    problem: ForcedProblem
    tuned: ForcedProblem
    sectors: SectorsInTime

    @property
    def sector_of(self) -> IntArray:
        """(n_retained,) sector of each retained coordinate."""
        own = self.sectors.structure.n // self.sectors.count
        return np.asarray(self.problem.system.retained // own)

    def spread(self, point: ForcedPoint) -> ForcedPoint:
        """Return a point of the tuned wheel as the motion of all sectors."""
        wheel = self.tuned.system
        whole = np.zeros((len(point.coefficients), wheel.structure.n), dtype=complex)
        whole[:, wheel.retained] = point.coefficients
        own = self.sectors.structure.n // self.sectors.count
        rows: ComplexArray = self.sectors.travelling(whole[:, :own])
        moved = rows[:, self.problem.system.retained]
        return replace(point, coefficients=moved, kept=np.zeros((0, 0), dtype=np.int64))


@by_one_thread
def every_sector(problem: ForcedProblem) -> EverySector:
    """Return the forced response of a tuned wheel with all its sectors as one structure.

    Raises
    ------
    InputError
        If the structure is no tuned wheel with every wave; also raised by `stickslip.response.all_sectors`.
    """
    wheel = problem.system.structure.wheel
    if wheel is None or not wheel.has_every_wave:
        raise input_error(
            "every_sector: problem",
            "is not that of a tuned wheel with every wave",
            "Give assemble(every_wave=True), or tuned_wheel all waves.",
        )
    system = problem.system
    found = all_sectors(system, problem.low.linear.load, every=True)
    own = found.structure.n // found.count
    places = own * np.arange(found.count)
    alert = system.outputs if system.alert_dofs is None else system.alert_dofs
    outputs, alert = ((places[:, None] + d[d < own]).ravel() for d in (system.outputs, alert))
    peak_of = np.arange(outputs.size) if system.peak_of is None else system.peak_of
    whole = System(found.structure, found.contacts, outputs, alert, peak_of=peak_of)
    return EverySector(forced_problem(whole, found.load, problem.sweep), problem, found)
