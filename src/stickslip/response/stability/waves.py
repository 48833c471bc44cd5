"""Disturbances of the motion of a whole wheel as travelling waves, to find the growing nodal diameter."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability.multipliers import period_matrix
from stickslip.response.system import System
from stickslip.response.time.sectors import all_in_time

FELT = 1e-12  # multiplier over the largest, below which the state is forgotten within the period


@dataclass(frozen=True, eq=False)
class WaveDisturbance:
    """Disturbance of a motion of all sectors.

    Parameters
    ----------
    multiplier
        Floquet multiplier: growth in a period.
    wave
        Wave number with the largest share in the shape. A disturbance of a travelling motion also contains the
        combinations of this wave with the harmonics of the motion.
    share
        Share of this wave in the squared norm of the shape.
    omega
        Frequency of the disturbance, rad/s.
    """

    multiplier: complex
    wave: int
    share: float
    omega: float

    def nodal_diameter(self, sectors: int) -> int:
        """Return the nodal diameter of the wave."""
        return min(self.wave, sectors - self.wave)


@by_one_thread
def point_disturbances(problem: ForcedProblem, point: ForcedPoint) -> list[WaveDisturbance]:
    """Return the disturbances of a forced motion of a wheel as solved; see `wave_disturbances`."""
    gaps = point.coefficients @ problem.low.interface.gap_operator.T
    return wave_disturbances(problem.system, gaps, point.omega)


@by_one_thread
def wave_disturbances(system: System, gaps: ComplexArray, omega: float) -> list[WaveDisturbance]:
    """Return the disturbances of a motion of all sectors, the fastest growing first; none if they are unknown.

    Parameters
    ----------
    system
        System with a tuned wheel and all its waves.
    gaps
        (H+1, 3 n_contacts) complex coefficients of the gaps of one sector, m.
    omega
        Frequency of the motion, rad/s.
    """
    own = all_in_time(system, gaps)
    found = period_matrix(own, omega)
    if found is None:
        return []
    modes, matrix, shares = found
    sectors = own.sectors
    values, vectors = np.linalg.eig(matrix)
    values = values**shares
    n = modes.n
    moved = _by_wave(modes.basis @ vectors[:n], sectors)
    rate = _by_wave(omega * (modes.basis @ (modes.speed[:, None] * vectors[n : 2 * n])), sectors)
    order = np.argsort(-np.abs(values), kind="stable")
    felt = order[np.abs(values[order]) > FELT * np.abs(values[order[0]])]
    return [_described(complex(values[i]), moved[:, :, i], rate[:, :, i], sectors) for i in felt]


def growing_wave(disturbances: Sequence[WaveDisturbance], modulus: float) -> WaveDisturbance | None:
    """Return the disturbance whose multiplier has this modulus; None without disturbances."""
    if not disturbances or not np.isfinite(modulus):
        return None
    return min(disturbances, key=lambda d: abs(abs(d.multiplier) - modulus))


def _by_wave(rows: ComplexArray, sectors: int) -> ComplexArray:
    """Return the waves (n_s, p, k) of rows (n_s p, k) given sector by sector."""
    return np.asarray(np.fft.fft(rows.reshape(sectors, -1, rows.shape[1]), axis=0) / sectors)


def _described(multiplier: complex, moved: ComplexArray, rate: ComplexArray, sectors: int) -> WaveDisturbance:
    """Return the disturbance of a complex shape, or of its conjugate, whichever has a positive frequency."""
    size = np.sum(np.abs(moved) ** 2, axis=1)
    at, total = int(np.argmax(size)), float(np.sum(size))
    if total == 0.0:
        return WaveDisturbance(multiplier, 0, 0.0, 0.0)
    omega = float(np.sum(np.conj(moved[at]) * rate[at]).imag / size[at])
    wave = at if omega >= 0.0 else (sectors - at) % sectors
    share = float(size[at]) / total
    return WaveDisturbance(multiplier, wave, share, abs(omega))
