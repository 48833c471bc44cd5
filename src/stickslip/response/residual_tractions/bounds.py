"""Bounds of a vibration over all residual tractions, at frequencies and at the resonance.

Where laws allow several motions, sweeps up and down a wider range find motions on other branches.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
import scipy.optimize

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.initial_sliders import Starts, starts_of
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.laws.bouc_wen import BoucWen
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.dahl import Dahl
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.regularised_coulomb import RegularisedCoulomb
from stickslip.errors import SingularError, input_error
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import one_structure
from stickslip.harmonic.peak import Driven, driven_by
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.continuation.branch import Followed
from stickslip.response.continuation.starting_solutions import plain_sweep, without_branch
from stickslip.response.parameter import Discretisation
from stickslip.response.residual_tractions.problem import TractionProblem, TractionState
from stickslip.response.residual_tractions.search import Extremes, TractionSearch, extremes
from stickslip.response.system import System
from stickslip.response.time.settling import SettlingStatus
from stickslip.response.time.start import start_from_harmonics
from stickslip.response.time.transient import TimeStepping, integrate
from stickslip.solve.newton_method import Newton, newton

PEAK_WIDTH = 3e-5  # relative width of the bracket of a resonance
PEAK_TRIALS = 9  # largest number of frequencies tried in it
EQUAL = 1e-6  # relative difference up to which two bounds coincide
APART = 1e-3  # relative difference in amplitude above which two motions from one start lie on different branches

End = Literal["least", "most"]
WIDER = 1.3  # factor by which the sweeps extend the range at both ends: a bent branch leads far
POINTS = 15  # smallest number of points of a sweep around one frequency; two more for each further one
ONE = (Bonded, BoucWen, Dahl, Iwan, Jenkins)  # laws without stops, and with friction under a constant normal load
NORMAL = (CoupledCoulomb, ElasticCoulomb, RegularisedCoulomb)  # the same if k_n is zero

SAMPLES = 1024  # of sampled contact forces
ALIKE = 1e-3  # relative difference in amplitude between samples and events that is sampling error
MISSING_HARMONICS_SHARE = 0.05  # largest share of the amplitude in time for the missing harmonics of a bound


@dataclass(frozen=True, eq=False)
class Bound:
    """Motion with an extreme amplitude.

    Attributes
    ----------
    amplitude
        Norm of the output over the driven harmonics, m.
    coefficients
        (H+1, n) displacement of all dofs, m.
    sliders
        (n_springs, 2) initial slider positions of the springs of `TractionBounds.springs`, m.
    multipliers
        (n_springs, 2) tractions along t and w at t = 0, over the friction limit; NaN for springs that do not stick
        throughout.
    error
        Predicted relative change of the output by the harmonics of its judging set; 0 without forces on them, NaN if
        unknown.
    """

    amplitude: float
    coefficients: ComplexArray
    sliders: FloatArray
    multipliers: FloatArray
    error: float = np.nan

    @property
    def stuck(self) -> int:
        """Number of springs that stick throughout and so keep a residual traction."""
        return int(np.count_nonzero(np.isfinite(self.multipliers)))


@dataclass(frozen=True, eq=False)
class TractionBounds:
    """Bounds of the amplitude over residual tractions at a frequency.

    Attributes
    ----------
    omega
        Frequency, rad/s.
    reference
        The motion from the model's own start.
    least, most
        Motions with the smallest and the largest amplitude.
    springs
        Name of the contact for each row of the sliders.
    solves, failures
        Number of solved motions, and of starts without a solution.
    branches
        Number of motions from the model's own start; above one if sweeps met other branches at this frequency. The
        bounds include them all.
    """

    omega: float
    reference: Bound
    least: Bound
    most: Bound
    springs: tuple[str, ...]
    solves: int
    failures: int
    branches: int = 1

    @property
    def converged(self) -> bool:
        """Whether a motion was found; otherwise all numbers are NaN."""
        return bool(np.isfinite(self.reference.amplitude))

    @property
    def unique(self) -> bool:
        """Whether both bounds coincide."""
        return self.most.amplitude - self.least.amplitude <= EQUAL * self.most.amplitude


@dataclass(frozen=True, eq=False)
class _Setup:
    system: System
    problem: TractionProblem
    given: HarmonicBalance
    swept: Sequence[Sequence[Followed]] = ()

    def reference(self, omega: float, near: Sequence[FloatArray]) -> TractionState:
        """Solve from the model's own start."""
        solution = without_branch(self.system, self.given, self.problem.newton, omega, near, 0.0 if near else 1.0)
        if not solution.status.converged:
            raise SingularError(f"residual tractions: no motion at {omega:.6g} rad/s: {solution.status.advice}")
        return self._state(solution.x, omega)

    def others(self, omega: float, reference: TractionState) -> list[TractionState]:
        """Return the motions from the model's own start on other branches than the reference."""
        found = [reference]
        for x in crossings(self.swept, self.given, omega, self.problem.newton):
            state = self._state(x, omega)
            if all(abs(np.log(state.amplitude / one.amplitude)) > APART for one in found):
                found.append(state)
        return found[1:]

    def _state(self, x: FloatArray, omega: float) -> TractionState:
        """Return a motion from the model's own start."""
        self.problem.spent.solves += 1
        starts = self.problem.starts
        given = TractionState(self.problem, omega, _own_sliders(starts), x)
        if all(getattr(law, "residual_traction", None) is None for law in starts.given.laws):
            return given
        # a traction given as a share of the limit determines slider positions only for a known motion
        period = self.given.contacts(x, omega)
        force = period.force[:, :2, 0] / starts.interface.factors[:, None]
        rests = period.gap[:, :2, 0] - force / np.maximum(starts.stiffness, 1e-300)
        sliders = np.where(starts.stiffness > 0.0, rests, 0.0)
        return self.problem.solved(sliders, omega, (given,)) or given


