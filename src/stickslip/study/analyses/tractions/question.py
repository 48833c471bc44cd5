"""The table [residual_tractions] of a study file, and what a job solves."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from pydantic import Field, model_validator

from stickslip.arrays import FloatArray
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.model import Model
from stickslip.contact.compiled import Evaluator
from stickslip.contact.starts import starts_of
from stickslip.errors import InputError, input_error
from stickslip.response.forced.sweep import Sweep
from stickslip.response.parameter import Discretisation
from stickslip.response.residual_tractions.search import TractionSearch
from stickslip.study.analyses.analysis import Case
from stickslip.study.analyses.facts import facts_of
from stickslip.study.analyses.forced.estimate import Estimate, estimate
from stickslip.study.analyses.forced.question import peak_first
from stickslip.study.analyses.vibrating import represented
from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.file.section import Positive, Section, rising_pair
from stickslip.study.models.cost import above
from stickslip.units import HZ, RPM

MOTIONS = (
    20,
    100,
)  # solved at a frequency: where hardly a spring keeps a traction, and where many do
STEPS = 0.5  # Newton steps that one of them takes, over those of a point of a response


class ResidualTractionsTable(Section):
    """How far the response depends on the tractions that sticking contacts have kept from before."""

    frequency_hz: list[Positive] = Field(
        min_length=2,
        max_length=2,
        description="the range [lowest, highest] in which the bounds are computed, Hz; it should hold the resonance",
    )
    points: int = Field(25, ge=3, le=2000, description="frequencies in the range, 3 to 2000")
    harmonics: int = Field(
        5, ge=1, le=HIGHEST, description=f"harmonics of the motions, 1 to {HIGHEST}"
    )
    starts: int = Field(
        4,
        ge=0,
        le=10_000,
        description="random starts of the search at each frequency, beside those that are always taken, 0 to 10000",
    )
    seed: int = Field(0, ge=0, le=2**32 - 1, description="seed of the random starts")
    in_time: bool = Field(
        True,
        description="whether both ends of the resonance are followed in time with the tractions they stand for; a tuned wheel is not",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        rising_pair(self.frequency_hz, "frequency_hz")
        return self


@dataclass(frozen=True, eq=False)
class Question:
    """A case of the analysis.

    Parameters
    ----------
    label
        Of the case.
    model
        Assembled; the first output is the one whose amplitude is bounded.
    asked
        The table.
    evaluator
        Of the contact forces.
    excitation
        Amplitude of the harmonic force, N; NaN for none.
    facts
        What results say of the model.
    """

    label: str
    model: Assembled
    asked: ResidualTractionsTable
    evaluator: Evaluator
    excitation: float
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def omegas(self) -> FloatArray:
        """Frequencies at which bounds are computed, rad/s."""
        first, last = self.asked.frequency_hz
        return np.asarray(HZ * np.linspace(first, last, self.asked.points))

    @property
    def discretisation(self) -> Discretisation:
        """Of the motions."""
        return represented(self.asked.harmonics, self.evaluator)

    @property
    def search(self) -> TractionSearch:
        """How hard extremes are looked for."""
        return TractionSearch(starts=self.asked.starts, seed=self.asked.seed)


def cost_of(model: Model, asked: ResidualTractionsTable) -> Estimate:
    """Return what a case is estimated to cost."""
    first, last = asked.frequency_hz
    sweep = Sweep(
        omega_range=(HZ * first, HZ * last), low=max(asked.harmonics, 1), high=max(asked.harmonics, 1),
        selection="always_high", frequencies=asked.points, points=asked.points, peak_points=0,
    )  # fmt: skip
    once = estimate(model, sweep)
    least, most = MOTIONS
    return replace(
        once,
        least_seconds=STEPS * least * once.least_seconds,
        most_seconds=STEPS * most * once.most_seconds,
    )


def question_of(case: Case, model: Model) -> Question:
    """Return what a job solves.

    Raises
    ------
    InputError
        If a contact has no springs that start somewhere, a load drives more harmonics than are kept, or none, or a force of zero, or the estimated cost
        exceeds the study's limits.
    """
    asked: ResidualTractionsTable = case.settings.residual_tractions
    driven = sorted(set(model.driven.values()))
    if not driven:
        raise input_error(
            "residual_tractions", "nothing vibrates: no load has a harmonic", "Add a harmonic load."
        )
    if driven[-1] > asked.harmonics:
        raise input_error(
            "residual_tractions.harmonics",
            f"is {asked.harmonics}, and a load drives harmonic {driven[-1]}",
            f"Give {driven[-1]} or more.",
        )
    cost = cost_of(model, asked)
    what = f"a case of residual_tractions ({asked.points} frequencies, {cost.unknowns} unknowns, up to {MOTIONS[1]} motions each) is estimated"
    if (refusal := above(case.settings.limits, what, cost.memory_gb, cost.seconds)) is not None:
        raise refusal
    assembled = peak_first(model.assembled(asked.harmonics, case.store))
    if not any(np.any(force) for force in assembled.load.harmonics.values()):
        name = next(iter(model.driven))
        raise input_error(
            f"load.{name}.force_n",
            "is 0 N where it acts: residual_tractions needs a vibration",
            "Give it a force that is not zero.",
        )
    try:
        starts_of(assembled.system.interface)
    except InputError as error:
        raise error.at(f"residual_tractions: {error.place}") from None
    return Question(
        case.label,
        assembled,
        asked,
        case.settings.solver.evaluator,
        float(assembled.excitation),
        facts_of(model, model.speed / RPM),
    )
