"""Map from a state to the state one period later, with its derivative, for `stickslip.response.time.shooting`.

It uses the compiled time step of `integrate`, so that a fixed point of the map is a settled motion of `integrate`, with
the same step error.
"""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.response.stability.found import Floquet, floquet
from stickslip.response.time.sectors import WaveMotion
from stickslip.response.time.settling import overflowed
from stickslip.response.time.start import TransientStart
from stickslip.response.time.stepping.contact_step import StepState
from stickslip.response.time.stepping.marcher import Marcher, Record
from stickslip.response.time.stepping.step_tangent import (
    TangentOperators,
    advanced,
    first_tangent,
    kept,
    law_derivatives,
    tangent_operators,
)
from stickslip.response.time.stepping.time_step import StepLog

SINGULAR = 1e-9  # relative singular value of (1 - monodromy) below which a direction is neutral


@dataclass(frozen=True, eq=False)
class Image:
    """Motion over one period.

    Parameters
    ----------
    state
        (size,) final state; NaN if the motion overflowed.
    failures
        Steps in which the contact equations were not solved to rounding; -1 if the motion overflowed.
    record
        Samples of the period.
    """

    state: FloatArray
    failures: int
    record: Record


@dataclass(frozen=True, eq=False)
class Derivative:
    """Motion over one period, with the derivative of its final by its initial state.

    Parameters
    ----------
    image
        The motion.
    monodromy
        (size, size) derivative of the final state; NaN if the motion overflowed.
    kept
        Law states that stay constant, also after a small change: sliders that stick.
    unfelt
        Law states without influence on any force.
    idle
        Law states that neither change nor act through a spring.
    """

    image: Image
    monodromy: FloatArray
    kept: IntArray
    unfelt: IntArray
    idle: IntArray

    def inverse(self) -> FloatArray:
        """Return the (size, size) pseudo-inverse of ``1 - monodromy``, which turns a defect into a correction.

        It is zero in neutral directions.

        A slider that sticks for the whole period keeps its position, which selects one motion of a family.
        """
        moves = np.setdiff1d(np.arange(len(self.monodromy)), self.kept)
        inverse = np.zeros_like(self.monodromy)
        part = np.ix_(moves, moves)
        inverse[part] = np.linalg.pinv(np.eye(moves.size) - self.monodromy[part], rcond=SINGULAR)
        return inverse


