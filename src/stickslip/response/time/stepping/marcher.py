"""Structure with contacts, prepared for time integration with a step that resolves impacts.

A contact of stiffness k vibrates with its effective mass m at √(k/m), and an impact lasts half a period of this
vibration. The accuracy with a step h depends on the angle ``√(k/m) h``. For masses on stops, the error against an
integrator with exact events (`tests/test_step_choice.py`) is below 1 % for angles up to `FINE`, and below 2 % up to
`ROUGH`. Contacts that stay closed, and contacts that slip, need no fine steps.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.contact.law import ContactLaw
from stickslip.harmonic.linear import LinearSide, one_structure
from stickslip.response.time.start import TransientStart
from stickslip.response.time.stepping.contact_step import LawWork, StepState, TimeContacts, law_work, time_contacts
from stickslip.response.time.stepping.propagator import ModalCoordinates, PeriodicLoad, step_operators
from stickslip.response.time.stepping.step_newton import NewtonWork, newton_work
from stickslip.response.time.stepping.time_step import (
    BEGIN,
    FAILED,
    FIRST,
    LOGS,
    ROWS,
    STEPS,
    TAKEN,
    StepLog,
    StepOperators,
    run_steps,
)

STEP_FLOPS = 1e4  # least work of a step
LOG_NUMBERS = 4_000_000  # entries of the log of the laws' derivatives: 32 MB
FINE, ROUGH = 0.2, 0.3  # rad
LOOK = 4  # periods that show which contacts open and close
MOST_STEPS = 8192  # in a period


def step_work(coordinates: int, gaps: int) -> float:
    """Estimate the floating-point operations of a step from the numbers of coordinates and gaps.

    A contact has three gaps.
    """
    return STEP_FLOPS + 8.0 * coordinates**2 + float(gaps) ** 3


@dataclass(frozen=True, eq=False)
class Record:
    """Samples of a period at the end of every step.

    Parameters
    ----------
    rows
        (steps, n + 2k): modal displacements, gaps, forces.
    n
        Number of modal coordinates.
    """

    rows: FloatArray
    n: int

    @property
    def motion(self) -> FloatArray:
        """(steps, n) modal displacements."""
        return self.rows[:, : self.n]

    @property
    def gap(self) -> FloatArray:
        """(steps, n_contacts, 3) gaps, m."""
        return self._contacts(0)

    @property
    def force(self) -> FloatArray:
        """(steps, n_contacts, 3) forces, N."""
        return self._contacts(1)

    def _contacts(self, which: int) -> FloatArray:
        steps, width = self.rows.shape
        k = (width - self.n) // 2
        return self.rows[:, self.n + which * k : self.n + (which + 1) * k].reshape(steps, k // 3, 3)


@dataclass(frozen=True, eq=False)
class Marcher:
    """Structure with contacts, prepared for time integration.

    Parameters
    ----------
    operators, modes, contacts
        Matrices of a step, their modal coordinates, and the laws.
    labels
        Names of the coordinates.
    """

    operators: StepOperators
    modes: ModalCoordinates
    contacts: TimeContacts
    labels: tuple[str, ...]
    _work: tuple[LawWork, NewtonWork] = field(repr=False)

    @property
    def n(self) -> int:
        """Number of coordinates of the structure."""
        return self.modes.speed.size

    @property
    def k(self) -> int:
        """Number of gaps."""
        return 3 * self.contacts.n

    @property
    def steps(self) -> int:
        """Steps in a period."""
        return len(self.operators.drive)

    @property
    def slowest(self) -> float:
        """Decay factor per period of the slowest free motion with contacts stuck."""
        step = np.linalg.eigvals(self.operators.transfer[: 2 * self.n])
        return float(np.abs(step).max(initial=0.0) ** self.steps)

    @property
    def work(self) -> float:
        """Estimated floating point operations of a period; see `step_work`."""
        return self.steps * step_work(self.n, self.k)

    def turn(self, record: Record) -> float:
        """Return the largest phase angle per step, rad, of the contacts that open or close in a record.

        It is the contact frequency times the step.

        If it is large, the step does not resolve impacts; see `stickslip.response.time.stepping.marcher`.
        """
        shut = record.force[:, :, 2] != 0.0
        hits = np.any(shut, axis=0) & ~np.all(shut, axis=0)
        step = 2.0 * np.pi / (self.modes.omega * self.steps)
        return step * float(np.max(self.modes.paces[2::3][hits], initial=0.0))

    def begun(self, start: TransientStart) -> StepState:
        """Return an initial state in the form of the time step."""
        states = [np.asarray(s, dtype=float).ravel() for s in start.states]
        motion = self.modes.motion(start.displacement, start.velocity)
        return self.begin(motion, np.concatenate([*states, np.zeros(0)]))[0]

    def begin(self, motion: FloatArray, law: FloatArray) -> tuple[StepState, FloatArray]:
        """Return a state with its contact forces, and the derivatives of the laws.

        The forces follow from gaps, rates and law states (n_states,).
        """
        seen = np.vstack([(self.modes.seen @ motion).reshape(2, self.k), np.zeros((1, self.k))])
        status = np.full((self.contacts.n, 2), -1)  # not open before
        state = StepState(np.concatenate([motion, np.zeros(self.k)]), seen, law.copy(), status)
        log = self._log(1)
        self._run(state, self.record(0), log, {BEGIN: 1, LOGS: 1})
        return state, log.jac[0]

    def end(self, state: StepState) -> TransientStart:
        """Return a state as the start of another integration."""
        displacement, velocity = self.modes.physical(state.x[: 2 * self.n])
        states = tuple(s.copy() for s in self.contacts.separate(state.law))
        return TransientStart(displacement, velocity, states)

    def record(self, steps: int | None = None) -> Record:
        """Return an empty record for a period, or for this number of steps."""
        steps = self.steps if steps is None else steps
        return Record(np.empty((steps, self.n + 2 * self.k)), self.n)

    def march(self, state: StepState, record: Record) -> int:
        """Fill the record with steps from t = 0 on; return the number of failed steps, or -1 after an overflow."""
        plan = self._run(state, record, self._log(0), {STEPS: len(record.rows)})
        return int(plan[FAILED])

    def march_logged(self, state: StepState, record: Record, use: Callable[[StepLog, int], None]) -> int:
        """Integrate like `march`, and log the derivatives of the laws.

        The log and its number of rows are passed to `use` whenever the log is full.
        """
        steps, taken, failures = len(record.rows), 0, 0
        log = self._log(max(1, min(steps, LOG_NUMBERS // max(self.contacts.log_width, 1))))
        while taken < steps:
            plan = self._run(state, record, log, {FIRST: taken, STEPS: steps - taken, LOGS: 1})
            if plan[FAILED] < 0:
                return -1
            taken, failures = taken + int(plan[TAKEN]), failures + int(plan[FAILED])
            use(log, int(plan[ROWS]))
        return failures

    def _log(self, rows: int) -> StepLog:
        return StepLog(np.empty((rows, self.contacts.log_width)), np.zeros(rows, dtype=np.int64))

    def _run(self, state: StepState, record: Record, log: StepLog, task: dict[int, int]) -> IntArray:
        plan = np.zeros(7, dtype=np.int64)
        for what, value in task.items():
            plan[what] = value
        run_steps()(self.contacts.table, self.operators, state, *self._work, record.rows, log, plan)
        return plan


def prepared(
    structure: LinearSide,
    gap_operator: Matrix,
    laws: Sequence[ContactLaw],
    load: PeriodicLoad,
    omega: float,
    steps: int,
    weights: FloatArray | None = None,
    caller: str = "integrate",
) -> Marcher:
    """Return the prepared structure with `steps` steps in a period; other arguments as in `integrate`.

    Parameters
    ----------
    caller
        Public function named in errors.
    """
    one = one_structure(structure, caller)
    laid = time_contacts(laws, weights, caller)
    operators, modes, springs = step_operators(one, gap_operator, laid.table.stuck, load, omega, steps, caller)
    contacts = laid.on(springs)
    n_states = contacts.start.size
    work = (law_work(contacts.n, n_states, contacts.log_width), newton_work(2 * one.n, 3 * contacts.n))
    return Marcher(operators, modes, contacts, one.dofs.labels, work)


def with_enough_steps(
    made: Callable[[int], Marcher], start: TransientStart, least: int, angle: float = FINE
) -> Marcher:
    """Return the prepared structure with a step that resolves the impacts of its first periods.

    Parameters
    ----------
    made
        Function that prepares the structure with a given number of steps in a period.
    start
        Initial state.
    least
        Smallest number of steps in a period; it is doubled as needed, up to `MOST_STEPS`.
    angle
        Largest phase angle per step, rad.
    """
    marcher = made(least)
    state, record, seen = marcher.begun(start), marcher.record(), 0.0
    for _ in range(LOOK):
        if marcher.march(state, record) < 0:
            break
        seen = max(seen, marcher.turn(record))
    steps = least
    while seen > angle and 2 * steps <= MOST_STEPS:
        steps, seen = 2 * steps, seen / 2.0
    return marcher if steps == least else made(steps)
