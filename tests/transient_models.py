"""Models of the time integration and of shooting, with exact values."""

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.dofs import Dofs
from stickslip.model.structure import Structure
from stickslip.response.time.transient import TransientStart, start_from_harmonics

# Exact event-driven |X1| of the oscillator with a friction damper (after Griffin 1980): m = 1, k = 1, c = 0.02,
# k_d = 0.5, f_c = 0.1, force 0.1 cos Wt; piecewise-linear propagation with root finding of every switch.
GRIFFIN_EXACT = {1.10: 0.56839426, 1.15: 0.46660338, 1.20: 0.38916153}


def structure_of(mass: FloatArray, damping: FloatArray, stiffness: FloatArray) -> Structure:
    n = len(mass)
    return Structure(
        np.asarray(mass, dtype=float),
        np.asarray(damping, dtype=float),
        np.asarray(stiffness, dtype=float),
        Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3))),
    )


def load_of(
    n: int, harmonics: dict[int, list[complex]], static: list[float] | None = None
) -> HarmonicLoad:
    amplitudes = {h: np.array(f, dtype=complex) for h, f in harmonics.items()}
    return HarmonicLoad(
        np.zeros(n) if static is None else np.array(static, dtype=float), amplitudes
    )


def wedge() -> tuple[Structure, FloatArray, list[ElasticCoulomb], HarmonicLoad]:
    """Blade, wedge damper, blade in the plane (Ferhatoglu and Zucca's lumped model): x1 y1 x2 y2 xD yD."""
    stiffness = np.diag([3e5] * 4 + [0.0, 0.0])
    for a, b, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
        stiffness[np.ix_([a, b], [a, b])] += k * np.array([[1, -1], [-1, 1]])
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    gap = np.zeros((6, 6))
    for row, blade, frame in ((0, 0, [[c, s], [s, -c]]), (3, 2, [[c, -s], [-s, -c]])):
        gap[[row, row + 2], 4:] = frame
        gap[[row, row + 2], blade : blade + 2] = -np.array(frame)
    law = ElasticCoulomb(k_t=3e5, k_w=0.0, k_n=3e5, mu=0.5, residual_traction=0.0)
    structure = structure_of(
        np.diag([1, 1, 1, 1, 0.1, 0.1]), np.diag([20.0] * 4 + [0, 0]), stiffness
    )
    force = [0, 20j, -5j, 0, 0, 0]  # (0, -20, 5, 0, 0, 0) sin(ωt)
    return structure, gap, [law, law], load_of(6, {1: force}, [0, 0, 0, 0, 0, 120])


def stuck_motion(
    structure: Structure,
    gap: FloatArray,
    laws: list[ElasticCoulomb],
    load: HarmonicLoad,
    omega: float,
) -> tuple[ComplexArray, TransientStart]:
    """Static and first-harmonic amplitudes where contacts stick with no mean traction, and the state at t = 0."""
    springs = np.array([[law.k_t, law.k_w, law.k_n] for law in laws])
    stiffness = structure.stiffness + gap.T @ (springs.reshape(-1, 1) * gap)
    dynamic = stiffness - omega**2 * structure.mass + 1j * omega * structure.damping
    normal = gap[2::3]
    static = np.linalg.solve(
        structure.stiffness + normal.T @ (springs[:, 2:] * normal), load.static
    )
    motion = np.array([static, np.linalg.solve(dynamic, load.harmonics[1])])
    traction = springs[:, :2] * (gap @ motion[1].real).reshape(-1, 3)[:, :2]
    return motion, start_from_harmonics(motion, omega, traction)
