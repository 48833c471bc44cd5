"""The problem of a search for all motions, picklable."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stickslip.analyses.all_motions.table import AllMotionsTable
from stickslip.analyses.facts import facts_of
from stickslip.analyses.forced_response.problem import peak_first
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.assembling import assemble
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.errors import InputError, input_error
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.harmonic.linear import one_structure
from stickslip.response.all_motions.basins import not_marched
from stickslip.response.all_motions.found import MotionSearch, search_problem
from stickslip.response.forced.problem import ForcedProblem
from stickslip.study.analysis import Case
from stickslip.units import HZ, RPM


@dataclass(frozen=True, eq=False)
class Question:
    """The search of one case.

    Parameters
    ----------
    label
        Label of the case.
    model
        The assembled model; amplitudes belong to its first output.
    search
        Options of the search.
    facts
        Facts about the model for the result.
    """

    label: str
    model: Assembled
    search: MotionSearch
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def problem(self) -> ForcedProblem:
        """The problem of the sweep."""
        return search_problem(self.model.system, self.model.load, self.search)


def question_of(case: Case, model: Model) -> Question:
    """Return the problem of a job; raise all refusals before any long computation.

    Raises
    ------
    InputError
        If a contact is rigid, no load vibrates, or the loads drive a harmonic that is not kept.
    """
    asked: AllMotionsTable = case.settings.all_motions
    refuse_whole("all_motions", model)
    assembled = peak_first(assemble(model, JUDGED_MULTIPLE * asked.harmonics, case.store))
    if not any(np.any(f) for f in assembled.load.harmonics.values()):
        raise input_error(
            "all_motions",
            "no load vibrates: nothing has a period",
            "Add a load with a harmonic, or ask for [limit_cycle].",
        )
    low, high = asked.frequency_hz
    search = MotionSearch(
        omega_range=(HZ * low, HZ * high),
        at=tuple(HZ * f for f in asked.at_hz or ()),
        frequencies=asked.frequencies,
        harmonics=asked.harmonics,
        points=asked.points,
        tries=asked.tries,
        starts=asked.starts,
        modes=asked.modes,
        spread=asked.spread,
        periods=asked.periods,
        most_periods=asked.most_periods,
        steps=asked.steps,
        solves=asked.solves,
        seed=asked.seed,
        evaluator=case.settings.solver.evaluator,
    )
    _refuse_modes(asked, assembled)
    question = Question(case.label, assembled, search, facts_of(model, model.speed / RPM))
    try:
        _ = question.problem
    except InputError as error:
        raise error.inside("all_motions") from None
    return question


def _refuse_modes(asked: AllMotionsTable, model: Assembled) -> None:
    """Refuse a requested number of modes above the degrees of freedom of the model in time."""
    if not_marched(model.system) or not asked.starts or "modes" not in asked.model_fields_set:
        return
    most = one_structure(model.system.structure, "all_motions").n
    if asked.modes > most:
        raise input_error(
            "all_motions.modes",
            f"is {asked.modes}, more than the degrees of freedom of the model as it is integrated in time: {most}",
            f"Give {most} at most, or leave it out.",
        )