@dataclass(frozen=True, eq=False)
class PeriodMap:
    """Period map in energy coordinates: modal displacement, velocity, law states.

    A state is ``(ωs q, ωs w, c z)`` with q, w and the speeds s of `ModalCoordinates`, the law states z, and factors c
    from the contact springs. Half its squared length is the energy of modes and springs, J, so that distances are
    comparable for stiff and soft coordinates.

    Parameters
    ----------
    marcher
        The structure prepared for time integration.
    linear
        Matrices of its tangents.
    scale
        (size,) factors of (q, w, z).
    shares
        Number n of sectors of a travelling motion, in which each sector moves like another one T/n earlier: the map
        then covers T/n, followed by a shift of the sectors. Otherwise 1.
    shift
        (size, size) shift of the sectors; None without one.
    """

    marcher: Marcher
    linear: TangentOperators
    scale: FloatArray
    shares: int = 1
    shift: FloatArray | None = None

    @property
    def size(self) -> int:
        """Number of coordinates of a state."""
        return self.scale.size

    @property
    def n_motion(self) -> int:
        """Number of displacements and velocities in a state."""
        return 2 * self.marcher.n

    def start_of(self, state: FloatArray) -> StepState:
        """Return a state in the form of the time step."""
        return self._begun(state)[0]

    def state_of(self, step: StepState) -> FloatArray:
        """Return the coordinates of a state of the time step."""
        return np.asarray(self.scale * np.concatenate([step.x[: self.n_motion], step.law]))

    def image(self, state: FloatArray) -> Image:
        """Integrate one period, or the share T/n followed by the shift."""
        image = self._marched(state, self.marcher.steps // self.shares)
        return image if self.shift is None else replace(image, state=self.shift @ image.state)

    def period(self, state: FloatArray) -> Image:
        """Integrate one whole period."""
        return self._marched(state, self.marcher.steps)

    def _marched(self, state: FloatArray, steps: int) -> Image:
        step, record = self.start_of(state), self.marcher.record(steps)
        return self._ended(step, self.marcher.march(step, record), record)

    def vibration(self, image: Image) -> float:
        """Return the size of the vibration over a period in the norm of the states.

        It is at least 1e-9 of the final state.
        """
        n = self.marcher.n
        scale, motion = self.scale[:n], image.record.motion
        if self.shares == 1:
            swing = np.std(motion, axis=0)
        else:  # a share of the period of all sectors together covers the whole period
            basis = self.marcher.modes.basis
            own = (motion @ basis.T).reshape(-1, n // self.shares)
            mean = np.tile(own.mean(axis=0), self.shares)
            away = motion - self.marcher.modes.inverse @ mean
            swing = np.sqrt(np.mean(away**2, axis=0))
        size = float(np.sqrt(2.0) * np.linalg.norm(scale * swing))
        return max(size, 1e-9 * float(np.linalg.norm(image.state)), np.finfo(float).tiny)

    def derivative(self, state: FloatArray) -> Derivative:
        """Integrate one period, or its share, with tangents."""
        (step, first), record = (self._begun(state), self.marcher.record(self.marcher.steps // self.shares))
        tangent = first_tangent(first, self.linear, step.law.size)
        seen = np.zeros(first.size, dtype=bool)

        def carry(log: StepLog, rows: int) -> None:
            nonlocal tangent
            tangent = advanced(log, rows, tangent, self.linear)
            np.logical_or(seen, np.any(log.jac[:rows] != 0.0, axis=0), out=seen)

        failures = self.marcher.march_logged(step, record, carry)
        image = self._ended(step, failures, record)
        if image.failures < 0:
            nothing, none = np.full((self.size, self.size), np.nan), np.zeros(0, dtype=np.int64)
            return Derivative(image, nothing, none, none, none)
        m, k = self.n_motion, self.marcher.k
        matrix = np.vstack([tangent[:m], tangent[m + k :]])
        stays = kept(matrix, np.arange(m, self.size))
        rest = self._no_motion(seen, np.isin(np.arange(m, self.size), stays))
        matrix = self.scale[:, None] * matrix / self.scale
        if self.shift is None:
            return Derivative(image, matrix, stays, *rest)
        image = replace(image, state=self.shift @ image.state)
        return Derivative(image, self.shift @ matrix, stays[:0], *rest)

    def floquet(self, derivative: Derivative) -> Floquet:
        """Return the multipliers of a whole period: without idle states, and zero for unfelt ones."""
        none = np.concatenate([derivative.unfelt, derivative.idle])
        states = np.delete(np.arange(self.size), none)
        monodromy = derivative.monodromy[np.ix_(states, states)]
        found = floquet(np.linalg.matrix_power(monodromy, self.shares)).multipliers
        return Floquet(np.append(found, np.zeros(derivative.unfelt.size, dtype=complex)))

    def _no_motion(self, seen: BoolArray, still: BoolArray) -> tuple[IntArray, IntArray]:
        """Return the indices of unfelt and of idle states.

        `seen` marks derivatives of the laws that were not always zero, `still` the states that stayed constant.
        """
        (pattern,) = law_derivatives(seen[None].astype(float), self.linear, still.size)
        sprung = np.any(pattern.force_by_law[self.marcher.contacts.table.stuck != 0.0], axis=0)
        felt, more = np.zeros_like(still), np.any(pattern.force_by_law, axis=0)
        while not np.array_equal(felt, more):
            felt, more = more, more | np.any(pattern.law_by_law[more], axis=0)
        sectors = (self.shares, -1)  # which take turns
        felt, sprung = (np.any(a.reshape(sectors), axis=0) for a in (felt, sprung))
        idle = np.all(still.reshape(sectors), axis=0) & ~sprung
        unfelt = ~felt & ~idle
        first = self.n_motion
        return tuple(first + np.flatnonzero(np.tile(a, self.shares)) for a in (unfelt, idle))  # type: ignore[return-value]

    def _begun(self, state: FloatArray) -> tuple[StepState, FloatArray]:
        plain, m = state / self.scale, self.n_motion
        return self.marcher.begin(plain[:m], plain[m:])

    def _ended(self, step: StepState, failures: int, record: Record) -> Image:
        """Return the period that ends at `step`; all NaN if its squares would overflow."""
        state = self.state_of(step)
        if failures < 0 or overflowed(state, record.motion):
            for array in (state, record.rows):
                array.fill(np.nan)
            failures = -1
        return Image(state, failures, record)


def period_map(
    marcher: Marcher, start: TransientStart, symmetry: WaveMotion | None = None
) -> tuple[PeriodMap, FloatArray]:
    """Return the period map of a marcher and the coordinates of `start`.

    With a symmetry, the map covers a share of the period.
    """
    linear = tangent_operators(marcher)
    begin = marcher.begun(start)
    speed = marcher.modes.omega * marcher.modes.speed
    scale = np.concatenate([speed, speed, _law_scale(marcher, linear)])
    made = PeriodMap(marcher, linear, scale)
    if symmetry is not None:
        shift = scale[:, None] * _shift(marcher, symmetry) / scale
        made = replace(made, shares=symmetry.sectors, shift=shift)
    return made, made.state_of(begin)


def _shift(marcher: Marcher, symmetry: WaveMotion) -> FloatArray:
    """Return the matrix that shifts a state (q, w, z) to the represented sectors."""
    modes, n, n_states = marcher.modes, marcher.n, marcher.contacts.start.size
    moved = modes.inverse @ symmetry.shifted(modes.basis)
    turned = moved * modes.speed / modes.speed[:, None]
    states = symmetry.shifted(np.eye(n_states)) if n_states else np.zeros((0, 0))
    shift = np.zeros((2 * n + n_states,) * 2)
    for at, part in ((0, moved), (n, turned), (2 * n, states)):
        shift[at : at + len(part), at : at + len(part)] = part
    return shift


def _law_scale(marcher: Marcher, linear: TangentOperators) -> FloatArray:
    """Return (n_states,) factors of the law states: their force at rest over the root of the contact stiffness.

    A state without force at rest, as in an open contact, counts as a displacement.
    """
    contacts = marcher.contacts
    n_states = contacts.start.size
    at_rest = marcher.begin(np.zeros(2 * marcher.n), contacts.start)[1]
    (laws,) = law_derivatives(at_rest[None], linear, n_states)
    force = laws.force_by_law.reshape(contacts.n, 3, n_states)
    stiffness = np.max(contacts.table.stuck.reshape(-1, 3), axis=1, initial=0.0)
    fallback = np.max(stiffness, initial=0.0) or 1.0
    root = np.sqrt(np.where(stiffness > 0.0, stiffness, fallback))
    own = np.repeat(np.arange(contacts.n), np.diff(contacts.state_places))
    size = np.linalg.norm(force[own, :, np.arange(n_states)], axis=1)
    return np.where(size > 0.0, size, root[own] ** 2) / root[own]
