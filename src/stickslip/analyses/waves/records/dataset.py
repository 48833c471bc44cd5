"""Datasets of the analyses by waves."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.columns import variables
from stickslip.analyses.facts import NOTE, ModelFacts, facts_in
from stickslip.analyses.waves.records.results import WaveBranches, WaveFlutter, WaveModes, wave_name
from stickslip.arrays import FloatArray
from stickslip.study.analysis import Solved
from stickslip.study.store.netcdf import stacked, variable
from stickslip.study.verdict import ATTRIBUTE, Verdict, from_json, of_all_cases, to_json

Variables = dict[str, xr.Variable]
Waves = Sequence[WaveModes] | Sequence[WaveBranches] | Sequence[WaveFlutter]
LABELS = {"xyz": ["x", "y", "z"], "part": ["re", "im"]}


def dataset(solved: Sequence[Solved], of_case: Callable[[Solved], tuple[Variables, list[Verdict]]]) -> xr.Dataset:
    """Return the dataset of all cases.

    Parameters
    ----------
    solved
        The cases.
    of_case
        Returns the variables of a case beside those of its model and waves, and its verdicts.
    """
    cases = []
    doubts: list[Verdict] = []
    for one in solved:
        note = one.notes.get(NOTE, {})
        own, said = of_case(one) if one.records else ({}, [])
        cases.append(
            variables(ModelFacts(**facts_in(one.notes))) | _of_waves(one.records, int(note.get("sectors", 1))) | own
        )
        own_doubts = (*from_json(note.get("verdicts", "[]")), *said)
        doubts += [replace(v, case=one.case.label) for v in own_doubts]
    data = stacked(cases)
    sizes = {dim: size for v in data.values() for dim, size in v.sizes.items()}
    coordinates: dict[str, Any] = {"mode": np.arange(1, sizes.get("mode", 0) + 1), **LABELS}
    used = {name: values for name, values in coordinates.items() if name in sizes}
    every = of_all_cases(doubts, [s.case.label for s in solved])
    return xr.Dataset(data, coords=used, attrs={ATTRIBUTE: to_json(every)})


def frequencies(waves: Waves) -> FloatArray:
    """Return the frequencies in Hz of all waves."""
    return np.array([w.frequencies_hz for w in waves])


def growth(waves: Sequence[WaveModes]) -> xr.Variable:
    """Return how the frequencies grow with the speed."""
    grown = np.array([w.growth for w in waves])
    return variable("wave mode", grown, "1", "derivative of the squared frequency by the squared speed")


def _of_waves(waves: Waves, sectors: int) -> Variables:
    named = [wave_name(w.wave_number, sectors) for w in waves]
    return {
        "wave_number": variable(
            "wave", np.array([w.wave_number for w in waves], dtype=np.int64), "1", "wave number of the travelling wave"
        ),
        "nodal_diameter": variable("wave", np.array([d for d, _ in named], dtype=np.int64), "1", "nodal diameter"),
        "wave_kind": variable(
            "wave", np.array([kind for _, kind in named], dtype=str), "1", "standing, forward or backward"
        ),
        "seconds": variable("wave", np.array([w.seconds for w in waves], dtype=float), "s", "time of the computation"),
    }
