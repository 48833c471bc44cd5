"""Conversion of study tables to a model."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from stickslip.assembly.contact import GROUND, NEXT, Contact, Join
from stickslip.assembly.fluid.aerodynamics import Aerodynamics
from stickslip.assembly.forces import Load, Output
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.model.part import Part
from stickslip.study.file.model.loads import LoadTable
from stickslip.study.file.tables import Tables
from stickslip.study.models.aero import aerodynamics_of
from stickslip.study.models.checks import diameter_refusals, staged
from stickslip.study.models.files import alike
from stickslip.study.models.mistuning import mistuning_of
from stickslip.study.models.parts import Memo, Workshop
from stickslip.study.models.pressure import read_pressure
from stickslip.study.models.spares import spare_parts
from stickslip.units import DEG, HZ, RPM

DOF = re.compile(r"node\d+(\.r?[xyz])?|r?[xyz]|dof\d+")
NORMAL_ALONE = ("unilateral_spring",)  # laws with normal forces only


def model_of(tables: Tables, home: Path, memo: Memo) -> Model:
    """Return the model of one case.

    Parameters
    ----------
    tables
        Tables of the case.
    home
        Folder to which file names are relative.
    memo
        Parts built for earlier cases; new parts are added.

    Raises
    ------
    InputError
        If files cannot be read or inputs are inconsistent; the message names the key.
    """
    every = Workshop(tables, home, memo).parts()
    spare = spare_parts(tables)
    parts = {name: part for name, part in every.items() if name not in spare}
    rotation = tables.rotation
    _require_speed(tables, parts)
    if not staged(tables):
        for error in diameter_refusals(tables, max((part.sectors for part in parts.values()), default=1)):
            raise error
    alike = Model(
        parts=parts,
        contacts={name: _contact(parts, table) for name, table in tables.contact.items()},
        joins={
            name: Join(
                between=_between(parts, table.between),
                pairing=table.pairing,
                tolerance=table.tolerance_m,
                harmonics=tuple(table.harmonics or ()),
            )
            for name, table in tables.join.items()
        },
        loads={name: _load(tables, parts, table, home) for name, table in tables.load.items()},
        outputs=_outputs(tables, parts),
        peak_output=tables.output.peak,
        amplitude_of=tables.output.measure,
        alert_over=_alert_over(tables),
        speed=RPM * rotation.speed_rpm,
        tangent=rotation.tangent,
        coriolis=rotation.coriolis,
        centrifugal=rotation.centrifugal,
        interface_modes=None if tables.reduction is None else tables.reduction.interface_modes,
        retention=tables.retention.stiffness_n_per_m,
        aerodynamics=_aerodynamics(tables, parts, home),
    )

    def own_name(name: str) -> str:
        return _own_name(parts, name)

    mistuning = mistuning_of(tables, home, alike, every, own_name)
    return alike if mistuning is None else replace(alike, mistuning=mistuning)


def _require_speed(tables: Tables, parts: Mapping[str, Part]) -> None:
    """Refuse a study without a speed if one of its files has one."""
    if "speed_rpm" in tables.rotation.model_fields_set:
        return
    for name, part in parts.items():
        if part.own_speed:
            rpm = part.own_speed / RPM
            raise input_error(
                "rotation.speed_rpm",
                f"is missing, and the file of part.{name} turns at {rpm:.6g} rpm",
                f"Write speed_rpm = {rpm:.6g} under [rotation], or 0 for the wheel at rest.",
            )


def _aerodynamics(tables: Tables, parts: Mapping[str, Part], home: Path) -> Aerodynamics | None:
    if tables.aero is None:
        return None
    points = {name: _own_name(parts, point.on) for name, point in tables.aero.points.items()}
    clamped = None if tables.aero.clamped is None else _own_name(parts, tables.aero.clamped)
    sectors = max(part.sectors for part in parts.values())
    return aerodynamics_of(tables.aero, home, sectors, points, clamped or "")


def newton(tables: Tables, table: LoadTable) -> float:
    """Return the force of a load, N: its own value, or the force of another load divided by the ratio."""
    if table.force_n is not None:
        return table.force_n
    if table.pressure is not None:  # factor of the pressure field
        return 1.0
    other = tables.load[str(table.ratio_of).removeprefix("load.")]
    assert table.ratio is not None
    return newton(tables, other) / table.ratio


def _contact(parts: Mapping[str, Part], table: Any) -> Contact:
    return Contact(
        between=_between(parts, table.between),
        law=table.library(),
        share=table.per,
        pairing=table.pairing,
        tangent=None if table.tangent is None else tuple(table.tangent),
        normal=None if table.normal is None else tuple(table.normal),
        acts=table.acts or _acts(table),
        tolerance=table.tolerance_m,
        gap=table.gap,
        preload=table.preload,
    )


def _acts(table: Any) -> Any:
    """Return the default direction of a contact between single dofs; surfaces have normals."""
    return "normal" if table.law in NORMAL_ALONE else "tangential"


def _between(parts: Mapping[str, Part], names: list[str]) -> tuple[str, str]:
    first, second = (_own_name(parts, name) for name in names)
    return first, second


def _own_name(parts: Mapping[str, Part], name: str) -> str:
    """Return the name of a surface as in its file; capitals do not matter."""
    ahead = NEXT if name.startswith(NEXT) else ""
    head, dot, rest = name.removeprefix(NEXT).partition(".")
    if name == GROUND or head not in parts or not rest:
        return name
    as_dof = rest.lower() if DOF.fullmatch(rest.lower()) else rest
    return f"{ahead}{head}{dot}{alike(rest, parts[head].names) or as_dof}"


def _load(tables: Tables, parts: Mapping[str, Part], table: LoadTable, home: Path) -> Load:
    x, y, z = table.direction or (0.0, 0.0, 0.0)
    field = None
    if table.pressure is not None:
        still = table.harmonic == 0
        field = read_pressure(home / table.pressure, table.length_unit, static=still)
    return Load(
        on=_own_name(parts, table.on),
        newton=newton(tables, table),
        direction=None if table.direction is None else (x, y, z),
        harmonic=table.harmonic,
        phase=table.phase_deg * DEG,
        engine_order=table.engine_order,
        omega=None if table.frequency_hz is None else HZ * table.frequency_hz,
        omega_ratio=table.frequency_ratio,
        field=field,
    )


def _outputs(tables: Tables, parts: Mapping[str, Part]) -> tuple[Output, ...]:
    usual = tables.output.directions
    return tuple(
        Output(
            name=name,
            on=_own_name(parts, point.on),
            near=None if point.near_m is None else (point.near_m[0], point.near_m[1], point.near_m[2]),
            directions=tuple(point.directions or usual or ()),
        )
        for name, point in tables.output.points.items()
    )


def _alert_over(tables: Tables) -> tuple[str, ...]:
    over = tables.harmonics.alert_over
    return (over,) if isinstance(over, str) else tuple(over)
