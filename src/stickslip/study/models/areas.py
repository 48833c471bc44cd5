"""Contacts per area on rigid bodies: the data needed for the areas of their points."""

from collections.abc import Iterator
from typing import Any

from stickslip.errors import InputError, input_error
from stickslip.study.file.bodies import Cylinder, FlatCurved, RigidBodyTable
from stickslip.study.file.parts import Copy
from stickslip.study.file.tables import Tables

_FLAT_CURVED = {
    "flat": ("length_m", "flat_between_m"),
    "curved": ("length_m", "curved_width_m"),
}  # a wedge tells its areas itself


def without_areas(tables: Tables) -> Iterator[InputError]:
    """Yield the complaint about each key that a contact per area needs and its body does not have."""
    contacts: dict[str, Any] = tables.contact
    for name, contact in contacts.items():
        head, _, side = contact.between[0].partition(".")
        if contact.per != "area" or head not in tables.part:
            continue
        table: Any = tables.part[head]
        while isinstance(table, Copy) and table.of in tables.part:
            head, table = table.of, tables.part[table.of]
        for key, value in _told(table, side).items():
            if value is None:
                yield input_error(
                    f"part.{head}.{key}",
                    f'is missing, and contact.{name} has per = "area": the points of {contact.between[0]!r} have no area',
                    'Add it, or give the contact per = "interface" and the stiffness of the whole side.',
                )


def _told(table: Any, side: str) -> dict[str, Any]:
    """Return what tells the areas of a side's points, by key; None where it is left out."""
    if isinstance(table, FlatCurved):
        return {key: getattr(table, key) for key in _FLAT_CURVED.get(side, ())}
    if isinstance(table, Cylinder):
        return {"contact_width_m": table.contact_width_m}  # type: ignore[attr-defined]
    if isinstance(table, RigidBodyTable):
        surface = table.surfaces.get(side)  # type: ignore[attr-defined]
        return {} if surface is None else {f"surfaces.{side}.areas_m2": surface.areas_m2}
    return {}
