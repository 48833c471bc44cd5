"""Contacts of a model as pairs of points on the dofs of all parts: gaps, frames (normals and tangents), areas, and the law of each point."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.assembly.contact import GROUND, NEXT, Contact, Join
from stickslip.assembly.joints.surface_checks import (
    flat_warning,
    named,
    overlap_warning,
    refuse_averted,
    refuse_held,
    refuse_without_direction,
    refuse_without_facets,
    rim_warning,
    tilt_warning,
    twice_warning,
    with_hint,
    with_pairing,
)
from stickslip.assembly.locations import AXES, NO_FACETS, Places, Spot
from stickslip.contact.law import ContactLaw, PressedOrOpen, Rigid, scaled
from stickslip.contact.laws import LAWS, law_name
from stickslip.contact.pairing import Pairing, node_to_node, node_to_segment, segment_to_segment
from stickslip.contact.surface import Surface
from stickslip.errors import InputError, input_error
from stickslip.model.axis import Axis
from stickslip.reduction.turning import dof_rotation
from stickslip.units import quantity_of

SQUARE = 0.3  # sine of the angle with a normal above which a direction is accepted for t
NODE_TO_NODE_DISTANCE_M = 1e-6  # largest distance of partners node to node
ROWS = {"tangential": 0, "normal": 2}


@dataclass(frozen=True)
class Turn:
    """Rotation from a sector to the next one.

    Parameters
    ----------
    sectors
        Number of sectors of the wheel.
    axis
        Axis of the wheel; None if coordinates do not change from sector to sector.
    """

    sectors: int
    axis: Axis | None

    @property
    def matrix(self) -> FloatArray:
        """(3, 3) rotation of vectors by one pitch."""
        if self.axis is None:
            return np.eye(3)
        return self.axis.rotation(2 * np.pi / self.sectors)

    def points(self, points: FloatArray) -> FloatArray:
        """Return points (n, 3) of this sector, rotated to the next sector."""
        return points if self.axis is None else self.axis.turned(points, 2 * np.pi / self.sectors)


@dataclass(frozen=True, eq=False)
class Pairs:
    """Contact points on N dofs of all parts.

    Parameters
    ----------
    own, following
        (3 p, N) CSR rows t, w, n: ``gap = own u + following u_next``, with u_next the dofs of the next sector in its
        own axes.
    names, groups
        Name of each point, and of its contact.
    laws
        Law of each point, its share of the law of the contact.
    position, frame, area
        (p, 3) in m, (p, 3, 3) columns t, w, n, (p,) in m²; NaN if unknown.
    nodes
        (p, 3) dofs x, y, z of the node at a point, on the first side, or on the second if the first is a rigid body; -1
        without a node.
    warnings
        Warnings for the user.
    """

    own: Matrix
    following: Matrix
    names: tuple[str, ...]
    groups: tuple[str, ...]
    laws: tuple[ContactLaw, ...]
    position: FloatArray
    frame: FloatArray
    area: FloatArray
    nodes: IntArray
    warnings: tuple[str, ...] = ()


def pair_contacts(places: Places, contacts: Mapping[str, Contact], turn: Turn | None) -> Pairs:
    """Pair the points of all contacts.

    Parameters
    ----------
    places
        Surfaces and dofs by name.
    contacts
        Name -> contact.
    turn
        Rotation from sector to sector; None if the model is not a sector.

    Raises
    ------
    InputError
        If a contact cannot be paired. The message names it and the reason.
    """
    n = places.n
    found = [one_contact(places, name, contact, turn) for name, contact in contacts.items()]
    twice = twice_warning(
        {
            name: (p.own + p.following, bool(np.all(np.isfinite(p.position))))
            for name, p in zip(contacts, found, strict=True)
        }
    )
    names = [name for pairs in found for name in pairs.names]
    if len(set(names)) < len(names):  # the points of two bodies may have the same names
        names = [f"{g}.{x}" for p in found for g, x in zip(p.groups, p.names, strict=True)]

    def stacked(which: str, empty: Any) -> FloatArray:
        return np.concatenate([empty, *(getattr(pairs, which) for pairs in found)])

    rows = [scipy.sparse.csr_array((0, n))]
    return Pairs(
        scipy.sparse.vstack([*rows, *(p.own for p in found)], format="csr"),
        scipy.sparse.vstack([*rows, *(p.following for p in found)], format="csr"),
        tuple(names),
        tuple(group for p in found for group in p.groups),
        tuple(law for p in found for law in p.laws),
        stacked("position", np.zeros((0, 3))),
        stacked("frame", np.zeros((0, 3, 3))),
        stacked("area", np.zeros(0)),
        np.concatenate([np.zeros((0, 3), dtype=np.int64), *(p.nodes for p in found)]),
        (*(text for p in found for text in p.warnings), *twice),
    )


def one_contact(places: Places, name: str, contact: Contact, turn: Turn | None) -> Pairs:
    """Pair the points of one contact."""
    key = f"contact.{name}"
    first, second, ahead = sides(places, key, contact, turn)
    law = at_rest(key, contact)
    if first.surface is None or (second is not None and second.surface is None):
        return _single_dofs(places, name, contact, law, first, second, ahead)
    pairing, said = _paired(places, key, contact, law, first, second, ahead)
    n, p = places.n, pairing.n_points
    operator = scipy.sparse.csr_array(pairing.gap_operator)
    on_facets = contact.pairing == "segment_to_segment" and second is not None
    has_area = on_facets or whole(first.surface)
    area = pairing.weights if has_area else np.full(p, np.nan)
    area = area if first.area is None else first.area
    refuse_held(key, operator)
    labels = first.labels if len(first.labels) == p else _numbered(name, p)
    rims = (text for side in (first, second) if side for text in rim_warning(places, key, side))
    warnings = (*said, *rims, *flat_warning(key, operator, law))
    if contact.pairing != "node_to_node" and len(first.surface.facets):
        lost = len(first.surface.points) - len(first.surface.used)
        if lost:
            text = f"{key}: {lost} nodes of {first.name} span no facet and take no part."
            warnings = (*warnings, text)
    return Pairs(
        operator[:, :n],
        operator[:, n:] if ahead else scipy.sparse.csr_array((3 * p, n)),
        labels,
        (name,) * p,
        _shared(key, contact, law, area),
        pairing.positions,
        pairing.frames,
        area,
        _nodes(places, contact, first, operator[:, :n]),
        warnings,
    )


def _numbered(name: str, points: int) -> tuple[str, ...]:
    """Return names of the points of a contact: its own for a single point, else with a number each."""
    return (name,) if points == 1 else tuple(f"{name}.{i + 1}" for i in range(points))


def _nodes(places: Places, contact: Contact, first: Spot, own: Matrix) -> IntArray:
    """Return the dofs of the node at each point."""
    assert first.surface is not None
    p = own.shape[0] // 3
    found = np.full((p, 3), -1, dtype=np.int64)
    if first.nodes is not None and contact.pairing != "segment_to_segment":
        return first.nodes if p == len(first.nodes) else first.nodes[first.surface.used]
    if first.nodes is not None:
        return found
    table = places.dofs
    for i in range(p):
        used = np.unique(own[3 * i : 3 * i + 3].indices)
        used = used[table.node[used] >= 0]
        if np.unique(table.node[used]).size == 1:
            axes = [AXES.index(table.component[dof]) for dof in used]
            found[i, axes] = used
    return found


def sides(
    places: Places, key: str, contact: Contact | Join, turn: Turn | None
) -> tuple[Spot, Spot | None, Turn | None]:
    """Return both sides of a contact or join (None: ground).

    Also return the rotation of the second side if it belongs to the next sector.
    """
    one, two = contact.between
    place = f"{key}.between"
    if one.startswith(NEXT) or one == GROUND:
        raise input_error(place, f"has {one!r} as its first side", "Let it be the second one.")
    first = places.spot(one, place)
    if two == GROUND:
        return first, None, None
    second = places.spot(two.removeprefix(NEXT), place)
    if not two.startswith(NEXT):
        refuse_itself(place, first, second)
        return first, second, None
    if turn is None or (places.parts[second.part].sectors == 1 and places.parts[second.part].mesh):
        raise input_error(
            place,
            f"has {two!r}, and {second.part!r} is no sector of a wheel",
            f"Leave {NEXT!r} out, or give the part its number of sectors.",
        )
    return first, second, turn


def refuse_itself(place: str, first: Spot, second: Spot) -> None:
    """Refuse two sides that are the same, or that share a single dof."""
    same = first.name == second.name
    met = first.dofs.shape == second.dofs.shape and bool(np.any(first.dofs == second.dofs))
    if same or met:
        whom = f"pairs {first.name!r}" if same else f"pairs a dof that is both in {first.name!r} and in {second.name!r}"
        raise input_error(
            place,
            f"{whom} with itself, where nothing moves relative to anything",
            'Name the other side, or "ground".',
        )


def _paired(
    places: Places,
    key: str,
    contact: Contact,
    law: ContactLaw,
    first: Spot,
    second: Spot | None,
    turn: Turn | None,
    *,
    hints: bool = True,
) -> tuple[Pairing, tuple[str, ...]]:
    """Pair two surfaces, and return warnings; with a rotation, dofs of the next sector follow those of this sector."""
    assert first.surface is not None
    a, b = widened(first.surface, second, turn)
    facing = with_normals(key, contact, first, a, second, b)
    along = direction(key, contact, law, first, facing, second, b)
    if b is None:
        empty = scipy.sparse.csr_array(facing.displacement.shape)
        b = Surface(facing.points, empty, NO_FACETS)
        held = named(key, contact, lambda: node_to_node(facing, b, tolerance=NODE_TO_NODE_DISTANCE_M, direction=along))
        return held, ()
    assert second is not None
    normals = facing.node_normals()[facing.used]
    opposite = normals_of(second, b)
    if opposite is not None and turn is not None and second.frame is not None:
        opposite = opposite[0], opposite[1] @ turn.matrix.T
    mine = facing.points[facing.used], normals
    refuse_without_facets(key, contact, facing, b)
    try:
        refuse_averted(key, contact, mine, opposite)
        found = named(key, contact, lambda: match(contact, facing, b, along), (facing, b))
    except InputError as error:
        told = with_pairing(error, contact, facing, b)
        if turn is None:
            raise with_hint(told, places, facing, second) from None
        raise (_exchanged(told, places, key, contact, law, first, second, turn) if hints else told) from None
    rigid = places.parts[first.part].body is not None and len(b.facets)
    tilted = tilt_warning(key, contact, first.part, mine, opposite) if rigid else ()
    return found, (*tilted, *overlap_warning(key, contact, found, (facing, b)))


def _exchanged(
    error: InputError,
    places: Places,
    key: str,
    contact: Contact,
    law: ContactLaw,
    first: Spot,
    second: Spot,
    turn: Turn,
) -> InputError:
    """Return an error about surfaces of neighbouring sectors; it says so if they match after an exchange."""
    one, two = contact.between
    other = two.removeprefix(NEXT), f"{NEXT}{one}"
    exchanged = replace(contact, between=other)
    try:
        _paired(places, key, exchanged, law, second, first, turn, hints=False)
    except InputError:
        return error
    remedy = f'With {one} and {other[0]} exchanged they match: between = ["{other[0]}", "{other[1]}"].'
    return input_error(error.place, error.problem, remedy)


def match(contact: Contact | Join, a: Surface, b: Surface, along: Any) -> Pairing:
    """Pair two surfaces by the method of a contact or join."""
    reach = contact.tolerance
    if contact.pairing == "node_to_node":
        return node_to_node(a, b, tolerance=NODE_TO_NODE_DISTANCE_M if reach is None else reach, direction=along)
    if contact.pairing == "node_to_segment":
        return node_to_segment(a, b, reach=reach, tolerance=None if reach is None else reach / 10, direction=along)
    return segment_to_segment(a, b, reach=reach, direction=along)


def widened(first: Surface, second: Spot | None, turn: Turn | None) -> tuple[Surface, Surface | None]:
    """Return both surfaces on the dofs of this sector followed by those of the next.

    The second is rotated to the next sector.
    """
    if second is None:
        return first, None
    b = second.surface
    assert b is not None
    if turn is None:
        return first, b
    empty = [scipy.sparse.csr_array(s.displacement.shape) for s in (first, b)]
    turned = scipy.sparse.kron(scipy.sparse.eye_array(len(b.points)), turn.matrix) @ b.displacement
    own = scipy.sparse.hstack([first.displacement, empty[0]], format="csr")
    theirs = scipy.sparse.hstack([empty[1], turned], format="csr")
    normals = None if b.normals is None else b.normals @ turn.matrix.T
    return (replace(first, displacement=own), Surface(turn.points(b.points), theirs, b.facets, normals, b.numbers))


def _single_dofs(
    places: Places, name: str, contact: Contact, law: ContactLaw, first: Spot, second: Spot | None, turn: Turn | None
) -> Pairs:
    """Pair single dofs, in the order in which they are named."""
    key = f"contact.{name}"
    one, two = first.dofs, first.dofs[:0] if second is None else second.dofs
    surfaces = [spot is not None and spot.surface is not None for spot in (first, second)]
    if any(surfaces):
        in_space, single = contact.between if surfaces[0] else contact.between[::-1]
        raise input_error(
            f"{key}.between",
            f"{in_space!r} has points in space, and {single!r} is a single dof, which moves along one line",
            "Such a surface meets the nodes of a mesh or another surface. Between lumped masses or single dofs take a lumped damper "
            "and a law between dofs, such as jenkins.",
        )
    if second is not None and len(one) != len(two):
        raise input_error(
            f"{key}.between",
            f"{contact.between[0]!r} has {len(one)} dofs and {contact.between[1]!r} {len(two)}",
            "Pair single dofs with as many single dofs or the ground.",
        )
    refuse_without_direction(name, contact, first)
    assert contact.acts is not None
    _refuse_unused(key, contact)
    p, n = len(one), places.n
    row = 3 * np.arange(p) + ROWS[contact.acts]

    def rows(dofs: Any, sign: float) -> Matrix:
        return scipy.sparse.csr_array((np.full(len(dofs), sign), (row[: len(dofs)], dofs)), (3 * p, n))

    own, theirs = rows(one, -1.0), rows(two, 1.0)
    if turn is not None and second is not None:
        theirs = theirs @ _turned_dofs(places, key, second.part, turn)
    names = _numbered(name, p)
    area = np.full(p, np.nan)
    return Pairs(
        own if turn is not None else own + theirs,
        theirs if turn is not None else rows(two[:0], 1.0),
        names,
        (name,) * p,
        _shared(key, contact, law, area),
        np.full((p, 3), np.nan),
        np.tile(np.eye(3), (p, 1, 1)),
        area,
        np.column_stack([one, np.full((p, 2), -1)]),
    )


def _refuse_unused(key: str, contact: Contact) -> None:
    """Refuse surface keys in a contact of single dofs."""
    pairing = None if contact.pairing == "node_to_node" else contact.pairing
    said = {"pairing": pairing, "normal": contact.normal, "tangent": contact.tangent}
    for word, given in said.items():
        if given is not None:
            raise input_error(
                f"{key}.{word}",
                f"is given, and {contact.between[0]!r} is a single dof: the contact acts along its motion alone",
                "Leave it out; acts says whether that motion is tangential or normal. Or name a node or a surface.",
            )


def _turned_dofs(places: Places, key: str, name: str, turn: Turn) -> Matrix:
    """Return the (N, N) matrix from the next sector's dofs in its own axes to those along the axes of this sector.

    Masses on a line have no axes.
    """
    part, n = places.parts[name], places.n
    if turn.axis is None or (part.body is None and part.mesh is None):
        return scipy.sparse.eye_array(n, format="csr")
    own = dof_rotation(part.structure.dofs, turn.matrix, f"{key}.between")
    first = places.offset(name)
    before, after = first, n - first - part.structure.n
    sides = [scipy.sparse.eye_array(before), own, scipy.sparse.eye_array(after)]
    return scipy.sparse.block_diag(sides, format="csr")


def at_rest(key: str, contact: Contact) -> ContactLaw:
    """Return the law with the preload and the gap of the contact."""
    law: Any = contact.law
    if contact.preload == 0.0 and contact.gap == 0.0:
        return contact.law
    if isinstance(contact.law, Rigid):
        pressed = contact.preload > 0.0
        changed: ContactLaw = (
            replace(law, preload=contact.preload)
            if pressed
            else replace(law, initial_gap=law.initial_gap + contact.gap)
        )
        return changed
    own = {entry.name for entry in fields(law)} if is_dataclass(law) else set()
    missing = [n for n in ("preload", "k_n") if n not in own or getattr(law, n) is None]
    if missing:
        raise _at_rest_alike(key, contact, *_without(law, missing))
    if contact.gap != 0.0 and law.k_n == 0.0:
        raise _at_rest_alike(key, contact, "has no normal stiffness here: its pressure is constant")
    if isinstance(law, PressedOrOpen):
        return law.at_rest(contact.preload, contact.gap)
    pressed = law.preload + contact.preload - law.k_n * contact.gap
    found: ContactLaw = replace(law, preload=pressed)
    return found


def _without(law: Any, missing: list[str]) -> tuple[str, ...]:
    """Return the reason why a law without these fields takes no preload and no gap, and a remedy for a user's law."""
    if law_name(law) in tuple(LAWS):
        return ("has a normal force that does not depend on how far the bodies are apart",)
    names = " and no field ".join(f"`{name}`" for name in missing)
    return (
        f"has no field {names}: the contact's preload and gap go into the law as preload - k_n * gap",
        "Give the law the fields `preload` (N at zero gap, N) and `k_n` (normal stiffness, N/m), or leave it out and press by the law's own parameters.",
    )


