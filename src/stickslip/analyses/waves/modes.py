"""Natural frequencies and mode shapes beside reference frequencies: of each nodal diameter, of a whole structure, or of coupled wheels.

Wheels with different numbers of sectors have one record for each nodal diameter of the assembly.
"""

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any, TextIO

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from stickslip.analyses.facts import NOTE, facts_of
from stickslip.analyses.forced_response.records.blades import localisation
from stickslip.analyses.waves.analysis import counted, wave_analysis
from stickslip.analyses.waves.records import Modes, WaveModes, Wheel, WheelMode
from stickslip.analyses.waves.solve import STATIC, Question, each_wave, solve_wave
from stickslip.analyses.waves.tables import ModesTable
from stickslip.analyses.waves.verdicts import modes_tables
from stickslip.arrays import FloatArray
from stickslip.assembly.model import Model
from stickslip.assembly.sides.mistuned import wheel_modes
from stickslip.errors import input_error, missing_file
from stickslip.model.facts import facts_of_part
from stickslip.reduction.coupled_stages import Multistage, Wave, multistage_modes
from stickslip.reduction.waves import wave
from stickslip.study.analysis import Case, Notes, Solved
from stickslip.study.store.progress import advance
from stickslip.study.verdict import Verdict, doubt, to_json
from stickslip.units import RPM

LEFT_OUT = 0.01  # relative change of a frequency by harmonics that are not coupled, above which there is a doubt


@dataclass(frozen=True, eq=False)
class StagesQuestion:
    """Inputs of a computation of coupled stages; picklable.

    Parameters
    ----------
    model
        A model of several stages.
    numbers
        Nodal diameters of the assembly.
    n_modes
        Number of modes of each nodal diameter.
    """

    model: Model
    numbers: tuple[int, ...]
    n_modes: int

    @property
    def assembly(self) -> Multistage:
        """The stages and their flanges."""
        found = self.model.stages
        assert found is not None
        return found


def stages_question(model: Model, diameters: Sequence[int] | None, n_modes: int) -> StagesQuestion:
    """Return the inputs after a check of the nodal diameters; None: all diameters that vibrate independently."""
    assembly = model.stages
    assert assembly is not None
    unknown = sorted(set(diameters or ()) - set(assembly.harmonics))
    if unknown:
        kept = ", ".join(map(str, assembly.harmonics))
        raise input_error(
            "modes.nodal_diameters",
            f"{unknown[0]} is no harmonic that a flange couples, these are {kept}",
            "Add it to join.NAME.harmonics, or leave it out.",
        )
    return StagesQuestion(model, tuple(sorted(diameters or assembly.nodal_diameters)), n_modes)


def each_diameter(asked: StagesQuestion, done: Sequence[WaveModes], notes: Notes) -> Iterator[WaveModes]:
    """Yield the modes of unfinished nodal diameters; the note about the model comes first."""
    if notes.get(NOTE) is None:
        notes.put(NOTE, _about(asked))
    known = {w.wave_number for w in done}
    for i, number in enumerate(asked.numbers):
        if number not in known:
            found = _solved(asked, number)
            yield found
            low, high = found.frequencies_hz.min(), found.frequencies_hz.max()
            told = f"nodal diameter {number}: {low:.6g} to {high:.6g} Hz in {found.seconds:.1f} s"
            advance((i + 1) / len(asked.numbers), told)


def _solved(asked: StagesQuestion, number: int) -> WaveModes:
    began = perf_counter()
    found = multistage_modes(asked.assembly, number, asked.n_modes)
    return WaveModes(
        wave_number=number,
        seconds=perf_counter() - began,
        frequencies_hz=found.frequencies_hz,
        growth=np.zeros(asked.n_modes),
        shares=found.shares.T,
        stiffest_hz=found.stiffest_hz,
    )


def flange_doubts(waves: Sequence[WaveModes]) -> list[Verdict]:
    """Doubt frequencies that the uncoupled harmonics of the flanges could change."""
    off = {w.wave_number: w.stiffest_hz / w.frequencies_hz - 1 for w in waves if w.stiffest_hz is not None}
    poor = [f"{k} (up to {100 * d.max():.2g} %)" for k, d in off.items() if d.max() > LEFT_OUT]
    if not poor:
        return []
    why = (
        f"the flanges couple few harmonics: those left out could raise the frequencies of the nodal diameters {', '.join(poor)}, "
        "as they do where they are held"
    )
    return [Verdict("doubtful", why=why, remedy="Give join.NAME.harmonics more of them.")]


