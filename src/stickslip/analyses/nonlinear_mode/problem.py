"""The problem of a job: the model at rest, its waves, and the modes to follow."""

from dataclasses import dataclass, replace

from stickslip.analyses import vibrating
from stickslip.analyses.facts import facts_of
from stickslip.analyses.modal_synthesis.table import ModalSynthesisTable
from stickslip.analyses.nonlinear_mode.table import NonlinearModeTable
from stickslip.analyses.vibrating import (
    free_to_vibrate,
    modes_of,
    no_such_mode,
    refuse_rigid,
    refuse_waves,
    require_flow,
)
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.reduction.waves import NO_WAVE
from stickslip.response.nonlinear_modes.backbone import ModeSweep
from stickslip.response.self_excited.modes import StuckMode
from stickslip.study.analysis import Case
from stickslip.units import RPM

NAME = "nonlinear_mode"


@dataclass(frozen=True, eq=False)
class Question(vibrating.Question):
    """A case of the analysis, whose model has no harmonic loads.

    Parameters
    ----------
    waves
        Wave numbers to examine; only `NO_WAVE` for a single structure.
    """

    asked: NonlinearModeTable
    waves: tuple[int, ...]

    def followed(self, wave: int) -> list[StuckMode]:
        """Return the modes of a wave to follow."""
        every = modes_of(self.model, max(self.asked.modes), wave)
        return [m for m in every if m.number in self.asked.modes]

    @property
    def sweep(self) -> ModeSweep:
        """Range and number of amplitudes."""
        asked = self.asked
        return replace(sweep_of(asked), to_gross_slip=asked.to_gross_slip, concept=asked.concept)


def sweep_of(asked: NonlinearModeTable | ModalSynthesisTable) -> ModeSweep:
    """Return range and number of amplitudes of a nonlinear mode from its table."""
    given = asked.amplitude_mm
    return ModeSweep(
        span=None if given is None else (1e-3 * given[0], 1e-3 * given[1]),
        points=asked.points,
        most_harmonics=asked.most_harmonics,
        tolerance=0.01 * asked.accuracy_percent,
    )


def question_of(case: Case, model: Model) -> Question:
    """Return the problem of a job.

    Raises
    ------
    InputError
        If a wave number or mode is unknown, a contact is rigid, no contact slips or opens and no amplitudes are given, or
        the model cannot be assembled.
    """
    asked: NonlinearModeTable = case.settings.nonlinear_mode
    refuse_waves(NAME, asked.wave_numbers, model)
    most = max(asked.harmonics, asked.most_harmonics)
    refuse_whole(NAME, model)
    assembled = free_to_vibrate(model, most, case.store)
    refuse_rigid(NAME, assembled)
    facts, waves = facts_of(model, model.speed / RPM), _waves(asked, model, assembled)
    question = Question(case.label, assembled, asked, case.settings.solver.evaluator, facts, waves)
    question.sweep.require_span(assembled.system.interface, f"{NAME}.amplitude_mm")
    modes = [mode for wave in question.waves for mode in _required(question, wave)]
    require_flow(assembled, modes, most, "a nonlinear mode")
    return question


def _required(question: Question, wave: int) -> list[StuckMode]:
    """Return the modes of a wave to follow; refuse a requested mode that does not exist."""
    modes, wanted = question.followed(wave), question.asked.modes
    missing = sorted(set(wanted) - {m.number for m in modes})
    if missing:
        of = "the model" if wave == NO_WAVE else f"wave {wave}"
        raise no_such_mode(f"{NAME}.modes", f"holds {missing[0]}", of)
    return modes


def _waves(asked: NonlinearModeTable, model: Model, assembled: Assembled) -> tuple[int, ...]:
    if assembled.system.structure.wheel is None:
        return (NO_WAVE,)
    if asked.wave_numbers is not None:
        return tuple(asked.wave_numbers)
    order = model.engine_order
    return tuple(range(model.sectors)) if order is None else (order % model.sectors,)
