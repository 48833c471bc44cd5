"""Refusals without a mesh: run-ups."""

from collections.abc import Iterator
from typing import Any

from stickslip.contact.laws import ALL_LAWS
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.errors import InputError, input_error
from stickslip.study.file.tables import Tables


def run_up_refusals(tables: Tables) -> Iterator[InputError]:
    """Yield the complaints about aerodynamic forces, mistuning and rigid contacts beside [run_up]."""
    asked: Any = getattr(tables, "run_up", None)
    contacts: dict[str, Any] = tables.contact
    if asked is None:
        return
    if tables.aero is not None:
        yield input_error(
            "run_up",
            "does not follow the aerodynamic forces of [aero] over speed",
            "Leave [aero] out, or compute forced responses at single speeds.",
        )
    for name in tables.mistuning:
        yield input_error(
            "run_up",
            f"is of tuned wheels, and [mistuning.{name}] makes sectors differ",
            "Leave it out, or compute forced responses at single speeds.",
        )
    for name, table in contacts.items():
        if asked.rate_rpm_per_s and ALL_LAWS[table.law] is RigidCoulomb:
            yield input_error(
                "run_up.rate_rpm_per_s",
                f"needs contact forces that follow from gaps, and contact.{name}.law is {table.law}",
                "Give the contact a stiffness, or leave the rates out.",
            )
