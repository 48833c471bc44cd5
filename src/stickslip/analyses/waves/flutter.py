"""Flutter margins: aerodynamic damping of each wave by the energy method and by eigenvalues, and the least stable diagram."""

from collections.abc import Iterator, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from stickslip.analyses.waves.analysis import wave_analysis
from stickslip.analyses.waves.records.dataset import Variables
from stickslip.analyses.waves.records.results import WaveFlutter, Wheel, label
from stickslip.analyses.waves.solve import Question, each_wave, wave_in_flow
from stickslip.analyses.waves.tables import FlutterTable
from stickslip.analyses.waves.texts import flutter_tables
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.assembly.build import flow_around
from stickslip.assembly.model import Model
from stickslip.assembly.sides.wheel_modes import wheel_in_flow
from stickslip.errors import input_error
from stickslip.reduction.aerodynamics import InfluenceCoefficients
from stickslip.reduction.waves import wave
from stickslip.response.rotating.flutter import damping_ratio, least_stable_curve
from stickslip.study.analysis import Case, Notes, Solved
from stickslip.study.store.netcdf import variable
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, RPM

INFLUENCE, WHEEL = ("influence", "wheel")  # notes of the coefficients, and of a wheel whose sectors differ
EVERY = 2.0  # degrees of inter-blade phase angle between points of the curve
APART = 0.1  # of the largest damping: energy method and eigenvalue differ by more
PERCENT = 100.0
FLUTTERS = "The wheel flutters: friction may limit the vibration, more damping or another blade prevent it."
MORE = "Add damping, or change the blade."


def _of_wave(asked: Question, wave_number: int) -> WaveFlutter:
    began = perf_counter()
    found = wave_in_flow(asked.model, asked.contacts, asked.speeds[0], wave_number, asked.n_modes)
    assert found is not None
    return WaveFlutter(
        wave_number,
        found.frequencies / HZ,
        found.amplitudes,
        found.by_energy,
        found.in_flow,
        found.damped,
        perf_counter() - began,
    )


def _of_case(solved: Solved) -> tuple[Variables, list[Verdict]]:
    waves: Sequence[WaveFlutter] = solved.records
    sectors = int(solved.notes["model"]["sectors"])
    asked: FlutterTable = solved.case.settings.flutter
    energy = np.array([w.by_energy for w in waves])
    flow, both = (np.array([getattr(w, name) for w in waves]) for name in ("in_flow", "damped"))
    total, by_eigenvalue = damping_ratio(both), damping_ratio(flow)
    angles = np.array([wave(w.wave_number, sectors).phase_angle for w in waves])
    least = np.unravel_index(total.argmin(), total.shape)
    around = np.arange(-180.0, 180.0 + EVERY / 2, EVERY)
    known = solved.notes[INFLUENCE]
    each = [w.solved for w in waves]
    reference = float(known["reference"])
    curve = least_stable_curve(_influence(known), np.radians(around), each, angles, reference)
    signed = np.degrees(np.where(angles > np.pi + 1e-9, angles - 2 * np.pi, angles))
    found = {
        "frequency_hz": variable(
            "wave mode", np.array([w.frequencies_hz for w in waves]), "Hz", "natural frequency in still fluid"
        ),
        "phase_angle_deg": variable("wave", signed, "deg", "inter-blade phase angle"),
        "damping_by_energy": variable("wave mode", energy, "1", "aerodynamic damping ratio by the energy method"),
        "damping_by_eigenvalue": variable(
            "wave mode", by_eigenvalue, "1", "aerodynamic damping ratio of the eigenvalue"
        ),
        "damping": variable("wave mode", total, "1", "damping ratio of the eigenvalue, with that of the structure"),
        "frequency_in_flow_hz": variable(
            "wave mode", both.imag / HZ, "Hz", "frequency of the eigenvalue, with that damping"
        ),
        "curve_angle_deg": variable("curve", around, "deg", "inter-blade phase angle of the curve"),
        "curve_damping": variable(
            "mode curve", curve, "1", "aerodynamic damping ratio by the energy method, over any inter-blade phase angle"
        ),
        "least_wave": variable("", int(least[0]), "1", "index of the least stable wave"),
        "least_mode": variable("", int(least[1]), "1", "index of its mode"),
        "required_damping": variable(
            "", asked.required_percent / PERCENT, "1", "damping ratio that every wave must have"
        ),
    }
    told = _unstable(waves, total, sectors, asked)
    if WHEEL in solved.notes:  # then no wave is a mode
        own = np.asarray(solved.notes[WHEEL]["eigenvalues"])
        found |= _of_wheel(own)
        told = _unstable_wheel(own, asked)
    return found, [*told, *_doubts(energy, by_eigenvalue)]


