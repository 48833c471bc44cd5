"""The problem of a job: the model and its bounds over residual tractions."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.analyses import vibrating
from stickslip.analyses.facts import facts_of
from stickslip.analyses.forced_response.estimate import Estimate, estimate
from stickslip.analyses.forced_response.problem import peak_first
from stickslip.analyses.residual_tractions.table import ResidualTractionsTable
from stickslip.arrays import FloatArray
from stickslip.assembly.assembling import assemble
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.contact.initial_sliders import starts_of
from stickslip.errors import InputError, input_error
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.response.forced.sweep import Sweep
from stickslip.response.residual_tractions.search import TractionSearch
from stickslip.study.analysis import Case
from stickslip.study.models.cost import above
from stickslip.units import HZ, RPM

MOTIONS = (20, 100)  # motions solved at a frequency: if hardly a spring keeps a traction, and if many do
STEPS = 0.5  # Newton steps of such a motion over the steps of a point of a response


@dataclass(frozen=True, eq=False)
class Question(vibrating.Question):
    """A case of the analysis; the first output is bounded.

    Parameters
    ----------
    excitation
        Amplitude of the harmonic force, N; NaN for none.
    """

    asked: ResidualTractionsTable
    excitation: float

    @property
    def omegas(self) -> FloatArray:
        """Frequencies of the bounds, rad/s."""
        first, last = self.asked.frequency_hz
        return np.asarray(HZ * np.linspace(first, last, self.asked.points))

    @property
    def search(self) -> TractionSearch:
        """Effort of the search for extremes."""
        return TractionSearch(starts=self.asked.starts, seed=self.asked.seed)


def cost_of(model: Model, asked: ResidualTractionsTable) -> Estimate:
    """Return the estimated cost of a case."""
    first, last = asked.frequency_hz
    sweep = Sweep(
        omega_range=(HZ * first, HZ * last),
        low=max(asked.harmonics, 1),
        high=max(asked.harmonics, 1),
        selection="always_high",
        frequencies=asked.points,
        points=asked.points,
        peak_points=0,
    )
    once = estimate(model, sweep)
    least, most = MOTIONS
    return replace(
        once, least_seconds=STEPS * least * once.least_seconds, most_seconds=STEPS * most * once.most_seconds
    )


def question_of(case: Case, model: Model) -> Question:
    """Return the problem of a job.

    Raises
    ------
    InputError
        If a contact has no springs with an initial traction, no load vibrates or its force is zero, a load drives a
        harmonic that is not kept, or the estimated cost exceeds the study's limits.
    """
    asked: ResidualTractionsTable = case.settings.residual_tractions
    driven = sorted(set(model.driven.values()))
    if not driven:
        raise input_error("residual_tractions", "nothing vibrates: no load has a harmonic", "Add a harmonic load.")
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
    refuse_whole("residual_tractions", model)
    assembled = peak_first(assemble(model, JUDGED_MULTIPLE * asked.harmonics, case.store))
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
    facts, excitation = facts_of(model, model.speed / RPM), float(assembled.excitation)
    return Question(case.label, assembled, asked, case.settings.solver.evaluator, facts, excitation)
