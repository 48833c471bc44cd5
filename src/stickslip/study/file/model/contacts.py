"""The tables [contact.NAME] and [join.NAME]; the keys of a law are the fields of its dataclass."""

from collections.abc import Callable
from functools import cache
from inspect import signature
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BeforeValidator,
    Field,
    ValidationInfo,
    WrapValidator,
    create_model,
    field_validator,
    model_validator,
)

from stickslip.assembly.contact import GROUND, NEXT, SPATIAL, PairingKind, Share
from stickslip.contact.law import MEMBERS, ContactLaw
from stickslip.contact.laws import ALL_LAWS
from stickslip.contact.laws.iwan import FirstLoading, FourParameter, UniformBand
from stickslip.errors import InputError, did_you_mean
from stickslip.study.file.model.bodies import Direction
from stickslip.study.file.model.parts import union_of
from stickslip.study.file.quantities import build, columns_of, refused_by, table_of
from stickslip.study.file.section import Name, Positive, Section, custom_error, own_object, shown
from stickslip.study.own_code import is_address
from stickslip.study.questions import loaded

POPULATIONS: dict[str, type] = {
    "uniform_band": UniformBand,
    "four_parameter": FourParameter,
    "first_loading": FirstLoading,
}  # distributions of the sliders of the law iwan
_TABLES = {
    name: table_of(cls, name=cls.__name__, kind=(Literal[name], Field(description=f'kind = "{name}"')))
    for name, cls in POPULATIONS.items()
}


def _kind(given: Any) -> str | None:
    return given.get("kind") if isinstance(given, dict) else getattr(given, "kind", None)


def _known_kind(given: Any) -> Any:
    kind = _kind(given)
    if isinstance(given, dict) and kind not in POPULATIONS:
        raise custom_error(f"is not known, got {shown(kind)}", did_you_mean(str(kind), list(POPULATIONS)), "kind")
    return given


PopulationTable: Any = Annotated[union_of(_TABLES, _kind), BeforeValidator(_known_kind)]


def _named_or_own(given: Any, check: Callable[[Any], Any], info: ValidationInfo) -> Any:
    """Check a name, or a module path."""
    if not is_address(given):
        return check(given)
    own_object(info, given, "contact law", MEMBERS)
    return given


Law: Any = Annotated[Literal[tuple(ALL_LAWS)], WrapValidator(_named_or_own)]
Between = Annotated[list[Name], Field(min_length=2, max_length=2)]


class Pair(Section):
    """Two surfaces that meet."""

    between: Between = Field(
        description='the two surfaces: "part.surface" (a node set, a dof, a surface of a body), then "part.surface", '
        '"next.part.surface" (of the neighbouring sector) or "ground"'
    )
    tolerance_m: Positive | None = Field(
        None,
        description="distance of partners node to node, reach of a segment, in m; a node may stand a tenth of it beyond the rim of a segment; left out: as the pairing has it, and nothing beyond the rim",
    )

    @field_validator("between")
    @classmethod
    def _are_surfaces(cls, given: list[str]) -> list[str]:
        first, second = given
        if set(given) == {GROUND}:
            raise custom_error("are both the ground", "Name a place of a part first.")
        if first == GROUND or first.startswith(NEXT):
            raise custom_error(
                f"begins with {first!r}, but the first surface gives the points and their normal",
                f"Give {[second, first]}.",
            )
        for name in given:
            if name != GROUND and "." not in name.removeprefix(NEXT):
                raise custom_error(f"{name!r} is no surface", 'Name part and surface, such as "blade.tip".')
        return given


