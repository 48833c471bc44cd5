"""Measured peaks of a study, read and checked before any computation."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from pydantic import ValidationError

from stickslip.arrays import FloatArray
from stickslip.errors import did_you_mean, input_error, missing_file
from stickslip.model.readers.measured_columns import LENGTHS, MeasuredColumns, read_columns
from stickslip.study.file.case_names import assignments, is_number, written
from stickslip.study.file.study import StudyFile, TablesOfCase
from stickslip.study.file.tables import study_tables
from stickslip.study.file.vary import with_values
from stickslip.study.models.model import newton

PLACE = "measured.file"
AMPLITUDE, FREQUENCY, EXCITATION = "peak_amplitude", "peak_frequency", "excitation_n"
LIKE = "note", "comment"  # columns of text
PER_FORCE = {f"{unit}_per_n": factor for unit, factor in LENGTHS.items()}
HZ = {"hz": 1.0}
ERRORS = {"std": "standard deviation", "half_width": "half-width"}  # kinds of error bars
TURNS = (".rx", ".ry", ".rz")


@dataclass(frozen=True, eq=False)
class Quantity:
    """A measured quantity.

    Parameters
    ----------
    values, errors
        (n,) values and error bars in `unit`; NaN if not measured or without an error bar.
    unit
        SI unit, or Hz.
    bar
        Meaning of the error bars: ``standard deviation``, ``half-width``; empty for none.
    """

    values: FloatArray
    errors: FloatArray
    unit: str
    bar: str


@dataclass(frozen=True, eq=False)
class MeasuredPeaks:
    """Peaks from a test.

    Parameters
    ----------
    file
        Name of the file.
    source
        Origin of the data.
    key
        Varied key on the abscissa.
    values
        (n,) values of this key.
    others
        (n,) other varied keys with their values as text, as in labels of cases; empty if the file lacks them.
    amplitude
        Amplitude of the output whose peak is reported, m or m/N.
    frequency
        Frequency of the peak, Hz.
    excitation
        (n,) amplitude of the force, N, from the file or else from the study; NaN if not needed.
    """

    file: str
    source: str
    key: str
    values: FloatArray
    others: tuple[str, ...]
    amplitude: Quantity
    frequency: Quantity
    excitation: FloatArray = field(repr=False)

    @property
    def sentence(self) -> str:
        """Line about the peaks in ``stickslip check``."""
        n = self.values.size
        of = f", {self.source}" if self.source else ""
        return f"measured: {n} point{'s' * (n != 1)} of {self.file} over {self.key}{of}"


def measured_peaks(file: StudyFile) -> MeasuredPeaks | None:
    """Return the measured peaks named by a study; None if it names none.

    Raises
    ------
    InputError
        If the study varies no number, or the file cannot be read; the message names line, column and value.
    """
    table = file.tables.measured
    if table is None:
        return None
    key = _varied_number(file)
    path = file.home / table.file
    if not path.is_file():
        raise missing_file(f"{file.path}: {PLACE}", path)
    columns = read_columns(path)
    others = [k for k in file.cases[0].values if k != key]
    _check_names(columns, key, others)
    n = len(columns.rows)
    has_force = EXCITATION in columns.names
    found = MeasuredPeaks(
        file=table.file,
        source=table.source,
        key=key,
        values=columns.numbers(key.lower()),
        others=_others(columns, others, file.cases),
        amplitude=_quantity(columns, AMPLITUDE, {"m": LENGTHS, "m/N": PER_FORCE}),
        frequency=_quantity(columns, FREQUENCY, {"Hz": HZ}),
        excitation=columns.numbers(EXCITATION, gaps=True) if has_force else np.full(n, np.nan),
    )
    _refuse(columns, found)
    per_metre = found.amplitude.unit == "m"
    return _with_forces(columns, found, file, others) if per_metre else found


def _varied_number(file: StudyFile) -> str:
    """Return the varied key of the optimisation curves: the first key whose values are different numbers."""
    place, tables = f"{file.path}: measured", file.tables
    if any(key.startswith("measured.") for key in file.cases[0].values):
        raise input_error(place, "is varied", "Leave it out of [vary]: it is of all cases.")
    if getattr(tables, "forced_response", None) is None:
        raise input_error(
            place, "has peaks, and the study computes none", "Add the table [forced_response], or leave [measured] out."
        )
    if tables.output.peak.endswith(TURNS):
        raise input_error(
            place,
            f"has amplitudes in metres, and the peak is that of {tables.output.peak}, an angle",
            "Name a displacement in output.peak.",
        )
    for key in file.cases[0].values:
        given = [case.values[key] for case in file.cases]
        if all(is_number(v) for v in given) and len(set(given)) > 1:
            return key
    raise input_error(
        place,
        "has nothing to be drawn over: [vary] varies no number",
        "Vary what was varied in the test, for example load.shaker.ratio = [100, 20].",
    )


def _check_names(columns: MeasuredColumns, key: str, others: Sequence[str]) -> None:
    """Refuse a file without the varied key, or with unused columns."""
    place = f"{columns.path}: line 1"
    if key.lower() not in columns.names:
        near = did_you_mean(key, [*columns.names])
        remedy = near if near.startswith("Did") else "Name a column like the varied key."
        raise input_error(place, f"has no column {key}", remedy)
    units = {AMPLITUDE: [*LENGTHS, *PER_FORCE], FREQUENCY: [*HZ]}
    known = [key, *others, EXCITATION, *LIKE]
    for name, of in units.items():
        known += [f"{name}_{unit}" for unit in of]
        known += [f"{name}_{bar}_{unit}" for bar in ERRORS for unit in of]
    for name in columns.names:
        if name not in {k.lower() for k in known}:
            told = [
                key,
                *others,
                f"{AMPLITUDE}_um",
                f"{FREQUENCY}_hz",
                f"{AMPLITUDE}_std_um",
                f"{FREQUENCY}_std_hz",
                EXCITATION,
            ]
            raise columns.unknown(name, known, ", ".join(told))


def _quantity(columns: MeasuredColumns, name: str, units: Mapping[str, Mapping[str, float]]) -> Quantity:
    """Return a measured quantity with its error bars; NaN if the file lacks it."""
    unit, values = _column(columns, name, units)
    bars = {bar: _column(columns, f"{name}_{bar}", units) for bar in ERRORS}
    given = {bar: own for bar, own in bars.items() if own[0]}
    if len(given) > 1:
        raise input_error(
            f"{columns.path}: line 1",
            f"has both {name}_std and {name}_half_width",
            "Give one of them; a half-width belongs to an interval of your own.",
        )
    for bar, (other, errors) in given.items():
        if other != unit:
            raise input_error(
                f"{columns.path}: line 1",
                f"{name}_{bar} is in {other}, {name} in {unit or 'nothing: there is none'}",
                "Give both in metres, or both per newton.",
            )
        return Quantity(values, errors, unit, ERRORS[bar])
    return Quantity(values, np.full(values.size, np.nan), unit, "")


def _column(columns: MeasuredColumns, stem: str, units: Mapping[str, Mapping[str, float]]) -> tuple[str, FloatArray]:
    """Return unit and numbers of a column; an empty unit if the column is missing."""
    found = [(unit, *columns.named(stem, names)) for unit, names in units.items()]
    there = [(unit, name, factor) for unit, name, factor in found if name]
    if len(there) > 1:
        problem = f"has both {there[0][1]} and {there[1][1]}"
        raise input_error(f"{columns.path}: line 1", problem, "Leave one of them out.")
    if not there:
        return "", np.full(len(columns.rows), np.nan)
    unit, name, factor = there[0]
    values = columns.numbers(name, gaps=True)
    bar = any(name.startswith(f"{which}_{kind}") for which in (AMPLITUDE, FREQUENCY) for kind in ERRORS)
    wrong = np.flatnonzero(values < 0 if bar else values <= 0)
    if wrong.size:
        problem = f"must {'not be negative' if bar else 'be above zero'}"
        remedy = "Leave the cell empty where nothing was measured."
        raise columns.wrong(int(wrong[0]), name, problem, remedy)
    return unit, factor * values


def _others(columns: MeasuredColumns, keys: Sequence[str], cases: Sequence[TablesOfCase]) -> tuple[str, ...]:
    """Return the other varied keys in the file with their values."""
    told: list[list[str]] = [[] for _ in columns.rows]
    for key in (k for k in keys if k.lower() in columns.names):
        known = {written(case.values[key]): assignments({key: case.values[key]})[0] for case in cases}
        at = columns.names.index(key.lower())
        for i, row in enumerate(columns.rows):
            label = known.get(_plain(row[at]))
            if label is None:
                raise columns.wrong(i, key.lower(), "is none of the values of [vary]", f"Known: {', '.join(known)}.")
            told[i].append(label)
    return tuple(", ".join(labels) for labels in told)


def _plain(text: str) -> str:
    try:
        return f"{float(text):g}"
    except ValueError:
        return text


def _refuse(columns: MeasuredColumns, found: MeasuredPeaks) -> None:
    if not (found.amplitude.unit or found.frequency.unit):
        raise input_error(
            f"{columns.path}: line 1",
            "has neither peak amplitudes nor frequencies",
            "Add a column such as peak_amplitude_um, peak_amplitude_um_per_n or peak_frequency_hz.",
        )
    for i in np.flatnonzero(np.isnan(found.amplitude.values) & np.isnan(found.frequency.values)):
        raise input_error(
            f"{columns.path}: line {columns.lines[i]}", "has neither amplitude nor frequency", "Leave the line out."
        )
    for i in np.flatnonzero(found.excitation <= 0):
        raise columns.wrong(int(i), EXCITATION, "must be above zero", "Give the amplitude of the force in N.")


def _with_forces(
    columns: MeasuredColumns, found: MeasuredPeaks, file: StudyFile, others: Sequence[str]
) -> MeasuredPeaks:
    """Return the peaks, with forces from the study if the file has none.

    Raises
    ------
    InputError
        If the force depends on keys missing in the file, or the study refuses a value.
    """
    force = found.excitation.copy()
    untold = [k for k in others if k.lower() not in columns.names]
    for i in map(int, np.flatnonzero(np.isnan(force))):
        of_case = [
            c for c in file.cases if set(filter(None, found.others[i].split(", "))) <= set(assignments(c.values))
        ]
        try:
            forces = {_force(file, {**c.values, found.key: float(found.values[i])}) for c in of_case}
        except ValidationError:
            raise columns.wrong(
                i,
                found.key.lower(),
                "is no value that the study could have",
                f"Correct it, or add a column {EXCITATION}.",
            ) from None
        if len(forces) > 1:
            raise input_error(
                f"{columns.path}: line {columns.lines[i]}",
                f"the force depends on {' and '.join(untold)}, which the file does not tell",
                f"Add {'a column' if len(untold) == 1 else 'columns'} of that name, or {EXCITATION}.",
            )
        force[i] = forces.pop() if forces else np.nan
    return replace(found, excitation=force)


def _force(file: StudyFile, values: Mapping[str, Any]) -> float:
    """Return the largest harmonic force of the study with these values of the varied keys, N."""
    raw = with_values(file.raw, values)
    tables = study_tables().model_validate(raw, context={"study": file.path})
    forces = [abs(newton(tables, load)) for load in tables.load.values() if load.harmonic and load.pressure is None]
    return max(forces, default=math.nan)
