"""Forced responses at many levels from one nonlinear mode."""

from functools import partial

from stickslip.analyses.collected import of_answers
from stickslip.analyses.modal_synthesis.problem import NAME, question_of
from stickslip.analyses.modal_synthesis.records import ModalSynthesis, SynthesisLevel, answer
from stickslip.analyses.modal_synthesis.solve import solve
from stickslip.analyses.modal_synthesis.table import ModalSynthesisTable
from stickslip.analyses.modal_synthesis.verdicts import case_verdicts, tables
from stickslip.assembly.model import Model
from stickslip.study.analysis import Analysis, Case, of_tables
from stickslip.units import HZ


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return the line on the mode that answers."""
    mode = question_of(case, model).mode
    told = (
        "" if mode is None else f"mode {mode.number}, {mode.omega / HZ:.4g} Hz, damping ratio {100 * mode.ratio:+.3g} %"
    )
    return (f"{NAME}: {len(case.settings.modal_synthesis.levels)} levels of {told}",)


MODAL_SYNTHESIS = Analysis(
    name=NAME,
    table=ModalSynthesisTable,
    record=SynthesisLevel,
    key=of_tables("modal_synthesis", "solver"),
    inputs=question_of,
    solve=solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts),
    check=_check,
    summary=tables,
    shared=("solver",),
    answers=(ModalSynthesis,),
)
