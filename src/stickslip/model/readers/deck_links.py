"""Links of a CalculiX or Abaqus deck: equations, rigid bodies, couplings, turned axes, point masses, springs, dashpots."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.fe.links import ROUNDING, Links
from stickslip.model.readers.keywords import Block, real_number, whole_number
from stickslip.model.readers.node_table import NodeTable
from stickslip.model.readers.units import Units

# elements without volume, and their number of nodes
POINT_KINDS = {"MASS": 1, "SPRINGA": 2, "SPRING1": 1, "SPRING2": 2, "DASHPOTA": 2, "DASHPOT1": 1, "DASHPOT2": 2}
SUPPORT = "*BOUNDARY"  # end of the place of a support in turned axes
ON_LINE = 1e-6  # distance from a line or a plane over the size of the constraint
Term = tuple[int, int, float]  # node, direction 1 to 6, coefficient
Vector = list[Term]


@dataclass
class DeckLinks:
    """Links of a deck, in its own numbers and units.

    Parameters
    ----------
    equations
        Place and terms of each equation; directions 4 to 6 are rotations of reference nodes.
    supports
        The same for supports in turned axes.
    turns
        Node -> (3, 3) rows: its axes of ``*TRANSFORM``.
    held_angles
        Node and direction of rotations of reference nodes that are held.
    elements
        Element number -> kind and nodes of masses, springs and dashpots.
    valued
        Numbers of those whose mass, stiffness or damping was read.
    masses
        Node and mass of each point mass.
    negative
        A sentence for each negative stiffness or damping.
    springs, dashpots
        Terms of an elongation, and its stiffness or damping.
    rotation_nodes
        ``ROT NODE`` of a rigid body -> its reference node.
    references
        Reference nodes, which alone can rotate.
    small
        As in `Links`.
    """

    equations: list[tuple[str, Vector]] = field(default_factory=list)
    supports: list[tuple[str, Vector]] = field(default_factory=list)
    turns: dict[int, FloatArray] = field(default_factory=dict)
    held_angles: set[tuple[int, int]] = field(default_factory=set)
    elements: dict[int, tuple[str, list[int]]] = field(default_factory=dict)
    valued: set[int] = field(default_factory=set)
    masses: list[tuple[int, float]] = field(default_factory=list)
    negative: list[str] = field(default_factory=list)
    springs: list[tuple[Vector, float]] = field(default_factory=list)
    dashpots: list[tuple[Vector, float]] = field(default_factory=list)
    rotation_nodes: dict[int, int] = field(default_factory=dict)
    references: set[int] = field(default_factory=set)
    small: str = ""

    @property
    def any(self) -> bool:
        """Whether there is a link."""
        return bool(self.equations or self.supports or self.masses or self.springs or self.dashpots)

    @property
    def nodes(self) -> IntArray:
        """Numbers of the nodes whose displacements the links contain."""
        vectors = [v for _, v in (*self.equations, *self.supports)]
        vectors += [v for v, _ in (*self.springs, *self.dashpots)]
        own = {node for vector in vectors for node, direction, _ in vector if direction <= 3}
        own -= self.rotation_nodes.keys()
        return np.array(sorted(own | {node for node, _ in self.masses}), dtype=np.int64)

    def along(self, node: int, direction: int, factor: float = 1.0) -> Vector:
        """Return the motion of a node in a direction of its own axes as terms along the global axes."""
        if direction > 3 or node not in self.turns:
            return [(node, direction, factor)]
        axis = self.turns[node][direction - 1]
        return [(node, i + 1, factor * float(v)) for i, v in enumerate(axis) if abs(v) > ROUNDING]

    def linear(self, place: str, what: str) -> None:
        """Note a link that is right for small rotations only."""
        self.small = self.small or f"{place}: {what}"


Nodes = Callable[[str, str], IntArray]  # nodes of a set or number, and the place for messages


def read_equation(links: DeckLinks, block: Block, nodes: Nodes) -> None:
    """Read ``*EQUATION``: a count, then node, direction, coefficient of each term, several to a line.

    Raises
    ------
    InputError
        If a line is incomplete, or a set has several nodes.
    """
    fields: list[tuple[str, str]] = []
    for place, row in block.rows():
        fields += [(place, text) for text in row]
    while fields:
        place, text = fields[0]
        count = whole_number(text, place, "number of terms")
        own = fields[1 : 1 + 3 * count]
        if count < 1 or len(own) < 3 * count:
            raise input_error(
                place,
                f"announces {count} terms and has {len(own)} numbers",
                "Write node, direction, coefficient of each.",
            )
        fields = fields[1 + 3 * count :]
        vector: Vector = []
        for (where, node), (_, direction), (_, factor) in zip(own[::3], own[1::3], own[2::3], strict=True):
            vector += _term(links, nodes, where, node, direction, factor)
        links.equations.append((f"{place}, *EQUATION", vector))


def _term(links: DeckLinks, nodes: Nodes, place: str, node: str, direction: str, factor: str) -> Vector:
    found = nodes(node, place)
    if found.size != 1:
        raise input_error(place, f"{node!r} has {found.size} nodes", "Write one equation for each node.")
    along = whole_number(direction, place, "direction")
    if not 1 <= along <= 6:
        raise input_error(place, f"the direction {along}", "Directions count from 1 to 6.")
    return links.along(int(found[0]), along, real_number(factor, place, "coefficient"))


def read_transform(links: DeckLinks, block: Block, nodes: Nodes, table: NodeTable, held: IntArray) -> None:
    """Read ``*TRANSFORM``: axes of nodes, rectangular or cylindrical.

    Parameters
    ----------
    links
        The links read so far.
    block
        The block.
    nodes, table
        Nodes by name, and their positions.
    held
        Numbers of the nodes that are supported already.
    """
    kind = block.parameters.get("TYPE", "R").upper()
    if kind not in ("R", "C"):
        raise input_error(block.place, f"TYPE={kind} is not read", "Use TYPE=R or TYPE=C.")
    name = block.parameter("NSET")
    rows = list(block.rows())
    if len(rows) != 1 or len(rows[0][1]) < 6:
        raise input_error(block.place, "needs one line with six numbers", "Give two points.")
    place, fields = rows[0]
    a, b = np.array([real_number(text, place, "coordinate") for text in fields[:6]]).reshape(2, 3)
    numbers = nodes(name, block.place)
    tied = [node for place, vector in links.equations if place.endswith("*EQUATION") for node, _, _ in vector]
    late = np.intersect1d(numbers, [*held, *tied])
    if late.size:
        raise input_error(
            block.place,
            f"turns the axes of node {late[0]}, which a line above supports or ties",
            "Put it above *BOUNDARY and *EQUATION.",
        )
    for number, point in zip(numbers, table.points[table.index(numbers)], strict=True):
        links.turns[int(number)] = _axes(kind, a, b, point, place)


def _axes(kind: str, a: FloatArray, b: FloatArray, point: FloatArray, place: str) -> FloatArray:
    """Return (3, 3) rows: the axes of a node."""
    first, second = (a, b) if kind == "R" else (point - a, b - a)
    if kind == "R":
        third = np.cross(first, second)
        frame = [first, np.cross(third, first), third]
    else:
        radial = first - second * (float(first @ second) / max(float(second @ second), 1e-300))
        frame = [radial, np.cross(second, radial), second]
    rows = np.array(frame)
    length = np.linalg.norm(rows, axis=1)
    if length.min() <= ON_LINE * max(1e-300, float(np.linalg.norm(first))):
        raise input_error(
            place, f"gives a node at {point.tolist()} no axes", "Give points off a line; nodes on the axis need TYPE=R."
        )
    return np.asarray(rows / length[:, None])


def read_rigid_body(links: DeckLinks, block: Block, nodes: Nodes, table: NodeTable, of_elements: Nodes) -> None:
    """Read ``*RIGID BODY``: all nodes of a set follow translation and rotation of a reference node."""
    reference = _reference(block, nodes)
    angles = block.parameters.get("ROT NODE") or block.parameters.get("ROTNODE")
    if angles:
        links.rotation_nodes[int(nodes(angles, block.place)[0])] = reference
    followers = [nodes(block.parameters[p], block.place) for p in ("NSET", "PIN NSET") if p in block.parameters]
    if "ELSET" in block.parameters:
        followers.append(of_elements(block.parameters["ELSET"], block.place))
    if not followers:
        raise input_error(block.place, "names no nodes", "Give NSET= or ELSET=.")
    own = np.unique(np.concatenate(followers))
    _follow(links, block.place, own[own != reference], reference, table, (1, 2, 3))


def read_coupling(
    links: DeckLinks, coupling: Block, block: Block, nodes: Nodes, table: NodeTable, surface: IntArray
) -> None:
    """Read ``*KINEMATIC`` below ``*COUPLING``: directions of a surface's nodes follow a reference node rigidly."""
    reference = _reference(coupling, nodes)
    directions: set[int] = set()
    for place, fields in block.rows():
        first = whole_number(fields[0], place, "direction")
        last = whole_number(fields[1], place, "direction") if len(fields) > 1 and fields[1] else first
        if not 1 <= first <= last <= 6:
            raise input_error(
                place, f"the directions {first} to {last}", "Directions count from 1 to 6, the lower first."
            )
        directions |= set(range(first, last + 1))
    own = tuple(sorted((directions or {1, 2, 3}) & {1, 2, 3}))
    if not own:
        raise input_error(block.place, "names no direction from 1 to 3", "Nodes of solids have these alone.")
    _follow(links, coupling.place, surface[surface != reference], reference, table, own)


