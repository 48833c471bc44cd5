"""Checks of the two surfaces of a contact: opposite normals, overlap, moving points."""

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import Any, TypeVar

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.assembly.contact import NEXT, Contact, Join
from stickslip.assembly.locations import Places, Spot, clamped_rim
from stickslip.contact.law import ContactLaw, Rigid
from stickslip.contact.pairing import Pairing
from stickslip.contact.projection import facet_balls
from stickslip.contact.surface import Surface
from stickslip.errors import InputError, input_error

Found = TypeVar("Found")

TILTED = 3.0  # degrees from opposite normals at which a rigid body may be rotated wrongly: meshes deviate less
STEEPEST = 45.0  # degrees from opposite normals at which surfaces cannot be meant to touch
# distance, as a share of a facet's radius, that touching surfaces may have everywhere due to rounding in their files
OFF = 1e-3
DEEP = 0.05  # overlap, as a share of a facet's radius, that facets of curved surfaces do not exceed
FLAT = 1e-9  # relative motion along a normal that is rounding
MEET_FACETS = 'Give pairing = "node_to_segment": each point of a rigid body meets a facet'
TENFOLD = "ten times the largest of these distances or more"  # a node may stand a tenth of the tolerance beyond a rim
NAMED = 5  # points that a message names
Normals = tuple[FloatArray, FloatArray]  # points (n, 3) and their unit normals


def refuse_averted(key: str, contact: Contact, mine: Normals, theirs: Normals | None) -> None:
    """Refuse surfaces whose normals are not opposite to each other.

    Parameters
    ----------
    key, contact
        Key ``contact.NAME``, and the contact.
    mine, theirs
        Points and outward normals of both sides; None if the second side has no normals.
    """
    if theirs is None or not len(mine[0]):
        return
    angle = float(np.median(_from_opposite(mine, theirs)))
    if angle <= STEEPEST:
        return
    one, two = contact.between
    way = "look the same way" if angle > 180.0 - STEEPEST else "do not face each other"
    raise input_error(
        f"{key}.between",
        f"{one!r} and {two!r} {way}: their outward normals, {_mean(mine[1])} and {_mean(theirs[1])}, are {angle:.0f}° from opposite",
        "Name the faces that meet, or check how the parts are placed, turned and mirrored.",
    )


def refuse_without_facets(key: str, contact: Contact, a: Surface, b: Surface) -> None:
    """Refuse points without facets where the pairing needs facets. The message names a pairing that fits."""
    one, two = contact.between
    need = {"node_to_segment": (b,), "segment_to_segment": (a, b)}.get(contact.pairing, ())
    if all(len(side.facets) for side in need):
        return
    points, remedy = two, 'Give pairing = "node_to_node", or name a surface with facets.'
    if len(a.facets) and not two.startswith(NEXT):
        remedy = f'Name the points first: between = ["{two}", "{one}"], with pairing = "node_to_segment".'
    elif len(b.facets):
        points, remedy = one, f"{MEET_FACETS}."
    raise input_error(
        f"{key}.between", f"{points!r} has points and no facets, as {contact.pairing} needs them there", remedy
    )


def with_pairing(error: InputError, contact: Contact, a: Surface, b: Surface) -> InputError:
    """Return an error about points without partners; for points that meet facets it names the suitable pairing."""
    if contact.pairing != "node_to_node" or len(a.facets) or not len(b.facets):
        return error
    return input_error(error.place, error.problem, f"{MEET_FACETS}.")


def tilt_warning(key: str, contact: Contact, part: str, mine: Normals, theirs: Normals | None) -> tuple[str, ...]:
    """Warn of a rigid part with no point flat on the other surface; arguments as in `refuse_averted`."""
    if theirs is None or not len(mine[0]):
        return ()
    angle = float(np.min(_from_opposite(mine, theirs)))  # a curved surface is flat on the other one somewhere
    if angle < TILTED:
        return ()
    one, two = contact.between
    text = (
        f"{key}: {one} is tilted by {angle:.3g}° against {two}. Check the angles of part.{part} (of a wedge left_angle_deg and "
        "right_angle_deg) and how it is placed."
    )
    return (text,)