class JoinTable(Pair):
    """Two surfaces that are tied permanently: the first follows the second."""

    pairing: PairingKind | Literal["spatial_harmonics"] = Field(
        "node_to_segment",
        description="how points find their partners: node_to_node, node_to_segment or segment_to_segment; or spatial_harmonics, for the "
        "flanges of wheels of different numbers of sectors",
    )
    harmonics: list[Annotated[int, Field(ge=0, le=1000)]] | None = Field(
        None,
        min_length=1,
        max_length=501,
        description="with spatial_harmonics: the harmonics of the circumference that are coupled, whole numbers from 0 on",
    )

    @model_validator(mode="after")
    def _has_its_harmonics(self) -> Self:
        if (self.harmonics is None) == (self.pairing == SPATIAL):
            raise custom_error(
                f"belong to pairing = {SPATIAL!r}, which needs them",
                f'Give harmonics = [0, 1, 2] with pairing = "{SPATIAL}", and with it alone.',
                "harmonics",
            )
        return self


class ContactBase(Pair):
    """Two surfaces that may stick, slip and lift off."""

    pairing: PairingKind = Field(
        "node_to_node",
        description="how points find their partners: node_to_node, node_to_segment or segment_to_segment",
    )
    tangent: Direction | None = Field(
        None,
        description='direction "x", "-z" or [x, y, z] whose part in the contact plane is the tangent t; left out: the surface\'s, allowed where the law is the same along t and w',
    )
    normal: Direction | None = Field(
        None,
        description='direction "x", "-z" or [x, y, z] out of the first surface if its nodes span no facet, such as the tip of a beam; left out: the surface normals',
    )
    acts: Literal["tangential", "normal"] | None = Field(
        None,
        description="for single dofs, which have no normal: whether their motion is tangential or normal to the contact",
    )
    gap_m: float = Field(0.0, ge=0, le=10, description="clearance at rest in m, 0 for none")
    interference_m: float = Field(
        0.0,
        ge=0,
        le=1,
        description="how far the surfaces would overlap at rest if nothing gave way, in m, 0 for none: it presses them "
        "by the normal stiffness times itself",
    )
    law: Law = Field(
        description=f"the contact law: {', '.join(ALL_LAWS)}; or my_module:Class, a law of your own, with --allow-code"
    )
    per: Share = Field(
        "interface",
        description="what stiffnesses and forces are of: interface (shared among its points), point, or area (N/m³ and Pa)",
    )
    parameters: dict[str, Any] | None = Field(
        None,
        description="of a law of your own: its parameters by their names in Python, in SI, such as { k_t = 2e4, limit = 5.0 }",
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        keys = ("gap_m", "interference_m", self._preload_key)
        given = [key for key in keys if getattr(self, key)]
        if len(given) > 1:
            raise custom_error(
                f"is given together with {given[0]}",
                "A contact at rest is open, pressed by what overlaps, or pressed by a force: give one of them.",
                given[1],
            )
        if self.parameters is not None and not is_address(self.law):
            raise custom_error(
                f"is of a law of your own, and law is {self.law!r}",
                f"Write the keys of {self.law} into the table of the contact.",
                "parameters",
            )
        refused_by(law_class(self.law), self.library)
        return self

    @property
    def _preload_key(self) -> str:
        return "preload_pa" if self.per == "area" else "preload_n"

    @property
    def gap(self) -> float:
        """Clearance at rest, m; negative for an interference."""
        return self.gap_m - self.interference_m

    @property
    def preload(self) -> float:
        """Normal force at rest, N, or pressure, Pa, depending on `per`."""
        return float(getattr(self, self._preload_key) or 0.0)

    def library(self) -> ContactLaw:
        """Return the law with the given parameters."""
        if is_address(self.law):
            return _own_law(self.law, self.parameters or {})
        table = getattr(self, "population", None)
        given = {} if table is None else {"population": build(POPULATIONS[table.kind], table)}
        law: ContactLaw = build(ALL_LAWS[self.law], self, per_area=self.per == "area", **given)
        return law


def law_class(law: str) -> type:
    """Return the class of a law by its name or module path."""
    found: type = loaded(law) if is_address(law) else ALL_LAWS[law]
    return found


def _own_law(address: str, parameters: dict[str, Any]) -> ContactLaw:
    given = {name: tuple(value) if isinstance(value, list) else value for name, value in parameters.items()}
    try:
        law: ContactLaw = law_class(address)(**given)
    except InputError as error:
        raise custom_error(error.problem, error.remedy, f"parameters.{error.argument}".rstrip(".")) from None
    except Exception as error:
        name = address.partition(":")[2]
        asked = f"{name}{signature(law_class(address))}"
        raise custom_error(
            f"{name} is not made of {shown(parameters)}: {error}", f"Give what it takes: {asked}.", "parameters"
        ) from error
    return law


@cache
def keys_of(law: str, *, per_area: bool) -> dict[str, bool]:
    """Return the keys of a law and whether each is required."""
    if is_address(law):
        return {"preload_pa" if per_area else "preload_n": False}
    columns = columns_of(ALL_LAWS[law], per_area=per_area)
    others = ["preload_pa" if per_area else "preload_n", *(["population"] if law == "iwan" else [])]
    return {key: field.is_required() for key, (_, field) in columns.items()} | dict.fromkeys(others, False)


def meaning_of(law: str, key: str) -> str:
    """Return the meaning of a key in a law; empty if it is no key of the law's own class."""
    found = (
        {} if is_address(law) else columns_of(ALL_LAWS[law], per_area=False) | columns_of(ALL_LAWS[law], per_area=True)
    )
    return str(found[key][1].description) if key in found else ""


def _owners(key: str, *, per_area: bool) -> list[str]:
    return [law for law in ALL_LAWS if key in keys_of(law, per_area=per_area)]


def _is_of_the_law(cls: type[Section], value: Any, info: ValidationInfo) -> Any:
    law, key, per = info.data.get("law"), str(info.field_name), info.data.get("per")
    if law is None or per is None:  # unknown, which has its own error
        return value
    area = per == "area"
    known = keys_of(law, per_area=area)
    if value is None:
        if known.get(key):
            about = meaning_of(law, key) or cls.model_fields[key].description
            raise custom_error(f"is missing, the law {law} needs it", f"Add it: {about}.")
    elif key not in known:
        raise _foreign(law, key, area, value)
    return value


def _foreign(law: str, key: str, area: bool, value: Any) -> Exception:
    """Return the error about a key that belongs to another law or to another `per`."""
    if is_address(law):
        return custom_error(
            f"is no key of {law}, got {shown(value)}", "Give it under parameters, by its name in Python."
        )
    if key in keys_of(law, per_area=not area):
        ours, theirs = (list(keys_of(law, per_area=a)) for a in (area, not area))
        what = '"area"' if area else "one other than area"
        return custom_error(
            f"is not the key with per = {what}, got {shown(value)}", f"Give {ours[theirs.index(key)]}, or another per."
        )
    having = ", ".join(_owners(key, per_area=area) or _owners(key, per_area=not area))
    return custom_error(
        f"is no parameter of the law {law}, got {shown(value)}; it belongs to {having}",
        "Remove it, or choose a law that has it.",
    )


def _columns() -> dict[str, Any]:
    """Return the keys of all laws, all optional; the law decides which ones are required."""
    sliders = "how the sliders of iwan share stiffness and limit, a table with its kind"
    found: dict[str, Any] = {"population": (PopulationTable | None, Field(None, description=sliders))}
    for area in (False, True):
        unit = "Pa" if area else "N"
        found[f"preload_{unit.lower()}"] = (
            float | None,
            Field(None, ge=0, description=f"normal force at rest in {unit}, 0 for none"),
        )
        for law in ALL_LAWS:
            for key, (annotation, field) in columns_of(ALL_LAWS[law], per_area=area).items():
                about = Field(None, validate_default=True, description=field.description)
                found.setdefault(key, (annotation | None, about))
    return found


def _made() -> type[ContactBase]:
    columns = _columns()
    check: Any = field_validator(*columns)(classmethod(_is_of_the_law))
    return create_model(
        "Contact", __base__=ContactBase, __doc__=ContactBase.__doc__, __validators__={"is_of_the_law": check}, **columns
    )


ContactTable = _made()
__all__ = ["ContactTable", "JoinTable", "Pair", "keys_of", "law_class", "meaning_of"]
