"""Autonomous periodic problem: the frequency is unknown, and so is the damping that sustains the motion.

The first harmonic of one coordinate has a given amplitude ``a``, which scales the balance, and zero phase, since the
origin of time is arbitrary. The additional unknowns are ``ln ω`` and a *level*, which is one of these:

- mass-proportional damping that sustains the motion. Where it is zero, the motion is a limit cycle. In a model with
  positive damping it is negative (the extended periodic motion concept of Krack, Computers & Structures 154 (2015)
  59-71);
- a parameter of the model: a contact parameter, or a factor on the aerodynamic forces;
- the amplitude itself, for the limit cycle of the given model.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray
from stickslip.contact.element import K_T, MU, PRELOAD, UNILATERAL
from stickslip.contact.interface import Interface
from stickslip.contact.law import OPEN, SLIP, STICK, ContactLaw, PiecewiseLinear
from stickslip.errors import InputError, input_error
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.bordered import Condition, PeriodicProblem, Setting, State
from stickslip.harmonic.decaying import DecayingStiffness
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.judging import judging_set_of
from stickslip.harmonic.parameters import BalanceAt
from stickslip.model.blas_threads import by_one_thread
from stickslip.operators import times
from stickslip.response.parameter import Discretisation, Parameter, parameter_family
from stickslip.response.self_excited.modes import StuckMode
from stickslip.response.system import System
from stickslip.solve.linear import factorised

WANDERED = 3.0  # |ln(ω / ω_0)| at which a corrector has lost the mode
FARTHEST = 100.0  # largest |ln a|
STILL = 1e-6  # amplitude of a coordinate over the largest in the mode, below which it does not take part
SAMPLES_A_HARMONIC = 16
FAR = 1e6  # m: displacement at which every slider has slipped, also in dimensionless models


@dataclass(frozen=True)
class Held:
    """Condition that prescribes the cosine or sine part of a coordinate's first harmonic, in the scale of the problem.

    Parameters
    ----------
    position
        Index of the coordinate among the retained ones.
    row
        1: the cosine part, 2: the sine part.
    target
        Prescribed value.
    """

    position: int
    row: int
    target: float

    def value(self, state: State) -> float:
        """Return the residual of the condition."""
        return float(state.x[self._place(state)] - self.target)

    def gradient(self, state: State) -> FloatArray:
        """Return the derivative of the residual by the unknowns."""
        out = np.zeros(state.y.size)
        out[self._place(state)] = 1.0
        return out

    def _place(self, state: State) -> int:
        return self.row * state.setting.balance.linear.n + self.position


@dataclass(frozen=True, eq=False)
class SelfExcited:
    """Unforced periodic motions of one mode; `self_excited_motions` makes one.

    Parameters
    ----------
    system, load
        System of structure and contacts, and its static load.
    mode
        Mode of the motions at small amplitudes.
    how
        Harmonics, samples, solver.
    position
        Index, among the retained coordinates, of the coordinate with prescribed amplitude.
    balance
        The balance at an amplitude of 1 m.
    """

    system: System
    load: HarmonicLoad
    mode: StuckMode
    how: Discretisation
    position: int
    balance: HarmonicBalance

    def with_order(self, order: int) -> "SelfExcited":
        """Return the problem with harmonics up to `order`; a wheel must have their waves."""
        samples = max(self.how.samples, SAMPLES_A_HARMONIC * order)
        how = replace(self.how, order=order, samples=samples)
        return self_excited_motions(self.system, self.load, self.mode, self.dof, how)

    def judging(self) -> "SelfExcited | None":
        """Return the problem with the judging set of harmonics; None if a wheel lacks their waves."""
        harmonics = judging_set_of(self.balance)
        try:
            made = self.with_order(harmonics[-1])
        except InputError:
            return None
        return replace(made, balance=made.balance.with_harmonics(harmonics))

    @property
    def dof(self) -> int:
        """Coordinate with prescribed amplitude."""
        return int(self.balance.linear.retained[self.position])

    def damped(self, level: float) -> HarmonicBalance:
        """Return the balance at 1 m without a level of damping.

        `level` · ω_0 · M is subtracted from the damping matrix.
        """
        rate = -level * self.mode.omega
        return replace(self.balance, linear=self.balance.linear.with_mass_damping(rate))

    def decaying(self, level: float) -> HarmonicBalance:
        """Return the balance at 1 m of free decaying motions, whose decay rate is half the level of damping."""
        rate = 0.5 * level * self.mode.omega
        return replace(self.balance, linear=DecayingStiffness(self.balance.linear, rate))

    def over_amplitude(
        self,
        family: BalanceAt | None = None,
        scale: float = 1.0,
        held: tuple[Condition, ...] | None = None,
        *,
        linear_alone: bool = False,
    ) -> PeriodicProblem:
        """Return the periodic problem with the parameter ``ln a`` and a level, over `scale`, as the last unknown.

        The level is the damping, unless `family` gives the balance of another level. The conditions `held` on amplitude
        and phase refer to the coordinate by default. A level that changes linear forces only (`linear_alone`), such as
        damping, costs no evaluation of contacts.
        """
        members = family or self.damped

        def setting(extra: FloatArray, p: float) -> Setting:
            made = self._setting(members(scale * float(extra[1])), float(extra[0]), p)
            known = self._by_damping if family is None and scale == 1.0 else None
            return replace(made, linear_alone=linear_alone, by_level=known)

        return replace(self._bordered(setting, held), by_parameter=_by_size)

    def _by_damping(self, state: State) -> FloatArray:
        """Return the derivative of the balance by the level of damping."""
        side, setting = self.system.structure, state.setting
        slope = setting.balance.by_mass_damping(state.x, setting.omega, lambda h: side.of_harmonic(h).mass)
        return -self.mode.omega * slope

    def limit_cycle(self) -> PeriodicProblem:
        """Return the periodic problem with ``ln a`` as the last unknown.

        The parameter is the level of damping, zero for a limit cycle.
        """

        def setting(extra: FloatArray, level: float) -> Setting:
            balance = self.balance if level == 0.0 else self.damped(level)
            return self._setting(balance, float(extra[0]), float(extra[1]))

        return self._bordered(setting)

    def unknowns(self, coefficients: ComplexArray, omega: float, last: float) -> FloatArray:
        """Return the unknowns of a motion (H+1, n_retained) over its amplitude.

        They end with its frequency, given in rad/s, and the last unknown.
        """
        x = replace(self.balance, displacement_scale=1.0).unknowns(coefficients)
        return np.append(x, [np.log(omega / self.mode.omega), last])

    def relative(self, y: FloatArray) -> ComplexArray:
        """Return the (H+1, n_retained) motion over its amplitude from the unknowns."""
        return replace(self.balance, displacement_scale=1.0).coefficients(y[:-2])

    def omega(self, y: FloatArray) -> float:
        """Return the frequency from the unknowns, rad/s."""
        return self.mode.omega * float(np.exp(y[-2]))

    def level(self, ratio: float, omega: float) -> float:
        """Return the level of damping for a damping ratio at a frequency, rad/s."""
        return 2.0 * ratio * omega / self.mode.omega

    def ratio(self, y: FloatArray) -> float:
        """Return the damping ratio from unknowns with the level of damping as the last one."""
        return 0.5 * float(y[-1]) * self.mode.omega / self.omega(y)

    def at_amplitude(self, balance: HarmonicBalance, log_amplitude: float) -> HarmonicBalance:
        """Return a balance scaled by an amplitude."""
        a = float(np.exp(log_amplitude))
        return replace(balance, displacement_scale=a, force_scale=a * self.balance.force_scale)

    def guess(self, static: FloatArray, amplitude: float) -> FloatArray:
        """Return the unknowns of the linear mode about a static state at an amplitude, m.

        `static` has the (n_retained,) coordinates of the system.
        """
        linear = self.balance.linear
        motion = np.zeros((self.balance.order + 1, linear.n), dtype=complex)
        motion[0, np.searchsorted(linear.retained, self.system.retained)] = static / amplitude
        motion[1] = self.mode.shape[linear.retained] / self.mode.shape[self.dof]
        return self.unknowns(motion, self.mode.omega, 2.0 * self.mode.ratio)

    def _setting(self, balance: HarmonicBalance, log_omega: float, log_amplitude: float) -> Setting:
        near = abs(log_omega) < WANDERED and abs(log_amplitude) < FARTHEST
        omega = self.mode.omega * float(np.exp(log_omega)) if near else np.nan
        scaled = self.at_amplitude(balance, log_amplitude) if near else balance
        return Setting(scaled, omega, np.array([omega, 0.0]))

    def _bordered(
        self, settings: Callable[[FloatArray, float], Setting], held: tuple[Condition, ...] | None = None
    ) -> PeriodicProblem:
        own = (Held(self.position, 1, 1.0), Held(self.position, 2, 0.0))
        return PeriodicProblem(settings, held or own, partial(factorised, self.how.newton.linear))


def _by_size(state: State) -> FloatArray:
    """Return the derivative by the logarithm of the scaling amplitude.

    It is ``J x - r`` for the balance, and zero for the conditions.
    """
    at = state.at
    return np.append(times(at.jac, state.x) - at.residual, np.zeros(state.extra.size))


@by_one_thread
def self_excited_motions(
    system: System, load: HarmonicLoad, mode: StuckMode, dof: int, how: Discretisation
) -> SelfExcited:
    """Set up the unforced motions of a mode.

    Parameters
    ----------
    system
        System with contacts; on a wheel the wave number of the mode is its engine order.
    load
        Static forces; harmonic forces are not allowed.
    mode
        One of `stuck_modes`.
    dof
        Coordinate whose amplitude represents the motion.
    how
        Harmonics, samples, solver.

    Raises
    ------
    InputError
        If a contact is rigid, a harmonic load acts, or the coordinate is at rest in the mode.
    """
    if system.interface.rigid:
        raise input_error(
            f"mode {mode.number}", "a contact is rigid", "Give the contacts a stiffness, as elastic_coulomb."
        )
    if any(np.any(f) for f in load.harmonics.values()):
        raise input_error(
            f"mode {mode.number}",
            "a harmonic load acts: the motion would have two frequencies",
            "Leave it out; the stability of the forced response says whether it is kept.",
        )
    moving = np.delete(np.abs(mode.shape), system.structure.multipliers)
    share = abs(mode.shape[dof]) / float(np.max(moving))
    if share < STILL:
        raise input_error(
            f"mode {mode.number}",
            f"{system.structure.dofs.labels[dof]} hardly moves in mode {mode.number} ({share:.2g} of the largest)",
            "Report the motion of a point that the mode moves.",
        )
    still = HarmonicLoad(load.static)
    linear = system.condensed(still, how.order, np.array([dof]))
    some = HarmonicLoad(still.static, {1: np.ones(still.static.size, dtype=complex)})
    balance = harmonic_balance(linear.with_load(some), system.interface, how.order, how.samples, how.evaluator)
    stiffness = (mode.omega / abs(mode.shape[dof])) ** 2  # modal stiffness for unit amplitude of the coordinate
    balance = replace(balance, linear=linear, displacement_scale=1.0, force_scale=stiffness)
    position = int(np.searchsorted(linear.retained, dof))
    return SelfExcited(system, load, mode, how, position, balance)


def levels(problem: SelfExcited, parameter: Parameter, first: float) -> BalanceAt:
    """Return the balances at 1 m as a function of a parameter; see `branch_in_parameter` for its choices."""
    own = problem.balance

    def made(system: System, load: HarmonicLoad) -> HarmonicBalance:
        return self_excited_motions(system, load, problem.mode, problem.dof, problem.how).balance

    family = parameter_family(problem.system, problem.load, parameter, first, made)
    return lambda value: replace(family(value), displacement_scale=own.displacement_scale, force_scale=own.force_scale)


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts over one period.

    Attributes
    ----------
    slipping
        Share of the contact points that change their state, among the points that can slip or open; NaN without such
        points. A contact with several sliders counts by its share of slipping sliders, which is 1 in gross slip only.
    sticking
        Share of these contact points that stick throughout, with several sliders counted in the same way.
    open_for
        Share of the period for which a contact point is open, the largest over all points.
    """

    slipping: float
    sticking: float
    open_for: float