def unreached(assembly: Multistage) -> list[Verdict]:
    """Name the waves of the stages that no kept harmonic excites and no list of modes holds."""
    own = _in_words(assembly, assembly.unreached)
    if not own:
        return []
    why = f"no kept harmonic of the flanges leads to the waves {own}: their modes are in no list here"
    lowest = sorted({k for _, k in assembly.unreached})
    remedy = f"Add the harmonics {', '.join(map(str, lowest))} to join.NAME.harmonics."
    return [Verdict("trusted", why=why, remedy=remedy)]


def _about(asked: StagesQuestion) -> dict[str, Any]:
    """Return the note about the model; its number of sectors is the least common multiple of the stages."""
    stages = asked.assembly.stages
    counts = [sector.sectors for sector in stages.values()]
    told = [f"{name} of {count} sectors" for name, count in zip(stages, counts, strict=True)]
    each = [facts_of_part(asked.model.parts[name]) for name in stages]
    masses = np.array([count * f.mass for count, f in zip(counts, each, strict=True)])
    axis = asked.model.axis
    along = masses @ (np.array([f.centre for f in each]) - np.asarray(axis.origin)) @ axis.unit
    return facts_of(asked.model, 0.0) | {
        "stages": ", ".join(told),
        "mass_kg": float(masses.sum()),
        "centre_m": np.asarray(axis.origin) + along / masses.sum() * axis.unit,
        "sectors": math.lcm(*counts),
        "stage_name": np.array(list(stages), dtype=str),
        "stage_sectors": np.array(counts, dtype=np.int64),
        "stage_waves": np.array([_waves(asked.assembly, k) for k in asked.numbers], dtype=str),
        "speed_rpm": 0.0,
        "contacts": "none",
        "parted": False,
        "verdicts": to_json([*unreached(asked.assembly), *map(doubt, asked.model.warnings)]),
        **dict.fromkeys(STATIC, np.nan),
    }


def _waves(assembly: Multistage, number: int) -> str:
    """Return the waves of a nodal diameter in words: first 2, second 2 and 7."""
    return _in_words(assembly, assembly.waves(number))


def _in_words(assembly: Multistage, waves: Sequence[Wave]) -> str:
    own = {name: [str(k) for other, k in waves if other == name] for name in assembly.stages}
    return ", ".join(f"{name} {' and '.join(numbers)}" for name, numbers in own.items() if numbers)


MOST_ROWS = 100_000
SAME_SPEED = 1e-6  # relative
_SPEED = re.compile(r"(\d+(?:\.\d+)?)[ _]*rpm", re.IGNORECASE)  # in the name of a case
WHEEL = "mistuned"  # note with the modes of a mistuned wheel


class Row(BaseModel):
    """A line of the file."""

    nodal_diameter: int = Field(ge=0, description="a whole number")
    mode: int = Field(ge=0, description="a whole number")
    frequency_hz: float = Field(gt=0, allow_inf_nan=False, description="a frequency above zero")
    speed_rpm: float | None = Field(None, ge=0, allow_inf_nan=False, description="a speed of zero or more, or nothing")


@dataclass(frozen=True)
class Reference:
    """Reference frequencies of modes.

    Parameters
    ----------
    path
        Path of the file.
    frequencies_hz
        (nodal diameter, mode from 1) -> frequency, Hz.
    speeds_rpm
        Speeds in the column ``speed_rpm``, or else in the name of the case, as ``prestressed_8000rpm``; empty if unknown.
    """

    path: Path
    frequencies_hz: Mapping[tuple[int, int], float]
    speeds_rpm: tuple[float, ...] = ()

    def not_at(self, rpm: float) -> tuple[float, ...]:
        """Return the speeds of these frequencies that differ from a given speed."""
        return tuple(s for s in self.speeds_rpm if abs(s - rpm) > SAME_SPEED * max(s, rpm))

    def of_waves(self, numbers: Sequence[int], n_modes: int, sectors: int) -> FloatArray:
        """Return (k, m) reference frequencies in Hz for wave numbers; NaN if unknown.

        Both directions of a nodal diameter are compared with the same frequencies.

        Raises
        ------
        InputError
            If no reference frequency belongs to these waves.
        """
        diameters = [wave(k, sectors).nodal_diameter for k in numbers]
        modes = range(1, n_modes + 1)
        out = np.array([[self.frequencies_hz.get((d, m), np.nan) for m in modes] for d in diameters])
        if not np.isfinite(out).any():
            raise input_error(
                str(self.path),
                "holds no frequency of the nodal diameters and modes of this study",
                "Check the columns nodal_diameter and mode (1 is the lowest), and modes.reference_case.",
            )
        return out


