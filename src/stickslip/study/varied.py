"""The varied keys of a study, from the dataset of an analysis."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray
from stickslip.study.file.case_names import assignments


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


def other_values(data: xr.Dataset, key: str) -> list[str]:
    """Return the other varied keys of each case with their values; empty if there are none."""
    keys, values = varied_values(data)
    rows = [{k: v for k, v in zip(keys, row, strict=True) if k != key} for row in values]
    return [", ".join(assigned_of(row)) for row in rows]


def assigned_of(values: Mapping[str, object]) -> tuple[str, ...]:
    """Return the varied keys of a case with their values, which a dataset holds as texts."""
    return assignments({k: str(v) if np.isnan(as_number(v)) else as_number(v) for k, v in values.items()})
