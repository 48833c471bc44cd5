"""Input decks of CalculiX and Abaqus: mesh, material, supports, speed, and what couples surfaces (cyclic symmetry, ties).

The parser is our own. meshio, which the mesher installs, reads nodes, elements and sets of such a file, but silently skips
materials, supports, ties and steps; and with only NumPy and SciPy installed it is not available.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.cell_laws import Temperature
from stickslip.model.fe.elements import EXACT, Quadrature, Rules
from stickslip.model.fe.links import Links, eliminate
from stickslip.model.fe.material import AnyMaterial, ElasticMaterial
from stickslip.model.fe.solid import integrate, support
from stickslip.model.mesh.facets import centres, closest, interpolation, near_pairs, positions
from stickslip.model.mesh.solid_mesh import CORNERS, EDGES, SolidMesh, by_kind
from stickslip.model.readers.deck_links import SUPPORT, links_of_mesh, read_coupling, read_distributing
from stickslip.model.readers.deck_materials import material_of, read_orientation
from stickslip.model.readers.deck_model import DeckModel, interpret, nodes_named, passed_over, unknown, unread
from stickslip.model.readers.keywords import Block, keyword_blocks, real_number, unique_in_order, whole_number
from stickslip.model.readers.node_table import block_nodes
from stickslip.model.readers.units import SI, Units, check_material
from stickslip.model.structure import Structure

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
            model.reach = max(model.reach, _tolerance(block))
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


def _tolerance(block: Block) -> float:
    """Return the POSITION TOLERANCE of a tie, in the deck's unit of length."""
    reach = real_number(block.parameters["POSITION TOLERANCE"], block.place, "POSITION TOLERANCE")
    if reach < 0:
        raise input_error(
            block.place, f"the POSITION TOLERANCE {reach:g} is negative", "Give a distance, or leave it out."
        )
    return reach


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
            reach = _tolerance(block)
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


PAIRED = 1e-3  # largest distance between a rotated cyclic face and the other face, over the size of the face
ROUNDING = 1e-9  # squares of direction cosines below this value are zero


@dataclass(frozen=True, eq=False)
class Deck:
    """Content of an input deck, in SI.

    Parameters
    ----------
    mesh
        Cells and their nodes. Node sets: the deck's sets without clamped nodes; ``root``, the clamped nodes; with cyclic
        symmetry ``cyclic_low`` and ``cyclic_high``. The low face, rotated by one pitch, coincides with the high face.
    cell_types
        (m,) element type of each cell in the deck's words, e.g. ``C3D10``.
    materials
        Name -> material; a material in an orientation has the name ``MATERIAL in ORIENTATION``.
    cell_material
        (m,) material name of each cell.
    held
        (n, 3) supported components of each node; ``root`` contains nodes with all three.
    speed
        Rotor speed in rad/s of the last ``CENTRIF`` load; None without one.
    axis
        Axis of rotation; the z axis if the deck defines none.
    sectors
        Number of sectors; None without cyclic symmetry.
    ignored
        Ignored keywords and loads, with their lines.
    clamped_sets
        Names of the deck's sets whose nodes are all clamped, which are therefore missing in the mesh.
    of_abaqus
        Whether the deck has keywords that Abaqus alone has (``*PART``, ``*ASSEMBLY``, ``*PREPRINT``).
    links
        Equations, point masses, springs and dashpots; None without any.
    told
        What the equations do beyond their words, with their lines: those that follow from others, those that hold a dof.
    temperature
        Temperatures of the nodes: initial ones without thermal strain, and those of the last step; None without any, or if no
        material depends on them.
    """

    mesh: SolidMesh
    cell_types: tuple[str, ...]
    materials: Mapping[str, AnyMaterial]
    cell_material: tuple[str, ...]
    held: BoolArray
    speed: float | None
    axis: Axis
    sectors: int | None
    ignored: tuple[str, ...]
    clamped_sets: tuple[str, ...] = ()
    of_abaqus: bool = False
    links: Links | None = None
    told: tuple[str, ...] = ()
    temperature: Temperature | None = None

    @property
    def element_type(self) -> str:
        """Element types of the deck, e.g. ``C3D10`` or ``C3D20R, C3D15``."""
        return ", ".join(dict.fromkeys(self.cell_types))

    @property
    def material(self) -> AnyMaterial:
        """The only material; an `InputError` if there are several."""
        used = sorted(set(self.cell_material))
        if len(used) != 1:
            raise input_error("Deck.material", f"there are {len(used)}: {', '.join(used)}", "Use assemble_deck.")
        return self.materials[used[0]]

    @property
    def quadrature(self) -> Rules:
        """CalculiX's rules for the element types; exact rules where the quadrature is not the only difference."""
        return self._rules(lambda kind: QUADRATURES.get(kind, EXACT))

    def exact(self, hourglass: float | None = None) -> Rules:
        """Return exact integration; C3D8I have incompatible modes and C3D8R one point and hourglass control all the same.

        `hourglass` is the factor of the hourglass stiffness; None: CalculiX's or Abaqus's, by the kind of deck.
        """
        return self._rules(lambda kind: EXACT_BRICKS.get(kind, EXACT), hourglass)

    def calculix(self, hourglass: float | None = None) -> Rules:
        """Return the rules of `quadrature` with another factor of the hourglass stiffness."""
        return self._rules(lambda kind: QUADRATURES.get(kind, EXACT), hourglass)

    def _rules(self, rule_of: Callable[[str], Quadrature], hourglass: float | None = None) -> Rules:
        factor = (HOURGLASS_ABAQUS if self.of_abaqus else HOURGLASS_CALCULIX) if hourglass is None else hourglass
        known = {kind: rule_of(kind) for kind in dict.fromkeys(self.cell_types)}
        known = {k: r if r.hourglass is None else replace(r, hourglass=factor) for k, r in known.items()}
        if len(set(known.values())) == 1:
            return next(iter(known.values()))
        return tuple(known[kind] for kind in self.cell_types)


