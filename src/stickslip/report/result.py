"""A result as the report sees it: the dataset of a run, its analyses, and what it says of itself."""

import json
from html import escape
from pathlib import Path

import xarray as xr

from stickslip.errors import input_error
from stickslip.report.node import Node
from stickslip.study.keep.netcdf import read_tree

RESULT = "result.nc"


def open_result(path: Path) -> xr.DataTree:
    """Read a result into memory.

    Parameters
    ----------
    path
        The file that ``stickslip run`` wrote, finished or not, or the folder that holds it.
    """
    file = path / RESULT if path.is_dir() else path
    if not file.is_file():
        remedy = f"Give the {RESULT} that 'stickslip run' wrote, or its folder."
        raise input_error(str(file), "no such file", remedy)
    return read_tree(file)


def analysis(tree: xr.DataTree, name: str) -> xr.Dataset:
    """Return the dataset of an analysis, with the attributes of the result where it has none of its own."""
    node = tree[name]
    return node.to_dataset().assign_attrs({**tree.attrs, **node.attrs})


def _stored(attributes: Node) -> list[str]:
    text = attributes.text("warnings", "[]")
    try:
        found = json.loads(text)
    except json.JSONDecodeError:
        found = text
    return [escape(str(s)) for s in (found if isinstance(found, list) else [found]) if str(s)]


def stored_warnings(tree: xr.DataTree) -> list[str]:
    """Return what the run warned of, of the model and of each analysis, escaped, and whether it is complete."""
    every = [Node(node.to_dataset()) for node in (tree, *tree.children.values())]
    found = [w for node in every for w in _stored(node)]
    if any(node.scalar("complete", 1) == 0 for node in every):
        found.insert(
            0, "The run is not complete. Run the study again: it resumes where it stopped."
        )
    return list(dict.fromkeys(found))


def versions(stored: str) -> dict[str, str]:
    """Return the versions of libraries from the JSON that results hold."""
    try:
        found = json.loads(stored)
    except json.JSONDecodeError:
        return {"versions": stored}
    return {str(k): str(v) for k, v in found.items()} if isinstance(found, dict) else {}
