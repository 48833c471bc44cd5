"""What pages and terminals make of stored results, in full: texts, tables, verdicts, and figures with numbers in short.

``python tests/held_pages.py`` writes it anew, after a change of words or figures that is meant. Look at the difference that the test prints, first.
"""

import gzip
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from stickslip import Result
from stickslip.analyses import page
from stickslip.analyses.compared import side_by_side
from stickslip.analyses.compared.designs import Design
from stickslip.analyses.compared.side_by_side import comparison_html
from stickslip.study.analysis import named
from stickslip.study.questions import ANALYSES
from stickslip.study.store.netcdf import read_tree

STORED = Path(__file__).parent / "data" / "shown"
DIGITS = 6  # of numbers
# settings of the style that all figures share
SHARED = ("template",)
# results that are compared; with itself: with its numbers stretched
PAIRS = (
    ("measured", "unlike_harmonics"),
    ("impacting", "impacting"),
    ("waves", "waves"),
    ("backbone", "backbone"),
    ("limit_cycles", "limit_cycles"),
)
Lines = list[str]


def every() -> list[str]:
    """Return the names of what is held: results, and pairs of them."""
    results = [path.name.removesuffix(".nc.gz") for path in STORED.glob("*.nc.gz")]
    return [*sorted(results), *map("+".join, PAIRS)]


def now(name: str, folder: Path) -> Lines:
    """Return what is shown of a result, or of two that are compared."""
    first, _, second = name.partition("+")
    tree = tree_of(first, folder)
    if not second:
        return shown(tree)
    return compared(tree, stretched(tree) if second == first else tree_of(second, folder))


def tree_of(name: str, folder: Path) -> xr.DataTree:
    """Return a stored result."""
    path = folder / f"{name}.nc"
    path.write_bytes(gzip.decompress((STORED / f"{name}.nc.gz").read_bytes()))
    return read_tree(path)


def held(name: str) -> Lines:
    """Return what was written of a stored result."""
    return gzip.decompress((STORED / f"{name}.txt.gz").read_bytes()).decode().split("\n")


def shown(tree: xr.DataTree) -> Lines:
    """Return what the page, the terminal and Python show of a result, in lines."""
    found = [f"page{line}" for line in lines("", _given(page, lambda: page.report_html(tree)))]
    for name in (n for n in ANALYSES if n in tree.children):
        analysis, data = named(name), tree[name].to_dataset()
        found += [f"{name}.terminal{line}" for line in lines("", analysis.summary(data))]
        found += [f"{name}.verdicts{line}" for line in lines("", analysis.verdicts(data))]
    result = Result(tree)
    frames = {name: result.to_dataframe(name).to_dict("list") for name in result}
    return [*found, *(f"frames{line}" for line in lines("", frames))]


def compared(tree: xr.DataTree, other: xr.DataTree) -> Lines:
    """Return what the page of a comparison shows, in lines."""
    designs = [Design(name, own, k) for k, (name, own) in enumerate((("first", tree), ("second", other)))]
    return [f"compared{line}" for line in lines("", _given(side_by_side, lambda: comparison_html(designs)))]


def stretched(tree: xr.DataTree) -> xr.DataTree:
    """Return a result with all its real numbers 7 % larger."""
    nodes = {name: node.to_dataset() for name, node in tree.children.items()}
    for name, data in nodes.items():
        own = {v: data[v] * 1.07 for v in data.data_vars if data[v].dtype.kind == "f"}
        nodes[name] = data.assign({v: value.assign_attrs(data[v].attrs) for v, value in own.items()})
    return xr.DataTree.from_dict({"/": tree.to_dataset(), **nodes})


def _given(where: ModuleType, make: Callable[[], str]) -> Mapping[str, Any]:
    """Return what the template of a page is given."""
    given: dict[str, Any] = {}

    def kept(title: str, made: str, chapters: Sequence[Any], **more: Any) -> str:
        given.update(title=title, made=made, chapters=chapters, **more)
        return ""

    with patch.object(where, "page_html", kept), patch("stickslip.report.frame.to_html", lambda *_, **__: ""):
        make()
    return given


def lines(place: str, value: Any) -> Iterator[str]:
    """Yield a line for each text and number inside a value."""
    inside = _inside(value)
    if inside is not None:
        for key, own in inside:
            yield from lines(f"{place}{key}", own)
    elif isinstance(value, str | bool) and value != "":
        yield f"{place} {value}".replace("\n", "\\n")
    elif isinstance(value, int | float | np.number):
        yield f"{place} {_number(float(value))}"
    elif value is not None and not isinstance(value, str):
        yield f"{place} {_numbers(value) or type(value).__name__}"


def _inside(value: Any) -> list[tuple[str, Any]] | None:
    """Return what a value holds, with its places; None for a text, a number and a list of numbers."""
    if isinstance(value, go.Figure):
        return _inside(value.to_plotly_json())
    if is_dataclass(value) and not isinstance(value, type):
        return [(f".{f.name}", getattr(value, f.name)) for f in fields(value) if f.repr]
    if isinstance(value, Mapping):
        return [(f".{key}", own) for key, own in value.items() if key not in SHARED]
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str) and _numbers(value) is None:
        return [(f"[{i}]", own) for i, own in enumerate(value)]
    return None


def _number(value: float) -> str:
    return f"{value:.{DIGITS}g}" if abs(value) > 1e-15 else "0"


def _numbers(value: Any) -> str | None:
    """Return numbers in short: how many, and three that hang on each of them and on their order; None for what are none."""
    try:
        given = np.asarray(value)
        if np.iscomplexobj(given):
            given = np.stack([given.real, given.imag], axis=-1)
        numbers = np.asarray(given, dtype=float).ravel()
    except (TypeError, ValueError):
        return None
    if not numbers.size:
        return "none"
    known = np.nan_to_num(numbers, nan=0.0, posinf=1e30, neginf=-1e30)
    weight = 1.0 + np.abs(np.sin(np.arange(1.0, numbers.size + 1)))
    sums = (np.abs(known).max(), np.sum(weight * np.abs(known)), np.sum(weight * (known > 0) * known))
    return f"{numbers.size} {int(np.isnan(numbers).sum())} {' '.join(map(_number, sums))}"


def differences(new: Lines, old: Lines) -> Lines:
    """Return the lines that differ; numbers may differ in their last digits."""
    if len(new) == len(old):
        return [f"- {b}\n+ {a}" for a, b in zip(new, old, strict=True) if not _same(a, b)]
    gone, come = set(old) - set(new), set(new) - set(old)
    return [*(f"- {b}" for b in old if b in gone), *(f"+ {a}" for a in new if a in come)]


def _same(one: str, other: str) -> bool:
    if one == other:
        return True
    pairs = list(zip(one.split(" "), other.split(" "), strict=False))
    return len(one.split(" ")) == len(other.split(" ")) and all(a == b or _close(a, b) for a, b in pairs[1:])


def _close(one: str, other: str) -> bool:
    try:
        return math.isclose(float(one), float(other), rel_tol=10.0 ** (2 - DIGITS), abs_tol=1e-14)
    except ValueError:
        return False


def main() -> None:
    """Write what is shown now."""
    with TemporaryDirectory() as folder:
        for name in every():
            new = now(name, Path(folder))
            path = STORED / f"{name}.txt.gz"
            changed = differences(new, held(name)) if path.exists() else new
            if changed:
                path.write_bytes(gzip.compress("\n".join(new).encode(), mtime=0))
            print(f"{name}: {len(new)} lines, {len(changed)} changed")


if __name__ == "__main__":
    main()
