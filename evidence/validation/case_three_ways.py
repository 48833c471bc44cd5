"""Stability of random motions in three ways: the monodromy, Hill's method with the contact tangent at the exponent sought, and shooting.

    python -m evidence.validation.case_three_ways --motions 200 --minutes 60   # goes on where it was left

`run()` takes the first few motions only. The monodromy and Hill's method judge the same motion, that of the study; shooting finds its own, and
counts where it is that of the balance with 20 harmonics, which the other two then judge as well. Where Hill's method could not count the
exponents right of the axis, or its errors reach across, it says nothing (*not known*).
"""

from collections import Counter
from dataclasses import dataclass
from time import process_time

import numpy as np

from evidence.benchmarks.robustness import OutOfTimeError, at_most
from evidence.models.random_motions import Motion, random_motion
from evidence.validation.case_stability import SAME, growth, spread
from evidence.validation.compare import Record, record
from evidence.validation.going_on import go_on
from stickslip.errors import StickslipError
from stickslip.response.forced.problem import ForcedPoint
from stickslip.response.stability import hill_exponents
from stickslip.response.stability.found import UNIT_TOLERANCE
from stickslip.response.time.shooting import shoot
from stickslip.response.time.start import start_from_harmonics
from stickslip.response.time.transient import TimeStepping

CASE = "Stability in three ways"
SOURCE = "monodromy, Hill's method and shooting"
FEW = 10
HILL_SECONDS, SHOOTING_SECONDS = 30.0, 10.0  # CPU, of a motion
STEPS = 2048  # of a period
ON_CIRCLE = 1e-3  # distance from the unit circle within which verdicts may differ


@dataclass(frozen=True)
class Outcome:
    """One motion: largest moduli of multipliers that are not neutral, by each way; NaN where a way gave none.

    `error` is what Hill's method says of its own; `many_...` are those of the balance with 20 harmonics, which shooting is compared with.
    """

    number: int
    note: str
    dofs: int = 0
    transitions: int = 0
    grazing: int = 0
    monodromy: float = np.nan
    hill: float = np.nan
    error: float = np.nan
    missing: int = -1
    many_monodromy: float = np.nan
    many_hill: float = np.nan
    shooting: float = np.nan
    apart: float = np.nan
    hill_seconds: float = np.nan
    reason: str = ""

    @property
    def hill_knows(self) -> bool:
        """Whether its error does not reach the circle, or is within the distance that is allowed, and it has counted, or found what grows."""
        sure = abs(self.hill - 1.0) > self.error or self.error < ON_CIRCLE
        return sure and (self.missing == 0 or self.hill > 1.0 + self.error)

    @property
    def shot(self) -> bool:
        """Whether shooting has found the motion of the balance."""
        return not np.isnan(self.shooting) and self.apart < SAME and not self.grazing

    @property
    def other(self) -> bool:
        """Whether Hill's verdict is another one than that of the monodromy, away from the circle."""
        return self.hill_knows and differ(self.hill, self.monodromy)

    @property
    def other_shot(self) -> bool:
        """Whether shooting has another verdict than one of the others on the motion with many harmonics, away from the circle."""
        found = (m for m in (self.many_monodromy, self.many_hill) if not np.isnan(m))
        return self.shot and any(differ(self.shooting, m) for m in found)


def differ(one: float, two: float) -> bool:
    """Whether two largest moduli are verdicts that differ, one of them farther from the unit circle than is allowed."""
    apart = (one > 1.0 + UNIT_TOLERANCE) != (two > 1.0 + UNIT_TOLERANCE)
    return apart and max(abs(one - 1.0), abs(two - 1.0)) > ON_CIRCLE


def by_hill(motion: Motion, point: ForcedPoint) -> tuple[float, float, int]:
    """Return the largest modulus by Hill's method, its error, and how many exponents right of the axis it missed; -1: not counted."""
    gaps = point.coefficients @ motion.problem.low.interface.gap_operator.T
    with at_most(HILL_SECONDS):
        found = hill_exponents(motion.system, gaps, point.omega)
    largest = growth(found.multipliers)
    size = np.abs(found.multipliers)
    near = size > 0.9 * largest
    error = float(np.max(2 * np.pi * size[near] * found.errors[near], initial=0.0))
    return largest, error, -1 if found.missing is None else found.missing


