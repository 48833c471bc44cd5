"""The tables [material], [damping] and [reduction], of the whole study or of a part."""

from collections.abc import Callable
from dataclasses import is_dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, WrapValidator, field_validator, model_validator

from stickslip.model.damping import Damping
from stickslip.model.fe.material import Material
from stickslip.model.readers.units import MODULI, SOLIDS
from stickslip.reduction.choice import Reduction
from stickslip.reduction.truncation import FrequencyError, ModeChoice, ModesBelow
from stickslip.study.file.quantities import table_of
from stickslip.study.file.section import Positive, Section, custom_error, own_object, rising_pair
from stickslip.study.own_code import is_address

FEW = 25  # default number of fixed-interface modes
OWN_MODES = {"craig_bampton": "fixed_interface_modes", "rubin": "free_interface_modes"}
MODES_OF = tuple(OWN_MODES.values())
# units in which a number may have been meant, for messages
STRESSES = {"GPa": 1e9, "MPa": 1e6, "kPa": 1e3}
DENSITIES = {"g/cm³": 1e3, "kg/mm³": 1e9, "t/mm³": 1e12}


class _PlausibleMaterial(Section):
    """Checks that the numbers are plausible for a solid."""

    plausible: bool = Field(
        True,
        description="whether stiffness and density are checked against what solids have: true, or false where the numbers are right",
    )

    @field_validator("young_modulus_pa", "density_kg_per_m3", check_fields=False)
    @classmethod
    def _is_of_a_solid(cls, value: float, info: ValidationInfo) -> float:
        """Refuse a value that no solid has, as the readers of decks do."""
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


def _named_or_own(given: Any, check: Callable[[Any], Any], info: ValidationInfo) -> Any:
    """Check a name, or a module path."""
    if not is_address(given):
        return check(given)
    found = own_object(info, given, "reduction", ("of", "in_words"), instance=True)
    if not is_dataclass(found):
        raise custom_error(
            f"is a {type(found).__name__}, which is no dataclass, got {given!r}",
            "Make it one: parts are kept by its parameters.",
        )
    return given


