"""Tables for Python and notebooks: a dataset as a DataFrame of pandas, and a small DataFrame as text."""

from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from stickslip.errors import did_you_mean, input_error
from stickslip.study.coordinates import VARIED_KEY, as_stored, varied_values


def cells(frame: pd.DataFrame) -> list[list[str]]:
    """Return the cells of a table as text, numbers with six digits."""
    return [[_text(v) for v in row] for row in frame.itertuples(index=False, name=None)]


def as_text(frame: pd.DataFrame) -> str:
    """Return a table as lines of text."""
    every = [[str(name) for name in frame.columns], *cells(frame)]
    widths = [max(map(len, column)) for column in zip(*every, strict=True)]
    return "\n".join("  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in every)


def _text(value: Any) -> str:
    if isinstance(value, float | np.floating):
        return f"{value:.6g}" if np.isfinite(value) else "–"
    return str(value)


# main variables, whose entries are the rows of a table; the first one that an analysis has counts
_CHIEF = ("amplitude", "largest", "damping", "pair_margin", "level", "frequency_hz", "linear_damping_ratio", "answer")


def dataframe(data: xr.Dataset, name: str, of: str) -> pd.DataFrame:
    """Return a variable and all variables over its dimensions, one row an entry.

    Missing entries are left out; verdicts and states become words.

    Parameters
    ----------
    data
        Dataset of one analysis.
    name
        Name of the analysis, for messages.
    of
        The variable; empty: the main variable of the analysis.

    Raises
    ------
    InputError
        If there is no such variable.
    """
    short = {
        str(data[c].attrs[VARIED_KEY]): str(c)
        for c in sorted(
            data.coords, key=lambda c: -len(str(c))
        )  # the shortest name last: the coordinate of points, without the prefix case_
        if VARIED_KEY in data[c].attrs
    }
    data = as_stored(data)
    names = [str(v) for v in data.data_vars]
    if of and of not in names:
        raise input_error(f"to_dataframe({name!r}, of={of!r})", "is no variable of it", did_you_mean(of, names))
    rows = [v for v in names if set(data[v].dims) - {"case"}] or names  # facts of a case are no rows
    chief = of or next((v for v in _CHIEF if v in rows), next(iter(rows), ""))
    if not chief:
        raise input_error(f"to_dataframe({name!r})", "holds no variables", "Look at result.data.")
    dims = set(data[chief].dims)
    at_case = data["point_case"].values if "point_case" in data and "point" in dims else None
    per_case = {"case"} if dims != {"case"} else set()  # facts of a case stand in the dataset
    kept = [v for v in names if set(data[v].dims) <= dims and set(data[v].dims) - per_case]
    own = data[[chief, *(v for v in kept if v != chief)]]
    frame = own.to_dataframe()
    places = [n for n in frame.index.names if n not in frame.columns]  # a variable may have the name of its dimension
    frame = frame.reset_index(places).reset_index(drop=True)
    if frame[chief].dtype.kind == "f":
        there = np.isfinite(frame[chief])
        if "status" in own and "frequency_hz" in own:  # a point without a solution still has a frequency
            there |= np.isfinite(frame["frequency_hz"])
        frame = frame[there].reset_index(drop=True)
    case = frame["case"].to_numpy() if "case" in dims else None
    if at_case is not None:
        case = at_case[frame["point"].to_numpy()]
    if case is not None and "vary" in data.coords:
        keys, values = varied_values(data)
        for k, key in reversed(list(enumerate(keys))):
            frame.insert(0, short.get(key, key), values[case, k])
    for v in own.data_vars:  # codes become words
        told = own[v].attrs
        if "flag_meanings" in told:
            words = dict(zip(np.ravel(told["flag_values"]).tolist(), str(told["flag_meanings"]).split(), strict=True))
            frame[str(v)] = [words.get(x, x) for x in frame[str(v)].tolist()]
    frame = frame.infer_objects()
    frame.attrs["units"] = {str(v): str(own[v].attrs["units"]) for v in own if "units" in own[v].attrs}
    return frame