def by_shooting(motion: Motion, point: ForcedPoint) -> tuple[float, float] | None:
    """Return the largest modulus by shooting, and how far its motion is from the point's; None where it did not converge."""
    system = motion.system
    amplitudes = motion.problem.low.linear.recover(point.omega, point.coefficients)
    interface = system.interface
    start = start_from_harmonics(amplitudes, point.omega, interface.gap_operator, interface.laws)
    shot = shoot(
        system.plain_structure,
        interface.gap_operator,
        interface.laws,
        motion.load,
        point.omega,
        system.outputs,
        start,
        TimeStepping(STEPS, max_periods=300, tolerance=1e-9),
    )
    if not shot.converged:
        return None
    harmonics = shot.harmonics[: len(amplitudes)]
    mine = amplitudes[: len(harmonics), system.outputs]
    apart = np.max(np.abs(harmonics[1:] - mine[1:])) / np.max(np.abs(mine[1:]))
    return growth(shot.floquet.multipliers), float(apart)


def outcome(seed: int, number: int) -> Outcome:
    """Judge one motion in three ways."""
    motion = random_motion(seed, number)
    if isinstance(motion, str):
        return Outcome(number, motion, reason=motion)
    values: dict[str, float] = {"monodromy": motion.found.floquet.growth}
    reason, missing = [], -1
    began = process_time()
    try:
        values["hill"], values["error"], missing = by_hill(motion, motion.point)
    except (OutOfTimeError, StickslipError, np.linalg.LinAlgError) as error:
        reason.append(f"Hill: {str(error) or 'too long'}")
    values["hill_seconds"] = process_time() - began
    if motion.refined is not None:
        try:
            with at_most(SHOOTING_SECONDS):
                shot = by_shooting(motion, motion.refined)
        except (OutOfTimeError, StickslipError):
            shot = None
        if shot is None:
            reason.append("shooting did not converge")
        else:
            values |= {"shooting": shot[0], "apart": shot[1]}
            values["many_monodromy"] = motion.stability_of(motion.refined).floquet.growth
            try:
                many, _, lost = by_hill(motion, motion.refined)
                values |= {"many_hill": many} if lost == 0 else {}
            except (OutOfTimeError, StickslipError, np.linalg.LinAlgError):
                reason.append("Hill with 20 harmonics gave nothing")
    grazing = motion.found.grazing
    return Outcome(
        number,
        f"{motion.family}, {motion.laws}",
        motion.system.structure.n,
        motion.found.transitions,
        grazing,
        missing=missing,
        reason="; ".join(reason),
        **values,
    )


def table(outcomes: list[Outcome]) -> str:
    """Return what came out, in lines."""
    motions = [o for o in outcomes if o.dofs]
    known, shot = [o for o in motions if o.hill_knows], [o for o in motions if o.shot]
    lines = [
        f"{len(motions)} motions, {sum(o.monodromy > 1 + UNIT_TOLERANCE for o in motions)} of them unstable by the monodromy",
        f"Hill's method: {len(known)} known, other verdicts {sum(o.other for o in known)}; not known {len(motions) - len(known)}",
        f"shooting, the same motion to {SAME:g}: {len(shot)}, other verdicts {sum(o.other_shot for o in shot)}",
        spread(
            "distance of the largest modulus, Hill from monodromy, over that modulus or 1",
            [abs(o.hill - o.monodromy) / max(1.0, o.monodromy) for o in known],
        ),
        spread("CPU seconds of Hill's method", [o.hill_seconds for o in motions]),
    ]
    lines += [
        f"  {o.number}: {o.note}, {o.dofs} dofs, {o.transitions} transitions: monodromy {o.monodromy:.6f}, Hill {o.hill:.6f} ± {o.error:.1e}, missing {o.missing}"
        for o in motions
        if o.other or not o.hill_knows
    ]
    lines += [
        f"  {o.number}: {o.note}: shooting {o.shooting:.6f}, monodromy {o.many_monodromy:.6f}, Hill {o.many_hill:.6f}"
        for o in shot
        if o.other_shot
    ]
    left = Counter(o.reason for o in outcomes if o.reason)
    return "\n".join(lines + [f"  {count} x {reason}" for reason, count in left.most_common()])


def run() -> list[Record]:
    """Compare the first motions."""
    found: list[Outcome] = []
    for number in range(10 * FEW):
        found.append(outcome(1, number))
        if sum(o.hill_knows for o in found) == FEW:
            break
    return [
        record(CASE, "verdicts of Hill's method unlike the monodromy's", sum(o.other for o in found), 0.0, 0.0, SOURCE),
        record(CASE, "verdicts of shooting unlike the others", sum(o.other_shot for o in found), 0.0, 0.0, SOURCE),
    ]


if __name__ == "__main__":
    go_on("three_ways", __doc__, Outcome, outcome, table)