class ReductionTable(Section):
    """Reduction of a part: dofs of contacts, loads and outputs stay physical, the others are replaced by a few modes."""

    method: Annotated[Literal["craig_bampton", "rubin", "none"], WrapValidator(_named_or_own)] = Field(
        "craig_bampton",
        description="craig_bampton (modes with the physical dofs fixed), rubin (with them free; exact free modes), or none: the part "
        "is kept whole; where more than 5000 dofs touch no contact nothing is condensed either; [forced_response], [modes] and "
        "[campbell] take such a model, without stability and time integration; or my_module:Name, a reduction of your own, with "
        "--allow-code",
    )
    fixed_interface_modes: Annotated[int, Field(ge=1, le=500)] | None = Field(
        None,
        description=f"number of modes that craig_bampton keeps, 1 to 500; left out: {FEW}. A part with fewer keeps all",
    )
    free_interface_modes: Annotated[int, Field(ge=1, le=500)] | None = Field(
        None, description="of rubin: number of modes kept, rigid motions among them, 1 to 500"
    )
    up_to_hz: Positive | None = Field(
        None,
        description="instead of a number: highest frequency in Hz that the reduced part is meant for; modes below factor times that "
        "are kept",
    )
    factor: Annotated[float, Field(ge=1, le=20)] | None = Field(
        None, description="factor on up_to_hz up to which modes are kept, 1 to 20; left out: 1.5"
    )
    frequency_error: Annotated[float, Field(gt=0, lt=0.5)] | None = Field(
        None,
        description="of craig_bampton, with up_to_hz and instead of factor: as many modes as it takes for the part's natural "
        "frequencies to be right to this share, such as 1e-4",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        own = OWN_MODES.get(self.method)
        for key in MODES_OF:
            if key != own and getattr(self, key) is not None:
                raise _not_of(self.method, key)
        if self.method != "craig_bampton" and self.frequency_error is not None:
            raise _not_of(self.method, "frequency_error")
        if self.up_to_hz is not None and (self.method == "none" or is_address(self.method)):
            raise _not_of(self.method, "up_to_hz")
        if own is not None and self.up_to_hz is not None and getattr(self, own) is not None:
            raise custom_error(f"is given together with {own}", "Give a number of modes or a frequency.", "up_to_hz")
        for key in ("factor", "frequency_error"):
            if getattr(self, key) is not None and self.up_to_hz is None:
                raise custom_error("goes together with up_to_hz", "Give the highest frequency of interest.", key)
        if self.factor is not None and self.frequency_error is not None:
            raise custom_error(
                "is given together with factor",
                "Give one: the error decides how many modes are kept.",
                "frequency_error",
            )
        if self.method == "rubin" and self.free_interface_modes is None and self.up_to_hz is None:
            raise custom_error("is missing with rubin", "Give a number of modes, or up_to_hz.", "free_interface_modes")
        return self

    def library(self) -> Reduction | None:
        """Return the reduction; None for none. A user's reduction is made together with the parts."""
        if self.method == "none":
            return None
        return Reduction(self._n_modes(), self.method)

    def _n_modes(self) -> ModeChoice:
        if self.up_to_hz is None:
            return getattr(self, OWN_MODES[self.method]) or FEW
        if self.frequency_error is not None:
            return FrequencyError(self.frequency_error, self.up_to_hz)
        return ModesBelow(self.up_to_hz, self.factor or 1.5)


class StudyReduction(ReductionTable):
    """Reduction of all parts without a reduction of their own, and of joined surfaces."""

    interface_modes: Annotated[int, Field(ge=1, le=2000)] | None = Field(
        None,
        description="number of characteristic shapes that replace the nodes of joined surfaces in the forced response of a single structure, 1 to 2000. Nodes of contacts, loads and outputs stay; left out: all nodes stay",
    )


def _not_of(method: str, key: str) -> Exception:
    return custom_error(f"is no key of the method {method}", "Remove it, or choose the method that has it.", key)


class DampingTable(Section):
    """Damping of a part: ratio and between_hz, or alpha_per_s and beta_s, or modal_ratio, or modal_ratios; and a loss factor."""

    ratio: Annotated[float, Field(ge=0, lt=1)] | None = Field(
        None, description="damping ratio at the two frequencies of between_hz, from 0 to below 1 (0.01 is 1 %)"
    )
    between_hz: list[Positive] | None = Field(
        None, min_length=2, max_length=2, description="two frequencies in Hz, the lower first"
    )
    alpha_per_s: float | None = Field(
        None, ge=0, le=1e6, description="damping proportional to the mass: C = α M + β K, α in 1/s"
    )
    beta_s: float | None = Field(None, ge=0, le=1, description="damping proportional to the stiffness: β in s")
    modal_ratio: Annotated[float, Field(ge=0, lt=1)] | None = Field(
        None, description="one damping ratio of all modes of the part by itself, its contacts open, 0 to 1"
    )
    modal_ratios: list[Annotated[float, Field(ge=0, lt=1)]] | None = Field(
        None,
        min_length=1,
        max_length=500,
        description="damping ratios of these modes, lowest first, 0 to 1 each; higher modes are not damped",
    )
    loss_factor: Annotated[float, Field(ge=0, lt=1)] | None = Field(
        None,
        description="loss factor η of the material, stiffness K (1 + i η), twice the damping ratio of a resonance, 0 to 1; alone or "
        "beside another form",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        rising_pair(self.between_hz or [], "between_hz")
        if (self.ratio is None) != (self.between_hz is None):
            raise custom_error(
                "is missing, the other of ratio and between_hz is given",
                "A ratio holds at two frequencies; one of all modes is modal_ratio.",
                "between_hz" if self.between_hz is None else "ratio",
            )
        forms = [
            self.ratio is not None,
            self.alpha_per_s is not None or self.beta_s is not None,
            self.modal_ratio is not None,
            self.modal_ratios is not None,
        ]
        if sum(forms) > 1 or (not any(forms) and self.loss_factor is None):
            found = "several forms" if any(forms) else "no number"
            raise custom_error(
                f"is given in {found}",
                "Give ratio and between_hz, or alpha_per_s and beta_s, or modal_ratio, or modal_ratios; or loss_factor.",
            )
        return self

    def library(self) -> Damping:
        """Return the damping."""
        low, high = self.between_hz or (0.0, 0.0)
        return Damping(
            ratio=self.ratio,
            between_hz=None if self.between_hz is None else (low, high),
            alpha=self.alpha_per_s or 0.0,
            beta=self.beta_s or 0.0,
            modal=self.modal_ratio if self.modal_ratios is None else tuple(self.modal_ratios),
            loss_factor=self.loss_factor or 0.0,
        )
