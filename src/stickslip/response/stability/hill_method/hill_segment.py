"""Hill's problem in a frequency interval of the disturbance, as a small matrix of the modes that resonate there.

A disturbance ``e^{στ} Σ_h u_h e^{ihτ}`` of a wave satisfies ``Z_h(σ + ih) q_h + B_hᴴ f_h = 0``, with gaps ``g_h = B_h
q_h`` and contact forces ``f = D(σ) g``. Modes far from resonance are eliminated with the contacts. The matrix S(σ) of
the remaining modes has no poles near the segment, so a polynomial through a few σ is accurate to many digits. Contact
harmonics above the solved ones act to first order, ``-D R D`` with the receptance R at the ports.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.linalg

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.contact.slider import PERIOD
from stickslip.response.stability.hill_method.contact_tangent import ContactTangent
from stickslip.response.stability.hill_method.hill_modes import HillModes, HillSide

TOGETHER = 2.0  # safety factor on the growth of a single mode, for coupled modes
LET_GO = 0.1  # stiffness of a mode over its mean below which damping no longer excludes growth
NODES = 8  # of the polynomial on a segment
AWAY = 0.75  # distance of a mode from a segment, in frequencies of the motion, above which it does not resonate; ...
FARTHER = (1.0, 2.0, 4.0, 8.0)  # ... factors on this distance to try
SMOOTH = 1e-4  # last term of an accurate polynomial, relative to its largest
MOST_RINGING = 400  # resonating modes of all harmonics together
HALF = 0.5  # length of a segment, in frequencies of the motion
Keep = Callable[[str, Callable[[], Mapping[str, Any]]], Mapping[str, Any]]


def reach(side: HillSide, tangents: Sequence[ContactTangent]) -> float:
    """Return the highest frequency of a mode that contacts can destabilise, over the frequency of the motion.

    It is 0 without such a mode.
    """
    if not tangents:
        return 0.0
    tops = (_top(side.modes(wave, 0), tangents) for wave in range(side.waves // 2 + 1))
    return max(tops)


def _top(modes: HillModes, tangents: Sequence[ContactTangent]) -> float:
    """Return `reach` for one wave.

    At a sudden change of stiffness, the amplitude of a fast mode grows at most, at the worst phase, by the square root
    of the ratio of its frequencies before and after; between changes it decays by damping. A mode with a negative total
    logarithm over the period cannot grow.
    """
    share = _relative(modes, tangents)
    own = np.log(np.maximum(1.0 + share, LET_GO))
    jumps = 0.25 * np.sum(np.abs(own - np.roll(own, 1, axis=0)), axis=0)
    damping = np.real(modes.damping if modes.damping.ndim == 1 else np.diagonal(modes.damping))
    damping = damping - np.sum(np.abs(modes.springs) ** 2, axis=0)
    ratios = modes.ratios
    loss = np.real(modes.loss if modes.loss.ndim == 1 else np.diagonal(modes.loss))
    with np.errstate(divide="ignore", invalid="ignore"):
        decay = 0.5 * PERIOD * (damping + loss / ratios) / modes.mass
    held = np.min(share, axis=0) > LET_GO - 1.0
    grows = np.isfinite(ratios) & ~(held & (TOGETHER * jumps < decay))
    highest = ratios * np.sqrt(np.maximum(1.0 + np.max(share, axis=0), 0.0))
    return float(np.max(highest[grows], initial=0.0))


def _relative(modes: HillModes, tangents: Sequence[ContactTangent]) -> FloatArray:
    """Return the (n_intervals, n) change of the stiffness of each mode by the contacts, over its mean."""
    total = np.zeros((len(tangents[0].times) - 1, modes.mass.size))
    for tangent in tangents:
        ports = modes.ports[tangent.ports]
        forces = np.tensordot(tangent.changes, ports, axes=1)
        total += np.real(np.einsum("pj,ipj->ij", ports.conj(), forces))
    return np.asarray(total / modes.stiffness)


TAIL, MOST_TAIL = (3, 60)  # highest harmonic that acts to first order: over the highest solved one, and at most


def not_kept(_content: str, make: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the result of the function without a cache."""
    return make()


