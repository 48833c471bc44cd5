"""Refusals without a mesh: aerodynamic coefficients and pressures."""

from collections.abc import Iterator
from pathlib import Path

from stickslip.errors import InputError
from stickslip.study.file.tables import Tables
from stickslip.study.models.aero import aero_refusals
from stickslip.study.models.pressure import pressure_refusals


def fluid_refusals(tables: Tables, home: Path, sectors: int | None) -> Iterator[InputError]:
    """Yield what is wrong with [aero] and with pressures of loads."""
    yield from aero_refusals(tables, home, sectors)
    yield from pressure_refusals(tables, home)
