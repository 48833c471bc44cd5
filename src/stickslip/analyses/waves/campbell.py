"""Natural frequencies against rotor speed, and their crossings with engine orders."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from stickslip.analyses.waves.analysis import solved_by, wave_analysis
from stickslip.analyses.waves.doubts import basis_doubts, campbell_doubts, unfollowed_from
from stickslip.analyses.waves.records.dataset import Variables, frequencies
from stickslip.analyses.waves.records.results import WaveBranches, Wheel
from stickslip.analyses.waves.solve import Question, follow_wave, in_still_fluid
from stickslip.analyses.waves.tables import CampbellTable
from stickslip.analyses.waves.texts import campbell_tables
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.study.analysis import Case, Solved
from stickslip.study.store.netcdf import variable
from stickslip.study.verdict import Verdict
from stickslip.units import RPM


def _numbers(asked: CampbellTable, wheel: Wheel) -> tuple[int, ...]:
    """Return the wave numbers of the requested nodal diameters, else of those excited by the engine orders."""
    if asked.nodal_diameters is not None:
        return wheel.numbers(asked.nodal_diameters)
    return tuple(sorted({wheel.diagram(m) for m in asked.engine_orders}))


def _of_case(solved: Solved) -> tuple[Variables, list[Verdict]]:
    asked: CampbellTable = solved.case.settings.campbell
    waves: Sequence[WaveBranches] = solved.records
    told = solved.notes["model"]
    wheel = Wheel(int(told["sectors"]), bool(told["parted"]))
    beyond = _unfollowed(waves, wheel, asked)
    unseen = sorted(m for m in asked.engine_orders if wheel.diagram(m) not in _numbers(asked, wheel))
    doubts = [*basis_doubts(waves), *campbell_doubts(beyond, unseen, waves)]
    return _curves(waves, asked) | _crossings(waves) | _beyond(beyond), doubts


def _unfollowed(waves: Sequence[WaveBranches], wheel: Wheel, asked: CampbellTable) -> list[tuple[int, float]]:
    """Return engine orders that rise above all followed modes of their wave, and the speed in rpm from which they do."""
    known = {w.wave_number: w.frequencies_hz for w in waves}
    found = []
    for order in sorted(asked.engine_orders):
        hertz = known.get(wheel.diagram(order))
        rpm = None if hertz is None else unfollowed_from(order, hertz, np.array(asked.speeds))
        if rpm is not None:
            found.append((order, rpm))
    return found


def _curves(waves: Sequence[WaveBranches], asked: CampbellTable) -> Variables:
    orders, error = asked.engine_orders, [w.error for w in waves]
    about = "natural frequency in the rotating frame"
    return {
        "speed_rpm": variable("speed", np.array(asked.speeds) / RPM, "rpm", "speed of the rotor"),
        "engine_orders": variable("order", orders, "1", "engine order whose crossings are looked for"),
        "frequency_hz": variable("wave speed mode", frequencies(waves), "Hz", about),
        "basis_error": variable("wave", error, "1", "relative error of frequencies between speeds"),
    }


def _crossings(waves: Sequence[WaveBranches]) -> Variables:
    which = np.repeat(np.arange(len(waves)), [len(w.modes) for w in waves])

    def every(name: str) -> Any:
        return np.concatenate([getattr(w, name) for w in waves])

    found = {
        "wave": (which, "1", "index of the wave"),
        "mode": (every("modes"), "1", "index of the mode"),
        "engine_order": (every("engine_orders"), "1", "engine order that crosses"),
        "speed_rpm": (every("speeds") / RPM, "rpm", "speed of the crossing"),
        "frequency_hz": (every("crossings_hz"), "Hz", "frequency of the crossing"),
    }
    return {f"crossing_{name}": variable("crossing", *of) for name, of in found.items()}


def _beyond(unfollowed: Sequence[tuple[int, float]]) -> Variables:
    orders = np.array([m for m, _ in unfollowed], dtype=np.int64)
    speeds = np.array([rpm for _, rpm in unfollowed], dtype=float)
    about = "engine order that goes beyond the followed modes of its nodal diameter"
    return {
        "unfollowed_engine_order": variable("unfollowed", orders, "1", about),
        "unfollowed_from_rpm": variable("unfollowed", speeds, "rpm", "speed from which it does"),
    }


def _inputs(case: Case, model: Model) -> Question:
    """Return the question of a case."""
    asked: CampbellTable = case.settings.campbell
    if not model.rotates:
        raise input_error(
            "campbell",
            "the model is matrices, which no speed changes",
            "Bring the mesh (a deck or an archive of one material) instead of matrices.",
        )
    wheel = Wheel(model.sectors, model.coriolis)
    wheel.require(asked.nodal_diameters, "campbell.nodal_diameters")
    still, left_out = in_still_fluid(model)
    return Question(
        still,
        asked.contacts,
        wheel,
        _numbers(asked, wheel),
        asked.modes,
        asked.speeds,
        engine_orders=tuple(asked.engine_orders),
        left_out=left_out,
    )


CAMPBELL = wave_analysis(
    "campbell",
    CampbellTable,
    WaveBranches,
    _inputs,
    solved_by(follow_wave),
    _of_case,
    campbell_tables,
)
