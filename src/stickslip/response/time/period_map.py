"""The map from a state to the state one period later, with its derivative, for `stickslip.response.time.shooting`.

It is the compiled time step of `integrate`, period for period, so that a fixed point of the map is a motion that
`integrate` would find settled, with the same error of the step.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.contact.law import ContactLaw
from stickslip.model.structure import Structure
from stickslip.response.time.propagator import ModalCoordinates, PeriodicLoad, step_operators
from stickslip.response.time.settling import overflowed
from stickslip.response.time.step_tangent import (
    TangentOperators,
    equal_steps,
    fresh_tangent,
    run_tangent_period,
    tangent_operators,
)
from stickslip.response.time.time_step import (
    StepOperators,
    StepRecord,
    StepState,
    StepWork,
    run_period,
    step_workspace,
)
from stickslip.response.time.transient import TransientStart, initial_state, law_table


@dataclass(frozen=True, eq=False)
class Image:
    """One period from a state.

    Parameters
    ----------
    state
        (size,) at the end; NaN if the motion overflowed.
    failures
        Steps in which the contact equations were not solved to rounding; -1 if the motion overflowed.
    record
        The steps of the period.
    """

    state: FloatArray
    failures: int
    record: StepRecord


@dataclass(frozen=True, eq=False)
class Derivative:
    """One period from a state, with the derivative of where it ends by where it begins.

    Parameters
    ----------
    image
        The period.
    monodromy
        (size, size) derivative of its end; NaN if the motion overflowed.
    grazing
        Number of tangential springs that reached their limit without slipping, and were taken as sticking.
    """

    image: Image
    monodromy: FloatArray
    grazing: int


@dataclass(frozen=True, eq=False)
class PeriodMap:
    """The period map in coordinates whose square is an energy: modal displacement, velocity, spring force.

    A state is ``(ωs q, ωs w, T/√k)`` with q, w and the speeds s of `ModalCoordinates` and T the forces in those
    tangential springs that have a stiffness. Half its squared length is the energy of the modes and of the springs, in
    J; with it, distances of states mean the same for stiff and for soft coordinates.
    """

    operators: StepOperators
    linear: TangentOperators
    modes: ModalCoordinates
    springs: IntArray  # (size - m,) rows of the gaps whose tangential spring has a stiffness
    scale: FloatArray  # (size,) factors of (q, w, T)
    held: FloatArray  # (k,) forces in springs of no stiffness, which no motion changes
    steps: int
    work: StepWork = field(repr=False)

    @property
    def size(self) -> int:
        """Number of coordinates of a state."""
        return self.scale.size

    def start_of(self, state: FloatArray) -> StepState:
        """Return the state in the form that the step takes, its springs as they are."""
        m, law = 2 * self.modes.speed.size, self.operators.law
        plain = state / self.scale
        gap = self.linear.gaps @ plain[: m // 2]
        force = self.held.copy()
        force[self.springs] = plain[m:]
        force[2::3] = -np.maximum(0.0, law[:, 4] - law[:, 2] * gap[2::3])
        return StepState(np.concatenate([plain[:m], force - law[:, :3].ravel() * gap]), gap, force)

    def state_of(self, step: StepState) -> FloatArray:
        """Return the coordinates of a state of the step."""
        motion = step.x[: 2 * self.modes.speed.size]
        return np.asarray(self.scale * np.concatenate([motion, step.force[self.springs]]))

    def image(self, state: FloatArray) -> Image:
        """March one period."""
        step, record = self.start_of(state), self._record()
        return self._ended(step, run_period(self.operators, step, self.work, record), record)

    def derivative(self, state: FloatArray) -> Derivative:
        """March one period with its tangents."""
        step, record = self.start_of(state), self._record()
        tangent = fresh_tangent(self._first_tangents(step), step.gap.size)
        m, law = 2 * self.modes.speed.size, self.operators.law[:, :3].ravel()
        equal = equal_steps(m, step.gap.size)
        failures = run_tangent_period(
            self.operators, self.linear, step, self.work, record, tangent, equal
        )
        image = self._ended(step, failures, record)
        lost = np.nan if image.failures < 0 else 1.0
        motion, beyond = tangent.state[:m], tangent.state[m:]
        forces = beyond + law[:, None] * (self.linear.gaps @ motion[: m // 2])
        matrix = np.vstack([motion, forces[self.springs]])
        return Derivative(
            image,
            lost * self.scale[:, None] * matrix / self.scale,
            int(np.count_nonzero(tangent.grazed)),
        )

    def _ended(self, step: StepState, failures: int, record: StepRecord) -> Image:
        """Return the period that ends at `step`; all NaN if its squares would overflow."""
        state = self.state_of(step)
        if failures < 0 or overflowed(state, record.motion):
            for array in (state, *record):
                array.fill(np.nan)
            failures = -1
        return Image(state, failures, record)

    def _record(self) -> StepRecord:
        n, k = self.modes.speed.size, self.held.size
        return StepRecord(*(np.empty((self.steps, width)) for width in (n, k, k)))

    def _first_tangents(self, step: StepState) -> FloatArray:
        """Return (m + k, size) derivatives of the step's state by (q, w, T)."""
        n, law = self.modes.speed.size, self.operators.law[:, :3].ravel()
        first = np.zeros((2 * n + step.gap.size, self.size))
        first[: 2 * n, : 2 * n] = np.eye(2 * n)
        first[2 * n :, :n] = -law[:, None] * self.linear.gaps
        # a closed contact holds its normal spring: no force beyond it
        first[2 * n + 2 :: 3][step.force[2::3] < 0.0] = 0.0
        first[2 * n + self.springs, 2 * n + np.arange(self.springs.size)] = 1.0
        return first


def period_map(
    structure: Structure,
    gap_operator: Matrix,
    laws: Sequence[ContactLaw],
    load: PeriodicLoad,
    omega: float,
    start: TransientStart,
    steps: int,
) -> tuple[PeriodMap, FloatArray]:
    """Return the period map with `steps` steps a period, and the coordinates of `start`."""
    law = law_table(laws, "shoot")
    operators, modes = step_operators(structure, gap_operator, law, load, omega, steps, "shoot")
    begin = initial_state(modes, gap_operator, law, start)
    tangential = np.flatnonzero(np.arange(begin.gap.size) % 3 < 2)
    springs = tangential[law[:, :3].ravel()[tangential] > 0.0]
    held = begin.force.copy()
    held[springs] = 0.0
    speed = modes.omega * modes.speed
    scale = np.concatenate([speed, speed, 1.0 / np.sqrt(law[:, :3].ravel()[springs])])
    gaps = np.asarray(gap_operator @ modes.basis)
    linear = tangent_operators(operators, gaps)
    work = step_workspace(begin.gap.size)
    made = PeriodMap(operators, linear, modes, springs, scale, held, steps, work)
    return made, made.state_of(begin)
