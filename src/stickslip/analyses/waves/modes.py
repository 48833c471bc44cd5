"""Natural frequencies and mode shapes: of each nodal diameter of a wheel, or of a structure as a whole."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from stickslip.analyses.waves.analysis import counted, wave_analysis
from stickslip.analyses.waves.of_wheel import NOTE, variables
from stickslip.analyses.waves.of_wheel import solved as solved_wheel
from stickslip.analyses.waves.records.dataset import Variables, frequencies, growth
from stickslip.analyses.waves.records.results import WaveModes, Wheel
from stickslip.analyses.waves.reference import Reference, read_reference
from stickslip.analyses.waves.solve import Question, each_wave, solve_wave
from stickslip.analyses.waves.stages import (
    StagesQuestion,
    each_diameter,
    flange_doubts,
    stages_question,
    unreached,
)
from stickslip.analyses.waves.tables import ModesTable
from stickslip.analyses.waves.texts import modes_tables
from stickslip.arrays import FloatArray
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.response.rotating.flutter import damping_ratio
from stickslip.study.analysis import Case, Notes, Solved
from stickslip.study.store.netcdf import variable
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, RPM


def _compared_with(asked: ModesTable, home: Path) -> Reference | None:
    """Return the reference frequencies; None if there are none."""
    if asked.reference is None:
        return None
    return read_reference(home / asked.reference, asked.reference_case)


def _of_case(solved: Solved) -> tuple[Variables, list[Verdict]]:
    waves: Sequence[WaveModes] = solved.records
    hertz = frequencies(waves)
    found = {"frequency_hz": variable("wave mode", hertz, "Hz", "natural frequency"), "growth": growth(waves)}
    more = _of_stages(waves) | _in_flow(waves) | _compared(solved, hertz) | _shapes(waves)
    of_wheel = variables(solved.notes.get(NOTE))
    return found | more | of_wheel, [*flange_doubts(waves), *_of_other_speed(solved)]


def _of_stages(waves: Sequence[WaveModes]) -> Variables:
    """Return the energy share of each stage; empty for a single wheel."""
    shares = np.array([w.shares.T for w in waves])
    if not shares.size:
        return {}
    stiffest = np.array([w.stiffest_hz for w in waves])
    return {
        "stage_share": variable("wave mode stage", shares, "1", "share of a stage in the kinetic energy"),
        "stiffest_hz": variable(
            "wave mode", stiffest, "Hz", "natural frequency with all harmonics held that flanges do not couple"
        ),
    }


def _in_flow(waves: Sequence[WaveModes]) -> Variables:
    """Return damping and frequency of the eigenvalues with aerodynamic forces; empty without such forces."""
    values = np.array([w.in_flow for w in waves])
    if not values.size:
        return {}
    about = "of the eigenvalue with aerodynamic forces and the structure's damping"
    return {
        "damping": variable("wave mode", damping_ratio(values), "1", f"damping ratio {about}"),
        "damped_hz": variable("wave mode", values.imag / HZ, "Hz", f"frequency {about}"),
    }


def _compared(solved: Solved, hertz: FloatArray) -> Variables:
    asked: ModesTable = solved.case.settings.modes
    known = _compared_with(asked, solved.case.home)
    if known is None:
        return {}
    numbers = [w.wave_number for w in solved.records]
    reference = known.of_waves(numbers, hertz.shape[1], int(solved.notes["model"]["sectors"]))
    off = hertz / reference - 1
    return {
        "reference_hz": variable("wave mode", reference, "Hz", "frequency to compare with"),
        "difference": variable("wave mode", off, "1", "relative difference from the reference"),
    }


def _of_other_speed(solved: Solved) -> list[Verdict]:
    """Report reference frequencies at another speed."""
    asked: ModesTable = solved.case.settings.modes
    known, rpm = _compared_with(asked, solved.case.home), float(solved.notes["model"]["speed_rpm"])
    others = known.not_at(rpm) if known is not None else ()
    if not others:
        return []
    speeds = ", ".join(f"{s:g} rpm" for s in others)
    why = f"the frequencies of modes.reference are of {speeds}, those of [modes] of {rpm:g} rpm: the differences hold what the speed does"
    return [Verdict("trusted", why=why, remedy="Compare at the same speed.")]


def _shapes(waves: Sequence[WaveModes]) -> Variables:
    shapes = np.stack([w.shapes for w in waves])
    if not shapes.size:
        return {}
    parts = np.stack([shapes.real, shapes.imag], axis=-1).astype(np.float32)
    about = "displacement of sector 0, largest is 1"
    return {"shape": variable("wave mode skin_point xyz part", parts, "1", about)}


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
    if inputs.model.mistuning is not None and notes.get(NOTE) is None:
        notes.put(NOTE, solved_wheel(inputs))


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
        _of_case,
        modes_tables,
        compared=frozenset({"reference", "reference_case"}),
    ),
    check=_check,
)