def _own_sliders(starts: Starts) -> FloatArray:
    return np.array([getattr(law, "slider", None) or (0.0, 0.0) for law in starts.given.laws]).reshape(-1, 2)


@by_one_thread
def traction_bounds(
    system: System,
    load: HarmonicLoad,
    omegas: Sequence[float],
    output: int = 0,
    discretisation: Discretisation | None = None,
    search: TractionSearch | None = None,
    near: TractionBounds | None = None,
) -> Iterator[TractionBounds]:
    """Find the smallest and the largest amplitude of an output over all residual tractions of sticking contacts.

    With laws other than friction under a constant normal load, the response may be multi-valued. Sweeps up and down a
    wider range then search for other branches, and the bounds include all motions that they meet. They do not meet
    isolated branches.

    Parameters
    ----------
    system
        Structure, contacts and outputs.
    load
        Static and harmonic forces on all dofs, N.
    omegas
        Frequencies in ascending or descending order, rad/s: each starts from the previous one.
    output
        Number of the output of `system`.
    discretisation
        Harmonics, samples, solver.
    search
        Options of the search for extremes.
    near
        Bounds at the frequency before the first one, to continue an interrupted search.

    Yields
    ------
    TractionBounds
        Bounds at each frequency; not `converged` if no motion is found from the model's own start.

    Raises
    ------
    InputError
        If a contact is rigid, a law has no initial slider positions, a frequency is not positive, or the output does
        not exist.
    """
    setup = _setup(system, load, omegas, output, discretisation)
    if may_be_several(system.interface):
        setup = _swept(setup, omegas)
    how = search or TractionSearch()
    last = _again(setup, near) if near is not None and near.converged else None
    for omega in omegas:
        try:
            last = _at(setup, omega, how, last)
        except SingularError:
            yield _lost(setup, omega)
            continue
        yield _bounds(setup, last)


@by_one_thread
def resonance_bounds(
    system: System,
    load: HarmonicLoad,
    known: Sequence[TractionBounds],
    end: End,
    output: int = 0,
    discretisation: Discretisation | None = None,
    search: TractionSearch | None = None,
) -> TractionBounds:
    """Find the maximum of a bound over the frequency, between known bounds: the bound of the resonance amplitude.

    For any tractions, constant or changing with the frequency, the resonance amplitude lies between the maximum of the
    smallest amplitudes and the maximum of the largest ones. Where several motions were met, both bounds include all of
    them.

    Parameters
    ----------
    system, load, output, discretisation, search
        As in `traction_bounds`.
    known
        Bounds at increasing frequencies.
    end
        The bound, ``least`` or ``most``.

    Returns
    -------
    TractionBounds
        Bounds at the maximum; the highest of `known` if this is the first or the last one.

    Raises
    ------
    InputError
        If `known` has no converged bounds.
    """
    known = [b for b in known if b.converged]
    if not known:
        raise input_error(
            "resonance_bounds: known", "holds no bounds that converged", "Give those of `traction_bounds`."
        )
    heights = [getattr(b, end).amplitude for b in known]
    top = int(np.argmax(heights))
    if top in (0, len(known) - 1):
        return known[top]
    setup = _setup(system, load, [b.omega for b in known], output, discretisation)
    if any(b.branches > 1 for b in known):
        setup = _swept(setup, [b.omega for b in known])
    how = search or TractionSearch()
    beside = [_again(setup, known[k]) for k in (top, top - 1, top + 1)]
    found: dict[float, Extremes] = {}

    def depth(omega: float) -> float:
        found[omega] = _at(setup, omega, None, *beside)
        return -float(getattr(found[omega], end).amplitude)

    limits = known[top - 1].omega, known[top + 1].omega
    scipy.optimize.minimize_scalar(
        depth, bounds=limits, method="bounded", options={"xatol": PEAK_WIDTH * known[top].omega, "maxiter": PEAK_TRIALS}
    )
    for omega in _highest(setup, *limits):  # a bound jumps at a fold
        depth(omega)
    best = max(found.values(), key=lambda e: float(getattr(e, end).amplitude))
    if getattr(best, end).amplitude <= heights[top]:
        return known[top]
    return _bounds(setup, _at(setup, best.reference.omega, how, best))


