"""The problem of a job: the model with its loads, and the mode."""

from collections.abc import Sequence

import numpy as np

from stickslip.analyses import vibrating
from stickslip.analyses.facts import facts_of
from stickslip.analyses.forced_response.problem import peak_first
from stickslip.analyses.modal_synthesis.table import ModalSynthesisTable
from stickslip.analyses.nonlinear_mode.problem import sweep_of
from stickslip.analyses.vibrating import (
    modes_of,
    no_such_mode,
    refuse_rigid,
    require_flow,
)
from stickslip.assembly.assembling import assemble
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.response.nonlinear_modes.backbone import ModeSweep
from stickslip.response.self_excited.modes import StuckMode
from stickslip.study.analysis import Case
from stickslip.units import RPM

NAME = "modal_synthesis"
MOST_FORCE = 1e60  # N, above which the polynomial of the response overflows


class Question(vibrating.Question):
    """A case of the analysis."""

    asked: ModalSynthesisTable

    @property
    def rest(self) -> HarmonicLoad:
        """The static loads alone."""
        return HarmonicLoad(self.model.load.static)

    @property
    def mode(self) -> StuckMode | None:
        """The mode of the synthesis; None if it does not exist."""
        every = modes_of(self.model, self.asked.mode)
        return next((m for m in every if m.number == self.asked.mode), None)

    @property
    def sweep(self) -> ModeSweep:
        """Range and number of amplitudes of the nonlinear mode."""
        return sweep_of(self.asked)


def question_of(case: Case, model: Model) -> Question:
    """Return the problem of a job.

    Raises
    ------
    InputError
        If no load or one of a higher harmonic drives the model, a contact is rigid, the mode does not exist, no contact
        slips or opens and no amplitudes are given, or the model cannot be assembled.
    """
    asked: ModalSynthesisTable = case.settings.modal_synthesis
    driven = {name: harmonic for name, harmonic in model.driven.items() if harmonic > 0}
    if not driven:
        raise input_error(NAME, "no load vibrates", "Give a load with harmonic = 1.")
    for name, harmonic in driven.items():
        if harmonic != 1:
            raise input_error(
                f"load.{name}.harmonic",
                f"is {harmonic}, and the mode of [{NAME}] answers to harmonic 1",
                "Leave the load out, or ask for the forced response.",
            )
    most = JUDGED_MULTIPLE * max(asked.harmonics, asked.most_harmonics)
    refuse_whole(NAME, model)
    assembled = peak_first(assemble(model, most, case.store))
    refuse_rigid(NAME, assembled)
    facts = facts_of(model, model.speed / RPM)
    _bounded(asked.levels, assembled.load)
    question = Question(case.label, assembled, asked, case.settings.solver.evaluator, facts)
    question.sweep.require_span(assembled.system.interface, f"{NAME}.amplitude_mm")
    mode = question.mode
    if mode is None:
        raise no_such_mode(f"{NAME}.mode", f"is {asked.mode}")
    require_flow(assembled, [mode], most, "a nonlinear mode")
    return question


def _bounded(levels: Sequence[float], load: HarmonicLoad) -> None:
    """Refuse levels whose forces exceed the range of numbers of the response."""
    force = max(float(np.max(np.abs(f), initial=0.0)) for f in load.harmonics.values())
    for level in levels:
        if not level * force <= MOST_FORCE:
            raise input_error(
                f"{NAME}.levels",
                f"holds {level:g}, with which the loads are above {MOST_FORCE:g} N",
                "Levels are factors on the harmonic loads: give some between 0.01 and 100.",
            )
