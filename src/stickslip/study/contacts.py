"""The tables [contact.flat] and [contact.curved], and the contact laws they become."""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from stickslip.contact.law import ContactLaw
from stickslip.contact.laws import LAWS
from stickslip.study.messages import custom_error, shown
from stickslip.study.sections import Positive, Section

LawName = Literal[
    "elastic_coulomb", "coupled_coulomb", "jenkins", "iwan", "unilateral_spring", "bonded"
]
NORMAL, TANGENTIAL, AXIAL = (
    "normal_stiffness_n_per_m",
    "tangential_stiffness_n_per_m",
    "axial_stiffness_n_per_m",
)
FRICTION, SLIP = "friction_coefficient", "slip_limit_n"
NEEDS: dict[LawName, tuple[str, ...]] = {
    "elastic_coulomb": (NORMAL, TANGENTIAL, AXIAL, FRICTION),
    "coupled_coulomb": (NORMAL, TANGENTIAL, FRICTION),
    "jenkins": (NORMAL, TANGENTIAL, AXIAL, SLIP),
    "iwan": (NORMAL, TANGENTIAL, AXIAL, SLIP),
    "unilateral_spring": (NORMAL,),
    "bonded": (NORMAL, TANGENTIAL, AXIAL),
}
SHARED = {NORMAL: "k_n", TANGENTIAL: "k_t", AXIAL: "k_w", SLIP: "limit"}  # among the points
EACH = {FRICTION: "mu"}  # the same at every point


class ContactSide(Section):
    """One side of the damper; stiffnesses and slip limit of the whole interface, shared among its contact points."""

    law: LawName = Field(
        description="the contact law: elastic_coulomb (two Jenkins springs under a unilateral normal spring), coupled_coulomb "
        "(the same with one spring in the contact plane), jenkins (constant slip limit), iwan (20 Jenkins springs that slip one "
        "after the other), unilateral_spring (no friction) or bonded; the normal spring of jenkins, iwan and bonded also pulls"
    )
    normal_stiffness_n_per_m: Positive = Field(
        description="normal stiffness of the whole interface in N/m, greater than zero: nothing else holds the damper"
    )
    tangential_stiffness_n_per_m: Positive | None = Field(
        None,
        validate_default=True,
        description="stiffness in the section's plane (coupled_coulomb: in every direction of the contact plane) of the whole "
        "interface in N/m, greater than zero",
    )
    axial_stiffness_n_per_m: Positive | None = Field(
        None,
        validate_default=True,
        description="stiffness along the damper's axis of the whole interface in N/m, greater than zero",
    )
    friction_coefficient: Annotated[float, Field(ge=0, le=5)] | None = Field(
        None,
        validate_default=True,
        description="friction coefficient, 0 to 5 (steel on steel: 0.6)",
    )
    slip_limit_n: Positive | None = Field(
        None,
        validate_default=True,
        description="friction force in N at which the whole interface has slipped, along either tangent, greater than zero",
    )

    @field_validator(TANGENTIAL, AXIAL, FRICTION, SLIP)
    @classmethod
    def _is_of_the_law(cls, value: float | None, info: ValidationInfo) -> float | None:
        law, key = info.data.get("law"), str(info.field_name)
        if law is None:  # unknown, which is told already
            return value
        needed = key in NEEDS[law]
        if needed and value is None:
            about = cls.model_fields[key].description
            raise custom_error(f"is missing, the law {law} needs it", f"Add it: {about}.")
        if not needed and value is not None:
            having = ", ".join(name for name, keys in NEEDS.items() if key in keys)
            raise custom_error(
                f"is no parameter of the law {law}, got {shown(value)}",
                f"Remove it, or choose a law that has it: {having}.",
            )
        return value

    def library(self, points: int) -> ContactLaw:
        """Return the law of each of the `points` contact points of the side."""
        share = 1.0 / points
        given = {
            field: share * getattr(self, key) for key, field in SHARED.items() if self._has(key)
        }
        given |= {field: getattr(self, key) for key, field in EACH.items() if self._has(key)}
        law: ContactLaw = LAWS[self.law](**given)
        return law

    def _has(self, key: str) -> bool:
        return getattr(self, key) is not None


class Contact(Section):
    """The two sides of the damper."""

    flat: ContactSide = Field(description="the table [contact.flat]")
    curved: ContactSide = Field(description="the table [contact.curved]")

    def of_side(self, side: str) -> ContactSide:
        """Return the table of the side ``flat`` or ``curved``."""
        return {"flat": self.flat, "curved": self.curved}[side]
