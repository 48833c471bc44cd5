"""Writing and reading of netCDF-4 with h5py only.

xarray writes and reads such files, too, but looks up every dimension for each variable: 0.7 s for the hundred variables of a response, ten
times the time for the file itself. Conventions (texts, missing values, coordinates) are encoded by xarray's functions. The layout follows
"NetCDF-4 File Format" (Unidata), section "Dimensions": a dimension is a dimension scale of HDF5, and `_Netcdf4Coordinates` of a variable
names its dimensions by their `_Netcdf4Dimid`.
"""

from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr
from xarray.conventions import cf_encoder, encode_dataset_coordinates

DIMID, COORDINATES = "_Netcdf4Dimid", "_Netcdf4Coordinates"
REFERENCES = {"REFERENCE_LIST", "DIMENSION_LIST"}
PROVENANCE, WRITER = "_NCProperties", "stickslip.netcdf4_file=1"
HIDDEN = {"CLASS", "NAME", DIMID, COORDINATES, PROVENANCE}
NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable."
RENAMED = "_nc4_non_coord_"  # prefix of a variable with the name of a dimension that is not its coordinate
_TEXT = h5py.string_dtype()


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