def read_reference(path: Path, case: str | None) -> Reference:
    """Read a CSV file of frequencies; with `case`, only the rows whose column ``case`` has this value.

    Raises
    ------
    InputError
        If the file or a column is missing, or a line cannot be read.
    """
    if not path.is_file():
        raise missing_file("modes.reference", path)
    found, speeds = _rows(path, case)
    named = _SPEED.search(case or "")
    if named and not speeds:
        speeds = {float(named[1])}
    return Reference(path, found, tuple(sorted(speeds)))


def _rows(path: Path, case: str | None) -> tuple[dict[tuple[int, int], float], set[float]]:
    found: dict[tuple[int, int], float] = {}
    speeds: set[float] = set()
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            for line, row in _lines(path, stream, case):
                key = row.nodal_diameter, row.mode
                if key in found:
                    raise input_error(
                        f"{path}: line {line}",
                        f"nodal diameter {key[0]}, mode {key[1]} is there twice",
                        "Choose the rows by a column 'case' and modes.reference_case.",
                    )
                found[key] = row.frequency_hz
                speeds |= set() if row.speed_rpm is None else {row.speed_rpm}
    except (UnicodeDecodeError, csv.Error) as error:
        raise input_error(str(path), f"is not a CSV file in UTF-8 ({error})", "Save it as CSV.") from None
    return found, speeds


def _lines(path: Path, stream: TextIO, case: str | None) -> Iterator[tuple[int, Row]]:
    """Yield the reference rows and their line numbers."""
    reader = csv.DictReader(stream)
    required = [name for name, field in Row.model_fields.items() if field.is_required()]
    needed = [*required, *(["case"] if case is not None else [])]
    missing = [name for name in needed if name not in (reader.fieldnames or [])]
    if missing:
        raise input_error(
            str(path), f"has no column {', '.join(missing)}", f"The first line names the columns: {','.join(needed)}."
        )
    for row in reader:
        if reader.line_num > MOST_ROWS:
            raise input_error(str(path), f"has more than {MOST_ROWS} lines", "Cut it to what is compared.")
        if case is None or row["case"] == case:
            yield reader.line_num, _row(f"{path}: line {reader.line_num}", row)


def _row(place: str, row: dict[str, str]) -> Row:
    try:
        return Row.model_validate({k: v for k, v in row.items() if v or k != "speed_rpm"})
    except ValidationError as error:
        column = str(error.errors()[0]["loc"][0])
        raise input_error(
            f"{place}: {column}",
            f"cannot be read, got {row[column]!r}",
            f"Give {Row.model_fields[column].description}.",
        ) from None


def _compared_with(asked: ModesTable, home: Path) -> Reference | None:
    """Return the reference frequencies; None if there are none."""
    if asked.reference is None:
        return None
    return read_reference(home / asked.reference, asked.reference_case)


def _answer(solved: Solved, facts: Mapping[str, Any]) -> tuple[Modes, list[Verdict]]:
    known = _compared_with(solved.case.settings.modes, solved.case.home)
    waves = _compared([_with_shape(w) for w in solved.records], known, int(facts["sectors"]))
    found = Modes(**facts, waves=waves, wheel_modes=wheel_modes_in(solved.notes.get(WHEEL)))
    return found, [*flange_doubts(waves), *_of_other_speed(known, float(facts["speed_rpm"]))]


def _with_shape(found: WaveModes) -> WaveModes:
    """Return a wave with its shapes as real and imaginary parts."""
    parts = np.stack([found.shapes.real, found.shapes.imag], axis=-1).astype(np.float32)
    return replace(found, shape=parts) if parts.size else found


