"""Varied keys of a study, read from the dataset of an analysis."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray
from stickslip.study.file.case_names import JOINT, Naming, assignments, namings


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