def read_distributing(
    links: DeckLinks, coupling: Block, block: Block, nodes: Nodes, table: NodeTable, surface: IntArray
) -> None:
    """Read ``*DISTRIBUTING``: a reference node moves as the nodes of a surface do in the mean, all with the same weight.

    With the places r_i about their centre, the rotation is that of the rigid body of equal masses with the same angular momentum:
    ``sum(r_i^2 I - r_i r_i^T) theta = sum(r_i x u_i)``.
    """
    reference = _reference(coupling, nodes)
    for place, fields in block.rows():
        if [text for text in fields if text] not in ([], ["1", "6"]):
            raise input_error(place, f"couples the directions {', '.join(fields)}", "All six are read: leave them out.")
    own = surface[surface != reference]
    points = table.points[table.index(own)]
    centre = points.mean(axis=0)
    arms = points - centre
    inertia = np.sum(arms**2) * np.eye(3) - arms.T @ arms
    if np.linalg.eigvalsh(inertia)[0] <= ON_LINE**2 * np.trace(inertia):
        raise input_error(coupling.place, "couples nodes on one line, which have no rotation", "Name nodes off a line.")
    away = table.points[table.index(np.array([reference]))][0] - centre
    links.linear(coupling.place, "a distributing coupling")
    links.references.add(reference)
    cross = _crossed(away)
    for i in range(3):
        mean = [(int(node), i + 1, -1.0 / own.size) for node in own]
        turned = [(reference, 4 + k, float(cross[i, k])) for k in range(3) if cross[i, k]]
        links.equations.append((coupling.place, [(reference, i + 1, 1.0), *mean, *turned]))
        moments = [
            (int(node), k + 1, float(_crossed(arm)[i, k]))
            for node, arm in zip(own, arms, strict=True)
            for k in range(3)
            if _crossed(arm)[i, k]
        ]
        spin = [(reference, 4 + k, -float(inertia[i, k])) for k in range(3) if inertia[i, k]]
        links.equations.append((coupling.place, [*spin, *moments]))


