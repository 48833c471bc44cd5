"""Monodromy matrix from matrix exponentials, projections at transitions, and impulses of sampled tangents.

Laws without located transitions act by an impulse at each sample, with exact propagation between samples (the splitting
of Strang 1968); the error is of second order in the step. The means of their tangents over the period are springs of
the propagated structure.

Within a block of samples, small matrices give the gaps from the initial states and from the forces at earlier samples;
large matrices are multiplied once per block. The result agrees with single samples up to rounding.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numba import types

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.cache import njit
from stickslip.contact.slider import PERIOD
from stickslip.response.stability.flow_map.contact_states import ContactStates
from stickslip.response.stability.flow_map.low_rank_flow import flow_of
from stickslip.response.stability.flow_map.modal_states import ModalStates
from stickslip.response.stability.flow_map.propagation import transition
from stickslip.response.stability.flow_map.sampled_tangents import SampledTangents
from stickslip.response.time.sectors import InTime
from stickslip.response.time.stepping.contact_step import inner

MAX_SAMPLES = 32  # in a block; for one contact on 60 modes, 8 to 64 cost the same within a tenth


@dataclass(slots=True)
class Disturbance:
    """States as linear functions of the states at the beginning of the period."""

    motion: FloatArray  # (2n, k)
    sliders: FloatArray  # (n_sliders, k)


class Sliders:
    """Operators for slider positions, from the gaps (3 n_contacts, k) of the first k states."""

    def __init__(self, gaps: FloatArray, contacts: ContactStates) -> None:
        self.contacts = contacts
        self.own, self.normal = gaps[contacts.rows], gaps[contacts.normals]

    def take_hold(self, interval: int, now: Disturbance) -> None:
        """Set the positions of sliders that begin to stick with an interval."""
        new = self.contacts.takes_hold[interval]
        by_normal = self.contacts.by_normal[interval, new][:, None]
        row = self.own[new] + by_normal * self.normal[new]
        now.sliders[new] = row @ now.motion[: row.shape[1]]


def monodromy(modes: ModalStates, contacts: ContactStates) -> FloatArray:
    """Return the monodromy matrix of contacts with located transitions only.

    The states belong to the structure and to sliders that stick at the beginning of the period. The period begins at
    the transition after which the fewest sliders stick; the non-zero multipliers do not depend on this choice.
    """
    flow, count = flow_of(modes, contacts), len(contacts.times) - 1
    places = Sliders(flow.gaps, contacts)
    begin = int(np.argmin(contacts.sticks.sum(axis=1)))
    held = contacts.sticks[begin]
    now = identity(modes.n, held, 0)
    now.motion = flow.into @ now.motion
    for i in range(begin, begin + count):
        here, following = i % count, (i + 1) % count
        length = contacts.times[here + 1] - contacts.times[here]
        now.motion = flow.advance(here, length, now.motion, now.sliders)
        places.take_hold(following, now)
    return np.vstack([flow.out @ now.motion, now.sliders[held]])


def share_of_monodromy(modes: ModalStates, contacts: ContactStates, wheel: InTime) -> FloatArray | None:
    """Return the monodromy matrix of one share of the period with renumbered sectors; None if the motion has no shares.

    A travelling wave repeats its first share of the period in other sectors, so the multipliers of the period are
    powers of the multipliers of the share. The share begins in the middle of the longest interval.
    """
    times, count = contacts.times, len(contacts.times) - 1
    sliders = contacts.rows.size
    if wheel.shares < 2 or sliders % wheel.sectors:
        return None
    begin = int(np.argmax(np.diff(times)))
    start = 0.5 * (times[begin] + times[begin + 1])
    stop = start + PERIOD / wheel.shares
    held = contacts.sticks[begin]
    flow, now = flow_of(modes, contacts), identity(modes.n, held, 0)
    places = Sliders(flow.gaps, contacts)
    now.motion = flow.into @ now.motion
    here, at = begin, start
    while True:
        i, turn = here % count, (here // count) * PERIOD
        end = min(float(times[i + 1] + turn), stop)
        now.motion = flow.advance(i, end - at, now.motion, now.sliders)
        if end >= stop:
            break
        here, at = here + 1, end
        places.take_hold(here % count, now)
    if not np.array_equal(wheel.shifted(contacts.sticks[here % count]), held):
        return None
    moved = np.linalg.solve(modes.basis, wheel.shifted(modes.basis))
    turned = moved * modes.speed / modes.speed[:, None]
    n, motion = modes.n, flow.out @ now.motion
    return np.vstack([moved @ motion[:n], turned @ motion[n:], wheel.shifted(now.sliders)[held]])


def identity(n: int, held: BoolArray, more: int) -> Disturbance:
    """Return unit disturbances of each state, followed by `more` empty columns."""
    size = 2 * n + int(np.count_nonzero(held))
    sliders = np.zeros((len(held), size + more))
    sliders[held, 2 * n : size] = np.eye(size - 2 * n)
    return Disturbance(np.eye(2 * n, size + more), sliders)


def sample_times(contacts: ContactStates, samples: int, halves: int = 2) -> list[FloatArray]:
    """Return equally spaced samples of each interval between transitions, from its beginning on.

    Parameters
    ----------
    contacts
        Contacts with located transitions.
    samples
        Smallest number of samples in the period.
    halves
        Multiple of half this number; twice the value halves each step.
    """
    out = []
    for left, right in zip(contacts.times[:-1], contacts.times[1:], strict=True):
        least = max(1, int(np.ceil((right - left) * samples / (2.0 * np.pi))))
        count = (least * halves + 1) // 2
        out.append(left + (right - left) / count * np.arange(count))
    return out


class _Kicks:
    """States of sampled contacts, and the effect of their impulses on the motion."""

    def __init__(self, modes: ModalStates, tangents: SampledTangents, weights: FloatArray, size: int) -> None:
        n, most = tangents.kept.shape
        self.modes, self.jac = modes, tangents.jac
        self.by_rate = bool(np.any(tangents.jac[:, :, :, 3:6] != 0.0))
        self.alone = np.ascontiguousarray(np.delete(tangents.jac, [3, 4, 5], axis=3))  # without rates
        self.factors = weights
        index = 3 * tangents.contacts[:, None] + np.arange(3)
        self.gaps = modes.gaps[index.reshape(-1)]  # (3 n, n_modes)
        self.rates = self.gaps * (modes.omega * modes.speed)
        self.pull = modes.pull(self.gaps)
        self.weights = np.repeat(weights, 3)[:, None]
        own_stiffness = np.diagonal(tangents.jac[:, :, :3, :3], axis1=2, axis2=3)
        self.springs = self.weights * own_stiffness.mean(axis=0).reshape(-1, 1)
        self.real = tangents.kept
        self.states = np.zeros((n, most, size))
        self.before = np.zeros((n, 3, size))  # gaps at the previous sample
        own = int(self.real.sum())
        self.states[self.real, size - 3 * n - own : size - 3 * n] = np.eye(own)
        self.before[:, :, size - 3 * n :] = np.eye(3 * n).reshape(n, 3, 3 * n)

    def advance(self, first: int, shares: FloatArray, step: FloatArray, states: FloatArray) -> FloatArray:
        """Return the states after impulses at the samples from `first` on, and a step after each.

        `shares` are step lengths over the period.
        """
        if self.by_rate:
            for i, share in enumerate(shares, first):
                self.kick(i, share, states)
                states = step @ states
            return states
        half, (rows, columns) = self.modes.n, (len(self.gaps), states.shape[1])
        gaps, push = np.zeros((rows, len(step))), np.zeros((len(step), rows))
        gaps[:, :half], push[half : 2 * half] = self.gaps, self.pull
        known, springs = np.zeros((self.alone.shape[3], columns)), self.springs.ravel()
        for block in _blocks(step, gaps, push, len(shares)):
            samples = len(block.gaps)
            now, forces = block.gaps @ states, np.zeros((samples, rows, columns))
            contacts = self.alone[first : first + samples], self.factors, springs
            compiled_kicks()(
                contacts, shares[:samples], block.gap_response, now, self.states, self.before, known, forces
            )
            states = block.step @ states + block.force_effect @ forces.reshape(-1, columns)
            first, shares = first + samples, shares[samples:]
        return states

    def kick(self, sample: int, share: float, motion: FloatArray) -> None:
        """Change velocities and law states by an impulse at a sample, during which velocities decay."""
        n, half = len(self.states), self.modes.n
        gap = self.gaps @ motion[:half]
        now = gap.reshape(n, 3, -1)
        jac, rate = self.jac[sample], self.rates @ motion[half : 2 * half]
        known = np.concatenate([now, np.zeros_like(now), self.states, self.before], axis=1)
        force = self.weights * (jac[:, :3] @ known).reshape(3 * n, -1) - self.springs * gap
        damping = np.zeros((n, 3, n, 3))
        damping[np.arange(n), :, np.arange(n)] = jac[:, :3, 3:6]
        damping = self.weights * damping.reshape(3 * n, 3 * n)
        mobility = share * (self.rates @ self.pull)
        force = _decayed(damping @ mobility) @ (force + damping @ rate)
        rate = rate - 0.5 * mobility @ force
        known[:, 3:6] = rate.reshape(n, 3, -1)
        motion[half : 2 * half] -= share * (self.pull @ force)
        self.states, self.before = jac[:, 3:] @ known, now

    @property
    def rows(self) -> FloatArray:
        """Existing law states, and gaps at the last sample, (n_states, k)."""
        return np.vstack([self.states[self.real], self.before.reshape(-1, self.before.shape[2])])


def _decayed(x: FloatArray) -> FloatArray:
    """Return ``(1 - exp(-X)) / X``, the mean of a decaying force, from a rational function of X / 2ᵏ."""
    halvings = max(0, int(np.ceil(np.log2(max(float(np.linalg.norm(x, 1)), 1e-9)))) + 2)
    part, one = x / 2**halvings, np.eye(len(x))
    square = part @ part
    out = np.linalg.solve(one + 0.5 * part + 0.1 * square + part @ square / 120.0, one + square / 60.0)
    for _ in range(halvings):
        out -= 0.5 * out @ part @ out
        part = 2.0 * part
    return np.asarray(out)


def sampled_monodromy(
    modes: ModalStates, contacts: ContactStates, times: list[FloatArray], tangents: SampledTangents, weights: FloatArray
) -> FloatArray:
    """Return the monodromy matrix of contacts with located transitions and with sampled tangents.

    Parameters
    ----------
    modes
        Modes of the structure.
    contacts
        Contacts with located transitions.
    times
        From `sample_times`.
    tangents
        The other contacts, at these times.
    weights
        (n,) factors of their forces.
    """
    count = len(times)
    lengths = np.diff(contacts.times) / [t.size for t in times]
    steps = np.repeat(lengths, [t.size for t in times])
    shares = 0.5 * (steps + np.roll(steps, 1))
    held = contacts.sticks[0]
    more = int(tangents.kept.sum()) + 3 * len(tangents.kept)
    now: Disturbance = identity(modes.n, held, more)
    kicks = _Kicks(modes, tangents, weights, now.motion.shape[1])
    springs = np.zeros_like(contacts.stiffness[0])
    springs[tangents.contacts] = kicks.springs.reshape(-1, 3, 1) * np.eye(3)
    places = Sliders(modes.gaps, contacts)
    pull = modes.pull(places.own) * contacts.springs
    sample = 0
    for here in range(count):
        stuck = contacts.sticks[here]
        matrix = modes.matrix(contacts.stiffness[here] + springs)
        exponential, driven = transition(matrix, pull[:, stuck], lengths[here])
        step = np.block([[exponential, driven], [np.zeros(driven.T.shape), np.eye(driven.shape[1])]])
        following = sample + times[here].size
        moved = kicks.advance(sample, shares[sample:following], step, np.vstack([now.motion, now.sliders[stuck]]))
        now.motion, sample = moved[: 2 * modes.n], following
        places.take_hold((here + 1) % count, now)
    return np.vstack([now.motion, now.sliders[held], kicks.rows])


@dataclass(frozen=True, eq=False)
class Block:
    """Propagation of states (N, k) over a number of equally spaced samples.

    Attributes
    ----------
    gaps
        (samples, m, N) gaps of the sampled contacts without forces.
    gap_response
        (samples, m, m) gaps at successive samples after a unit force.
    step
        (N, N) transition matrix of the block.
    force_effect
        (N, samples m) effect of forces at the samples on the final states.
    """

    gaps: FloatArray
    gap_response: FloatArray
    step: FloatArray
    force_effect: FloatArray


def _blocks(step: FloatArray, gaps: FloatArray, push: FloatArray, count: int) -> list[Block]:
    """Return blocks with `count` samples in total, with as many equal blocks as possible.

    Parameters
    ----------
    step
        (N, N) transition matrix from just after an impulse to the next sample.
    gaps
        (m, N) gaps of the sampled contacts.
    push
        (N, m) change of the states by forces on these gaps.
    count
        Number of samples.
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
    """Add the effect of forces at earlier samples to the gaps of the i-th sample."""
    for j in range(i):
        for a in range(gaps.shape[0]):
            for b in range(gaps.shape[0]):
                _add(gap_response[i - j - 1, a, b], forces[j, b], gaps[a])


@inner
def _kick(jac, weight, springs, share, known, states, forces):  # type: ignore[no-untyped-def]
    """Compute forces (3, k) and new states (s, k) of one contact from gaps, states and previous gaps in `known`."""
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
    """Apply the contact impulses at each sample of a block.

    `contacts` are the derivatives (samples, n, 3 + s, 6 + s) of forces and new states by gaps, states and previous
    gaps, the factors (n,) of the forces, and the springs (3 n,) in the propagation; `shares` (samples,) are step
    lengths over the period. Changed in place are `gaps` (samples, 3 n, k), to which the effect of the block's forces is
    added, `states` (n, s, k) and `before` (n, 3, k); `forces` (samples, 3 n, k) is filled; `known` (6 + s, k) is a work
    array.
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
def compiled_kicks() -> Any:
    """Return `_run`, compiled."""
    kinds: Any = types
    vector, matrix, block = types.float64[::1], types.float64[:, ::1], types.float64[:, :, ::1]
    contacts = kinds.Tuple((types.float64[:, :, :, ::1], vector, vector))
    return njit(types.void(contacts, vector, block, block, block, block, matrix, block), cache=True)(_run)
