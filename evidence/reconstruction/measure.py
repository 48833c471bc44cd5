"""What a candidate shows: static loads, responses with one, five and eleven harmonics, motions in time."""

from dataclasses import dataclass, replace

import numpy as np

from evidence.figures.solve import orbit
from evidence.models.two_blades import TwoBlades
from stickslip.arrays import FloatArray
from stickslip.contact.law import OPEN, SLIP
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.harmonic.selection.strategy import ErrorMeasure
from stickslip.response import signals
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.forced.response import forced_response

HZ = 2 * np.pi
HERTZ = (150.0, 190.0)
FREQUENCIES = 41
RATIOS = (250.0, 20.0, 5.0, 2.0)
JUDGED = (20.0, 5.0, 2.0)  # with five and eleven harmonics and in time
FIVE, ELEVEN = 5, 11
ALARM = 0.05
LINES = ("L1", "L2", "R")


@dataclass(frozen=True, eq=False)
class Passage:
    """One ratio with one number of harmonics at equally spaced frequencies: those that were found, by Hz."""

    problem: ForcedProblem
    points: dict[float, ForcedPoint]

    def amplitude(self, hertz: float) -> float:
        """Amplitude of the first output, m."""
        return float(self.problem.amplitude(self.points[hertz]))

    @property
    def peak(self) -> float:
        """Frequency of the largest amplitude, Hz."""
        return max(self.points, key=self.amplitude)


def static_loads(blades: TwoBlades) -> list[float]:
    """Return the normal forces (N) that the pull alone leaves on L1, L2 and R."""
    problem, points = blades.stepped(1e4, (HERTZ[0], HERTZ[0] + 0.5), "always_low", 2)
    force = signals(problem, points[0]).force.mean(axis=-1)
    return [-float(force[_of_line(blades, line), 2].sum()) for line in LINES]


def _of_line(blades: TwoBlades, line: str) -> list[int]:
    return [i for i, n in enumerate(blades.system.interface.names) if n.startswith(line)]


def passage(blades: TwoBlades, ratio: float, order: int) -> Passage:
    """Solve one ratio with `order` harmonics everywhere; with one, `FIVE` are at hand for the alert."""
    load = blades.load(ratio)
    few = order == 1
    sweep = replace(
        blades.sweep,
        omega_range=(HZ * HERTZ[0], HZ * HERTZ[1]),
        low=1,
        high=FIVE if few else order,
        samples=256,
        frequencies=FREQUENCIES,
        peak_points=0,
        selection="always_low" if few else "always_high",
    )
    solved = forced_response(blades.system, load, sweep)
    points = {round(p.omega / HZ, 6): p for p in solved if p.converged}
    return Passage(forced_problem(blades.system, load, sweep), points)


def predicted(few: Passage) -> FloatArray:
    """Return Err1 (eq. 22) of every frequency of a passage with one harmonic."""
    problem = few.problem
    measure = ErrorMeasure(problem.measure.dofs, (1,))
    return np.array(
        [
            jacobian_alert(problem.low, problem.high, problem.low.unknowns(p.coefficients), p.omega, measure).error
            for p in few.points.values()
        ]
    )


def actual(few: Passage, many: Passage) -> FloatArray:
    """Return the actual error (eq. 29) at every frequency of `few`; NaN where `many` was not found."""
    return np.array([_actual(few, many, f) if f in many.points else np.nan for f in few.points])


def _actual(few: Passage, many: Passage, hertz: float) -> float:
    outputs = few.problem.measure.dofs
    first, other = (
        p.problem.low.linear.recover(p.points[hertz].omega, p.points[hertz].coefficients)[1, outputs]
        for p in (few, many)
    )
    return float(np.max(np.abs(first - other) / np.abs(first)))


def moves(found: Passage) -> FloatArray:
    """Return for every frequency whether a contact slips or opens."""
    return np.array([bool(np.any(signals(found.problem, p).state != 0)) for p in found.points.values()])


def at_peak(blades: TwoBlades, found: Passage) -> list[tuple[float, float]]:
    """Return for L1, L2 and R the shares of points and instants that slip and that are open at the peak."""
    state = signals(found.problem, found.points[found.peak]).state
    own = [state[_of_line(blades, line)] for line in LINES]
    return [(float(np.any(s == SLIP, axis=1).mean()), float(np.any(s == OPEN, axis=1).mean())) for s in own]


def in_time(blades: TwoBlades, found: Passage) -> tuple[str, float]:
    """Return the kind of motion that begins at the peak of a passage, and its amplitude in m."""
    motion = orbit(blades, found.problem, found.points[found.peak])
    return motion.motion, motion.amplitude