def _crossed(arm: FloatArray) -> FloatArray:
    """Return the (3, 3) matrix of ``arm x``."""
    x, y, z = arm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _reference(block: Block, nodes: Nodes) -> int:
    name = block.parameters.get("REF NODE") or block.parameters.get("REFNODE")
    if not name:
        raise input_error(block.place, "lacks the parameter REF NODE", "Write REF NODE=….")
    return int(nodes(name, block.place)[0])


def _follow(
    links: DeckLinks, place: str, numbers: IntArray, reference: int, table: NodeTable, directions: tuple[int, ...]
) -> None:
    """Add ``u = u_ref + θ × r`` for nodes, in directions of the global axes."""
    links.linear(place, "a rigid body")
    links.references.add(reference)
    arms = table.points[table.index(numbers)] - table.points[table.index(np.array([reference]))]
    for number, (x, y, z) in zip(numbers.tolist(), arms.tolist(), strict=True):
        turned = {1: ((5, z), (6, -y)), 2: ((6, x), (4, -z)), 3: ((4, y), (5, -x))}
        for direction in directions:
            terms = [(reference, angle, -arm) for angle, arm in turned[direction] if arm]
            links.equations.append((place, [(number, direction, 1.0), (reference, direction, -1.0), *terms]))


def read_mpc(links: DeckLinks, block: Block, nodes: Nodes, table: NodeTable, *, of_abaqus: bool) -> None:
    """Read ``*MPC``: PLANE, STRAIGHT and BEAM of CalculiX, TIE, PIN and LINK of Abaqus, for small rotations."""
    fields: list[str] = []
    first = block.place
    for place, row in block.rows():
        own = [text for text in row if text]
        # a line that begins with a number continues the one above
        if own and not own[0].lstrip("+-").isdigit():
            _one_mpc(links, first, fields, nodes, table, of_abaqus=of_abaqus)
            fields, first = [], f"{place}, *MPC"
        fields += own
    _one_mpc(links, first, fields, nodes, table, of_abaqus=of_abaqus)