@dataclass(frozen=True, eq=False)
class Hill:
    """Hill's problem of a motion.

    Attributes
    ----------
    side
        Linear structure of the disturbances.
    tangents
        Tangents of the contacts that change in the period.
    order
        Highest solved harmonic of the disturbances.
    keep
        Cache of the matrices of a segment by their inputs.
    """

    side: HillSide
    tangents: Sequence[ContactTangent]
    order: int
    keep: Keep = not_kept

    @cached_property
    def reach(self) -> float:
        """Highest frequency of a mode that contacts can destabilise, in harmonics of the motion."""
        return reach(self.side, self.tangents)

    @property
    def rows(self) -> int:
        """Number of gaps in all solved harmonics: rows of the factorised matrices."""
        return (2 * self.order + 1) * int(self.side.ports.size)

    @property
    def core(self) -> IntArray:
        """The solved harmonics."""
        return np.arange(-self.order, self.order + 1)

    @property
    def tail(self) -> IntArray:
        """The harmonics above the solved ones."""
        last = min(TAIL * self.order, self.order + MOST_TAIL)
        beyond = np.arange(self.order + 1, last + 1)
        return np.concatenate([-beyond[::-1], beyond])


@dataclass(frozen=True, eq=False)
class Node:
    """Small matrices at one exponent.

    Attributes
    ----------
    whole
        (s, s) matrix with the contacts.
    beyond
        (s, s) contribution of the harmonics above the solved ones to it.
    alone
        (s, s) matrix with mean springs in place of the contacts.
    phase
        Argument of the determinant of the eliminated part, relative to the part without contacts.
    """

    whole: ComplexArray
    beyond: ComplexArray
    alone: ComplexArray
    phase: float


