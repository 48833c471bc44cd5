"""Blocks of samples of a disturbed motion: contact forces act as kicks at the samples, one matrix propagates the whole block.

Over a block of samples the gaps follow from the states at its beginning and from the forces of the samples before, by small matrices; the
large ones are multiplied once a block. Rounding apart the result is that of one sample after the other.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numba import types

from stickslip.arrays import FloatArray
from stickslip.contact.cache import njit
from stickslip.response.time.stepping.contact_step import inner

MAX_SAMPLES = 32  # in a block; 8 to 64 cost the same within a tenth, one contact on 60 modes


@dataclass(frozen=True, eq=False)
class Block:
    """Propagation of states (N, k) over a number of equally spaced samples.

    Attributes
    ----------
    gaps
        (samples, m, N) those of the sampled contacts while no force acts.
    gap_response
        (samples, m, m) response of the gaps one, two and more samples after a unit force.
    step
        (N, N) of all samples.
    force_effect
        (N, samples m) effect of forces at the samples on the states after the last.
    """

    gaps: FloatArray
    gap_response: FloatArray
    step: FloatArray
    force_effect: FloatArray


def blocks(step: FloatArray, gaps: FloatArray, push: FloatArray, count: int) -> list[Block]:
    """Return blocks of `count` samples in all, the same one as often as it can be.

    Parameters
    ----------
    step
        (N, N) from just after a kick to the next sample.
    gaps
        (m, N) gaps of the sampled contacts.
    push
        (N, m) change of the states by forces on these.
    count
        Samples.
    """
    most = min(count, int(np.clip(len(step) // max(len(gaps), 1), 1, MAX_SAMPLES)))
    rows, force_effect = [gaps], [step @ push]
    for _ in range(most - 1):
        rows.append(rows[-1] @ step)
        force_effect.append(step @ force_effect[-1])
    gap_response = np.array([gaps @ p for p in force_effect])

    def of(samples: int) -> Block:
        powered = np.linalg.matrix_power(step, samples)
        return Block(
            np.array(rows[:samples]), gap_response[:samples], powered, np.hstack(force_effect[samples - 1 :: -1])
        )

    whole, rest = divmod(count, most)
    return [of(most)] * whole + [of(rest)] * (rest > 0)


@inner
def _add(factor, row, out):  # type: ignore[no-untyped-def]
    """Add a multiple of a row to another."""
    if factor != 0.0:
        for c in range(row.size):
            out[c] += factor * row[c]


@inner
def _add_effects(gap_response, forces, i, gaps):  # type: ignore[no-untyped-def]
    """Add what forces at the samples before the i-th have done to its gaps."""
    for j in range(i):
        for a in range(gaps.shape[0]):
            for b in range(gaps.shape[0]):
                _add(gap_response[i - j - 1, a, b], forces[j, b], gaps[a])


@inner
def _kick(jac, weight, springs, share, known, states, forces):  # type: ignore[no-untyped-def]
    """Find the forces (3, k) of one contact and its new states (s, k) from gaps, states and the gaps before, `known`."""
    for d in range(3):
        forces[d] = 0.0
        _add(share * springs[d], known[d], forces[d])
        for b in range(known.shape[0]):
            _add(-share * weight * jac[d, b], known[b], forces[d])
    for d in range(states.shape[0]):
        states[d] = 0.0
        for b in range(known.shape[0]):
            _add(jac[3 + d, b], known[b], states[d])


def _run(contacts, shares, gap_response, gaps, states, before, known, forces):  # type: ignore[no-untyped-def]
    """Kick by the contacts at each sample of a block.

    `contacts` are the derivatives (samples, n, 3 + s, 6 + s) of forces and new states by gaps, states and the gaps before, factors (n,) of the forces, and
    springs (3 n,) that are part of the propagation; `shares` (samples,) those of the period. In place: `gaps` (samples, 3 n, k) without forces of the block
    become those with them, `states` (n, s, k), `before` (n, 3, k); `forces` (samples, 3 n, k) is filled; `known` (6 + s, k) is room.
    """
    jac, weights, springs = contacts
    kept = states.shape[1]
    for i in range(gaps.shape[0]):
        _add_effects(gap_response, forces, i, gaps[i])
        for p in range(states.shape[0]):
            own = slice(3 * p, 3 * p + 3)
            known[:3] = gaps[i, own]
            known[3 : 3 + kept] = states[p]
            known[3 + kept :] = before[p]
            before[p] = gaps[i, own]
            _kick(jac[i, p], weights[p], springs[own], shares[i], known, states[p], forces[i, own])


@cache
def run() -> Any:
    """Return `_run`, compiled."""
    kinds: Any = types
    vector, matrix, block = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
    contacts = kinds.Tuple((types.float64[:, :, :, ::1], vector, vector))
    return njit(types.void(contacts, vector, block, block, block, block, matrix, block), cache=True)(_run)
