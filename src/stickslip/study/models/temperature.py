"""Temperatures of the nodes of a part from the tables [temperature] and [part.NAME.temperature]."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.cell_laws import Temperature
from stickslip.model.fe.factorisation import Say, silent
from stickslip.model.fe.material import ElasticMaterial, Materials
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.frd import read_frd
from stickslip.model.readers.node_table import csv_columns, csv_numbers
from stickslip.study.file.model.material import FileTemperature, TemperatureTable

STRESS_FREE_C = 20.0
BEYOND = 0.05  # of a table's range: by so much temperatures may leave it without a word, as 20 °C a table from 25 °C
MAX_STRAIN = 0.05  # thermal strain beyond that of metals: nickel at its melting point has 0.03
FAR = 10.0  # radii so many times those of the part are in another unit


def temperature_of(
    place: str,
    table: TemperatureTable | None,
    mesh: SolidMesh,
    material: Materials,
    axis: Axis,
    *,
    home: Path,
    of_deck: Temperature | None = None,
    say: Say = silent,
) -> Temperature | None:
    """Return the temperatures of the nodes of a part; None if no material depends on temperature, or none is given.

    Parameters
    ----------
    place
        Key of the part, for messages.
    table
        Its table, or the one of all parts; None: the deck's temperatures.
    mesh, material, axis
        Its mesh, materials and axis of rotation.
    home
        Folder to which file names are relative.
    of_deck
        Temperatures of the part's deck; None without any.
    say
        Called with a sentence about a file that has other nodes, too.

    Raises
    ------
    InputError
        If a material depends on temperature and none is given, or a file lacks nodes.
    """
    if not _depends(material):
        return None
    if table is None:
        own = material if isinstance(material, Sequence) else [material]
        if of_deck is None and any(isinstance(one, ElasticMaterial) and one.varies for one in dict.fromkeys(own)):
            raise input_error(
                f"{place}.temperature",
                "is missing, and its material depends on temperature",
                "Add the table [temperature], or one of the part.",
            )
        return of_deck
    start = np.full(len(mesh.points), STRESS_FREE_C)
    if table.stress_free_c is not None:
        start[:] = table.stress_free_c
    elif of_deck is not None:
        start = of_deck.start
    hot = _field(place, table, mesh, axis, home, of_deck, say)
    return Temperature(start + table.factor * (hot - start), start)


def _depends(material: Materials) -> bool:
    """Whether stiffness, density or size of a material depend on temperature."""
    own = material if isinstance(material, Sequence) else [material]
    kinds = (one for one in dict.fromkeys(own) if isinstance(one, ElasticMaterial))
    return any(one.varies or one.expansion is not None for one in kinds)


def doubts_of_temperature(
    place: str,
    table: TemperatureTable | None,
    mesh: SolidMesh,
    material: Materials,
    axis: Axis,
    found: Temperature | None,
) -> tuple[str, ...]:
    """Return warnings: temperatures that the materials do not depend on, radii far from the part, and temperatures beyond the materials' tables.

    Parameters
    ----------
    place, table, mesh, material, axis
        As in `temperature_of`.
    found
        The temperatures of the part, of the study or its deck.
    """
    if found is None or not _depends(material):
        if table is None and found is None:
            return ()
        whose = "the deck's temperatures have" if table is None else "its temperature has"
        why = "the material has neither constants over temperature nor thermal expansion"
        return (f"{place}: {whose} no effect: {why}. Give material.over_temperature or expansion_per_k.",)
    used = np.unique(mesh.cells[mesh.cells >= 0])
    said = []
    if table is not None and table.radius_m is not None:
        radius = np.linalg.norm(axis.arm(mesh.points[used]), axis=1)
        (low, high), (first, last) = (radius.min(), radius.max()), table.radius_m
        if FAR * high < first or low > FAR * last:
            said.append(
                f"{place}: it lies {low:.4g} to {high:.4g} m from the axis, far from the radii of its temperature, {first:g} to {last:g} m, "
                "and has one temperature. Give radius_m in m, and the axis of the part."
            )
    own = material if isinstance(material, Sequence) else [material]
    tables = [one.elastic.temperatures for one in dict.fromkeys(own) if isinstance(one, ElasticMaterial)]
    ends = [(rows[0], rows[-1]) for rows in tables if len(rows) > 1]
    if ends:
        low, high = max(a for a, _ in ends), min(b for _, b in ends)
        coldest, hottest = found.values[used].min(), found.values[used].max()
        margin = BEYOND * (high - low)
        if coldest < low - margin or hottest > high + margin:
            reached = hottest if hottest > high + margin else coldest
            said.append(
                f"{place}: its temperatures reach {reached:.4g} °C, and its constants are those from {low:g} to {high:g} °C; beyond, the "
                "last row holds. Give rows that reach further."
            )
    kinds = [one for one in dict.fromkeys(own) if isinstance(one, ElasticMaterial) and one.expansion is not None]
    strains = [one.expansion.strain(found.start[used], found.values[used]) for one in kinds if one.expansion]
    largest = max((float(np.abs(strain).max()) for strain in strains), default=0.0)
    if largest > MAX_STRAIN:
        said.append(
            f"{place}: its thermal strain reaches {100 * largest:.3g} %, beyond that of metals. Check temperatures in °C and the "
            "expansion in 1/K."
        )
    return tuple(said)


def _field(
    place: str,
    table: TemperatureTable,
    mesh: SolidMesh,
    axis: Axis,
    home: Path,
    of_deck: Temperature | None,
    say: Say,
) -> FloatArray:
    if table.uniform_c is not None:
        return np.full(len(mesh.points), table.uniform_c)
    if table.radius_m is not None and table.at_radius_c is not None:
        radius = np.linalg.norm(axis.arm(mesh.points), axis=1)
        return np.asarray(np.interp(radius, table.radius_m, table.at_radius_c))
    if isinstance(table, FileTemperature) and table.file is not None:
        return _by_node(place, home / table.file, mesh, say)
    if of_deck is None:
        raise input_error(
            f"{place}.temperature",
            "gives no temperature, and the part's file has none",
            "Give uniform_c, radius_m with at_radius_c, or file.",
        )
    return of_deck.values


def _by_node(place: str, path: Path, mesh: SolidMesh, say: Say) -> FloatArray:
    """Read temperatures of the nodes that belong to cells."""
    numbers: FloatArray
    values: FloatArray
    if ".frd" in "".join(path.suffixes[-2:]).lower():
        fields = [one for one in read_frd(path).fields if one.name == "NDTEMP" and one.frequency_hz is None]
        if not fields:
            raise input_error(
                str(path), "has no static field NDTEMP", "Write the temperatures of the static step (*NODE FILE, NT)."
            )
        numbers, values = fields[-1].nodes.astype(float), np.real(fields[-1].values[:, 0])
    else:
        columns = csv_columns(path, ("node", "temperature_c"))
        numbers, values = (csv_numbers(path, name, columns[name]) for name in ("node", "temperature_c"))
    order = np.argsort(numbers, kind="stable")
    twice = np.flatnonzero(np.diff(numbers[order]) == 0)
    if twice.size:
        raise input_error(
            str(path),
            f"has two temperatures of node {numbers[order[twice[0]]]:.0f}",
            "Give one of each node.",
        )
    at = np.minimum(np.searchsorted(numbers, mesh.numbers, sorter=order), len(numbers) - 1)
    found = np.where(numbers[order[at]] == mesh.numbers, values[order[at]], np.nan)
    used = np.isin(np.arange(len(mesh.points)), mesh.cells)
    missing = np.flatnonzero(np.isnan(found) & used)
    if missing.size:
        raise input_error(
            str(path),
            f"lacks the temperature of {missing.size} nodes, e.g. {mesh.numbers[missing[0]]}",
            "Give every node of the part.",
        )
    other = numbers[~np.isin(numbers, mesh.numbers)]
    if other.size:
        say(
            f"{place}: {path.name} has temperatures of {other.size} nodes that the part has not, e.g. {other[0]:.0f}, without effect. "
            "Check that its numbers are those of this mesh."
        )
    return np.asarray(found)