def contacts_of(problem: SelfExcited, y: FloatArray, amplitude: float) -> Contacts:
    """Return slip, stick and opening of the contacts in a motion of an amplitude, m, from its unknowns."""
    balance = problem.at_amplitude(problem.balance, float(np.log(amplitude)))
    period = balance.contacts(y[:-2], problem.omega(y))
    state, leaves = period.state, leaving(problem.system.interface)
    # permanently open contacts do not count as slipping
    slips = np.any(state == SLIP, axis=(1, 2)) | np.any(state != state[:, :, :1], axis=(1, 2))
    stays = np.all(state == STICK, axis=(1, 2))
    moved, stuck = slips.astype(float), stays.astype(float)
    for c, travels in _sliders(problem.system.interface).items():
        moved[c] = np.mean(np.any(np.ptp(period.gap[c, :2], axis=1) > travels, axis=1))
        stuck[c] = 1.0 - moved[c]
    share = float(np.mean(moved[leaves])) if np.any(leaves) else np.nan
    opened = np.mean(np.any(state == OPEN, axis=1), axis=1)
    sticks = float(np.mean(stuck[leaves])) if np.any(leaves) else np.nan
    return Contacts(share, sticks, float(np.max(opened, initial=0.0)))


@lru_cache(maxsize=8)
def _sliders(interface: Interface) -> dict[int, FloatArray]:
    """Return for each contact with several sliders the peak-to-peak gaps above which they slip, m.

    Each has (n, 2) entries, along t and w.
    """
    found: dict[int, FloatArray] = {}
    for law in interface.laws:
        if id(law) not in found:
            found[id(law)] = _travels(law)
    every = {c: found[id(law)] for c, law in enumerate(interface.laws)}
    return {c: travels for c, travels in every.items() if len(travels) > 1}