def _from_opposite(mine: Normals, theirs: Normals) -> FloatArray:
    """Return the angle in degrees between the normals of points and the reversed nearest normals of the other side."""
    from scipy.spatial import cKDTree

    near = cKDTree(theirs[0]).query(mine[0])[1]
    cosine = np.clip(-np.einsum("pc,pc->p", mine[1], theirs[1][near]), -1.0, 1.0)
    return np.asarray(np.degrees(np.arccos(cosine)))


def _mean(normals: FloatArray) -> str:
    mean = normals.mean(axis=0)
    length = np.linalg.norm(mean)
    unit = mean / length if length > 0 else mean
    return f"({', '.join(f'{x + 0.0:.2f}' for x in unit.round(2))})"


def overlap_warning(key: str, contact: Contact, pairing: Pairing, sides: Sequence[Surface]) -> tuple[str, ...]:
    """Warn of surfaces that overlap by more than facet error and interference, or that touch nowhere."""
    sizes = [float(np.median(facet_balls(side)[1])) for side in sides if len(side.facets)]
    worst = int(np.argmin(pairing.initial_gap))
    deep = float(-pairing.initial_gap[worst])
    if not sizes or deep <= DEEP * min(sizes) + max(-contact.gap, 0.0):
        gap = pairing.initial_gap
        everywhere = float(np.abs(gap).min()) if np.ptp(np.sign(gap)) == 0 else 0.0
        far = sizes and contact.gap == 0.0 and everywhere > OFF * min(sizes)
        return (_apart(key, contact, float(np.median(gap))),) if far else ()
    one, two = contact.between
    place = ", ".join(f"{x:.4g}" for x in pairing.positions[worst])
    text = (
        f"{key}: {one} and {two} overlap by up to {deep:.3g} m as they are placed, at ({place}) m; the contact takes them as "
        "touching at rest. Move a part, or give interference_m if they are to press each other."
    )
    return (text,)


def _apart(key: str, contact: Contact, gap: float) -> str:
    """Return the error of surfaces that do not touch."""
    one, two = contact.between
    how = "lie apart" if gap > 0 else "overlap"
    word = "gap_m" if gap > 0 else "interference_m"
    return (
        f"{key}: {one} and {two} {how} by {abs(gap):.3g} m as they are placed; the contact takes them as touching at rest. Move a "
        f"part, or give {word} if that is meant."
    )


def refuse_joined(contacts: Mapping[str, Contact], joins: Mapping[str, Join]) -> None:
    """Refuse a contact between surfaces that a join ties."""
    for name, contact in contacts.items():
        for other, tied in joins.items():
            if set(contact.between) == set(tied.between):
                raise input_error(
                    f"contact.{name}.between",
                    f"names the surfaces that join.{other} ties for good, so that the contact cannot move",
                    "Remove one of them.",
                )


def refuse_held(key: str, operator: Matrix) -> None:
    """Refuse a contact in which no point can move."""
    if not operator.nnz:
        raise input_error(
            f"{key}.between",
            "no point of the contact can move: its nodes are clamped",
            "Name a surface that moves, or clamp less.",
        )


def flat_warning(key: str, operator: Matrix, law: ContactLaw) -> tuple[str, ...]:
    """Warn of a contact with normal stiffness in which no point can move along its normal."""
    rigid = isinstance(law, Rigid)
    if abs(operator[2::3]).max() > FLAT or not (rigid or law.stuck_stiffness()[2] > 0):
        return ()
    text = f"{key}: no point of it can move along the normal; its normal force stays constant, and its normal stiffness does nothing. Let the part move so (a beam: axial = true), or give another normal."
    return (text,)


