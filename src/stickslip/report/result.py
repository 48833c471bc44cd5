"""A result as the report sees it: dataset, analyses with the accesses that figures and tables need, and provenance."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.npz import require_no_pipe
from stickslip.study.coordinates import with_coordinates
from stickslip.study.store.netcdf import read_tree

RESULT = "result.nc"


def open_result(path: Path) -> xr.DataTree:
    """Read a result into memory, with the coordinates that results of earlier versions lack.

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
    tree = read_tree(file)
    found = {name: with_coordinates(node.to_dataset(), name) for name, node in tree.children.items()}
    return xr.DataTree.from_dict({"/": tree.to_dataset(), **found})


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


@dataclass(frozen=True, eq=False)
class Node:
    """A dataset of one analysis.

    Parameters
    ----------
    data
        Variables of the analysis. Attributes of the analysis override attributes of the whole result.
    key
        Suffix of figure names if each case has its own figures; empty for the first case.
    """

    data: xr.Dataset
    key: str = ""

    def has(self, *names: str) -> bool:
        """Return whether all the variables exist and none is empty."""
        return all(name in self.data and self.data[name].size > 0 for name in names)

    def values(self, name: str, *dimensions: str) -> FloatArray:
        """Return a variable as floats with its dimensions in the order named, or as they are stored."""
        found = self.data[name]
        return np.asarray(found.transpose(*dimensions or found.dims).values, dtype=np.float64)

    def floats(self, name: str) -> FloatArray:
        """Return the values of a variable as floats."""
        return self.values(name)

    def integers(self, name: str) -> IntArray:
        """Return the values of a variable as integers."""
        return np.asarray(self.data[name].values).astype(np.int64)

    def labels(self, dimension: str) -> tuple[str, ...]:
        """Return the labels of a dimension; running numbers if it has none."""
        if dimension in self.data.coords:
            return tuple(str(v) for v in self.data[dimension].values)
        return tuple(str(i) for i in range(self.data.sizes.get(dimension, 0)))

    def labels_of(self, name: str) -> tuple[str, ...]:
        """Return the texts of a variable."""
        return tuple(str(v) for v in self.data[name].values)

    def stored(self, name: str) -> Any:
        """Return a number, list or text stored as a variable or as an attribute; None if there is none."""
        return self.data[name].values if name in self.data else self.data.attrs.get(name)

    def text(self, name: str, default: str = "") -> str:
        """Return a stored value as text."""
        value = self.stored(name)
        return default if value is None else str(value)

    def numbers(self, name: str) -> FloatArray:
        """Return a stored value as numbers (n,); empty if it is missing or not numeric."""
        try:
            value = self.stored(name)
            return np.atleast_1d(np.asarray([] if value is None else value, dtype=np.float64))
        except (TypeError, ValueError):
            return np.zeros(0)

    def scalar(self, name: str, default: float = float("nan")) -> float:
        """Return a stored value as a number; the default if it is missing or not numeric."""
        found = self.numbers(name)
        return float(found[0]) if found.size else default