def _compared(waves: Sequence[WaveModes], known: Reference | None, sectors: int) -> tuple[WaveModes, ...]:
    """Return the waves with their reference frequencies."""
    if known is None:
        return tuple(waves)
    reference = known.of_waves([w.wave_number for w in waves], len(waves[0].frequencies_hz), sectors)
    pairs = zip(waves, reference, strict=True)
    return tuple(replace(w, reference_hz=own, difference=w.frequencies_hz / own - 1) for w, own in pairs)


def wheel_modes_in(note: Mapping[str, Any] | None) -> tuple[WheelMode, ...]:
    """Return the modes of a mistuned wheel from the note of a job; none for a tuned one."""
    if not note:
        return ()
    each = zip(*(np.asarray(note[n]) for n in ("mistuned_hz", "sector_share", "wave_share")), strict=True)
    return tuple(
        WheelMode(
            frequency_hz=hertz,
            sector_share=sectors,
            wave_share=waves,
            localisation=localisation(np.sqrt(np.maximum(sectors, 0.0))),
        )
        for hertz, sectors, waves in each
    )


def _of_other_speed(known: Reference | None, rpm: float) -> list[Verdict]:
    """Report reference frequencies at another speed."""
    others = known.not_at(rpm) if known is not None else ()
    if not others:
        return []
    speeds = ", ".join(f"{s:g} rpm" for s in others)
    why = f"modes.reference has frequencies at {speeds}, and [modes] at {rpm:g} rpm: the differences include the effect of speed"
    return [Verdict("trusted", why=why, remedy="Compare at the same speed.")]


def _inputs(case: Case, model: Model) -> Question | StagesQuestion:
    """Return the question of a case."""
    asked: ModesTable = case.settings.modes
    if model.stages is not None:
        return stages_question(model, asked.nodal_diameters, asked.number)
    turning = model.coriolis and model.rotates and model.speed > 0
    wheel = Wheel(model.sectors, turning or model.aerodynamics is not None)
    wheel.require(asked.nodal_diameters, "modes.nodal_diameters")
    _refuse_too_many(model, asked.number)
    numbers = wheel.numbers(asked.nodal_diameters)
    known = _compared_with(asked, case.home)
    if known is not None:
        known.of_waves(numbers, asked.number, model.sectors)
    question = Question(
        model,
        asked.contacts,
        wheel,
        numbers,
        asked.number,
        (model.speed,),
        rpm=float(f"{model.speed / RPM:.12g}"),
        shapes=asked.shapes and model.skin is not None,
    )
    question.require_coefficients()
    return question


def _solve(inputs: Question | StagesQuestion, done: Sequence[WaveModes], notes: Notes) -> Iterator[WaveModes]:
    """Yield the modes of each wave, or of each nodal diameter of stages, and store the modes of a mistuned wheel."""
    if isinstance(inputs, StagesQuestion):
        yield from each_diameter(inputs, done, notes)
        return
    yield from each_wave(solve_wave, inputs, done, notes)
    model = inputs.model
    if (
        model.mistuning is not None and notes.get(WHEEL) is None
    ):  # as many modes a sector as the table requests for a wave
        found = wheel_modes(model, inputs.n_modes * model.sectors, inputs.contacts)
        arrays = found.frequencies_hz, found.sector_share, found.wave_share
        notes.put(WHEEL, dict(zip(("mistuned_hz", "sector_share", "wave_share"), arrays, strict=True)))


def _unreached(asked: Question | StagesQuestion) -> list[str]:
    """Name the waves of several stages that appear in no list."""
    told = unreached(asked.assembly) if isinstance(asked, StagesQuestion) else []
    return [f"modes: {v.why}. {v.remedy}" for v in told]


def _refuse_too_many(model: Model, number: int) -> None:
    """Refuse more modes than there are dofs with mass."""
    parts = model.parts.values()
    most = sum(int(np.count_nonzero(part.structure.mass.diagonal())) for part in parts)
    if number > most:
        raise input_error(
            "modes.number", f"is {number}, and the model has {most} dofs with mass", f"Give at most {most}."
        )


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """State the number of modes, and the waves of several stages that appear in no list."""
    asked = _inputs(case, model)
    return (counted("modes", asked), *_unreached(asked))


MODES = replace(
    wave_analysis(
        "modes",
        ModesTable,
        WaveModes,
        _inputs,
        _solve,
        _answer,
        (Modes, modes_tables),
        compared=frozenset({"reference", "reference_case"}),
    ),
    check=_check,
)
