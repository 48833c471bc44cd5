"""Bounds over residual tractions: benchmark B8, and a thousand motions in time from random states, none of them outside.

The judge is the integrator of `evidence.integrator`, which has laws and steps of its own and none of the balance, its evaluators or the search. The system is that
of B6 with dashpots of 30 N s/m on the damper as well: without them damper modes ring on and hardly a motion settles. Half of the states
are drawn anywhere, half beside periodic motions with random tractions, since large vibrations shake most tractions to the middle of
their interval. A motion counts as periodic whose first harmonic scatters by less than `PERIODIC` over the last third of the periods; others are counted and
not judged, as no bound of periodic motions speaks of them: states are drawn until a thousand motions are periodic.
"""

from dataclasses import dataclass, replace

import numpy as np

from evidence.integrator.transient import TimeStepping, TransientStart, integrate
from evidence.models.lumped import blades_and_damper
from evidence.validation.case_b8_residual_traction import SOURCE as B8
from evidence.validation.case_b8_residual_traction import TABLE
from evidence.validation.compare import Record, bound, digits, record
from stickslip.arrays import FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.parameter import Discretisation
from stickslip.response.residual_tractions import TractionBounds, confirmed, traction_bounds
from stickslip.response.residual_tractions.bounds import _setup
from stickslip.response.residual_tractions.search import sliders_at
from stickslip.response.system import System
from stickslip.units import HZ

CASE = "residual tractions"
JUDGE = "time integration (evidence.integrator)"
HERTZ = (159.0, 160.0, 161.0, 164.0, 215.0, 217.0, 220.0, 228.0)
RUNS = 1000  # periodic ones
MOST = 4  # times as many states that are drawn
STEPS, PERIODS = 256, 200
PERIODIC = 1e-3  # scatter, relative
GOOD_TO = 1e-3  # of an integrated amplitude: scatter, and the error of so few steps
SIZE = 3e-4  # m: of random displacements, and with the frequency of speeds; some five times the vibration
ASIDE = 0.05  # of that, beside a periodic motion
HARMONICS = Discretisation(order=15, samples=512)
ON_SAMPLES = Discretisation(order=5, samples=256, evaluator="intervals")  # as the benchmark


@dataclass(frozen=True, eq=False)
class Outcome:
    """Motions in time at a frequency.

    Attributes
    ----------
    amplitude
        (n,) of the first harmonic of y2, m.
    periodic
        (n,) whether it repeats.
    """

    amplitude: FloatArray
    periodic: FloatArray


def with_dashpots() -> tuple[System, HarmonicLoad]:
    """Return B6 with dashpots on the damper."""
    made, load = blades_and_damper(m=None)
    damping = np.diag([20.0, 20, 20, 20, 30, 30])
    return replace(made, structure=replace(made.structure, damping=damping)), load


def random_motions(made: System, load: HarmonicLoad, omega: float, count: int, random: np.random.Generator) -> Outcome:
    """Integrate from random states until `count` motions are periodic."""
    setup = _setup(made, load, [omega], 0, HARMONICS)
    reference = setup.reference(omega, ())
    laws, gaps = made.interface.laws, made.interface.gap_operator
    found: list[float] = []
    periodic: list[bool] = []
    for k in range(MOST * count):
        if sum(periodic) == count:
            break
        displacement, velocity = random.normal(size=(2, 6)) * SIZE
        traction = np.zeros((2, 2))
        if k % 2:
            shares = np.zeros(reference.sliders.shape)
            shares[:, 0] = random.uniform(-1.0, 1.0, 2)
            near = setup.problem.solved(sliders_at(reference, shares), omega, (reference,))
            motion = (near or reference).coefficients
            orders = np.arange(len(motion))[:, None]
            displacement = motion.real.sum(axis=0) + ASIDE * displacement
            velocity = (1j * orders * motion).real.sum(axis=0) + ASIDE * velocity
            period = setup.problem.at((near or reference).sliders).contacts((near or reference).x, omega)
            traction = period.force[:, :2, 0]
        else:
            displacement[5] += SIZE
            pressed = 3e5 * np.maximum(-(gaps @ displacement)[2::3], 0.0)
            traction[:, 0] = 0.5 * pressed * random.uniform(-1.0, 1.0, 2)
        run = integrate(
            made.structure,
            gaps,
            laws,
            load,
            omega,
            made.outputs[:1],
            TransientStart(displacement, omega * velocity, traction),
            TimeStepping(steps_per_period=STEPS, max_periods=PERIODS),
        )
        found.append(float(abs(run.average[0])))
        periodic.append(bool(run.scatter < PERIODIC))
    return Outcome(np.array(found), np.array(periodic))


