"""What a job solves: the model at rest, its waves, and the modes that are followed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stickslip.assembly.assembled import Assembled
from stickslip.assembly.model import Model
from stickslip.contact.compiled import Evaluator
from stickslip.errors import input_error
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.at_rest import pressed_by
from stickslip.response.nonlinear_modes.backbone import ModeSweep
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import StuckMode, stuck_modes
from stickslip.response.self_excited.problem import SAMPLES_A_HARMONIC
from stickslip.response.system import System
from stickslip.study.analyses.analysis import Case
from stickslip.study.analyses.backbones.table import NonlinearModeTable
from stickslip.study.analyses.cycles.question import ONE, SAMPLES, refuse_waves
from stickslip.study.analyses.facts import facts_of
from stickslip.study.analyses.forced.question import peak_first
from stickslip.units import RPM

NAME = "nonlinear_mode"


@dataclass(frozen=True, eq=False)
class Question:
    """A case of the analysis.

    Parameters
    ----------
    label
        Of the case.
    model
        Assembled, without harmonic loads, a wheel with all its waves; the first output is the one whose amplitude is told.
    asked
        The table.
    waves
        Wave numbers that are looked at; one of `ONE` for a single structure.
    evaluator
        Of the contact forces.
    facts
        What results say of the model.
    """

    label: str
    model: Assembled
    asked: NonlinearModeTable
    waves: tuple[int, ...]
    evaluator: Evaluator
    facts: Mapping[str, Any] = field(default_factory=dict)

    def system(self, wave: int) -> System:
        """Return the system that vibrates as a wave."""
        side = self.model.system.structure
        if not isinstance(side, TunedWheel):
            return self.model.system
        return replace(self.model.system, structure=side.travelling_as(wave))

    def followed(self, wave: int) -> list[StuckMode]:
        """Return the modes of a wave that are followed."""
        holds = pressed_by(self.model.system.springs.laws, self.model.static_force)
        every = stuck_modes(self.system(wave), max(self.asked.modes), holds)
        return [m for m in every if m.number in self.asked.modes]

    @property
    def dof(self) -> int:
        """The coordinate of the first output."""
        return int(np.asarray(self.model.system.outputs)[0])

    @property
    def discretisation(self) -> Discretisation:
        """With the fewest harmonics."""
        order = self.asked.harmonics
        samples = max(SAMPLES, SAMPLES_A_HARMONIC * order)
        return Discretisation(order=order, samples=samples, evaluator=self.evaluator)

    @property
    def sweep(self) -> ModeSweep:
        """Over which amplitudes."""
        asked, given = self.asked, self.asked.amplitude_mm
        return ModeSweep(
            span=None if given is None else (1e-3 * given[0], 1e-3 * given[1]),
            points=asked.points,
            most_harmonics=asked.most_harmonics,
            tolerance=0.01 * asked.accuracy_percent,
            to_gross_slip=asked.to_gross_slip,
            concept=asked.concept,
        )


def question_of(case: Case, model: Model) -> Question:
    """Return what a job solves.

    Raises
    ------
    InputError
        If a wave number is none of the wheel, a mode is none of a wave, a contact is rigid, no contact slips or opens and there are no amplitudes, or the model
        cannot be assembled.
    """
    asked: NonlinearModeTable = case.settings.nonlinear_mode
    refuse_waves(NAME, asked.wave_numbers, model)
    most = max(asked.harmonics, asked.most_harmonics)
    still = model.undriven
    wheel = still.sectors > 1 and still.mistuning is None
    assembled = still.assembled(
        most, case.store, wave_number=0 if wheel else None, every_wave=wheel
    )
    if assembled.system.interface.rigid:
        raise input_error(
            NAME,
            "a contact is rigid: its force is no function of its gap",
            "Give the contacts a stiffness, such as elastic_coulomb.",
        )
    question = Question(
        case.label,
        peak_first(assembled),
        asked,
        _waves(asked, model, wheel=wheel),
        case.settings.solver.evaluator,
        facts_of(model, model.speed / RPM),
    )
    question.sweep.require_span(assembled.system.interface, f"{NAME}.amplitude_mm")
    modes = [mode for wave in question.waves for mode in _required(question, wave)]
    force = question.model.system.structure.feedback_of(1)
    if force is not None and force.influence.refuses and modes:
        low, high = (f(m.omega for m in modes) for f in (min, max))
        force.influence.require(low, most * high, f"a nonlinear mode with up to {most} harmonics (most_harmonics)")  # fmt: skip
    return question


def _required(question: Question, wave: int) -> list[StuckMode]:
    """Return the modes of a wave that are followed, all that are asked for."""
    modes, wanted = question.followed(wave), question.asked.modes
    missing = sorted(set(wanted) - {m.number for m in modes})
    if missing:
        of = "the model" if wave == ONE else f"wave {wave}"
        raise input_error(
            f"{NAME}.modes",
            f"holds {missing[0]}, and {of} has no such mode that vibrates",
            "Modes count from 1 by frequency with contacts stuck; [modes] lists them.",
        )
    return modes


def _waves(asked: NonlinearModeTable, model: Model, *, wheel: bool) -> tuple[int, ...]:
    if not wheel:
        return (ONE,)
    if asked.wave_numbers is not None:
        return tuple(asked.wave_numbers)
    order = model.engine_order
    return tuple(range(model.sectors)) if order is None else (order % model.sectors,)
