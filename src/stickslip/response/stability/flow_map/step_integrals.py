"""Means of tangents over the steps on both sides of each sample, refined where the tangents change much within a step."""

from collections.abc import Callable

import numpy as np

from stickslip.arrays import FloatArray, IntArray

ACCURACY = 1e-8  # of the integral over a piece, relative to that over the period
MOST_HALVINGS = 50


def fourier_basis(tau: FloatArray, m: int) -> tuple[FloatArray, FloatArray]:
    """Return 1, cos hτ, sin hτ, ... at times, and their derivatives by τ."""
    h = np.arange(1, (m + 1) // 2)
    cos, sin = np.cos(np.outer(tau, h)), np.sin(np.outer(tau, h))
    basis, slope = np.ones((tau.size, m)), np.zeros((tau.size, m))
    basis[:, 1::2], basis[:, 2::2] = cos, sin
    slope[:, 1::2], slope[:, 2::2] = -h * sin, h * cos
    return basis, slope


def hat_integrals(
    tangents: Callable[[FloatArray, IntArray], FloatArray], ends: FloatArray, step: IntArray, samples: FloatArray
) -> FloatArray:
    """Return means of tangents about each sample, their weight falling linearly to zero at the neighbouring samples.

    A force that lasts much less than a step acts as two kicks with the same sum and the same mean time. Pieces are halved until the
    rule of Simpson does not change.

    Parameters
    ----------
    tangents
        Gives the (k, ...) tangents at k times, each of which lies in a part of a step.
    ends
        (n_parts, 2) between which times the parts lie; a moment in which the tangents are large has to be one of these.
    step
        (n_parts,) the sample at which the step of each part ends.
    samples
        (n_samples,) times, the first step beginning at the last of the period before.
    """
    lengths = np.diff(samples, prepend=samples[-1] - 2 * np.pi)
    part, left, right = np.arange(len(ends)), ends[:, 0], ends[:, 1]
    shape = tangents(ends[:1, 1], part[:1]).shape[1:]
    found = np.zeros((2, len(samples), int(np.prod(shape))))  # at the beginning and the end of a step

    def moments(tau: FloatArray, parts: IntArray) -> FloatArray:
        own = tangents(tau, parts).reshape(tau.size, -1)
        share = 1.0 - (samples[step[parts]] - tau) / lengths[step[parts]]
        return np.stack([own * (1.0 - share)[:, None], own * share[:, None]])

    for halvings in range(MOST_HALVINGS + 1):
        length = (right - left)[:, None]
        places = [left + (right - left) * share for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
        a, b, c, d, e = (moments(tau, part) for tau in places)
        whole = length / 6.0 * (a + 4.0 * c + e)
        halves = length / 12.0 * (a + 4.0 * b + 2.0 * c + 4.0 * d + e)
        total = np.sum(np.abs(found), axis=(0, 1)) + np.sum(np.abs(halves), axis=(0, 1))
        done = np.all(np.abs(halves - whole) <= ACCURACY * total, axis=(0, 2))
        done |= halvings == MOST_HALVINGS
        for side in range(2):
            np.add.at(found[side], step[part[done]], halves[side, done])
        if np.all(done):
            break
        middle = 0.5 * (left + right)[~done]
        part = np.concatenate([part[~done]] * 2)
        left, right = (np.concatenate([left[~done], middle]), np.concatenate([middle, right[~done]]))
    shares = 0.5 * (lengths + np.roll(lengths, -1))
    means = (np.roll(found[0], -1, axis=0) + found[1]) / shares[:, None]
    return np.asarray(means.reshape(-1, *shape))
