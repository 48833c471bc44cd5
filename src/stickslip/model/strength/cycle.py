"""Stress over a cycle: alternating and mean stress.

Stresses have the components xx, yy, zz, xy, yz, xz in Pa. The stress of a place over a period is given by its harmonics,
`s(t) = Re Σ_h S_h exp(i h ω t)`, `S_0` is the static stress.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import input_error
from stickslip.model.fe.material import TENSOR

SAMPLES_PER_HARMONIC = 16  # maxima over the phase are looked for at these samples, then located by Newton's method
MIN_SAMPLES = 64
NEWTON_STEPS = 4
# deviator of a stress as a vector whose length is √J2
_ROOT = np.sqrt(3) / 2
DEVIATOR = np.array(
    [
        [_ROOT * 2 / 3, -_ROOT / 3, -_ROOT / 3, 0, 0, 0],
        [0, 0.5, -0.5, 0, 0, 0],
        [0, 0, 0, 1, 0, 0],
        [0, 0, 0, 0, 1, 0],
        [0, 0, 0, 0, 0, 1],
    ]
)


def history(harmonics: ComplexArray, samples: int) -> FloatArray:
    """Return the stress (samples, k, 6) at equally spaced times of a period.

    Parameters
    ----------
    harmonics
        (H+1, k, 6) complex amplitudes of the stress at k places in Pa.
    samples
        Number of times.
    """
    return _sampled(_checked(harmonics), samples)


def von_mises(stress: FloatArray) -> FloatArray:
    """Return the equivalent stress (...) by von Mises (1913) of stresses (..., 6), in Pa."""
    return np.asarray(np.sqrt(3) * np.linalg.norm(stress @ DEVIATOR.T, axis=-1))


def alternating_and_mean(harmonics: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return the alternating and the mean stress (k,) in Pa, as integrity departments state them.

    The alternating stress is the largest equivalent stress of the dynamic part over the phase. The mean is the equivalent
    stress of the static part, with the sign of its principal stress of the largest size; positive where two are of one size.

    Parameters
    ----------
    harmonics
        (H+1, k, 6) complex amplitudes of the stress at k places in Pa; NaN at a place gives NaN there.
    """
    given = _checked(harmonics)
    return _where_finite(_alternating, given), signed_mean(given[0].real)


def signed_mean(stress: FloatArray) -> FloatArray:
    """Return the equivalent stress (...) of static stresses (..., 6), signed by the largest principal stress, in Pa."""
    finite = np.asarray(np.isfinite(stress).all(axis=-1))
    principal = np.linalg.eigvalsh(np.where(finite[..., None], stress, 0.0)[..., TENSOR])
    # of equal sizes, as in pure shear, the tensile one decides; rounding must not
    compressed = -principal[..., 0] > principal[..., 2] * (1 + 1e-9)
    return np.where(compressed, -1.0, 1.0) * von_mises(stress)


def _alternating(harmonics: ComplexArray) -> FloatArray:
    path = harmonics[1:] @ DEVIATOR.T
    if not len(path):
        return np.zeros(harmonics.shape[1])
    path = np.concatenate([np.zeros_like(path[:1]), path])
    return np.asarray(np.sqrt(3) * _farthest(path, _sampled(path, _samples(path)), np.zeros(path.shape[1:]))[1])


def _checked(harmonics: ComplexArray) -> ComplexArray:
    given = np.asarray(harmonics)
    if given.ndim != 3 or given.shape[-1] != 6 or not len(given):
        raise input_error(
            "harmonics",
            f"must have the shape (H+1, k, 6), got {given.shape}",
            "Give harmonic, place, and xx, yy, zz, xy, yz, xz.",
        )
    return given.astype(complex)


def _where_finite(compute: Callable[..., FloatArray], harmonics: ComplexArray, *others: Any) -> FloatArray:
    """Return what is computed of places with finite stresses, and NaN elsewhere; `others` are (k,) arrays."""
    finite = np.isfinite(harmonics).all(axis=(0, 2))
    found = np.full(finite.shape, np.nan)
    found[finite] = compute(harmonics[:, finite], *(np.broadcast_to(other, finite.shape)[finite] for other in others))
    return found


def _samples(harmonics: ComplexArray) -> int:
    return max(MIN_SAMPLES, SAMPLES_PER_HARMONIC * (len(harmonics) - 1))


def _sampled(harmonics: ComplexArray, samples: int) -> FloatArray:
    """Return the signals (samples, ...) of harmonics (H+1, ...) at equally spaced times."""
    phase = 2 * np.pi / samples * np.outer(np.arange(samples), np.arange(len(harmonics)))
    flat = harmonics.reshape(len(harmonics), -1)
    # two real products instead of a complex one
    signals = np.cos(phase) @ flat.real - np.sin(phase) @ flat.imag
    return np.asarray(signals.reshape(samples, *harmonics.shape[1:]))


def _derivatives(harmonics: ComplexArray, phase: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return signals (m, c) of harmonics (H+1, m, c) at a phase (m,) each, and their first two derivatives."""
    order = np.arange(len(harmonics))
    terms = harmonics * np.exp(1j * np.multiply.outer(order, phase))[..., None]
    value, slope, bend = (np.einsum("h,hmc->mc", 1.0 * factor, terms) for factor in (order**0, order, order**2))
    return value.real, -slope.imag, -bend.real


def _farthest(harmonics: ComplexArray, sampled: FloatArray, centre: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points (m, c) of paths farthest from their centres (m, c), and the distances (m,).

    Samples bracket each maximum, Newton's method locates it.
    """
    squared = np.einsum("nmc,nmc->nm", sampled - centre, sampled - centre)
    first = squared.argmax(axis=0)
    start = 2 * np.pi / len(sampled) * first
    step, phase = 2 * np.pi / len(sampled), start
    for _ in range(NEWTON_STEPS):
        x, slope, bend = _derivatives(harmonics, phase)
        d1 = np.einsum("mc,mc->m", x - centre, slope)
        d2 = np.einsum("mc,mc->m", slope, slope) + np.einsum("mc,mc->m", x - centre, bend)
        phase = np.clip(phase - np.divide(d1, d2, out=np.zeros_like(d1), where=d2 < 0), start - step, start + step)
    point = _derivatives(harmonics, phase)[0]
    reach = np.einsum("mc,mc->m", point - centre, point - centre)
    each = np.arange(len(first))
    sharper = reach >= squared[first, each]
    return (
        np.where(sharper[:, None], point, sampled[first, each]),
        np.sqrt(np.where(sharper, reach, squared[first, each])),
    )