def _travels(law: ContactLaw) -> FloatArray:
    """Return these peak-to-peak gaps for a law with constant slip limits.

    Elastic springs are left out; other laws have none.
    """
    rows = law.elements() if isinstance(law, PiecewiseLinear) else np.zeros((0, UNILATERAL + 1))
    if np.any(rows[:, UNILATERAL]):
        return np.zeros((0, 2))
    k, limit = rows[:, K_T : K_T + 2], np.tile(rows[:, MU] * rows[:, PRELOAD], (2, 1)).T
    travels = np.divide(2.0 * limit, k, out=np.full(k.shape, np.inf), where=k > 0.0)
    return np.asarray(travels[np.any(np.isfinite(travels), axis=1)])


@lru_cache(maxsize=8)
def leaving(interface: Interface) -> BoolArray:
    """Return whether the law of each contact point (p,) slips or opens at some gap."""
    found: dict[int, bool] = {}
    for law in interface.laws:
        found.setdefault(id(law), _leaves(law))
    leaves = np.array([found[id(law)] for law in interface.laws], dtype=bool)
    leaves.setflags(write=False)
    return leaves


def _leaves(law: ContactLaw) -> bool:
    """Whether a law stops sticking at a large tangential displacement or a large gap."""
    return any(_state(law, gap) for gap in FAR * np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]]))


def _state(law: ContactLaw, gap: FloatArray) -> bool:
    state = law.initial_state()
    jac = np.zeros((3 + state.size, 6 + state.size))
    status = np.empty(2, dtype=np.int64)
    after = np.empty_like(state)
    law.kernel(gap, np.zeros(3), state, law.parameters(), np.empty(3), after, jac, status)
    return bool(np.any(status != STICK))
