"""Refusals without a mesh: nodal diameters of analyses by waves."""

from collections.abc import Iterator
from typing import Any

from stickslip.errors import InputError, input_error
from stickslip.study.file.tables import Tables


def diameter_refusals(tables: Tables, sectors: int | None) -> Iterator[InputError]:
    """Yield the complaints about nodal diameters that a wheel of so many sectors has not; None where only a file knows."""
    for name in ("modes", "campbell"):
        yield from _diameters(name, getattr(tables, name, None), sectors)


def _diameters(name: str, table: Any, sectors: int | None) -> Iterator[InputError]:
    given = getattr(table, "nodal_diameters", None)
    if sectors is None or not given:
        return
    if sectors == 1 and max(given) > 0:
        yield input_error(
            f"{name}.nodal_diameters",
            "are of a wheel, and no part is a sector of one",
            "Leave them out, or give the part its number of sectors.",
        )
        return
    if max(given) > sectors // 2:
        yield input_error(
            f"{name}.nodal_diameters",
            f"{max(given)} is above half of {sectors} sectors",
            f"The nodal diameters go from 0 to {sectors // 2}.",
        )
        return
    for order in getattr(table, "engine_orders", ()):
        excited = min(order % sectors, -order % sectors)
        if excited not in given:
            yield input_error(
                f"{name}.engine_orders",
                f"{order} excites the nodal diameter {excited}, which is not computed",
                "Add it to nodal_diameters, or leave those out: then all that are excited are computed.",
            )
