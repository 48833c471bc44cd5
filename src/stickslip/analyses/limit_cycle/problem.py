"""The problem of a job: model, waves, modes, and the choice of unstable ones."""

from collections.abc import Sequence
from dataclasses import dataclass

from stickslip.analyses import vibrating
from stickslip.analyses.facts import facts_of
from stickslip.analyses.limit_cycle.table import MODES, LimitCycleTable
from stickslip.analyses.vibrating import (
    free_to_vibrate,
    modes_of,
    refuse_rigid,
    refuse_waves,
    require_flow,
)
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.errors import input_error
from stickslip.reduction.waves import NO_WAVE
from stickslip.response.self_excited.modes import StuckMode
from stickslip.study.analysis import Case
from stickslip.units import RPM

IN_TIME = "verify"


@dataclass(frozen=True, eq=False)
class Question(vibrating.Question):
    """A case of the analysis, whose model has no harmonic loads.

    Parameters
    ----------
    in_time
        Whether limit cycles are compared with time integration.
    """

    asked: LimitCycleTable
    in_time: bool

    @property
    def waves(self) -> tuple[int, ...]:
        """Wave numbers to examine; only `NO_WAVE` for a single structure."""
        if self.model.system.structure.wheel is None:
            return (NO_WAVE,)
        if self.asked.wave_numbers is not None:
            return tuple(self.asked.wave_numbers)
        return tuple(range(self.model.sectors))

    def modes(self, wave: int) -> list[StuckMode]:
        """Return the modes of a wave to examine, with contacts stuck."""
        blades = self.model.blades
        every = MODES if blades is None else MODES * blades.sectors
        count = max([every, *(self.asked.modes or [])])
        return modes_of(self.model, count, wave)

    def followed(self, modes: list[StuckMode]) -> list[StuckMode]:
        """Return the modes to follow over amplitude: the requested ones, or else the unstable ones."""
        if self.asked.modes is not None:
            return [m for m in modes if m.number in self.asked.modes]
        named = self.asked.wave_numbers is not None and not any(m.unstable for m in modes)
        return modes[:1] if named else [m for m in modes if m.unstable]


def question_of(case: Case, model: Model) -> Question:
    """Return the problem of a job.

    Raises
    ------
    InputError
        If the wheel lacks a wave number, or the model cannot be assembled.
    """
    asked: LimitCycleTable = case.settings.limit_cycle
    refuse_waves("limit_cycle", asked.wave_numbers, model)
    most = max(asked.harmonics, asked.most_harmonics)
    refuse_whole("limit_cycle", model)
    assembled = free_to_vibrate(model, most, case.store)
    refuse_rigid("limit_cycle", assembled)
    in_time = asked.in_time or IN_TIME in case.checks
    facts = facts_of(model, model.speed / RPM)
    question = Question(case.label, assembled, asked, case.settings.solver.evaluator, facts, in_time)
    force = assembled.system.structure.feedback_of(1)
    if asked.modes is None and (force is None or not force.influence.refuses):
        return question
    modes = [question.modes(wave) for wave in question.waves]
    _refuse_modes(asked, modes)
    followed = [mode for own in modes for mode in question.followed(own)]
    require_flow(assembled, followed, most, "a limit cycle")
    return question


def _refuse_modes(asked: LimitCycleTable, modes: Sequence[Sequence[StuckMode]]) -> None:
    """Refuse mode numbers above the number of modes of all examined waves."""
    most = max((mode.number for own in modes for mode in own), default=0)
    wanted = max(asked.modes or [0])
    if wanted > most:
        raise input_error(
            "limit_cycle.modes",
            f"holds {wanted}, and what is looked at has {most} modes",
            "Name others, or leave it out: then the unstable ones are followed.",
        )
