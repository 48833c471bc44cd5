"""Direct time integration; it shares only the matrices and the contact laws with the harmonic balance.

A matrix exponential propagates the linear structure with all contacts stuck, and the periodic loads, exactly over a
step, for any damping matrix and any stiffness. The remaining contact force, minus the force of the stuck springs, is
interpolated linearly over the step (first-order hold) and solved implicitly. Sticking contacts are thus integrated
without error. For slipping and open contacts, the linear interpolation of a curved force reduces the mass on the spring
by about ``k h²/12``; changes of state add another error of second order in the step. Contact springs that vibrate much
faster than the load with their effective mass are therefore no part of the linear structure: their force is the mean of
both ends of the step, which conserves energy.
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

MOST_STEPS = 10_000_000  # a period with so many steps fills the memory of a large computer
DRIFT_THRESHOLD = 1e-4  # drift per period over a coordinate's swing


@dataclass(frozen=True)
class TimeStepping:
    """Step length and duration of a time integration.

    Parameters
    ----------
    steps_per_period
        Steps in a period of the excitation. An impact on a stiff spring needs several steps; where a sliding contact
        reverses within a step, the error is of first order.
    max_periods
        Largest number of periods.
    tolerance
        The driven harmonics (without a load: the first) are settled when their estimated remaining change, relative to
        the largest amplitude, is below this.
    harmonics
        Highest harmonic reported.
    min_periods
        Smallest number of periods, also for a settled motion: a disturbance may need them to grow.
    every_harmonic
        Judge all reported harmonics except the mean, not the driven ones only: a motion over several periods of the
        load shows in the others.
    rings
        Relative scatter up to which a motion counts as periodic but for vibration that neither decays nor grows, such
        as that of a damper on its contact springs; the integration then ends early, ``unsettled``. 0: never.
    """

    steps_per_period: int = quantity("steps in a period", default=1024, least=16, most=MOST_STEPS)
    max_periods: int = quantity("periods at most", default=3000, least=2)
    tolerance: float = quantity("relative change, 1e-5 is usual", default=1e-5, above=0, below=1)
    harmonics: int = quantity("highest harmonic reported", default=7, least=1)
    min_periods: int = quantity("periods at least", default=1, least=1)
    every_harmonic: bool = False
    rings: float = quantity("relative scatter, 1e-4 is usual", default=0.0, least=0, below=1)

    def __post_init__(self) -> None:
        check_quantities(self)
        if 2 * self.harmonics >= self.steps_per_period:
            problem = f"{self.harmonics} are too many for {self.steps_per_period} steps a period"
            raise input_error("TimeStepping.harmonics", problem, "Ask for less than half the number of steps.")


@dataclass(frozen=True, eq=False)
class TransientResult:
    """Last period of a time integration.

    Parameters
    ----------
    status
        ``settled``: the driven harmonics have become periodic; ``unsettled``: the periods ran out; ``diverged``: the
        motion overflowed, and all arrays are NaN.
    harmonics
        (n_h + 1, n_outputs) complex amplitudes over the last period, m.
    average
        (n_outputs,) first harmonic averaged over the last third of the periods, m: the value to use if undamped modes
        of a damper on its contact springs keep vibrating and nothing settles.
    averages
        (n_h + 1, n_outputs) averages of all harmonics, m.
    scatter
        Largest relative distance of a period's driven harmonics from the average.
    periods
        Number of periods integrated.
    change
        Largest relative change of the driven harmonics from one period to the next over the last few periods.
    remaining
        Sum of all future changes if they decay at the same rate (see `stickslip.response.time.settling`).
    decay
        Largest change in the last third of the periods over the third before: 1 for persistent vibration, more for
        growing motion. NaN if there are too few periods.
    contact_failures
        Time steps in which the contact equations were not solved to rounding.
    drift
        (n,) change of the mean displacement per period over the last third of the periods, m (rad).
    swing
        (n,) half of peak to peak displacement over the last period, m (rad).
    labels
        n names of the coordinates.
    final
        State at the end, from which an integration can continue.
    outputs
        (steps, n_outputs) displacements over the last period, at t = T/steps, 2T/steps, ... T; m.
    gap, contact_force
        (steps, n_contacts, 3) gaps (m) and forces ``T_t, T_w, -N`` (N) at the same times.
    step_angle
        Phase angle per step, rad, of the fastest contact that opens or closes in the last period: frequency of its
        stiffness and effective mass, times the step. See `stickslip.response.time.stepping.marcher`.
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
        """Whether the step is too long for the impacts of the stiffest opening contact.

        Harmonics may then have an error of a percent.
        """
        return self.step_angle > FINE

    @property
    def settled(self) -> bool:
        """Whether the driven harmonics have become periodic."""
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
    """Integrate ``M ü + C u̇ + K u + gap_operatorᵀ λ = f(t)`` until the driven harmonics of the outputs are periodic.

    Parameters
    ----------
    structure
        Any linear structure with a regular mass matrix; free rigid bodies are allowed. For a wheel, the structure of
        all sectors.
    gap_operator
        (3 n_contacts, n), dense or sparse: rows t, w, n of each contact; normal gap positive when open.
    laws
        One law for each contact, of any kind except `RigidCoulomb`, which has no stiffness.
    load
        Static and harmonic loads.
    omega
        Angular frequency, rad/s.
    outputs
        Dofs whose harmonics are reported.
    start
        State at t = 0; rest if None.
    stepping
        Step, number of periods and tolerance.
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
    """Integrate period by period until the remaining change of the judged harmonics is below the tolerance."""
    n, basis, record = marcher.n, marcher.modes.basis, marcher.record()
    unknown = np.full((stepping.harmonics + 1, len(outputs)), np.nan, dtype=complex)
    now = Progress(unknown, np.full(n, np.nan), judged=judged)
    while now.periods < stepping.max_periods and now.goes_on(stepping.min_periods, stepping.rings):
        began = state.x[:n].copy()
        failed = marcher.march(state, record)
        if failed < 0 or overflowed(state.x, record.motion):
            now.periods, now.status = now.periods + 1, "diverged"
            for array in (state.x, state.law, record.rows):  # no infinities in results
                array.fill(np.nan)
            break
        modal = period_harmonics(began, record.motion, stepping.harmonics)
        now.take_in(modal @ basis[outputs].T, basis @ modal[0].real, failed, stepping.tolerance)
    return _result(marcher, state, record, outputs, now)


def _result(marcher: Marcher, state: StepState, record: Record, outputs: IntArray, now: Progress) -> TransientResult:
    # values before an overflow are meaningless, too
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
