"""Laws whose sliders stay where a static state has left them."""

from dataclasses import replace

from stickslip.arrays import FloatArray
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import input_error

OneSlider = ElasticCoulomb | CoupledCoulomb  # under the normal force, with a place to start from


def freezable(name: str, law: ContactLaw) -> bool:
    """Return whether a law has a slider that a static state can leave somewhere; of springs nothing is to be frozen.

    Parameters
    ----------
    name
        Of the contact, for messages.
    law
        Its law.

    Raises
    ------
    InputError
        If the law remembers more than the place of one slider, or says itself where that starts.
    """
    if isinstance(law, OneSlider):
        if isinstance(law, ElasticCoulomb) and law.residual_traction is not None:
            raise input_error(
                f"contact {name}",
                "has a residual traction, and its slider is to start from the static state",
                "Leave one of them out.",
            )
        return True
    springs = isinstance(law, Bonded | UnilateralSpring)
    if isinstance(law, RigidCoulomb) or (not springs and law.initial_state().size):
        raise input_error(
            f"contact {name}",
            f"is {type(law).__name__}, which has no single slider under the normal force that a static state could leave somewhere",
            "Take ElasticCoulomb or CoupledCoulomb, or leave the sliders where they start.",
        )
    return False


def sharing_friction(law: ContactLaw, share: float) -> ContactLaw:
    """Return a law with a share of its friction coefficient, its springs unstretched at zero displacement; springs as they are."""
    return replace(law, mu=share * law.mu, slider=None) if isinstance(law, OneSlider) else law


def left_behind(law: ContactLaw, gap: FloatArray, force: FloatArray) -> ContactLaw:
    """Return a law whose slider starts where a spring with the `force` (3,) at the `gap` (3,) holds it; springs as they are."""
    if not isinstance(law, OneSlider):
        return law
    k = law.stuck_stiffness()
    places = [float(gap[d] - force[d] / k[d]) if k[d] > 0.0 else 0.0 for d in range(2)]
    return replace(law, slider=(places[0], places[1]))
