"""Floquet exponents near and right of the imaginary axis, by Hill's method."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.response.stability.hill_method.hill_segment import HALF, Hill, Segment, fitted
from stickslip.response.stability.hill_method.hill_zeros import Matrix, Zeros, turning, zeros_near

WIDE, HIGH = 0.3, 0.32  # half axes of the ellipse about a segment
# real parts relative to a segment: smallest of sought exponents, and smallest of exponents that are solved again
LEFT, SURE = -0.12, 0.04
ROUNDS, STEP, LAST_CHANGE, MAX_CHANGE = 8, 1e-6, 1e-8, 0.1  # of Newton's method on the exact matrix
EDGE = 5e-3  # allowed distance of exponents beyond the ends of a segment
ON_AXIS = 1.6e-7  # real part up to which an exponent is on the imaginary axis
PATH = 65  # points of a determinant along a segment
STEPS = (0.4, 0.8, 1.2, 1.6, 2.0, 2.5, 3.0)  # real parts of further segments if exponents are missing
FURTHER = 1.25  # factor on the harmonics to confirm an exponent while others are missing
TRIES = 3  # largest number of growing exponents to confirm
UNCOUNTED = 3e-3  # error of a confirmed exponent from modes that resonate above; measured: 1.4e-3
TWIN = 1e-5  # distance up to which exponents of two segments are the same
WHOLE = 0.05  # largest distance of a winding number from an integer


@dataclass(frozen=True, eq=False)
class Exponents:
    """Exponents σ = λ/ω of the disturbances of a motion, in order of decreasing growth.

    Attributes
    ----------
    values
        (e,) with imaginary parts from -1/2 to 1/2.
    errors
        (e,) first-order change by the harmonics above the solved ones.
    waves, harmonics
        (e,) wave number and strongest harmonic of each disturbance.
    missing
        Number of exponents right of the imaginary axis that were not found; None if they could not be counted. Unless
        it is 0, only the fastest growing exponent that more harmonics confirm is kept right of the axis.
    """

    values: ComplexArray
    errors: FloatArray
    waves: IntArray
    harmonics: IntArray
    missing: int | None

    @property
    def multipliers(self) -> ComplexArray:
        """(e,) ``e^{2πσ}``."""
        return np.asarray(np.exp(2.0 * np.pi * self.values))


@dataclass(frozen=True, eq=False)
class Part:
    """Exponents near a segment."""

    segment: Segment
    values: ComplexArray
    errors: FloatArray
    harmonics: IntArray

    def taken(self, which: BoolArray | IntArray) -> "Part":
        """Return a selection of the exponents."""
        return Part(self.segment, self.values[which], self.errors[which], self.harmonics[which])


def exponents(hill: Hill, segments: Sequence[Segment] = ()) -> Exponents:
    """Return all exponents of a motion near the imaginary axis and right of it, or those near some segments.

    For a wheel each wave is a separate problem. Disturbances are real, so the exponents of waves k and -k are
    conjugate.
    """
    if segments:
        return _gathered([_zeros(fitted(segment)) for segment in segments], hill, None)
    axis = [fitted(segment) for segment in segments_of(hill)]
    found = [_raw(segment, "whole") for segment in axis]
    parts = [_zeros(segment, zeros) for segment, zeros in zip(axis, found, strict=True)]
    growing = _counted(axis, found)
    for growth in STEPS if growing is not None else ():
        if _growing(parts, hill) >= (growing or 0):
            break
        parts += [_zeros(replace(segment, growth=growth)) for segment in axis]
    if _growing(parts, hill) == growing:
        return _gathered(parts, hill, 0)
    parts = _confirmed(parts)
    left = None if growing is None else growing - _growing(parts, hill)
    return _gathered(parts, hill, left if left is None or left >= 0 else None)


def _confirmed(parts: list[Part]) -> list[Part]:
    """Return the parts with only one exponent right of the axis.

    It is the fastest growing one that more harmonics confirm.
    """
    growing = [(i, int(j)) for i, p in enumerate(parts) for j in np.flatnonzero(p.values.real > ON_AXIS)]
    growing.sort(key=lambda at: -parts[at[0]].values[at[1]].real)
    out = [p.taken(p.values.real <= ON_AXIS) for p in parts]
    for i, j in growing[:TRIES]:
        own = parts[i].taken(np.array([j]))
        hill = own.segment.hill
        more = replace(own.segment, hill=replace(hill, order=int(np.ceil(FURTHER * hill.order))))
        again = _solved(more, complex(own.values[0]))
        if again is None:
            continue
        off = abs(again[0] - own.values[0])
        if off > 0.5 * own.values[0].real:
            continue
        return [*out, replace(own, errors=own.errors + 2.0 * off + UNCOUNTED)]
    return out


def segments_of(hill: Hill) -> list[Segment]:
    """Return the segments of the imaginary axis that cover all disturbances."""
    waves, found = hill.side.waves, []
    for wave in range(waves // 2 + 1):
        lows = (0.0,) if 2 * wave in (0, waves) else (-HALF, 0.0)
        found += [Segment(hill, wave, low) for low in lows]
    return found


def _counted(axis: Sequence[Segment], found: Sequence[Zeros]) -> int | None:
    """Return the number of exponents right of the imaginary axis; None if unknown.

    It follows from the winding of the determinant along the axis.
    """
    if not all(segment.smooth for segment in axis) or not _rings(axis):
        return None
    each = [_turns(segment, zeros) for segment, zeros in zip(axis, found, strict=True)]
    turns, alone = 2.0 * sum(t for t, _ in each), 2 * sum(n for _, n in each)
    if np.isnan(turns) or abs(turns - round(turns)) > WHOLE:
        return None
    return alone - round(turns)


def _rings(axis: Sequence[Segment]) -> bool:
    """Whether a mode resonates in a solved harmonic, and contacts destabilise none above all solved harmonics."""
    hill = axis[0].hill
    if not hill.tangents:
        return True
    rings = any(own.size for segment in axis for own in segment.slow)
    return rings and hill.order >= hill.reach


def _turns(segment: Segment, found: Zeros) -> tuple[float, int]:
    """Return the winding of the determinant along a segment, relative to mean springs.

    The second result is the number of growing exponents with mean springs.
    """
    whole, alone = _matrix(segment, "whole"), _matrix(segment, "alone")
    path = ON_AXIS + 1j * np.linspace(segment.low, segment.high, PATH)
    without = _raw(segment, "alone").values
    phases = np.array([node.phase for node in segment.nodes])
    steps = np.angle(np.exp(1j * np.diff(phases)))
    eliminated = float(steps.sum()) if np.all(np.abs(steps) < 2.0) else float("nan")
    turns = turning(whole, found.values, path) - turning(alone, without, path) + eliminated
    inside = (without.imag >= segment.low) & (without.imag < segment.high)
    growing = int(np.count_nonzero((without.real > ON_AXIS) & inside))
    return turns / (2.0 * np.pi), growing


def _zeros(segment: Segment, zeros: Zeros | None = None) -> Part:
    """Return the exponents near a segment, their errors, and their strongest harmonics.

    Far from the segment the polynomial has spurious zeros, so zeros right of the segment are solved again with the
    exact matrix.
    """
    found = _raw(segment, "whole") if zeros is None else zeros
    beside = found.values.real - segment.growth
    inside = (found.values.imag >= segment.low - EDGE) & (found.values.imag <= segment.high + EDGE)
    values, errors, most = [], [], []
    harmonic = np.repeat(segment.hill.core, [own.size for own in segment.slow])
    beyond = _matrix(segment, "beyond")(found.values) / found.scale
    for i in np.flatnonzero(inside & (beside > LEFT)):
        value, right, left = found.values[i], found.right[i], found.left[i]
        change, slope = beyond[i], found.slopes[i]
        if beside[i] > SURE or segment.growth:
            again = _solved(segment, complex(value))
            if again is None:
                continue
            value, right, left, change, slope = again
        values.append(value)
        errors.append(abs(np.vdot(left, change @ right) / slope))
        most.append(harmonic[np.argmax(np.abs(right))])
    return Part(segment, np.array(values, dtype=complex), np.array(errors, dtype=float), np.array(most, dtype=np.int64))


def _solved(
    segment: Segment, sigma: complex
) -> tuple[complex, ComplexArray, ComplexArray, ComplexArray, complex] | None:
    """Solve for an exponent by Newton's method on the exact matrix; None without convergence.

    The result is the exponent, its right and left vectors, the contribution of higher harmonics, and the slope.
    """
    start = sigma
    for _ in range(ROUNDS):
        here, beside = segment.node(sigma), segment.node(sigma + STEP)
        scale = np.max(np.abs(here.whole), axis=1, keepdims=True)
        whole = here.whole / scale
        u, _, vh = np.linalg.svd(whole)
        right, left = vh[-1].conj(), u[:, -1]
        slope = np.vdot(left, (beside.whole / scale - whole) @ right) / STEP
        change = -np.vdot(left, whole @ right) / slope
        sigma += change
        if abs(sigma - start) > MAX_CHANGE:
            return None
        if abs(change) < LAST_CHANGE:
            return sigma, right, left, here.beyond / scale, complex(slope)
    return None


def _raw(segment: Segment, name: str) -> Zeros:
    centre = complex(segment.growth, segment.low + 0.5 * HALF)
    return zeros_near(_matrix(segment, name), _slope(segment, name), centre, WIDE, HIGH)


def _matrix(segment: Segment, name: str) -> Matrix:
    """Return the polynomial through the small matrices of a segment."""
    nodes = np.array([getattr(node, name) for node in segment.nodes])

    def matrix(sigma: ComplexArray) -> ComplexArray:
        return np.asarray(np.tensordot(segment.weights(sigma), nodes, axes=1))

    return matrix


def _slope(segment: Segment, name: str) -> Matrix:
    """Return the derivative of the matrix, by central differences along the real axis."""
    nodes, step = np.array([getattr(node, name) for node in segment.nodes]), 1e-5

    def slope(sigma: ComplexArray) -> ComplexArray:
        apart = segment.weights(sigma + step) - segment.weights(sigma - step)
        return np.asarray(np.tensordot(apart / (2.0 * step), nodes, axes=1))

    return slope


def _growing(parts: list[Part], hill: Hill) -> int:
    """Return the number of known exponents right of the imaginary axis, conjugates included."""
    return int(np.count_nonzero(_gathered(parts, hill, None).values.real > ON_AXIS))


def _gathered(parts: list[Part], hill: Hill, missing: int | None) -> Exponents:
    """Return all exponents and their conjugates once each, in order of decreasing growth."""
    waves = hill.side.waves
    segment = np.concatenate([np.full(p.values.size, i) for i, p in enumerate(parts)])
    wave = np.concatenate([np.full(p.values.size, p.segment.wave) for p in parts])
    values = np.concatenate([p.values for p in parts])
    errors = np.concatenate([p.errors for p in parts])
    harmonics = np.concatenate([p.harmonics for p in parts])
    kept: list[int] = []
    for i in np.argsort(-values.real, kind="stable"):
        others = np.array([j for j in kept if segment[j] != segment[i]], dtype=np.int64)
        same = (wave[others] == wave[i]) & (np.abs(values[others] - values[i]) < TWIN)
        for turn in (-1, 1):  # the same disturbance with shifted harmonics
            twin = np.abs(values[others] - values[i] - 1j * turn) < EDGE
            same |= twin & (wave[others] == hill.side.wave_of(int(wave[i]), -turn))
        if not np.any(same):
            kept.append(int(i))
    own = np.array(kept, dtype=np.int64)
    # for a self-conjugate wave, an exponent at an end is its own conjugate, or its conjugate has been found, too
    at_end = np.minimum(np.abs(values[own].imag), np.abs(np.abs(values[own].imag) - HALF)) < EDGE
    paired = own[~(((-wave[own]) % waves == wave[own]) & at_end)]
    both, sign = np.append(own, paired), np.repeat([1, -1], [own.size, paired.size])
    order = np.argsort(-values[both].real, kind="stable")
    both, sign = both[order], sign[order]
    return Exponents(
        values[both].real + 1j * sign * values[both].imag,
        errors[both],
        (sign * wave[both]) % waves,
        sign * harmonics[both],
        missing,
    )
