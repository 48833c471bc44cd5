"""Natural frequencies against rotor speed, and their crossings with engine orders."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from stickslip.analyses.facts import NOTE
from stickslip.analyses.operation import asked_of, ends_of
from stickslip.analyses.waves.analysis import solved_by, wave_analysis
from stickslip.analyses.waves.records import Campbell, Unfollowed, WaveBranches, Wheel
from stickslip.analyses.waves.solve import Question, follow_wave, in_still_fluid
from stickslip.analyses.waves.tables import CampbellTable
from stickslip.analyses.waves.verdicts import (
    basis_doubts,
    campbell_doubts,
    campbell_tables,
    in_operation,
    unfollowed_from,
)
from stickslip.assembly.model import Model
from stickslip.errors import input_error
from stickslip.study.analysis import Case, Solved
from stickslip.study.verdict import Verdict
from stickslip.units import RPM


def _numbers(asked: CampbellTable, wheel: Wheel) -> tuple[int, ...]:
    """Return the wave numbers of the requested nodal diameters, or else the waves excited by the engine orders."""
    if asked.nodal_diameters is not None:
        return wheel.numbers(asked.nodal_diameters)
    return tuple(sorted({wheel.diagram(m) for m in asked.engine_orders}))


def _answer(solved: Solved, facts: Mapping[str, Any]) -> tuple[Campbell, list[Verdict]]:
    asked: CampbellTable = solved.case.settings.campbell
    waves: tuple[WaveBranches, ...] = tuple(solved.records)
    wheel = Wheel(int(facts["sectors"]), bool(solved.notes[NOTE]["parted"]))
    beyond = _unfollowed(waves, wheel, asked)
    unseen = sorted(m for m in asked.engine_orders if wheel.diagram(m) not in _numbers(asked, wheel))
    found = Campbell(
        **facts,
        speeds_rpm=np.array(asked.speeds) / RPM,
        waves=waves,
        engine_orders=np.array(asked.engine_orders),
        unfollowed=tuple(Unfollowed(engine_order=m, from_rpm=rpm) for m, rpm in beyond),
        **ends_of(asked_of(solved.case)),
    )
    return found, [*basis_doubts(waves), *campbell_doubts(beyond, unseen, waves), *in_operation(found)]


def _unfollowed(waves: Sequence[WaveBranches], wheel: Wheel, asked: CampbellTable) -> list[tuple[int, float]]:
    """Return engine orders that rise above all followed modes of their wave, each with the speed at which it does, rpm."""
    known = {w.wave_number: w.frequencies_hz for w in waves}
    found = []
    for order in sorted(asked.engine_orders):
        hertz = known.get(wheel.diagram(order))
        rpm = None if hertz is None else unfollowed_from(order, hertz, np.array(asked.speeds))
        if rpm is not None:
            found.append((order, rpm))
    return found


def _inputs(case: Case, model: Model) -> Question:
    """Return the question of a case."""
    asked: CampbellTable = case.settings.campbell
    if not model.rotates:
        raise input_error(
            "campbell",
            "the model is matrices, which no speed changes",
            "Bring the mesh (a deck or an archive of one material), or matrices at several speeds (at_speed).",
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


CAMPBELL = replace(
    wave_analysis(
        "campbell",
        CampbellTable,
        WaveBranches,
        _inputs,
        solved_by(follow_wave),
        _answer,
        (Campbell, campbell_tables),
    ),
    shared=("operation",),
)
