"""Nonlinear modes: frequency and damping ratio over amplitude and energy."""

from functools import partial

import numpy as np

from stickslip.analyses.collected import of_answers
from stickslip.analyses.nonlinear_mode.problem import NAME, question_of
from stickslip.analyses.nonlinear_mode.records import ModeRecord, NonlinearModes, answer
from stickslip.analyses.nonlinear_mode.solve import solve
from stickslip.analyses.nonlinear_mode.table import NonlinearModeTable
from stickslip.analyses.nonlinear_mode.verdicts import case_verdicts, tables
from stickslip.assembly.model import Model
from stickslip.reduction.waves import NO_WAVE
from stickslip.study.analysis import Analysis, Case, of_tables
from stickslip.units import HZ


def _lost(found: NonlinearModes) -> int:
    """Return the number of points without a motion."""
    return sum(int(np.count_nonzero(branch.status > 0)) for branch in found.branches)


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return a line for each mode to follow."""
    question = question_of(case, model)
    each = [(wave, mode) for wave in question.waves for mode in question.followed(wave)]
    return tuple(
        f"{NAME}: {'' if wave == NO_WAVE else f'wave {wave}, '}mode {mode.number}, {mode.omega / HZ:.4g} Hz, damping ratio {100 * mode.ratio:+.3g} %"
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
