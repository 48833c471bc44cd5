"""Direct time integration: the judge of the harmonic balance, and of law and step of the library's own integrator.

It shares the method of propagation and the rule of settling with that integrator, as copies, and neither law nor step (``docs/judges.md``).

It reads the parameters of the library's laws, their matrices and loads, and nothing else.

The linear part, with every contact stuck, is propagated exactly over a step by a matrix exponential, whatever the damping
matrix and however stiff the modes; so are the periodic loads. What is left of the contact force, its departure from the
stuck springs, is interpolated linearly over the step (first-order hold) and solved for implicitly. A contact that sticks
is then integrated without error. One that slips or is open is not: its departure is curved, and the line in its place acts
like a mass ``k h²/12`` too little on the spring; the switches between states add another error of second order in the step.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from evidence.integrator.propagator import ModalCoordinates, PeriodicLoad, require_array, step_operators
from evidence.integrator.settling import Progress, SettlingStatus, overflowed, period_harmonics
from evidence.integrator.time_step import StepOperators, StepRecord, StepState, run_period, step_workspace
from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.harmonic.linear import LinearSide, one_structure
from stickslip.model.structure import Structure
from stickslip.units import check_quantities, quantity

DRIFT_THRESHOLD = 1e-4  # of a coordinate's own swing, per period


@dataclass(frozen=True)
class TimeStepping:
    """How finely and how long to integrate.

    Parameters
    ----------
    steps_per_period
        Steps in a period of the excitation. The fastest mode that the contact springs hold should have six or more of
        them in a cycle.
    max_periods
        Give up settling after this many periods.
    tolerance
        The first harmonic counts as settled when what is left of its change, relative to its amplitude, is below this.
    harmonics
        Highest harmonic reported.
    """

    steps_per_period: int = quantity("steps in a period", default=1024, least=16)
    max_periods: int = quantity("periods at most", default=3000, least=2)
    tolerance: float = quantity("relative change, 1e-5 is usual", default=1e-5, above=0, below=1)
    harmonics: int = quantity("highest harmonic reported", default=7, least=1)

    def __post_init__(self) -> None:
        check_quantities(self)
        if 2 * self.harmonics >= self.steps_per_period:
            problem = f"{self.harmonics} are too many for {self.steps_per_period} steps a period"
            raise input_error("TimeStepping.harmonics", problem, "Ask for less than half the number of steps.")


@dataclass(frozen=True, eq=False)
class TransientStart:
    """State at t = 0, which is also the state at any whole number of periods.

    Parameters
    ----------
    displacement, velocity
        (n,) in m and m/s.
    traction
        (n_contacts, 2) forces in the tangential contact springs, N; limited to μN on the first use.
    states
        (n_contacts, s) all that contacts remember, for `evidence.integrator.verlet`; None: no more than their tractions.
    """

    displacement: FloatArray
    velocity: FloatArray
    traction: FloatArray
    states: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class TransientResult:
    """What the last period of an integration looked like.

    Parameters
    ----------
    status
        ``settled``: the first harmonic has become periodic; ``unsettled``: the periods ran out; ``diverged``: the motion
        overflowed, and all arrays are NaN.
    harmonics
        (n_h + 1, n_outputs) complex amplitudes over the last period, m.
    average
        (n_outputs,) first harmonic averaged over the last third of the periods, m: the number to use where undamped
        modes of a damper on its contact springs go on ringing and nothing settles.
    scatter
        Largest distance of a period's first harmonic from that average, relative to it.
    periods
        Number of periods integrated.
    change
        Largest relative change of the first harmonic from one period to the next over the last few periods.
    remaining
        What is left to come of such changes if they go on decaying as they did (see `evidence.integrator.settling`).
    contact_failures
        Time steps in which the contact equations were not solved to rounding.
    drift
        (n,) change of the mean displacement per period over the last third of the periods, m (rad).
    swing
        (n,) half of peak to peak displacement over the last period, m (rad).
    labels
        n names of the coordinates.
    final
        State at the end, from which an integration can go on.
    outputs
        (steps, n_outputs) displacements over the last period, at t = T/steps, 2T/steps, ... T; m.
    gap, contact_force
        (steps, n_contacts, 3) gaps (m) and forces ``T_t, T_w, -N`` (N) at the same times.
    """

    status: SettlingStatus
    harmonics: ComplexArray
    average: ComplexArray
    scatter: float
    periods: int
    change: float
    remaining: float
    contact_failures: int
    drift: FloatArray
    swing: FloatArray
    labels: tuple[str, ...]
    final: TransientStart
    outputs: FloatArray
    gap: FloatArray
    contact_force: FloatArray

    @property
    def settled(self) -> bool:
        """Whether the first harmonic has become periodic."""
        return self.status == "settled"

    @property
    def drifting(self) -> tuple[str, ...]:
        """Names of the coordinates whose mean moves by a visible share of their swing in every period."""
        visible = np.maximum(DRIFT_THRESHOLD * self.swing, 1e-9 * np.max(self.swing))
        return tuple(name for name, moves in zip(self.labels, np.abs(self.drift) > visible, strict=True) if moves)


def rest(n: int, laws: Sequence[Any], caller: str = "integrate") -> TransientStart:
    """Return zero displacement and velocity of `n` coordinates, with the residual traction of each law."""
    known = _known(laws, caller)
    held = [(law.residual_traction or 0.0) * law.mu * max(law.preload, 0.0) for law in known]
    return TransientStart(np.zeros(n), np.zeros(n), np.tile(held, (2, 1)).T)


def start_from_harmonics(coefficients: ComplexArray, omega: float, traction: FloatArray) -> TransientStart:
    """Return the state at t = 0 of a motion ``Re Σ X_h e^{ihωt}``, such as that of a harmonic balance.

    With the balance's `problem` and `point`: ``problem.low.linear.recover(point.omega, point.coefficients)`` are the
    amplitudes of all dofs, and ``signals(problem, point).force[:, :2, 0]`` the tractions.

    Parameters
    ----------
    coefficients
        (H + 1, n) complex displacement amplitudes, m; harmonic 0 first.
    omega
        Angular frequency, rad/s.
    traction
        (n_contacts, 2) forces in the tangential contact springs at t = 0, N.
    """
    orders = np.arange(len(coefficients))[:, None]
    velocity = np.sum((1j * orders * omega * coefficients).real, axis=0)
    return TransientStart(np.sum(coefficients.real, axis=0), velocity, traction)


def integrate(
    structure: LinearSide,
    gap_operator: Matrix,
    laws: Sequence[Any],
    load: PeriodicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart | None = None,
    stepping: TimeStepping | None = None,
) -> TransientResult:
    """Integrate ``M ü + C u̇ + K u + gap_operatorᵀ λ = f(t)`` until the first harmonic of the outputs is periodic.

    Parameters
    ----------
    structure
        Any linear structure with a regular mass matrix; free rigid bodies are welcome. Of a wheel, that of all its sectors.
    gap_operator
        (3 n_contacts, n), dense or sparse: rows t, w, n of each contact; normal gap positive when open.
    laws
        One law a contact.
    load
        Static and harmonic loads.
    omega
        Angular frequency, rad/s.
    outputs
        Dofs whose harmonics are reported.
    start
        State at t = 0; rest if None.
    stepping
        Step, patience and tolerance.

    Raises
    ------
    InputError
        If an argument has a wrong shape or value, or the mass matrix is singular.
    """
    structure = one_structure(structure, "integrate")
    stepping = stepping or TimeStepping()
    start = start or rest(structure.n, laws)
    check_arguments(structure.n, len(laws), outputs, start)
    law = law_table(laws)
    operators, modes = step_operators(structure, gap_operator, law, load, omega, stepping.steps_per_period)
    state = initial_state(modes, gap_operator, law, start)
    return _settle(structure, operators, modes, state, outputs, stepping)


def _known(laws: Sequence[Any], caller: str) -> Sequence[Any]:
    """Return the laws if the integration has a step of its own for each of them."""
    for law in laws:
        if type(law).__name__ != "ElasticCoulomb":
            raise input_error(
                f"{caller}: laws", f"got {type(law).__name__}", "This integration judges ElasticCoulomb contacts only."
            )
    return laws


def law_table(laws: Sequence[Any], caller: str = "integrate") -> FloatArray:
    """Return (n_contacts, 5): k_t, k_w, k_n (N/m), mu, preload (N) of each contact.

    Raises
    ------
    InputError
        If a law is not elastic Coulomb.
    """
    rows = [[c.k_t, c.k_w, c.k_n, c.mu, c.preload] for c in _known(laws, caller)]
    return np.array(rows, dtype=float).reshape(-1, 5)


def initial_state(modes: ModalCoordinates, gap_operator: Matrix, law: FloatArray, start: TransientStart) -> StepState:
    """Return the step's own form of a start, with its springs limited to what friction holds."""
    gap = gap_operator @ start.displacement
    normal = np.maximum(0.0, law[:, 4] - law[:, 2] * gap[2::3])
    limit = (law[:, 3] * normal)[:, None]
    force = np.hstack([np.clip(start.traction, -limit, limit), -normal[:, None]]).ravel()
    beyond = force - law[:, :3].ravel() * gap
    return StepState(np.concatenate([modes.motion(start.displacement, start.velocity), beyond]), gap, force)


