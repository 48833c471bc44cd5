"""The responses of all cases as one labelled dataset, with the measured peaks."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.records.columns import COLUMNS, OWNERS, flags
from stickslip.analyses.forced_response.records.values import Values
from stickslip.analyses.forced_response.verdicts.cases import with_levels
from stickslip.study.models.measured import MeasuredPeaks, Quantity
from stickslip.study.store.netcdf import variable
from stickslip.study.verdict import said

LABELLED = ("output", "retained", "contact", "driven", "mistuned")  # dimensions whose entries have names
SOME = OWNERS.keys() - {"point", "attempt", "alert_point"}  # dimensions of variables that some cases may lack
COUNTED = (
    "harmonic",
    "force_harmonic",
    "motion_harmonic",
    "sample",
    "mode",
    "drawn_node",
    "drawn_harmonic",
    "stress_place",
    "stress_harmonic",
    "worst",
)  # dimensions that may be longer in one case than in another
AXES = {
    "direction": ["t", "w", "n"],
    "tangent": ["t", "w"],
    "part": ["re", "im"],
    "xyz": ["x", "y", "z"],
    "component": ["xx", "yy", "zz", "xy", "yz", "xz"],
}


def put_together(cases: Sequence[Values], labels: Sequence[str]) -> xr.Dataset:
    """Return the dataset of finished cases.

    Cases of different size are padded: with zero for harmonics not kept, else with NaN or -1.

    Parameters
    ----------
    cases
        Values of each case by name. The first case gives everything that all cases share, such as the positions of contacts.
    labels
        Varied keys of each case as text; empty for a study without [vary].
    """
    before = np.cumsum([0, *(int(c["points"]) for c in cases)])
    each = _aligned([_of_case(i, c, int(before[i])) for i, c in enumerate(cases)])
    found = {
        name: _joined([e[name].variable for e in each if name in e], along=column.along[0])
        for name, column in COLUMNS.items()
        if (any if column.along[0] in SOME else all)(name in e for e in each)
    }
    empty = [name for name, variable in found.items() if not _told(name, variable)]
    ordered = {name: variable for name, variable in found.items() if name not in empty}
    used = {d for v in ordered.values() for d in v.dims}
    coordinates: dict[str, Any] = {n: each[0][n].values for n in LABELLED if n in each[0].coords}
    coordinates |= {name: values for name, values in AXES.items() if name in used}
    data = xr.Dataset(ordered, coords=coordinates, attrs=_attributes(cases, labels))
    data = data.assign(with_levels(data, labels))
    for name, own in data.data_vars.items():
        column = COLUMNS[str(name)]
        own.attrs = {"units": column.unit, "long_name": column.meaning} | flags(str(name))
    return data


def _attributes(cases: Sequence[Values], labels: Sequence[str]) -> dict[str, Any]:
    """Return the attributes of the dataset, texts and numbers; the first case gives the selection of harmonics."""
    both = list(zip(labels, cases, strict=True))
    told = [said(label, str(c["choice_sentence"])) for label, c in both if c["choice_sentence"]]
    own: dict[str, Any] = json.loads(cases[0]["attributes"])
    return own | {"alert_explanation": " ".join(told), "failed": sum(int(c["points_failed"]) for c in cases)}


def _joined(each: Sequence[xr.Variable], along: str) -> xr.Variable:
    """Return the variable of all cases, concatenated; a variable common to all cases comes from the first."""
    if along not in ("case", *OWNERS):
        return each[0]
    joined: xr.Variable = xr.Variable.concat(each, along)  # type: ignore[no-untyped-call]
    return joined.astype(str) if joined.dtype.kind == "O" else joined


def _told(name: str, variable: xr.Variable) -> bool:
    """Whether a variable has content; checks not requested and speeds of a response over frequency have none."""
    nothing = name == "speed_rpm" and bool(np.all(np.isnan(variable.values)))
    return not nothing and variable.sizes.get(variable.dims[0], 1) > 0


def _of_case(index: int, values: Values, before: int) -> xr.Dataset:
    """Return the variables of a case with their dimensions, and the index of the case for each of its rows."""
    peak = int(values["peak_point"])
    values = values | {"peak_point": peak + before if peak >= 0 else peak}
    for dim, own in OWNERS.items():
        rows = [len(values[n]) for n, c in COLUMNS.items() if n in values and n != own and c.along[0] == dim]
        if rows:
            values[own] = np.full(rows[0], index)
    data = {
        name: xr.Variable(column.along, _shaped(values[name], column.along))
        for name, column in COLUMNS.items()
        if name in values
    }
    named = {name: [str(x) for x in values[name]] for name in LABELLED if name in values}
    made = xr.Dataset(data, coords=named)
    return made.assign_coords({d: np.arange(made.sizes[d]) for d in COUNTED if d in made.sizes})


def _shaped(value: Any, dims: Sequence[str]) -> Any:
    array = np.asarray(value)
    array = array.astype(object) if array.dtype.kind == "U" else array
    return array[None] if dims[0] == "case" else array


def _aligned(each: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """Return datasets of cases with equal labels and lengths."""
    counts = {d: np.arange(max(e.sizes.get(d, 0) for e in each)) for d in COUNTED}
    labelled = [d for d in LABELLED if any(d in e.coords for e in each)]
    labels = {d: list(dict.fromkeys(x for e in each for x in e[d].values)) for d in labelled}
    return [_filled(e, {d: n for d, n in counts.items() if d in e.sizes} | labels) for e in each]


def _filled(data: xr.Dataset, labels: Mapping[str, Any]) -> xr.Dataset:
    if all(np.array_equal(data[d].values, own) for d, own in labels.items()):
        return data
    zero = {n: 0 for n in data.data_vars if "harmonic" in data[n].dims}
    blank = {n: _blank(data[n].dtype) for n in data.data_vars}
    higher = {d: own for d, own in labels.items() if d == "harmonic"}
    others = {d: own for d, own in labels.items() if d != "harmonic"}
    return data.reindex(higher, fill_value=blank | zero).reindex(others, fill_value=blank)


def _blank(kind: np.dtype[Any]) -> Any:
    return {"f": np.nan, "i": -1, "O": ""}[kind.kind]


DIM = "measured"


def with_measured(data: xr.Dataset, found: MeasuredPeaks | None) -> xr.Dataset:
    """Return the dataset of a forced response with the measured peaks, along the dimension ``measured``."""
    if found is None:
        return data
    variables: dict[str, Any] = {
        "measured_value": variable(DIM, found.values, "1", f"value of {found.key} in the test"),
        "measured_others": variable(
            DIM, list(found.others), "1", "values of other varied keys in the test; empty where not told"
        ),
        "measured_excitation_n": variable(
            DIM, found.excitation, "N", "amplitude of the force that measured amplitudes belong to"
        ),
        **_of("measured_amplitude", found.amplitude, "peak amplitude"),
        **_of("measured_frequency_hz", found.frequency, "peak frequency"),
    }
    own = {"measured_key": found.key, "measured_file": found.file, "measured_source": found.source}
    return data.assign(variables).assign_attrs(own)


def _of(name: str, found: Quantity, about: str) -> dict[str, Any]:
    """Return the variables of a measured quantity and of its error bars; none if not measured."""
    if not found.unit:
        return {}
    own = {name: variable(DIM, found.values, found.unit, f"measured {about}")}
    if found.bar:
        long_name = f"{found.bar} of the measured {about}"
        own[f"{name}_error"] = variable(DIM, found.errors, found.unit, long_name)
        own[f"{name}_error"].attrs["error"] = found.bar
    return own
