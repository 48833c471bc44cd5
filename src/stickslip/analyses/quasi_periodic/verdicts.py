"""Verdicts on motions with two frequencies, and the terminal tables."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from stickslip.analyses.columns import number, record_of, told_apart
from stickslip.analyses.quasi_periodic.records import QuasiPeriodic, TwoFrequencies
from stickslip.study.analysis import TextTable
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, millimetres_between

LARGE = 0.02  # share left out, or difference from time integration, above which any motion is doubtful
SLIP = 5e-3  # the same for the error of the second phase, rad a turn


def case_verdicts(label: str, case: QuasiPeriodic) -> list[Verdict]:
    """Return the verdicts on a case."""
    asked = LARGE if case.accuracy is None else case.accuracy
    found = [v for point in case.points for v in _of_point(label, point, asked)]
    if case.points and not found:
        worst = np.nanmax([0.0, *(point.left_out for point in case.points)])
        why = f"{len(case.points)} motions, combined frequencies left out would change the motion by at most {100 * worst:.2g} %"
        found.append(Verdict("trusted", label, None, f"{why}; compared with time integration"))
    return found


def _of_point(label: str, point: TwoFrequencies, asked: float) -> list[Verdict]:
    hz = point.first / HZ
    if not point.solved:
        remedy = "Give quasi_periodic.second_hz, more harmonics, or nearer frequencies_hz."
        return [Verdict("wrong", label, hz, f"no motion was found: {point.why.removesuffix('.')}", remedy)]
    if point.kind == "no second tone":
        return [_without(label, hz, point.why, point.unknown)]
    found = list(_unexamined(label, point))
    found += _left_out(label, hz, point.left_out, asked)
    if point.slip > SLIP:
        off = f"contacts were marched at a ratio by which the second phase is off by {point.slip:.2g} rad a turn"
        found.append(
            Verdict("doubtful", label, hz, off, "Take frequencies whose ratio is nearer to one of small numbers.")
        )
    return [*found, *_of_time(label, point)]


def _of_time(label: str, point: TwoFrequencies) -> Iterator[Verdict]:
    """Doubt a motion if time integration reaches another one."""
    hz = point.first / HZ
    away = np.nan if point.time_off is None else point.time_off
    if away > LARGE:
        told = f"time integration is {100 * away:.2g} % off"
        remedy = "Lower quasi_periodic.accuracy_percent, or look for another motion."
        yield Verdict("doubtful", label, hz, told, remedy)
    if point.time_largest is None or point.time_least is None or np.isfinite(away):
        return
    largest, least, in_time, least_in_time = (
        float(own[0]) for own in (point.largest, point.least, point.time_largest, point.time_least)
    )
    if max(abs(largest - in_time), abs(least - least_in_time)) / largest > 2 * LARGE:
        told = f"in time the amplitude goes from {millimetres_between(least_in_time, in_time)}, the balance has {millimetres_between(least, largest)}"
        yield Verdict("doubtful", label, hz, told, "The motion may be left, or not be settled in time.")


def _left_out(label: str, hz: float, share: float, asked: float) -> list[Verdict]:
    """Doubt a motion if the combined frequencies left out exceed the requested accuracy or `LARGE`."""
    if share <= min(asked, LARGE):
        return []
    left = f"combined frequencies left out would change the motion by {100 * share:.2g} %"
    if share <= LARGE:
        left += f", more than the {100 * asked:.3g} % that is asked for"
    remedy = "Raise quasi_periodic.most_harmonics, or ask for less: accuracy_percent."
    return [Verdict("doubtful", label, hz, left, remedy)]


def _without(label: str, hz: float, why: str, unknown: str) -> Verdict:
    if not unknown:
        return Verdict("trusted", label, hz, f"there is no second tone: {why}")
    told = f"no second tone was found: {why}; other tones may grow ({unknown.removesuffix('.')})"
    remedy = "Give quasi_periodic.second_hz, or see forced_response --verify."
    return Verdict("doubtful", label, hz, told, remedy)


def _unexamined(label: str, point: TwoFrequencies) -> Iterator[Verdict]:
    """Doubt a motion whose stability was not examined by time integration."""
    hz, told = point.first / HZ, "its stability was not examined"
    if point.time_largest is None:
        remedy = "Set quasi_periodic.in_time = true, of a single structure."
        yield Verdict("doubtful", label, hz, told, remedy)
    elif not np.isfinite(point.time_largest[0]):
        told += ": time integration came to nothing"
        remedy = "Take frequencies whose ratio is nearer to one of small numbers, but not to 1."
        yield Verdict("doubtful", label, hz, told, remedy)


def tables(data: xr.Dataset) -> tuple[TextTable, ...]:
    """Return the terminal tables: the motions of each case."""
    every = ((record_of(QuasiPeriodic, case), head) for case, head in told_apart(data))
    return tuple(_table(found, head) for found, head in every if found.points)


def _table(found: QuasiPeriodic, head: str) -> TextTable:
    rows = [
        (
            number(point.first / HZ),
            number(point.second / HZ),
            point.kind,
            number(1e3 * float(point.least[0])),
            number(1e3 * float(point.largest[0])),
            number(1e3 * float(point.rms[0])),
            str(point.combined),
            number(100 * point.left_out),
        )
        for point in found.points
    ]
    columns = ("first Hz", "second Hz", "", "least mm", "largest mm", "rms mm", "combined", "left out %")
    return TextTable(f"{head}Motions with two frequencies, amplitude of {found.output_name[0]}", columns, tuple(rows))
