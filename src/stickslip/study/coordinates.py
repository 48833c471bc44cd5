"""Coordinates of the dataset of an analysis: cases, varied keys, frequencies, speeds and outputs; and the varied keys read back from it.

They are made both when a run assembles its dataset and when a result is opened, so results of every version have them.
"""

import re
from collections import Counter
from collections.abc import Collection, Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from xarray.core.indexing import IndexSelResult

from stickslip.arrays import BoolArray, FloatArray
from stickslip.column import names_of
from stickslip.study.analysis import named
from stickslip.study.file.case_names import JOINT, Naming, assignments, namings
from stickslip.study.file.suffixes import unit_of
from stickslip.study.questions import ANALYSES

CASE, POINT = "case", "point"  # the dimensions of cases, and of the points of all cases
OWNER = "point_case"  # index of the case of each point if all cases share the dimension `point`
VARIED_KEY = "varied_key"  # attribute of coordinates that hold the values of a varied key
PLACES = ("frequency_hz", "speed_rpm")  # endings of the names of variables that give a row its position
LABELS = ("output_label", "output_name")  # names of the outputs if their dimension has no coordinate
RELATIVE_ERROR_OF_VALUES = 1e-9  # relative difference below which a requested number equals a value of the key


class Varied(xr.Index):
    """Index of the varied keys along one dimension: ``data.sel(ratio=5, mu=0.3)`` selects points, or cases, with these values.

    The request may be a value, a list of values or a slice of numbers. In a pandas table the keys are index levels, after the number of the
    point or the label of the case.
    """

    def __init__(self, dim: Hashable, values: Mapping[Hashable, xr.Variable]) -> None:
        self.dim, self.values = dim, dict(values)

    @classmethod
    def from_variables(cls, variables: Mapping[Any, xr.Variable], *, options: Mapping[str, Any]) -> "Varied":
        """Return the index of coordinates along one dimension."""
        (dim,) = next(iter(variables.values())).dims
        return cls(dim, variables)

    @classmethod
    def concat(cls, indexes: Sequence["Varied"], dim: Hashable, positions: Any = None) -> "Varied":
        """Return the index of concatenated datasets."""
        found = {
            name: xr.Variable.concat([one.values[name] for one in indexes], dim, positions)  # type: ignore[no-untyped-call]
            for name in indexes[0].values
        }
        return cls(dim, found)

    def create_variables(self, variables: Mapping[Any, xr.Variable] | None = None) -> dict[Hashable, xr.Variable]:
        """Return the coordinates of the index."""
        return {name: own.copy(deep=False) for name, own in self.values.items()}

    def to_pandas_index(self) -> pd.Index:
        """Return the index as a pandas index."""
        names = [self.dim, *(name for name in self.values if name != self.dim)]
        return pd.MultiIndex.from_arrays([self.values[name].values for name in names], names=names)

    def isel(self, indexers: Mapping[Any, Any]) -> "Varied | None":
        """Return the index of some positions; None for a single one, or for positions in several dimensions."""
        found = {name: own.isel(indexers, missing_dims="ignore") for name, own in self.values.items()}
        return type(self)(self.dim, found) if all(own.dims == (self.dim,) for own in found.values()) else None

    def sel(self, labels: dict[Any, Any], method: str | None = None, tolerance: Any = None) -> IndexSelResult:
        """Return the positions at which all keys have the requested values.

        If each key has a single value left, the keys become scalar coordinates of the selection, which align nothing.

        Raises
        ------
        KeyError
            If a key has no such value.
        """
        found = [_positions(str(name), self.values[name].values, asked, method) for name, asked in labels.items()]
        at = np.flatnonzero(np.all(found, axis=0))
        keys = {name: own[at] for name, own in self.values.items() if name != self.dim}
        if not at.size or any(np.any(own.values != own.values[0]) for own in keys.values()):
            return IndexSelResult({self.dim: at})
        if self.dim == CASE and at.size == 1 and all(np.ndim(one) == 0 for one in labels.values()):
            return IndexSelResult({self.dim: int(at[0])})
        single = {name: own[0] for name, own in keys.items()}
        every = list(self.values)
        # xarray drops coordinates only if the result contains an index
        return IndexSelResult({self.dim: at}, {self.dim: self}, single, drop_coords=[self.dim], drop_indexes=every)

    def equals(self, other: xr.Index, *, exclude: Any = None) -> bool:
        """Whether two indexes have the same values."""
        if not isinstance(other, Varied) or self.values.keys() != other.values.keys():
            return False
        return all(np.array_equal(own.values, other.values[name].values) for name, own in self.values.items())

    def rename(self, name_dict: Mapping[Any, Hashable], dims_dict: Mapping[Any, Hashable]) -> "Varied":
        """Return the index with other names."""
        dim = dims_dict.get(self.dim, self.dim)
        own = {name_dict.get(name, name): xr.Variable((dim,), v.values, v.attrs) for name, v in self.values.items()}
        return type(self)(dim, own)


