"""Meshes from ANSYS archives (``.cdb``), where wedges, pyramids and tetrahedra are bricks with repeated nodes."""

from collections.abc import Iterable
from functools import cache
from pathlib import Path

import numpy as np

from stickslip.arrays import IntArray
from stickslip.errors import input_error
from stickslip.model.mesh.solid_mesh import EDGES, FACES, SolidMesh
from stickslip.model.readers.ansys_blocks import (
    CONSTRAINTS,
    CUT_SHORT,
    DAMPING,
    NUMBER,
    OPTIONS,
    ROTATIONS,
    SUPPORTS,
    TYPE,
    WRITE,
    Blocks,
    is_whole,
    read_blocks,
)
from stickslip.model.readers.ansys_materials import is_elastic_table
from stickslip.model.readers.units import Units

Face = tuple[int, ...]


def regular_nodes(nodes: IntArray) -> IntArray | None:
    """Return the nodes of the cell that a brick of 8 or 20 nodes stands for, in VTK order; None if it is no known shape.

    Corners may be repeated in any way that leaves a hexahedron, wedge, pyramid or tetrahedron. Mid-side nodes of edges
    without length are left out.
    """
    corners = nodes[:8].tolist()
    pattern = tuple(corners.index(node) for node in corners)
    found = _positions(pattern, len(nodes) > 8)
    if found is None:
        return None
    for same in found[1]:
        if len(set(nodes[list(same)].tolist())) > 1:
            return None  # two mid-side nodes on one edge
    cell = nodes[list(found[0])]
    return cell if len(np.unique(cell)) == len(cell) and (cell > 0).all() else None


@cache
def _positions(pattern: Face, second: bool) -> tuple[Face, tuple[Face, ...]] | None:
    """Return the places of a cell's nodes among those of the brick, and places that must hold the same node.

    `pattern` has for each corner the first corner with the same node.
    """
    corners = _corners(pattern)
    if corners is None or not second:
        return None if corners is None else (corners, ())
    middles: dict[Face, list[int]] = {}
    for place, (a, b) in enumerate(EDGES[8], 8):
        if pattern[a] != pattern[b]:
            middles.setdefault(_pair(pattern[a], pattern[b]), []).append(place)
    own = [middles[_pair(corners[a], corners[b])] for a, b in EDGES[len(corners)]]
    return (*corners, *(places[0] for places in own)), tuple(tuple(places) for places in own if len(places) > 1)


def _corners(pattern: Face) -> Face | None:
    """Return the corners of the cell in VTK order; None for other shapes."""
    faces = [_without_repeats(pattern[i] for i in face) for face in FACES[8]]
    faces = [face for face in faces if len(face) > 2]
    count, kinds = len(set(pattern)), sorted(len(face) for face in faces)
    if count == 8:
        return tuple(range(8))
    if count == 6 and kinds == [3, 3, 4, 4, 4]:
        low = next(face for face in faces if len(face) == 3)[::-1]  # faces are seen from outside, the base from inside
        sides = [face for face in faces if len(face) == 4]
        above = [_beside(corner, low, sides) for corner in low]
        return None if None in above else (*low, *(corner for corner in above if corner is not None))
    if (count, kinds) in ((5, [3, 3, 3, 3, 4]), (4, [3, 3, 3, 3])):
        base = max(faces, key=len)[::-1]
        (top,) = set(pattern) - set(base)
        return (*base, top)
    return None


def _beside(corner: int, base: Face, sides: Iterable[Face]) -> int | None:
    """Return the corner above one of the base of a wedge: its neighbour in a quadrilateral that is not of the base."""
    for side in sides:
        if corner in side:
            at = side.index(corner)
            for other in (side[at - 1], side[(at + 1) % 4]):
                if other not in base:
                    return other
    return None


def _without_repeats(face: Iterable[int]) -> Face:
    return tuple(dict.fromkeys(face))


def _pair(a: int, b: int) -> Face:
    return (a, b) if a < b else (b, a)