HOURGLASS_CALCULIX, HOURGLASS_ABAQUS = 5e-4, 5e-3  # of Young's modulus
# determined by comparison with matrices stored by CalculiX 2.20, which agree to 2e-14
QUADRATURES = {
    "C3D4": Quadrature(stiffness=1, mass=1),
    "C3D10": Quadrature.calculix(),
    "C3D10T": Quadrature.calculix(),
    "C3D6": Quadrature(stiffness=1, mass=1, axial=3),
    "C3D15": Quadrature(stiffness=2, mass=2, axial=5),
    "C3D8": Quadrature(stiffness=3, mass=3),
    "C3D8I": Quadrature(stiffness=3, mass=3, inner="centre"),
    "C3D8R": Quadrature(stiffness=1, mass=1, hourglass=HOURGLASS_CALCULIX),
    "C3D20": Quadrature(stiffness=5, mass=5),
    "C3D20R": Quadrature(stiffness=3, mass=3),
}
# bricks that are other elements than the plain one. C3D8I with exact mass, and distorted bricks pass the patch test; C3D8R has its
# mass at one point, too.
EXACT_BRICKS = {"C3D8I": Quadrature(stiffness=3, mass=4, inner="mean"), "C3D8R": QUADRATURES["C3D8R"]}


# steps whose temperatures are results
HEAT_STEPS = ("HEAT TRANSFER", "COUPLED TEMPERATURE-DISPLACEMENT", "UNCOUPLED TEMPERATURE-DISPLACEMENT")


