"""Bounds of the response over residual tractions, over frequencies and at the resonance."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from stickslip.analyses.columns import of_answers
from stickslip.analyses.residual_tractions.problem import MOTIONS, Question, cost_of, question_of
from stickslip.analyses.residual_tractions.records import ResidualTractions, TractionRecord, answer, to_record
from stickslip.analyses.residual_tractions.table import ResidualTractionsTable
from stickslip.analyses.residual_tractions.verdicts import case_verdicts, tables
from stickslip.assembly.model import Model
from stickslip.contact.initial_sliders import starts_of
from stickslip.response.residual_tractions.bounds import (
    Confirmation,
    End,
    TractionBounds,
    confirmed,
    resonance_bounds,
    traction_bounds,
)
from stickslip.study.analysis import Analysis, Case, Notes, of_tables
from stickslip.study.store.progress import advance
from stickslip.units import HZ, millimetres_between

TOPS: tuple[End, End] = ("least", "most")


def _lost(found: ResidualTractions) -> int:
    """Return the number of frequencies without a motion."""
    return sum(bool(np.isnan(point.reference_amplitude)) for point in found.points)


def _solve(inputs: Question, done: Sequence[TractionRecord], notes: Notes) -> Iterator[TractionRecord]:
    """Yield the bounds at each frequency, then at the resonance of each bound."""
    told = {
        "output": inputs.model.output_labels[0],
        "excitation_n": inputs.excitation,
        "harmonics": inputs.asked.harmonics,
    }
    notes.put("model", dict(inputs.facts) | told)
    found = list(done)
    for record in _along(inputs, [r for r in done if r.stage == "point"]):
        found.append(record)
        yield record
    known = [r.bounds for r in found if r.stage == "point"]
    if not any(b.converged for b in known):
        return
    tops = {r.stage: r.bounds for r in found if r.stage != "point"}
    for end in TOPS:
        if end not in tops:
            tops[end] = _resonance(inputs, known, end)
            yield to_record(tops[end], end)
    if inputs.asked.in_time and notes.get("confirmed") is None:
        notes.put("confirmed", _confirmed(inputs, [tops[end] for end in TOPS]))


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return the line on the number of springs with an initial traction, and on the cost."""
    question = question_of(case, model)
    starts = starts_of(question.model.system.interface)
    springs = int(np.count_nonzero(starts.stiffness > 0.0))
    cost = cost_of(model, question.asked)
    counted = f"{springs} tangential springs that may keep a traction, {question.asked.points} frequencies"
    seconds = f"{cost.least_seconds:.1g} to {cost.most_seconds:.2g} s"
    return (f"residual_tractions: {counted}, some {MOTIONS[0]} to {MOTIONS[1]} motions each, {seconds}",)


def _along(question: Question, done: Sequence[TractionRecord]) -> Iterator[TractionRecord]:
    """Yield the bounds at the missing frequencies."""
    left = question.omegas[len(done) :]
    if not left.size:
        return
    near = next((r.bounds for r in reversed(done) if r.bounds.converged), None)
    model = question.model
    each = traction_bounds(model.system, model.load, left.tolist(), 0, question.discretisation, question.search, near)
    for k, bounds in enumerate(each, len(done) + 1):
        yield to_record(bounds, "point")
        advance(0.9 * k / len(question.omegas), _told(bounds))


def _told(bounds: TractionBounds) -> str:
    if not bounds.converged:
        return f"{bounds.omega / HZ:.2f} Hz: no motion found"
    size = millimetres_between(bounds.least.amplitude, bounds.most.amplitude)
    return f"{bounds.omega / HZ:.2f} Hz: {size}, {bounds.solves} motions"


def _resonance(question: Question, known: Sequence[TractionBounds], end: End) -> TractionBounds:
    model = question.model
    return resonance_bounds(model.system, model.load, known, end, 0, question.discretisation, question.search)


def _confirmed(question: Question, tops: Sequence[TractionBounds]) -> dict[str, object]:
    model = question.model
    each: list[Confirmation] = [
        confirmed(model.system, model.load, top.omega, getattr(top, end), 0, question.discretisation)
        for end, top in zip(TOPS, tops, strict=True)
    ]
    return {
        "resolved_amplitude": np.array([c.resolved for c in each]),
        "time_amplitude": np.array([c.transient for c in each]),
        "time_status": np.array([c.status or "" for c in each], dtype=str),
        "confirmed": np.array([int(c.agrees) for c in each]),
    }


RESIDUAL_TRACTIONS = Analysis(
    name="residual_tractions",
    table=ResidualTractionsTable,
    record=TractionRecord,
    key=of_tables("residual_tractions", "solver"),
    inputs=question_of,
    solve=_solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts, lost=_lost),
    check=_check,
    summary=tables,
    shared=("solver", "limits"),
    answers=(ResidualTractions,),
)
