"""Two result files, variable by variable: kind, dimensions and every bit; attributes too."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from evidence.baseline.texts import timeless

TIMES = "seconds"  # in the names of what no two runs share
TEXTS = "OUS"  # kinds of arrays
LETTERS_BEFORE, LETTERS_AFTER = (60, 100)  # of a text that are printed about the first letter that differs
OF_THE_RUN = ("created", "wall_seconds", "stickslip_version", "versions")  # attributes of the root


def read_nodes(path: Path) -> dict[str, xr.Dataset]:
    """Return the datasets of a result file by the path of their group, as they are stored."""
    with xr.open_datatree(path, engine="h5netcdf", decode_cf=False) as tree:
        return {node.path: node.to_dataset(inherit=False).load() for node in tree.subtree}


def differing_results(old: Mapping[str, xr.Dataset], new: Mapping[str, xr.Dataset]) -> list[str]:
    """Return a line for every variable and attribute that only one of two results has, or that differs."""
    found = list(_names("group", "", old, new))
    for path in (path for path in old if path in new):
        before, after = old[path], new[path]
        found += _names("variable", f"{path}/", before.variables, after.variables)
        found += _attributes(path, before.attrs, after.attrs)
        for name in (str(name) for name in before.variables if name in after.variables):
            one, other = before.variables[name], after.variables[name]
            found += [f"{path}/{name}: {line}" for line in differing_variable(name, one, other)]
            found += _attributes(f"{path}/{name}", one.attrs, other.attrs)
    return found


def differing_variable(name: str, old: xr.Variable, new: xr.Variable) -> Iterator[str]:
    """Say in what two variables of one name differ; times may differ in their values alone."""
    a, b = np.asarray(old.values), np.asarray(new.values)
    if old.dims != new.dims or a.shape != b.shape:
        yield f"dimensions {dict(zip(old.dims, a.shape, strict=True))}, now {dict(zip(new.dims, b.shape, strict=True))}"
        return
    texts = a.dtype.kind in TEXTS and b.dtype.kind in TEXTS
    if a.dtype != b.dtype and not texts:
        yield f"kind {a.dtype}, now {b.dtype}"
        return
    if TIMES in name:
        return
    other = _unequal(a, b)
    if other.any():
        place = tuple(int(i) for i in np.argwhere(other)[0])
        yield f"{int(other.sum())} of {other.size} values differ, first {list(place)}: {_shown(a[place], b[place])}"


def _unequal(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return where two arrays of one kind and shape differ in a bit, or in a letter but for times."""
    if a.dtype.kind in TEXTS:
        pairs = zip(a.ravel().tolist(), b.ravel().tolist(), strict=True)
        return np.array([_text(x) != _text(y) for x, y in pairs], dtype=bool).reshape(a.shape)
    size = a.dtype.itemsize
    bits = (np.ascontiguousarray(x).reshape(-1).view(np.uint8).reshape(-1, size) for x in (a, b))
    return np.any(np.not_equal(*bits), axis=1).reshape(a.shape)


def _text(value: Any) -> str:
    return timeless(value.decode() if isinstance(value, bytes) else str(value))


def _names(kind: str, where: str, old: Mapping[Any, Any], new: Mapping[Any, Any]) -> Iterator[str]:
    yield from (f"{where}{name}: no such {kind} any more" for name in old if name not in new)
    yield from (f"{where}{name}: a new {kind}" for name in new if name not in old)


def _attributes(where: str, old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    own = [{k: v for k, v in one.items() if k not in OF_THE_RUN and TIMES not in k} for one in (old, new)]
    yield from _names("attribute", f"{where}@", *own)
    for name in (name for name in own[0] if name in own[1]):
        a, b = (xr.Variable([f"i{k}" for k in range(np.ndim(one[name]))], one[name]) for one in own)
        yield from (f"{where}@{name}: {line}" for line in differing_variable(name, a, b))


def _shown(old: Any, new: Any) -> str:
    """Return two values that differ; of long texts the letters about the first that does."""
    if isinstance(old, np.generic):
        return f"{old.item()!r}, now {new.item()!r}"
    a, b = _text(old), _text(new)
    at = next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))
    start = max(at - LETTERS_BEFORE, 0)
    return f"{a[start : at + LETTERS_AFTER]!r}, now {b[start : at + LETTERS_AFTER]!r}"
