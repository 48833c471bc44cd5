"""Limit cycles: unstable waves bounded by friction, and the stability of the resulting motion."""

from functools import partial

import numpy as np

from stickslip.analyses.collected import of_answers
from stickslip.analyses.forced_response.stability.examination import too_long
from stickslip.analyses.limit_cycle.problem import IN_TIME, question_of
from stickslip.analyses.limit_cycle.records import CycleBranch, LimitCycles, answer
from stickslip.analyses.limit_cycle.solve import solve
from stickslip.analyses.limit_cycle.table import LimitCycleTable
from stickslip.analyses.limit_cycle.verdicts import case_verdicts, tables
from stickslip.assembly.model import Model
from stickslip.reduction.waves import NO_WAVE
from stickslip.study.analysis import Analysis, Case, of_tables


def _lost(found: LimitCycles) -> int:
    """Return the number of amplitudes without a motion."""
    return sum(int(np.count_nonzero(np.isfinite(b.amplitude) & ~np.isfinite(b.damping_ratio))) for b in found.branches)


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return lines on the growing modes, and on stability if it cannot be examined."""
    question = question_of(case, model)
    lines = []
    for wave in question.waves:
        for mode in question.followed(question.modes(wave)):
            of = "" if wave == NO_WAVE else f"wave {wave}, "
            lines.append(f"limit_cycle: {of}mode {mode.number}, damping ratio {100 * mode.ratio:+.3g} %")
    why = too_long(question.model.system, forced=False)
    stability = f"limit_cycle: stability not examined, {why}" if why else ""
    none = "limit_cycle: no mode grows with contacts stuck"
    return tuple(line for line in (*(lines or [none]), stability) if line)


LIMIT_CYCLE = Analysis(
    name="limit_cycle",
    table=LimitCycleTable,
    record=CycleBranch,
    key=of_tables("limit_cycle", "solver"),
    inputs=question_of,
    solve=solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts, lost=_lost),
    check=_check,
    summary=tables,
    shared=("solver",),
    answers=(LimitCycles,),
    checks=(IN_TIME,),
)
