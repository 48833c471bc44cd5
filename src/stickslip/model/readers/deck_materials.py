"""Materials of a CalculiX or Abaqus deck: elasticity of any symmetry, density, and orientations."""

import math
from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.errors import InputError, input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.cell_laws import Temperature
from stickslip.model.fe.material import (
    AnyMaterial,
    ByTemperature,
    ElasticMaterial,
    Expansion,
    Material,
    Orientation,
    orthotropic_stiffness,
    refuse_unstable,
    row_of,
)
from stickslip.model.readers.keywords import Block, real_number, whole_number
from stickslip.model.readers.units import Units

A_LINE = 8  # constants on a line
# places of the constants in the matrix, order 11, 22, 33, 12, 13, 23: down the columns of the upper triangle
PLACES = {
    "ORTHO": [*((i, j) for j in range(3) for i in range(j + 1)), (3, 3), (4, 4), (5, 5)],
    "ANISO": [(i, j) for j in range(6) for i in range(j + 1)],
}
CONSTANTS = {"ISO": 2, "ENGINEERING": 9, "ORTHO": 9, "ANISO": 21}


@dataclass(frozen=True)
class Constants:
    """Constants of a material over temperature, as in the deck.

    Parameters
    ----------
    kind
        ``ISO``, ``ENGINEERING``, ``ORTHO``, ``ANISO``, or ``DENSITY``.
    rows
        Constants of each temperature.
    temperatures
        Temperatures of the rows; empty if one row has none.
    place
        File and line.
    """

    kind: str
    rows: tuple[tuple[float, ...], ...]
    temperatures: tuple[float, ...]
    place: str

    @property
    def over_temperature(self) -> ByTemperature:
        """The constants as a table."""
        return ByTemperature(self.rows, self.temperatures if len(self.rows) > 1 else ())


def read_constants(block: Block) -> Constants:
    """Read the data of ``*ELASTIC`` or ``*DENSITY``.

    Raises
    ------
    InputError
        If the type is unknown, or constants or temperatures are missing.
    """
    kind, count = "DENSITY", 1
    if block.keyword == "ELASTIC":
        given = "".join(block.parameters.get("TYPE", "ISO").upper().split())
        found = [word for word in CONSTANTS if given.startswith(word)]
        if not found:
            raise input_error(
                block.place, f"TYPE={given} is not read", "Use ISO, ENGINEERING CONSTANTS, ORTHO or ANISO."
            )
        kind, count = found[0], CONSTANTS[found[0]]
    return _rows(block, kind, count)


def _rows(block: Block, kind: str, count: int) -> Constants:
    """Read rows of `count` constants with their temperatures, eight numbers a line."""
    lines = list(block.rows())
    each = math.ceil(count / A_LINE)
    rows, temperatures, place = [], [], block.place
    for first in range(0, max(len(lines), 1), each):
        fields: list[str] = []
        for where, own in lines[first : first + each]:
            place = where
            fields += own
            if len(fields) < count:
                fields += [""] * (-len(fields) % A_LINE)
        if len([text for text in fields[:count] if text]) < count:
            raise input_error(place, f"needs {count} numbers, got {len([f for f in fields if f])}", "Check the line.")
        numbers = [real_number(text, place, "value") for text in fields[:count]]
        rows.append(tuple(numbers))
        temperatures += [real_number(text, place, "temperature") for text in fields[count : count + 1] if text]
    if len(rows) > 1 and len(temperatures) < len(rows):
        raise input_error(place, "has several rows without temperatures", "Give each row its temperature.")
    if not np.all(np.diff(temperatures) > 0):
        raise input_error(place, f"has the temperatures {temperatures}, which do not rise", "Give the lowest first.")
    return Constants(kind, tuple(rows), tuple(temperatures), block.place)


@dataclass
class DeckHeat:
    """Temperatures of nodes: initial ones, and those of steps, each as nodes and a value, in the order of the deck."""

    initial: list[tuple[IntArray, float]] = field(default_factory=list)
    later: list[tuple[IntArray, float]] = field(default_factory=list)
    places: list[str] = field(default_factory=list)

    def of_nodes(self, numbers: IntArray, used: BoolArray) -> Temperature | None:
        """Return the temperatures of the nodes with these numbers; None if the deck has none.

        Raises
        ------
        InputError
            If nodes that are `used` by cells have no initial temperature.
        """
        if not self.places:
            return None
        start = _over(np.full(len(numbers), np.nan), numbers, self.initial)
        missing = np.flatnonzero(np.isnan(start) & used)
        if missing.size:
            raise input_error(
                self.places[0],
                f"{missing.size} nodes have no initial temperature, e.g. {numbers[missing[0]]}",
                "Name them in *INITIAL CONDITIONS, TYPE=TEMPERATURE: thermal strain counts from there.",
            )
        return Temperature(_over(start, numbers, self.later), start)


def _over(field: FloatArray, numbers: IntArray, given: list[tuple[IntArray, float]]) -> FloatArray:
    """Return a field over nodes in which later values replace earlier ones."""
    found = field.copy()
    if given:
        nodes = np.concatenate([own for own, _ in given])
        values = np.repeat([value for _, value in given], [len(own) for own, _ in given])
        last = len(nodes) - 1 - np.unique(nodes[::-1], return_index=True)[1]
        order = np.argsort(numbers, kind="stable")
        place = np.minimum(np.searchsorted(numbers, nodes[last], sorter=order), len(numbers) - 1)
        here = numbers[order[place]] == nodes[last]
        found[order[place[here]]] = values[last[here]]
    return found


