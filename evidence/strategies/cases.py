"""The four cases on which strategies of harmonic selection are compared."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from evidence.benchmarks.bench_chain import CASES as CHAINS
from evidence.models.lumped_disks import TIP
from evidence.models.lumped_disks import friction_ring as ring_and_wheel
from evidence.models.two_blades import COARSER, two_blades
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System

HZ = 2 * math.pi
HIGHEST = 10  # harmonics that every case can be solved with: twice those of the reference
RING_STIFFNESS, RING_LIMIT = 2e7, 4.0


@dataclass(frozen=True, eq=False)
class SelectionCase:
    """A system under a load, with a frequency range in which harmonics are to be chosen.

    Attributes
    ----------
    name, title
        For commands and for tables.
    system, load
        What vibrates.
    omega_range
        First and last frequency, rad/s.
    frequencies
        Equally spaced frequencies.
    low, high
        Highest harmonic of the first passage and of the reference; the judge has twice those of the reference.
    samples
        Samples a period of the contact forces.
    """

    name: str
    title: str
    system: System
    load: HarmonicLoad
    omega_range: tuple[float, float]
    frequencies: int
    low: int = 1
    high: int = 5
    samples: int = 256

    def sweep(self, **changes: Any) -> Sweep:
        """Return a sweep over the equally spaced frequencies, without extra points at the peak."""
        sweep = Sweep(
            omega_range=self.omega_range,
            low=self.low,
            high=self.high,
            samples=self.samples,
            frequencies=self.frequencies,
            peak_points=0,
        )
        return replace(sweep, **changes)


def example(name: str, title: str, ratio: float, hertz: tuple[float, float], frequencies: int) -> SelectionCase:
    """Return the example study on its coarse mesh with F_CL/F_HE = `ratio`."""
    case = two_blades(COARSER)
    return SelectionCase(
        name,
        title,
        case.system,
        case.load(ratio),
        (HZ * hertz[0], HZ * hertz[1]),
        frequencies,
        samples=case.sweep.samples,
    )


def two_blades_strong() -> SelectionCase:
    """F_CL/F_HE = 5: the strongest ratio of the example with a periodic motion at all frequencies."""
    title = "two blades, strongly nonlinear (F_CL/F_HE = 5)"
    return example("two_blades_strong", title, 5.0, (160.0, 184.0), 49)


def two_blades_stuck() -> SelectionCase:
    """F_CL/F_HE = 250: the damper sticks or all but sticks."""
    title = "two blades, stuck damper (F_CL/F_HE = 250)"
    return example("two_blades_stuck", title, 250.0, (172.0, 184.0), 49)


def friction_ring() -> SelectionCase:
    """Literature benchmark B9: a tuned blisk of 24 sectors with a friction ring under engine order 2."""
    wheel, operator = ring_and_wheel(HIGHEST)
    contacts = Interface(("ring",), (Jenkins(k_t=RING_STIFFNESS, limit=RING_LIMIT),), operator)
    system = System(wheel, contacts, outputs=wheel.of_harmonic(1).sets["tip"])
    force = np.zeros(6)  # of the sector, with the copies of its neighbour's coordinates
    force[TIP] = 1.0
    load = HarmonicLoad(np.zeros(wheel.n), {1: wheel.project(force, 1)})
    title = "blisk of 24 sectors with a friction ring (B9, slip limit 4 N)"
    return SelectionCase("friction_ring", title, system, load, (HZ * 620.0, HZ * 628.0), 41, samples=256)


def chain() -> SelectionCase:
    """100 masses in a row, Jenkins elements from the first 60 to ground."""
    big = CHAINS["big"][0]
    title = "chain with 60 Jenkins elements"
    return SelectionCase("chain", title, big.system(), big.load(), (8.0, 16.0), 33)


CASES: dict[str, Callable[[], SelectionCase]] = {
    "two_blades_strong": two_blades_strong,
    "two_blades_stuck": two_blades_stuck,
    "friction_ring": friction_ring,
    "chain": chain,
}