COUPLED = ("coupled_1", "coupled_2")
NODES_OF_SOLID = {185: (8, 4), 186: (20,), 187: (10, 4)}  # element type -> numbers of nodes of regular shapes
# values of KEYOPT other than 0 that do not change how these solids are read: full integration of SOLID186, and output options
HARMLESS_OPTIONS = {(186, 2): ("1",), (185, 5): ("1", "2"), (186, 5): ("1", "2"), (187, 5): ("1", "2")}
WHAT_OPTIONS = {
    (185, 2): "another integration than full: reduced, or with enhanced strains",
    (185, 3): "layers",
    (186, 3): "layers",
    (185, 6): "a pressure of its own",
    (186, 6): "a pressure of its own",
    (187, 6): "a pressure of its own",
}
# material tables without effect on small vibration: plasticity, creep, and friction of contacts
BEYOND_VIBRATION = {
    "PLAS",
    "BISO",
    "BKIN",
    "MISO",
    "MKIN",
    "KINH",
    "NLIS",
    "CHAB",
    "CREE",
    "RATE",
    "FRIC",
    "CZM",
    "FAIL",
    "FCLI",
}
WITHOUT_STIFFNESS = {154, 200}  # surface effect elements for pressures, and mesh-only elements


def read_ansys_archive(path: Path | str, *, units: Units | None = None, linked: bool = False) -> SolidMesh:
    """Read the solid elements of an ANSYS archive.

    Parameters
    ----------
    path
        The ``.cdb`` file: ``CDWRITE,DB,model,cdb`` with elements of the types SOLID185, SOLID186 or SOLID187.
    units
        Unit system of the model, SI by default: the file does not say.
    linked
        Whether equations (CE) and couplings (CP) other than pairs of nodes are accepted: the mesh does not have them, a study reads them.

    Returns
    -------
    SolidMesh
        Bricks with repeated nodes are wedges, pyramids and tetrahedra. In metres, with the numbers of nodes and elements; node components are node sets in lower case, and ``coupled_1`` and
        ``coupled_2`` contain the first and the second nodes of coupled pairs (CP), as between the faces of a sector.

    Raises
    ------
    InputError
        If the file is damaged; if elements lack mid-side nodes, have repeated nodes in an unknown way, or have stiffness but are
        no solids.
    """
    units = Units.si() if units is None else units
    path = Path(path)
    blocks = read_blocks(path)
    kept = _solids(path, blocks)
    cells = _cells(path, blocks, kept)
    own = cells >= 0
    used = np.unique(cells[own])
    order = np.argsort(blocks.numbers, kind="stable")
    numbers = blocks.numbers[order]
    missing = np.setdiff1d(used, numbers)
    if len(missing):
        raise input_error(str(path), f"has elements at node {missing[0]}, which is not there", CUT_SHORT)
    points = blocks.points[order][np.searchsorted(numbers, used)]
    named = dict(blocks.node_sets) | dict(zip(COUPLED, _coupled(blocks, linked=linked).T, strict=True))
    sets = {name: np.flatnonzero(np.isin(used, members)) for name, members in named.items()}
    return SolidMesh(
        units.length * points,
        np.where(own, np.searchsorted(used, cells), -1),
        {name: members for name, members in sets.items() if len(members)},
        used,
        blocks.heads[kept, NUMBER],
    )


def ansys_passed_over(path: Path | str) -> tuple[str, ...]:
    """Return the ignored commands of an archive whose content a study must define itself: supports, damping.

    Raises
    ------
    InputError
        If a material table (TB) changes stiffness or damping.
    """
    found: dict[str, list[str]] = {}
    for place, (command, *words) in read_blocks(Path(path)).commands:
        word = command.upper()
        if word == "TB" and words and words[0].upper()[:4] not in BEYOND_VIBRATION and not is_elastic_table(words):
            raise input_error(
                place,
                f"gives a material by a table (TB,{words[0]}), and of these only ANEL and ELAS (AELS, AELF) are read",
                "Let ANSYS write its matrices (read_ansys_full), or delete the table where the model is the same without.",
            )
        if word in SUPPORTS or (word in DAMPING and any(map(_nonzero, words))):
            found.setdefault(word, []).append(place.rpartition(": ")[2])
    what = {"D": "supports: name sets of nodes that are clamped"}
    return tuple(
        f"{len(lines)} commands {word} (from {lines[0]} on), {what.get(word, 'damping: state it in the study')}"
        for word, lines in found.items()
    )


def _nonzero(word: str) -> bool:
    try:
        return float(word or 0) != 0
    except ValueError:
        return True


def ansys_speed(path: Path, units: Units) -> float:
    """Return the speed of an archive (OMEGA) in rad/s; 0 if it has none.

    Raises
    ------
    InputError
        If the archive defines rotation by another command than OMEGA.
    """
    speed = 0.0
    for place, (command, *rest) in read_blocks(path).commands:
        if command.upper() not in ROTATIONS:
            continue
        try:
            own = np.array([float(word or 0) for word in (*rest, "", "", "")[:3]])
        except ValueError:
            own = np.full(3, np.nan)  # CMOMEGA names a component first
        if command.upper() == "OMEGA" and np.isfinite(own).all():
            speed = float(np.linalg.norm(own)) / units.time
        elif np.any(own != 0):
            raise input_error(
                place,
                f"rotates by {command.upper()}, and rotation is read as OMEGA and three numbers alone",
                "Turn all of the model about one axis with OMEGA, or delete the command.",
            )
    return speed


