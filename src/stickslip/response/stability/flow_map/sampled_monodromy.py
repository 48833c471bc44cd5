"""Monodromy matrix where the tangents of some contacts are known on samples only.

These forces act as a kick at each sample, and between samples everything is propagated exactly (the splitting of Strang 1968): the error
is of second order in the step. The means of the tangents over the period are springs, and part of what is propagated.
"""

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.response.stability.flow_map.contact_states import ContactStates
from stickslip.response.stability.flow_map.kick_blocks import blocks, run
from stickslip.response.stability.flow_map.modal_states import ModalStates
from stickslip.response.stability.flow_map.monodromy import Disturbance, Sliders, identity
from stickslip.response.stability.flow_map.propagation import transition
from stickslip.response.stability.flow_map.sampled_tangents import SampledTangents


def sample_times(contacts: ContactStates, samples: int, halves: int = 2) -> list[FloatArray]:
    """Return the samples of each interval between transitions, equally spaced and its beginning among them.

    Parameters
    ----------
    contacts
        Those with located transitions.
    samples
        Least number over the period.
    halves
        How many halves of it are taken; twice as many halve each step.
    """
    out = []
    for left, right in zip(contacts.times[:-1], contacts.times[1:], strict=True):
        least = max(1, int(np.ceil((right - left) * samples / (2.0 * np.pi))))
        count = (least * halves + 1) // 2
        out.append(left + (right - left) / count * np.arange(count))
    return out


class _Kicks:
    """Sampled contacts: their states, and what their forces do to the motion."""

    def __init__(self, modes: ModalStates, tangents: SampledTangents, weights: FloatArray, size: int) -> None:
        n, most = tangents.kept.shape
        self.modes, self.jac = modes, tangents.jac
        self.by_rate = bool(np.any(tangents.jac[:, :, :, 3:6] != 0.0))
        self.alone = np.ascontiguousarray(np.delete(tangents.jac, [3, 4, 5], axis=3))  # where no rate acts
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
        self.before = np.zeros((n, 3, size))  # gaps at the sample before
        own = int(self.real.sum())
        self.states[self.real, size - 3 * n - own : size - 3 * n] = np.eye(own)
        self.before[:, :, size - 3 * n :] = np.eye(3 * n).reshape(n, 3, 3 * n)

    def advance(self, first: int, shares: FloatArray, step: FloatArray, states: FloatArray) -> FloatArray:
        """Return the states after the kicks at samples from `first` on, each with its share of the period, and a step after each."""
        if self.by_rate:
            for i, share in enumerate(shares, first):
                self.kick(i, share, states)
                states = step @ states
            return states
        half, (rows, columns) = self.modes.n, (len(self.gaps), states.shape[1])
        gaps, push = np.zeros((rows, len(step))), np.zeros((len(step), rows))
        gaps[:, :half], push[half : 2 * half] = self.gaps, self.pull
        known, springs = np.zeros((self.alone.shape[3], columns)), self.springs.ravel()
        for block in blocks(step, gaps, push, len(shares)):
            samples = len(block.gaps)
            now, forces = block.gaps @ states, np.zeros((samples, rows, columns))
            contacts = self.alone[first : first + samples], self.factors, springs
            run()(contacts, shares[:samples], block.gap_response, now, self.states, self.before, known, forces)
            states = block.step @ states + block.force_effect @ forces.reshape(-1, columns)
            first, shares = first + samples, shares[samples:]
        return states

    def kick(self, sample: int, share: float, motion: FloatArray) -> None:
        """Change velocities and states at a sample; velocities decay as the kick goes on."""
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
        force = decayed(damping @ mobility) @ (force + damping @ rate)
        rate = rate - 0.5 * mobility @ force
        known[:, 3:6] = rate.reshape(n, 3, -1)
        motion[half : 2 * half] -= share * (self.pull @ force)
        self.states, self.before = jac[:, 3:] @ known, now

    @property
    def rows(self) -> FloatArray:
        """The states that there are and the gaps at the last sample, (n_states, k)."""
        return np.vstack([self.states[self.real], self.before.reshape(-1, self.before.shape[2])])


def decayed(x: FloatArray) -> FloatArray:
    """Return ``(1 - exp(-X)) / X``, the mean of a force that decays by its own effect, from a rational function of X / 2ᵏ."""
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
    """Return the derivative of all states after a period by those before.

    Parameters
    ----------
    modes
        Of the structure.
    contacts
        Those with located transitions.
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