def rim_warning(places: Places, key: str, spot: Spot) -> tuple[str, ...]:
    """Warn of facets missing at the rim of a surface, because readers remove clamped nodes from node sets."""
    mesh, (rim, left) = places.parts[spot.part].mesh, clamped_rim(places, spot)
    if mesh is None or spot.surface is None or not left.size:
        return ()
    listed = ", ".join(str(n) for n in mesh.numbers[left[:NAMED]])
    more = f" and {left.size - NAMED} more" if left.size > NAMED else ""
    text = (
        f"{key}: {spot.name} borders on clamped nodes, {listed}{more}; the facets between them and it, {len(rim)} "
        f"beside {len(spot.surface.facets)}, take no part in the contact."
    )
    return (text,)


def twice_warning(found: Mapping[str, tuple[Matrix, bool]]) -> tuple[str, ...]:
    """Warn of contacts between surfaces with the same dofs.

    Parameters
    ----------
    found
        Name of a contact -> its gap rows (3 p, N), and whether it is between surfaces.
    """
    touched: dict[str, frozenset[int]] = {
        name: frozenset(np.unique(scipy.sparse.csr_array(rows).indices).tolist())
        for name, (rows, surface) in found.items()
        if surface
    }
    return tuple(
        f"contact.{two} lies on the same points as contact.{one}: their forces add up. Remove one of them if that is not meant."
        for one, two in combinations(touched, 2)
        if touched[one] and touched[one] == touched[two]
    )


def refuse_contacts_of_dofs(places: Places, contacts: Mapping[str, Contact]) -> None:
    """Refuse contacts of single dofs of matrix parts without a direction `acts`.

    Dofs of meshes are checked during pairing.
    """
    for name, contact in contacts.items():
        part = places.parts.get(contact.between[0].partition(".")[0])
        if contact.acts is None and part is not None and part.mesh is None and part.body is None:
            spot = places.spot(contact.between[0], f"contact.{name}.between")
            refuse_without_direction(name, contact, spot)


def refuse_without_direction(name: str, contact: Contact, first: Spot) -> None:
    """Refuse a contact of single dofs without a direction `acts`."""
    if contact.acts is None and first.surface is None:
        raise input_error(
            f"contact.{name}.acts",
            f"is missing: {first.name!r} is a single dof, which has no normal",
            'Say what its relative motion is to the contact: acts = "normal" or "tangential".',
        )


def with_hint(error: InputError, places: Places, first: Surface, second: Spot) -> InputError:
    """Return an error about a surface without partners that names the nearest set of the second part."""
    assert second.surface is not None
    part = places.parts[second.part]
    own = _distance(first, second.surface.points)
    near: list[tuple[float, str]] = []
    for name in part.names:
        full = f"{second.part}.{name}"
        spot: Any = places.spot(full, "")
        if full != second.name and spot.surface is not None and len(spot.surface.points):
            near.append((_distance(first, spot.surface.points), full))
    if not near or min(near)[0] > 0.1 * own:
        return error
    remedy = (
        f"{error.remedy} {min(near)[1]!r} lies nearer than {second.name!r}: are surfaces swapped? "
        "Or is a part not where it belongs: look at placed."
    )
    return input_error(error.place, error.problem, remedy)


def _distance(surface: Surface, points: FloatArray) -> float:
    """Return the median distance of a surface's points to the nearest of `points`, m."""
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(points).query(surface.points[surface.used])[0]))


def named(
    key: str, contact: Contact | Join, pair: Callable[[], Found], surfaces: tuple[Surface, Surface] | None = None
) -> Found:
    """Pair two surfaces; an error names the contact and the distance of its surfaces."""
    from scipy.spatial import cKDTree

    try:
        found = pair()
    except InputError as error:
        one, two = contact.between
        told = error.called({"reach": "tolerance", "rim": f"tolerance = {TENFOLD}"})
        if surfaces is not None and contact.pairing != "node_to_node" and "rim" not in error.words:
            a, b = (side.points[side.used] for side in surfaces)
            nearest = float(cKDTree(b).query(a)[0].min())
            problem = f"{told.problem}; the nearest nodes or points of both lie {nearest:.3g} m apart"
            told = InputError(told.place, problem, told.advice, told.words, told.others)
        raise told.inside(f"{key} (side A: {one}, side B: {two})") from None
    return found
