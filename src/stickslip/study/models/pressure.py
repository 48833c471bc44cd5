"""Pressure fields from files: CSV with units in the column names, or a VTK surface."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.assembly.fluid.pressure import PressureField
from stickslip.errors import InputError, input_error, missing_file, missing_package
from stickslip.model.readers.measured_columns import MeasuredColumns, read_columns
from stickslip.study.file.tables import Tables
from stickslip.units import DEG

LENGTHS = {"m": 1.0, "mm": 1e-3}
AREAS = {"m2": 1.0, "mm2": 1e-6}
PRESSURES = {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "bar": 1e5}
VTK = (".vtk", ".vtu")
NORMAL = ("normal_x", "normal_y", "normal_z")
WORDS = ("note", "comment")
COLUMNS = (
    "x_m, y_m, z_m, then pressure_pa, or real_pa and imag_pa, or amplitude_pa and phase_deg; area_m2 with normal_x, normal_y, normal_z. "
    "_mm, _mm2, _kpa, _mpa and _bar are other units"
)
UNIT = 1e-3  # largest deviation of a normal's length from 1


def pressure_refusals(tables: Tables, home: Path) -> Iterator[InputError]:
    """Yield errors about missing pressure files."""
    for name, load in tables.load.items():
        if load.pressure is not None and not (home / load.pressure).is_file():
            yield missing_file(f"load.{name}.pressure", home / load.pressure)


def read_pressure(path: Path, length_unit: str, *, static: bool) -> PressureField:
    """Read a pressure field.

    Parameters
    ----------
    path
        A CSV, ``.vtk`` or ``.vtu`` file.
    length_unit
        Length unit of a VTK file: ``m`` or ``mm``; CSV columns carry their own.
    static
        Whether the field is static and has no phase.

    Raises
    ------
    InputError
        If the file cannot be used; the message names file, line, column and value.
    """
    if path.suffix.lower() in VTK:
        return _of_vtk(path, LENGTHS[length_unit], static=static)
    columns = read_columns(path)
    _check_names(columns)
    points = np.column_stack([columns.required(axis, LENGTHS) for axis in "xyz"])
    pressure = _pressure(columns, static=static)
    return PressureField(points, pressure, _area(columns), str(path))


def _check_names(columns: MeasuredColumns) -> None:
    known = [f"{axis}_{unit}" for axis in "xyz" for unit in LENGTHS]
    known += [f"{part}_{unit}" for part in ("pressure", "real", "imag", "amplitude") for unit in PRESSURES]
    known += ["phase_deg", *(f"area_{unit}" for unit in AREAS), *NORMAL, *WORDS]
    for name in columns.names:
        if name not in known:
            raise columns.unknown(name, known, COLUMNS)


def _pressure(columns: MeasuredColumns, *, static: bool) -> ComplexArray:
    """Return the complex pressure in Pa."""
    there = {part: columns.named(part, PRESSURES) for part in ("pressure", "real", "imag", "amplitude")}
    given = {part for part, (name, _) in there.items() if name}
    phase = "phase_deg" in columns.names
    wanted = [{"pressure"}] if static else [{"real", "imag"}, {"amplitude"}]
    if given not in wanted or (phase != ("amplitude" in given)):
        found = ", ".join(sorted(there[part][0] for part in given)) or "no pressure"
        what = "pressure_pa" if static else "real_pa and imag_pa, or amplitude_pa and phase_deg"
        kind = "A static load" if static else "A harmonic load"
        raise input_error(
            f"{columns.path}: line 1", f"has {found}{' and phase_deg' if phase else ''}", f"{kind} has {what}."
        )

    def numbers(part: str) -> FloatArray:
        name, factor = there[part]
        return factor * columns.numbers(name)

    if static:
        return numbers("pressure").astype(complex)
    if "amplitude" in given:
        turn = np.exp(1j * DEG * columns.numbers("phase_deg"))
        return np.asarray(numbers("amplitude") * turn)
    return np.asarray(numbers("real") + 1j * numbers("imag"))


def _area(columns: MeasuredColumns) -> FloatArray | None:
    """Return (n, 3) area vectors; None if the file has none."""
    name, factor = columns.named("area", AREAS)
    normal = [n for n in NORMAL if n in columns.names]
    if not name and not normal:
        return None
    if not name or len(normal) < 3:
        raise input_error(
            f"{columns.path}: line 1",
            f"has {name or ' and '.join(normal)} alone",
            f"Areas go with the columns {', '.join(NORMAL)}.",
        )
    area = columns.numbers(name)
    bad = np.flatnonzero(area <= 0)
    if bad.size:
        raise columns.wrong(int(bad[0]), name, "must be above zero", "Mend the line.")
    unit = np.column_stack([columns.numbers(n) for n in NORMAL])
    off = np.flatnonzero(np.abs(np.linalg.norm(unit, axis=1) - 1) > UNIT)
    if off.size:
        raise columns.wrong(int(off[0]), NORMAL[0], "is of no vector of length 1", "Divide each normal by its length.")
    return np.asarray(factor * area[:, None] * unit)


def _of_vtk(path: Path, length: float, *, static: bool) -> PressureField:
    """Return the field of a surface: quadrature points of its triangles, with their areas."""
    try:
        import meshio
    except ImportError as error:
        raise missing_package("meshio", error, "fe") from error
    try:
        mesh = meshio.read(path)
    except (Exception, SystemExit) as error:  # noqa: BLE001  the library raises many different errors on wrong files
        said = " ".join(str(error).split())
        raise input_error(str(path), f"cannot be read as VTK ({said})", "Write it as .vtu, ASCII.") from None
    points = length * np.asarray(mesh.points, dtype=float)
    triangles = []
    data: dict[str, list[Any]] = {name: [] for name in mesh.cell_data}
    for i, block in enumerate(mesh.cells):
        if block.type not in ("triangle", "quad"):
            continue
        own = np.asarray(block.data)
        pieces = [own] if block.type == "triangle" else [own[:, [0, 1, 2]], own[:, [0, 2, 3]]]
        triangles += pieces
        for name, known in data.items():
            known.extend([np.asarray(mesh.cell_data[name][i])] * len(pieces))
    if not triangles:
        raise input_error(str(path), "has no triangles or quadrilaterals", "Write the blade's surface.")
    corners = np.concatenate(triangles)
    rule = np.array([[2 / 3, 1 / 6, 1 / 6], [1 / 6, 2 / 3, 1 / 6], [1 / 6, 1 / 6, 2 / 3]])
    a, b, c = points[corners].transpose(1, 0, 2)
    area = np.repeat(np.cross(b - a, c - a) / 6, 3, axis=0)
    places = np.einsum("qk,tkc->tqc", rule, points[corners]).reshape(-1, 3)
    nodal = {name.lower(): np.asarray(own) for name, own in mesh.point_data.items()}
    cells = {name.lower(): np.repeat(np.concatenate(own), 3) for name, own in data.items()}
    values = _vtk_values(path, nodal, cells, corners, rule, static=static)
    return PressureField(places, values, area, str(path))


def _vtk_values(
    path: Path,
    nodal: Mapping[str, FloatArray],
    cells: Mapping[str, FloatArray],
    corners: Any,
    rule: FloatArray,
    *,
    static: bool,
) -> ComplexArray:
    names = ("pressure_pa",) if static else ("real_pa", "imag_pa", "amplitude_pa", "phase_deg")

    def at(name: str) -> FloatArray | None:
        if name in nodal:
            return np.asarray((nodal[name][corners] @ rule.T).ravel())
        return cells.get(name)

    found = {name: at(name) for name in names}
    if static and found["pressure_pa"] is not None:
        return found["pressure_pa"].astype(complex)
    if not static and found["real_pa"] is not None and found["imag_pa"] is not None:
        return np.asarray(found["real_pa"] + 1j * found["imag_pa"])
    if not static and found["amplitude_pa"] is not None and found["phase_deg"] is not None:
        return np.asarray(found["amplitude_pa"] * np.exp(1j * DEG * found["phase_deg"]))
    known = ", ".join([*nodal, *cells]) or "none"
    what = "pressure_pa" if static else "real_pa and imag_pa, or amplitude_pa and phase_deg"
    raise input_error(str(path), f"has the data {known}", f"Name the data of points or cells {what}.")
