"""Multipliers of random motions against differences of an independent flow map and against shooting.

    python -m evidence.validation.case_stability --motions 200 --minutes 90   # goes on where it was left

`run()` takes the first few motions only. The flow map (`evidence.judges.flow_map`) has the motion with few harmonics as its own, so that it
judges the multipliers to its accuracy; shooting finds the motion itself, and the balance is compared with 20 harmonics.
"""

from collections import Counter
from dataclasses import dataclass
from time import process_time

import numpy as np

from evidence.benchmarks.robustness import OutOfTimeError, at_most
from evidence.judges.flow_map import FlowMap, judged
from evidence.models.random_motions import Motion, random_motion
from evidence.validation.compare import Record, bound, record
from evidence.validation.going_on import go_on
from stickslip.arrays import ComplexArray
from stickslip.errors import StickslipError
from stickslip.response.forced.problem import ForcedPoint
from stickslip.response.stability.found import UNIT_TOLERANCE
from stickslip.response.time.shooting import shoot
from stickslip.response.time.start import start_from_harmonics
from stickslip.response.time.transient import TimeStepping

CASE = "Stability of random motions"
SOURCE = "differences of an independent flow map with located events"
FEW = 10
FLOW_SECONDS, SHOOTING_SECONDS = 40.0, 40.0  # CPU, of a motion
STEPS = (2048, 4096)
CLOSE = 1e-6
SAME = 1e-3
SHARES = (1e-8, 1e-9)  # disturbance over the vibration


@dataclass(frozen=True)
class Outcome:
    """One motion: distances of multipliers over the largest modulus, and these moduli; NaN where there is no comparison.

    `judge` is what the flow map's multipliers change by with disturbances a tenth as large, `apart` how far the motion that shooting finds
    is from the balance with 20 harmonics, relative to the outputs' vibration.
    """

    number: int
    note: str
    dofs: int
    transitions: int
    resting: int
    grazing: int
    ours: float = np.nan
    flow: float = np.nan
    off_flow: float = np.nan
    judge: float = np.nan
    refined: float = np.nan
    shooting: float = np.nan
    off_shooting: float = np.nan
    apart: float = np.nan
    seconds: float = np.nan
    reason: str = ""

    @property
    def by_flow(self) -> bool:
        """Whether the flow map judges: its derivative has two sides where a spring only grazes its limit."""
        return not np.isnan(self.off_flow) and not self.grazing

    @property
    def judged(self) -> bool:
        """Whether it knows the multipliers well enough."""
        return self.by_flow and self.judge < CLOSE

    @property
    def shot(self) -> bool:
        """Whether shooting has found the same motion."""
        return not np.isnan(self.off_shooting) and self.apart < SAME and not self.grazing

    @property
    def disagrees(self) -> bool:
        """Whether the flow map has another verdict."""
        return self.by_flow and (self.ours > 1 + UNIT_TOLERANCE) != (self.flow > 1 + UNIT_TOLERANCE)

    @property
    def shot_otherwise(self) -> bool:
        """Whether shooting has another verdict."""
        return self.shot and (self.refined > 1 + UNIT_TOLERANCE) != (self.shooting > 1 + UNIT_TOLERANCE)


def distance(found: ComplexArray, expected: ComplexArray) -> float:
    """Return the largest distance of a multiplier from its partner; missing ones are zeros."""
    left = np.append(found, np.zeros(max(0, len(expected) - len(found))))
    right = np.append(expected, np.zeros(max(0, len(found) - len(expected))))
    worst = 0.0
    for value in right:
        nearest = int(np.argmin(np.abs(left - value)))
        worst = max(worst, float(abs(left[nearest] - value)))
        left = np.delete(left, nearest)
    return worst / max(1.0, float(np.max(np.abs(right))))


def growth(multipliers: ComplexArray) -> float:
    """Return the largest modulus of those that are not neutral."""
    return float(np.max(np.abs(multipliers[np.abs(multipliers - 1.0) > UNIT_TOLERANCE]), initial=0.0))


def by_flow_map(motion: Motion) -> list[ComplexArray]:
    """Return the multipliers of differences about the motion as it was solved, with two sizes of disturbances."""
    structure, interface = motion.system.plain_structure, motion.system.interface
    case = judged(
        *(np.asarray(m) for m in (structure.mass, structure.damping, structure.stiffness)),
        interface.gap_operator.toarray(),
        [law.elements() for law in interface.laws],
        interface.factors,
        motion.gaps(motion.point),
        motion.point.omega,
    )
    flow = FlowMap(case)
    began = process_time()
    size = 2 * structure.n + len(flow.sticking)
    flow.image(np.zeros(size))
    needed = 4 * size * (process_time() - began)
    if needed > FLOW_SECONDS:
        raise OutOfTimeError
    return [flow.multipliers(share) for share in SHARES]


def by_shooting(motion: Motion, point: ForcedPoint) -> tuple[ComplexArray, float] | None:
    """Return the multipliers of shooting, extrapolated to a vanishing step, and how far its motion is from the point's; or None."""
    system, problem = motion.system, motion.problem
    amplitudes = problem.low.linear.recover(point.omega, point.coefficients)
    interface = system.interface
    start = start_from_harmonics(amplitudes, point.omega, interface.gap_operator, interface.laws)
    found = []
    for steps in STEPS:
        shot = shoot(
            system.plain_structure,
            interface.gap_operator,
            interface.laws,
            motion.load,
            point.omega,
            system.outputs,
            start,
            TimeStepping(steps, max_periods=300, tolerance=1e-9),
        )
        if not shot.converged:
            return None
        start = shot.final
        found.append(shot.floquet.multipliers)
    left, out = found[0], []
    for value in found[1]:
        nearest = int(np.argmin(np.abs(left - value)))
        out.append(value + (value - left[nearest]) / 3.0)
        left = np.delete(left, nearest)
    harmonics = shot.harmonics[: len(amplitudes)]
    mine = amplitudes[: len(harmonics), system.outputs]
    apart = np.max(np.abs(harmonics[1:] - mine[1:])) / np.max(np.abs(mine[1:]))
    return np.array(out), float(apart)


