"""Any contact law over one time step: force, new state and their derivatives at a guess of the gap at its end.

A law that lets go of its contact forgets: what it does after the next landing is counted from where the gap closes, not
from the sample before, or its force would be off by an amount of first order for as long as it sticks. A step in which a
contact lands is therefore given to the law in two parts, up to the place on the straight path of the gap where the normal
force begins, and on from there.
"""

# mypy: disallow-untyped-decorators=False

from typing import Any, NamedTuple

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.addresses import law_at
from stickslip.contact.cache import njit
from stickslip.contact.law import OPEN

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
    """State between steps; r is the contact force beyond the springs of the linear structure."""

    x: FloatArray  # (m + 3 n,) motion and r
    seen: FloatArray  # (3, 3 n) gap, rate, force
    law: FloatArray  # states of the laws of all contacts
    status: IntArray  # (n, 2) what each tangent does


class LawWork(NamedTuple):
    """What the laws answer at an iterate, and arrays to write on."""

    seen: FloatArray  # (3, 3 n) gap and rate of the iterate, force
    law: FloatArray  # (2, n_states) states after the step, and where a gap closes
    status: IntArray  # (n + 1, 2); the last row where a gap closes
    jac: FloatArray  # (3 + s, 6 + s) derivatives by gap, rate and state, then (3 + s, 6) by gap and rate before, by contact
    there: FloatArray  # derivatives where a gap closes
    landed: IntArray  # (n,) whether the derivatives by what was before count
    place: FloatArray  # (5, 3): gap, rate and force there, way of the gap over the step, gradient of the normal force


@inner
def _way(c, state, work, jac):  # type: ignore[no-untyped-def]
    """Write the way of a gap over the step and the gradient of its normal force; return how much of the force is on the way."""
    slope = 0.0
    for d in range(3):
        work.place[3, d] = work.seen[GAP, 3 * c + d] - state.seen[GAP, 3 * c + d]
        work.place[4, d] = jac[2, d]
        slope += work.place[4, d] * work.place[3, d]
    return slope


@large
def _chain(jac, there, entry, way, normal, share):  # type: ignore[no-untyped-def]
    """Turn derivatives by the state at the closing into those by gap, rate and state before the step.

    The place of closing moves with the path: of its change the part along the path is lost, as the time of closing moves.
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

    The law is called at one place of the code, whatever it is asked: each place would be compiled for itself.
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
    """Return arrays for n contacts with so many states and derivatives."""
    return LawWork(
        np.zeros((3, 3 * n)),
        np.zeros((2, n_states)),
        np.zeros((n + 1, 2), dtype=np.int64),
        np.zeros(n_jac),
        np.zeros(n_jac),
        np.zeros(n, dtype=np.int64),
        np.zeros((5, 3)),
    )