def _setup(
    system: System, load: HarmonicLoad, omegas: Sequence[float], output: int, discretisation: Discretisation | None
) -> _Setup:
    how = discretisation or Discretisation()
    if not (len(omegas) and all(0.0 < w < np.inf for w in omegas)):
        raise input_error("omegas", f"are {list(omegas)[:3]}", "Give frequencies above zero, rad/s.")
    if not 0 <= output < system.outputs.size:
        have = system.outputs.size
        raise input_error("output", f"is {output}, of {have} outputs", f"Give 0 to {have - 1}.")
    starts = starts_of(system.interface)
    dof = int(system.outputs[output])
    linear = system.condensed(load, how.order, np.array([dof]))
    free, given = (
        harmonic_balance(linear, interface, how.order, how.samples, how.evaluator)
        for interface in (starts.interface, starts.given)
    )
    driven = Driven(int(np.searchsorted(linear.retained, dof)), driven_by(load)[0])
    return _Setup(replace(system, interface=starts.given), TractionProblem(free, starts, driven, how.newton), given)


def _at(setup: _Setup, omega: float, search: TractionSearch | None, *beside: Extremes | None) -> Extremes:
    near = [b for b in beside if b is not None]
    reference = setup.reference(omega, [b.reference.x for b in near])
    more = [s.inside() for b in near for s in (b.least, b.most)]
    others = setup.others(omega, reference)
    found = [extremes(one, search, more) for one in (reference, *others)]
    least = min((e.least for e in found), key=lambda s: s.amplitude)
    most = max((e.most for e in found), key=lambda s: s.amplitude)
    return Extremes(reference, least, most, 1 + len(others))


def _highest(setup: _Setup, low: float, high: float) -> list[float]:
    """Return the frequency between two others at which the swept branches are highest; empty without a sweep."""
    balance, driven = setup.given, setup.problem.driven
    inside = [f for way in setup.swept for f in way if f.converged and low < f.p < high]
    inside.sort(key=lambda f: float(np.linalg.norm(driven.motion(balance, f.point.x))))
    return [f.p for f in inside[-1:]]


def _swept(setup: _Setup, omegas: Sequence[float]) -> _Setup:
    """Return the setup with branches swept around some frequencies."""
    swept = both_ways(setup.system, setup.given, omegas, setup.problem.newton)
    return replace(setup, swept=swept)


def _again(setup: _Setup, bounds: TractionBounds) -> Extremes:
    """Return known bounds as states of the problem."""
    balance = setup.problem.balance

    def state(bound: Bound) -> TractionState:
        x = balance.unknowns(bound.coefficients[:, balance.linear.retained])
        found = newton(lambda v: setup.problem.at(bound.sliders).linearise(v, bounds.omega), x, setup.problem.newton)
        return TractionState(setup.problem, bounds.omega, bound.sliders, found.x)

    return Extremes(state(bounds.reference), state(bounds.least), state(bounds.most))


def _bounds(setup: _Setup, found: Extremes) -> TractionBounds:
    spent, names = setup.problem.spent, setup.problem.starts.interface.names
    reference, least, most = map(_bound, (found.reference, found.least, found.most))
    omega = found.reference.omega
    made = TractionBounds(omega, reference, least, most, names, spent.solves, spent.failures, found.branches)
    spent.solves = spent.failures = 0
    return made


def _lost(setup: _Setup, omega: float) -> TractionBounds:
    problem = setup.problem
    shape = problem.balance.order + 1, setup.system.structure.n
    springs = problem.starts.stiffness.shape
    none = Bound(np.nan, np.full(shape, np.nan + 0j), np.zeros(springs), np.full(springs, np.nan))
    names, spent = problem.starts.interface.names, problem.spent
    made = TractionBounds(omega, none, none, none, names, spent.solves, spent.failures)
    spent.solves = spent.failures = 0
    return made


