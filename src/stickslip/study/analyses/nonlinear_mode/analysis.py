"""Nonlinear modes: frequency and damping ratio over amplitude and energy."""

from collections.abc import Iterator, Sequence

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.study.analyses.analysis import Case, Notes, Solved, TextTable
from stickslip.study.analyses.nonlinear_mode.dataset import dataset
from stickslip.study.analyses.nonlinear_mode.problem import NAME, Question, question_of
from stickslip.study.analyses.nonlinear_mode.records import ModeRecord
from stickslip.study.analyses.nonlinear_mode.solve import solve
from stickslip.study.analyses.nonlinear_mode.table import NonlinearModeTable
from stickslip.study.analyses.nonlinear_mode.verdicts import tables
from stickslip.study.analyses.verdict import Verdict, stored
from stickslip.study.analyses.vibrating import ONE
from stickslip.units import HZ


class NonlinearModeAnalysis:
    """The analysis; see `Analysis` for what its methods promise."""

    name = NAME
    table = NonlinearModeTable
    record = ModeRecord
    linear = False
    checks = ()

    def key(self, case: Case) -> str:
        """Return the tables that the records depend on."""
        return case.as_text("nonlinear_mode", "solver")

    def inputs(self, case: Case, model: Model) -> Question:
        """Return the assembled model and what is asked of it."""
        return question_of(case, model)

    def solve(self, inputs: Question, done: Sequence[ModeRecord], notes: Notes) -> Iterator[ModeRecord]:
        """Yield what is found along the modes."""
        return solve(inputs, done, notes)

    def dataset(self, solved: Sequence[Solved]) -> xr.Dataset:
        """Return all cases."""
        return dataset(solved)

    def check(self, case: Case, model: Model) -> tuple[str, ...]:
        """Say which modes are followed."""
        question = self.inputs(case, model)
        each = [(wave, mode) for wave in question.waves for mode in question.followed(wave)]
        return tuple(
            f"{NAME}: {'' if wave == ONE else f'wave {wave}, '}mode {mode.number}, {mode.omega / HZ:.4g} Hz, damping ratio {100 * mode.ratio:+.3g} %"
            for wave, mode in each
        )

    def verdicts(self, data: xr.Dataset) -> tuple[Verdict, ...]:
        """Return what was found when the dataset was made."""
        return stored(data.attrs)

    def summary(self, data: xr.Dataset) -> tuple[TextTable, ...]:
        """Return what the terminal prints."""
        return tables(data)


NONLINEAR_MODE = NonlinearModeAnalysis()
