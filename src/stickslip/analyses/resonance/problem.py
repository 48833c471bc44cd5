"""The problem of a job of resonance peaks, picklable."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from stickslip.analyses.facts import facts_of
from stickslip.analyses.forced_response.problem import peak_first
from stickslip.analyses.resonance.table import ResonanceTable
from stickslip.analyses.vibrating import refuse_rigid, represented
from stickslip.assembly.assembling import assemble
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import Store
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.contact.compiled import Evaluator
from stickslip.errors import InputError, input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.judging import judging_set
from stickslip.harmonic.peak import PeakProblem
from stickslip.response.parameter import LoadName, Parameter
from stickslip.response.resonances.first import PeakSearch
from stickslip.response.system import System
from stickslip.study.analysis import Case
from stickslip.study.file.tables import OF_THE_MODEL
from stickslip.units import HZ, RPM

VALUE = "value"  # name of the parameter of a Python function
FACTORS = get_args(LoadName)  # parameters that are factors on loads, and no keys


@dataclass(frozen=True, eq=False)
class OfKey:
    """The system as a function of a study key, for use as the parameter of a resonance.

    Parameters
    ----------
    at
        Function that makes the model.
    key
        The key.
    harmonics
        Highest harmonic of the matrices.
    store
        Cache for expensive parts of the model.
    """

    at: Callable[[str, float], Model]
    key: str
    harmonics: int
    store: Store

    def __call__(self, value: float) -> tuple[System, HarmonicLoad]:
        """Return system and load, with the output of the peak first."""
        model = peak_first(assemble(self.at(self.key, value), self.harmonics, self.store))
        return model.system, model.load


@dataclass(frozen=True, eq=False)
class Question:
    """The resonances of one case.

    Parameters
    ----------
    label
        Label of the case.
    asked
        The table [resonance].
    search
        Search of the peaks.
    output
        Name of the output.
    facts
        Facts about the model for the result.
    warnings
        Warnings of the model.
    """

    label: str
    asked: ResonanceTable
    search: PeakSearch
    output: str
    facts: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


def more_than(harmonics: int) -> int:
    """Return the highest harmonic of the reference for the highest peak; it covers the peak's judging set."""
    return judging_set(range(harmonics + 1))[-1]


def question_of(case: Case, model: Model) -> Question:
    """Return the problem of a job; raise all refusals before any long computation.

    Raises
    ------
    InputError
        If the parameter is unknown or changes nothing, one of its values is refused, a contact is rigid, or no load
        drives a harmonic.
    """
    asked: ResonanceTable = case.settings.resonance
    if asked.parameter in case.values:
        raise input_error(
            "resonance.parameter",
            f"is {asked.parameter}, which [vary] varies too: every case would follow the same peaks",
            "Drop it from [vary], or give another parameter.",
        )
    parameter = _parameter(case, asked)
    _accepted(case, asked, parameter)
    refuse_whole("resonance", model)
    assembled = peak_first(assemble(model, more_than(asked.harmonics), case.store))
    refuse_rigid("resonance", assembled)
    evaluator: Evaluator = case.settings.solver.evaluator
    how = represented(asked.harmonics, evaluator)
    lowest, highest = (HZ * f for f in asked.frequency_hz)
    search = PeakSearch(
        assembled.system, assembled.load, parameter, (lowest, highest), asked.by, 0, how, asked.harmonic, asked.periods
    )
    if parameter == "static_load" and not np.any(assembled.load.static):
        raise input_error(
            "resonance.parameter",
            "is static_load, but no static load acts: the factor changes nothing",
            "Give a load with harmonic = 0, or take another parameter.",
        )
    try:
        for value in asked.ends:
            problem = search.problem(value)
        if isinstance(parameter, str) and parameter not in FACTORS:
            _accepted_by_laws(problem, asked)
    except InputError as error:
        raise error.inside("resonance") from None
    facts = facts_of(model, model.speed / RPM)
    return Question(case.label, asked, search, assembled.output_labels[0], facts, tuple(assembled.warnings))


def _accepted(case: Case, asked: ResonanceTable, parameter: Parameter) -> None:
    """Refuse values that the tables of the study refuse."""
    if case.accepts is None or not isinstance(parameter, OfKey):
        return
    for value in asked.values or asked.ends:
        try:
            case.accepts(parameter.key, value)
        except InputError as error:
            raise error.inside("resonance") from None


def _accepted_by_laws(problem: PeakProblem, asked: ResonanceTable) -> None:
    """Refuse values that the contact laws refuse."""
    for value in asked.values or asked.ends:
        try:
            problem.family(value)
        except InputError as error:
            problem_told = f"{asked.parameter} = {value:g} is refused: {error.problem}"
            raise input_error("parameter", problem_told, error.remedy) from None


def _parameter(case: Case, asked: ResonanceTable) -> Parameter:
    """Return the parameter: a name that the solver knows, or the model as a function of the value."""
    name = asked.parameter
    if case.at is None or name in FACTORS or ("." not in name and name != VALUE):
        return name
    if name.partition(".")[0] not in {*OF_THE_MODEL, VALUE}:
        known = ", ".join(sorted(OF_THE_MODEL))
        raise input_error(
            "resonance.parameter",
            f"is {name}, which is no key of the model",
            f"Give one of the tables {known}, or {', '.join(FACTORS)}.",
        )
    return OfKey(case.at, name, more_than(asked.harmonics), case.store)
