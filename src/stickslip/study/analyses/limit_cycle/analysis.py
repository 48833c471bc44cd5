"""Motions that nothing drives: unstable waves that friction bounds, where it does, and whether the machine stays there."""

from collections.abc import Iterator, Sequence

import xarray as xr

from stickslip.assembly.model import Model
from stickslip.study.analyses.analysis import Case, Notes, Solved, TextTable
from stickslip.study.analyses.forced_response.stability.examination import too_long
from stickslip.study.analyses.limit_cycle.dataset import dataset
from stickslip.study.analyses.limit_cycle.problem import IN_TIME, Question, question_of
from stickslip.study.analyses.limit_cycle.records import CycleBranch
from stickslip.study.analyses.limit_cycle.solve import solve
from stickslip.study.analyses.limit_cycle.table import LimitCycleTable
from stickslip.study.analyses.limit_cycle.verdicts import tables
from stickslip.study.analyses.verdict import Verdict, stored
from stickslip.study.analyses.vibrating import ONE


class LimitCycleAnalysis:
    """The analysis; see `Analysis` for what its methods promise."""

    name = "limit_cycle"
    table = LimitCycleTable
    record = CycleBranch
    linear = False
    checks = (IN_TIME,)

    def key(self, case: Case) -> str:
        """Return the tables that the records depend on."""
        return case.as_text("limit_cycle", "solver")

    def inputs(self, case: Case, model: Model) -> Question:
        """Return the assembled model and what is asked of it."""
        return question_of(case, model)

    def solve(self, inputs: Question, done: Sequence[CycleBranch], notes: Notes) -> Iterator[CycleBranch]:
        """Yield what is found of each mode."""
        return solve(inputs, done, notes)

    def dataset(self, solved: Sequence[Solved]) -> xr.Dataset:
        """Return all cases."""
        return dataset(solved)

    def check(self, case: Case, model: Model) -> tuple[str, ...]:
        """Say which modes grow, and whether their stability can be examined."""
        question = self.inputs(case, model)
        lines = []
        for wave in question.waves:
            for mode in question.followed(question.modes(wave)):
                of = "" if wave == ONE else f"wave {wave}, "
                lines.append(f"limit_cycle: {of}mode {mode.number}, damping ratio {100 * mode.ratio:+.3g} %")
        why = too_long(question.model.system, forced=False)
        stability = f"limit_cycle: stability not examined, {why}" if why else ""
        none = "limit_cycle: no mode grows with contacts stuck"
        return tuple(line for line in (*(lines or [none]), stability) if line)

    def verdicts(self, data: xr.Dataset) -> tuple[Verdict, ...]:
        """Return what was found when the dataset was made."""
        return stored(data.attrs)

    def summary(self, data: xr.Dataset) -> tuple[TextTable, ...]:
        """Return what the terminal prints."""
        return tables(data)


LIMIT_CYCLE = LimitCycleAnalysis()
