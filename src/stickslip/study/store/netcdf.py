"""Labelled variables, and atomic writing and reading of result files."""

from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip.arrays import BoolArray, IntArray
from stickslip.errors import input_error
from stickslip.model.checksum import Cut, check_file, with_checksum
from stickslip.study.store.atomic_write import interrupted_later, write_whole
from stickslip.study.store.netcdf4_file import of_file, root_attributes, to_bytes

_AGAIN = (
    "Give the result.nc that 'stickslip run' wrote, or its folder. Of a damaged one, run the study again: no finished point is "
    "computed anew. With --fresh everything is, after what runs wrote into the folder is removed, and no other file."
)
_TOLD = {"xyz", "order"}  # dimensions of variables that become attributes in the dataset of one case
_MISSING: dict[str, object] = {"f": np.nan, "c": np.nan, "i": -1, "U": "", "O": ""}


def write_tree(tree: xr.DataTree, path: Path) -> None:
    """Write netCDF-4 with a checksum at the end, under a temporary name, and move it to `path`.

    Readers of HDF5 ignore bytes after the end of file that is stated in its header.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    # made in memory: on a full disk HDF5 leaves open files, which print tracebacks when closed
    with interrupted_later():
        write_whole(path, with_checksum(to_bytes(tree)))


def read_tree(path: Path) -> xr.DataTree:
    """Read a result file into memory, written by `write_tree` or by another program.

    Raises
    ------
    InputError
        If the file cannot be read, or does not agree with its checksum.
    """
    try:
        check_file(path)  # HDF5 may hang or crash on damaged files
    except ValueError as error:
        raise input_error(str(path), str(error), _AGAIN) from None
    try:
        own = of_file(path)
        if own is not None:
            return own
        with xr.open_datatree(path, engine="h5netcdf", decode_times=False) as tree:
            return tree.load()
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001  the libraries raise many different errors on damaged files
        said = " ".join(str(error).split())
        raise input_error(str(path), f"is no netCDF-4 file, or a damaged one ({said})", _AGAIN) from None


def attributes_there(path: Path) -> dict[str, Any]:
    """Return the root attributes of a result file without verifying its checksum; empty for a missing or damaged file."""
    try:
        check_file(path)
    except Cut:
        pass  # the content before the checksum is complete, or HDF5 notices that its end is missing
    except (OSError, ValueError):
        return {}
    try:
        return root_attributes(path)
    except Exception:  # noqa: BLE001  as in `read_tree`
        return {}


def variable(dims: str, values: object, units: str, long_name: str) -> xr.Variable:
    """Return a variable; `dims` holds the names of its dimensions, separated by spaces."""
    return xr.Variable(tuple(dims.split()), np.asarray(values), {"units": units, "long_name": long_name})


def stacked(cases: Sequence[Mapping[str, xr.Variable]]) -> dict[str, xr.Variable]:
    """Return the variables of all cases with the leading dimension ``case``.

    Cases of different size are padded with NaN, -1 or empty texts; `one_case` removes the padding.
    """
    sizes: dict[Hashable, int] = {}
    for found in (v for case in cases for v in case.values()):
        for dim, size in found.sizes.items():
            sizes[dim] = max(size, sizes.get(dim, 0))
    names = dict.fromkeys(name for case in cases for name in case)
    return {name: _stack([case.get(name) for case in cases], sizes) for name in names}


def _stack(found: Sequence[xr.Variable | None], sizes: Mapping[Hashable, int]) -> xr.Variable:
    like = next(v for v in found if v is not None)
    kind = np.result_type(*(v.dtype for v in found if v is not None))
    shape = (len(found), *(sizes[dim] for dim in like.dims))
    values = np.full(shape, _MISSING[kind.kind], dtype=kind)
    for i, own in enumerate(found):
        if own is not None:
            at: tuple[int | slice, ...] = (i, *(slice(n) for n in own.shape))
            values[at] = own.values
    return xr.Variable(("case", *like.dims), values, like.attrs)


def alike(data: xr.Dataset) -> list[list[int]]:
    """Return the cases of a dataset in groups of equal content, except labels: a varied key need not affect every analysis."""
    labels = [name for name in data.coords if data[name].dims == ("case",)]
    told = ["case_label", "vary_value", "seconds", *labels]
    own = [data.isel(case=i).drop_vars(told, errors="ignore") for i in range(data.sizes["case"])]
    groups: list[list[int]] = []
    for i, case in enumerate(own):
        twins = next((g for g in groups if own[g[0]].equals(case)), None)
        if twins is None:
            groups.append([i])
        else:
            twins.append(i)
    return groups


def one_case(data: xr.Dataset, index: int) -> xr.Dataset:
    """Return one case of a dataset without padding; single numbers and texts become attributes."""
    names = [name for name, v in data.variables.items() if "case" in v.dims]
    case = data.isel(case=index)
    kept: dict[Hashable, IntArray] = {}
    for dim in case[names].dims:
        there = [_there(case[name], dim) for name in names if dim in case[name].dims]
        kept[dim] = np.flatnonzero(np.any(there, axis=0))
    case = case.isel(kept)
    told = {name: case[name].values.tolist() for name in names if set(case[name].dims) <= _TOLD}
    return case.drop_vars(told).assign_attrs({**data.attrs, **told})


def _there(found: xr.Variable | xr.DataArray, dim: Hashable) -> BoolArray:
    """Return the positions along a dimension at which any variable has a value."""
    values = np.moveaxis(found.values, found.dims.index(dim), 0)
    kind = values.dtype.kind
    missing = np.isnan(values) if kind in "fc" else values == _MISSING[kind]
    return np.asarray(~missing.all(axis=tuple(range(1, values.ndim))))