def _one_mpc(
    links: DeckLinks, place: str, fields: list[str], nodes: Nodes, table: NodeTable, *, of_abaqus: bool
) -> None:
    if not fields:
        return
    kind = fields[0].upper()
    numbers = [int(n) for text in fields[1:] if text != "0" for n in nodes(text, place)]
    known = {"TIE": 2, "PIN": 2, "LINK": 2} if of_abaqus else {"PLANE": 4, "STRAIGHT": 3, "BEAM": 2}
    if kind not in known:
        raise input_error(
            place,
            f"an MPC of type {kind} ties nodes and is not read",
            f"Read are {', '.join(known)}; or write *EQUATION.",
        )
    if len(numbers) < known[kind]:
        raise input_error(place, f"{kind} has {len(numbers)} nodes", f"It needs {known[kind]}.")
    points = table.points[table.index(np.array(numbers))]
    if kind in ("TIE", "PIN"):
        links.equations += [(place, [(numbers[0], d, 1.0), (numbers[1], d, -1.0)]) for d in (1, 2, 3)]
    elif kind in ("BEAM", "LINK"):
        along = points[1] - points[0]
        length = float(np.linalg.norm(along))
        if length == 0.0:
            raise input_error(place, f"nodes {numbers[:2]} lie at one place", "Tie them by equations.")
        row = _projected([(numbers[1], 1.0), (numbers[0], -1.0)], along / length)
        links.linear(place, "a rigid bar")
        links.equations.append((place, row))
    else:
        fixed = 3 if kind == "PLANE" else 2
        shape = "plane" if fixed == 3 else "straight line"
        links.linear(place, f"a {shape}")
        for number, point in zip(numbers[fixed:], points[fixed:], strict=True):
            links.equations += [
                (place, row) for row in _on_flat(place, shape, numbers[:fixed], points[:fixed], number, point)
            ]


