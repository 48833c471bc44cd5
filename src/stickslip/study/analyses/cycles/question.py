"""What a job solves: the model, the waves and modes that are asked for, and those that grow by themselves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stickslip.arrays import BoolArray
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.model import Model
from stickslip.contact.compiled import Evaluator
from stickslip.errors import input_error
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.at_rest import pressed_by
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import StuckMode, stuck_modes
from stickslip.response.self_excited.problem import SAMPLES_A_HARMONIC
from stickslip.response.system import System
from stickslip.study.analyses.analysis import Case
from stickslip.study.analyses.cycles.table import MODES, LimitCycleTable
from stickslip.study.analyses.facts import facts_of
from stickslip.study.analyses.forced.question import peak_first
from stickslip.units import RPM

IN_TIME = "verify"
ONE = -1  # wave number of a single structure
SAMPLES = 256


@dataclass(frozen=True, eq=False)
class Question:
    """A case of the analysis.

    Parameters
    ----------
    label
        Of the case.
    model
        Assembled, without harmonic loads, a wheel with all its waves; the first output is the one whose amplitude is given.
    asked
        The table.
    evaluator
        Of the contact forces.
    in_time
        Whether motions in time are compared.
    facts
        What results say of the model.
    """

    label: str
    model: Assembled
    asked: LimitCycleTable
    evaluator: Evaluator
    in_time: bool
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def waves(self) -> tuple[int, ...]:
        """Wave numbers that are looked at; one of `ONE` for a single structure."""
        if not isinstance(self.model.system.structure, TunedWheel):
            return (ONE,)
        if self.asked.wave_numbers is not None:
            return tuple(self.asked.wave_numbers)
        return tuple(range(self.model.sectors))

    def system(self, wave: int) -> System:
        """Return the system that vibrates as a wave."""
        side = self.model.system.structure
        if not isinstance(side, TunedWheel):
            return self.model.system
        return replace(self.model.system, structure=side.travelling_as(wave))

    @property
    def holds(self) -> BoolArray:
        """(p,) contact points that stick under the static loads."""
        return pressed_by(self.model.system.springs.laws, self.model.static_force)

    def modes(self, wave: int) -> list[StuckMode]:
        """Return the modes of a wave that are looked at."""
        blades = self.model.blades
        every = MODES if blades is None else MODES * blades.sectors
        count = max([every, *(self.asked.modes or [])])
        return stuck_modes(self.system(wave), count, self.holds)

    def followed(self, modes: list[StuckMode]) -> list[StuckMode]:
        """Return those of some modes of a wave whose amplitude is followed: those that are named, or that grow."""
        if self.asked.modes is not None:
            return [m for m in modes if m.number in self.asked.modes]
        named = self.asked.wave_numbers is not None and not any(m.unstable for m in modes)
        return modes[:1] if named else [m for m in modes if m.unstable]

    @property
    def discretisation(self) -> Discretisation:
        """Of the curve over the amplitude."""
        order = self.asked.harmonics
        samples = max(SAMPLES, SAMPLES_A_HARMONIC * order)
        return Discretisation(order=order, samples=samples, evaluator=self.evaluator)


def question_of(case: Case, model: Model) -> Question:
    """Return what a job solves.

    Raises
    ------
    InputError
        If a wave number is none of the wheel, or the model cannot be assembled.
    """
    asked: LimitCycleTable = case.settings.limit_cycle
    refuse_waves("limit_cycle", asked.wave_numbers, model)
    most = max(asked.harmonics, asked.most_harmonics)
    still = model.undriven
    wheel = still.sectors > 1 and still.mistuning is None
    assembled = still.assembled(
        most, case.store, wave_number=0 if wheel else None, every_wave=wheel
    )
    if assembled.system.interface.rigid:
        raise input_error(
            "limit_cycle",
            "a contact is rigid: its force is no function of the gap",
            "Give the contacts a stiffness, such as elastic_coulomb.",
        )
    question = Question(
        case.label,
        peak_first(assembled),
        asked,
        case.settings.solver.evaluator,
        asked.in_time or IN_TIME in case.checks,
        facts_of(model, model.speed / RPM),
    )
    force = question.model.system.structure.feedback_of(1)
    table = None if force is None or not force.influence.refuses else force.influence
    if asked.modes is None and table is None:
        return question
    modes = [question.modes(wave) for wave in question.waves]
    _refuse_modes(asked, modes)
    followed = [mode.omega for own in modes for mode in question.followed(own)]
    if table is not None and followed:
        what = f"a limit cycle with up to {most} harmonics (most_harmonics)"
        table.require(min(followed), most * max(followed), what)
    return question


def _refuse_modes(asked: LimitCycleTable, modes: Sequence[Sequence[StuckMode]]) -> None:
    """Refuse numbers of modes that no wave has that is looked at."""
    most = max((mode.number for own in modes for mode in own), default=0)
    wanted = max(asked.modes or [0])
    if wanted > most:
        raise input_error(
            "limit_cycle.modes",
            f"holds {wanted}, and what is looked at has {most} modes",
            "Name others, or leave it out: then the unstable ones are followed.",
        )


def refuse_waves(analysis: str, wanted: Sequence[int] | None, model: Model) -> None:
    """Refuse wave numbers of a model that is no tuned wheel, and those that it does not have."""
    if wanted is None:
        return
    if model.sectors == 1 or model.mistuning is not None:
        raise input_error(
            f"{analysis}.wave_numbers",
            "are those of a tuned wheel, and the model is none",
            "Leave them out.",
        )
    beyond = [k for k in wanted if k >= model.sectors]
    if beyond:
        raise input_error(
            f"{analysis}.wave_numbers",
            f"holds {beyond[0]}, and {model.sectors} sectors have the waves 0 to {model.sectors - 1}",
            f"A backward wave of d nodal diameters is d, a forward one {model.sectors} - d.",
        )


def coordinate(system: System) -> int:
    """Return the coordinate whose amplitude is given: that of the first output."""
    return int(np.asarray(system.outputs)[0])
