"""Starts from free motions: a mode at the amplitude where its frequency equals a harmonic's."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.optimize import brentq

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.linear import one_structure
from stickslip.model.modes import normal_modes
from stickslip.response.continuation.starting_solutions import GrowingLoad, growing_load
from stickslip.response.forced.problem import ForcedProblem

PHASES = 8  # of a free motion relative to the load; a shift by a load period gives the same motion
SPAN = (1e-2, 1e2)  # range of amplitudes, over the known motion
AMPLITUDES = 40
HIGHEST = 3  # highest multiple of the load's frequency
ALIKE = 0.999  # cosine above which two shapes are the same


def mode_starts(
    problem: ForcedProblem,
    balance: HarmonicBalance,
    omega: float,
    periods: int,
    known: Sequence[FloatArray],
    modes: int,
) -> list[FloatArray]:
    """Return starts for motions at an internal or subharmonic resonance, by ascending residual.

    Without damping and load, a mode with stuck or open contacts vibrates freely in one harmonic at amplitudes where the
    force along its shape vanishes. A motion on an isolated branch lies near such a free motion plus the known motion,
    at some phase.

    Parameters
    ----------
    problem
        The forced response.
    balance
        Equations of the motion.
    omega
        Basic frequency of the motion, rad/s.
    periods
        Periods of the load in one period of the motion.
    known
        Unknowns (size,) of the known motions.
    modes
        Number of lowest modes with stuck and with open contacts, each.
    """
    side = problem.system.structure
    if not known or side.wheel is not None or side.speed_follows_frequency:
        return []
    free = growing_load(balance, omega)
    base = min((balance.coefficients(x) for x in known), key=_size)
    starts: list[tuple[float, FloatArray]] = []
    for shape in _shapes(problem, balance, modes):
        for harmonic in _harmonics(balance.order, periods):
            for amplitude in _free_amplitudes(free, base, harmonic, shape):
                for k in range(PHASES):
                    q = base.copy()
                    turn = np.exp(2j * np.pi * k / (PHASES * periods))
                    q[harmonic] += amplitude * turn * shape
                    x = balance.unknowns(q)
                    lack = float(np.linalg.norm(balance.linearise(x, omega).residual))
                    starts.append((lack, x))
    return [x for _, x in sorted(starts, key=lambda start: start[0])]


def _size(q: ComplexArray) -> float:
    return float(np.linalg.norm(q[1:]))


def _harmonics(order: int, periods: int) -> list[int]:
    """Return the harmonics below the load's, and multiples of the load's harmonic."""
    multiples = (periods * m for m in range(1, HIGHEST + 1))
    return [h for h in (*range(1, periods), *multiples) if h <= order]


def _shapes(problem: ForcedProblem, balance: HarmonicBalance, modes: int) -> Iterator[FloatArray]:
    """Yield the distinct shapes (n_retained,) of the lowest modes with stuck and with open contacts.

    The largest entry of a shape is one.
    """
    seen: list[FloatArray] = []
    for side in (problem.system.stuck_structure(), problem.system.structure):
        structure = one_structure(side, "all motions")
        own = normal_modes(structure, min(modes, structure.n))
        for column in np.asarray(own.shapes).real.T:
            shape = column[balance.linear.retained]
            largest = float(np.max(np.abs(shape), initial=0.0))
            if largest == 0.0:
                continue
            unit = shape / np.linalg.norm(shape)
            if not any(abs(unit @ other) > ALIKE for other in seen):
                seen.append(unit)
                yield shape / largest


def _free_amplitudes(free: GrowingLoad, base: ComplexArray, harmonic: int, shape: FloatArray) -> Iterator[float]:
    """Yield the amplitudes, m, at which a shape vibrates freely in a harmonic about the static part of a motion."""
    still = np.zeros_like(base)
    still[0] = base[0]

    def along(amplitude: float) -> float:
        q = still.copy()
        q[harmonic] = amplitude * shape
        residual = free.linearise(free.balance.unknowns(q), 0.0).residual
        return float(free.balance.coefficients(residual)[harmonic].real @ shape)

    # a known motion without vibration gives no scale
    size = float(np.max(np.abs(base[1:]), initial=0.0)) or free.balance.displacement_scale
    tried = size * np.geomspace(*SPAN, AMPLITUDES)
    force = np.array([along(a) / a for a in tried])
    for i in np.flatnonzero(force[:-1] * force[1:] < 0.0):
        yield float(brentq(along, tried[i], tried[i + 1], xtol=1e-6 * tried[i], rtol=1e-6))
