"""Flutter margins: aerodynamic damping of each wave by the energy method and by eigenvalues, and the least stable diagram."""

from collections.abc import Iterator, Mapping, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from stickslip.analyses.waves.analysis import wave_analysis
from stickslip.analyses.waves.records import Flutter, WaveFlutter, Wheel, WheelFlutter
from stickslip.analyses.waves.solve import Question, each_wave, wave_in_flow
from stickslip.analyses.waves.tables import FlutterTable
from stickslip.analyses.waves.verdicts import PERCENT, energy_doubts, flutter_tables, unstable, unstable_wheel
from stickslip.assembly.build import flow_around
from stickslip.assembly.model import Model
from stickslip.assembly.sides.mistuned import wheel_in_flow
from stickslip.errors import input_error
from stickslip.reduction.aerodynamics import InfluenceCoefficients
from stickslip.reduction.waves import wave
from stickslip.response.rotating.flutter import damping_ratio, least_stable_curve
from stickslip.study.analysis import Case, Notes, Solved
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, RPM

INFLUENCE, WHEEL = ("influence", "wheel")  # notes with the coefficients, and with the modes of a mistuned wheel
EVERY = 2.0  # degrees of inter-blade phase angle between points of the curve


def _of_wave(asked: Question, wave_number: int) -> WaveFlutter:
    began = perf_counter()
    found = wave_in_flow(asked.model, asked.contacts, asked.speeds[0], wave_number, asked.n_modes)
    assert found is not None
    angle = wave(wave_number, asked.wheel.sectors).phase_angle
    return WaveFlutter(
        wave_number=wave_number,
        seconds=perf_counter() - began,
        frequencies_hz=found.frequencies / HZ,
        phase_angle_deg=float(np.degrees(angle - 2 * np.pi if angle > np.pi + 1e-9 else angle)),
        by_energy=found.by_energy,
        by_eigenvalue=damping_ratio(found.in_flow),
        damping=damping_ratio(found.damped),
        in_flow_hz=found.damped.imag / HZ,
        amplitudes=found.amplitudes,
    )


def _answer(solved: Solved, facts: Mapping[str, Any]) -> tuple[Flutter, list[Verdict]]:
    waves: tuple[WaveFlutter, ...] = tuple(solved.records)
    sectors, known = int(facts["sectors"]), solved.notes[INFLUENCE]
    asked: FlutterTable = solved.case.settings.flutter
    total = np.array([w.damping for w in waves])
    least = np.unravel_index(total.argmin(), total.shape)
    around = np.arange(-180.0, 180.0 + EVERY / 2, EVERY)
    each = [(HZ * w.frequencies_hz, w.amplitudes) for w in waves]
    angles = np.array([wave(w.wave_number, sectors).phase_angle for w in waves])
    own = np.asarray(solved.notes[WHEEL]["eigenvalues"]) if WHEEL in solved.notes else np.zeros(0, dtype=complex)
    found = Flutter(
        **facts,
        waves=waves,
        curve_angle_deg=around,
        curve_damping=least_stable_curve(
            _influence(known), np.radians(around), each, angles, float(known["reference"])
        ),
        least_wave=int(least[0]),
        least_mode=int(least[1]),
        required_damping=asked.required_percent / PERCENT,
        wheel_modes=tuple(
            WheelFlutter(damping=d, frequency_hz=f) for d, f in zip(damping_ratio(own), own.imag / HZ, strict=True)
        ),
    )
    # the waves are no modes of a mistuned wheel
    told = unstable_wheel(own, asked) if own.size else unstable(waves, total, sectors, asked)
    return found, [
        *told,
        *energy_doubts(np.array([w.by_energy for w in waves]), np.array([w.by_eigenvalue for w in waves])),
    ]


def _influence(note: Any) -> InfluenceCoefficients:
    distances, values, frequencies, speeds = (
        np.asarray(note[name]) for name in ("distances", "values", "frequencies", "speeds")
    )
    return InfluenceCoefficients(distances, values, frequencies, speeds, "nearest")


def _inputs(case: Case, model: Model) -> Question:
    """Return the question of a case."""
    asked: FlutterTable = case.settings.flutter
    given = model.aerodynamics
    if given is None:
        raise input_error(
            "flutter",
            "needs aerodynamic coefficients",
            "Add the table [aero] with their file, or give the model `aerodynamics`.",
        )
    flow = flow_around(model)
    assert flow is not None
    wheel = Wheel(model.sectors, parted=True)
    wheel.require(asked.nodal_diameters, "flutter.nodal_diameters")
    number = asked.number or (1 if given.of_points else max(given.modes))
    question = Question(
        model,
        asked.contacts,
        wheel,
        wheel.numbers(asked.nodal_diameters),
        number,
        (model.speed,),
        rpm=float(f"{model.speed / RPM:.12g}"),
    )
    if question.small:
        question.require("flutter.number" if asked.number else "aero.mode")
        flow.patterns(question.numbers[0])
    question.require_coefficients()
    return question


def _solve(inputs: Question, done: Sequence[Any], notes: Notes) -> Iterator[Any]:
    """Yield the record of each wave; the coefficients go into the notes first."""
    if notes.get(INFLUENCE) is None:
        flow = flow_around(inputs.model)
        assert flow is not None
        own = flow.influence
        notes.put(
            INFLUENCE,
            {
                "distances": own.distances,
                "values": own.values,
                "frequencies": own.frequencies,
                "speeds": own.speeds,
                "reference": flow.given.reference,
            },
        )
    yield from each_wave(_of_wave, inputs, done, notes)
    model = inputs.model
    if model.mistuning is not None and notes.get(WHEEL) is None:
        found = wheel_in_flow(model, inputs.n_modes * model.sectors, inputs.contacts)
        notes.put(WHEEL, {"eigenvalues": found})


FLUTTER = wave_analysis(
    "flutter",
    FlutterTable,
    WaveFlutter,
    _inputs,
    _solve,
    _answer,
    (Flutter, flutter_tables),
    compared=frozenset({"required_percent"}),
)
