"""Verdicts on a forced response, point by point and case by case."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.chooser import error_text
from stickslip.analyses.forced_response.records.columns import Verdicts, stored
from stickslip.analyses.forced_response.stability.stable_words import said_of
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.margin import margin_to_fatigue
from stickslip.analyses.forced_response.verdicts.rules import (
    LEFT,
    PHYSICS_RULES,
    RULES,
    Finding,
    told_of_model,
    without_place,
)
from stickslip.arrays import IntArray
from stickslip.column import columns_of
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.study.verdict import ALIKE, LEVELS, POINT_LEVELS, UNSTABLE, Level, Verdict, of_all_cases, worst


@dataclass(frozen=True, eq=False)
class Judged:
    """A case with the findings of each rule."""

    label: str
    case: Curve
    findings: tuple[tuple[Finding, ...], ...]

    @property
    def level(self) -> Level:
        """Level of the case: the worst of the findings on the whole case and on its peak."""
        every = (f for own in self.findings for f in own)
        return worst(f.level for f in every if not f.points or self.case.peak in f.points)

    @property
    def of_points(self) -> tuple[IntArray, list[str]]:
        """(n,) index of the level of each point in `POINT_LEVELS`, and the reasons; empty for trusted points."""
        levels = np.zeros(self.case.at.size, dtype=np.int64)
        reasons: list[list[str]] = [[] for _ in levels]
        for found, i in ((f, i) for own in self.findings for f in own for i in f.points):
            levels[i] = max(levels[i], LEVELS.index(found.level))
            reasons[i].append(found.why)
        for i in self.case.unstable:
            if levels[i] < LEVELS.index("wrong"):
                levels[i] = POINT_LEVELS.index(UNSTABLE)
                reasons[i].insert(0, LEFT)
        return levels, ["; ".join(own) for own in reasons]

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Verdicts, the worst first; for a trusted case with the list of checks."""
        found = sorted((v for own in self.findings for v in self._of_rule(own)), reverse=True)
        if self.level == "trusted":
            hz = self.case.peak_hz if self.case.peak >= 0 else None
            found = [Verdict("trusted", self.label, hz, _examined(self.case)), *found]
        return said_once(found)

    def _of_rule(self, found: Sequence[Finding]) -> Iterator[Verdict]:
        """Yield the verdicts of a rule: one on the whole case, and for each level one for its points, at the peak or else at the worst point."""
        whole = [f for f in found if not f.points]
        yield from (Verdict(f.level, self.label, None, f.why, f.remedy) for f in whole)
        for level in LEVELS:
            group = [f for f in found if f.points and f.level == level]
            if group:
                first = max(group, key=self._weight)
                at = self.case.peak if self.case.peak in first.points else first.points[0]
                why = first.why + (self._others(group, first) if len(group) > 1 else "")
                yield Verdict(level, self.label, float(self.case.hz[at]), why, first.remedy)

    def _weight(self, found: Finding) -> tuple[bool, float, float]:
        """Return the rank of a finding: at the peak, then the largest, then the nearest to the peak."""
        apart = np.abs(self.case.hz[list(found.points)] - self.case.peak_hz).min()
        return self.case.peak in found.points, found.size, -float(np.nan_to_num(apart))

    def _others(self, group: Sequence[Finding], first: Finding) -> str:
        """State the number of points with the same finding, and the largest value with its frequency."""
        hz = self.case.hz[sorted({i for f in group for i in f.points})]
        count = f"{hz.size} of {self.case.hz.size} points"
        most = max(group, key=lambda f: f.size)
        told = ""
        if most.value and most is not first:
            told = f", the most at {self.case.hz[most.points[0]]:.2f} Hz ({most.value})"
        return f"; this concerns {count}, {hz.min():.2f} to {hz.max():.2f} Hz{told}"


def said_once(verdicts: Sequence[Verdict]) -> tuple[Verdict, ...]:
    """Return verdicts of a case without clauses that are the whole reason of an earlier verdict."""
    told: list[Verdict] = []
    for v in verdicts:
        known = [before.why for before in told if len(before.why) >= ALIKE]
        told.append(replace(v, why=reduce(lambda why, own: why.replace(f"; {own}", ""), known, v.why)))
    return tuple(told)


def _examined(case: Curve) -> str:
    """List the checks of the peak, stability first, and the missing ones."""
    if case.peak < 0:
        return "nothing to judge"
    peak = case.peak
    because = [
        f" ({without_place(str(row.stability_sentence)).removeprefix('not examined: ')})"
        for point, row in case.examined
        if point == peak and row.stability_verdict == "not examined"
    ]
    said = [f"peak with H = {case.kept[peak]}, {said_of(case.peak_stability)}{''.join(because)}"]
    said += ["exact, as no force acts on the harmonics left out"] * bool(case.exact[peak])
    for value, about in (
        (np.nan if case.exact[peak] else case.own_error[peak], "predicted error"),
        (case.audit[peak], "difference from more harmonics"),
        (case.reference[peak], f"predicted change with up to {JUDGED_MULTIPLE * case.cap} harmonics"),
    ):
        said += [f"{about} {error_text(float(value))}"] * bool(np.isfinite(value))
    said += ["attained in time integration"] * bool(case.attained[peak])
    changes = told_of_model(case)
    return ", ".join(said) + f". It changes {', '.join(changes)}" * bool(changes)


def judged(data: xr.Dataset, labels: Sequence[str]) -> tuple[Judged, ...]:
    """Return the findings of the rules for each case of a finished dataset.

    Parameters
    ----------
    data
        Dataset of `put_together`.
    labels
        Labels of the cases.
    """
    curves = [Curve(data, i) for i in range(len(labels))]
    return tuple(
        Judged(label, curve, tuple(tuple(rule(curve)) for rule in (margin_to_fatigue, *RULES, *PHYSICS_RULES)))
        for label, curve in zip(labels, curves, strict=True)
    )


def verdicts(data: xr.Dataset, labels: Sequence[str]) -> tuple[Verdict, ...]:
    """Return the verdicts of all cases; a verdict common to all cases appears once."""
    return of_all_cases([v for own in judged(data, labels) for v in own.verdicts], labels)


def with_levels(data: xr.Dataset, labels: Sequence[str]) -> dict[str, tuple[str, object]]:
    """Return level of each case and point, and reasons, as variables: dimension and values."""
    every = judged(data, labels)
    of_cases = np.array([LEVELS.index(own.level) for own in every])
    levels = np.zeros(sum(own.case.at.size for own in every), dtype=np.int64)
    if not levels.size:
        return _with_dimensions(Verdicts(case_verdict=of_cases))
    reasons = np.full(levels.size, "", dtype=object)
    for own in every:
        levels[own.case.at], reasons[own.case.at] = own.of_points
    return _with_dimensions(Verdicts(case_verdict=of_cases, verdict=levels, verdict_reason=reasons.astype(str)))


def _with_dimensions(found: Verdicts) -> dict[str, tuple[str, object]]:
    dims = columns_of(Verdicts)
    return {name: (dims[name].along[0], values) for name, values in stored(found).items()}