def _at_rest_alike(
    key: str,
    contact: Contact,
    why: str,
    remedy: str = "Choose a law that is pressed and lifts off, such as elastic_coulomb, or leave it out.",
) -> InputError:
    """Return an error about a preload, gap or interference without effect, with its key and its name in Python."""
    preload = "preload_pa" if contact.share == "area" else "preload_n"
    word = preload if contact.preload else "gap_m" if contact.gap > 0.0 else "interference_m"
    given = f"preload={contact.preload:g}" if contact.preload else f"gap={contact.gap:g}"
    return input_error(
        f"{key}.{word}", f"is given (in Python {given}), and the law {law_name(contact.law)} {why}", remedy
    )


def _shared(key: str, contact: Contact, law: ContactLaw, area: FloatArray) -> tuple[ContactLaw, ...]:
    """Return the law of each point."""
    p, known = len(area), bool(np.all(np.isfinite(area)))
    alike = isinstance(law, Rigid) and law.preload is None  # without parameters that could be shared
    if contact.share == "point" or alike:
        return (law,) * p
    if contact.share == "interface":
        factors = area / area.sum() if known else np.full(p, 1.0 / p)
    elif known:
        factors = area
    else:
        raise input_error(
            f"{key}.law",
            f"is given per area, and the points of {contact.between[0]!r} have none: they span no facets, and no body tells their areas",
            "Give the law of the whole interface or of a point, name a set that holds whole facets, or let a rigid body with areas come first.",
        )
    made: dict[float, ContactLaw] = {}
    try:
        return tuple(made.setdefault(f, scaled(law, f)) for f in map(float, factors))
    except InputError as error:
        raise error.inside(f"{key}.law") from None


