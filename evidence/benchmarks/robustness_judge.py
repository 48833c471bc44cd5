"""Whether a solution of the balance is right: the judge is the time integration of `evidence.integrator`, with laws and steps of its own.

A point is solved again with many harmonics, because the integration knows no truncation, and the integration begins on that solution.
If it stays there, the point is right. If its first periods stay there and later ones leave, the solution is one of the equations but
unstable, or several motions stand beside each other. If already the first period leaves by more than the error of the step and what the
last harmonics still change, the balance is wrong.
"""

from dataclasses import dataclass, replace

import numpy as np

from evidence.integrator.transient import TimeStepping, TransientStart
from evidence.integrator.verlet import start_along
from evidence.models.solving import integrate, integrate_refined
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.forced.response import ForcedPoint, ForcedProblem
from stickslip.solve.newton_method import Newton, newton

ORDERS = (9, 15, 25)
SAMPLES = 1024
STEPS = 1024
PERIODS = 200
AGREES = 2e-3  # relative difference of the first harmonics that needs no other explanation
SURE = 5.0  # times the estimated errors of both


@dataclass(frozen=True, slots=True)
class Judgement:
    """One point judged.

    `default_off` and `off` are the differences of the accepted solution and of that with many harmonics from the integration, `first_off`
    that of the first period; all relative to the amplitude integrated.
    """

    verdict: str
    frequency_hz: float
    order: int
    amplitude: float
    default_off: float = float("nan")
    off: float = float("nan")
    first_off: float = float("nan")
    tolerance: float = float("nan")

    @property
    def sentence(self) -> str:
        """What was found."""
        return (
            f"{self.verdict}: {self.frequency_hz:.6g} Hz, H = {self.order}, amplitude {self.amplitude:.3e} m, differences: accepted "
            f"{self.default_off:.1e}, many harmonics {self.off:.1e}, in the first period {self.first_off:.1e}, explained {self.tolerance:.1e}"
        )


def judge(
    problem: ForcedProblem, load: HarmonicLoad, accepted: list[ForcedPoint], rng: np.random.Generator
) -> list[Judgement]:
    """Judge the highest point and one at random."""
    top = max(accepted, key=problem.amplitude)
    other = accepted[int(rng.integers(len(accepted)))]
    return [judged(problem, load, p) for p in (top, other)]


def judged(problem: ForcedProblem, load: HarmonicLoad, point: ForcedPoint) -> Judgement:
    """Judge one point."""
    amplitude = problem.amplitude(point)
    begin = Judgement("many harmonics not found", point.omega / (2 * np.pi), point.order, amplitude)
    ladder = with_many(problem, point)
    if ladder is None:
        return begin
    before, many = ladder
    outputs = problem.system.outputs[:1]
    motion = problem.low.linear.recover(point.omega, many)
    system = problem.system
    laws, gaps = system.interface.laws, system.interface.gap_operator
    start = start_along(motion, point.omega, gaps, laws)
    common = (system.structure, gaps, laws, load, point.omega, outputs)
    once = one_period(common, start)
    found = integrate_refined(*common, start=start, stepping=TimeStepping(steps_per_period=STEPS, max_periods=PERIODS))
    true = complex(found.first_harmonic[0])
    if not np.isfinite(true):
        return replace(begin, verdict="integration overflowed")
    ours, accepted, fewer = (
        complex(problem.low.linear.recover(point.omega, q)[1, outputs[0]]) for q in (many, point.coefficients, before)
    )
    size = abs(true)
    explained = max(AGREES, SURE * (found.error + abs(ours - fewer) / size))
    result = replace(
        begin,
        default_off=abs(accepted - true) / size,
        off=abs(ours - true) / size,
        first_off=abs(once - ours) / size,
        tolerance=explained,
    )
    return replace(result, verdict=verdict(result, settled=found.fine.settled))


def verdict(found: Judgement, *, settled: bool) -> str:
    """Say what the differences mean."""
    if found.off <= found.tolerance:
        return "agrees"
    if found.first_off <= max(AGREES, 0.2 * found.off):
        return "unstable, or beside another motion" if settled else "left for no periodic motion"
    return "wrong"


def with_many(problem: ForcedProblem, point: ForcedPoint) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the solutions with the last two numbers of harmonics; None if one was not found."""
    known, before = point.coefficients, point.coefficients
    for order in ORDERS:
        balance = replace(problem.high, samples=SAMPLES).with_order(order)
        solution = newton(
            lambda v, b=balance: b.linearise(v, point.omega), balance.unknowns(known), Newton(max_iterations=60)
        )
        if not solution.status.converged:
            return None
        before, known = known, balance.coefficients(solution.x)
    return before, known


def one_period(common: tuple, start: TransientStart) -> complex:  # type: ignore[type-arg]
    """Return the first harmonic of the first period from `start`, with fine steps."""
    stepping = TimeStepping(steps_per_period=8 * STEPS, max_periods=2)
    found = integrate(*common, start=start, stepping=stepping)
    return complex(found.harmonics[1, 0])
