"""The model on the page: drawing of its skin and contact points, accuracy of the reduction, and facts."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from stickslip.analyses.pictures.skin import skin_picture
from stickslip.arrays import FloatArray
from stickslip.report.content import Table
from stickslip.report.plot import Plot
from stickslip.report.quantities import NONE, fixed, number, percent, quantity
from stickslip.report.result import Node

_CHECKED = (
    ("free", "frequency_full_hz", "frequency_reduced_hz"),
    ("stuck", "frequency_stuck_full_hz", "frequency_stuck_reduced_hz"),
)


def picture(nodes: Mapping[str, Node]) -> Plot | None:
    """Return the drawing of the skin with the contacts, if an analysis stores them."""
    found = (skin_picture(node) for node in nodes.values())
    return next((plot for plot in found if plot is not None), None)


def reduction(nodes: Mapping[str, Node]) -> Table | None:
    """Compare the frequencies of the full and the reduced model."""
    node = next((n for n in nodes.values() if n.has(*_CHECKED[0][1:])), None)
    if node is None:
        return None
    rows, off = [], []
    for name, full, reduced in _CHECKED:
        if node.has(full, reduced):
            a, b = (of_first_case(node, n) for n in (full, reduced))
            with np.errstate(divide="ignore", invalid="ignore"):
                difference = np.where(a > 0, b / a - 1, np.nan)
            cells = zip(a, b, difference, strict=True)
            rows += [
                [f"{name} {k + 1}", fixed(float(x), 3), fixed(float(y), 3), percent(100 * d)]
                for k, (x, y, d) in enumerate(cells)
                if np.isfinite(x)
            ]
            off += np.abs(difference[np.isfinite(difference)]).tolist()
    worst = percent(100 * max(off)) if off else NONE
    text = f"The reduced model reproduces the frequencies of the full one within {worst}."
    head = ["mode", "full (Hz)", "reduced (Hz)", "difference"]
    return Table(head, rows, "Reduction", (text,)) if rows else None


def of_first_case(node: Node, name: str) -> FloatArray:
    """Return a variable of the first case."""
    found = node.data[name]
    return np.asarray((found.isel(case=0) if "case" in found.dims else found).values, dtype=float)


def facts(nodes: Mapping[str, Node]) -> Table | None:
    """Return mass, centre, size and counts of the model."""
    node = _together(nodes)
    if node.stored("mass_kg") is None:
        return None
    sectors = int(node.scalar("sectors", 1))
    stages = node.text("stages")
    sectors = 1 if stages else sectors
    mass, each = node.scalar("mass_kg"), " of a sector" if sectors > 1 else ""
    rows = [
        ["stages", stages or NONE],
        ["sectors", str(sectors) if sectors > 1 else NONE],
        [f"mass{each}", quantity(1e3 * mass, "g", 6)],
        ["mass of the wheel", quantity(1e3 * sectors * mass, "g", 6) if sectors > 1 else NONE],
        [f"centre of mass{each}", _lengths(node.numbers("centre_m"))],
        ["box from", _lengths(node.numbers("box_low_m"))],
        ["box to", _lengths(node.numbers("box_high_m"))],
        *([text, fixed(node.scalar(name), 0)] for name, text in _COUNTS),
        ["rotation", node.text("rotation") or NONE],
        *_static(node),
    ]
    return Table((), [row for row in rows if row[1] != NONE], "Facts", numeric=False)


def _together(nodes: Mapping[str, Node]) -> Node:
    """Return the facts about the model from the first analysis that stores them."""
    each = [node.data for node in reversed(list(nodes.values()))]
    told = {n: v.variable for data in each for n, v in data.data_vars.items() if set(v.dims) <= {"xyz"}}
    return Node(xr.Dataset(told, attrs={k: v for data in each for k, v in data.attrs.items()}))


_COUNTS = (
    ("nodes", "nodes"),
    ("elements", "elements"),
    ("dofs", "free degrees of freedom"),
    ("reduced", "coordinates of the reduced model"),
    ("retained", "coordinates of contacts and rigid bodies"),
)


def _static(node: Node) -> list[list[str]]:
    """Return the effects of the centrifugal load, if something rotates."""
    displacement = node.scalar("static_displacement_m")
    if not np.isfinite(displacement):
        return []
    rpm = number(node.scalar("static_rpm"), 5)
    strain = percent(100 * node.scalar("static_strain"), 3)
    degrees = number(float(np.degrees(node.scalar("static_rotation_rad"))), 3)
    return [
        [f"largest static displacement at {rpm} rpm", f"{number(1e3 * displacement, 4)} mm"],
        ["with strains and rotations up to", f"{strain}, {degrees}°"],
    ]


def _lengths(values: np.ndarray) -> str:
    if values.size != 3 or not np.isfinite(values).all():
        return NONE
    return f"({', '.join(number(float(v) * 1e3, 5) for v in values)}) mm"


PARTS = (reduction, facts)
