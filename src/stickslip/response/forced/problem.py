"""Problem of a forced response, set up for all passages, and its points."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.event_integrals import Events
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.dlft import DynamicLagrangian, dynamic_lagrangian
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import ByDof, Harmonics, is_full, kept_by_dof, padded, supports_of
from stickslip.harmonic.harmonics_per_dof import AnyBalance, LocalBalance
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.selection.strategy import ErrorMeasure, Solve, Step, Strategy, always_kept
from stickslip.response.continuation.branch import Judged, following_vibration
from stickslip.response.forced.amplitude import amplitudes, error_measure
from stickslip.response.forced.choices import Stage
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.continuation import STEPS_BETWEEN, Following, Point, start_point, step_to
from stickslip.solve.krylov import to_tolerance
from stickslip.solve.newton_method import Solution
from stickslip.solve.status import Rung, Status


@dataclass(frozen=True, eq=False)
class Shot:
    """Periodic motion found by shooting; see `stickslip.response.ShootingResult`.

    Attributes
    ----------
    residual
        Change of the state over a period, relative to the vibration.
    step_error
        Estimated error of the harmonics by the time step, relative to the largest.
    growth_error
        Estimated error of the largest multiplier by the time step; 0 where it is far from 1.
    steps
        Time steps in a period.
    periods
        Periods integrated.
    multipliers
        (n_states,) Floquet multipliers.
    displacement, velocity
        (n,) state at t = 0, m and m/s.
    states
        States of all contact laws at t = 0, one contact after the other.
    """

    residual: float
    step_error: float
    growth_error: float
    steps: int
    periods: int
    multipliers: ComplexArray
    displacement: FloatArray
    velocity: FloatArray
    states: FloatArray

    @property
    def error(self) -> float:
        """Error for the verdict on the motion, a fraction; infinite if unknown."""
        return self.step_error if np.isfinite(self.step_error) else float("inf")


Balance = HarmonicBalance | DynamicLagrangian
FAINTEST = 1e-7  # smallest excitation over static load, a thousand times the residual tolerance
ALERT_TOLERANCE = 1e-6  # relative residual of the alert's step by an iterative solver
SAMPLES_A_HARMONIC = 8  # smallest number of samples, whatever the sweep has
BRANCH_ITERATIONS = 10  # of a corrector along a branch
DETOUR = 30  # largest number of points between a neighbour and a frequency


@dataclass(frozen=True, eq=False)
class ForcedPoint:
    """Solution at one frequency of a forced response.

    It holds arrays and numbers only, so that a journal can store and restore it.

    Attributes
    ----------
    stage
        With ``high = "auto"``, the kinds of `stickslip.response.continuation.adaptive_continuation.Followed`:
        ``point``, ``audit``, ``trial``, ``found``. In the published passages, ``low``: first passage; ``high``: repeat
        with more harmonics; ``branch``: on the branch with more harmonics, where repeats failed. In all responses,
        ``peak``: added to resolve the peak; ``check``: a ``peak`` with more harmonics, for comparison; ``in_time``: a
        failed frequency solved from time integration; ``settled``: with more harmonics, where only a prediction judged
        the point before; ``compared``: with more harmonics, for comparison. Among several ``peak`` or ``settled``
        points at a frequency, the one with most harmonics counts.
    index
        Position in the stage. A ``high`` point has the index of the ``low`` point that it repeats, a ``branch`` point
        the index of the first repeat that it replaces.
    omega
        Frequency, rad/s.
    coefficients
        (order+1, n_retained) complex displacement of the retained coordinates, m.
    tangent, step, orientation
        Scaled tangent, step length and orientation of the branch; empty and 0 outside the first passage.
    status
        How the solver ended; a point that did not converge is no solution.
    iterations
        Newton steps.
    predicted_error
        Indicator of the strategy; for an alert, the predicted error as a fraction. NaN where it was not computed.
    seconds_contact, seconds_linear, seconds_total
        Computing time of contact forces, of factorisations, and total, s.
    rescue
        Method that found the solution.
    harmonics
        Harmonics kept, in ascending order from 0.
    asked
        Harmonics of the solution that the strategy requests next; empty: no request.
    start
        (H+1, n_retained) starting coefficients of that solution, m; empty: no start, or no request.
    kept
        (n_harmonics, n_retained) 1 where a coordinate keeps a harmonic, else 0; empty: all coordinates keep all
        harmonics.
    marched
        Results of time integration, in the order of `stickslip.response.forced.from_time.Marched`; empty without one.
    shot
        Results of shooting; empty for a response by harmonic balance.
    """

    stage: Stage
    index: int
    omega: float
    coefficients: ComplexArray
    tangent: FloatArray
    step: float
    status: Status
    iterations: int
    predicted_error: float
    seconds_contact: float
    seconds_linear: float
    seconds_total: float
    orientation: float = 0.0
    rescue: Rung = Rung.FULL_STEPS
    harmonics: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    asked: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    start: ComplexArray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    kept: IntArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    marched: FloatArray = field(default_factory=lambda: np.zeros(0))
    shot: tuple[Shot, ...] = ()

    @property
    def unknowns(self) -> int:
        """Number of real unknowns; for shooting, the states."""
        if self.shot:
            (one,) = self.shot
            return 2 * one.displacement.size + one.states.size
        if self.kept.size:
            return 2 * int(self.kept.sum()) - int(self.kept[0].sum())
        return (2 * int(self.harmonics.size) - 1) * int(self.coefficients.shape[1])

    @property
    def by_dof(self) -> ByDof | None:
        """Harmonics of each retained coordinate, where these differ."""
        return supports_of(self.kept > 0, self.support) if self.kept.size else None

    @property
    def order(self) -> int:
        """Highest harmonic kept at this point."""
        return int(self.coefficients.shape[0]) - 1

    @property
    def support(self) -> Harmonics:
        """Harmonics kept, as a tuple."""
        return tuple(self.harmonics.tolist())

    @property
    def converged(self) -> bool:
        """Whether the point is a solution."""
        return self.status.converged


@dataclass(frozen=True, eq=False)
class ForcedProblem:
    """Forced response of a system under a load, set up for all passages."""

    system: System
    sweep: Sweep
    low: Balance
    high: Balance
    others: dict[Harmonics, Balance] = field(default_factory=dict)  # made when first needed
    ways: dict[AnyBalance, Following] = field(default_factory=dict, init=False)  # continuation options
    own_errors: dict[ForcedPoint, float] = field(default_factory=dict, init=False)  # predicted

    @cached_property
    def strategy(self) -> Strategy:
        """Strategy that chooses harmonics."""
        return self.sweep.strategy

    @cached_property
    def measure(self) -> ErrorMeasure:
        """Error measure over the watched dofs."""
        system = self.system
        dofs = system.outputs if system.alert_dofs is None else system.alert_dofs
        return error_measure(system, self.sweep, self.driven, dofs)

    @cached_property
    def of_outputs(self) -> ErrorMeasure:
        """Error measure over the outputs, by their positions."""
        outputs = self.system.outputs
        return error_measure(self.system, self.sweep, self.driven, outputs, np.arange(outputs.size))

    @property
    def alert_solve(self) -> Solve:
        """Linear solver of the alert's enlarged system: Newton's solver with a tolerance for errors of 0.1 %."""
        return to_tolerance(self.sweep.newton.linear, ALERT_TOLERANCE).solve

    def balance(self, harmonics: Harmonics) -> Balance:
        """Return the periodic problem with these harmonics."""
        for own in (self.low, self.high):
            if own.harmonics == harmonics:
                return own
        if harmonics not in self.others:
            samples = max(self.low.samples, SAMPLES_A_HARMONIC * harmonics[-1])
            enough = replace(self.low, samples=samples)
            self.others[harmonics] = enough.with_harmonics(harmonics)
        return self.others[harmonics]

    def local(self, harmonics: Harmonics, by_dof: ByDof | None) -> AnyBalance:
        """Return the periodic problem with harmonics by retained coordinate.

        If these are None, all coordinates have `harmonics`.
        """
        whole = self.balance(harmonics)
        if by_dof is None or all(own == harmonics for own in by_dof):
            return whole
        return LocalBalance(with_stiffness(whole), by_dof)

    def step(
        self,
        balance: AnyBalance,
        x: FloatArray,
        omega: float,
        next_omega: float | None = None,
        left: Events | None = None,
    ) -> Step:
        """Return a strategy's input for a scaled solution of `balance`.

        `left` are the contact events of its evaluation, if known.
        """
        smallest = self.sweep.low_harmonics
        by_dof = None
        if isinstance(balance, LocalBalance):
            by_dof, x, balance = balance.by_dof, balance.whole(x), balance.balance
        following = omega if next_omega is None else next_omega
        return Step(
            with_stiffness(balance),
            with_stiffness(self.high),
            smallest,
            x,
            omega,
            following,
            self.measure,
            self.alert_solve,
            left=left,
            by_dof=by_dof,
        )

    def following(self, balance: AnyBalance) -> Following:
        """Return the continuation options of `balance`."""
        if balance in self.ways:
            return self.ways[balance]
        # along a branch a shorter step is cheaper than a long correction
        most = min(BRANCH_ITERATIONS, self.sweep.newton.max_iterations)
        few = replace(self.sweep.newton, max_iterations=most)
        way = following_vibration(balance, self.sweep.control, few)
        if not isinstance(balance, LocalBalance):
            self.ways[balance] = way
        return way

    def along_branch(self, point: ForcedPoint, omega: float, balance: AnyBalance, steps: int = STEPS_BETWEEN) -> Point:
        """Follow the branch from a solution to another frequency with the harmonics of `balance`.

        It takes at most `steps` Newton steps.
        """
        following = self.following(balance)
        most = min(DETOUR, following.control.max_points)
        following = replace(following, control=replace(following.control, max_points=most))
        start = start_point(balance, balance.unknowns(point.coefficients), point.omega, following)
        if not start.solution.status.converged:
            return start
        return step_to(balance, start, omega, following, steps)

    def alerted(self, point: ForcedPoint) -> bool:
        """Whether the alert requests more harmonics at a point of the first passage."""
        return point.converged and bool(point.predicted_error > self.strategy.threshold)

    @property
    def repeats(self) -> bool:
        """Whether a frequency may be solved again with the harmonics of the reference."""
        return always_kept(self.strategy) != "low"

    def asks_again(self, point: ForcedPoint) -> bool:
        """Whether to repeat a point of the first passage.

        The reason is an alert, or a failure that neighbours or more harmonics may resolve.
        """
        anew = self.sweep.rescue == "all" or point.support != self.high.harmonics
        return (self.repeats and not point.converged and anew) or self.alerted(point)

    def branch_point(self, point: ForcedPoint, balance: Balance | None = None) -> Point:
        """Return a point of a branch as the start of its continuation; `balance` has its harmonics."""
        x = (balance or self.balance(point.support)).unknowns(point.coefficients)
        contact, linear = point.seconds_contact, point.seconds_linear
        solution = Solution(x, point.status, point.iterations, 0.0, contact, linear, rung=point.rescue)
        return Point(x, point.omega, point.tangent, point.step, solution, point.orientation)

    def real_error(self, point: ForcedPoint, reference: ForcedPoint) -> float:
        """Return the largest relative error of a point against a reference at its frequency, a fraction.

        This is eq. 29 for the published measure.
        """
        return self.difference(point.omega, point.coefficients, reference.coefficients)[0]

    def difference(self, omega: float, one: ComplexArray, other: ComplexArray) -> tuple[float, int]:
        """Return the largest difference of two motions (H+1, n_retained), relative to the first, and its dof."""
        rows = self.measure.rows(len(one), len(other))
        linear = self._linear_of(rows - 1)
        motion, exact = (linear.recover(omega, padded(q, rows - 1)[:rows]) for q in (one, other))
        return self.measure.change(motion, exact - motion)[:2]

    def _linear_of(self, order: int) -> DynamicStiffness:
        """Return a linear side with matrices for harmonics up to `order`; for a wheel, from a balance that has them."""
        every = (self.low, self.high, *self.others.values())
        known = (b.linear for b in every if b.linear.most is None or b.linear.most >= order)
        return next(known, self.low.linear)

    @cached_property
    def driven(self) -> Harmonics:
        """Harmonics that the load drives; 1 where it drives none."""
        forces = self.low.linear.load.harmonics
        return tuple(h for h in sorted(forces) if np.any(forces[h])) or (1,)

    def amplitude(self, point: ForcedPoint, output: int | None = None) -> float:
        """Return the amplitude of output number `output` at a point, m; see `amplitude_of`."""
        return self.amplitude_of(point.omega, point.coefficients, output)

    def amplitude_of(self, omega: float, coefficients: ComplexArray, output: int | None = None) -> float:
        """Return the amplitude of output number `output`, m, as the sweep measures it.

        None: the largest amplitude of the outputs that define the system's peak.
        """
        motion, system = self.low.linear.recover(omega, coefficients), self.system
        first = np.zeros(1, dtype=np.int64) if system.peak_of is None else system.peak_of
        chosen = first if output is None else np.array([output])
        every = amplitudes(motion[:, system.outputs[chosen]], self.driven, self.sweep.amplitude_of)
        return float(every.max())


def forced_problem(system: System, load: HarmonicLoad, sweep: Sweep) -> ForcedProblem:
    """Set up the forced response of `system` under `load`.

    The cap of ``auto`` is lowered to the harmonics of a tuned wheel.
    """
    refuse_ill_posed(system)
    if sweep.auto and system.structure.harmonics:
        sweep = replace(sweep, cap=max(min(sweep.cap, system.structure.harmonics), 1))
    first, reference = sweep.first_harmonics, sweep.high_harmonics
    for h, force in load.harmonics.items():
        if h not in first and np.any(force):
            raise input_error(
                "HarmonicLoad",
                f"excites harmonic {h}, but the first passage keeps {', '.join(map(str, first))}",
                f"Give Sweep(low={h}, high={max(h, reference[-1])}) or more.",
            )
    linear = system.condensed(load, reference[-1])
    low = _periodic(system, linear, sweep)
    # compare norms, as the residual tolerance is one
    dynamic = float(np.linalg.norm(list(load.harmonics.values())))
    if 0.0 < dynamic < FAINTEST * low.force_scale:
        raise input_error(
            "HarmonicLoad",
            f"the excitation is {dynamic / low.force_scale:.2g} of the static load or preload on the coordinates of the model, "
            f"{dynamic:.3g} of {low.force_scale:.3g} N: below {FAINTEST:g} it is too faint for the tolerance of the solver",
            "Solve the stuck structure, which is linear, or raise the excitation.",
        )
    high = low if sweep.auto else low.with_harmonics(reference)
    made = ForcedProblem(system, sweep, low, high)
    return replace(made, high=made.balance(reference)) if sweep.auto else made


def with_stiffness(balance: AnyBalance) -> HarmonicBalance:
    """Return a periodic problem with contact forces as functions of the gaps.

    All coordinates have all harmonics.

    Raises
    ------
    InputError
        If a contact is rigid.
    """
    if isinstance(balance, LocalBalance):
        return balance.balance
    if isinstance(balance, DynamicLagrangian):
        raise input_error(
            "rigid contacts",
            "have forces that are no functions of the gaps, from which no error of missing harmonics follows",
            "Keep more harmonics and compare, or give the contacts a stiffness.",
        )
    return balance


def _periodic(system: System, linear: DynamicStiffness, sweep: Sweep) -> Balance:
    """Return the periodic problem of the first passage; rigid contacts need all harmonics at all coordinates."""
    first, interface = sweep.first_harmonics, system.interface
    if not interface.rigid:
        return harmonic_balance(linear, interface, first, sweep.samples, sweep.evaluator)
    if always_kept(sweep.strategy) is None:
        raise input_error(
            "Sweep.selection",
            "chooses harmonics from forces that are functions of the gap, and a contact is rigid",
            "Give selection='always_high'.",
        )
    if not (is_full(first) and is_full(sweep.high_harmonics)):
        raise input_error("Sweep", "leaves out harmonics, and a contact is rigid", "Keep all up to the highest.")
    order = first[-1]
    return dynamic_lagrangian(linear, interface, order, sweep.samples, None, sweep.evaluator)


def forced_point(
    balance: AnyBalance,
    solution: Solution,
    stage: Stage,
    index: int,
    omega: float,
    seconds: float,
    there: Point | None = None,
    judged: Judged = Judged(),  # noqa: B008  # frozen
) -> ForcedPoint:
    """Return a solution as a point of the response.

    It has the tangent and step of the branch `there`, and its estimated error `judged`.
    """
    tangent: FloatArray = np.zeros(0)
    step = sign = 0.0
    if there is not None:
        tangent, step, sign = there.tangent, there.step, there.orientation
    point = ForcedPoint(
        stage,
        index,
        omega,
        balance.coefficients(solution.x),
        tangent,
        step,
        solution.status,
        solution.iterations,
        judged.bound,
        solution.seconds_contact,
        solution.seconds_linear,
        seconds,
        sign,
        solution.rung,
        np.array(balance.harmonics),
        np.array(judged.asked, dtype=np.int64),
        np.zeros((0, 0), dtype=complex) if judged.start is None else judged.start,
    )
    if not isinstance(balance, LocalBalance):
        return point
    return replace(point, kept=kept_by_dof(balance.by_dof, balance.harmonics).astype(np.int64))


def refuse_ill_posed(system: System) -> None:
    """Refuse a system without unknowns or with negative masses."""
    if not system.retained.size:
        raise input_error(
            "System.interface",
            "touches no dof that can move: nothing is left to solve for",
            "Let a contact touch a free dof; without contacts the response is linear.",
        )
    structure = system.structure.of_harmonic(0)
    mass = structure.mass.diagonal().real
    if np.any(mass < 0):
        dof = int(np.argmin(mass))
        raise input_error(
            "System.structure",
            f"has the mass {mass[dof]:.6g} at {structure.dofs.labels[dof]}",
            "A mass matrix is positive definite: check its source.",
        )