def _on_flat(
    place: str, shape: str, fixed: list[int], base: FloatArray, number: int, point: FloatArray
) -> Iterator[Vector]:
    """Yield the equations that keep a node on the line or plane through two or three others."""
    edges = base[1:] - base[0]
    size = float(np.abs(edges).max())
    away = point - base[0]
    share = np.linalg.lstsq(edges.T, away, rcond=None)[0]
    _, strength, directions = np.linalg.svd(edges)
    if strength[-1] < ON_LINE * size:
        raise input_error(place, f"nodes {fixed} span no {shape}", f"Name {len(fixed)} nodes that do first.")
    if np.linalg.norm(away - share @ edges) > 1e-3 * size:
        raise input_error(
            place,
            f"node {number} does not lie on the {shape} of nodes {fixed}",
            "Straight lines and planes are read where the nodes lie on them.",
        )
    weights = np.append(1.0 - share.sum(), share)
    for normal in directions[len(edges) :]:
        moved = [(number, 1.0), *((a, -float(w)) for a, w in zip(fixed, weights, strict=True))]
        yield _projected(moved, normal)


def _projected(moved: list[tuple[int, float]], normal: FloatArray) -> Vector:
    return [(node, i + 1, weight * float(v)) for node, weight in moved for i, v in enumerate(normal) if v]


def read_point_property(links: DeckLinks, block: Block, elements: IntArray, table: NodeTable) -> None:
    """Read ``*MASS``, ``*SPRING`` or ``*DASHPOT`` of a set of elements."""
    rows = [(place, fields) for place, fields in block.rows() if any(fields)]
    kinds = {links.elements[int(e)][0] for e in elements if int(e) in links.elements}
    kind: str = min(kinds, default="")
    family = {"MASS": "MASS", "SPRING": "SPRING", "DASHPOT": "DASHPOT"}[block.keyword]
    if len(kinds) != 1 or not kind.startswith(family):
        raise input_error(
            block.place,
            f"its set has elements {sorted(kinds) or 'of solids'}",
            f"Name a set of elements of one kind of {family}.",
        )
    directions = [int(kind[-1])] if kind[-1].isdigit() else []
    wanted = 2 if directions else 1
    if len(rows) != wanted:
        raise input_error(
            block.place,
            f"has {len(rows)} lines of data, {wanted} expected",
            "Values by temperature or frequency are not read.",
        )
    place, fields = rows[-1]
    value = _point_value(links, family, fields[0], place)
    along = [whole_number(text, rows[0][0], "direction") for text in rows[0][1] if text] if directions else []
    if directions and (len(along) != directions[0] or not all(1 <= d <= 3 for d in along)):
        raise input_error(rows[0][0], f"gives the directions {along}", f"{kind} needs {directions[0]}, from 1 to 3.")
    for number in elements:
        nodes = links.elements[int(number)][1]
        if int(number) in links.valued:
            raise input_error(
                block.place, f"gives element {number} a second *{family}", "Keep one: CalculiX takes the last."
            )
        links.valued.add(int(number))
        turned = [node for node in nodes if node in links.turns]
        if directions and turned:
            raise input_error(
                block.place,
                f"acts along a direction of node {turned[0]}, whose axes *TRANSFORM turns",
                "CalculiX takes the global direction here: take the node out of *TRANSFORM, or give a SPRINGA or DASHPOTA along the direction.",
            )
        if family == "MASS":
            links.masses.append((nodes[0], value))
        else:
            target = links.springs if family == "SPRING" else links.dashpots
            target.append((_elongation(nodes, along, table, block.place), value))
    if family == "SPRING":
        links.linear(block.place, "a spring")