def read_expansion(block: Block) -> Expansion:
    """Read ``*EXPANSION``: secant coefficients, which count from ``ZERO`` (0 if left out, as the manuals say).

    Raises
    ------
    InputError
        If the type is not read, or coefficients or temperatures are missing.
    """
    kind = "".join(block.parameters.get("TYPE", "ISO").upper().split())
    counts = {"ISO": 1, "ORTHO": 3}
    found = [word for word in counts if kind.startswith(word)]
    if not found:
        raise input_error(block.place, f"TYPE={kind} is not read", "Use ISO or ORTHO.")
    zero = block.parameters.get("ZERO")
    given = _rows(block, "EXPANSION", counts[found[0]])
    return Expansion(
        coefficients=given.over_temperature,
        zero=0.0 if not zero else real_number(zero, block.place, "temperature ZERO"),
    )


def read_orientation(block: Block, units: Units) -> Orientation:
    """Read ``*ORIENTATION``: two points, and a further turn about one of the axes.

    Raises
    ------
    InputError
        If the kind of axes is not read, or the points span none.
    """
    system = " ".join(block.parameters.get("SYSTEM", "RECTANGULAR").upper().split())
    cylinder = system.startswith("C")
    if not (cylinder or system in ("R", "RECTANGULAR")):
        raise input_error(block.place, f"SYSTEM={system} is not read", "Use RECTANGULAR or CYLINDRICAL.")
    definition = block.parameters.get("DEFINITION", "COORDINATES").upper()
    if definition != "COORDINATES":
        raise input_error(block.place, f"DEFINITION={definition} is not read", "Give coordinates of two points.")
    lines = list(block.rows())
    if not lines or len(lines[0][1]) < 6:
        raise input_error(block.place, "needs a line with two points", "Give six coordinates.")
    place, fields = lines[0]
    numbers = np.array([real_number(text or "0", place, "coordinate") for text in fields])
    if np.any(numbers[6:] != 0):
        raise input_error(
            place, "has a third point as origin, which CalculiX does not read", "Give points relative to it."
        )
    extra: FloatArray = np.eye(3)
    if len(lines) > 1 and len(lines[1][1]) > 1:
        where, (axis, angle, *_) = lines[1]
        number = whole_number(axis or "1", where, "axis")
        if number not in (1, 2, 3):
            raise input_error(where, f"turns about the axis {number}", "Axes are 1, 2 and 3.")
        turn = math.radians(real_number(angle or "0", where, "angle"))
        x, y, z = np.eye(3)[number - 1].tolist()
        extra = Axis((x, y, z)).rotation(turn)
    try:
        if cylinder:
            (x, y, z), (a, b, c) = (units.length * numbers[:3]).tolist(), (numbers[3:6] - numbers[:3]).tolist()
            return Orientation(_nested(extra), Axis((a, b, c), (x, y, z)))
        own = np.asarray(Orientation.of_axes(numbers[:3].tolist(), numbers[3:6].tolist()).axes)
        return Orientation(_nested(own @ extra))
    except InputError as error:
        raise error.inside(place) from None


def _nested(matrix: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in matrix.tolist())


def material_of(
    elastic: Constants,
    density: Constants,
    expansion: Expansion | None,
    orientation: Orientation | None,
    units: Units,
) -> AnyMaterial:
    """Return the material of a section in SI.

    Raises
    ------
    InputError
        If the constants belong to no stable material.
    """
    mass = ByTemperature(
        tuple((units.density * row[0],) for row in density.rows), density.over_temperature.temperatures
    )
    own: tuple[tuple[float, ...], ...]
    if elastic.kind == "ISO":
        own = tuple((units.stress * modulus, ratio) for modulus, ratio in elastic.rows)
        if len(own) == 1 and not mass.varies and expansion is None:
            return Material(young_modulus=own[0][0], poisson_ratio=own[0][1], density=mass.values[0][0])
    else:
        own = tuple(_row(elastic, row, units) for row in elastic.rows)
    return ElasticMaterial(
        elastic=ByTemperature(own, elastic.over_temperature.temperatures),
        density_table=mass,
        orientation=orientation or Orientation(),
        expansion=expansion,
    )


def _row(elastic: Constants, row: tuple[float, ...], units: Units) -> tuple[float, ...]:
    """Return the 36 numbers of a matrix in Pa from the constants of the deck, whose shears are in the order 12, 13, 23."""
    if elastic.kind == "ENGINEERING":
        young, poisson, shear = row[:3], row[3:6], row[6:]
        try:
            matrix = orthotropic_stiffness(young, poisson, shear)
        except InputError as error:
            raise error.inside(elastic.place) from None
        return row_of(units.stress * matrix)
    matrix = np.zeros((6, 6))
    for (i, j), value in zip(PLACES[elastic.kind], row, strict=True):
        matrix[i, j] = matrix[j, i] = value
    refuse_unstable(elastic.place, matrix)
    return row_of(units.stress * matrix, "12-13-23")
