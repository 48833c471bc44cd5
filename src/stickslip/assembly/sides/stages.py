"""Parts that are sectors of different wheels, coupled at their flanges by spatial harmonics."""

from collections.abc import Collection, Mapping

import numpy as np

from stickslip.arrays import IntArray
from stickslip.assembly.contact import ALONE, NEXT, SPATIAL, Join
from stickslip.assembly.locations import Places
from stickslip.assembly.sides.wheel import faces_of
from stickslip.errors import input_error
from stickslip.reduction.coupled_stages import Flange, Multistage, multistage


def is_staged(joins: Mapping[str, Join]) -> bool:
    """Whether a join couples stages."""
    return any(join.pairing == SPATIAL for join in joins.values())


def stages_of(places: Places, joins: Mapping[str, Join], contacts: Collection[str], speed: float) -> Multistage | None:
    """Return the wheels of a model whose joins couple several; None for a model of one wheel.

    Parameters
    ----------
    places
        Dofs and names of the parts.
    joins, contacts
        Joins of the model, and names of its contacts.
    speed
        Rotor speed, rad/s; zero for models that do not depend on it.

    Raises
    ------
    InputError
        If the parts have other joins or contacts, a part is no sector or has no flange, or the flanges do not fit.
    """
    if not is_staged(joins):
        return None
    for name, join in joins.items():
        if join.pairing != SPATIAL:
            raise input_error(f"join.{name}.pairing", f"is {join.pairing} beside joins by {SPATIAL}", ALONE)
    if contacts:
        raise input_error(f"contact.{next(iter(contacts))}", "is between stages or within one", ALONE)
    if speed > 0:
        raise input_error("rotation.speed_rpm", "gives stages a prestress that crosses their flanges", ALONE)
    flanges = [_flange(places, f"join.{name}", join) for name, join in joins.items()]
    used = {stage for flange in flanges for stage in flange.stages}
    sectors = {}
    for name, part in places.parts.items():
        sector = faces_of(name, part) if part.sectors > 1 and name in used else None
        if sector is None:
            raise input_error(
                f"part.{name}",
                "is no sector with cyclic faces on a flange",
                "Every part is one stage: give it its sectors, and a join by spatial harmonics.",
            )
        sectors[name] = sector
    return multistage(sectors, flanges)


def _flange(places: Places, key: str, join: Join) -> Flange:
    names, dofs = [], []
    for surface in join.between:
        if surface.startswith(NEXT):
            raise input_error(f"{key}.between", f"{surface!r} is on the next sector", "Name the stages.")
        spot = places.spot(surface, f"{key}.between")
        if spot.nodes is None:
            raise input_error(f"{key}.between", f"{surface!r} holds no nodes", "Name a node set.")
        names.append(spot.part)
        dofs.append(_of_part(spot.nodes, places.offset(spot.part)))
    if names[0] == names[1]:
        raise input_error(f"{key}.between", f"names {names[0]!r} twice", "Name two stages.")
    return Flange((names[0], names[1]), (dofs[0], dofs[1]), tuple(sorted(set(join.harmonics))))


def _of_part(nodes: IntArray, offset: int) -> IntArray:
    return np.unique(nodes[nodes >= 0]) - offset