def outside(bounds: TractionBounds, outcome: Outcome) -> float:
    """Return by how much the periodic motion that is farthest outside the bounds is so, relative; zero where all are within."""
    own = outcome.amplitude[outcome.periodic]
    below = 1.0 - np.min(own, initial=np.inf) / bounds.least.amplitude
    above = np.max(own, initial=0.0) / bounds.most.amplitude - 1.0
    return float(max(below, above, 0.0))


def in_time_records(runs: int = RUNS) -> list[Record]:
    """Compare the bounds with random motions."""
    made, load = with_dashpots()
    random = np.random.default_rng(17)
    records, within = [], 0
    each = traction_bounds(made, load, [HZ * f for f in HERTZ], 0, HARMONICS)
    for hertz, bounds in zip(HERTZ, each, strict=True):
        outcome = random_motions(made, load, bounds.omega, runs // len(HERTZ), random)
        own = outcome.amplitude[outcome.periodic]
        within += int(
            np.sum((own >= bounds.least.amplitude * (1 - GOOD_TO)) & (own <= bounds.most.amplitude * (1 + GOOD_TO)))
        )
        width = bounds.most.amplitude / bounds.least.amplitude - 1.0
        seen = own.max() / own.min() - 1.0
        print(
            f"{hertz:g} Hz: bounds {bounds.least.amplitude:.5e} to {bounds.most.amplitude:.5e} m ({100 * width:.2g} % wide); {own.size} of "
            f"{outcome.amplitude.size} motions periodic, {own.min():.5e} to {own.max():.5e} m ({100 * seen:.2g} %)"
        )
        records.append(
            bound(
                CASE,
                f"{hertz:g} Hz: how far a periodic motion in time lies outside, relative",
                outside(bounds, outcome),
                GOOD_TO,
                JUDGE,
            )
        )
    records.append(record(CASE, "periodic motions in time within the bounds", within, runs, 0.0, JUDGE))
    return records


def benchmark_records() -> list[Record]:
    """Compare with the extremes of benchmark B8, and the ends at 164 Hz with what other means find."""
    made, load = blades_and_damper()
    records = []
    omegas = [HZ * float(row[0]) for row in TABLE]
    for row, found in zip(TABLE, traction_bounds(made, load, omegas, 0, ON_SAMPLES), strict=True):
        records.append(digits(CASE, f"smallest |y2| at {row[0]} Hz, m", found.least.amplitude, row[1], B8))
        if row[0] == "215":  # the largest lies between the benchmark's starts
            off = max(1.0 - found.most.amplitude / float(row[3]), 0.0)
            records.append(bound(CASE, "largest |y2| at 215 Hz: how far below the benchmark's, relative", off, 0.0, B8))
            continue
        records.append(digits(CASE, f"largest |y2| at {row[0]} Hz, m", found.most.amplitude, row[3], B8))
    (at,) = traction_bounds(made, load, [HZ * 164.0], 0, HARMONICS)
    for name, end in (("smallest", at.least), ("largest", at.most)):
        told = confirmed(made, load, at.omega, end, 0, HARMONICS)
        records.append(
            record(
                CASE,
                f"{name} |y2| at 164 Hz, in time from its tractions, m",
                told.transient,
                end.amplitude,
                3e-4,
                "time integration",
            )
        )
    return records


def run() -> list[Record]:
    """Compare with the benchmark and with a thousand motions in time."""
    return benchmark_records() + in_time_records()
