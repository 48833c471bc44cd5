"""Results of today and of the baseline's commit under the same names: node -> variable -> values."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

Node = dict[str, np.ndarray]
# the layout of the first plan: one file an analysis, ``load_case`` for ``case``, ``case`` for ``point_case``
FIRST_LAYOUT = {
    "forced_response": "result.nc",
    "modes": "modes.nc",
    "campbell": "campbell.nc",
    "safe": "safe.nc",
}
RENAMED = {"case": "point_case"}
OF_THE_MODEL = ("static_", "frequency_full", "frequency_reduced", "frequency_stuck")
TIMES = "seconds"  # in the names of what no two runs share


def read_nodes(folder: Path) -> dict[str, Node]:
    """Return the variables of every analysis in a results folder, of either layout.

    Parameters
    ----------
    folder
        With ``result.nc`` of a study of today, or with the files of the first layout.
    """
    if (folder / "modes.nc").is_file() or not _has_groups(folder / "result.nc"):
        found = {name: folder / file for name, file in FIRST_LAYOUT.items()}
        return {name: _first_layout(path) for name, path in found.items() if path.is_file()}
    with xr.open_datatree(folder / "result.nc", engine="h5netcdf") as tree:
        return {name: _node(name, tree[name].to_dataset()) for name in tree.children}


def _has_groups(path: Path) -> bool:
    with xr.open_datatree(path, engine="h5netcdf") as tree:
        return bool(tree.children)


def _first_layout(path: Path) -> Node:
    with xr.open_dataset(path, engine="h5netcdf") as data:
        return {RENAMED.get(str(name), str(name)): data[name].values for name in data.variables}


def _node(name: str, data: xr.Dataset) -> Node:
    """Drop the leading dimension of the cases where the baseline has none: its loads did not change the model."""
    single = name != "forced_response" and data.sizes.get("case") == 1
    return {
        str(key): (
            data[key][0]
            if data[key].dims[:1] == ("case",) and (single or str(key).startswith(OF_THE_MODEL))
            else data[key]
        ).values
        for key in data.variables
    }


def timeless(node: Mapping[str, np.ndarray]) -> Node:
    """Leave out how long things took."""
    return {name: values for name, values in node.items() if TIMES not in name}