def whole(surface: Surface) -> bool:
    """Whether every point belongs to a facet."""
    return bool(len(surface.facets)) and len(surface.used) == len(surface.points)


def with_normals(
    key: str, contact: Contact, first: Spot, a: Surface, second: Spot | None, b: Surface | None
) -> Surface:
    """Return side A with normals: from its frames or facets, from the contact, or opposite to the normals of side B."""
    from scipy.spatial import cKDTree

    if contact.normal is not None:
        return replace(a, facets=NO_FACETS, normals=_named(key, contact.normal, first, a))
    if first.frame is not None:
        return replace(a, normals=first.frame[:, :, 2])
    if whole(a) or (len(a.facets) and contact.pairing != "node_to_node"):
        return a
    if len(a.facets):  # nodes that span no facet take the normal of the nearest node with one
        near = a.used[cKDTree(a.points[a.used]).query(a.points)[1]]
        return replace(a, facets=NO_FACETS, normals=a.node_normals()[near])
    theirs = None if second is None or b is None else normals_of(second, b)
    if theirs is None:
        raise input_error(
            f"{key}.between",
            f"{first.name!r} spans no facet, and nothing else tells where its normal points",
            "Name a set that holds whole facets of a mesh, let the first side be the body with known normals, give the normal of the "
            "contact, or name single dofs with acts.",
        )
    points, normals = theirs
    return replace(a, normals=-normals[cKDTree(points).query(a.points)[1]])


