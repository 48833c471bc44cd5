"""Effects that a frequency diagram neglects."""

from stickslip.assembly.model import Model
from stickslip.study.verdict import Verdict

FLUID = "the aerodynamic coefficients play no part: frequencies are those in still fluid"
ALIKE = "mistuning plays no part: frequencies are those of the wheel with all sectors alike"


def in_still_fluid(model: Model) -> tuple[Model, tuple[Verdict, ...]]:
    """Return the model of a diagram of tuned waves in still fluid, and what that leaves out."""
    found = []
    if model.aerodynamics is not None:
        remedy = "[modes] has the frequencies in the flow at one speed, [flutter] the damping."
        found.append(Verdict("trusted", why=FLUID, remedy=remedy))
    if model.mistuning is not None:
        remedy = "[modes] has the frequencies of the wheel as it is at one speed."
        found.append(Verdict("trusted", why=ALIKE, remedy=remedy))
    return model.without_aerodynamics(), tuple(found)
