"""Refusals without a mesh: joined wheels of different numbers of sectors."""

from collections.abc import Iterator

from stickslip.assembly.contact import ALONE, SPATIAL
from stickslip.errors import InputError, input_error
from stickslip.study.analyses import ANALYSES
from stickslip.study.file.tables import Tables


def staged(tables: Tables) -> bool:
    """Whether a join couples stages."""
    return any(table.pairing == SPATIAL for table in tables.join.values())


def stage_refusals(tables: Tables) -> Iterator[InputError]:
    """Yield the complaints about what nobody knows of coupled stages."""
    if not staged(tables):
        return
    for name in ANALYSES:
        if name != "modes" and getattr(tables, name, None) is not None:
            why = f"is no question for stages, which a join by {SPATIAL} couples"
            yield input_error(name, why, ALONE)
    for name, table in tables.join.items():
        if table.pairing != SPATIAL:
            yield input_error(f"join.{name}.pairing", f"is {table.pairing} beside joins by {SPATIAL}", ALONE)
    for name in tables.contact:
        yield input_error(f"contact.{name}", "touches stages, which a join couples", ALONE)
    if tables.rotation.speed_rpm > 0:
        yield input_error("rotation.speed_rpm", "gives stages a prestress that crosses their flanges", ALONE)