def _positions(name: str, values: np.ndarray[Any, Any], asked: Any, method: str | None) -> BoolArray:
    """Return a mask of the positions at which a key has one of the requested values."""
    number = values.dtype.kind in "fi"
    if np.asarray(asked).dtype == bool:
        return np.asarray(asked)
    if isinstance(asked, slice):
        low, high = asked.start, asked.stop
        inside = np.ones(values.size, dtype=bool)
        inside &= True if low is None else values >= low
        return np.asarray(inside & (True if high is None else values <= high))
    found = np.zeros(values.size, dtype=bool)
    for one in np.ravel(asked).tolist():
        wanted = one
        if number and method == "nearest":
            wanted = values[np.argmin(np.abs(values - one))]
        here = np.isclose(values, wanted, rtol=RELATIVE_ERROR_OF_VALUES, atol=0.0) if number else values == str(one)
        if not np.any(here):
            known = ", ".join(f"{v:g}" if number else str(v) for v in pd.unique(values))
            raise KeyError(f"{name} has no value {one!r}, but {known}")
        found |= here
    return found


def with_coordinates(data: xr.Dataset, analysis: str) -> xr.Dataset:
    """Return a dataset with coordinates for its entries; values and their names stay the same.

    Parameters
    ----------
    data
        Dataset of an analysis with ``case_label``, and with ``vary_value`` where keys are varied.
    analysis
        Name of the analysis; its `Home` names the variables that are coordinates.

    Returns
    -------
    xr.Dataset
        Dataset with the coordinates that its `Home` names, and with:

        - ``case``: labels of the cases, if keys are varied;
        - each varied key, under the shortest unique end of its name (``force_n`` for ``load.shaker.force_n``): along the points of all
          cases, with ``case_force_n`` along the cases; without such points only along the cases;
        - case, frequency and speed of rows of all cases (``point_case``, ``frequency_hz``, ``attempt_frequency_hz`` ...);
        - names of the outputs.
    """
    if any(VARIED_KEY in data[name].attrs for name in data.coords):
        return data
    axes = ANALYSES[analysis].axes if analysis in ANALYSES else ()
    data = data.set_coords([name for name in data.data_vars if _positions_rows(data, str(name)) or name in axes])
    data = _with_outputs(data)
    keys, values = varied_values(data)
    if not any(keys) or CASE not in data.dims:
        return data
    if "case_label" in data and CASE not in data.variables:
        data = data.assign_coords({CASE: data["case_label"].variable.copy()})
    here = {str(name) for found in (data.variables, data.dims, data.attrs) for name in found}
    possible = {name for kind in named(analysis).answers for name in names_of(kind)} if analysis in ANALYSES else set()
    names = short_names(keys, here | possible)
    each = {name: _of_key(key, values[:, k]) for k, (key, name) in enumerate(zip(keys, names, strict=True))}
    if OWNER not in data:
        return data.assign_coords(each)
    owner = data[OWNER].variable
    points = {name: xr.Variable(owner.dims, v.values[owner.values], v.attrs) for name, v in each.items()}
    return data.assign_coords(points | {f"{CASE}_{name}": v for name, v in each.items()})


