"""Nonlinear modes: frequency and damping ratio over amplitude and energy."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from stickslip.analyses.columns import of_answers
from stickslip.analyses.nonlinear_mode.problem import NAME, Question, question_of
from stickslip.analyses.nonlinear_mode.records import END, ModeRecord, NonlinearModes, answer, mode_record
from stickslip.analyses.nonlinear_mode.table import NonlinearModeTable
from stickslip.analyses.nonlinear_mode.verdicts import case_verdicts, tables
from stickslip.analyses.vibrating import as_wave, known_coordinates, mode_name, mode_told
from stickslip.assembly.model import Model
from stickslip.errors import StickslipError
from stickslip.response.nonlinear_modes.backbone import mode_way
from stickslip.response.self_excited.modes import StuckMode
from stickslip.study.analysis import Analysis, Case, Notes, of_tables
from stickslip.study.store.progress import LOG, advance
from stickslip.units import HZ


def solve(question: Question, done: Sequence[ModeRecord], notes: Notes) -> Iterator[ModeRecord]:
    """Yield the missing points of each mode, and its end."""
    notes.put("model", dict(question.facts) | {"output": question.model.output_labels[0]})
    known = known_coordinates(question.model)
    notes.put("coordinates", known | {"concept": question.asked.concept})
    tasks = [(wave, mode) for wave in question.waves for mode in question.followed(wave)]
    for i, (wave, mode) in enumerate(tasks):
        before = [r for r in done if (r.wave_number, r.mode) == (wave, mode.number)]
        if before and before[-1].kind == END:
            continue
        name = mode_told(question.label, wave, mode)
        for record in follow_mode(question, wave, mode, before):
            if record.kind == END:
                LOG.info(f"{name}: {record.problem or record.end}")
            yield record
        advance((i + 1) / len(tasks), name)


def follow_mode(question: Question, wave: int, mode: StuckMode, done: Sequence[ModeRecord]) -> Iterator[ModeRecord]:
    """Yield the missing points of one mode, and its end."""
    resonant: tuple[int, ...] = ()
    end, problem, other = "", "", np.nan
    every = [r.followed for r in done]
    try:
        way = mode_way(
            as_wave(question.model.system, wave),
            question.model.load,
            mode,
            question.dof,
            question.discretisation,
            question.sweep,
        )
        for found in way.follow(tuple(every)):
            every.append(found)
            yield mode_record(wave, mode, way, found)
        mode_found = way.backbone(every)
        end, resonant, other = mode_found.end, mode_found.resonant, mode_found.other_ratio
    except StickslipError as error:
        problem = str(error)
    yield ModeRecord(
        wave,
        mode.number,
        END,
        mode_omega=mode.omega,
        mode_ratio=mode.ratio,
        tolerance=question.sweep.tolerance,
        end=end,
        problem=problem,
        resonant=resonant,
        other_ratio=other,
    )


def _lost(found: NonlinearModes) -> int:
    """Return the number of points without a motion."""
    return sum(int(np.count_nonzero(branch.status > 0)) for branch in found.branches)


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return a line for each mode to follow."""
    question = question_of(case, model)
    each = [(wave, mode) for wave in question.waves for mode in question.followed(wave)]
    return tuple(
        f"{NAME}: {mode_name(wave, mode.number)}, {mode.omega / HZ:.4g} Hz, damping ratio {100 * mode.ratio:+.3g} %"
        for wave, mode in each
    )


NONLINEAR_MODE = Analysis(
    name=NAME,
    table=NonlinearModeTable,
    record=ModeRecord,
    key=of_tables("nonlinear_mode", "solver"),
    inputs=question_of,
    solve=solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts, lost=_lost),
    check=_check,
    summary=tables,
    shared=("solver",),
    answers=(NonlinearModes,),
)
