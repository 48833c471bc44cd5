"""Content of a CalculiX or Abaqus deck: cells, materials, boundary conditions, rotation, cyclic symmetry."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from stickslip.arrays import IntArray
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.fe.material import Expansion
from stickslip.model.readers.deck_links import (
    POINT_KINDS,
    SUPPORT,
    DeckLinks,
    read_equation,
    read_mpc,
    read_point_property,
    read_rigid_body,
    read_transform,
)
from stickslip.model.readers.deck_materials import Constants, DeckHeat, read_constants, read_expansion
from stickslip.model.readers.keywords import (
    ABAQUS_WORDS,
    DAMPING,
    PARAMETERS,
    PASSING_CONDITIONS,
    REFUSED,
    SILENT,
    TOLD,
    Block,
    members,
    real_number,
    unique_in_order,
    whole_number,
)
from stickslip.model.readers.node_table import NodeTable

NODES_OF = {
    "C3D4": 4,
    "C3D10": 10,
    "C3D10M": 10,
    "C3D10T": 10,
    "C3D5": 5,
    "C3D6": 6,
    "C3D15": 15,
    "C3D8": 8,
    "C3D8I": 8,
    "C3D8R": 8,
    "C3D20": 20,
    "C3D20R": 20,
}


@dataclass
class DeckModel:
    """Supported content of a deck, in its own numbers and units.

    Cells are rows ``number, nodes…``, which -1 fills to the widest; ``kinds`` has the type of each; sections are pairs of material and element set; ``fixed`` holds nodes by
    component ``x``, ``y``, ``z``; speeds are squares of circular frequencies.
    """

    nodes: NodeTable
    kinds: tuple[str, ...] = ()
    cells: IntArray = field(default_factory=lambda: np.empty((0, 0), dtype=np.int64))
    element_sets: dict[str, IntArray] = field(default_factory=dict)
    elastic: dict[str, Constants] = field(default_factory=dict)
    density: dict[str, Constants] = field(default_factory=dict)
    expansion: dict[str, Expansion] = field(default_factory=dict)
    heat: DeckHeat = field(default_factory=DeckHeat)
    orientations: dict[str, Block] = field(default_factory=dict)
    sections: list[tuple[str, str, str, str]] = field(default_factory=list)  # material, orientation or "", set, place
    fixed: dict[str, list[IntArray]] = field(default_factory=lambda: {"x": [], "y": [], "z": []})
    speed_squares: list[float] = field(default_factory=list)
    axes: list[tuple[str, list[float], list[float]]] = field(default_factory=list)  # place, origin, direction
    sectors: int | None = None
    repeated: list[tuple[str, str]] = field(default_factory=list)  # place and elements of each cyclic model
    ties: list[tuple[IntArray, IntArray]] = field(default_factory=list)  # nodes of dependent and independent faces
    reach: float = 0.0  # distance within which nodes of the tied faces meet
    links: DeckLinks = field(default_factory=DeckLinks)
    of_abaqus: bool = False  # whether the deck has keywords that Abaqus alone has
    ignored: list[str] = field(default_factory=list)


def interpret(blocks: list[Block], nodes: NodeTable, ignore: tuple[str, ...]) -> DeckModel:
    """Read the blocks of a deck.

    Parameters
    ----------
    blocks
        Blocks of the whole file.
    nodes
        Nodes and node sets of the file.
    ignore
        Keywords to ignore although they change the model.

    Raises
    ------
    InputError
        If something is missing or wrong, or changes the matrices in an unsupported way.
    """
    model = DeckModel(nodes, of_abaqus=any(block.keyword in ABAQUS_WORDS for block in blocks))
    passed = passed_over(ignore)
    _cells(model, blocks, passed)
    _nodes_of_elements(model, blocks)
    material = ""
    for block in blocks:
        word = block.keyword
        if word in passed and word not in ("ELEMENT", "MATERIAL"):
            model.ignored.append(f"*{word} ({block.path.name}: line {block.line}), as asked")
        elif word in PARAMETERS:
            block.check_parameters()
            if word == "MATERIAL":
                material = block.parameter("NAME").upper()
            elif word in ("ELASTIC", "DENSITY", "EXPANSION"):
                _material(model, block, material)
            elif word in _ACTIONS:
                _ACTIONS[word](model, block)
        elif word in TOLD:
            _tell(model, block)
        elif word not in SILENT:
            raise _refused(block)
    _rotation_nodes(model)
    _check_repeated(model)
    _tell_bare(model)
    return model


def _tell_bare(model: DeckModel) -> None:
    """List point elements whose mass, stiffness or damping the deck does not give."""
    for family in ("MASS", "SPRING", "DASHPOT"):
        own = [n for n, (kind, _) in model.links.elements.items() if kind.startswith(family)]
        bare = [n for n in own if n not in model.links.valued]
        if bare:
            model.ignored.append(f"elements {family} without *{family}: {len(bare)}, e.g. {bare[0]}")


def _rotation_nodes(model: DeckModel) -> None:
    """Take supports of the rotation nodes of rigid bodies as supports of the rotations of their reference nodes."""
    for direction, component in enumerate("xyz", 4):
        for nodes in model.fixed[component]:
            own = [int(node) for node in nodes if int(node) in model.links.rotation_nodes]
            model.links.held_angles |= {(model.links.rotation_nodes[node], direction) for node in own}


def _tell(model: DeckModel, block: Block) -> None:
    """List a keyword that does not change the structure; a step that only removes earlier loads has no rows."""
    place = f"*{block.keyword} ({block.path.name}: line {block.line})"
    if block.keyword == "CONTACT PAIR":
        model.ignored.append(f"{place}: its surfaces are free until a study couples them")
    elif any(block.rows()):
        model.ignored.append(place)


def passed_over(ignore: tuple[str, ...]) -> set[str]:
    """Return the keywords that the user ignores, in the spelling of blocks."""
    return {" ".join(word.upper().strip("* ").split()) for word in ignore}


def unread(block: Block, problem: str) -> InputError:
    """Return the error for an unsupported keyword that changes the model."""
    return input_error(
        block.place,
        problem,
        "Let the solver write its matrices and read these$ignore.",
        ignore=f", or pass ignore=({block.keyword!r},) to go on without",
    )


def _refused(block: Block) -> InputError:
    """Return the error that explains why a keyword is not ignored."""
    word = block.keyword
    if word in DAMPING:
        return input_error(
            block.place,
            "damping is not read from decks",
            "State it in the study, and leave it out here$ignore.",
            ignore=f", or pass ignore=({word!r},) to go on without",
        )
    if word in REFUSED:
        return unread(block, f"*{word} changes the model and is not read")
    near = did_you_mean(word, sorted({*PARAMETERS, *SILENT, *TOLD}))
    hint = f"{near} " if near.startswith("Did") else ""
    return input_error(
        block.place,
        f"*{word} is not known, and may change the model",
        f"{hint}Remove it if the model stays the same without it. Otherwise let the solver write its matrices, and read these$ignore.",
        ignore=f", or pass ignore=({word!r},)",
    )


def _cells(model: DeckModel, blocks: list[Block], passed: set[str]) -> None:
    """Read elements of all kinds, and the element sets."""
    parts, kinds, named = [], list[str](), dict[str, list[IntArray]]()
    for block in blocks:
        if block.keyword != "ELEMENT":
            continue
        block.check_parameters()
        kind = block.parameter("TYPE").upper()
        if kind in POINT_KINDS:
            rows = np.array(list(_connectivity(model, block, POINT_KINDS[kind])), dtype=np.int64)
            model.links.elements |= {int(row[0]): (kind, row[1:].tolist()) for row in rows}
            if "ELSET" in block.parameters and len(rows):
                named.setdefault(block.parameters["ELSET"].upper(), []).append(rows[:, 0])
            continue
        if kind not in NODES_OF and "ELEMENT" in passed:
            model.ignored.append(f"elements {kind} ({block.path.name}: line {block.line}), as asked")
            continue
        if kind not in NODES_OF:
            raise unread(block, f"elements of type {kind} are not read")
        count = NODES_OF[kind]
        rows = np.array(list(_connectivity(model, block, count)), dtype=np.int64).reshape(-1, count + 1)
        parts.append(rows)
        kinds += [kind] * len(rows)
        if "ELSET" in block.parameters:
            named.setdefault(block.parameters["ELSET"].upper(), []).append(rows[:, 0])
    if not sum(map(len, parts)):
        raise input_error(model.nodes.place, "has no *ELEMENT", "Give the deck with the mesh, solid elements.")
    widest = max(rows.shape[1] for rows in parts)
    model.cells = np.vstack([np.pad(rows, ((0, 0), (0, widest - rows.shape[1])), constant_values=-1) for rows in parts])
    model.kinds = tuple(kinds)
    numbers = np.concatenate([model.cells[:, 0], np.array([*model.links.elements], dtype=np.int64)])
    if len(np.unique(numbers)) < len(numbers):
        number, times = np.unique(numbers, return_counts=True)
        raise input_error(model.nodes.place, f"defines element {number[times > 1][0]} twice", "Give it once.")
    model.element_sets = members(blocks, "ELSET", numbers, {name: np.concatenate(p) for name, p in named.items()})


def _nodes_of_elements(model: DeckModel, blocks: list[Block]) -> None:
    """Add the node sets that ``*NSET, NSET=…, ELSET=…`` defines by elements."""
    sets = dict(model.nodes.node_sets)
    for block in blocks:
        if block.keyword == "NSET" and "ELSET" in block.parameters:
            elements = block.parameter("ELSET").upper()
            if elements not in model.element_sets:
                raise unknown(block.place, "element set", elements, list(model.element_sets))
            rows = model.cells[np.isin(model.cells[:, 0], model.element_sets[elements]), 1:]
            name = block.parameter("NSET").upper()
            known = sets.get(name, np.empty(0, dtype=np.int64))
            sets[name] = unique_in_order(np.concatenate([known, np.sort(rows[rows >= 0])]))
    model.nodes = replace(model.nodes, node_sets=sets)


def _connectivity(model: DeckModel, block: Block, count: int) -> Iterator[list[int]]:
    """Yield number and nodes of each element; long elements continue on the next lines, surplus nodes of a line are passed over."""
    row: list[int] = []
    place, surplus = block.place, 0
    for place, fields in block.rows():
        row += [whole_number(text, place, "node") for text in fields]
        if len(row) > count:
            surplus += len(row) > count + 1
            if min(row[: count + 1]) < 0:
                raise input_error(
                    place, f"an element has the number {min(row)}", "Check the line: numbers are positive."
                )
            yield row[: count + 1]
            row = []
    if row:
        raise input_error(place, f"the last element has {len(row) - 1} nodes of {count}", "The file is cut short.")
    if surplus:
        kind = block.parameter("TYPE").upper()
        model.ignored.append(
            f"the surplus nodes of {surplus} elements {kind}, which have {count} ({block.path.name}: line {block.line})"
        )


def _material(model: DeckModel, block: Block, material: str) -> None:
    if not material:
        raise input_error(block.place, "belongs to no *MATERIAL", "Put it below its material.")
    if block.keyword == "EXPANSION":
        model.expansion[material] = read_expansion(block)
        return
    table = model.elastic if block.keyword == "ELASTIC" else model.density
    table[material] = read_constants(block)


def _section(model: DeckModel, block: Block) -> None:
    name, elements = block.parameter("MATERIAL").upper(), block.parameter("ELSET").upper()
    if elements not in model.element_sets:
        raise unknown(block.place, "element set", elements, list(model.element_sets))
    model.sections.append((name, block.parameters.get("ORIENTATION", "").upper(), elements, block.place))


def _orientation(model: DeckModel, block: Block) -> None:
    model.orientations[block.parameter("NAME").upper()] = block


def unknown(place: str, what: str, name: str, known: list[str]) -> InputError:
    """Return the error for an unknown name."""
    return input_error(place, f"there is no {what} {name!r}", did_you_mean(name, known))


def nodes_named(model: DeckModel, text: str, place: str) -> IntArray:
    """Return the nodes of a set, or a single node by its number."""
    if text.upper() in model.nodes.node_sets:
        return model.nodes.node_sets[text.upper()]
    if not text.lstrip("+-").isdigit():
        raise unknown(place, "node set", text.upper(), list(model.nodes.node_sets))
    number = whole_number(text, place, "node")
    if number not in model.nodes.numbers:
        raise input_error(place, f"names node {number}, which the deck lacks", "Check the number, or add the node.")
    return np.array([number])


OTHER_FIELDS = (0, 8, 11)  # directions of temperature and electric potential


def _boundary(model: DeckModel, block: Block) -> None:
    """Read supports: ``node or set, first direction, last direction, value``, or a type such as ``ENCASTRE``."""
    words = {"ENCASTRE": (1, 6), "PINNED": (1, 3)}
    if block.parameters.get("TYPE", "DISPLACEMENT").upper() != "DISPLACEMENT":
        raise unread(block, f"TYPE={block.parameters['TYPE']} is not read")
    if _anew(block):
        model.fixed = {"x": [], "y": [], "z": []}
        model.links.supports, model.links.held_angles = [], set()
    for place, fields in block.rows():
        nodes = nodes_named(model, fields[0], place)
        if len(fields) > 1 and fields[1].upper() in words:
            first, last = words[fields[1].upper()]
        else:
            if len(fields) < 2:
                raise input_error(place, "names no direction", "Write node, first, last.")
            first = whole_number(fields[1], place, "direction")
            last = whole_number(fields[2] or str(first), place, "direction") if len(fields) > 2 else first
        value = real_number(fields[3], place, "value") if len(fields) > 3 else 0.0
        if value:
            model.ignored.append(f"the prescribed displacement of {value:g} ({place}): its nodes are held at 0")
        if first == last and first in OTHER_FIELDS:
            model.ignored.append(f"the boundary condition of direction {first} ({place}), which is no displacement")
            continue
        if not 1 <= first <= last:
            raise input_error(place, f"directions {first} to {last}", "They count from 1 to 3.")
        _hold(model, nodes, first, last, place)


def _hold(model: DeckModel, nodes: IntArray, first: int, last: int, place: str) -> None:
    """Hold directions of nodes, along their own axes where ``*TRANSFORM`` turns these."""
    links = model.links
    whole = first == 1 and last >= 3
    turned = [] if whole else [int(node) for node in nodes if int(node) in links.turns]
    plain = nodes[~np.isin(nodes, turned)] if turned else nodes
    for direction in range(first, min(last, 6) + 1):
        if direction <= 3:
            model.fixed["xyz"[direction - 1]].append(plain)
            for node in turned:
                terms = links.along(node, direction)
                if len(terms) == 1:  # along a global axis
                    model.fixed["xyz"[terms[0][1] - 1]].append(np.array([node]))
                else:
                    links.supports.append((f"{place}, {SUPPORT}", terms))
        else:
            links.held_angles |= {(int(node), direction) for node in nodes}


def _anew(block: Block) -> bool:
    """Whether the block replaces earlier ones of its kind (``OP=NEW``)."""
    operation = block.parameters.get("OP", "MOD").upper()
    if operation not in ("NEW", "MOD"):
        raise input_error(block.place, f"OP={operation} is not known", "Write OP=NEW or OP=MOD.")
    return operation == "NEW"


ROTATIONS = ("CENT", "CORIO", "ROTA", "ROTDYNF")  # Abaqus' loads by rotation, which are refused


def _distributed_load(model: DeckModel, block: Block) -> None:
    """Read rotation: ``elements, CENTRIF, speed², point of the axis, direction``; list other loads as ignored."""
    if _anew(block):
        model.speed_squares = []
    for place, fields in block.rows():
        kind = fields[1].upper() if len(fields) > 1 else ""
        if kind in ROTATIONS:
            raise input_error(
                place,
                f"rotates by {kind}, and rotation is read as CENTRIF alone",
                "Write: elements, CENTRIF, speed², a point of the axis, its direction.",
            )
        if kind != "CENTRIF":
            model.ignored.append(f"load {kind or '?'} ({place})")
            continue
        if len(fields) < 9:
            raise input_error(place, f"CENTRIF with {len(fields)} fields", "Give speed², a point and a direction.")
        numbers = [real_number(text, place, "CENTRIF value") for text in fields[2:9]]
        if numbers[0] < 0:
            raise input_error(place, f"speed² is {numbers[0]:g}", "It cannot be negative.")
        if "AMPLITUDE" in block.parameters:
            model.ignored.append(f"AMPLITUDE of *DLOAD ({place}): the speed is taken whole")
        _whole_model(model, fields[0], place, "rotates")
        model.speed_squares.append(numbers[0])
        model.axes.append((place, numbers[1:4], numbers[4:7]))


def _check_repeated(model: DeckModel) -> None:
    """Refuse cyclic models whose sets together lack some of the elements."""
    names = [name for _, name in model.repeated]
    if not names or "" in names:
        return
    own = np.concatenate([_elements_named(model, name, place) for place, name in model.repeated])
    if not np.isin(model.cells[:, 0], own).all():
        raise input_error(
            model.repeated[-1][0],
            f"repeats {' and '.join(map(repr, names))}, which lack some of the elements",
            "Name sets that hold all elements together, or leave ELSET out.",
        )


def _whole_model(model: DeckModel, name: str, place: str, what: str) -> None:
    """Refuse a set that lacks some of the elements."""
    inside = model.element_sets.get(name.upper(), np.empty(0, dtype=np.int64))
    if not np.isin(model.cells[:, 0], inside).all():
        raise input_error(
            place, f"{what} {name!r}, which is not the set of all elements", "Name a set that holds all of them."
        )


def _initial(model: DeckModel, block: Block) -> None:
    """List initial conditions without effect on the matrices as ignored; refuse stresses and all others."""
    kind = block.parameter("TYPE").upper()
    if kind not in PASSING_CONDITIONS:
        raise unread(block, f"initial conditions of TYPE={kind} change the stiffness")
    if kind == "TEMPERATURE":
        if {"USER", "FILE"} & block.parameters.keys():
            raise unread(block, "temperatures of a file or a subroutine are not read")
        for place, fields in block.rows():
            model.heat.initial.append(_temperatures(model, place, fields))
        model.heat.places.append(block.place)
        return
    model.ignored.append(f"*INITIAL CONDITIONS, TYPE={kind} ({block.path.name}: line {block.line})")


def _temperatures(model: DeckModel, place: str, fields: list[str]) -> tuple[IntArray, float]:
    """Read ``node or set, temperature``."""
    if len(fields) < 2:
        raise input_error(place, "names no temperature", "Write node or set, temperature.")
    return nodes_named(model, fields[0], place), real_number(fields[1], place, "temperature")


def _heating(model: DeckModel, block: Block) -> None:
    """Read temperatures of a step; nodes without one keep their initial temperature."""
    if _anew(block):
        model.heat.later = []
    rows = [_temperatures(model, place, fields) for place, fields in block.rows()]
    if rows and "AMPLITUDE" in block.parameters:
        model.ignored.append(f"AMPLITUDE of *TEMPERATURE ({block.path.name}: line {block.line}): taken whole")
    model.heat.later += rows
    model.heat.places.append(block.place)


def _step(model: DeckModel, block: Block) -> None:
    """List NLGEOM of a step as ignored: statics is linear here."""
    if block.parameters.get("NLGEOM", "NO").strip().upper() != "NO":
        model.ignored.append(f"NLGEOM of *STEP ({block.path.name}: line {block.line}): statics is linear here")


def _cyclic_model(model: DeckModel, block: Block) -> None:
    before = model.sectors
    model.sectors = whole_number(block.parameter("N"), block.place, "number of sectors N")
    if before not in (None, model.sectors):
        raise input_error(block.place, f"N={model.sectors} after N={before}", "Give one.")
    model.repeated.append((block.place, block.parameters.get("ELSET", "").upper()))
    if model.sectors < 1:
        raise input_error(block.place, f"N={model.sectors}", "Give the number of sectors.")
    rows = list(block.rows())
    if len(rows) != 1 or len(rows[0][1]) < 6:
        raise input_error(block.place, "needs one line with two points of the axis", "Add it.")
    place, fields = rows[0]
    numbers = [real_number(text, place, "coordinate") for text in fields[:6]]
    direction = [b - a for a, b in zip(numbers[:3], numbers[3:], strict=True)]
    model.axes.insert(0, (place, numbers[:3], direction))


def _transform(model: DeckModel, block: Block) -> None:
    held = [nodes for which in model.fixed.values() for nodes in which]
    read_transform(
        model.links, block, partial(nodes_named, model), model.nodes, np.concatenate([*held, np.empty(0, np.int64)])
    )


def _elements_named(model: DeckModel, name: str, place: str) -> IntArray:
    if name.upper() not in model.element_sets:
        raise unknown(place, "element set", name, list(model.element_sets))
    return model.element_sets[name.upper()]


def _nodes_of_set(model: DeckModel, name: str, place: str) -> IntArray:
    rows = model.cells[np.isin(model.cells[:, 0], _elements_named(model, name, place)), 1:]
    return np.unique(rows[rows >= 0])


def _rigid_body(model: DeckModel, block: Block) -> None:
    read_rigid_body(model.links, block, partial(nodes_named, model), model.nodes, partial(_nodes_of_set, model))


def _multi_point(model: DeckModel, block: Block) -> None:
    read_mpc(model.links, block, partial(nodes_named, model), model.nodes, of_abaqus=model.of_abaqus)


def _point_property(model: DeckModel, block: Block) -> None:
    elements = _elements_named(model, block.parameter("ELSET"), block.place)
    read_point_property(model.links, block, elements, model.nodes)


_ACTIONS = {
    "EQUATION": lambda model, block: read_equation(model.links, block, partial(nodes_named, model)),
    "MPC": _multi_point,
    "TRANSFORM": _transform,
    "RIGID BODY": _rigid_body,
    "MASS": _point_property,
    "SPRING": _point_property,
    "DASHPOT": _point_property,
    "SOLID SECTION": _section,
    "ORIENTATION": _orientation,
    "TEMPERATURE": _heating,
    "BOUNDARY": _boundary,
    "DLOAD": _distributed_load,
    "STEP": _step,
    "INITIAL CONDITIONS": _initial,
    "CYCLIC SYMMETRY MODEL": _cyclic_model,
}