@dataclass(frozen=True, eq=False)
class Segment:
    """Interval of exponents ``growth + iy`` with y between `low` and ``low + 1/2``, for the disturbances of a wave."""

    hill: Hill
    wave: int
    low: float
    growth: float = 0.0
    away: float = AWAY

    @property
    def high(self) -> float:
        """Upper end of the segment."""
        return self.low + HALF

    @cached_property
    def slow(self) -> list[IntArray]:
        """Modes of each harmonic that can resonate."""
        found = []
        for h in self.hill.core:
            ratios = self.hill.side.modes(self.wave, int(h)).ratios
            ends = sorted((abs(h + self.low), abs(h + self.high)))
            inside = (ratios > ends[0] - self.away) & (ratios < ends[1] + self.away)
            found.append(np.flatnonzero(inside))
        return found

    @cached_property
    def heights(self) -> FloatArray:
        """(NODES,) imaginary parts of the nodes, including the ends."""
        x = np.cos(np.pi * np.arange(NODES)[::-1] / (NODES - 1))
        return self.low + 0.5 * HALF * (1.0 + x)

    @cached_property
    def smooth(self) -> bool:
        """Whether the polynomial approximates the matrix everywhere between the nodes."""
        values = np.array([node.whole for node in self.nodes])
        if not values.size:
            return True
        k = np.arange(NODES)
        terms = np.cos(np.pi * np.outer(k[-2:], k) / (NODES - 1)) * 2.0 / (NODES - 1)
        terms[:, [0, -1]] *= 0.5
        scale = np.max(np.abs(values), axis=(0, 2))[:, None]
        last = np.tensordot(terms, values[::-1], axes=1) / scale
        return bool(np.max(np.abs(last)) < SMOOTH)

    @cached_property
    def nodes(self) -> list[Node]:
        """Matrices at the nodes."""
        place = f"wave {self.wave}, {self.low} + {self.growth}, {self.away}, H = {self.hill.order}"
        kept = self.hill.keep(place, self._matrices)
        names = [f.name for f in fields(Node)]
        return [Node(**dict(zip(names, own, strict=True))) for own in zip(*(kept[name] for name in names), strict=True)]

    def _matrices(self) -> dict[str, Any]:
        """Return the matrices of all nodes by their names in `Node`."""
        found = [self.node(complex(self.growth, y)) for y in self.heights]
        return {f.name: np.array([getattr(node, f.name) for node in found]) for f in fields(Node)}

    def weights(self, sigma: ComplexArray) -> ComplexArray:
        """Return the (k, NODES) shares of the nodes in the polynomial at exponents (k,)."""
        x = self.growth + 1j * self.heights
        bary = (-1.0) ** np.arange(NODES)
        bary[[0, -1]] *= 0.5
        apart = sigma[:, None] - x
        exact = np.abs(apart) < 1e-13
        share = bary / np.where(exact, 1.0, apart)
        share = np.where(exact.any(axis=1, keepdims=True), exact, share)
        return np.asarray(share / share.sum(axis=1, keepdims=True))

    def node(self, sigma: complex) -> Node:
        """Eliminate non-resonant modes and contacts at an exponent."""
        core, tail = self.hill.core, self.hill.tail
        parts = [self._part(sigma, int(h), own) for h, own in zip(core, self.slow, strict=True)]
        alone = scipy.linalg.block_diag(*(p.alone for p in parts))
        if not self.hill.tangents:
            return Node(alone, np.zeros_like(alone), alone, 0.0)
        k, m = core.size, self.hill.side.ports.size
        receptance = np.array([p.receptance for p in parts])
        ports = scipy.linalg.block_diag(*(p.ports for p in parts))
        forces = scipy.linalg.block_diag(*(p.forces for p in parts))
        own = [t.matrix(sigma, core, core) for t in self.hill.tangents]
        blocks = np.zeros((k, m, k, m), dtype=complex)
        for t, d in zip(self.hill.tangents, own, strict=True):
            q = t.ports
            block = receptance[:, :, q] @ d.reshape(k, q.size, k * q.size)
            blocks[:, :, :, q] = block.reshape(k, m, k, q.size)
        system = blocks.reshape(k * m, k * m)
        system.flat[:: k * m + 1] += 1.0
        factors = scipy.linalg.lu_factor(system, overwrite_a=True, check_finite=False)
        gaps = scipy.linalg.lu_solve(factors, ports, check_finite=False)
        felt = self._felt(own, gaps, k, k)
        whole = alone + forces @ felt
        beyond = self._beyond(sigma, core, tail, gaps)
        # effect of the changed forces on the gaps, and of these on the forces
        moved = scipy.linalg.lu_solve(
            factors, (receptance @ beyond.reshape(k, m, -1)).reshape(k * m, -1), check_finite=False
        )
        change = forces @ (beyond - self._felt(own, moved, k, k))
        turns = np.angle(np.diagonal(factors[0])).sum()
        swaps = np.pi * np.count_nonzero(factors[1] != np.arange(k * m))
        return Node(whole + change, change, alone, float(turns + swaps))

    def _beyond(self, sigma: complex, core: IntArray, tail: IntArray, gaps: ComplexArray) -> ComplexArray:
        """Return the change of the forces (k m, s) by harmonics above the solved ones."""
        k, m = core.size, self.hill.side.ports.size
        there = [t.matrix(sigma, tail, core) for t in self.hill.tangents]
        back = [t.matrix(sigma, core, tail) for t in self.hill.tangents]
        forces = self._felt(there, gaps, k, tail.size).reshape(tail.size, m, -1)
        answer = np.empty_like(forces)
        for i, h in enumerate(tail):
            modes = self.hill.side.modes(self.wave, int(h))
            away = (
                np.abs(modes.ratios - abs(h + self.low + 0.5 * HALF)) > AWAY + 0.5 * HALF
            )  # resonating modes are left out
            answer[i] = -_receptance(modes, sigma + 1j * h, away) @ forces[i]
        return self._felt(back, answer.reshape(tail.size * m, -1), tail.size, k)

    def _felt(self, matrices: Sequence[ComplexArray], gaps: ComplexArray, before: int, after: int) -> ComplexArray:
        """Return the forces (after m, s) of the gaps (before m, s), contact by contact."""
        m = self.hill.side.ports.size
        given = gaps.reshape(before, m, -1)
        out = np.zeros((after, m, given.shape[2]), dtype=complex)
        for t, d in zip(self.hill.tangents, matrices, strict=True):
            q = t.ports
            found = d @ given[:, q].reshape(before * q.size, -1)
            out[:, q] = found.reshape(after, q.size, -1)
        return out.reshape(after * m, -1)

    def _part(self, sigma: complex, harmonic: int, slow: IntArray) -> "_Part":
        modes = self.hill.side.modes(self.wave, harmonic)
        middle = harmonic + self.low + 0.5 * HALF
        return _part(modes, slow, sigma + 1j * harmonic, float(np.sign(middle)))