def selectable(data: xr.Dataset) -> xr.Dataset:
    """Return a dataset in which `sel` accepts values of varied keys and of labels such as nodal diameters.

    `with_coordinates` has made them coordinates before.
    """
    data = _with_labels(data)
    keys = [name for name in data.coords if VARIED_KEY in data[name].attrs]
    for dim in dict.fromkeys(data[name].dims[0] for name in keys):
        own = {name: data[name].variable for name in keys if data[name].dims == (dim,)}
        here = data[dim].variable if dim in data.variables else xr.Variable((dim,), np.arange(data.sizes[dim]))
        found = {dim: here.to_base_variable(), **own}
        index = Varied.from_variables(found, options={})
        data = data.drop_indexes(dim, errors="ignore").assign_coords(xr.Coordinates(found, dict.fromkeys(found, index)))
    return data


def _with_labels(data: xr.Dataset) -> xr.Dataset:
    """Return a dataset in which row labels (whole numbers and words) that all cases share become indexed coordinates of the rows."""
    found: dict[Hashable, dict[Hashable, xr.Variable]] = {}
    for name in data.coords:
        own = data[name].variable
        if own.dims[:1] != (CASE,) or own.ndim != 2 or own.dtype.kind not in "iU" or not own.size:
            continue
        if (own.values == own.values[:1]).all():
            found.setdefault(own.dims[1], {})[name] = xr.Variable(own.dims[1:], own.values[0], own.attrs)
    for dim, labels in found.items():
        if dim not in data.variables:
            every = {dim: xr.Variable((dim,), np.arange(data.sizes[dim])), **labels}
            index = Varied.from_variables(every, options={})
            data = data.drop_vars(labels).assign_coords(xr.Coordinates(every, dict.fromkeys(every, index)))
    return data


def as_stored(data: xr.Dataset) -> xr.Dataset:
    """Return a dataset as stored: without coordinates of cases and varied keys; other coordinates are variables again."""
    made = [name for name in data.coords if name in (CASE, POINT) or VARIED_KEY in data[name].attrs]
    data = data.drop_vars(made)
    labels = [name for name in data.coords if name in data.xindexes and name not in data.dims]
    rows = {data[name].dims[0] for name in labels}  # numbered by `_with_labels`
    data = data.drop_indexes([*labels, *rows]).drop_vars(rows)
    return data.reset_coords([name for name in data.coords if name not in data.dims])


def short_names(keys: Sequence[str], taken: Collection[str]) -> list[str]:
    """Return for each key its shortest unique end that is not in `taken`, with underscores for dots."""
    ends = [[re.sub(r"\W", "_", ".".join(parts[-n:])) for n in range(1, len(parts) + 1)] for parts in _parts(keys)]
    often = Counter(end for own in ends for end in own)
    free = [[end for end in own if often[end] == 1 and not {end, f"{CASE}_{end}"} & set(taken)] for own in ends]
    return [own[0] if own else f"vary_{k}" for k, own in enumerate(free)]


def _parts(keys: Sequence[str]) -> list[list[str]]:
    return [key.split(".") for key in keys]


def _of_key(key: str, values: np.ndarray[Any, Any]) -> xr.Variable:
    """Return the values of a key over the cases, as numbers if possible, with the unit at the end of its name."""
    numbers = np.array([as_number(v) for v in values])
    found = numbers if np.all(np.isfinite(numbers)) else np.array([str(v) for v in values])
    return xr.Variable((CASE,), found, {"units": _unit(key), "long_name": key, VARIED_KEY: key})


def _unit(key: str) -> str:
    words = key.rsplit(".", 1)[-1].split("_")
    units = (unit_of("_".join(words[n:])) for n in range(1, len(words)))
    return next((unit.symbol for unit in units if unit is not None), "1")


def _positions_rows(data: xr.Dataset, name: str) -> bool:
    """Whether a variable is the case, frequency or speed of rows that hold the points of all cases."""
    dims = data[name].dims
    if len(dims) != 1 or dims == (CASE,):
        return False
    owners = [own for own in data.variables if str(own).endswith("_case") and data[own].dims == dims]
    return name in owners or (bool(owners) and name.endswith(PLACES))