def _bound(state: TractionState) -> Bound:
    room = state.room
    rests = np.where(room.sticks, room.slider, state.sliders)
    return Bound(state.amplitude, state.coefficients, rests, room.multiplier, state.error)


def may_be_several(interface: Interface) -> bool:
    """Whether a law of an interface allows several branches: it is more than friction under a constant normal load."""
    return not all(_leaves_one(law) for law in interface.laws)


def _leaves_one(law: ContactLaw) -> bool:
    return isinstance(law, ONE) or (isinstance(law, NORMAL) and law.k_n == 0.0)


def both_ways(
    system: System, balance: HarmonicBalance, omegas: Sequence[float], options: Newton
) -> list[list[Followed]]:
    """Return the branches from below the frequencies upward and from above them downward."""
    low, high = min(omegas) / WIDER, max(omegas) * WIDER
    points = POINTS + 2 * (len(omegas) - 1)
    return [plain_sweep(system, balance, way, points, options) for way in ((low, high), (high, low))]


def crossings(
    branches: Sequence[Sequence[Followed]], balance: HarmonicBalance, omega: float, options: Newton
) -> Iterator[FloatArray]:
    """Yield the unknowns at every crossing of a branch with a frequency; the same motion may occur several times."""
    for branch in branches:
        for one, other in pairwise(branch):
            if not (one.converged and other.converged) or (one.p - omega) * (other.p - omega) > 0.0:
                continue
            share = (omega - one.p) / (other.p - one.p) if other.p != one.p else 0.0
            begin = np.asarray(one.point.x + share * (other.point.x - one.point.x))
            found = newton(lambda x: balance.linearise(x, omega), begin, options)
            if found.status.converged:
                yield found.x


@dataclass(frozen=True)
class Confirmation:
    """Checks of a bound by other methods.

    Attributes
    ----------
    resolved
        Amplitude by sampled contact forces from the same initial sliders, m; NaN without a solution.
    transient
        Amplitude by time integration from the bound's state and tractions, m; NaN if it diverged or was not run.
    status
        Status of the time integration; None if it was not run.
    periods
        Number of integrated periods.
    agrees
        Whether both agree with the bound, apart from errors of sampling and of the neglected harmonics.
    """

    resolved: float
    transient: float
    status: SettlingStatus | None
    periods: int
    agrees: bool


@by_one_thread
def confirmed(
    system: System,
    load: HarmonicLoad,
    omega: float,
    bound: Bound,
    output: int = 0,
    discretisation: Discretisation | None = None,
    stepping: TimeStepping | None = None,
) -> Confirmation:
    """Solve a bound again with sampled contacts, and integrate its motion in time.

    The integration starts from the bound's displacements, velocities and tractions.

    Parameters
    ----------
    system, load, output, discretisation
        As in `traction_bounds`.
    omega
        Frequency of the bound, rad/s.
    bound
        Bound `least` or `most` of a `TractionBounds`.
    stepping
        Options of the time integration. One sector of a tuned wheel is not integrated in time.
    """
    how = discretisation or Discretisation()
    interface = starts_of(system.interface).started(bound.sliders)
    dof = system.outputs[[output]]
    linear = system.condensed(load, how.order, dof)
    balance = harmonic_balance(linear, interface, how.order, max(how.samples, SAMPLES), "march")
    start = balance.unknowns(bound.coefficients[:, linear.retained])
    # near an event, sampled forces are discontinuous, so that the residual may not reach the tolerance
    found = newton(
        lambda x: balance.linearise(x, omega), start, replace(how.newton, tolerance=max(how.newton.tolerance, 1e-8))
    )
    driven = list(driven_by(load)[0])
    motion = linear.recover(omega, balance.coefficients(found.x))
    resolved = float(np.linalg.norm(motion[driven, dof[0]])) if found.status.converged else np.nan
    same = bool(abs(resolved / bound.amplitude - 1.0) <= ALIKE)
    if system.structure.wheel is not None:
        return Confirmation(resolved, np.nan, None, 0, same)
    result = integrate(
        one_structure(system.structure, "confirmed"),
        interface.gap_operator,
        interface.laws,
        load,
        omega,
        dof,
        start_from_harmonics(bound.coefficients, omega, interface.gap_operator, interface.laws),
        stepping or TimeStepping(max_periods=600, harmonics=max(7, *driven)),
        weights=interface.weights,
    )
    known = result.harmonics if result.settled else result.averages
    transient = float(np.linalg.norm(known[driven, 0]))
    near = bool(abs(bound.amplitude / transient - 1.0) <= MISSING_HARMONICS_SHARE)
    return Confirmation(resolved, transient, result.status, result.periods, same and near)
