"""Models of the time integration and of shooting, with exact values."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from evidence.models.lumped import blades_and_damper
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Dofs, Structure
from stickslip.response.time.start import TransientStart, start_from_harmonics

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


def load_of(n: int, harmonics: dict[int, list[complex]], static: list[float] | None = None) -> HarmonicLoad:
    amplitudes = {h: np.array(f, dtype=complex) for h, f in harmonics.items()}
    return HarmonicLoad(np.zeros(n) if static is None else np.array(static, dtype=float), amplitudes)


def griffin(integrate: Callable[..., Any], omega: float, stepping: Any) -> Any:
    """The oscillator of `GRIFFIN_EXACT`, by one of the integrators."""
    law = ElasticCoulomb(k_t=0.5, k_w=0.0, k_n=0.0, mu=0.5, preload=0.2)
    structure = structure_of(np.eye(1), 0.02 * np.eye(1), np.eye(1))
    gap = np.array([[1.0], [0.0], [0.0]])
    return integrate(structure, gap, [law], load_of(1, {1: [0.1]}), omega, np.array([0]), stepping=stepping)


def bounce(integrate: Callable[..., Any], steps: int, start: type[Any], stepping: type[Any]) -> float:
    """Largest error over a period, relative to the drop, of a mass that bounces on a unilateral spring.

    `start` and `stepping` are the classes of an integrator for its start and its time steps.
    """
    mass, k, weight, speed = 0.5, 2e4, 4.0, 0.8
    gravity, own = weight / mass, np.sqrt(k / mass)
    sag = weight / k
    amplitude = np.hypot(sag, speed / own)
    touch = 2 / own * (np.pi - np.arctan2(speed / own, sag))  # duration of the contact
    flight = 2 * speed / gravity
    period = touch + flight
    structure = structure_of(mass * np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)))
    law = ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=k, mu=0.0)
    result = integrate(
        structure,
        np.array([[0.0], [0.0], [1.0]]),
        [law],
        load_of(1, {}, [-weight]),
        2 * np.pi / period,
        np.array([0]),
        start(np.zeros(1), np.array([speed]), np.zeros((1, 2))),
        stepping(steps_per_period=steps, max_periods=2),
    )
    t = period * np.arange(1, steps + 1) / steps
    since = t - flight
    exact = np.where(
        t < flight, speed * t - gravity * t**2 / 2, -sag + amplitude * np.cos(own * (since - touch / 2) + np.pi)
    )
    return float(np.max(np.abs(result.outputs[:, 0] - exact)) / (speed**2 / (2 * gravity)))


def wedge() -> tuple[Structure, FloatArray, list[ElasticCoulomb], HarmonicLoad]:
    """Blade, wedge damper, blade in the plane (Ferhatoglu and Zucca's lumped model): x1 y1 x2 y2 xD yD."""
    system, load = blades_and_damper()
    contacts = system.interface
    return system.structure, contacts.gap_operator, list(contacts.laws), load


def stuck_motion(
    structure: Structure, gap: FloatArray, laws: list[ElasticCoulomb], load: HarmonicLoad, omega: float
) -> tuple[ComplexArray, TransientStart]:
    """Static and first-harmonic amplitudes where contacts stick with no mean traction, and the state at t = 0."""
    springs = np.array([[law.k_t, law.k_w, law.k_n] for law in laws])
    stiffness = structure.stiffness + gap.T @ (springs.reshape(-1, 1) * gap)
    dynamic = stiffness - omega**2 * structure.mass + 1j * omega * structure.damping
    normal = gap[2::3]
    static = np.linalg.solve(structure.stiffness + normal.T @ (springs[:, 2:] * normal), load.static)
    motion = np.array([static, np.linalg.solve(dynamic, load.harmonics[1])])
    start = start_from_harmonics(motion, omega, gap, laws)
    # their mean stretches no spring: sliders go where the mean has brought them
    mean = (gap @ static).reshape(-1, 3)[:, :2]
    return motion, replace(start, states=tuple(mean))
