"""Two harmonic-balance cases of a commercial code's verification manual: ANSYS Mechanical APDL, VM319 and VM320.

VM319 is a chain of six equal sectors, each one mass on a linear and a cubic spring, under engine order 0: here a tuned wheel, solved on
one sector. VM320 is a mass with a Jenkins element. Their data are those of the decks in the repository ansys/pymapdl (MIT).

The manual prints two or three digits. Its amplitudes of VM319 seem read from a graph: an independent solution with the same three
harmonics is 2.8e-3 and 2.6e-3 off, so that they are held to 3e-3, and the independent solution to its digits. Its frequencies are
those of the top of a curve whose logarithm bends by 1.6e5: six digits of the amplitude leave them open to 5e-6.
"""

import numpy as np

from evidence.models.lumped import force_at, lumped, system
from evidence.models.lumped_disks import blade_ring
from evidence.validation.compare import Record, digits
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.reduction.tuned import tuned_wheel
from stickslip.response import PeakPoint, track_peak
from stickslip.response.parameter import Discretisation
from stickslip.response.system import System

CASE = "ANSYS {}"
MANUAL = "ANSYS Mechanical APDL verification manual, {}"
INDEPENDENT = "independent solution with the same harmonics"
GRAPH = 3e-3  # of amplitudes that seem read from a graph
TOP = 5e-6  # of the frequency of a top whose amplitude has six digits
SECTORS, MASS, STIFFNESS, COUPLING, CUBIC = 6, 1e-3, 8.7662, 0.14836, 0.046752
DASHPOT = np.sqrt(8766.2) / 200 * 1e-3
CHAIN = (  # force on each mass; sqrt(A1² + A3²) and its frequency: printed, and of the independent solution
    ("1/8", 0.125, ("2.80", "95.09"), ("2.80785", "95.0940")),
    ("1/4", 0.25, ("5.41", "98.95"), ("5.39593", "98.9521")),
)
OSCILLATOR = (  # harmonics, amplitude and frequency of the peak
    (1, "1.50e-5", "209", MANUAL.format("VM320")),
    (1, "1.497949e-5", "209.211", "closed form of one harmonic"),
    (7, "1.5054e-5", "209.18", INDEPENDENT),
)


def peak(one: System, load: HarmonicLoad, around: tuple[float, float], solved: Discretisation) -> PeakPoint:
    """Return the peak of the first output."""
    (found,) = track_peak(one, load, lambda _: (one, load), [1.0], around, discretisation=solved)
    if not found.converged:
        raise RuntimeError(found.status.advice)
    return found


def chain_peak(force: float) -> tuple[float, float]:
    """Return the largest sqrt(A1² + A3²) of VM319 and its frequency, rad/s.

    It is taken where A1 is largest; A3 is 1/800 and 1/230 of it, and moves the top by less than the digits compared.
    """
    ring = blade_ring(SECTORS, mass=MASS, stiffness=STIFFNESS, coupling=COUPLING, damping=DASHPOT)
    own = np.zeros((3, ring.structure.n))
    own[0, 0] = 1.0
    wheel, gap = tuned_wheel(ring, 0, 3, (own, None), keep=ring.independent, reduce=lambda wave, *_: wave)
    contacts = Interface(("spring",), (CubicSpring(cubic_t=CUBIC),), gap)
    one = System(wheel, contacts, outputs=np.arange(wheel.n))
    sector = np.zeros(ring.structure.n)
    sector[0] = force
    load = HarmonicLoad(np.zeros(wheel.n), {1: wheel.project(sector, 1)})
    # 64 samples are exact for the cube of three harmonics
    solved = Discretisation(order=3, evaluator="march", samples=64)
    found = peak(one, load, (90.0, 100.0), solved)
    first, third = np.abs(found.coefficients[[1, 3], 0])
    return float(np.hypot(first, third)), found.omega


def oscillator_peak(order: int) -> tuple[float, float]:
    """Return the largest first harmonic of VM320 and its frequency, rad/s."""
    gap = np.zeros((3, 1))
    gap[0, 0] = 1.0
    alone = lumped(np.diag([944.6]), np.diag([7700.0]), np.diag([2.4e7]))
    one = system(alone, [Jenkins(k_t=2.4e7, limit=246.048)], gap)
    solved = Discretisation(order=order, evaluator="events")
    found = peak(one, force_at(1, 0, 123.024), (150.0, 260.0), solved)
    return found.amplitude, found.omega


def run() -> list[Record]:
    """Compare the peaks of both cases with what is printed and with independent solutions."""
    records = []
    case, manual = CASE.format("VM319"), MANUAL.format("VM319")
    for name, force, printed, independent in CHAIN:
        size, omega = chain_peak(force)
        what = f"largest sqrt(A1² + A3²), force {name}"
        at = f"its frequency, force {name}, rad/s"
        records += [
            digits(case, what, size, printed[0], manual, GRAPH),
            digits(case, at, omega, printed[1], manual),
            digits(case, what, size, independent[0], INDEPENDENT),
            digits(case, at, omega, independent[1], INDEPENDENT, TOP),
        ]
    case = CASE.format("VM320")
    for order, amplitude, at, source in OSCILLATOR:
        size, omega = oscillator_peak(order)
        records += [
            digits(case, f"peak, H = {order}, m", size, amplitude, source),
            digits(case, f"its frequency, H = {order}, rad/s", omega, at, source),
        ]
    return records
