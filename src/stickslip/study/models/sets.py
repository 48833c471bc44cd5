"""Node sets that a study picks from a file: by names, in a box, in a cylinder."""

from collections.abc import Mapping
from fnmatch import fnmatchcase

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.errors import InputError, input_error, nearest_and_known
from stickslip.study.file.model.sets import SetTable

EDGE = 1e-9  # of the size of the mesh, by which boxes and cylinders are larger: nodes lie on their faces


def with_sets(
    key: str, tables: Mapping[str, SetTable], points: FloatArray, known: Mapping[str, IntArray]
) -> dict[str, IntArray]:
    """Return the sets of a file and those that a study picks.

    Parameters
    ----------
    key
        Of the part, for messages.
    tables
        By name.
    points
        (n, 3) places in m of what sets hold by index: nodes, or dofs; NaN without a place.
    known
        Sets of the file.

    Raises
    ------
    InputError
        If the file has a set of that name, or nothing is picked.
    """
    found = dict(known)
    for name, table in tables.items():
        place = f"{key}.sets.{name}"
        if name.lower() in {own.lower() for own in known}:
            raise input_error(place, "is the name of a set of the file", "Choose a name that the file does not use.")
        members = np.flatnonzero(_picked(place, table, points, known))
        if not members.size:
            raise _nothing(place, table, points)
        found[name] = members
    return found


def _picked(place: str, table: SetTable, points: FloatArray, known: Mapping[str, IntArray]) -> BoolArray:
    inside = np.ones(len(points), dtype=bool)
    edge = EDGE * float(np.ptp(_placed(points), axis=0).max(initial=0.0))
    if table.pattern is not None:
        names = [n for n in known if fnmatchcase(n.lower(), table.pattern.lower())]
        if not names:
            raise input_error(
                f"{place}.pattern",
                f"fits no set of the file, got {table.pattern!r}",
                nearest_and_known(table.pattern, list(known)),
            )
        inside &= np.isin(np.arange(len(points)), np.concatenate([known[n] for n in names]))
    if table.box_m is not None:
        low, high = np.sort(np.array(table.box_m), axis=0)
        inside &= ((points >= low - edge) & (points <= high + edge)).all(axis=1)
    if table.cylinder_m is not None and table.radius_m is not None:
        first, last = np.array(table.cylinder_m)
        length = float(np.linalg.norm(last - first))
        along = (points - first) @ (last - first) / length
        from_axis = np.linalg.norm(points - first - np.outer(along, (last - first) / length), axis=1)
        inner, outer = table.radius_m
        inside &= (along >= -edge) & (along <= length + edge)
        inside &= (from_axis >= inner - edge) & (from_axis <= outer + edge)
    return inside


def _placed(points: FloatArray) -> FloatArray:
    return points[np.isfinite(points).all(axis=1)]


def _nothing(place: str, table: SetTable, points: FloatArray) -> InputError:
    placed = _placed(points)
    if not placed.size:
        return input_error(place, "picks none: no node has a place", "Give matrices their nodes.")
    low, high = (", ".join(f"{v:.5g}" for v in c) for c in (placed.min(axis=0), placed.max(axis=0)))
    keys = [k for k in ("pattern", "box_m", "cylinder_m", "radius_m") if getattr(table, k) is not None]
    got = ", ".join(f"{k} = {getattr(table, k)!r}" for k in keys)
    return input_error(
        place,
        f"picks none of the nodes, got {got}",
        f"The nodes lie between [{low}] and [{high}] m, whatever the file's units: widen it.",
    )
