"""Condensed dynamic stiffness and load for each combined frequency of a motion with two frequencies."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip.arrays import ComplexArray
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.two_frequency_path import Indices


@dataclass(frozen=True, eq=False)
class TorusSide:
    """A condensed structure or wheel with two excitation frequencies.

    Parameters
    ----------
    first, second
        Dynamic stiffness with the loads of either frequency; the static load is that of `first`.
    waves
        Wave numbers of both frequencies and number of sectors of a tuned wheel; None: one structure for all frequencies.
    still
        Dynamic stiffness without a load, by wave number modulo the sectors; 0 for one structure.
    """

    first: DynamicStiffness
    second: DynamicStiffness
    still: Mapping[int, DynamicStiffness]
    waves: tuple[int, int, int] | None = None

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return self.first.n

    def wave(self, j: int, k: int) -> int:
        """Return the wave number of a combined frequency."""
        if self.waves is None:
            return 0
        first, second, sectors = self.waves
        return (j * first + k * second) % sectors

    def stiffness(
        self, indices: Indices, omegas: tuple[float, float], rate: float = 0.0
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return the (len, n, n) dynamic stiffness at each combined frequency and its derivative by that frequency.

        Parameters
        ----------
        indices
            Indices of the combined frequencies.
        omegas
            ω1 and ω2, rad/s.
        rate
            Rate, 1/s, times which the mass is subtracted from the damping at all combined frequencies with the second one.
        """
        return _stiffness(self, indices, omegas, rate)

    def load(self, indices: Indices, omegas: tuple[float, float]) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return the (len, n) condensed load at each combined frequency and its derivatives by ω1 and ω2."""
        out = np.zeros((3, len(indices), self.n), dtype=complex)
        top = max(max(abs(j), abs(k)) for j, k in indices)
        one, two = self.first.condensed(omegas[0], top), self.second.condensed(omegas[1], top)
        for place, (j, k) in enumerate(indices):
            if k == 0:
                out[0, place], out[1, place] = one.load[j], one.load_derivative[j]
            elif j == 0:
                out[0, place], out[2, place] = two.load[k], two.load_derivative[k]
        return out[0], out[1], out[2]

    def recover(self, indices: Indices, omegas: tuple[float, float], q: ComplexArray) -> ComplexArray:
        """Return the (len, n_all) motion of all dofs from that of the retained coordinates (len, n)."""
        top = max(max(abs(j), abs(k)) for j, k in indices)
        own: list[ComplexArray | None] = [None] * len(indices)
        for linear, omega, places in (
            (self.first, omegas[0], {j: p for p, (j, k) in enumerate(indices) if k == 0}),
            (self.second, omegas[1], {k: p for p, (j, k) in enumerate(indices) if j == 0 and k}),
        ):
            rows = np.zeros((top + 1, self.n), dtype=complex)
            for h, place in places.items():
                rows[h] = q[place]
            full = linear.recover(omega, rows)
            for h, place in places.items():
                own[place] = full[h]
        for place, (j, k) in enumerate(indices):
            if own[place] is None:
                omega = j * omegas[0] + k * omegas[1]
                wave = self.wave(j, k) if omega >= 0.0 else self.wave(-j, -k)
                row = q[place] if omega >= 0.0 else q[place].conj()
                rows = np.stack([np.zeros_like(row), row])
                found = self.still[wave].recover_change(abs(omega), rows)[1]
                own[place] = found if omega >= 0.0 else found.conj()
        return np.array(own)


@lru_cache(maxsize=2)
def _stiffness(
    side: TorusSide, indices: Indices, omegas: tuple[float, float], rate: float
) -> tuple[ComplexArray, ComplexArray]:
    """Return what `TorusSide.stiffness` does; kept, because a Newton iteration at fixed frequencies asks for it at every step."""
    values = np.zeros((len(indices), side.n, side.n), dtype=complex)
    slopes = np.zeros_like(values)
    values[0] = side.first.condensed(omegas[0], 0).stiffness[0]
    damped: dict[int, DynamicStiffness] = {}
    for place, (j, k) in enumerate(indices):
        if place == 0:
            continue
        omega = j * omegas[0] + k * omegas[1]
        # a frequency below zero is the conjugate of one above that travels the other way
        wave = side.wave(j, k) if omega >= 0.0 else side.wave(-j, -k)
        linear = side.still[wave]
        if k != 0 and rate != 0.0:
            linear = damped.setdefault(wave, linear.with_mass_damping(-rate))
        part = linear.condensed(abs(omega), 1)
        values[place] = part.stiffness[1] if omega >= 0.0 else part.stiffness[1].conj()
        slopes[place] = part.derivative[1] if omega >= 0.0 else -part.derivative[1].conj()
    return values, slopes