def _with_outputs(data: xr.Dataset) -> xr.Dataset:
    """Return a dataset with the names of the outputs along their dimension, if they are the same in all cases."""
    name = next((n for n in LABELS if n in data and data[n].ndim == 2), None)
    if name is None:
        return data
    dim, rows = data[name].dims[1], data[name].values
    if dim in data.variables or not (rows == rows[:1]).all() or len(set(rows[0])) < len(rows[0]):
        return data
    return data.assign_coords({dim: rows[0].astype(str)})


def varied_values(data: xr.Dataset) -> tuple[list[str], np.ndarray]:
    """Return the varied keys and their values (case, key)."""
    n = data.sizes.get("case", 1)
    if "vary_value" not in data or not data["vary_value"].size:
        return [], np.zeros((n, 0), dtype=object)
    keys = [str(k) for k in data["vary"].values] if "vary" in data.coords else [""]
    return keys, np.asarray(data["vary_value"].transpose("case", "vary").values, dtype=object)


def as_number(value: object) -> float:
    """Return a varied value as a number; NaN for a text."""
    try:
        return float(str(value))
    except ValueError:
        return float("nan")


def first_varied_number(data: xr.Dataset) -> tuple[str, FloatArray]:
    """Return the first varied key whose values are numbers, and its values (case,); an empty key and NaN if there is none."""
    keys, values = varied_values(data)
    numbers = np.array([[as_number(v) for v in row] for row in values]).reshape(values.shape)
    for column, key in enumerate(keys):
        found = numbers[:, column]
        if np.isfinite(found).all() and len(set(found)) > 1:
            return key, found
    return "", np.full(len(values), np.nan)


def naming_of(data: xr.Dataset, key: str) -> Naming:
    """Return word, unit and power of ten of a varied key, as in names of cases."""
    keys, values = varied_values(data)
    if key not in keys:
        return namings({key: []})[key]
    return namings({k: [_as_given(v) for v in column] for k, column in zip(keys, values.T, strict=True)})[key]


def _as_given(value: object) -> object:
    number = as_number(value)
    return str(value) if np.isnan(number) else number


def families(data: xr.Dataset, key: str) -> dict[str, list[int]]:
    """Group the cases that differ only in `key` and keys that vary with it: name of a group -> its cases in the order of the study.

    The name consists of the parts of the cases' names that the group has in common; it is empty for a single group. A key varies with
    `key` if each value of `key` determines its value, and its numbers rise or fall with `key`.
    """
    keys, values = varied_values(data)
    along = values[:, keys.index(key)] if key in keys else np.zeros(len(values))
    free = [k for k, name in enumerate(keys) if name != key and not _runs_with(along, values[:, k])]
    groups: dict[tuple[object, ...], list[int]] = {}
    for case, row in enumerate(values[:, free]):
        groups.setdefault(tuple(row), []).append(case)
    spelled = [JOINT.join(assigned_of({keys[k]: v for k, v in zip(free, row, strict=True)})) for row in groups]
    labels = [str(v) for v in data["case_label"].values] if "case_label" in data else []
    shared = _shared_names(labels, list(groups.values()))
    return dict(zip(shared if len(set(shared)) == len(groups) else spelled, groups.values(), strict=True))


def _runs_with(along: np.ndarray, other: np.ndarray) -> bool:
    pairs = set(zip(along, other, strict=True))
    if len(pairs) > len(set(along)):
        return False
    numbers = np.array(sorted((as_number(a), as_number(b)) for a, b in pairs))
    steps = np.diff(numbers[:, 1])
    return bool(np.isnan(numbers).any() or (steps >= 0).all() or (steps <= 0).all())


def _shared_names(labels: Sequence[str], groups: Sequence[Sequence[int]]) -> list[str]:
    """Return for each group the parts of the names that all its cases have in common."""
    if len(groups) == 1 or not labels:
        return [""]
    parts = [label.split(JOINT) for label in labels]
    places = range(min(map(len, parts)))
    own = [k for k in places if all(len({parts[c][k] for c in cases}) == 1 for cases in groups)]
    return [JOINT.join(parts[cases[0]][k] for k in own) for cases in groups]


def assigned_of(values: Mapping[str, object]) -> tuple[str, ...]:
    """Return the varied keys of a case with their values as text: ``load.shaker.force_n = 3``."""
    return assignments({k: _as_given(v) for k, v in values.items()})
