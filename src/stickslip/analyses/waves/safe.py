"""The SAFE or interference diagram: modes excited by engine orders at one speed."""

from collections.abc import Sequence

import numpy as np

from stickslip.analyses.waves.analysis import solved_by, wave_analysis
from stickslip.analyses.waves.doubts import safe_doubts
from stickslip.analyses.waves.records.dataset import Variables, frequencies, growth
from stickslip.analyses.waves.records.results import WaveModes, Wheel
from stickslip.analyses.waves.solve import Question, in_still_fluid, solve_wave
from stickslip.analyses.waves.tables import SafeTable
from stickslip.analyses.waves.texts import safe_tables
from stickslip.arrays import FloatArray
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.response.rotating.safe import NodalDiameterMap, Safe, safe
from stickslip.study.analysis import Case, Solved
from stickslip.study.store.netcdf import variable
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, RPM


def _of_case(solved: Solved) -> tuple[Variables, list[Verdict]]:
    waves: Sequence[WaveModes] = solved.records
    told = solved.notes["model"]
    asked: SafeTable = solved.case.settings.safe
    sectors = int(told["sectors"])
    found = {
        "frequency_hz": variable("wave mode", frequencies(waves), "Hz", "natural frequency"),
        "growth": growth(waves),
        "margin_percent": variable("", asked.margin_percent, "%", "margin of a near resonance"),
    }
    if not {w.wave_number for w in waves} >= set(Wheel(sectors, parted=False).numbers()):
        return found, []  # the job ended without a solution
    met = interference(waves, sectors, asked, float(told["speed_rpm"]) * RPM)
    return found | _pairs(waves, met), list(safe_doubts(met))


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


def _pairs(waves: Sequence[WaveModes], met: Safe) -> Variables:
    numbers, sectors, pairs = [w.wave_number for w in waves], met.frequencies.sectors, met.points
    known = [k if k in numbers else sectors - k for k in (p.wave_number for p in pairs)]
    orders = np.array([p.engine_order for p in pairs])
    near = [int(abs(p.margin) <= met.allowed) for p in pairs]
    judged = [int(m not in met.not_judged) for m in orders]
    unjudged = "0 if the engine order excites above the highest computed mode of its nodal diameter"
    found = {
        "wave": ([numbers.index(k) for k in known], "1", "index of the wave"),
        "mode": ([p.mode for p in pairs], "1", "index of the mode"),
        "engine_order": (orders, "1", "engine order"),
        "frequency_hz": ([p.frequency_hz for p in pairs], "Hz", "natural frequency of the mode"),
        "excitation_hz": (orders * met.speed_range[0] / HZ, "Hz", "frequency of the excitation"),
        "resonance_rpm": ([p.speed / RPM for p in pairs], "rpm", "speed at which they meet"),
        "margin": ([p.margin for p in pairs], "1", "that speed over the speed, less one"),
        "near": (near, "1", "1 if the margin is within the limit"),
        "judged": (judged, "1", unjudged),
    }
    return {f"pair_{name}": variable("pair", *of) for name, of in found.items()}


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


SAFE = wave_analysis(
    "safe",
    SafeTable,
    WaveModes,
    _inputs,
    solved_by(solve_wave),
    _of_case,
    safe_tables,
    compared=frozenset({"engine_orders", "margin_percent"}),
)