def read_deck(path: Path | str, *, units: Units = SI, ignore: tuple[str, ...] = (), plausible: bool = True) -> Deck:
    """Read an input deck of CalculiX or Abaqus.

    Parameters
    ----------
    path
        The ``.inp`` file, plain or gzipped; ``*INCLUDE`` may name files in its folder.
    units
        Unit system of the deck.
    ignore
        Keywords to ignore although they change the model, e.g. ``("MPC",)``; they are listed in `Deck.ignored`.
    plausible
        False accepts implausible density and stiffness.

    Returns
    -------
    Deck
        In SI.

    Raises
    ------
    InputError
        If the deck is damaged or incomplete, or has unsupported keywords that change the model (multi-point constraints,
        shells, contact, orientations); the message names the line.
    """
    path = Path(path)
    blocks = keyword_blocks(path)
    model = interpret(blocks, block_nodes(blocks, path), ignore)
    tie_faces(model, blocks, ignore)
    couple(model, blocks, ignore)
    materials = _materials(model, units, plausible)
    mesh, keep = _mesh(model, units)
    held: BoolArray = _held(model)[keep]
    axis = _axis(model, units)
    links = links_of_mesh(model.links, mesh.numbers, units)
    sets = {name: _index(mesh, nodes) for name, nodes in model.nodes.node_sets.items()}
    if model.ties and model.sectors:
        pairs = [(_index(mesh, low), _index(mesh, high)) for low, high in model.ties]
        pairs = [_oriented(mesh.points, pair, axis, model.sectors) for pair in pairs]
        faces = (
            unique_in_order(np.concatenate([p[0] for p in pairs])),
            unique_in_order(np.concatenate([p[1] for p in pairs])),
        )
        mesh = _met(mesh, faces, axis, 2 * math.pi / model.sectors, units.length * model.reach)
        held = _held_by_tie(mesh, held, faces, axis, 2 * math.pi / model.sectors)
        sets |= {"cyclic_low": faces[0], "cyclic_high": faces[1]}
        links = None if links is None else replace(links, lasting=np.concatenate(faces))
    root: BoolArray = held.min(axis=1)
    free_sets = {name: nodes[~root[nodes]] for name, nodes in sets.items()}
    node_sets = {name: nodes for name, nodes in free_sets.items() if nodes.size}
    if root.any():
        node_sets["root"] = np.flatnonzero(root)
    for kind in dict.fromkeys(model.kinds):
        if kind not in (*QUADRATURES, "C3D5"):
            model.ignored.append(f"what makes {kind} another element than its plain kind")
    if "C3D8R" in model.kinds:
        model.ignored += [
            f"*{b.keyword} ({b.path.name}: line {b.line}): give the factor of hourglass control of C3D8R in the study"
            for b in blocks
            if b.keyword in ("SECTION CONTROLS", "HOURGLASS STIFFNESS")
        ]
    square = model.speed_squares[-1] if model.speed_squares else None
    used = np.isin(np.arange(len(mesh.points)), mesh.cells)
    depends = any(isinstance(m, ElasticMaterial) and (m.varies or m.expansion) for m in materials.values())
    heat = model.heat.of_nodes(mesh.numbers, used) if depends else None
    if depends:
        model.ignored += [
            f"{block.place}: temperatures that this step computes; the given ones are taken"
            for block in blocks
            if block.keyword in HEAT_STEPS
        ]
    else:
        model.ignored += [f"{place}, on which no material depends" for place in model.heat.places]
    return Deck(
        replace(mesh, node_sets=node_sets),
        model.kinds,
        materials,
        _cell_materials(model),
        held,
        None if square is None else math.sqrt(square) / units.time,
        axis,
        model.sectors,
        tuple(model.ignored),
        tuple(name for name, nodes in free_sets.items() if not nodes.size),
        model.of_abaqus,
        links,
        () if links is None else (*model.links.negative, *_of_equations(links, held)),
        heat,
    )


def _of_equations(links: Links, held: BoolArray) -> tuple[str, ...]:
    """Return which equations follow from others, and which hold a dof, for the user."""
    found = eliminate(links, held.ravel(), np.zeros(len(held), dtype=np.int64))
    surplus, holding = (
        [place for place in places if not place.endswith(SUPPORT)] for places in (found.surplus, found.holding)
    )
    told = []
    if surplus:
        told.append(f"{len(surplus)} equations follow from others and the supports ({surplus[0]})")
    if holding:
        told.append(f"{len(holding)} equations hold a node, together with others and the supports ({holding[0]})")
    return tuple(told)


def assemble_deck(deck: Deck) -> Structure:
    """Assemble mass and stiffness of a deck at rest and at its initial temperature, supports applied, cyclic faces untied.

    Parameters
    ----------
    deck
        The deck, with one material or several.

    Returns
    -------
    Structure
        Sparse, undamped. Each node set becomes a set of dofs, without supported ones.
    """
    materials = [deck.materials[name] for name in deck.cell_material]
    cold = None if deck.temperature is None else Temperature(deck.temperature.start, deck.temperature.start)
    mass, stiffness = integrate(deck.mesh, materials, deck.quadrature, deck.links, cold)
    return support(deck.mesh, mass, stiffness, ("root",), deck.held, deck.links)[0]


def _materials(model: DeckModel, units: Units, plausible: bool) -> dict[str, AnyMaterial]:
    """Return the materials of the sections."""
    materials = {}
    for name, axes, _, place in model.sections:
        for what, table in (("*ELASTIC", model.elastic), ("*DENSITY", model.density)):
            if name not in table:
                raise input_error(place, f"material {name!r} has no {what}", _found_instead(model, name))
        orientation = None
        if axes:
            if axes not in model.orientations:
                raise unknown(place, "orientation", axes, list(model.orientations))
            orientation = read_orientation(model.orientations[axes], units)
        try:
            materials[_in_axes(name, axes)] = material_of(
                model.elastic[name], model.density[name], model.expansion.get(name), orientation, units
            )
        except InputError as error:
            raise error.inside(f"{place}: material {name!r}") from None
        own = materials[_in_axes(name, axes)]
        if plausible:
            check_material(own.density, own.young_modulus, units, place)
    return materials


