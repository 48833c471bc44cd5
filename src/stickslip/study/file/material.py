"""The tables [material], [damping] and [reduction], of the whole study or of a part."""

from typing import Any, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from stickslip.model.fe.solid import Material
from stickslip.model.readers.units import MODULI, SOLIDS
from stickslip.study.file.quantities import table_of
from stickslip.study.file.section import Positive, Section, custom_error, rising_pair

# what a number may have been meant in, for messages
STRESSES = {"GPa": 1e9, "MPa": 1e6, "kPa": 1e3}
DENSITIES = {"g/cm³": 1e3, "kg/mm³": 1e9, "t/mm³": 1e12}


class _PlausibleMaterial(Section):
    """Checks that numbers are those of a solid."""

    plausible: bool = Field(
        True,
        description="whether stiffness and density are checked against what solids have: true, or false where the numbers are right",
    )

    @field_validator("young_modulus_pa", "density_kg_per_m3", check_fields=False)
    @classmethod
    def _is_of_a_solid(cls, value: float, info: ValidationInfo) -> float:
        """Refuse what no solid has, as the readers of decks do."""
        stiff = info.field_name == "young_modulus_pa"
        (low, high), unit = (MODULI, "Pa") if stiff else (SOLIDS, "kg/m³")
        if low <= value <= high or not info.data.get("plausible", True):
            return value
        meant = [
            f", which is {value * factor:.4g} {unit} if it is in {name}"
            for name, factor in (STRESSES if stiff else DENSITIES).items()
            if low <= value * factor <= high
        ]
        raise custom_error(
            f"no solid has {value:g} {unit}{meant[0] if meant else ''}",
            f"Give a value from {low:g} to {high:g} {unit}, or plausible = false where the number is right.",
        )


MaterialTable: Any = table_of(Material, base=_PlausibleMaterial, name="MaterialTable")


class Reduction(Section):
    """Craig-Bampton reduction of a part: what contacts, loads and outputs need stays physical."""

    fixed_interface_modes: int = Field(
        25,
        ge=1,
        le=500,
        description="number of fixed-interface modes kept beside the static ones, 1 to 500",
    )


class Damping(Section):
    """Structural damping, proportional to mass and stiffness."""

    ratio: float = Field(
        ge=0, lt=1, description="damping ratio at the two frequencies of between_hz, 0 to 1"
    )
    between_hz: list[Positive] = Field(
        min_length=2, max_length=2, description="two frequencies in Hz, the lower first"
    )

    @model_validator(mode="after")
    def _rises(self) -> Self:
        rising_pair(self.between_hz, "between_hz")
        return self
