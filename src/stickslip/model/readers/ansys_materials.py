"""Materials of an ANSYS archive: isotropic, orthotropic and anisotropic elasticity in the coordinate systems of the elements."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import InputError, input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.material import (
    AnyMaterial,
    Material,
    Orientation,
    elastic_material,
    orthotropic_stiffness,
    refuse_unstable,
)
from stickslip.model.readers.ansys_blocks import ESYS, MATERIAL, NUMBER, Blocks, is_whole, read_blocks
from stickslip.model.readers.units import Units, check_material

ENTRIES = [(i, j) for i in range(6) for j in range(i, 6)]  # their places: down the columns, order x, y, z, xy, yz, xz
SHEARS = ("GXY", "GXZ", "GYZ")
RATIOS = ("XY", "XZ", "YZ")


def read_ansys_materials(
    path: Path | str, *, units: Units | None = None, plausible: bool = True
) -> dict[int, AnyMaterial]:
    """Read the elastic materials of an ANSYS archive.

    Parameters
    ----------
    path
        The ``.cdb`` file.
    units
        Unit system of the model, SI by default: the file does not say.
    plausible
        Whether density and Young's modulus are checked for plausibility.

    Returns
    -------
    dict
        Material number -> material, in SI, axes global; materials without stiffness or density are left out.

    Raises
    ------
    InputError
        If the file is damaged, or a material is incomplete, unstable or implausible.
    """
    return _materials(Path(path), read_blocks(Path(path)), Units.si() if units is None else units, plausible)


def ansys_cell_materials(path: Path, elements: Sequence[int], units: Units, *, plausible: bool) -> list[AnyMaterial]:
    """Return the materials of elements, anisotropic ones in the element coordinate systems (ESYS).

    Parameters
    ----------
    path
        The ``.cdb`` file.
    elements
        Numbers of the elements, in the order of the answer.
    units, plausible
        As in `read_ansys_materials`.

    Raises
    ------
    InputError
        As `read_ansys_materials`; if an element's material is missing, or its coordinate system is not read.
    """
    blocks = read_blocks(path)
    known, systems = _materials(path, blocks, units, plausible), _systems(blocks, units)
    heads = {int(head[NUMBER]): head for head in blocks.heads}
    made: dict[tuple[int, int], AnyMaterial] = {}
    found = []
    for number in elements:
        key = int(heads[number][MATERIAL]), int(heads[number][ESYS])
        if key not in made:
            made[key] = _in_system(f"{path}: element {number}", key, known, systems)
        found.append(made[key])
    return found


def _in_system(
    place: str, key: tuple[int, int], known: Mapping[int, AnyMaterial], systems: Mapping[int, Orientation | str]
) -> AnyMaterial:
    number, system = key
    if number not in known:
        raise input_error(
            place,
            f"has the material {number}, which lacks stiffness, Poisson's ratio or density",
            "Complete it, or add the table [material].",
        )
    material = known[number]
    if isinstance(material, Material) or system == 0:
        return material
    axes = systems.get(system, "is not in the file (LOCAL)")
    if isinstance(axes, str):
        raise input_error(
            place,
            f"has an anisotropic material in the coordinate system {system}, which {axes}",
            "Use a Cartesian or a cylindrical local system.",
        )
    return replace(material, orientation=axes)


def _systems(blocks: Blocks, units: Units) -> dict[int, Orientation | str]:
    """Return the local coordinate systems; a text says why one is not read."""
    parts: dict[int, dict[str, list[str]]] = {}
    for _, (command, *words) in blocks.commands:
        if command.upper() != "LOCAL":
            continue
        if words and words[0].upper() == "R5.0":
            kind, number, *rest = [word.upper() for word in [*words[1:], "", "", ""]]
        else:  # LOCAL,n,type,x,y,z,angles
            kind, number, *rest = ["ALL", *words, *[""] * 9]
        if is_whole(number):
            parts.setdefault(int(number), {})[kind] = rest
    return {number: _system(given, units) for number, given in parts.items()}


def _system(given: Mapping[str, list[str]], units: Units) -> Orientation | str:
    whole = given.get("ALL")
    kind = (whole or next(iter(given.values())))[0].rstrip(".") or "0"
    if kind not in ("0", "1"):
        return "is neither Cartesian nor cylindrical"
    try:
        origin = [float(w or 0) for w in ((whole or given.get("LOC") or ["", *"000"])[1:4] + [""] * 3)[:3]]
        where = whole[4:7] if whole else (given.get("ANG") or ["", *"000"])[1:4]
        first, second, third = (math.radians(float(w or 0)) for w in (where + [""] * 3)[:3])
        stretched = [float(w or 0) for w in (given.get("PRM") or [""])[1:2]]
    except ValueError:
        return "has no numbers"
    if kind == "1" and stretched and stretched[0] not in (0.0, 1.0):
        return "is elliptical"
    x, y, z = Axis((1, 0, 0)), Axis((0, 1, 0)), Axis((0, 0, 1))
    turn = z.rotation(first) @ x.rotation(second) @ y.rotation(third)
    if kind == "0":
        return Orientation(tuple(tuple(row) for row in turn.tolist()))
    a, b, c = (units.length * v for v in origin)
    u, v, w = turn[:, 2].tolist()
    return Orientation(around=Axis((u, v, w), (a, b, c)))


@dataclass
class _Table:
    place: str
    flexible: bool
    values: list[float]


def _tables(blocks: Blocks) -> dict[int, _Table]:
    """Return the tables of 21 elastic constants by material."""
    found: dict[int, _Table] = {}
    current: _Table | None = None
    at = 0
    for place, (command, *words) in blocks.commands:
        word = command.upper()[:5]
        if word == "TB":
            label, number, temperatures, _, option = (w.upper() for w in (*words, *[""] * 5)[:5])
            current, at = None, 0
            if not is_elastic_table([label, number, temperatures, "", option]) or not is_whole(number):
                continue
            if temperatures not in ("", "0", "1"):
                raise input_error(place, "depends on temperature", "Write the model with one temperature.")
            current = found[int(number)] = _Table(place, option in ("1", "AELF"), [0.0] * 21)
        elif word == "TBDAT" and current is not None:
            try:
                at = int(words[0]) - 1 if words and words[0] else at
                given = [float(w or 0) for w in words[1:]]
            except ValueError:
                at, given = -1, []
            if not 0 <= at <= 21 or any(given[21 - at :]):
                raise input_error(place, "is no line of the 21 constants", "Check the table.")
            for value in given[: 21 - at]:
                current.values[at] = value
                at += 1
    return found


def is_elastic_table(words: list[str]) -> bool:
    """Whether the words after TB name a table of elastic constants that is read."""
    label, option = words[0].upper()[:4], (*words, *[""] * 5)[4].upper()
    return label == "ANEL" or (label == "ELAS" and option in ("AELS", "AELF"))


def _materials(path: Path, blocks: Blocks, units: Units, plausible: bool) -> dict[int, AnyMaterial]:
    tables, found = _tables(blocks), dict[int, AnyMaterial]()
    for number in sorted({*blocks.properties, *tables}):
        values, place = blocks.properties.get(number, {}), f"{path}: material {number}"
        if "DENS" not in values:
            continue
        density = units.density * values["DENS"]
        try:
            if number in tables:
                made: AnyMaterial | None = elastic_material(_of_table(tables[number], units), density)
            else:
                made = _of_constants(values, density, units)
        except InputError as error:
            raise error.inside(place) from None
        if made is None:
            continue
        if plausible:
            check_material(made.density, made.young_modulus, units, place)
        found[number] = made
    return found


def _of_table(table: _Table, units: Units) -> FloatArray:
    matrix = np.zeros((6, 6))
    for (i, j), value in zip(ENTRIES, table.values, strict=True):
        matrix[i, j] = matrix[j, i] = value
    refuse_unstable(table.place, matrix)
    return np.asarray(units.stress * (np.linalg.inv(matrix) if table.flexible else matrix))


def _of_constants(values: Mapping[str, float], density: float, units: Units) -> AnyMaterial | None:
    """Return a material of engineering constants; None if it lacks Young's modulus or Poisson's ratio."""
    poisson = values.get("NUXY", values.get("PRXY"))
    if poisson is None or "EX" not in values:
        return None
    modulus = values["EX"]
    shear = modulus / (2 * (1 + poisson))
    same = {"EY": modulus, "EZ": modulus} | dict.fromkeys(SHEARS, shear)
    same |= {kind + pair: poisson for kind in ("PR", "NU") for pair in RATIOS}
    if all(math.isclose(values.get(name, value), value, rel_tol=1e-6) for name, value in same.items()):
        return Material(young_modulus=units.stress * modulus, poisson_ratio=poisson, density=density)
    young = {"X": modulus, "Y": values.get("EY"), "Z": values.get("EZ")}
    missing = [f"E{axis}" for axis, value in young.items() if value is None]
    missing += [name for name in SHEARS if name not in values]
    ratios = []
    for pair in RATIOS:
        minor = values.get("NU" + pair) if young[pair[0]] == young[pair[1]] else None
        ratio = values.get("PR" + pair, minor)
        missing += [f"PR{pair}"] if ratio is None else []
        ratios.append(ratio or 0.0)
    if missing:
        raise input_error(
            "MPDATA",
            f"is orthotropic and lacks {', '.join(missing)}",
            "Give EX, EY, EZ, PRXY, PRYZ, PRXZ (major ratios) and GXY, GYZ, GXZ.",
        )
    matrix = orthotropic_stiffness([young[axis] or 0.0 for axis in "XYZ"], ratios, [values[name] for name in SHEARS])
    return elastic_material(units.stress * matrix, density)
