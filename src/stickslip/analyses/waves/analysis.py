"""The common part of the analyses by waves."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.columns import variables
from stickslip.analyses.facts import NOTE, ModelFacts, facts_in
from stickslip.analyses.waves.records import wave_name
from stickslip.analyses.waves.solve import Question, each_wave
from stickslip.analyses.waves.verdicts import contact_notes, summary
from stickslip.assembly.model import Model
from stickslip.study.analysis import Analysis, Case, Notes, Solved, TextTable
from stickslip.study.store.netcdf import stacked
from stickslip.study.verdict import ATTRIBUTE, Verdict, from_json, of_all_cases, to_json

Solve = Callable[[Any, Sequence[Any], Notes], Iterator[Any]]
Answer = Callable[[Solved, Mapping[str, Any]], tuple[ModelFacts, list[Verdict]]]
LABELS = {"xyz": ["x", "y", "z"], "part": ["re", "im"]}


def wave_analysis(
    name: str,
    table: type[Any],
    record: type[Any],
    inputs: Callable[[Case, Model], Any],
    solve: Solve,
    answer: Answer,
    tables: tuple[type[Any], Callable[[Any], Sequence[TextTable]]],
    *,
    compared: frozenset[str] = frozenset(),
) -> Analysis:
    """Return an analysis of small vibrations with one record a wave.

    Parameters
    ----------
    name, table, record, inputs, solve
        As in `Analysis`.
    answer
        Returns the record of a case and its verdicts from the content of its job and the facts of its model.
    tables
        Class of the record of a case, and the function that returns its terminal tables.
    compared
        Keys of the table for reference data, on which no record depends.
    """
    kind, tables_of = tables
    return Analysis(
        name=name,
        table=table,
        record=record,
        key=partial(_key, name=name, left_out=compared),
        inputs=inputs,
        solve=solve,
        dataset=partial(dataset, answer=answer),
        check=partial(_check, name=name, inputs=inputs),
        summary=partial(summary, kind=kind, tables=tables_of),
        answers=(kind,),
        linear=True,
    )


def dataset(solved: Sequence[Solved], answer: Answer) -> xr.Dataset:
    """Return the dataset of all cases; `answer` as in `wave_analysis`."""
    cases = []
    doubts: list[Verdict] = []
    for one in solved:
        facts = facts_in(one.notes)
        own, said = (
            answer(_with_names(one, int(facts.get("sectors", 1))), facts) if one.records else (ModelFacts(**facts), [])
        )
        cases.append(variables(own))
        noted = from_json(one.notes.get(NOTE, {}).get("verdicts", "[]"))
        states = contact_notes(one.case.settings) if own.contacts not in (None, "none") else ()
        doubts += [replace(v, case=one.case.label) for v in (*noted, *states, *said)]
    data = stacked(cases)
    sizes = {dim: size for v in data.values() for dim, size in v.sizes.items()}
    coordinates: dict[str, Any] = {"mode": np.arange(1, sizes.get("mode", 0) + 1), **LABELS}
    used = {name: values for name, values in coordinates.items() if name in sizes}
    every = of_all_cases(doubts, [s.case.label for s in solved])
    return xr.Dataset(data, coords=used, attrs={ATTRIBUTE: to_json(every)})


def _with_names(one: Solved, sectors: int) -> Solved:
    """Add nodal diameters and kinds to the waves."""
    named = ((w, *wave_name(w.wave_number, sectors)) for w in one.records)
    return replace(one, records=tuple(replace(w, nodal_diameter=d, kind=kind) for w, d, kind in named))


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
