"""A result as the report sees it: dataset, analyses, and provenance."""

import json
from pathlib import Path

import xarray as xr

from stickslip.errors import input_error
from stickslip.model.npz import require_no_pipe
from stickslip.study.store.netcdf import read_tree

RESULT = "result.nc"


def open_result(path: Path) -> xr.DataTree:
    """Read a result into memory.

    Parameters
    ----------
    path
        The file that ``stickslip run`` wrote, finished or not, or the folder that holds it.
    """
    file = path / RESULT if path.is_dir() else path
    require_no_pipe(file)
    if not file.is_file():
        remedy = f"Give the {RESULT} that 'stickslip run' wrote, or its folder."
        raise input_error(str(file), "no such file", remedy)
    if file.suffix.lower() in (".html", ".htm"):
        remedy = f"Give the folder of a run, or the {RESULT} in it."
        raise input_error(str(file), "is a page, and no result", remedy)
    return read_tree(file)


def analysis(tree: xr.DataTree, name: str) -> xr.Dataset:
    """Return the dataset of an analysis; attributes that it lacks come from the root of the result."""
    node = tree[name]
    return node.to_dataset().assign_attrs({**tree.attrs, **node.attrs})


def versions(stored: str) -> dict[str, str]:
    """Return library versions from the JSON text in the result."""
    try:
        found = json.loads(stored)
    except json.JSONDecodeError:
        return {"versions": stored}
    return {str(k): str(v) for k, v in found.items()} if isinstance(found, dict) else {}
