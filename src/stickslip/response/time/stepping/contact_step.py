"""Evaluation of any contact law over one time step: force, new state and their derivatives for a given gap at the end.

A law forgets its state at lift-off, and after closure its friction refers to the gap at closure. A reference to the
previous sample would cause an error of first order in the force for as long as the contact sticks. A step with a
closure is therefore evaluated in two parts: up to the point of the straight gap path where the normal force begins, and
from there to the end.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.addresses import law_address, law_at
from stickslip.contact.cache import njit
from stickslip.contact.compiled import checked_weights
from stickslip.contact.law import OPEN, ContactLaw, Rigid
from stickslip.errors import input_error

# functions called by compiled code only need no Python wrapper
_compiled: Any = njit
inner = _compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy", forceinline=True)
large = _compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy")
LANDING_STEPS = 8  # most Newton steps for the time of closure; one suffices if the normal force is linear in the gap
LOCATED = 1e-13  # tolerance of the time of closure, over the step
KERNEL, PARAMETERS, STATES, JAC, ENTRY = range(5)  # rows of `ContactTable.places`
GAP, RATE, FORCE = range(3)  # rows of `StepState.seen`
_AT_END, _CLOSING, _FROM_THERE = range(3)  # evaluations of a law: over the step, up to closure, from closure on


class ContactTable(NamedTuple):
    """Laws of n contacts as arrays."""

    places: IntArray  # (5, n + 1): address of each contact's kernel; offsets of its parameters, states and derivatives
    parameters: FloatArray  # of all contacts, in sequence
    weight: FloatArray  # (n,) factors of the forces
    stuck: FloatArray  # (3 n,) stiffnesses of the contacts that neither slip nor open, N/m, with the weights
    springs: FloatArray  # (3 n,) stiffnesses that the linear structure has at the contacts, N/m, with the weights


class StepState(NamedTuple):
    """State between steps; r is the contact force minus the force of the springs in the linear structure."""

    x: FloatArray  # (m + 3 n,) motion and r
    seen: FloatArray  # (3, 3 n) gap, rate, force
    law: FloatArray  # states of the laws of all contacts
    status: IntArray  # (n, 2) contact status by tangent


class LawWork(NamedTuple):
    """Forces and derivatives of the laws at an iterate, and work arrays."""

    seen: FloatArray  # (3, 3 n) gap and rate of the iterate, force
    law: FloatArray  # (2, n_states) states after the step, and at closure
    status: IntArray  # (n + 1, 2); the last row at closure
    jac: FloatArray  # by contact: (3 + s, 6 + s) by gap, rate and state, then (3 + s, 6) by initial gap and rate
    there: FloatArray  # derivatives at closure
    landed: IntArray  # (n,) whether the derivatives by initial gap and rate are used
    place: FloatArray  # (5, 3): gap, rate and force at closure, change of the gap, gradient of the normal force


@inner
def _way(c, state, work, jac):  # type: ignore[no-untyped-def]
    """Write the change of the gap over the step and the gradient of the normal force; return their product."""
    slope = 0.0
    for d in range(3):
        work.place[3, d] = work.seen[GAP, 3 * c + d] - state.seen[GAP, 3 * c + d]
        work.place[4, d] = jac[2, d]
        slope += work.place[4, d] * work.place[3, d]
    return slope


@large
def _chain(jac, there, entry, way, normal, share):  # type: ignore[no-untyped-def]
    """Convert derivatives by the state at closure into derivatives by gap, rate and state before the step.

    The point of closure changes with the path. The component of this change along the path is removed, since the time
    of closure changes, too.
    """
    n_state, along = there.shape[0] - 3, 0.0
    for d in range(3):
        along += normal[d] * way[d]
    for s in range(n_state):
        lost = 0.0
        for d in range(3):
            lost += there[3 + s, d] * way[d] / along
        for d in range(3):
            there[3 + s, d] -= lost * normal[d]
    for a in range(jac.shape[0]):
        for s in range(n_state):
            there[0, 6 + s] = jac[a, 6 + s]  # copied to an unused row of the force before its place is overwritten
            jac[a, 6 + s] = 0.0
        for s in range(n_state):
            by_state = there[0, 6 + s]
            for j in range(6):
                jac[a, j] += share * by_state * there[3 + s, j]
                entry[a, j] += (1.0 - share) * by_state * there[3 + s, j]
            for t in range(n_state):
                jac[a, 6 + t] += by_state * there[3 + s, 6 + t]


@large
def evaluate(table, state, work):  # type: ignore[no-untyped-def]  # noqa: C901, PLR0912, PLR0915
    """Fill `work` with forces, new states and derivatives of all contacts at the iterate of gap and rate.

    The law is called at a single place in the code, since each call would be compiled separately.
    """
    places, n = table.places, table.weight.size
    for c in range(n):
        first, end, at = places[STATES, c], places[STATES, c + 1], places[JAC, c]
        rows, columns = 3 + end - first, 6 + end - first
        entries, shape = at + rows * columns, (rows, columns)
        law = law_at(places[KERNEL, c])
        parameters = table.parameters[places[PARAMETERS, c] : places[PARAMETERS, c + 1]]
        jac = work.jac[at:entries].reshape(shape)
        gap, rate = work.seen[GAP, 3 * c : 3 * c + 3], work.seen[RATE, 3 * c : 3 * c + 3]
        force, status = work.seen[FORCE, 3 * c : 3 * c + 3], work.status[c]
        before, after, answer = state.law[first:end], work.law[0, first:end], jac
        if work.landed[c] != 0:
            work.landed[c] = 0
            for j in range(entries, places[JAC, c + 1]):
                work.jac[j] = 0.0
        share, tries, asked = 1.0, 0, _AT_END
        while True:
            if asked == _CLOSING:
                gap, rate, force = work.place[0], work.place[1], work.place[2]
                after, status = work.law[1, first:end], work.status[n]
                answer = work.there[: rows * columns].reshape(shape)
            elif asked == _FROM_THERE:
                gap, rate = work.seen[GAP, 3 * c : 3 * c + 3], work.seen[RATE, 3 * c : 3 * c + 3]
                force, status = work.seen[FORCE, 3 * c : 3 * c + 3], work.status[c]
                before, after, answer = work.law[1, first:end], work.law[0, first:end], jac
            for j in range(rows):
                for d in range(columns):
                    answer[j, d] = 0.0
            law(gap, rate, before, parameters, force, after, answer, status)
            weight = table.weight[c]
            if weight != 1.0:
                for d in range(3):
                    force[d] *= weight
                    for j in range(columns):
                        answer[d, j] *= weight
            if asked == _FROM_THERE:
                there = work.there[: rows * columns].reshape(shape)
                entry = work.jac[entries : places[JAC, c + 1]].reshape((rows, 6))
                _chain(jac, there, entry, work.place[3], work.place[4], share)
                work.landed[c] = 1
                break
            if asked == _AT_END and (rows == 3 or state.status[c, 0] != OPEN or status[0] == OPEN):
                break
            tries += 1
            if asked == _AT_END or (status[0] != OPEN and tries <= LANDING_STEPS):
                # Newton step back along the path to the point where the normal force begins
                slope = _way(c, state, work, answer)
                if slope == 0.0:
                    break
                last, share = share, min(max(share - force[2] / slope, 0.0), 1.0)
                if asked == _AT_END or abs(share - last) > LOCATED:
                    asked = _CLOSING
                    for d in range(3):
                        own = state.seen[RATE, 3 * c + d]
                        work.place[0, d] = state.seen[GAP, 3 * c + d] + share * work.place[3, d]
                        work.place[1, d] = own + share * (work.seen[RATE, 3 * c + d] - own)
                    continue
            asked = _FROM_THERE


def law_work(n: int, n_states: int, n_jac: int) -> LawWork:
    """Return work arrays for n contacts with these numbers of states and derivatives."""
    return LawWork(
        np.zeros((3, 3 * n)),
        np.zeros((2, n_states)),
        np.zeros((n + 1, 2), dtype=np.int64),
        np.zeros(n_jac),
        np.zeros(n_jac),
        np.zeros(n, dtype=np.int64),
        np.zeros((5, 3)),
    )


@dataclass(frozen=True, eq=False)
class TimeContacts:
    """Contacts in time.

    Parameters
    ----------
    table
        Laws as arrays.
    start
        (n_states,) initial states of all laws in sequence.
    """

    table: ContactTable
    start: FloatArray

    @property
    def n(self) -> int:
        """Number of contacts."""
        return self.table.weight.size

    def on(self, springs: FloatArray) -> "TimeContacts":
        """Return the contacts on a structure that contains the springs (3 n,)."""
        return replace(self, table=self.table._replace(springs=springs))

    def separate(self, states: FloatArray) -> tuple[FloatArray, ...]:
        """Return the states of each contact separately."""
        return tuple(np.split(states, self.state_places[1:-1])) if self.n else ()

    @property
    def state_places(self) -> IntArray:
        """(n + 1,) offsets of the states of each contact."""
        return np.asarray(self.table.places[STATES])

    @property
    def log_width(self) -> int:
        """Number of derivatives of all laws, see `LawWork`."""
        return int(self.table.places[JAC, -1])


def time_contacts(laws: Sequence[ContactLaw], weights: FloatArray | None, caller: str) -> TimeContacts:
    """Return the laws of contacts as arrays for the time step.

    Parameters
    ----------
    laws
        One law for each contact.
    weights
        (n_contacts,) factors of the forces; None: ones.
    caller
        Public function named in errors.

    Raises
    ------
    InputError
        If a contact is rigid, or a weight is not positive.
    """
    if any(isinstance(law, Rigid) for law in laws):
        raise input_error(
            f"{caller}: laws",
            "got RigidCoulomb, which has no stiffness: its force is no function of the gap",
            "Take `RigidCoulomb.softened(stiffness)` in its place.",
        )
    factors = np.ones(len(laws)) if weights is None else checked_weights(weights, len(laws))
    parameters = [np.asarray(law.parameters(), dtype=float) for law in laws]
    states = [np.asarray(law.initial_state(), dtype=float) for law in laws]
    own = np.array([law.stuck_stiffness() for law in laws]).reshape(-1, 3)
    stuck = np.ascontiguousarray((factors[:, None] * own).ravel())
    table = ContactTable(
        _places([law_address(law.kernel) for law in laws], parameters, states),
        _joined(parameters),
        factors,
        stuck,
        stuck,
    )
    return TimeContacts(table, _joined(states))


def _joined(arrays: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate(arrays) if arrays else np.zeros(0)


def _places(kernels: Sequence[int], parameters: Sequence[FloatArray], states: Sequence[FloatArray]) -> IntArray:
    """Return the (5, n + 1) offsets of each contact; see `ContactTable.places`."""
    sizes = np.array([s.size for s in states], dtype=np.int64)
    widths = [np.array([p.size for p in parameters]), sizes, (3 + sizes) * (12 + sizes)]
    begins = [np.concatenate([[0], np.cumsum(w)]) for w in widths]
    entry = begins[2] + np.append((3 + sizes) * (6 + sizes), 0)
    return np.array([[*kernels, 0], *begins, entry], dtype=np.int64)