def _in_axes(material: str, orientation: str) -> str:
    """Return the name of a material in an orientation."""
    return f"{material} in {orientation}" if orientation else material


def _found_instead(model: DeckModel, name: str) -> str:
    """Return the probable cause of a missing material keyword, for the message."""
    known = sorted({*model.elastic, *model.density})
    if name not in known:
        return f"Add it. {did_you_mean(name, known)}" if known else "Add it."
    return f"Add it to *MATERIAL, NAME={name}. It is a line of its own there."


def _cell_materials(model: DeckModel) -> tuple[str, ...]:
    """Return the material of each cell; if two sections contain a cell, the last one counts."""
    numbers = model.cells[:, 0]
    name = np.full(len(numbers), -1)
    for i, (_, _, elements, _) in enumerate(model.sections):
        name[np.isin(numbers, model.element_sets[elements])] = i
    if (name < 0).any():
        raise input_error(
            model.nodes.place,
            f"{(name < 0).sum()} elements have no material, e.g. {numbers[name < 0][0]}",
            "Name an element set that holds them in a *SOLID SECTION.",
        )
    names = [_in_axes(material, axes) for material, axes, _, _ in model.sections]
    return tuple(names[i] for i in name)


def _mesh(model: DeckModel, units: Units) -> tuple[SolidMesh, IntArray]:
    """Return the mesh without sets, and the rows of the nodes that it kept."""
    own = model.cells[:, 1:] >= 0
    rows = model.nodes.index(model.cells[:, 1:][own])
    kept = np.union1d(rows, model.nodes.index(model.links.nodes))
    cells = np.full(own.shape, -1)
    cells[own] = np.searchsorted(kept, rows)
    if len(kept) < len(model.nodes.numbers):
        model.ignored.append(f"{len(model.nodes.numbers) - len(kept)} nodes that belong to no cell")
    mesh = SolidMesh(
        units.length * model.nodes.points[kept],
        cells,
        {},
        numbers=model.nodes.numbers[kept],
        cell_numbers=model.cells[:, 0],
    )
    return mesh, kept


def _index(mesh: SolidMesh, numbers: IntArray) -> IntArray:
    """Return the nodes with these numbers, in this order; numbers that the mesh does not contain are skipped."""
    place = np.minimum(np.searchsorted(mesh.numbers, numbers), len(mesh.numbers) - 1)
    return np.asarray(place[mesh.numbers[place] == numbers], dtype=np.int64)


def _held(model: DeckModel) -> BoolArray:
    """Return a mask (n, 3) of the supported components of all nodes of the deck."""
    held = np.zeros((len(model.nodes.numbers), 3), dtype=bool)
    for i, component in enumerate("xyz"):
        for nodes in model.fixed[component]:
            held[model.nodes.index(nodes), i] = True
    return held


def _axis(model: DeckModel, units: Units) -> Axis:
    """Return the common axis of the deck, first choice the cyclic model's; refuse axes that differ."""
    if not model.axes:
        return Axis()
    axes = [
        (place, Axis(_three(direction), _three([units.length * x for x in origin])))
        for place, origin, direction in model.axes
    ]
    first = axes[0][1]
    for place, axis in axes[1:]:
        parallel = np.linalg.norm(first.cross @ axis.unit) < PAIRED
        away = float(np.linalg.norm(first.arm(np.array([axis.origin]))))
        if not parallel or away > PAIRED * max(1.0, float(np.linalg.norm(axis.origin))):
            raise input_error(place, "its axis differs from the axis of the cyclic symmetry", "Use one axis.")
    return first


