"""Normals and tangents of contact surfaces, from their own frames or facets, or from the other side."""

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.assembly.contact import Contact
from stickslip.assembly.locations import NO_FACETS, Spot
from stickslip.contact.law import ContactLaw
from stickslip.contact.surface import Surface
from stickslip.errors import input_error
from stickslip.units import quantity_of

SQUARE = 0.3  # sine of the angle with a normal above which a direction is accepted for t


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
