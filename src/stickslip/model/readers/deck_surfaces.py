"""Surfaces of CalculiX and Abaqus decks, and what couples them: cyclic symmetry, ties, couplings with a reference node."""

from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.mesh.facets import centres, interpolation, positions
from stickslip.model.mesh.nearest_facets import closest, near_pairs
from stickslip.model.mesh.solid_mesh import CORNERS, EDGES, by_kind
from stickslip.model.readers.deck_links import read_coupling, read_distributing
from stickslip.model.readers.deck_model import DeckModel, nodes_named, passed_over, unknown, unread
from stickslip.model.readers.keywords import Block, real_number, unique_in_order, whole_number

WIDEST = 8  # nodes of a facet
TIE_REACH = 0.025  # of the mean size of the facets: the tolerance that CalculiX takes if a deck gives none
LEAST_WEIGHT = 1e-12
# corners of the faces S1, S2, …, counted from 0, by number of corners of a cell
FACES: dict[int, tuple[tuple[int, ...], ...]] = {
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    5: ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0)),
    6: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}


def tie_faces(model: DeckModel, blocks: list[Block], ignore: tuple[str, ...]) -> None:
    """Add the faces of cyclic ties to the model, and the equations of other ties; refuse several instances.

    Parameters
    ----------
    model
        Model from the other keywords.
    blocks
        Blocks of the whole file.
    ignore
        Keywords to ignore although they change the model.

    Raises
    ------
    InputError
        If the surfaces of a tie are missing or lie apart, or a cyclic one has no number of sectors.
    """
    passed = passed_over(ignore)
    instances = [b for b in blocks if b.keyword == "INSTANCE"]
    moved = len(instances) > 1 or any(list(b.rows()) for b in instances)
    if moved and "INSTANCE" not in passed:
        raise unread(instances[-1], "several instances, or a moved one, are not read")
    surfaces = {b.parameter("NAME").upper(): b for b in blocks if b.keyword == "SURFACE"}
    for block in blocks:
        if block.keyword != "TIE" or "TIE" in passed:
            continue
        if "CYCLIC SYMMETRY" not in block.parameters:
            _tie(model, block, surfaces)
            continue
        rows = list(block.rows())
        if len(rows) != 1 or len(rows[0][1]) < 2:
            raise input_error(block.place, "needs one line with two surfaces", "Add it.")
        place, fields = rows[0]
        low, high = (_surface_nodes(model, surfaces, name.upper(), place) for name in fields[:2])
        model.ties.append((low, high))
        if block.parameters.get("POSITION TOLERANCE"):
            reach = real_number(block.parameters["POSITION TOLERANCE"], block.place, "POSITION TOLERANCE")
            model.reach = max(model.reach, reach)
        if model.sectors is None:
            raise input_error(
                block.place,
                "is cyclic, but nothing says how many sectors there are",
                "Add *CYCLIC SYMMETRY MODEL, N=….",
            )


def couple(model: DeckModel, blocks: list[Block], ignore: tuple[str, ...]) -> None:
    """Add the couplings of surfaces with reference nodes to the links of the model."""
    passed = passed_over(ignore)
    surfaces = {b.parameter("NAME").upper(): b for b in blocks if b.keyword == "SURFACE"}
    for block, below in pairwise([*blocks, Block("END", {}, blocks[-1].path, 0)]):
        if block.keyword != "COUPLING" or "COUPLING" in passed:
            continue
        name = block.parameter("SURFACE").upper()
        read = read_coupling
        if below.keyword == "DISTRIBUTING":
            kind = surfaces[name].parameters.get("TYPE", "ELEMENT").upper() if name in surfaces else "NODE"
            if not model.of_abaqus or kind != "NODE":
                raise unread(
                    below,
                    "is read in decks of Abaqus for surfaces of nodes alone: CalculiX leaves it out of vibrations, and weights of "
                    "faces are not known",
                )
            read = read_distributing
        elif below.keyword != "KINEMATIC":
            raise unread(
                block, "a *COUPLING without *KINEMATIC or *DISTRIBUTING in the next line ties nodes and is not read"
            )
        surface = _surface_nodes(model, surfaces, name, block.place)
        read(model.links, block, below, partial(nodes_named, model), model.nodes, surface)


def _surface_nodes(model: DeckModel, surfaces: dict[str, Block], name: str, place: str) -> IntArray:
    if name not in surfaces:
        raise unknown(place, "surface", name, list(surfaces))
    block = surfaces[name]
    kind = block.parameters.get("TYPE", "ELEMENT").upper()
    if kind == "NODE":
        parts = [nodes_named(model, fields[0], where) for where, fields in block.rows()]
    elif kind == "ELEMENT":
        parts = [_face_nodes(model, fields, where) for where, fields in block.rows()]
    else:
        raise input_error(block.place, f"a surface of TYPE={kind} is not read", "Use TYPE=NODE or ELEMENT.")
    if not parts:
        raise input_error(block.place, "holds no nodes", "List node sets or element faces.")
    return unique_in_order(np.concatenate(parts))


def _face_nodes(model: DeckModel, fields: list[str], place: str) -> IntArray:
    """Return the nodes of ``element or set, face``, e.g. ``SIDE, S3``."""
    rows = _cells_named(model, fields[0], place)
    facets = _facets(model, rows, fields, place)
    return facets[facets >= 0]