def _coupled(blocks: Blocks, *, linked: bool) -> IntArray:
    """Return the (k, 2) numbers of nodes coupled in pairs (CP); refuse other couplings and constraint equations."""
    pairs: dict[tuple[int, int], None] = {}
    for place, (command, *words) in blocks.commands:
        if command.upper() not in CONSTRAINTS:
            continue
        nodes = words[2:] if command.upper() == "CP" else []
        if len(nodes) != 2 or not all(map(is_whole, nodes)):
            if linked:
                continue
            raise input_error(
                place,
                f"constrains the model ({command.upper()}), and a mesh has coupled pairs of nodes alone (CP)",
                "Use the archive in a study, which reads equations; delete it (CEDELE, CPDELE), or let ANSYS write its matrices.",
            )
        pairs[int(nodes[0]), int(nodes[1])] = None
    return np.array([*pairs], dtype=np.int64).reshape(-1, 2)


def _check_options(blocks: Blocks) -> None:
    """Refuse element options (KEYOPT) that change the matrices of a solid in use."""
    used = set(blocks.heads[:, TYPE].tolist())
    for place, (command, *words) in blocks.commands:
        if command.upper() not in OPTIONS:
            continue
        number, option, value = (word.rstrip(".") for word in [*words, "0", "0", "0"][:3])
        kind = blocks.types.get(int(number), 0) if is_whole(number) else 0
        if kind not in NODES_OF_SOLID or int(number) not in used or value in ("", "0"):
            continue
        key = (kind, int(option)) if is_whole(option) else (kind, 0)
        if value not in HARMLESS_OPTIONS.get(key, ()):
            what = WHAT_OPTIONS.get(key, "what is not read")
            raise input_error(
                place,
                f"KEYOPT({option}) = {value} of SOLID{kind}: {what}",
                "Use elements without it, such as SOLID186, or let ANSYS write its matrices (read_ansys_full).",
            )


def _solids(path: Path, blocks: Blocks) -> IntArray:
    """Return the rows of the solid elements; refuse other elements with stiffness."""
    kinds = np.array([blocks.types.get(int(t), 0) for t in blocks.heads[:, TYPE]], dtype=np.int64)
    others = sorted(set(kinds.tolist()) - NODES_OF_SOLID.keys() - WITHOUT_STIFFNESS)
    if others:
        raise input_error(
            str(path), f"has elements of the types {others}; a mesh of solids holds SOLID185, 186 and 187", WRITE
        )
    _check_options(blocks)
    rows = np.flatnonzero(np.isin(kinds, list(NODES_OF_SOLID)))
    if not len(rows):
        raise input_error(str(path), "has no elements SOLID185, 186 or 187", WRITE)
    for row in rows:
        nodes, allowed = blocks.nodes[row], NODES_OF_SOLID[int(kinds[row])]
        place = f"{path}: element {blocks.heads[row, NUMBER]}, SOLID{kinds[row]}"
        if len(nodes) not in allowed or (nodes <= 0).any():
            raise input_error(
                place,
                f"has {int((nodes > 0).sum())} nodes, regular are {' or '.join(map(str, allowed))}",
                "Mesh with mid-side nodes in all places (EMID,ADD).",
            )
    return np.asarray(rows)


def _cells(path: Path, blocks: Blocks, kept: IntArray) -> IntArray:
    """Return the (m, k) node numbers of the solids in VTK order; -1 fills the ends of shorter rows."""
    found = []
    for row in kept:
        nodes = blocks.nodes[row]
        cell = nodes if len(nodes) in (4, 10) else regular_nodes(nodes)
        if cell is None or len(np.unique(cell)) < len(cell):
            raise input_error(
                f"{path}: element {blocks.heads[row, NUMBER]}, SOLID{blocks.types[int(blocks.heads[row, TYPE])]}",
                "has repeated nodes that make it no wedge, pyramid or tetrahedron",
                "Mesh this place anew.",
            )
        found.append(cell)
    cells = np.full((len(found), max(map(len, found))), -1)
    for i, cell in enumerate(found):
        cells[i, : len(cell)] = cell
    return cells
