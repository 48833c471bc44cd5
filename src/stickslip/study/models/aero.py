"""The table [aero] and its coefficient file as part of a model."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.assembly.fluid.aerodynamics import Aerodynamics
from stickslip.errors import InputError, did_you_mean, input_error, missing_file, no_wheel
from stickslip.model.readers.measured_columns import MeasuredColumns, read_columns
from stickslip.reduction.aerodynamics import InfluenceCoefficients, from_phase_angles, one_twice
from stickslip.study.file.model.aero import AeroTable
from stickslip.study.file.tables import Tables
from stickslip.study.file.toml import read_toml
from stickslip.units import DEG, HZ, RPM

WHO = ("neighbour", "recorded_on", "wave_number", "phase_angle_deg")
UNIT_MASS, SCALED, POINTS = "per_s2", "j", "n_per_m"  # units of the coefficients
BETWEEN = {False: ("force_mode", "motion_mode"), True: ("force_point", "motion_point")}
WORDS = ("note", "comment")
WHOLE = 1e-9  # largest deviation from a whole number


def aero_refusals(tables: Tables, home: Path, sectors: int | None) -> Iterator[InputError]:
    """Yield errors in [aero] that can be found before meshing."""
    table = tables.aero
    if table is None:
        if getattr(tables, "flutter", None) is not None:
            yield input_error("flutter", "needs aerodynamic coefficients", "Add the table [aero] with their file.")
        return
    if sectors == 1:
        yield no_wheel("aero")
    if not (home / table.file).is_file():
        yield missing_file("aero.file", home / table.file)


def knows_speeds(table: AeroTable | None, home: Path) -> bool:
    """Whether the coefficients are tabulated over speed; True for an unreadable file."""
    if table is None:
        return False
    try:
        return "speed_rpm" in _columns(home / table.file).names
    except InputError:  # reported by another check
        return True


def aerodynamics_of(
    table: AeroTable, home: Path, sectors: int, points: Mapping[str, str], clamped: str
) -> Aerodynamics:
    """Return the aerodynamic part of a model, read from [aero].

    Parameters
    ----------
    table
        The table.
    home
        Folder to which file names are relative.
    sectors
        Number of sectors of the wheel.
    points
        Name of a point -> its location, as in the part's file.
    clamped
        Name of a point -> location at which the blade is clamped.

    Raises
    ------
    InputError
        If the file cannot be used; the message names file, line, column and value.
    """
    path = home / table.file
    columns = _columns(path)
    _check_names(columns, table)
    names, pairs = _between(columns, table)
    values = _values(columns, table)
    influence = _influence(columns, values, pairs, len(names), sectors)
    of_points = bool(table.points)
    return Aerodynamics(
        influence=InfluenceCoefficients(
            influence.distances, influence.values, influence.frequencies, influence.speeds, table.beyond
        ),
        reference=HZ * table.reference_hz,
        modes=(1,) if of_points else tuple(int(name) for name in names),
        shapes=table.shapes,
        nodal_diameter=table.nodal_diameter or 0,
        clamped=clamped,
        largest_displacement=table.largest_displacement_m,
        over=table.over or "",
        contacts=table.contacts,
        points={name: (points[name], _direction(table, name)) for name in names} if of_points else {},
    )


def _direction(table: AeroTable, name: str) -> tuple[float, float, float] | None:
    given = table.points[name].direction
    return None if given is None else (given[0], given[1], given[2])


def _columns(path: Path) -> MeasuredColumns:
    return _from_toml(path) if path.suffix.lower() == ".toml" else read_columns(path)


def _from_toml(path: Path) -> MeasuredColumns:
    """Return the columns of a TOML file: keys with lists of equal length."""
    _, raw = read_toml(path)
    sizes = {key: len(value) if isinstance(value, list) else -1 for key, value in raw.items()}
    for key, size in sizes.items():
        if size < 1:
            raise input_error(f"{path}: {key}", "is no list", "Give a list of values for each key.")
        first = next(iter(sizes))
        if size != sizes[first]:
            raise input_error(f"{path}: {key}", f"has {size} entries, {first} {sizes[first]}", "Give as many.")
    if not raw:
        raise input_error(str(path), "holds no numbers", "Give keys with lists of values.")
    rows = tuple(tuple(str(v) for v in row) for row in zip(*raw.values(), strict=True))
    names = tuple(key.lower() for key in raw)
    return MeasuredColumns(path, names, tuple(range(1, len(rows) + 1)), rows, "entry")


def _unit(table: AeroTable) -> str:
    if table.points:
        return POINTS
    return UNIT_MASS if table.largest_displacement_m is None else SCALED


def _check_names(columns: MeasuredColumns, table: AeroTable) -> None:
    place, unit = f"{columns.path}: {columns.word} 1", _unit(table)
    if columns.word == "entry":
        place = str(columns.path)
    numbers = [f"real_{unit}", f"imag_{unit}", f"amplitude_{unit}", "phase_deg"]
    pair = BETWEEN[bool(table.points)]
    known = [*WHO, "frequency_hz", "speed_rpm", *pair, *numbers, *WORDS]
    for name in columns.names:
        if name in known:
            continue
        stem = name.partition("_")[0]
        if stem in ("real", "imag", "amplitude"):
            why = {
                POINTS: "coefficients of points are in N/m",
                UNIT_MASS: "coefficients of modes of unit mass are in 1/s²; scaled ones in J need largest_displacement_m in [aero]",
                SCALED: "coefficients of modes scaled to a largest displacement are in J",
            }[unit]
            raise input_error(place, f"has a column {name!r}, and {why}", f"Write {stem}_{unit}, in that unit.")
        between = f"{' and '.join(pair)}; frequency_hz, speed_rpm"
        values = f"{' and '.join(numbers[:2])}, or {' and '.join(numbers[2:])}"
        raise columns.unknown(name, known, f"one of {', '.join(WHO)}; {values}; {between}")
    who = [name for name in WHO if name in columns.names]
    if len(who) != 1:
        found = f"has {' and '.join(who)}" if who else "does not say whose motion it is"
        raise input_error(place, found, f"Give one of the columns {', '.join(WHO)}.")
    given = [name for name in numbers if name in columns.names]
    if given not in (numbers[:2], numbers[2:]):
        raise input_error(
            place,
            f"has {' and '.join(given) or 'no column'} of the values",
            f"Give {numbers[0]} and {numbers[1]}, or {numbers[2]} and {numbers[3]}.",
        )
    if sum(name in columns.names for name in pair) == 1:
        raise input_error(place, f"has one of {' and '.join(pair)}", "Give both, or none.")


def _between(columns: MeasuredColumns, table: AeroTable) -> tuple[list[Any], list[tuple[int, int]]]:
    """Return the modes or points, and for each row the one that moves and the one on which the force acts."""
    ends = BETWEEN[bool(table.points)]
    if ends[0] not in columns.names:
        if len(table.points) > 1:
            raise input_error(
                f"{columns.path}: {columns.word} 1",
                f"has no columns {' and '.join(ends)}",
                f"There are {len(table.points)} points in [aero]: say which.",
            )
        return list(table.points) or [table.mode], [(0, 0)] * len(columns.rows)
    if table.points:
        known: list[Any] = list(table.points)
        cells = [[row[columns.names.index(end)] for end in ends] for row in columns.rows]
        for i, row in enumerate(cells):
            for end, name in zip(ends, row, strict=True):
                if name not in known:
                    raise columns.wrong(i, end, "is no point of [aero]", did_you_mean(name, known))
        return known, [(known.index(a), known.index(b)) for a, b in cells]
    numbers = [_whole(columns, end, least=1) for end in ends]
    known = sorted({int(v) for column in numbers for v in column})
    return known, [(known.index(a), known.index(b)) for a, b in zip(*numbers, strict=True)]


def _values(columns: MeasuredColumns, table: AeroTable) -> ComplexArray:
    unit = _unit(table)
    if f"real_{unit}" in columns.names:
        real, imag = (columns.numbers(f"{part}_{unit}") for part in ("real", "imag"))
        return np.asarray(real + 1j * imag)
    phase = columns.numbers("phase_deg") * DEG
    return np.asarray(columns.numbers(f"amplitude_{unit}") * np.exp(1j * phase))


def _influence(
    columns: MeasuredColumns, values: ComplexArray, pairs: Sequence[tuple[int, int]], size: int, sectors: int
) -> InfluenceCoefficients:
    who = next(name for name in WHO if name in columns.names)
    given = columns.numbers(who) if who == "phase_angle_deg" else _whole(columns, who)
    if who == "recorded_on":
        given = -given
    axes = {"speed": _axis(columns, "speed_rpm", RPM), "frequency": _axis(columns, "frequency_hz", HZ)}
    once, place = np.unique(given, return_inverse=True)
    (speeds, at_speed), (frequencies, at_frequency) = axes["speed"], axes["frequency"]
    table = np.zeros((max(speeds.size, 1), max(frequencies.size, 1), once.size, size, size), dtype=complex)
    line = np.full(table.shape, -1)
    for i, (a, b) in enumerate(pairs):
        cell = (at_speed[i], at_frequency[i], place[i], a, b)
        if line[cell] >= 0:
            first = columns.lines[line[cell]]
            raise input_error(
                columns.place(i), f"says the same coefficient as {columns.word} {first}", "Leave one of them out."
            )
        line[cell] = i
        table[cell] = values[i]
    _refuse_gaps(columns, line, who, once, speeds, frequencies)
    _refuse_numbers(columns, who, once, sectors)
    if who in ("neighbour", "recorded_on"):
        return InfluenceCoefficients(once.astype(np.int64), table, frequencies, speeds)
    angles = once * DEG if who == "phase_angle_deg" else 2 * np.pi * once / sectors
    try:
        distances, spread = from_phase_angles(angles, np.moveaxis(table, 2, 0), sectors=sectors)
    except InputError as error:
        raise input_error(f"{columns.path}: {who}", error.problem, error.remedy) from None
    return InfluenceCoefficients(distances, np.moveaxis(spread, 0, 2), frequencies, speeds)


def _axis(columns: MeasuredColumns, name: str, unit: float) -> tuple[FloatArray, IntArray]:
    """Return the different values of a column in SI, and their index for each row."""
    if name not in columns.names:
        return np.zeros(0), np.zeros(len(columns.rows), dtype=np.int64)
    numbers = columns.numbers(name)
    below = np.flatnonzero(numbers < 0)
    if below.size:
        raise columns.wrong(int(below[0]), name, "must not be negative", "Mend the line.")
    once, place = np.unique(numbers, return_inverse=True)
    return unit * once, np.asarray(place, dtype=np.int64)


def _whole(columns: MeasuredColumns, name: str, least: int | None = None) -> FloatArray:
    numbers = columns.numbers(name)
    wrong = np.abs(numbers - np.round(numbers)) > WHOLE
    if least is not None:
        wrong |= numbers < least
    if wrong.any():
        words = "is no whole number" + ("" if least is None else f" from {least} on")
        raise columns.wrong(int(np.flatnonzero(wrong)[0]), name, words, "Mend the line.")
    return np.asarray(np.round(numbers))


def _refuse_gaps(
    columns: MeasuredColumns, line: IntArray, who: str, once: FloatArray, speeds: FloatArray, frequencies: FloatArray
) -> None:
    """Refuse a table in which a coefficient is missing at a speed, frequency or neighbour that other coefficients have."""
    there = (line >= 0).any(axis=(0, 1, 2))  # pairs that never occur are zero
    gaps = np.argwhere((line < 0) & there)
    if not gaps.size:
        return
    s, f, d, a, b = (int(i) for i in gaps[0])
    words = [f"{who} {once[d]:g}"]
    words += [f"{speeds[s] / RPM:g} rpm"] if speeds.size else []
    words += [f"{frequencies[f] / HZ:g} Hz"] if frequencies.size else []
    pair = f", of the {a + 1}. on the {b + 1}." if line.shape[-1] > 1 else ""
    raise input_error(
        str(columns.path),
        f"lacks the coefficient of {', '.join(words)}{pair}, {len(gaps)} such in all",
        "Give every one at each speed and frequency; zero is a value.",
    )


def _refuse_numbers(columns: MeasuredColumns, who: str, once: FloatArray, sectors: int) -> None:
    """Refuse neighbours that the wheel lacks or has twice, and an incomplete set of waves."""
    place = f"{columns.path}: {who}"
    if who == "phase_angle_deg":
        if once.size == 1:
            raise input_error(
                place,
                f"holds {once[0]:g} alone, and says nothing of the waves of other angles",
                "Give all of them; a force by the blade's own motion alone is neighbour 0.",
            )
        return
    given = np.sort(-once if who == "recorded_on" else once).astype(np.int64)
    waves = who == "wave_number"
    if not waves and np.abs(given).max() >= sectors:
        raise input_error(
            place,
            f"goes to {np.abs(given).max()}, and the wheel has {sectors} sectors",
            "A blade's farthest neighbour is half the wheel away.",
        )
    twice = one_twice(given, sectors)
    if twice:
        raise input_error(
            place,
            f"has {twice[0]} and {twice[1]}, which are one {'wave' if waves else 'blade'} of {sectors}",
            "Leave one of them out.",
        )
    missing = sorted(set(range(sectors)) - {int(k) % sectors for k in given}) if waves else []
    if missing:
        raise input_error(
            place,
            f"lacks {', '.join(map(str, missing))} of the waves 0 to {sectors - 1}",
            "Give them all, or coefficients by neighbour; the ones left out are zero.",
        )
