"""Direct time integration, without harmonics: it shares with the balance only the matrices and the contact laws.

The linear part, with every contact stuck, is propagated exactly over a step by a matrix exponential, whatever the damping
matrix and however stiff the modes; so are the periodic loads. What is left of the contact force, its departure from the
stuck springs, is interpolated linearly over the step (first-order hold) and solved for implicitly. A contact that sticks
is then integrated without error. One that slips or is open is not: its departure is curved, and the line in its place acts
like a mass ``k h²/12`` too little on the spring; the switches between states add another error of second order in the step.
Springs that with the mass they act on vibrate much faster than the load are therefore no part of the linear structure:
their force is held at the mean of both ends of the step, which does the work that their energy changes by.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error
from stickslip.harmonic.linear import LinearSide
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.time.settling import Progress, SettlingStatus, overflowed, period_harmonics
from stickslip.response.time.start import TransientStart, check_start, rest
from stickslip.response.time.stepping.contact_step import StepState
from stickslip.response.time.stepping.marcher import FINE, Marcher, Record, prepared
from stickslip.response.time.stepping.propagator import PeriodicLoad
from stickslip.units import check_quantities, quantity

MOST_STEPS = 10_000_000  # a period of which fills the memory of a large machine
DRIFT_THRESHOLD = 1e-4  # of a coordinate's own swing, per period


@dataclass(frozen=True)
class TimeStepping:
    """How finely and how long to integrate.

    Parameters
    ----------
    steps_per_period
        Steps in a period of the excitation. Impacts on stiff springs need several of them while they last; where a sliding contact
        turns within a step, the error is of first order.
    max_periods
        Give up settling after this many periods.
    tolerance
        The harmonics that the load drives (without one: the first) count as settled when what is left of their change, relative to
        their largest amplitude, is below this.
    harmonics
        Highest harmonic reported.
    min_periods
        Smallest number of periods, also for a settled motion: a disturbance may need them to grow.
    every_harmonic
        Judge all reported harmonics but the mean, not those that the load drives alone: of a motion over several periods of the load the
        others hold what is its own.
    """

    steps_per_period: int = quantity("steps in a period", default=1024, least=16, most=MOST_STEPS)
    max_periods: int = quantity("periods at most", default=3000, least=2)
    tolerance: float = quantity("relative change, 1e-5 is usual", default=1e-5, above=0, below=1)
    harmonics: int = quantity("highest harmonic reported", default=7, least=1)
    min_periods: int = quantity("periods at least", default=1, least=1)
    every_harmonic: bool = False

    def __post_init__(self) -> None:
        check_quantities(self)
        if 2 * self.harmonics >= self.steps_per_period:
            problem = f"{self.harmonics} are too many for {self.steps_per_period} steps a period"
            raise input_error("TimeStepping.harmonics", problem, "Ask for less than half the number of steps.")


@dataclass(frozen=True, eq=False)
class TransientResult:
    """The last period of an integration.

    Parameters
    ----------
    status
        ``settled``: the harmonics that the load drives have become periodic; ``unsettled``: the periods ran out; ``diverged``: the motion
        overflowed, and all arrays are NaN.
    harmonics
        (n_h + 1, n_outputs) complex amplitudes over the last period, m.
    average
        (n_outputs,) first harmonic averaged over the last third of the periods, m: the number to use where undamped
        modes of a damper on its contact springs go on ringing and nothing settles.
    averages
        (n_h + 1, n_outputs) the same of all harmonics.
    scatter
        Largest distance of a period's driven harmonics from that average, relative to it.
    periods
        Number of periods integrated.
    change
        Largest relative change of the driven harmonics from one period to the next over the last few periods.
    remaining
        Sum of the changes still to come, if they continue to decay at the same rate (see `stickslip.response.time.settling`).
    decay
        Largest such change of the last third of the periods over that of the third before: what goes on ringing has 1, what grows
        more. NaN where the periods are too few.
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
    step_angle
        Phase angle per step, rad, of the fastest contact that opens or closes in the last period: the frequency of its stiffness and the
        mass that moves with it, times the step. See `stickslip.response.time.stepping.marcher`.
    """

    status: SettlingStatus
    harmonics: ComplexArray
    average: ComplexArray
    averages: ComplexArray
    scatter: float
    periods: int
    change: float
    remaining: float
    decay: float
    contact_failures: int
    drift: FloatArray
    swing: FloatArray
    labels: tuple[str, ...]
    final: TransientStart
    outputs: FloatArray
    gap: FloatArray
    contact_force: FloatArray
    step_angle: float = float("nan")

    @property
    def coarse(self) -> bool:
        """Whether the step is too long to follow the impacts of the stiffest contact that opens: harmonics may be off by a percent."""
        return self.step_angle > FINE

    @property
    def settled(self) -> bool:
        """Whether the harmonics that the load drives have become periodic."""
        return self.status == "settled"

    @property
    def drifting(self) -> tuple[str, ...]:
        """Names of the coordinates whose mean moves by a visible share of their swing in every period."""
        visible = np.maximum(DRIFT_THRESHOLD * self.swing, 1e-9 * np.max(self.swing))
        return tuple(name for name, moves in zip(self.labels, np.abs(self.drift) > visible, strict=True) if moves)


@by_one_thread
def integrate(  # noqa: PLR0913
    structure: LinearSide,
    gap_operator: Matrix,
    laws: Sequence[ContactLaw],
    load: PeriodicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart | None = None,
    stepping: TimeStepping | None = None,
    *,
    weights: FloatArray | None = None,
) -> TransientResult:
    """Integrate ``M ü + C u̇ + K u + gap_operatorᵀ λ = f(t)`` until the outputs are periodic in the harmonics that the load drives.

    Parameters
    ----------
    structure
        Any linear structure with a regular mass matrix; free rigid bodies are welcome. Of a wheel, that of all its sectors.
    gap_operator
        (3 n_contacts, n), dense or sparse: rows t, w, n of each contact; normal gap positive when open.
    laws
        One law a contact, of any kind but `RigidCoulomb`, which has no stiffness.
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
    weights
        (n_contacts,) factors of the contact forces, such as the areas of an `Interface`; None: ones.

    Raises
    ------
    InputError
        If an argument has a wrong shape or value, the mass matrix is singular, or a contact is rigid.
    """
    stepping = stepping or TimeStepping()
    marcher = prepared(structure, gap_operator, laws, load, omega, stepping.steps_per_period, weights)
    check_outputs(outputs, marcher.n, "integrate")
    start = start or rest(marcher.n, laws)
    check_start(start, marcher.n, marcher.contacts, "integrate")
    driven = tuple(h for h, f in sorted(load.harmonics.items()) if 0 < h <= stepping.harmonics and np.any(f))
    judged = tuple(range(1, stepping.harmonics + 1)) if stepping.every_harmonic else driven or (1,)
    return _settle(marcher, marcher.begun(start), outputs, stepping, judged)


def _settle(
    marcher: Marcher, state: StepState, outputs: IntArray, stepping: TimeStepping, judged: tuple[int, ...]
) -> TransientResult:
    """March period by period until the remaining change of the judged harmonics is below the tolerance."""
    n, basis, record = marcher.n, marcher.modes.basis, marcher.record()
    unknown = np.full((stepping.harmonics + 1, len(outputs)), np.nan, dtype=complex)
    now = Progress(unknown, np.full(n, np.nan), judged=judged)
    while now.periods < stepping.max_periods and now.goes_on(stepping.min_periods):
        began = state.x[:n].copy()
        failed = marcher.march(state, record)
        if failed < 0 or overflowed(state.x, record.motion):
            now.periods, now.status = now.periods + 1, "diverged"
            for array in (state.x, state.law, record.rows):  # infinities are no numbers to go on with
                array.fill(np.nan)
            break
        modal = period_harmonics(began, record.motion, stepping.harmonics)
        now.take_in(modal @ basis[outputs].T, basis @ modal[0].real, failed, stepping.tolerance)
    return _result(marcher, state, record, outputs, now)


def _result(marcher: Marcher, state: StepState, record: Record, outputs: IntArray, now: Progress) -> TransientResult:
    # a number that overflowed later was none before
    known = np.nan if now.status == "diverged" else 1.0
    motion = record.motion @ marcher.modes.basis.T
    return TransientResult(
        status=now.status,
        harmonics=np.asarray(known * now.harmonics),
        average=np.asarray(known * now.average[1]),
        averages=np.asarray(known * now.average),
        scatter=known * now.scatter,
        periods=now.periods,
        change=known * now.change,
        remaining=known * now.remaining,
        decay=known * now.decay,
        contact_failures=now.failures,
        drift=known * now.drift,
        swing=np.ptp(motion, axis=0) / 2,
        labels=marcher.labels,
        final=marcher.end(state),
        outputs=motion[:, outputs],
        gap=record.gap,
        contact_force=record.force,
        step_angle=marcher.turn(record),
    )


def check_outputs(outputs: IntArray, n: int, caller: str) -> None:
    """Refuse outputs that the structure does not have."""
    if len(outputs) == 0 or np.min(outputs) < 0 or np.max(outputs) >= n:
        raise input_error(f"{caller}: outputs", f"got {outputs} for {n} dofs", f"Give indices from 0 to {n - 1}.")
