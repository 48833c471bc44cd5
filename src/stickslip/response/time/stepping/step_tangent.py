"""Derivative of a sequence of time steps, for `stickslip.response.time.shooting`.

The tangent of a state has one column for each initial direction. The logged derivatives of the laws propagate it;
successive steps with the same derivatives are combined by squaring their common matrix.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.response.time.stepping.contact_step import ENTRY, JAC
from stickslip.response.time.stepping.marcher import Marcher
from stickslip.response.time.stepping.time_step import StepLog

SINGLY = 6  # successive steps up to which single steps are cheaper than their common matrix
NUMBERS = 1 << 20  # matrix entries assembled from a log at once: 8 MB


@dataclass(frozen=True, eq=False)
class LawDerivatives:
    """Derivatives of force and new state of all contacts, as matrices by all gaps and rates, and by all states."""

    force: FloatArray  # (k, 2k)
    force_by_law: FloatArray  # (k, s)
    law: FloatArray  # (s, 2k)
    law_by_law: FloatArray  # (s, s)
    entry: FloatArray  # (k + s, 2k) by gaps and rates before the step; empty where no contact lands


@dataclass(frozen=True, eq=False)
class TangentOperators:
    """Matrices of a step that act on tangents of (motion, r, states)."""

    free: FloatArray  # (m, m + k): motion at the end with r held zero there
    hold: FloatArray  # (m, k)
    seen: FloatArray  # (2k, m): gaps and rates
    response: FloatArray  # (2k, k)
    springs: FloatArray  # (k,)
    blocks: tuple["Block", ...]


@dataclass(frozen=True, eq=False)
class Block:
    """Positions of the logged derivatives of contacts with equal numbers of states."""

    jac: IntArray  # (contacts, (3 + s) (6 + s)) positions in a row of the log
    entry: IntArray  # (contacts, (3 + s) 6)
    gaps: IntArray  # (contacts, 6) columns of their gaps and rates
    states: IntArray  # (contacts, s)


def tangent_operators(marcher: Marcher) -> TangentOperators:
    """Return the matrices for the tangents of a prepared structure."""
    ops, k = marcher.operators, marcher.k
    places, begins = marcher.contacts.table.places, marcher.contacts.state_places
    sizes = np.diff(begins)
    blocks = []
    for size in np.unique(sizes):
        contacts = np.flatnonzero(sizes == size)
        gaps = 3 * contacts[:, None] + np.arange(3)
        blocks.append(
            Block(
                places[JAC, contacts, None] + np.arange((3 + size) * (6 + size)),
                places[ENTRY, contacts, None] + np.arange((3 + size) * 6),
                np.hstack([gaps, k + gaps]),
                begins[contacts, None] + np.arange(size),
            )
        )
    return TangentOperators(
        np.ascontiguousarray(ops.transfer.T),
        np.ascontiguousarray(ops.hold.T),
        marcher.modes.seen,
        np.ascontiguousarray(ops.response.T),
        marcher.contacts.table.springs,
        tuple(blocks),
    )


def law_derivatives(rows: FloatArray, linear: TangentOperators, n_states: int) -> Iterator[LawDerivatives]:
    """Yield the (r, ...) rows of a log as matrices."""
    k = linear.springs.size
    whole = np.zeros((len(rows), k + n_states, 2 * k + n_states))
    entry = np.zeros((len(rows), k + n_states, 2 * k))
    landed = np.zeros(len(rows), dtype=bool)
    for block in linear.blocks:
        size = block.states.shape[1]
        down = np.hstack([block.gaps[:, :3], k + block.states])[:, :, None]
        across = np.hstack([block.gaps, 2 * k + block.states])[:, None, :]
        whole[:, down, across] = rows[:, block.jac].reshape(len(rows), -1, 3 + size, 6 + size)
        before = rows[:, block.entry].reshape(len(rows), -1, 3 + size, 6)
        landed |= np.any(before, axis=(1, 2, 3))
        entry[:, down, block.gaps[:, None, :]] = before
    split = 2 * k
    for own, before, lands in zip(whole, entry, landed, strict=True):
        yield LawDerivatives(
            own[:k, :split], own[:k, split:], own[k:, :split], own[k:, split:], before if lands else before[:, :0]
        )


def first_tangent(row: FloatArray, linear: TangentOperators, n_states: int) -> FloatArray:
    """Return (m + k + s, m + s) derivatives of (motion, r, states) by motion and states.

    They follow from the log of the initial state.
    """
    (laws,) = law_derivatives(row[None], linear, n_states)
    k, m = linear.springs.size, linear.seen.shape[1]
    by_motion = laws.force @ linear.seen - linear.springs[:, None] * linear.seen[:k]
    return np.block(
        [
            [np.eye(m), np.zeros((m, n_states))],
            [by_motion, laws.force_by_law],
            [laws.law @ linear.seen, laws.law_by_law],
        ]
    )


def advanced(log: StepLog, rows: int, tangent: FloatArray, linear: TangentOperators) -> FloatArray:
    """Return the tangent (m + k + s, columns) after the steps of a log."""
    n_states, k = len(tangent) - linear.free.shape[1], linear.springs.size
    width = (k + n_states) * (4 * k + n_states)  # 0 without contacts
    at_once = max(1, NUMBERS // max(1, width))
    for first in range(0, rows, at_once):
        own = slice(first, min(first + at_once, rows))
        each = law_derivatives(log.jac[own], linear, n_states)
        for count, laws in zip(log.steps[own], each, strict=True):
            tangent = _steps(int(count), laws, tangent, linear)
    return tangent


def _steps(count: int, laws: LawDerivatives, tangent: FloatArray, linear: TangentOperators) -> FloatArray:
    """Propagate the tangent over steps with the same derivatives."""
    k = linear.springs.size
    beyond = laws.force.copy()
    beyond[:, :k] -= np.diag(linear.springs)
    newton = np.linalg.inv(np.eye(k) - beyond @ linear.response)
    if count <= SINGLY or not _holds_still(laws):
        for _ in range(count):
            tangent = _step(laws, beyond, newton, tangent, linear)
        return tangent
    tangent = _step(laws, beyond, newton, tangent, linear)
    return _many(count - 1, laws, beyond, newton, tangent, linear)


def _holds_still(laws: LawDerivatives) -> bool:
    """Whether each state is forgotten in every step (slip) or constant (stick)."""
    force, new = laws.force_by_law, laws.law_by_law
    return not (
        np.any(force @ laws.law) or np.any(new @ laws.law) or np.any(force @ new != force) or np.any(new @ new != new)
    )


def _many(
    count: int,
    laws: LawDerivatives,
    beyond: FloatArray,
    newton: FloatArray,
    tangent: FloatArray,
    linear: TangentOperators,
) -> FloatArray:
    """Propagate motion and r over steps with constant states and forces c, by squaring ``x -> P x + Q c``."""
    m, k = linear.hold.shape
    held = np.flatnonzero(np.any(laws.force_by_law, axis=1))
    constant = laws.force_by_law[held] @ tangent[m + k :]
    by_motion, add = beyond @ linear.seen, np.eye(k)[:, held]
    start = linear.free[:, m:]
    power = linear.free[:, :m] + start @ by_motion
    share = start[:, held]
    answer = linear.hold @ newton
    share = share + answer @ (by_motion @ share + add)
    power = power + answer @ (by_motion @ power)
    motion = tangent[:m]
    while count > 0:
        if count % 2 == 1:
            motion = power @ motion + share @ constant
        count //= 2
        if count > 0:
            share = power @ share + share
            power = power @ power
    r = by_motion @ motion
    r[held] += constant
    states = laws.law_by_law @ tangent[m + k :] + (laws.law @ linear.seen) @ motion
    return np.vstack([motion, r, states])


def _seen(linear: TangentOperators, motion: FloatArray, *, rates: bool) -> FloatArray:
    """Return gaps and rates of tangents of motion; rates are zero where no law needs them."""
    m, k = linear.hold.shape
    seen = np.zeros((2 * k, motion.shape[1]))
    seen[:k] = linear.seen[:k, : m // 2] @ motion[: m // 2]
    if rates:
        seen[k:] = linear.seen[k:, m // 2 :] @ motion[m // 2 :]
    return seen


def _step(
    laws: LawDerivatives, beyond: FloatArray, newton: FloatArray, tangent: FloatArray, linear: TangentOperators
) -> FloatArray:
    """Propagate the tangent over a step; the gaps and rates also depend on the change of r at its end."""
    m, k = linear.hold.shape
    states = tangent[m + k :]
    motion = linear.free @ tangent[: m + k]
    rates = bool(np.any(beyond[:, k:]) or np.any(laws.law[:, k:]))
    seen = _seen(linear, motion, rates=rates)
    given, new = beyond @ seen + laws.force_by_law @ states, laws.law_by_law @ states
    if laws.entry.size:
        before = laws.entry @ _seen(linear, tangent[:m], rates=True)
        given += before[:k]
        new += before[k:]
    r = newton @ given
    return np.vstack([motion + linear.hold @ r, r, new + laws.law @ (seen + linear.response @ r)])


def kept(monodromy: FloatArray, places: Sequence[int] | IntArray) -> IntArray:
    """Return the states among `places` that stay constant over the period, independently of all others."""
    rows = monodromy[places].copy()
    rows[np.arange(len(places)), places] -= 1.0
    return np.asarray(np.asarray(places)[~np.any(rows, axis=1)])
