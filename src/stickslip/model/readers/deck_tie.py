"""The cyclic tie of a CalculiX or Abaqus deck: which nodes lie on the two faces of a sector."""

import numpy as np

from stickslip.arrays import IntArray
from stickslip.errors import input_error
from stickslip.model.mesh.solid_mesh import HEX_EDGES, TET_EDGES
from stickslip.model.readers.deck_model import DeckModel, nodes_named, passed_over, unknown, unread
from stickslip.model.readers.keywords import Block, unique_in_order, whole_number

# corners of the faces S1, S2, …, counted from 0
TET_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
HEX_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))


def tie_faces(model: DeckModel, blocks: list[Block], ignore: tuple[str, ...]) -> None:
    """Add the faces of the cyclic tie to the model; refuse other ties, and several instances.

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
        If a tie is not cyclic, or its surfaces are missing.
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
            raise unread(block, "a *TIE that is not cyclic changes the model and is not read")
        rows = list(block.rows())
        if len(rows) != 1 or len(rows[0][1]) < 2:
            raise input_error(block.place, "needs one line with two surfaces", "Add it.")
        place, fields = rows[0]
        low, high = (_surface_nodes(model, surfaces, name.upper(), place) for name in fields[:2])
        if model.tie is not None:
            raise input_error(block.place, "is a second cyclic tie", "Tie the faces of one sector.")
        model.tie = (low, high)
        if model.sectors is None:
            raise input_error(
                block.place,
                "is cyclic, but nothing says how many sectors there are",
                "Add *CYCLIC SYMMETRY MODEL, N=….",
            )


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
    count = model.cells.shape[1] - 1
    faces = TET_FACES if count in (4, 10) else HEX_FACES
    face = fields[1].upper() if len(fields) > 1 else ""
    if face not in {f"S{i}" for i in range(1, len(faces) + 1)}:
        raise input_error(place, f"{face!r} is no face of {model.element_type}", f"Write S1 to S{len(faces)}.")
    corners = faces[int(face[1:]) - 1]
    edges = TET_EDGES if count == 10 else HEX_EDGES if count == 20 else ()
    first = 4 if count == 10 else 8
    middles = [first + i for i, ends in enumerate(edges) if set(ends) <= set(corners)]
    if fields[0].upper() in model.element_sets:
        numbers = model.element_sets[fields[0].upper()]
    else:
        numbers = np.array([whole_number(fields[0], place, "element")])
    rows = model.cells[np.isin(model.cells[:, 0], numbers)]
    if not len(rows):
        raise unknown(place, "element or element set", fields[0], list(model.element_sets))
    return np.asarray(rows[:, [1 + i for i in (*corners, *middles)]].ravel(), dtype=np.int64)