def _settle(
    structure: Structure,
    operators: StepOperators,
    modes: ModalCoordinates,
    state: StepState,
    outputs: IntArray,
    stepping: TimeStepping,
) -> TransientResult:
    """March period by period until what is left of the change of the first harmonic is below the tolerance."""
    n, k, steps = structure.n, len(state.gap), stepping.steps_per_period
    record = StepRecord(np.empty((steps, n)), np.empty((steps, k)), np.empty((steps, k)))
    work = step_workspace(k)
    unknown = np.full((stepping.harmonics + 1, len(outputs)), np.nan, dtype=complex)
    now = Progress(unknown, np.full(n, np.nan))
    while now.periods < stepping.max_periods and now.status == "unsettled":
        began = state.x[:n].copy()
        failed = run_period(operators, state, work, record)
        if failed < 0 or overflowed(state.x, record.motion):
            now.periods, now.status = now.periods + 1, "diverged"
            for array in (*state, *record):  # infinities are no numbers to go on with
                array.fill(np.nan)
            break
        modal = period_harmonics(began, record.motion, stepping.harmonics)
        now.take_in(modal @ modes.basis[outputs].T, modes.basis @ modal[0].real, failed, stepping.tolerance)
    return _result(structure, modes, state, record, outputs, now)


def _result(
    structure: Structure,
    modes: ModalCoordinates,
    state: StepState,
    record: StepRecord,
    outputs: IntArray,
    now: Progress,
) -> TransientResult:
    # a number that overflowed later was none before
    known = np.nan if now.status == "diverged" else 1.0
    motion = record.motion @ modes.basis.T
    displacement, velocity = modes.physical(state.x[: 2 * structure.n])
    contacts = (len(motion), -1, 3)
    return TransientResult(
        status=now.status,
        harmonics=np.asarray(known * now.harmonics),
        average=np.asarray(known * now.average),
        scatter=known * now.scatter,
        periods=now.periods,
        change=known * now.change,
        remaining=known * now.remaining,
        contact_failures=now.failures,
        drift=known * now.drift,
        swing=np.ptp(motion, axis=0) / 2,
        labels=structure.dofs.labels,
        final=TransientStart(displacement, velocity, state.force.reshape(-1, 3)[:, :2]),
        outputs=motion[:, outputs],
        gap=record.gap.reshape(contacts),
        contact_force=record.force.reshape(contacts),
    )


def check_arguments(
    n: int, n_contacts: int, outputs: IntArray, start: TransientStart, caller: str = "integrate"
) -> None:
    """Refuse a start of another shape, and outputs that the structure does not have."""
    require_array(f"{caller}: start.displacement", start.displacement, (n,))
    require_array(f"{caller}: start.velocity", start.velocity, (n,))
    require_array(f"{caller}: start.traction", start.traction, (n_contacts, 2))
    if len(outputs) == 0 or np.min(outputs) < 0 or np.max(outputs) >= n:
        raise input_error(f"{caller}: outputs", f"got {outputs} for {n} dofs", f"Give indices from 0 to {n - 1}.")
