"""The common part of the analyses by waves."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import xarray as xr

from stickslip.analyses.waves.records.dataset import Variables, dataset
from stickslip.analyses.waves.solve import Question, each_wave
from stickslip.analyses.waves.texts import of_cases
from stickslip.assembly.model import Model
from stickslip.study.analysis import Analysis, Case, Notes, Solved, TextTable
from stickslip.study.verdict import Verdict

Solve = Callable[[Any, Sequence[Any], Notes], Iterator[Any]]


def wave_analysis(
    name: str,
    table: type[Any],
    record: type[Any],
    inputs: Callable[[Case, Model], Any],
    solve: Solve,
    variables: Callable[[Solved], tuple[Variables, list[Verdict]]],
    tables: Callable[[xr.Dataset], Sequence[TextTable]],
    *,
    compared: frozenset[str] = frozenset(),
) -> Analysis:
    """Return an analysis of small vibrations with one record a wave.

    Parameters
    ----------
    name, table, record, inputs, solve
        As in `Analysis`.
    variables
        Returns the variables of a case beside those of its model and waves, and its verdicts.
    tables
        Returns the terminal tables of a case.
    compared
        Keys of the table for reference data, on which no record depends.
    """
    return Analysis(
        name=name,
        table=table,
        record=record,
        key=partial(_key, name=name, left_out=compared),
        inputs=inputs,
        solve=solve,
        dataset=partial(dataset, of_case=variables),
        check=partial(_check, name=name, inputs=inputs),
        summary=partial(of_cases, tables=tables),
        linear=True,
    )


def solved_by(of_wave: Callable[[Question, int], Any]) -> Solve:
    """Return a generator function for the records of unfinished waves."""
    return partial(each_wave, of_wave)


def counted(name: str, asked: Any) -> str:
    """Return the line of ``stickslip check`` with the number of modes."""
    return f"{name}: {asked.n_modes} modes of each of {len(asked.numbers)} waves"


def _key(case: Case, name: str, left_out: frozenset[str]) -> str:
    return str(getattr(case.settings, name).model_dump_json(exclude=set(left_out)))


def _check(case: Case, model: Model, name: str, inputs: Callable[[Case, Model], Any]) -> tuple[str, ...]:
    return (counted(name, inputs(case, model)),)