def _three(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _oriented(
    points: FloatArray, faces: tuple[IntArray, IntArray], axis: Axis, sectors: int
) -> tuple[IntArray, IntArray]:
    """Order the faces so that the first, rotated by one pitch, coincides with the second."""
    from scipy.spatial import cKDTree

    pitch = 2 * math.pi / sectors
    misses = [
        float(cKDTree(points[faces[1]]).query(axis.turned(points[faces[0]], angle))[0].max())
        for angle in (pitch, -pitch)
    ]
    return faces if misses[0] <= misses[1] else (faces[1], faces[0])


def _met(mesh: SolidMesh, faces: tuple[IntArray, IntArray], axis: Axis, pitch: float, reach: float) -> SolidMesh:
    """Return the mesh with nodes of the low face moved to their partners, turned back, that lie within `reach`.

    Files with few digits have faces that do not match exactly; the deck's POSITION TOLERANCE says what is rounding. Nodes on the axis
    and nodes further away than `PAIRED` times the face stay.
    """
    from scipy.spatial import cKDTree

    low, high = faces
    if not (low.size and high.size):
        return mesh
    away, partner = cKDTree(mesh.points[high]).query(axis.turned(mesh.points[low], pitch))
    reach = min(reach, PAIRED * float(np.ptp(mesh.points[high], axis=0).max()))
    moved = (away > 0) & (away <= reach) & (np.linalg.norm(axis.arm(mesh.points[low]), axis=1) > reach)
    moved &= ~np.isin(low, high)
    if not moved.any() or np.unique(partner[moved]).size < np.count_nonzero(moved):
        return mesh
    points = mesh.points.copy()
    points[low[moved]] = axis.turned(mesh.points[high[partner[moved]]], -pitch)
    return replace(mesh, points=points)


def held_like_partners(deck: Deck, faces: tuple[IntArray, IntArray], axis: Axis, sectors: int) -> Deck:
    """Return the deck with supports of one cyclic face transferred to the other, as those of a deck with a cyclic tie are.

    Parameters
    ----------
    deck
        A deck without a cyclic tie.
    faces
        Nodes of the low and of the high face, indices into the points of the mesh; supported nodes may be left out.
    axis, sectors
        Axis of the wheel and its number of sectors.

    Raises
    ------
    InputError
        If supports of partners differ after a turn.
    """
    from scipy.spatial import cKDTree

    mesh, pitch = deck.mesh, 2 * math.pi / sectors
    low, high = faces
    held = np.flatnonzero(deck.held.any(axis=1))
    if not (held.size and low.size and high.size):
        return deck
    reach = PAIRED * float(np.ptp(mesh.points[high], axis=0).max())
    opposite = [
        held[cKDTree(mesh.points[side]).query(axis.turned(mesh.points[held], angle))[0] <= reach]
        for side, angle in ((high, pitch), (low, -pitch))
    ]
    both = np.union1d(low, opposite[0]), np.union1d(high, opposite[1])
    supports = _held_by_tie(mesh, deck.held, both, axis, pitch)
    root = supports.min(axis=1)
    sets = {name: nodes[~root[nodes]] for name, nodes in mesh.node_sets.items() if name != "root"}
    if root.any():
        sets["root"] = np.flatnonzero(root)
    kept = {name: nodes for name, nodes in sets.items() if nodes.size}
    return replace(deck, mesh=replace(mesh, node_sets=kept), held=supports)


def _held_by_tie(
    mesh: SolidMesh, held: BoolArray, faces: tuple[IntArray, IntArray], axis: Axis, pitch: float
) -> BoolArray:
    """Return the supports, with supports of one cyclic face transferred to the other by the tie.

    CalculiX accepts no support on the dependent face, whose nodes are held by their partners. With ``u_high = R u_low``, a
    component on one face is held if all components of the other face in its row are held.
    """
    from scipy.spatial import cKDTree

    low, high = faces
    distance, partner = cKDTree(mesh.points[high]).query(axis.turned(mesh.points[low], pitch))
    near = distance <= PAIRED * float(np.ptp(mesh.points[high], axis=0).max())
    first, second = low[near], high[partner[near]]
    share = axis.rotation(pitch) ** 2  # weight of each component of the low face in each one of the high face
    held = held.copy()
    held[first] |= (~held[second]) @ share < ROUNDING
    held[second] |= (~held[first]) @ share.T < ROUNDING
    torn = np.flatnonzero(held[first].sum(axis=1) != held[second].sum(axis=1))
    if torn.size:
        numbers = mesh.numbers[first[torn[0]]], mesh.numbers[second[torn[0]]]
        raise input_error(
            "*BOUNDARY",
            f"the supports of nodes {numbers[0]} and {numbers[1]} on the cyclic faces are not the same after a turn",
            "Hold nodes there in all directions, or along the axis if that is a coordinate axis.",
        )
    return held
