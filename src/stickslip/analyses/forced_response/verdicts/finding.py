"""A finding of a rule, and the names of checks and places in it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.study.verdict import Level

IN_TIME = "--verify integrates in time at the peak"


@dataclass(frozen=True)
class Finding:
    """What a rule finds.

    Parameters
    ----------
    level, why, remedy
        As of a `Verdict`; ``trusted`` is told without doubt.
    points
        Positions of its points within the case; none: the case as a whole.
    size
        Of several findings of a rule the largest stands for all.
    value
        Its size as text, where a sentence about several points tells the largest.
    """

    level: Level
    why: str
    remedy: str
    points: tuple[int, ...] = ()
    size: float = 0.0
    value: str = ""


Rule = Callable[[Curve], Iterator[Finding]]


def in_time_there(case: Curve, point: int) -> str:
    """Say how a point is integrated in time: of a sweep it is the peak that is."""
    if point == case.peak or case.range_key == "speed_rpm":
        return IN_TIME
    return f"--verify with forced_response.frequencies_hz = [{case.hz[point]:.2f}] alone integrates in time there"


def without_place(sentence: str) -> str:
    """Return the sentence of a check without the frequency at its head, which a verdict names itself, and without its full stop."""
    head, found, rest = sentence.partition(" Hz: ")
    return (rest if found and head.replace(".", "").isdigit() else sentence).removesuffix(".")