def _facets(model: DeckModel, rows: IntArray, fields: list[str], place: str) -> IntArray:
    """Return (f, 8) node numbers of the same face of some cells: corners, then the middle of each edge; -1 fills the ends."""
    face = fields[1].upper() if len(fields) > 1 else ""
    found = []
    for width, own in by_kind(model.cells[rows, 1:]):
        faces = FACES[CORNERS[width]]
        if face not in {f"S{i}" for i in range(1, len(faces) + 1)}:
            raise input_error(
                place, f"{face!r} is no face of {model.kinds[rows[own[0]]]}", f"Write S1 to S{len(faces)}."
            )
        corners = faces[int(face[1:]) - 1]
        middles = []
        if width > CORNERS[width]:
            place_of = {frozenset(ends): CORNERS[width] + i for i, ends in enumerate(EDGES[CORNERS[width]])}
            middles = [place_of[frozenset(ends)] for ends in pairwise([*corners, corners[0]])]
        local = [1 + i for i in (*corners, *middles)]
        block = np.full((own.size, WIDEST), -1)
        block[:, : len(local)] = model.cells[rows[own]][:, local]
        found.append(block)
    return np.concatenate(found).astype(np.int64)


def _tie(model: DeckModel, block: Block, surfaces: dict[str, Block]) -> None:
    """Let the nodes of the first surface of a tie follow the facets of the second, onto which they are moved."""
    for place, fields in block.rows():
        if len(fields) < 2:
            raise input_error(place, "needs two surfaces", "Write the one that follows, then the other.")
        slave = _surface_nodes(model, surfaces, fields[0].upper(), place)
        master = _surface_facets(model, surfaces, fields[1].upper(), place)
        slave = slave[~np.isin(slave, master)]
        facets = np.where(master >= 0, model.nodes.index(np.where(master >= 0, master, master[:, :1])), -1)
        points = model.nodes.points
        size = float(np.ptp(points[facets[:, :3]], axis=1).max(axis=1).mean())
        reach = TIE_REACH * size
        if block.parameters.get("POSITION TOLERANCE"):
            reach = real_number(block.parameters["POSITION TOLERANCE"], block.place, "POSITION TOLERANCE")
        rows = model.nodes.index(slave)
        facet, reference, distance = _nearest(points, facets, rows, reach)
        met = np.flatnonzero(distance <= reach)
        if not met.size:
            raise input_error(
                place,
                f"no node of {fields[0]!r} lies within {reach:.3g} of {fields[1]!r}",
                "Correct the surfaces, or raise POSITION TOLERANCE.",
            )
        if met.size < slave.size:
            model.ignored.append(
                f"the tie of {slave.size - met.size} of {slave.size} nodes of {fields[0]}, which lie further than {reach:.3g} "
                f"from {fields[1]} ({place})"
            )
        _follow_facets(model, f"{place}, *TIE", slave[met], facets[facet[met]], reference[met])
        if block.parameters.get("ADJUST", "YES").upper() != "NO":
            moved = points.copy()
            moved[rows[met]] = positions(points, facets[facet[met]], reference[met])
            model.nodes = replace(model.nodes, points=moved)


def _follow_facets(model: DeckModel, place: str, nodes: IntArray, facets: IntArray, reference: FloatArray) -> None:
    weights = interpolation(facets, reference)
    numbers = model.nodes.numbers
    for node, own, share in zip(nodes.tolist(), facets, weights, strict=True):
        used = np.flatnonzero((own >= 0) & (np.abs(share) > LEAST_WEIGHT))
        for direction in (1, 2, 3):
            terms = [(int(numbers[own[k]]), direction, -float(share[k])) for k in used]
            model.links.equations.append((place, [(node, direction, 1.0), *terms]))


def _nearest(
    points: FloatArray, facets: IntArray, rows: IntArray, reach: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return for each node (a row of points) its nearest facet, reference coordinates there, and the distance; infinite beyond `reach`."""
    middle = positions(points, facets, centres(facets))
    radius = np.where(facets >= 0, np.linalg.norm(points[facets] - middle[:, None], axis=2), 0.0).max(axis=1)
    point, near = near_pairs(points[rows], np.zeros(rows.size), middle, radius, reach)
    with np.errstate(divide="ignore", invalid="ignore"):  # a facet without area is near nothing
        reference, _ = closest(points, facets[near], points[rows[point]])
    away = np.linalg.norm(points[rows[point]] - positions(points, facets[near], reference), axis=1)
    order = np.lexsort((away, point))
    best = order[np.unique(point[order], return_index=True)[1]]
    facet, at, distance = np.zeros(rows.size, dtype=np.int64), np.zeros((rows.size, 2)), np.full(rows.size, np.inf)
    facet[point[best]], at[point[best]], distance[point[best]] = near[best], reference[best], away[best]
    return facet, at, distance


def _surface_facets(model: DeckModel, surfaces: dict[str, Block], name: str, place: str) -> IntArray:
    """Return the (f, 8) node numbers of the facets of a surface of element faces."""
    if name not in surfaces:
        raise unknown(place, "surface", name, list(surfaces))
    block = surfaces[name]
    if block.parameters.get("TYPE", "ELEMENT").upper() != "ELEMENT":
        raise input_error(
            block.place, f"{name!r} is a surface of nodes, which others cannot follow", "Define it by element faces."
        )
    parts = [_facets(model, _cells_named(model, fields[0], where), fields, where) for where, fields in block.rows()]
    if not parts:
        raise input_error(block.place, "holds no faces", "List element faces.")
    return np.concatenate(parts)


def _cells_named(model: DeckModel, name: str, place: str) -> IntArray:
    """Return the rows of the cells of an element set, or of one element."""
    if name.upper() in model.element_sets:
        numbers = model.element_sets[name.upper()]
    else:
        numbers = np.array([whole_number(name, place, "element")])
    rows = np.flatnonzero(np.isin(model.cells[:, 0], numbers))
    if not len(rows):
        raise unknown(place, "element or element set", name, list(model.element_sets))
    return rows
