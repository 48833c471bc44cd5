"""Motions with two frequencies: two loads, or a forced motion and a self-excited second tone."""

from functools import partial

from stickslip.analyses.collected import of_answers
from stickslip.analyses.quasi_periodic.problem import NAME, hertz, question_of
from stickslip.analyses.quasi_periodic.records import QuasiPeriodic, TwoFrequencies, answer
from stickslip.analyses.quasi_periodic.solve import solve
from stickslip.analyses.quasi_periodic.table import QuasiPeriodicTable
from stickslip.analyses.quasi_periodic.verdicts import case_verdicts, tables
from stickslip.assembly.model import Model
from stickslip.study.analysis import Analysis, Case, of_tables
from stickslip.units import HZ


def _lost(found: QuasiPeriodic) -> int:
    """Return the number of frequencies without a motion."""
    return sum(not point.solved for point in found.points)


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return lines on the second frequency and the number of unknowns."""
    question = question_of(case, model)
    first = HZ * question.asked.first_hz[0]
    size = question.problem().balance.size
    if question.driven:
        what = f"loads with {hertz(first)} and {hertz(question.second_frequency(first))}"
    else:
        near = [hertz(m.omega) for _, m in question.growing()[:3]]
        what = f"a second tone, looked for near {', '.join(near) or 'what multipliers say'}"
    return (f"{NAME}: {what}; {size} unknowns at first",)


QUASI_PERIODIC = Analysis(
    name=NAME,
    table=QuasiPeriodicTable,
    record=TwoFrequencies,
    key=of_tables(NAME),
    inputs=question_of,
    solve=solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts, lost=_lost),
    check=_check,
    summary=tables,
    answers=(QuasiPeriodic,),
)
