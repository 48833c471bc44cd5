"""Labelled variables, and atomic writing and reading of result files, netCDF-4 with h5py only.

xarray writes and reads such files, too, but looks up every dimension for each variable: 0.7 s for the hundred variables
of a response, ten times the time for the file itself. Conventions (texts, missing values, coordinates) are encoded by
xarray's functions. The layout follows "NetCDF-4 File Format" (Unidata), section "Dimensions": a dimension is a dimension
scale of HDF5, and `_Netcdf4Coordinates` of a variable names its dimensions by their `_Netcdf4Dimid`.
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr
from xarray.conventions import cf_encoder, encode_dataset_coordinates

from stickslip.arrays import BoolArray, IntArray
from stickslip.errors import input_error
from stickslip.model.checksum import Cut, check_file, with_checksum
from stickslip.study.store.atomic_write import interrupted_later, write_whole

DIMID, COORDINATES = "_Netcdf4Dimid", "_Netcdf4Coordinates"
REFERENCES = {"REFERENCE_LIST", "DIMENSION_LIST"}
PROVENANCE, WRITER = "_NCProperties", "stickslip.netcdf4_file=1"
HIDDEN = {"CLASS", "NAME", DIMID, COORDINATES, PROVENANCE}
NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."
RENAMED = "_nc4_non_coord_"  # prefix of a variable with the name of a dimension that is not its coordinate
_TEXT = h5py.string_dtype()
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


def to_bytes(tree: xr.DataTree) -> bytes:
    """Return a netCDF-4 file of a tree."""
    made = BytesIO()
    with h5py.File(made, "w", track_order=True) as file:
        told = f"version=2,{WRITER},hdf5={h5py.version.hdf5_version},h5py={h5py.__version__}"
        file.attrs[PROVENANCE] = np.bytes_(told)
        _write(file, tree, {}, [0])
    return made.getvalue()


def _write(group: h5py.Group, node: xr.DataTree, known: Mapping[str, h5py.Dataset], number: list[int]) -> None:
    data = node.to_dataset(inherit=False)
    variables, attributes = cf_encoder(*encode_dataset_coordinates(data))
    scales = dict(known)
    for name, size in data.sizes.items():
        if str(name) not in scales and variables.get(name, xr.Variable((), 0)).dims != (name,):
            scales[str(name)] = _dimension(group, str(name), size, number)
    for name, v in variables.items():
        if v.dims == (name,):
            scales[str(name)] = _scale(_dataset(group, str(name), v), str(name), number)
    for name, v in variables.items():
        if v.dims != (name,):
            stored = RENAMED + str(name) if name in scales else str(name)
            _attach(_dataset(group, stored, v), [scales[str(d)] for d in v.dims])
    for key, value in attributes.items():
        _attribute(group, str(key), value)
    for name, child in node.children.items():
        _write(group.create_group(name, track_order=True), child, scales, number)


def _dimension(group: h5py.Group, name: str, size: int, number: list[int]) -> h5py.Dataset:
    """Create a dimension without a variable."""
    made = group.create_dataset(name, (size,), ">f4")
    return _scale(made, f"{NO_VARIABLE}{size:10d}", number)


def _scale(made: h5py.Dataset, name: str, number: list[int]) -> h5py.Dataset:
    h5py.h5ds.set_scale(made.id, name.encode())
    made.attrs[DIMID] = np.int32(number[0])
    number[0] += 1
    return made


def _attach(made: h5py.Dataset, scales: list[h5py.Dataset]) -> None:
    for axis, scale in enumerate(scales):
        h5py.h5ds.attach_scale(made.id, scale.id, axis)
    if scales:
        made.attrs[COORDINATES] = np.array([s.attrs[DIMID] for s in scales], dtype=np.int32)


def _dataset(group: h5py.Group, name: str, v: xr.Variable) -> h5py.Dataset:
    values = np.asarray(v.values)
    missing = v.attrs.get("_FillValue")
    text = values.dtype.kind in "UO"
    made = group.create_dataset(
        name, values.shape, _TEXT if text else values.dtype, fillvalue=missing, track_order=True
    )
    if values.size:
        made[...] = values.astype(object) if text else values
    for key, value in v.attrs.items():
        _attribute(made, str(key), value)
    return made


def _attribute(of: h5py.HLObject, key: str, value: Any) -> None:
    """Write an attribute in the netCDF form: numbers as one-dimensional arrays."""
    if isinstance(value, str):
        of.attrs[key] = value
        return
    found = np.atleast_1d(np.asarray(value))
    of.attrs[key] = found.astype(_TEXT) if found.dtype.kind in "UO" else found


def of_file(path: Path) -> xr.DataTree | None:
    """Return the tree of a file written by `to_bytes`, in memory; None for a file of another program."""
    with h5py.File(path, "r") as file:
        if WRITER not in _said(file).get(PROVENANCE, ""):
            return None
        return xr.DataTree.from_dict(dict(_read(file, "/", {})))


def root_attributes(path: Path) -> dict[str, Any]:
    """Return the root attributes of a netCDF-4 file from any program."""
    with h5py.File(path, "r") as file:
        return _shown(_said(file))


def _read(group: h5py.Group, path: str, known: Mapping[int, str]) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield each group and its variables, from the root downward."""
    every = {name: (one, _said(one)) for name, one in group.items()}
    dims = dict(known) | {int(said[DIMID]): name for name, (_, said) in every.items() if DIMID in said}
    variables = {}
    for name, (one, said) in every.items():
        if isinstance(one, h5py.Group) or said.get("NAME", "").startswith(NO_VARIABLE):
            continue
        own = tuple(dims[i] for i in np.atleast_1d(said.get(COORDINATES, said.get(DIMID, []))))
        variables[name.removeprefix(RENAMED)] = xr.Variable(own, _values(one), _shown(said))
    data = xr.Dataset(variables, attrs=_shown(_said(group)))
    yield path, xr.decode_cf(data, decode_times=False)
    for name, (one, _) in every.items():
        if isinstance(one, h5py.Group):
            yield from _read(one, f"{path.rstrip('/')}/{name}", dims)


def _values(one: h5py.Dataset) -> np.ndarray[Any, Any]:
    if h5py.check_string_dtype(one.dtype) is None:
        return np.asarray(one[()])
    return np.asarray(one.asstr()[()]).astype(str)


def _shown(said: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes without those internal to netCDF-4."""
    return {name: value for name, value in said.items() if name not in HIDDEN}


def _said(of: h5py.HLObject) -> dict[str, Any]:
    """Return the attributes without references; single numbers as scalars."""
    found: dict[str, Any] = {}
    for key in of.attrs:
        if key in REFERENCES:
            continue
        value = of.attrs[key]
        if isinstance(value, bytes):
            value = value.decode()
        elif isinstance(value, np.ndarray) and value.dtype.kind == "O":
            value = value.tolist()
        if isinstance(value, np.ndarray | list) and len(value) == 1:
            value = value[0]
        found[key] = value
    return found
