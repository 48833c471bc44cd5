"""Forced responses at many levels from one nonlinear mode."""

from collections.abc import Iterator, Sequence

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.study.analyses.analysis import Case, Notes, Solved, TextTable
from stickslip.study.analyses.modal_synthesis.dataset import dataset
from stickslip.study.analyses.modal_synthesis.problem import NAME, Question, question_of
from stickslip.study.analyses.modal_synthesis.records import SynthesisLevel
from stickslip.study.analyses.modal_synthesis.solve import solve
from stickslip.study.analyses.modal_synthesis.table import ModalSynthesisTable
from stickslip.study.analyses.modal_synthesis.verdicts import tables
from stickslip.study.analyses.verdict import Verdict, stored
from stickslip.units import HZ


class ModalSynthesisAnalysis:
    """The analysis; see `Analysis` for what its methods promise."""

    name = NAME
    table = ModalSynthesisTable
    record = SynthesisLevel
    linear = False
    checks = ()

    def key(self, case: Case) -> str:
        """Return the tables that the records depend on."""
        return case.as_text("modal_synthesis", "solver")

    def inputs(self, case: Case, model: Model) -> Question:
        """Return the assembled model and what is asked of it."""
        return question_of(case, model)

    def solve(self, inputs: Question, done: Sequence[SynthesisLevel], notes: Notes) -> Iterator[SynthesisLevel]:
        """Yield the levels."""
        return solve(inputs, done, notes)

    def dataset(self, solved: Sequence[Solved]) -> xr.Dataset:
        """Return all cases."""
        return dataset(solved)

    def check(self, case: Case, model: Model) -> tuple[str, ...]:
        """Say which mode answers."""
        mode = self.inputs(case, model).mode
        told = (
            ""
            if mode is None
            else f"mode {mode.number}, {mode.omega / HZ:.4g} Hz, damping ratio {100 * mode.ratio:+.3g} %"
        )
        return (f"{NAME}: {len(case.settings.modal_synthesis.levels)} levels of {told}",)

    def verdicts(self, data: xr.Dataset) -> tuple[Verdict, ...]:
        """Return what was found when the dataset was made."""
        return stored(data.attrs)

    def summary(self, data: xr.Dataset) -> tuple[TextTable, ...]:
        """Return what the terminal prints."""
        return tables(data)


MODAL_SYNTHESIS = ModalSynthesisAnalysis()
