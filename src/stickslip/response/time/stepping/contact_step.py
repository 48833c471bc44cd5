"""Any contact law over one time step: force, new state and their derivatives at a guess of the gap at its end.

A law forgets its state at lift-off. After the next closure friction counts from the gap at closure; counted from the sample before, the
force would have an error of first order for as long as the contact sticks. A step with a closure is therefore evaluated in two parts: to
the point of the straight gap path where the normal force begins, and on from there.
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

# what compiled code alone calls is compiled with it, and needs no door to Python
_compiled: Any = njit
inner = _compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy", forceinline=True)
large = _compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True, error_model="numpy")
LANDING_STEPS = 8  # of Newton's method for the share of the step; one where the normal force is linear in the gap
LOCATED = 1e-13  # of the step
KERNEL, PARAMETERS, STATES, JAC, ENTRY = range(5)  # rows of `ContactTable.places`
GAP, RATE, FORCE = range(3)  # rows of what a contact shows
_AT_END, _CLOSING, _FROM_THERE = range(3)  # questions to a law


class ContactTable(NamedTuple):
    """The laws of n contacts as arrays."""

    places: IntArray  # (5, n + 1): address of the kernel of each contact; where its parameters, states and derivatives begin in their arrays
    parameters: FloatArray  # of all contacts, one after the other
    weight: FloatArray  # (n,) factors of the forces
    stuck: FloatArray  # (3 n,) stiffnesses of the contacts that neither slip nor open, N/m, with the weights
    springs: FloatArray  # (3 n,) stiffnesses that the linear structure has at the contacts, N/m, with the weights


class StepState(NamedTuple):
    """State between steps; r is the contact force minus that of the springs of the linear structure."""

    x: FloatArray  # (m + 3 n,) motion and r
    seen: FloatArray  # (3, 3 n) gap, rate, force
    law: FloatArray  # states of the laws of all contacts
    status: IntArray  # (n, 2) what each tangent does


class LawWork(NamedTuple):
    """Forces and derivatives of the laws at an iterate, and work arrays."""

    seen: FloatArray  # (3, 3 n) gap and rate of the iterate, force
    law: FloatArray  # (2, n_states) states after the step, and where a gap closes
    status: IntArray  # (n + 1, 2); the last row where a gap closes
    jac: FloatArray  # (3 + s, 6 + s) derivatives by gap, rate and state, then (3 + s, 6) by gap and rate before, by contact
    there: FloatArray  # derivatives where a gap closes
    landed: IntArray  # (n,) whether the derivatives by what was before count
    place: FloatArray  # (5, 3): gap, rate and force there, way of the gap over the step, gradient of the normal force


@inner
def _way(c, state, work, jac):  # type: ignore[no-untyped-def]
    """Write the gap path over the step and the gradient of its normal force; return the share of the force along the path."""
    slope = 0.0
    for d in range(3):
        work.place[3, d] = work.seen[GAP, 3 * c + d] - state.seen[GAP, 3 * c + d]
        work.place[4, d] = jac[2, d]
        slope += work.place[4, d] * work.place[3, d]
    return slope


@large
def _chain(jac, there, entry, way, normal, share):  # type: ignore[no-untyped-def]
    """Convert derivatives by the state at closure into derivatives by gap, rate and state before the step.

    The point of closure moves with the path; the component of its change along the path vanishes, since the time of closure moves.
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
            there[0, 6 + s] = jac[
                a, 6 + s
            ]  # kept while its place is written to: a row of the force, which is not needed
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

    The law is called at a single place of the code, since each call would be compiled separately.
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
                # the force on the way back to where it begins
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
        One law a contact.
    weights
        (n_contacts,) factors of the forces; None: ones.
    caller
        Public function that errors name.

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
