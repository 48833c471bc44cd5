"""Resonance peaks over a design parameter: the analysis ``resonance``."""

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from stickslip.analyses.columns import of_answers
from stickslip.analyses.resonance.problem import Question, more_than, question_of
from stickslip.analyses.resonance.records import Resonances, answer
from stickslip.analyses.resonance.table import ResonanceTable
from stickslip.analyses.resonance.verdicts import case_verdicts, tables
from stickslip.analyses.vibrating import represented
from stickslip.assembly.model import Model
from stickslip.errors import InputError
from stickslip.response.resonances.first import unmet_peaks
from stickslip.response.resonances.point import PeakPoint, heights, valley
from stickslip.response.resonances.tracking import follow_peaks, later_peaks, peak_curve, represented_as, smallest_peak
from stickslip.study.analysis import Analysis, Case, Notes, Solved, of_tables
from stickslip.study.store.progress import LOG, advance
from stickslip.study.verdict import Verdict, doubt, to_json
from stickslip.units import HZ, millimetres

UNMET = "unmet"  # note: peaks that were followed back and that no sweep at their value reaches
HARMONICS = "harmonics"  # note: the highest peak with more harmonics


MODEL, FIRST, SMALLEST, LAST = "model", "first", "smallest", "last"  # notes


def _inputs(case: Case, model: Model) -> Question:
    """Return the problem of a job; refuse a case whose peaks cannot be followed."""
    question = question_of(case, model)
    LOG.info(f"resonance: peaks of {question.output} over {question.asked.parameter}")
    return question


def _solve(inputs: Question, done: Sequence[PeakPoint], notes: Notes) -> Iterator[PeakPoint]:
    """Yield the missing points of the peaks."""
    if notes.get(LAST) is not None:
        return
    asked = inputs.asked
    notes.put(MODEL, {"verdicts": to_json(map(doubt, inputs.warnings)), "output": inputs.output, **inputs.facts})
    every = list(done)
    try:
        for point in _told(_points_of(inputs, done), inputs):
            every.append(point)
            yield point
    except InputError as error:  # no peak in the range
        notes.put(LAST, {"problem": error.problem})
        return
    # peaks that an interrupted run has followed back from the last value do not count among the first ones
    first = notes.get(FIRST)
    known = [p for p in every if first is None or p.peak < first["peaks"]]
    later = 1 + max((p.peak for p in known), default=-1)
    notes.put(FIRST, {"peaks": later})
    problem = ""
    if asked.values is not None and len(asked.values) > 1:
        try:
            back = later_peaks(inputs.search, asked.values, known, asked.peaks, done)
            for point in _told(back, inputs):
                every.append(point)
                yield point
        except InputError as error:
            problem = error.problem
        between = valley(every, heights(every, asked.values), asked.values)
        unmet = unmet_peaks(inputs.search, every, asked.values, later)
        peaks, values = (np.array([own[k] for own in unmet], dtype=float) for k in (0, 1))
        notes.put(UNMET, {"peak": peaks, "value": values})
        notes.put(SMALLEST, {} if between is None else _smallest(inputs, between))
    notes.put(HARMONICS, _more_harmonics(inputs, every))
    notes.put(LAST, {"problem": problem})


def _points_of(inputs: Question, done: Sequence[PeakPoint]) -> Iterator[PeakPoint]:
    asked, search = inputs.asked, inputs.search
    if asked.values is not None:
        yield from follow_peaks(search, asked.values, asked.peaks, done)
        return
    # an interrupted curve by arc length is computed again from its beginning, since only its points are stored
    for peak in range(asked.peaks):
        known = sum(p.peak == peak for p in done)
        try:
            for i, point in enumerate(peak_curve(search, asked.ends, asked.points, peak)):
                if i >= known:
                    yield point
        except InputError as error:
            if peak == 0 or error.place != "peak":
                raise
            return  # no further peak


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return the line on the parameter and the largest number of peaks."""
    question = question_of(case, model)
    asked = question.asked
    count = len(asked.values) if asked.values else asked.points
    told = f"resonance: {count} values of {asked.parameter}, up to {asked.peaks} peaks each, by {asked.by}"
    if asked.span is not None and callable(question.search.parameter):
        told += "; a span makes the model anew for each trial, which takes minutes where a contact begins to slip at the peak: values are faster"
    return (told,)


def _told(points: Iterator[PeakPoint], inputs: Question) -> Iterator[PeakPoint]:
    first, last = inputs.asked.ends
    for point in points:
        share = abs((point.value - first) / (last - first)) if last != first else 1.0
        state = "" if point.converged else f", {point.status.advice}"
        advance(
            0.9 * min(share, 1.0),
            f"peak {point.peak + 1} at {point.value:.5g}: {point.omega / HZ:.4f} Hz, {millimetres(point.amplitude, 5)}{state}",
        )
        yield point


def _more_harmonics(inputs: Question, points: Sequence[PeakPoint]) -> dict[str, float]:
    """Return the relative change of the highest peak by twice the harmonics and one; NaN if it is not found with them."""
    maxima = [p for p in points if p.converged and p.is_maximum]
    if not maxima:
        return {}
    top = max(maxima, key=lambda p: p.amplitude)
    order = more_than(inputs.asked.harmonics)
    how = represented(order, inputs.search.how.evaluator)
    more = represented_as(inputs.search, top, how)
    # a peak by phase lies below the maximum by its field `below`
    there = top.amplitude * (1.0 + (top.below if np.isfinite(top.below) else 0.0))
    change = more.amplitude / there - 1.0 if more.converged else np.nan
    return {"change": change, "value": top.value, "peak": top.peak, "order": order}


def _smallest(inputs: Question, between: tuple[float, float]) -> dict[str, float]:
    """Return the minimum of the highest peak between two values; empty if it is not found."""
    r = inputs.search
    try:
        best = smallest_peak(r.system, r.load, r.parameter, between, r.omega_range, r.output, r.how)
    except InputError as error:
        LOG.info(f"the lowest peak was not found: {error}")
        return {}
    return {"value": best.value, "amplitude": best.amplitude, "omega": best.omega}


def _dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the peaks of all cases."""
    by_label = {one.case.label: one for one in solved}

    def verdicts(label: str, own: Resonances) -> Sequence[Verdict]:
        one = by_label[label]
        return case_verdicts(label, own, one.notes, one.case.settings.resonance.values or ())

    return of_answers(solved, answer, verdicts, _lost)


def _lost(found: Resonances) -> int:
    """Return the number of points without a solution."""
    return sum(int(np.sum(peak.maximum == -1)) for peak in found.peaks)


RESONANCE = Analysis(
    name="resonance",
    table=ResonanceTable,
    record=PeakPoint,
    key=of_tables("resonance", "solver"),
    inputs=_inputs,
    solve=_solve,
    dataset=_dataset,
    check=_check,
    summary=tables,
    shared=("solver",),
    answers=(Resonances,),
)