def _point_value(links: DeckLinks, family: str, text: str, place: str) -> float:
    """Return a mass, stiffness or damping; a negative mass is refused, the others are noted."""
    value = real_number(text, place, "value")
    if value < 0 and family == "MASS":
        raise input_error(place, f"the mass {value:g}", "A point mass is zero or greater.")
    if value < 0:
        what, does = ("stiffness", "pushes away from rest") if family == "SPRING" else ("damping", "feeds vibration")
        links.negative.append(f"the {what} {value:g} is negative ({place}): it {does}")
    return value


def _elongation(nodes: list[int], along: list[int], table: NodeTable, place: str) -> Vector:
    if along:
        return [(node, d, sign) for node, d, sign in zip(nodes, along, (1.0, -1.0), strict=False)]
    start, end = table.points[table.index(np.array(nodes))]
    length = float(np.linalg.norm(end - start))
    if length == 0.0:
        raise input_error(
            place,
            f"nodes {nodes} lie at one place and give it no direction",
            "Use SPRING2 or DASHPOT2 with directions.",
        )
    return _projected([(nodes[1], 1.0), (nodes[0], -1.0)], (end - start) / length)


def links_of_mesh(links: DeckLinks, numbers: IntArray, units: Units) -> Links | None:
    """Return the links by the nodes of a mesh, in SI; None if there are none.

    Parameters
    ----------
    links
        The links of the deck.
    numbers
        (n,) ascending node numbers of the mesh, which has all nodes of the links.
    units
        Unit system of the deck.
    """
    if not links.any:
        return None
    n = len(numbers)
    angles: dict[tuple[int, int], int] = {}
    rows = [*links.supports, *links.equations]
    vectors = [_without(links, v, place) for place, v in rows]
    equations = _rows(vectors, numbers, angles)
    equations.resize((len(rows), 3 * n + len(angles)))
    mass = np.zeros(n)
    for node, value in links.masses:
        mass[np.searchsorted(numbers, node)] += units.mass * value

    def between(which: list[tuple[Vector, float]], unit: float) -> Matrix:
        own = _rows([v for v, _ in which], numbers, {})
        own.resize((len(which), 3 * n))
        return scipy.sparse.csr_array(own.T @ scipy.sparse.diags_array(unit * np.array([k for _, k in which])) @ own)

    empty = scipy.sparse.csr_array((3 * n, 3 * n))
    return Links(
        equations,
        tuple(place for place, _ in rows),
        mass,
        between(links.springs, units.stress * units.length) if links.springs else empty,
        between(links.dashpots, units.stress * units.length * units.time) if links.dashpots else empty,
        links.small,
    )


def _without(links: DeckLinks, vector: Vector, place: str) -> Vector:
    """Return an equation with rotation nodes as rotations of their reference nodes, without held rotations."""
    found = []
    for given, along, factor in vector:
        reference = links.rotation_nodes.get(given)
        node, direction = (given, along) if reference is None else (reference, along + 3)
        if direction > 3 and node not in links.references:
            raise input_error(
                place,
                f"names the rotation {direction} of node {node}, which is no reference node",
                "Nodes of solids do not rotate.",
            )
        if (node, direction) not in links.held_angles:
            found.append((node, direction, factor))
    return found


def _rows(vectors: list[Vector], numbers: IntArray, angles: dict[tuple[int, int], int]) -> Matrix:
    """Return the CSR rows of vectors on the x, y, z of all nodes and on the rotations, which are numbered in `angles`."""
    row, column, value = [], [], []
    for i, vector in enumerate(vectors):
        for node, direction, factor in vector:
            if direction > 3:
                place = 3 * len(numbers) + angles.setdefault((node, direction), len(angles))
            else:
                place = 3 * int(np.searchsorted(numbers, node)) + direction - 1
            row.append(i)
            column.append(place)
            value.append(factor)
    width = 3 * len(numbers) + len(angles)
    return scipy.sparse.csr_array((value, (row, column)), shape=(len(vectors), width))
