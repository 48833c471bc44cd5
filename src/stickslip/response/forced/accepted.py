"""Selection of the accepted points among all that were solved."""

from collections.abc import Mapping, Sequence

import numpy as np

from stickslip.response.forced.choices import Stage
from stickslip.response.forced.problem import ForcedPoint

# relative difference of two vibrations below which a branch has returned to the low-order one
ALIKE = 0.25
AUDITS: tuple[Stage, ...] = ("audit", "check", "compared")


def accepted_pairs(points: Sequence[ForcedPoint]) -> list[tuple[ForcedPoint, ForcedPoint | None]]:
    """Return the points of the response, each with the low-order point that it repeats.

    They are in the order of the branch: points of the first passage, replaced by their repeats. Where some repeats of a
    run failed, the branch with many harmonics replaces the run, if it reached the other side. Time integration fills
    remaining gaps. Peak points come last.
    """
    pairs: list[tuple[ForcedPoint, ForcedPoint | None]]
    if any(p.stage == "point" for p in points):
        pairs = [(p, None) for p in points_of_branch(points, "point")]
    else:
        pairs = _of_passages(points)
    best: dict[float, ForcedPoint] = {}
    for p in points:
        if p.stage == "peak" and not (p.omega in best and best[p.omega].converged and _fewer(p, best[p.omega])):
            best[p.omega] = p
    # a peak solved again with more harmonics replaces its earlier point
    again = {omega: p for omega, p in best.items() if p.converged}
    pairs = [(again.pop(p.omega) if p.omega in again and _fewer(p, again[p.omega]) else p, low) for p, low in pairs]
    in_time = {p.omega: p for p in points if p.stage == "in_time"}
    pairs = [(p if p.converged else in_time.get(p.omega, p), low) for p, low in pairs]
    settled = {p.omega: p for p in points if p.stage == "settled" and p.converged}
    pairs = [(settled[p.omega] if p.omega in settled and _fewer(p, settled[p.omega]) else p, low) for p, low in pairs]
    return pairs + [(p, None) for omega, p in best.items() if again.get(omega) is p or not p.converged]


def audits_by_frequency(points: Sequence[ForcedPoint]) -> dict[float, list[ForcedPoint]]:
    """Return the comparison solutions with more harmonics by frequency, rad/s."""
    found: dict[float, list[ForcedPoint]] = {}
    for p in points:
        if p.stage in AUDITS and p.converged:
            found.setdefault(p.omega, []).append(p)
    return found


def _of_passages(points: Sequence[ForcedPoint]) -> list[tuple[ForcedPoint, ForcedPoint | None]]:
    """Return the points of the published passages, each with its point of the first passage.

    Both may be the same point.
    """
    low = points_of_branch(points, "low")
    high = {p.index: p for p in points if p.stage == "high"}
    kept: list[tuple[ForcedPoint, ForcedPoint | None]] = []
    passed = -1
    for first, last in runs_of_repeats(high):
        branch = branch_points(points, first, last)
        end = replaced(branch, low, last)
        if end > passed:
            kept += [(high.get(p.index, p), p) for p in low[passed + 1 : branch[0].index]]
            kept += [(p, None) for p in branch]
            passed = end
    return kept + [(high.get(p.index, p), p) for p in low[passed + 1 :]]


def points_of_branch(points: Sequence[ForcedPoint], stage: Stage) -> list[ForcedPoint]:
    """Return the points of a branch, by their `stage`, without replaced ones."""
    branch: list[ForcedPoint] = []
    for one in points:
        if one.stage == stage:
            branch[one.index :] = [one]
        elif one.stage == "found":
            branch[one.index] = one
    return branch


def _fewer(one: ForcedPoint, other: ForcedPoint) -> bool:
    return one.harmonics.size < other.harmonics.size


def accepted_points(points: Sequence[ForcedPoint]) -> list[ForcedPoint]:
    """Return the points of the response; see `accepted_pairs`."""
    return [point for point, _ in accepted_pairs(points)]


def runs_of_repeats(high: Mapping[int, ForcedPoint]) -> list[tuple[int, int]]:
    """Return first and last index of each run of neighbouring repeats."""
    runs: list[tuple[int, int]] = []
    for index in sorted(high):
        if runs and index == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], index)
        else:
            runs.append((index, index))
    return runs


def branch_points(points: Sequence[ForcedPoint], first: int, last: int) -> list[ForcedPoint]:
    """Return the points of the branch with many harmonics through the run of repeats from `first` to `last`."""
    return [p for p in points if p.stage == "branch" and first <= p.index <= last]


def branch_end(low: Sequence[ForcedPoint], last: int) -> float:
    """Return the end frequency, rad/s, of a branch through a run of repeats.

    It is at the next point without an alert, or at the last point.
    """
    return low[min(last + 1, len(low) - 1)].omega


def replaced(branch: Sequence[ForcedPoint], low: Sequence[ForcedPoint], last: int) -> int:
    """Return the index of the last point of the first passage that a branch replaces; -1 if it replaces none.

    A branch replaces its run if it reaches the frequency and the motion of the next point without an alert. A folded
    branch may pass that frequency on another sheet. It then continues to the end of the range and replaces all points
    that follow.
    """
    if not branch or not branch[-1].converged:
        return -1
    if branch[-1].omega == low[-1].omega:
        return len(low) - 1
    if branch[-1].omega != branch_end(low, last):
        return -1
    if not low[last + 1].converged:
        return last
    quiet = low[last + 1].coefficients[1:]
    here = branch[-1].coefficients[1 : len(quiet) + 1]
    alike = np.linalg.norm(here - quiet) <= ALIKE * np.linalg.norm(quiet)
    return last if alike else -1