def _named(key: str, normal: tuple[float, float, float], first: Spot, a: Surface) -> FloatArray:
    """Return the normal given by a contact, at each point; refuse it if the surface has normals of its own."""
    length = float(np.linalg.norm(normal))
    if first.frame is not None or len(a.facets):
        raise input_error(
            f"{key}.normal",
            f"is given, and {first.name!r} has normals of its own",
            "Leave it out; it is for nodes that span no facet.",
        )
    if not 0 < length < np.inf:
        raise input_error(f"{key}.normal", "has no length", "Along z it is [0, 0, 1].")
    return np.tile(np.asarray(normal, dtype=float) / length, (len(a.points), 1))


def normals_of(spot: Spot, surface: Surface) -> tuple[FloatArray, FloatArray] | None:
    """Return the points of a surface with normals from its frames or facets, and these normals; None without any."""
    if spot.frame is not None:
        return surface.points, spot.frame[:, :, 2]
    if not len(surface.facets):
        return None
    return surface.points[surface.used], surface.node_normals()[surface.used]


def direction(
    key: str, contact: Contact, law: ContactLaw, first: Spot, a: Surface, second: Spot | None, b: Surface | None
) -> Any:
    """Return the direction of t, from the contact or from the frames.

    Any direction if the law is the same along t and w.
    """
    from scipy.spatial import cKDTree

    if contact.tangent is not None:
        return contact.tangent
    if first.frame is not None:
        return first.frame[:, :, 0]
    if second is not None and second.frame is not None and b is not None:
        return second.frame[cKDTree(b.points).query(a.points)[1], :, 0]
    unlike = told_apart(law, per_area=contact.share == "area")
    if unlike:
        raise input_error(
            f"{key}.tangent",
            f"is missing, and the law is not the same along t and w: {unlike}",
            "Give the direction whose part in the contact plane is t, or make both alike.",
        )
    normals = a.node_normals()[a.used]
    sines = [np.linalg.norm(np.cross(normals, axis), axis=1).min() for axis in np.eye(3)]
    good = [i for i, sine in enumerate(sines) if sine > SQUARE] or [int(np.argmax(sines))]
    return tuple(float(x) for x in np.eye(3)[good[0]])


def told_apart(law: Any, *, per_area: bool) -> str:
    """Return the keys of the parameters ``NAME_t`` and ``NAME_w`` that differ in a law; empty without a difference."""
    known = {entry.name: entry for entry in fields(law)} if is_dataclass(law) else {}
    said = []
    for name, entry in known.items():
        other = known.get(f"{name[:-1]}w") if name.endswith("_t") else None
        if other is None or getattr(law, other.name) in (None, getattr(law, name)):
            continue  # None along w: as along t
        for one in (entry, other):
            told = quantity_of(one)
            word = one.name if told is None else told.key_of(one.name, per_area=per_area)
            said.append(f"{word} = {_short(getattr(law, one.name))}")
    return ", ".join(said)


def _short(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