def fitted(segment: Segment) -> Segment:
    """Return a segment with enough retained modes for an accurate polynomial, if the limits allow."""
    for factor in FARTHER:
        trial = replace(segment, away=factor * AWAY)
        if sum(own.size for own in trial.slow) > MOST_RINGING:
            break
        segment = trial
        if segment.smooth:
            break
    return segment


@dataclass(frozen=True, eq=False)
class _Part:
    """One harmonic with its non-resonant modes eliminated."""

    alone: ComplexArray  # (s, s) matrix of the resonant modes
    ports: ComplexArray  # (m, s) gaps due to resonant modes
    forces: ComplexArray  # (s, m) effect of contact forces on resonant modes
    receptance: ComplexArray  # (m, m) of the eliminated modes


def _part(modes: HillModes, slow: IntArray, z: complex, sign: float) -> _Part:
    B, D, held = modes.ports, modes.diagonal(z, sign), modes.springs
    ringing = np.zeros(B.shape[1], dtype=bool)
    ringing[slow] = True
    rest = np.flatnonzero(~ringing)
    B_s, B_r = B[:, slow], B[:, rest]
    if D is None:
        Z = modes.dynamic(z, sign)
        inner, across = Z[np.ix_(slow, slow)], Z[np.ix_(slow, rest)]
        right = np.hstack([B_r.conj().T, Z[np.ix_(rest, slow)]])
        solved = np.linalg.solve(Z[np.ix_(rest, rest)], right)
    else:
        # Z = D - z Yᴴ Y is inverted by the Woodbury formula
        Y_s, Y_r = held[:, slow], held[:, rest]
        inner = np.diag(D[slow]) - z * (Y_s.conj().T @ Y_s)
        across = -z * (Y_s.conj().T @ Y_r)
        right = np.hstack([B_r.conj().T, -z * (Y_r.conj().T @ Y_s)])
        solved = right / D[rest, None]
        scaled = Y_r.conj().T / D[rest, None]
        small = np.eye(len(held)) - z * (Y_r @ scaled)
        solved = solved + z * (scaled @ np.linalg.solve(small, Y_r @ solved))
    answer, follows = solved[:, : len(B)], solved[:, len(B) :]
    return _Part(inner - across @ follows, B_s - B_r @ follows, B_s.conj().T - across @ answer, B_r @ answer)


def _receptance(modes: HillModes, z: complex, away: BoolArray) -> ComplexArray:
    """Return the (m, m) receptance at the ports of the modes `away` from resonance, without damping between modes."""
    damping, rest = (np.diagonal(a) if a.ndim == 2 else a for a in (modes.damping, modes.rest))
    own = damping - np.sum(np.abs(modes.springs) ** 2, axis=0)
    Z = modes.stiffness + z * z * modes.mass + z * own + rest
    ports = modes.ports[:, away]
    return np.asarray((ports / Z[away]) @ ports.conj().T)