def _of_wheel(eigenvalues: ComplexArray) -> Variables:
    """Return the modes of a mistuned wheel in the flow, the least damped first."""
    about = "of a mode of the wheel whose sectors differ, in the flow with its own damping"
    return {
        "wheel_damping": variable("wheel_mode", damping_ratio(eigenvalues), "1", f"damping ratio {about}"),
        "wheel_frequency_hz": variable("wheel_mode", eigenvalues.imag / HZ, "Hz", f"frequency {about}"),
    }


def _unstable_wheel(eigenvalues: ComplexArray, asked: FlutterTable) -> list[Verdict]:
    damping = damping_ratio(eigenvalues)
    if damping[0] >= asked.required_percent / PERCENT:
        return []
    grows = int(np.count_nonzero(damping < 0))
    what = f"{grows} of its modes grow" if grows else f"it has less than the {asked.required_percent:g} % required"
    why = f"the wheel whose sectors differ has a least damping of {PERCENT * damping[0]:.4g} % at {eigenvalues[0].imag / HZ:.5g} Hz: {what}"
    return [Verdict("trusted", why=why, remedy=FLUTTERS if grows else MORE, warns=True)]


def _influence(note: Any) -> InfluenceCoefficients:
    distances, values, frequencies, speeds = (
        np.asarray(note[name]) for name in ("distances", "values", "frequencies", "speeds")
    )
    return InfluenceCoefficients(distances, values, frequencies, speeds, "nearest")


def _unstable(waves: Sequence[WaveFlutter], total: FloatArray, sectors: int, asked: FlutterTable) -> list[Verdict]:
    """Report waves with less damping than required, the least stable first."""
    required = asked.required_percent / PERCENT
    rows = [(total[i, m], i, m) for i, m in np.argwhere(total < required)]
    if not rows:
        return []
    worst, i, m = min(rows)
    name = label(waves[i].wave_number, sectors, parted=True)
    what = "grows" if worst < 0 else f"has less damping than the {asked.required_percent:g} % required"
    why = f"{name}, mode {m + 1} {what}: damping {PERCENT * worst:.4g} % at {waves[i].frequencies_hz[m]:.5g} Hz{_others(rows, worst)}"
    return [Verdict("trusted", why=why, remedy=FLUTTERS if worst < 0 else MORE, warns=True)]


def _others(rows: Sequence[tuple[float, int, int]], worst: float) -> str:
    """Count the waves, and the modes if their number differs, that grow or have too little damping."""
    alike = [row for row in rows if row[0] < 0 or worst >= 0]
    if len(alike) == 1:
        return ""
    count, are = len({i for _, i, _ in alike}), "grow" if worst < 0 else "have too little"
    of = f"{len(alike)} modes of {count} wave{'s' if count > 1 else ''}"
    return f"; {of if len(alike) > count else f'{count} waves'} {are} in all"


def _doubts(energy: FloatArray, by_eigenvalue: FloatArray) -> list[Verdict]:
    """Doubt the energy method if the eigenvalue differs: the fluid then changes the mode."""
    size = np.abs(by_eigenvalue).max(initial=0.0)
    off = np.abs(energy - by_eigenvalue).max(initial=0.0)
    if not off > APART * size:
        return []
    why = f"energy method and eigenvalue differ by up to {PERCENT * off:.3g} % of critical damping"
    remedy = (
        "The fluid changes the modes: trust the eigenvalues, and give coefficients between all modes near each other."
    )
    return [Verdict("doubtful", why=why, remedy=remedy)]


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
    _of_case,
    flutter_tables,
    compared=frozenset({"required_percent"}),
)
