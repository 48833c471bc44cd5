"""Jumps of a response: neighbours of a branch on different motions."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray

JUMP = 2.0  # ratio of neighbouring amplitudes that no step of a branch makes
LOSS_JUMP = 10.0  # ratio of neighbouring dissipations ...
# ... whose difference is so many times those beside it: where slip begins they grow from one to the next
LOSS_STEP = 4.0
LOSS_COUNTS = 0.01  # share of the largest dissipation below which it does not matter
LOSS_SEEN = 1e-6  # share of the energy that the contacts store below which it is rounding


@dataclass(frozen=True)
class Jump:
    """A step of a branch from one motion to another.

    Parameters
    ----------
    step
        Position of the point before it.
    what
        What jumps, in words.
    size
        By which factor.
    """

    step: int
    what: str
    size: float


def jumps(amplitude: FloatArray, loss: FloatArray, few: BoolArray, elastic: float) -> tuple[Jump, ...]:
    """Return the steps at which the response jumps.

    Parameters
    ----------
    amplitude
        (n,) of neighbours on a branch, m.
    loss
        (n,) energy that all contacts dissipate in a cycle, J.
    few
        (n,) whether a point keeps the harmonics of the first passage: those are connected by arc length, while what was solved
        with more may stand anywhere.
    elastic
        Largest energy that the contacts store, J, beside which the rounding of `loss` is seen.
    """
    of_loss = {j.step: j for j in _of_loss(np.maximum(loss, 0.0), elastic)}
    return tuple(sorted((of_loss | _of_amplitude(amplitude, few)).values(), key=lambda j: j.step))


def _of_amplitude(amplitude: FloatArray, few: BoolArray) -> dict[int, Jump]:
    found = {}
    for k, (low, high) in enumerate(map(sorted, pairwise(amplitude))):
        if high > JUMP * low and not (few[k] and few[k + 1]):
            found[k] = Jump(k, f"amplitude {high / low:.3g} times", float(high / low))
    return found


def _of_loss(loss: FloatArray, elastic: float) -> list[Jump]:
    """Return jumps of the dissipation; where slip begins it grows from nothing too, but each step is like the one after it."""
    step = np.abs(np.diff(loss))
    least = max(LOSS_COUNTS * float(loss.max(initial=0.0)), LOSS_SEEN * elastic)
    found = []
    for k, (low, high) in enumerate(map(sorted, pairwise(loss))):
        beside = max([*step[max(k - 1, 0) : k], *step[k + 1 : k + 2]], default=0.0)
        if low <= LOSS_SEEN * elastic:
            continue  # rounding: this is where slip begins
        if high > max(least, LOSS_JUMP * low) and step[k] > LOSS_STEP * beside:
            ratio = float(high / low)
            found.append(Jump(k, f"dissipation {ratio:.3g} times", ratio))
    return found


def stored_energy(gap: FloatArray | ComplexArray, force: FloatArray | ComplexArray) -> float:
    """Return the largest energy of order π |force| |gap| of all contacts together in a cycle, J.

    Parameters
    ----------
    gap, force
        (point, harmonic from 1, contact, ...) coefficients, m and N.
    """
    own = [np.moveaxis(x, 2, 1).reshape(*x.shape[:1], x.shape[2], -1) for x in (gap, force)]
    sizes = [np.linalg.norm(x, axis=2) for x in own]
    each = np.sum(sizes[0] * sizes[1], axis=1)
    return float(np.pi * np.nanmax(each, initial=0.0))
