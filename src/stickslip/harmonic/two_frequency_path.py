"""Sampling of a torus of two phases along closed characteristics.

Contacts have memory, and time advances both phases at once, along the characteristic ``θ1 = ω1 t, θ2 = ω2 t + φ``. If
``ω2 / ω1`` is approximated by a ratio of integers q / p, a characteristic closes after p turns of the first phase and q
of the second. Its samples are those of one long period: the contact state is marched along them without interpolation.
If it closes after only a few turns, several parallel characteristics are used.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, gcd

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error

Indices = tuple[tuple[int, int], ...]  # (0, 0) first, then one of each pair (j, k), (-j, -k)

TURNS_A_HARMONIC, LEAST_TURNS = 4, 24
SAMPLES_A_HARMONIC, LEAST_SAMPLES = 8, 48  # per turn of the faster phase
SLIP = 2e-3  # largest error of the second phase, rad per turn: ten times as much changes forces by some thousandths
EXACT = 1e-6  # rad per turn: below this error, a ratio counts as a ratio of integers
LONG = 4  # times the usual number of turns, for a path through a whole slow beat


@dataclass(frozen=True)
class TorusPath:
    """Samples on a torus.

    Parameters
    ----------
    turns
        Turns of the first and second phase after which a characteristic closes; they have no common divisor.
    ways
        Number of parallel characteristics.
    samples
        Number of samples on each characteristic.
    """

    turns: tuple[int, int]
    ways: int
    samples: int

    @property
    def ratio(self) -> float:
        """Rational approximation of ω2 / ω1 for the contacts."""
        return self.turns[1] / self.turns[0]

    def phases(self, way: int) -> tuple[FloatArray, FloatArray]:
        """Return the (samples,) phases along a characteristic."""
        along = 2.0 * np.pi * np.arange(self.samples) / self.samples
        offset = 2.0 * np.pi * way / (self.ways * self.turns[0])
        return self.turns[0] * along, self.turns[1] * along + offset

    def slip(self, ratio: float) -> float:
        """Return the error of the second phase per turn of the first, rad."""
        return 2.0 * np.pi * abs(ratio - self.ratio)


def half_plane(order: int) -> Indices:
    """Return the indices (j, k) of combined frequencies ``j ω1 + k ω2`` with ``|j| + |k|`` up to `order`.

    Only one of (j, k) and (-j, -k) is returned.

    Raises
    ------
    InputError
        If the order is below 1.
    """
    if order < 1:
        raise input_error("harmonics", f"is {order}", "Keep at least the two frequencies: 1.")
    first = [(j, 0) for j in range(1, order + 1)]
    rest = [
        (j, k) for k in range(1, order + 1) for j in sorted(range(k - order, order - k + 1), key=lambda v: (abs(v), -v))
    ]
    return ((0, 0), *first, *rest)


def closed_path(ratio: float, order: int, refine: float = 1.0) -> TorusPath:
    """Return the shortest path with a rational approximation of `ratio`, ω2 / ω1.

    Parameters
    ----------
    ratio
        ω2 / ω1, above zero.
    order
        Largest sum of harmonics.
    refine
        Factor on the usual number of turns, and of samples per turn.
    """
    least = ceil(refine * max(TURNS_A_HARMONIC * order, LEAST_TURNS))
    choices = [(p, q) for p in range(1, 2 * least) for q in (max(1, round(ratio * p)),) if gcd(p, q) == 1]
    off = [2.0 * np.pi * abs(ratio - q / p) for p, q in choices]
    near = [i for i, slip in enumerate(off) if slip <= SLIP]
    p, q = choices[near[0] if near else int(np.argmin(off))]
    if p < least and 2.0 * np.pi * abs(ratio - q / p) > EXACT:
        p, q = _through_beat(ratio, least)
    a_turn = ceil(refine * max(SAMPLES_A_HARMONIC * order, LEAST_SAMPLES) * max(1.0, ratio))
    return TorusPath((p, q), ceil(least / p), p * a_turn)


def _through_beat(ratio: float, least: int) -> tuple[int, int]:
    """Return the turns of one long characteristic for a ratio close to a ratio of small integers.

    Parallel characteristics would have separate sliders, but a slider that sticks in one part of the beat keeps the
    state from another part. Thus one characteristic must pass through the whole beat.
    """
    turns = range(least, LONG * least)
    choices = [(p, q) for p in turns for q in {max(1, int(ratio * p)), int(ratio * p) + 1} if gcd(p, q) == 1]
    return min(choices, key=lambda c: abs(ratio - c[1] / c[0]))


@lru_cache(maxsize=64)
def torus_basis(path: TorusPath, indices: Indices, way: int) -> FloatArray:
    """Return (samples, m) values of ``1, cos(jθ1 + kθ2), sin(jθ1 + kθ2), ...`` along a characteristic."""
    first, second = path.phases(way)
    basis = np.ones((path.samples, 2 * len(indices) - 1))
    for place, (j, k) in enumerate(indices[1:]):
        angle = j * first + k * second
        basis[:, 1 + 2 * place], basis[:, 2 + 2 * place] = np.cos(angle), np.sin(angle)
    return basis


def torus_rates(basis: FloatArray, frequencies: FloatArray) -> FloatArray:
    """Return the time derivative of a basis whose functions have the `frequencies` (one per index, rad/s)."""
    rates = np.zeros_like(basis)
    rates[:, 1::2] = -frequencies[1:] * basis[:, 2::2]
    rates[:, 2::2] = frequencies[1:] * basis[:, 1::2]
    return rates
