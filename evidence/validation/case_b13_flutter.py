"""B13: flutter of one mass that friction bounds: both limit cycles at one harmonic and at twenty-one, the largest negative damping, and time.

The source's numbers with 21 harmonics are met with 4096 samples a period; exact events differ from them by the sampling.
"""

import numpy as np

from evidence.validation.compare import Record, bound, digits, record
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.curve import (
    AmplitudePoint,
    damping_over_amplitude,
    parameter_over_amplitude,
    slip_amplitude,
)
from stickslip.response.self_excited.cycles import LimitCycle, cycle_stability, limit_cycles
from stickslip.response.self_excited.in_time import march_periods
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.self_excited.problem import SelfExcited, self_excited_motions
from stickslip.response.system import System
from stickslip.response.time.start import start_from_harmonics
from stickslip.solve.newton_method import Newton

SOURCE = "literature benchmark B13"
CASE = "B13 flutter with friction"
LIMIT = 0.1
ONE = (  # c, then amplitude and frequency of the stable and of the unstable cycle, one harmonic
    (-0.01, "0.2040000019", "1.2237986674", "12.5183020", "1.0008525857"),
    (-0.05, "0.2238745559", "1.2130143566", "2.3008975711", "1.0105328175"),
    (-0.10, "0.2656867890", "1.1848086907", "0.9773932296", "1.0361251606"),
)
MANY = (  # the same, harmonics up to 21
    (-0.01, "0.2040575334", "1.2237911854", "12.5224067", "1.0008431708"),
    (-0.05, "0.2244016171", "1.2128768722", "2.3074466413", "1.0103586781"),
    (-0.10, "0.2671717597", "1.1843531238", "0.9840322764", "1.0355537241"),
)
LARGEST, AT = "0.1429382", 2.137483 * 2 * LIMIT
EXACT = Newton(tolerance=1e-13)
PLAIN = Discretisation(order=1, newton=EXACT)
SAMPLED = Discretisation(order=21, samples=4096, evaluator="intervals", newton=EXACT)
STEPS = 4096  # of a period in time


def oscillator(c: float) -> tuple[System, HarmonicLoad]:
    """Return the mass with its damper and a dashpot that feeds it, and no load."""
    gap = np.zeros((3, 1))
    gap[0, 0] = 1.0
    contacts = Interface(("damper",), (Jenkins(k_t=0.5, limit=LIMIT),), gap)
    structure = lumped(np.eye(1), np.eye(1), c * np.eye(1))
    return System(structure, contacts, np.array([0])), HarmonicLoad(np.zeros(1))


def motions(c: float, how: Discretisation) -> SelfExcited:
    """Return the motions of its mode."""
    system, load = oscillator(c)
    return self_excited_motions(system, load, stuck_modes(system, 1)[0], 0, how)


def curve(problem: SelfExcited) -> list[AmplitudePoint]:
    """Return the damping over the amplitude."""
    slips = slip_amplitude(problem)
    return damping_over_amplitude(problem, (0.5 * slips, 100 * slips), 40)


def in_time(cycle: LimitCycle, c: float) -> tuple[float, float]:
    """Return amplitude and frequency that time integration goes to from 5 % beside a cycle."""
    system, load = oscillator(c)
    start = start_from_harmonics(
        1.05 * cycle.coefficients, cycle.omega, system.interface.gap_operator, system.interface.laws
    )
    found = march_periods(system.structure, system.interface, load, cycle.omega, np.array([0]), start, 200, STEPS)
    return float(found.amplitude[0]), float(found.frequency[0])


def run() -> list[Record]:
    """Compare the table, the largest negative damping, multipliers and motions in time."""
    records = []
    for rows, how in ((ONE, PLAIN), (MANY, SAMPLED)):
        for c, *printed in rows:
            problem = motions(c, how)
            small, large = limit_cycles(problem, curve(problem))
            ours = (small.amplitude, small.omega, large.amplitude, large.omega)
            names = ("stable, A", "stable, w", "unstable, A", "unstable, w")
            records += [
                digits(CASE, f"c = {c:g}, H = {how.order}: {name}", own, theirs, SOURCE)
                for name, own, theirs in zip(names, ours, printed, strict=True)
            ]
    problem = motions(-0.1, PLAIN)
    first = limit_cycles(problem, curve(problem))[0]
    at_top = parameter_over_amplitude(problem, oscillator, -0.1, first.unknowns, (first.amplitude, AT), 10)[-1]
    records.append(digits(CASE, "largest negative damping, H = 1", -at_top.level, LARGEST, SOURCE))
    beyond = motions(-1.0001 * float(LARGEST), PLAIN)
    records.append(bound(CASE, "limit cycles beyond it", float(len(limit_cycles(beyond, curve(beyond)))), 0.5, SOURCE))
    few = Discretisation(order=5, samples=512)
    for c in (-0.01, -0.05, -0.1, -0.14):
        problem = motions(c, few)
        small, large = limit_cycles(problem, curve(problem), most_harmonics=95, tolerance=1e-7)
        amplitude, omega = in_time(small, c)
        records.append(record(CASE, f"c = {c:g}: A in time", amplitude, small.amplitude, 1e-4, SOURCE))
        records.append(record(CASE, f"c = {c:g}: w in time", omega, small.omega, 1e-4, SOURCE))
        for cycle, word in ((small, "stable"), (large, "unstable")):
            found = cycle_stability(problem.with_order(cycle.order), cycle)
            wrong = float(found.stability.verdict != word)
            records.append(bound(CASE, f"c = {c:g}: multipliers do not say {word}", wrong, 0.5, SOURCE))
            records.append(
                bound(
                    CASE, f"c = {c:g}, {word}: multiplier along the motion from 1", abs(found.along - 1), 1e-5, SOURCE
                )
            )
    return records