def outcome(seed: int, number: int) -> Outcome:
    """Compare one motion."""
    began = process_time()
    motion = random_motion(seed, number)
    if isinstance(motion, str):
        return Outcome(number, motion, 0, 0, 0, 0, reason=motion)
    note = f"{motion.family}, {motion.laws}"
    ours = motion.found
    values = {"ours": ours.floquet.growth}
    reason = []
    with_ones = np.append(ours.floquet.multipliers, np.ones(ours.resting))
    try:
        with at_most(2 * FLOW_SECONDS):
            theirs, again = by_flow_map(motion)
        values |= {"flow": growth(theirs), "off_flow": distance(with_ones, theirs), "judge": distance(again, theirs)}
    except (OutOfTimeError, RuntimeError) as error:
        reason.append(f"flow map: {str(error) or 'too long'}")
    if motion.refined is not None:
        try:
            with at_most(SHOOTING_SECONDS):
                shot = by_shooting(motion, motion.refined)
        except (OutOfTimeError, StickslipError):
            shot = None
        own = motion.stability_of(motion.refined)
        if shot is None:
            reason.append("shooting did not converge")
        elif own.grazing:
            reason.append("a spring grazes with 20 harmonics")
        else:
            both = np.append(own.floquet.multipliers, np.ones(own.resting))
            values |= {
                "refined": own.floquet.growth,
                "shooting": growth(shot[0]),
                "off_shooting": distance(both, shot[0]),
                "apart": shot[1],
            }
    return Outcome(
        number,
        note,
        motion.system.structure.n,
        ours.transitions,
        ours.resting,
        ours.grazing,
        **values,
        seconds=process_time() - began,
        reason="; ".join(reason),
    )


def table(outcomes: list[Outcome]) -> str:
    """Return what came out, in lines."""
    motions = [o for o in outcomes if o.dofs]
    flow, shot = [o for o in motions if o.by_flow], [o for o in motions if o.shot]
    sure = [o for o in flow if o.judged]
    others = [o for o in motions if not np.isnan(o.off_shooting) and not o.shot]
    lines = [
        f"{len(motions)} motions, {sum(o.ours > 1 + UNIT_TOLERANCE for o in motions)} of them unstable, {sum(o.grazing > 0 for o in motions)} with springs that graze",
        f"against the flow map: {len(flow)}, other verdicts {sum(o.disagrees for o in flow)}; known to {CLOSE:g} there: {len(sure)}, other verdicts {sum(o.disagrees for o in sure)}",
        f"against shooting, the same motion to {SAME:g}: {len(shot)}, other verdicts {sum(o.shot_otherwise for o in shot)}; another motion: {len(others)}",
        f"within 1e-6, or twice what the flow map is known to: {sum(o.off_flow < max(CLOSE, 2.0 * o.judge) for o in flow)} of {len(flow)}",
        spread("distance from the flow map, where it is known", [o.off_flow for o in sure]),
        spread("distance from shooting, same motion", [o.off_shooting for o in shot]),
    ]
    lines += [
        f"  {o.number}: {o.note}, {o.dofs} dofs, {o.transitions} transitions: {o.ours:.8f}, flow map {o.flow:.8f}, off by {o.off_flow:.1e}, judge {o.judge:.1e}"
        for o in sorted(flow, key=lambda o: -o.off_flow)[:8]
    ]
    lines += [
        f"  {o.number}: {o.note}, {o.dofs} dofs: with 20 harmonics {o.refined:.6f}, shooting {o.shooting:.6f}, off by {o.off_shooting:.1e}, motions apart {o.apart:.1e}"
        for o in sorted(shot, key=lambda o: -o.off_shooting)[:8]
    ]
    left = Counter(o.reason for o in outcomes if o.reason)
    return "\n".join(lines + [f"  {count} x {reason}" for reason, count in left.most_common()])


def spread(name: str, values: list[float]) -> str:
    """Return quantiles in a line."""
    if not values:
        return f"{name}: none"
    parts = np.quantile(values, [0.5, 0.9, 0.99, 1.0])
    return f"{name}: median {parts[0]:.1e}, 90 % {parts[1]:.1e}, 99 % {parts[2]:.1e}, worst {parts[3]:.1e}"


def run() -> list[Record]:
    """Compare the first motions."""
    found: list[Outcome] = []
    for number in range(10 * FEW):
        found.append(outcome(1, number))
        if sum(o.judged for o in found) == FEW:
            break
    flow = [o for o in found if o.judged]
    return [
        bound(CASE, f"multipliers of motion {o.number} ({o.note}), largest distance", o.off_flow, CLOSE, SOURCE)
        for o in flow
    ] + [record(CASE, "other verdicts", sum(o.disagrees for o in flow), 0.0, 0.0, SOURCE)]


if __name__ == "__main__":
    go_on("stability", __doc__, Outcome, outcome, table)
