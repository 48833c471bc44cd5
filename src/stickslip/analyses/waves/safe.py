"""The SAFE or interference diagram: modes excited by engine orders at one speed."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stickslip.analyses.operation import asked_of, ends_of
from stickslip.analyses.waves.analysis import solved_by, wave_analysis
from stickslip.analyses.waves.records import Interference, Pair, WaveModes, Wheel
from stickslip.analyses.waves.solve import Question, in_still_fluid, solve_wave
from stickslip.analyses.waves.tables import SafeTable
from stickslip.analyses.waves.verdicts import safe_doubts, safe_in_operation, safe_tables
from stickslip.arrays import FloatArray
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.response.rotating.safe import NodalDiameterMap, Safe, safe
from stickslip.study.analysis import Case, Solved
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, RPM


def _answer(solved: Solved, facts: Mapping[str, Any]) -> tuple[Interference, list[Verdict]]:
    waves: tuple[WaveModes, ...] = tuple(solved.records)
    asked: SafeTable = solved.case.settings.safe
    sectors = int(facts["sectors"])
    operating = ends_of(asked_of(solved.case))
    found = Interference(**facts, waves=waves, margin_percent=asked.margin_percent, **operating)
    if not {w.wave_number for w in waves} >= set(Wheel(sectors, parted=False).numbers()):
        return found, []  # no solution
    met = interference(waves, sectors, asked, float(facts["speed_rpm"]) * RPM)
    found = replace(found, pairs=_pairs(waves, met))
    return found, [*safe_doubts(met), *safe_in_operation(found)]


def interference(waves: Sequence[WaveModes], sectors: int, asked: SafeTable, speed: float) -> Safe:
    """Return the pairs of engine order and mode at a speed in rad/s."""
    known = {w.wave_number: w.frequencies_hz for w in waves}
    diameters = np.arange(sectors // 2 + 1)
    backward = np.array([known[int(d)] for d in diameters])
    forward = np.array([known.get(sectors - int(d), known[int(d)]) for d in diameters])
    found = NodalDiameterMap(sectors, diameters, backward, forward)
    grown = {w.wave_number: w.growth for w in waves}

    def of_wave(number: int) -> FloatArray:
        return grown.get(number, grown.get(sectors - number, np.zeros(0)))

    margin = asked.margin_percent / 100
    return safe(found, speed, asked.engine_orders, margin=margin, growth=of_wave)


def _pairs(waves: Sequence[WaveModes], met: Safe) -> tuple[Pair, ...]:
    numbers, sectors = [w.wave_number for w in waves], met.frequencies.sectors
    return tuple(
        Pair(
            wave=numbers.index(p.wave_number if p.wave_number in numbers else sectors - p.wave_number),
            mode=p.mode,
            engine_order=p.engine_order,
            frequency_hz=p.frequency_hz,
            excitation_hz=p.engine_order * met.speed_range[0] / HZ,
            resonance_rpm=p.speed / RPM,
            margin=p.margin,
            near=abs(p.margin) <= met.allowed,
            judged=p.engine_order not in met.not_judged,
        )
        for p in met.points
    )


def _inputs(case: Case, model: Model) -> Question:
    """Return the question of a case."""
    asked: SafeTable = case.settings.safe
    if model.sectors == 1:
        raise input_error(
            "safe",
            "the model is a whole structure, not a sector",
            "An interference diagram needs cyclic symmetry; give the sector and the number of sectors.",
        )
    rpm = float(f"{model.speed / RPM:.12g}") if asked.speed_rpm is None else asked.speed_rpm
    if rpm <= 0:
        raise input_error(
            "safe.speed_rpm", f"must be above zero, got {rpm:g}", "Give the speed at which the engine orders act."
        )
    at = rpm * RPM if model.rotates else 0.0
    wheel = Wheel(model.sectors, model.coriolis and model.rotates)
    still, left_out = in_still_fluid(model)
    numbers = wheel.numbers()
    return Question(still, asked.contacts, wheel, numbers, asked.modes, (at,), rpm=rpm, left_out=left_out)


SAFE = replace(
    wave_analysis(
        "safe",
        SafeTable,
        WaveModes,
        _inputs,
        solved_by(solve_wave),
        _answer,
        (Interference, safe_tables),
        compared=frozenset({"engine_orders", "margin_percent"}),
    ),
    shared=("operation",),
)
