"""Basins of attraction: shares of random starts that end on each motion, with confidence limits."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.linear import one_structure
from stickslip.model.modes import normal_modes
from stickslip.response.forced.problem import ForcedProblem
from stickslip.response.system import System
from stickslip.response.time.start import TransientStart, rest
from stickslip.response.time.transient import TimeStepping, TransientResult, integrate

CONFIDENCE = 0.95
PERIODIC = -1  # the motion repeats, but no solution was found for it
APERIODIC = -2  # the motion does not repeat with the period of the load
DIVERGED = -3  # the motion grows without bound
ALIKE = 0.03  # relative distance between harmonics in time and a solution, up to which they are the same motion


@dataclass(frozen=True, eq=False)
class Basins:
    """Motions on which the random starts at one frequency end.

    Parameters
    ----------
    omega
        Frequency of the load, rad/s.
    ends
        (starts,) number of the motion at this frequency on which each start ends. `APERIODIC`: the motion does not
        repeat with the period of the load, or not within the allowed periods; `PERIODIC`: it repeats, but no solution
        was found for it; `DIVERGED`: it grows without bound.
    """

    omega: float
    ends: tuple[int, ...]

    def count(self, motion: int) -> int:
        """Return the number of starts that end on a motion."""
        return self.ends.count(motion)

    def share(self, motion: int) -> float:
        """Return the share of the starts that ends on a motion; NaN without starts."""
        return self.count(motion) / len(self.ends) if self.ends else np.nan

    def interval(self, motion: int) -> tuple[float, float]:
        """Return the 95 % confidence interval of the share of starts that end on a motion."""
        return share_interval(self.count(motion), len(self.ends))


def share_interval(count: int, starts: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Return the binomial confidence interval of Clopper and Pearson (1934).

    It is the interval of the share for `count` out of `starts`; (0, 1) without starts.
    """
    rest_of = 0.5 * (1.0 - confidence)
    low = float(betaincinv(count, starts - count + 1, rest_of)) if count > 0 else 0.0
    high = float(betaincinv(count + 1, starts - count, 1.0 - rest_of)) if count < starts else 1.0
    return low, high


@dataclass(frozen=True, eq=False)
class StartSampler:
    """Sampler of random states about a mean displacement.

    Displacement and velocity of each of the lowest modes are uniform in a disc.

    Parameters
    ----------
    problem
        The forced response.
    omega
        Frequency of the load, rad/s.
    mean
        (n,) mean displacement of all random states, m.
    shapes, omegas, radius
        (n, modes) mass-normalised modes with stuck contacts, (modes,) their frequencies in rad/s, and (modes,) their
        largest amplitudes.
    """

    problem: ForcedProblem
    omega: float
    mean: FloatArray
    shapes: FloatArray
    omegas: FloatArray
    radius: FloatArray

    def draw(self, seed: tuple[int, ...]) -> TransientStart:
        """Return the random state of a seed, with sliders at their initial positions."""
        rng = np.random.default_rng(seed)
        size = self.radius * np.sqrt(rng.uniform(size=self.radius.size))
        turn = rng.uniform(0.0, 2.0 * np.pi, self.radius.size)
        laws = self.problem.system.interface.laws
        begun = rest(self.mean.size, laws)
        moved = self.mean + self.shapes @ (size * np.cos(turn))
        return TransientStart(moved, self.shapes @ (self.omegas * size * np.sin(turn)), begun.states)


def not_marched(system: System) -> str:
    """Return the reason why a system has no equations in time, and no multipliers, here; empty if it has."""
    side = system.structure
    if side.wheel is not None or side.speed_follows_frequency:
        return "a tuned wheel is searched as a travelling wave, its sectors are not marched in time"
    structure = side.of_harmonic(0)
    if side.feedback_of(1) is not None or structure.is_complex:
        return "what vibrates has no real matrices that are the same for all harmonics"
    return (
        "structural damping is defined for vibration at one frequency, not in time"
        if structure.loss is not None
        else ""
    )


def sampler(
    problem: ForcedProblem, omega: float, motions: list[ComplexArray], modes: int, spread: float
) -> StartSampler:
    """Return a sampler of states about the mean of motions (H+1, n), m.

    States reach `spread` times the largest amplitude of the motions in each mode.
    """
    structure = one_structure(problem.system.stuck_structure(), "all motions")
    own = normal_modes(structure, min(modes, structure.n))
    shapes = np.asarray(own.shapes).real
    omegas = np.where(own.squares > 0.0, np.sqrt(np.abs(own.squares)), omega)
    project = shapes.T @ structure.mass
    sizes = [np.sum(np.abs(project @ motion[1:].T), axis=1) for motion in motions]
    mean = np.mean([motion[0].real for motion in motions], axis=0)
    radius = spread * np.max(sizes, axis=0)
    floor = 1e-3 * float(np.max(radius * omegas)) / omegas
    return StartSampler(problem, omega, mean, shapes, omegas, np.maximum(radius, floor))


def in_time(own: StartSampler, start: TransientStart, stepping: TimeStepping) -> TransientResult:
    """Integrate from a state until the motion repeats; report the retained coordinates, then the outputs."""
    system, linear = own.problem.system, own.problem.low.linear
    contacts = system.interface
    watched = np.concatenate([linear.retained, system.outputs])
    return integrate(
        one_structure(system.structure, "all motions"),
        contacts.gap_operator,
        contacts.laws,
        linear.load,
        own.omega,
        watched,
        start,
        stepping,
        weights=contacts.weights,
    )


def drawn(own: StartSampler, seed: int, place: int) -> Iterator[TransientStart]:
    """Yield an endless sequence of states, determined by the seed and the number `place` of the frequency."""
    number = 0
    while True:
        yield own.draw((seed, place, number))
        number += 1
