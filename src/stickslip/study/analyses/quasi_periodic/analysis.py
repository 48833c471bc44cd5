"""Motions with two frequencies: two loads, or a forced motion and a second tone that grows by itself."""

import json
from collections.abc import Iterator, Sequence

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.study.analyses.analysis import Case, Notes, Solved, TextTable
from stickslip.study.analyses.quasi_periodic.dataset import dataset
from stickslip.study.analyses.quasi_periodic.problem import NAME, Question, hertz, question_of
from stickslip.study.analyses.quasi_periodic.records import TwoFrequencies
from stickslip.study.analyses.quasi_periodic.solve import solve
from stickslip.study.analyses.quasi_periodic.table import QuasiPeriodicTable
from stickslip.study.analyses.quasi_periodic.verdicts import tables
from stickslip.study.analyses.verdict import Verdict, stored
from stickslip.units import HZ


class QuasiPeriodicAnalysis:
    """The analysis; see `Analysis` for what its methods promise."""

    name = NAME
    table = QuasiPeriodicTable
    record = TwoFrequencies
    linear = False
    checks = ()

    def key(self, case: Case) -> str:
        """Return the table that the records depend on."""
        return json.dumps(case.settings.quasi_periodic.model_dump(mode="json"), sort_keys=True)

    def inputs(self, case: Case, model: Model) -> Question:
        """Return the assembled model and what is asked of it."""
        return question_of(case, model)

    def solve(self, inputs: Question, done: Sequence[TwoFrequencies], notes: Notes) -> Iterator[TwoFrequencies]:
        """Yield the motions."""
        return solve(inputs, done, notes)

    def dataset(self, solved: Sequence[Solved]) -> xr.Dataset:
        """Return all cases."""
        return dataset(solved)

    def check(self, case: Case, model: Model) -> tuple[str, ...]:
        """Say what the second frequency is, and how many unknowns there are."""
        question = self.inputs(case, model)
        first = HZ * question.asked.first_hz[0]
        size = question.problem().balance.size
        if question.driven:
            what = f"loads with {hertz(first)} and {hertz(question.second_frequency(first))}"
        else:
            near = [hertz(m.omega) for _, m in question.growing()[:3]]
            what = f"a second tone, looked for near {', '.join(near) or 'what multipliers say'}"
        return (f"{NAME}: {what}; {size} unknowns at first",)

    def verdicts(self, data: xr.Dataset) -> tuple[Verdict, ...]:
        """Return what was found when the dataset was made."""
        return stored(data.attrs)

    def summary(self, data: xr.Dataset) -> tuple[TextTable, ...]:
        """Return what the terminal prints."""
        return tables(data)


QUASI_PERIODIC = QuasiPeriodicAnalysis()
