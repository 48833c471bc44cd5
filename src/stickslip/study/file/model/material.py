"""The tables [material], [damping] and [reduction], of the whole study or of a part."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import is_dataclass
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, WrapValidator, create_model, field_validator, model_validator
from pydantic_core import PydanticCustomError

from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.damping import Damping
from stickslip.model.fe.material import (
    AnyMaterial,
    ByTemperature,
    ElasticMaterial,
    Expansion,
    Material,
    Orientation,
    cast_orientation,
    orthotropic_stiffness,
    refuse_unstable,
    row_of,
)
from stickslip.model.readers.units import MODULI, SOLIDS
from stickslip.reduction.choice import Reduction
from stickslip.reduction.truncation import FrequencyError, ModeChoice, ModesBelow
from stickslip.study.file.model.bodies import Direction, Triple
from stickslip.study.file.quantities import build, refused_by, table_of
from stickslip.study.file.section import FilePath, Positive, Section, custom_error, own_object, refuse_all, rising_pair
from stickslip.study.own_code import is_address
from stickslip.units import DEG

ANGLE_ROUNDING = 1e-6  # degrees

FEW = 25  # default number of fixed-interface modes
OWN_MODES = {"craig_bampton": "fixed_interface_modes", "rubin": "free_interface_modes"}
MODES_OF = tuple(OWN_MODES.values())
# units in which a number may have been meant, for messages
STRESSES = {"GPa": 1e9, "MPa": 1e6, "kPa": 1e3}
DENSITIES = {"g/cm³": 1e3, "kg/mm³": 1e9, "t/mm³": 1e12}


Three = Annotated[list[float], Field(min_length=3, max_length=3)]
Six = Annotated[list[float], Field(min_length=6, max_length=6)]
Angle = Annotated[float, Field(ge=-360, le=360)]


class OrientationTable(Section):
    """Axes 1, 2, 3 of a material, of a cubic crystal its ⟨001⟩ directions: two axes, Euler angles, or the angles of a casting."""

    axis_1: Direction | None = Field(
        None, description='direction of axis 1: "x", "-z" or a vector [x, y, z]; goes with axis_2'
    )
    axis_2: Direction | None = Field(
        None, description="a direction in the plane of the axes 1 and 2, on the side of axis 2"
    )
    euler_deg: Annotated[list[Angle], Field(min_length=3, max_length=3)] | None = Field(
        None,
        description="Euler angles [φ1, Φ, φ2] in degrees by Bunge: the axes are turned about z, then about the new axis 1, then about the new axis 3",
    )
    stacking_axis: Direction | None = Field(
        None,
        description='of a casting: direction from which axis 3, the nearest ⟨001⟩, is tilted, such as "x" or [1, 0, 0]; goes with reference',
    )
    reference: Direction | None = Field(
        None,
        description="of a casting: direction, across the stacking axis, from which azimuth and secondary angle are counted",
    )
    tilt_deg: Annotated[float, Field(ge=0, le=90)] = Field(
        0.0,
        description="of a casting: angle between axis 3 and the stacking axis in degrees, 0 to 90; of a cubic crystal at most 54.74, where another ⟨001⟩ becomes the nearest",
    )
    azimuth_deg: Angle = Field(
        0.0,
        description="of a casting: direction towards which axis 3 is tilted, in degrees about the stacking axis from the reference",
    )
    secondary_deg: Angle = Field(
        0.0,
        description="of a casting: angle of axis 1 about the stacking axis from the reference, before the tilt, in degrees",
    )
    around: Direction | None = Field(
        None,
        description="direction of the axis of a cylinder about which the material is wound: axes are then given in radial (x), tangential (y) and axial (z) direction of each place; left out: they are the same everywhere",
    )
    around_origin_m: Triple = Field([0.0, 0.0, 0.0], description="a point [x, y, z] of that axis in m")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        refuse_all(self._problems())
        try:
            self.library()
        except InputError as error:
            raise custom_error(error.problem, error.remedy) from None
        return self

    def _problems(self) -> Iterator[PydanticCustomError]:
        ways = {"axis_1": self.axis_1, "euler_deg": self.euler_deg, "stacking_axis": self.stacking_axis}
        given = [name for name, value in ways.items() if value is not None]
        if len(given) > 1:
            yield custom_error(f"is given together with {given[0]}", "Give the axes in one way.", given[1])
        for one, other in (("axis_1", "axis_2"), ("stacking_axis", "reference")):
            if (getattr(self, one) is None) != (getattr(self, other) is None):
                missing = one if getattr(self, one) is None else other
                yield custom_error("is missing beside the other", f"Give {one} and {other}.", missing)
        if self.stacking_axis is None:
            for key in ("tilt_deg", "azimuth_deg", "secondary_deg"):
                if key in self.model_fields_set:
                    yield custom_error("goes together with stacking_axis", "Give the axis of the casting.", key)
        if not given and self.around is None:
            yield custom_error(
                "names no axes", "Give axis_1 and axis_2, euler_deg, or stacking_axis and reference.", "axis_1"
            )
        if "around_origin_m" in self.model_fields_set and self.around is None:
            yield custom_error("goes together with around", "Give the direction of the axis.", "around_origin_m")

    def library(self) -> Orientation:
        """Return the orientation."""
        around = None
        if self.around is not None:
            (a, b, c), (x, y, z) = self.around, self.around_origin_m
            around = Axis((a, b, c), (x, y, z))
        if self.axis_1 is not None and self.axis_2 is not None:
            return Orientation.of_axes(self.axis_1, self.axis_2, around)
        if self.stacking_axis is not None and self.reference is not None:
            tilt, azimuth, secondary = (DEG * a for a in (self.tilt_deg, self.azimuth_deg, self.secondary_deg))
            return cast_orientation(self.stacking_axis, self.reference, tilt, azimuth, secondary, around)
        first, second, third = (DEG * angle for angle in self.euler_deg or (0.0, 0.0, 0.0))
        upright, across = Axis((0, 0, 1)), Axis((1, 0, 0))
        turn = upright.rotation(first) @ across.rotation(second) @ upright.rotation(third)
        return Orientation(tuple(tuple(row) for row in turn.tolist()), around)


class TemperatureTable(Section):
    """Temperature of meshed parts, at which materials are taken and from which thermal strain follows: uniform, or linear along the radius."""

    uniform_c: float | None = Field(None, ge=-273.15, le=5000, description="one temperature in °C")
    radius_m: list[Annotated[float, Field(ge=0)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="two distances from the axis of rotation in m, the smaller first; goes with at_radius_c",
    )
    at_radius_c: list[Annotated[float, Field(ge=-273.15, le=5000)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="temperatures at these two in °C; linear between, constant beyond",
    )
    stress_free_c: float | None = Field(
        None,
        ge=-273.15,
        le=5000,
        description="temperature without thermal strain in °C; left out: 20, or the initial temperatures of the deck",
    )
    factor: Annotated[float, Field(ge=0, le=10)] = Field(
        1.0, description="factor on the difference from the temperature without thermal strain, 0 to 10; may be varied"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        given = [key for key in ("uniform_c", "at_radius_c", "file") if getattr(self, key, None) is not None]
        if len(given) > 1:
            raise custom_error(f"is given together with {given[0]}", "Give the temperature in one way.", given[1])
        if (self.radius_m is None) != (self.at_radius_c is None):
            missing = "radius_m" if self.radius_m is None else "at_radius_c"
            raise custom_error("is missing beside the other", "Give radius_m and at_radius_c.", missing)
        rising_pair(self.radius_m or [], "radius_m", "radius")
        if not given and not self.of_files:
            raise custom_error("gives no temperature", "Give uniform_c, or radius_m and at_radius_c.", "uniform_c")
        return self

    @property
    def of_files(self) -> bool:
        """Whether temperatures may come from files."""
        return False


class FileTemperature(TemperatureTable):
    """Temperature of a part from a file: as of other parts, by node, or the deck's own times a factor."""

    file: FilePath | None = Field(
        None,
        description="temperatures by node: CSV with the columns node, temperature_c, or results of CalculiX (.frd) with NDTEMP, the last of which counts",
    )

    @property
    def of_files(self) -> bool:
        """Whether temperatures may come from files."""
        return True


# keys of an orthotropic material
ORTHOTROPIC = ("young_moduli_pa", "poisson_ratios", "shear_moduli_pa")


CONSTANTS = ("young_modulus_pa", "poisson_ratio", "shear_modulus_pa", *ORTHOTROPIC, "elasticity_pa")
EXPANSIONS = ("expansion_per_k", "expansions_per_k")


def elastic_row(table: Any, given: Collection[str]) -> tuple[float, ...]:
    """Return the row of `ElasticMaterial.elastic` of the constants of a table, of which the keys `given` are stated."""
    key = "elasticity_pa"
    try:
        if "elasticity_pa" in given:
            matrix = np.asarray(table.elasticity_pa, dtype=float)
            refuse_unstable("elasticity_pa", matrix)
            return row_of(matrix, "23-13-12")
        if "shear_modulus_pa" in given:
            key = "shear_modulus_pa"
            constants = [table.young_modulus_pa] * 3, [table.poisson_ratio] * 3, [table.shear_modulus_pa] * 3
            return row_of(orthotropic_stiffness(*constants))
        if ORTHOTROPIC[0] in given:
            key = ORTHOTROPIC[0]
            return row_of(orthotropic_stiffness(table.young_moduli_pa, table.poisson_ratios, table.shear_moduli_pa))
    except InputError as error:
        raise custom_error(error.problem, error.remedy, key) from None
    return table.young_modulus_pa, table.poisson_ratio


def problems_of_kind(given: Collection[str]) -> Iterator[PydanticCustomError]:
    """Yield what is wrong with the keys of the constants that are `given`: those of two kinds, or too few."""
    full = "elasticity_pa" in given
    nine = [key for key in ORTHOTROPIC if key in given]
    if full and nine:
        yield custom_error("is given together with elasticity_pa", "Give the constants or the matrix.", nine[0])
    for key in ORTHOTROPIC if nine else ():
        if key not in given:
            yield custom_error(f"is missing beside {nine[0]}", "An orthotropic material has nine constants.", key)
    for key in ("young_modulus_pa", "poisson_ratio", "shear_modulus_pa"):
        if key in given and (full or nine):
            other = "elasticity_pa" if full else nine[0]
            yield custom_error(f"is given together with {other}", "Give the constants of one kind of material.", key)
    for key in ("young_modulus_pa", "poisson_ratio"):
        if "shear_modulus_pa" in given and key not in given:
            yield custom_error("is missing beside shear_modulus_pa", "A cubic crystal has three constants.", key)
    if all(key in given for key in EXPANSIONS):
        yield custom_error(f"is given together with {EXPANSIONS[0]}", "Give one number or three.", EXPANSIONS[1])


class _PlausibleMaterial(Section):
    """Checks that the numbers are plausible for a solid, and that they are those of one kind of material."""

    plausible: bool = Field(
        True,
        description="whether stiffness and density are checked against what solids have: true, or false where the numbers are right",
    )

    @field_validator("young_modulus_pa", "density_kg_per_m3", check_fields=False)
    @classmethod
    def _is_of_a_solid(cls, value: float, info: ValidationInfo) -> float:
        """Refuse a value that no solid has, as the readers of decks do."""
        if info.data.get("plausible", True):
            refuse_implausible(value, stiff=info.field_name == "young_modulus_pa")
        return value

    @model_validator(mode="after")
    def _is_of_one_kind(self) -> Self:
        refuse_all(self._problems())
        made = refused_by(Material, self.library)
        if self.plausible and not isinstance(made, Material):
            refuse_implausible(made.young_modulus, stiff=True)
        return self

    def _problems(self) -> Iterator[PydanticCustomError]:
        given = self.model_fields_set
        yield from problems_of_kind(given)
        anisotropic = {*ORTHOTROPIC, "shear_modulus_pa", "elasticity_pa"}
        rows: list[Any] = getattr(self, "over_temperature", None) or []
        if len(rows) == 1:
            yield custom_error(
                f"has one row of over_temperature, at {rows[0].temperature_c:g} °C",
                "Give another row, or its constants in [material] itself.",
            )
            return
        kinds = [frozenset(row.model_fields_set - {"temperature_c"}) for row in rows]
        if "orientation" in given and not anisotropic & (given | frozenset().union(*kinds)):
            yield custom_error(
                "belongs to an anisotropic material, and this one is isotropic",
                "Give shear_modulus_pa (a cubic crystal), nine constants or elasticity_pa, or leave it out.",
                "orientation",
            )
        yield from self._problems_of_casting("shear_modulus_pa" in given | frozenset().union(*kinds))
        if len(set(kinds)) > 1:
            yield custom_error("has rows of different keys", "Give all rows the same constants.", "over_temperature")
        for key in kinds[0] & given if kinds else ():
            yield custom_error("is given over temperature, too", "Give it once.", key)
        if kinds and kinds[0] & set(CONSTANTS) and given & set(CONSTANTS):
            key = sorted(given & set(CONSTANTS))[0]
            yield custom_error("is given beside constants over temperature", "Give all constants in one place.", key)
        temperatures = [row.temperature_c for row in rows]
        if any(b <= a for a, b in pairwise(temperatures)):
            yield custom_error(
                f"must have rising temperatures, got {temperatures}",
                "Give the lowest first.",
                "over_temperature",
            )
        yield from self._problems_of_expansion(rows)

    def _problems_of_casting(self, cubic: bool) -> Iterator[PydanticCustomError]:
        """Yield what is wrong with the tilt of a cubic crystal: its axis 3 is the ⟨001⟩ nearest the stacking axis."""
        table: OrientationTable | None = getattr(self, "orientation", None)
        if not cubic or table is None or table.stacking_axis is None:
            return
        up = np.array(table.stacking_axis) / np.linalg.norm(table.stacking_axis)
        apart = np.degrees(np.arccos(np.minimum(np.abs(up @ np.array(table.library().axes)), 1.0)))
        if apart.min() < apart[2] - ANGLE_ROUNDING:
            yield custom_error(
                f"is {table.tilt_deg:g}, and axis {int(apart.argmin()) + 1} of the crystal lies nearer the stacking axis, at {apart.min():.4g}°",
                "Give the tilt of the nearest ⟨001⟩, at most 54.74, with its azimuth and secondary angle.",
                "orientation.tilt_deg",
            )

    def _problems_of_expansion(self, rows: list[Any]) -> Iterator[PydanticCustomError]:
        table: Any = self
        over = any(key in row.model_fields_set for row in rows for key in EXPANSIONS)
        if over and table.expansion is None:
            yield custom_error(
                "is missing with coefficients over temperature",
                'Say expansion = "secant" (from expansion_zero_c to the temperature of the row) or "instantaneous" (the slope there).',
                "expansion",
            )
        if over and table.expansion == "secant" and table.expansion_zero_c is None:
            yield custom_error(
                "is missing with secant coefficients", "Give the temperature from which they count.", "expansion_zero_c"
            )
        if not over and "expansion" in self.model_fields_set:
            yield custom_error(
                "belongs to coefficients over temperature", "Leave it out: one coefficient needs none.", "expansion"
            )
        if table.expansion != "secant" and "expansion_zero_c" in self.model_fields_set:
            yield custom_error("belongs to secant coefficients", "Leave it out.", "expansion_zero_c")

    def library(self) -> AnyMaterial:
        """Return the material.

        Raises
        ------
        PydanticCustomError
            If the constants belong to no stable material.
        """
        table: Any = self
        given, rows = self.model_fields_set, list[Any](table.over_temperature or [])
        anisotropic = {*ORTHOTROPIC, "shear_modulus_pa", "elasticity_pa"} & given
        if not anisotropic and not rows and not set(EXPANSIONS) & given:
            isotropic: Material = build(Material, self)
            return isotropic
        at = tuple(row.temperature_c for row in rows)
        over = [row for row in rows if row.model_fields_set & set(CONSTANTS)]
        elastic = ByTemperature((elastic_row(self, given),))
        if over:
            elastic = ByTemperature(tuple(elastic_row(row, row.model_fields_set) for row in over), at)
        return ElasticMaterial(
            elastic=elastic,
            density_table=ByTemperature(((table.density_kg_per_m3,),)),
            orientation=Orientation() if table.orientation is None else table.orientation.library(),
            expansion=self._expansion(rows, at),
        )

    def _expansion(self, rows: list[Any], at: tuple[float, ...]) -> Expansion | None:
        table: Any = self
        kind: Literal["secant", "instantaneous"] = table.expansion or "secant"
        own, over = _coefficients(self), [_coefficients(row) for row in rows]
        if own is not None:
            return Expansion(coefficients=ByTemperature((own,)))
        if not rows or over[0] is None:
            return None
        found = tuple(row for row in over if row is not None)
        return Expansion(coefficients=ByTemperature(found, at), kind=kind, zero=table.expansion_zero_c)


def _coefficients(table: Any) -> tuple[float, ...] | None:
    if table.expansion_per_k is not None:
        return (table.expansion_per_k,)
    return None if table.expansions_per_k is None else tuple(table.expansions_per_k)


class _Row(Section):
    """Constants at one temperature."""

    @model_validator(mode="after")
    def _is_of_one_kind(self) -> Self:
        table: Any = self
        given = self.model_fields_set
        refuse_all(problems_of_kind(given))
        if ("young_modulus_pa" in given) != ("poisson_ratio" in given):
            missing = "poisson_ratio" if "young_modulus_pa" in given else "young_modulus_pa"
            raise custom_error("is missing beside the other", "Give both at each temperature.", missing)
        if not given - {"temperature_c"}:
            raise custom_error(
                "gives no constant", "Give Young's modulus and Poisson's ratio, or others.", "temperature_c"
            )
        if given & set(CONSTANTS):
            elastic_row(table, given)
        return self


def refuse_implausible(value: float, *, stiff: bool) -> None:
    """Refuse a modulus in Pa (`stiff`) or a density in kg/m³ that no solid has."""
    (low, high), unit = (MODULI, "Pa") if stiff else (SOLIDS, "kg/m³")
    if low <= value <= high:
        return
    meant = [
        f", which is {value * factor:.4g} {unit} if it is in {name}"
        for name, factor in (STRESSES if stiff else DENSITIES).items()
        if low <= value * factor <= high
    ]
    raise custom_error(
        f"no solid has {value:g} {unit}{meant[0] if meant else ''}",
        f"Give a value from {low:g} to {high:g} {unit}, or plausible = false where the number is right.",
    )


COLUMNS: dict[str, Any] = {
    "shear_modulus_pa": (
        Positive | None,
        Field(
            None,
            description="shear modulus in Pa of a cubic (single) crystal: with it young_modulus_pa and poisson_ratio are those along its ⟨001⟩ axes",
        ),
    ),
    "young_moduli_pa": (
        Annotated[list[Positive], Field(min_length=3, max_length=3)] | None,
        Field(None, description="of an orthotropic material: Young's moduli [E1, E2, E3] in Pa"),
    ),
    "poisson_ratios": (
        Three | None,
        Field(
            None,
            description="of an orthotropic material: Poisson's ratios [ν12, ν13, ν23]; ν12 is minus the strain along 2 over that along 1 under tension along 1",
        ),
    ),
    "shear_moduli_pa": (
        Annotated[list[Positive], Field(min_length=3, max_length=3)] | None,
        Field(None, description="of an orthotropic material: shear moduli [G12, G13, G23] in Pa"),
    ),
    "elasticity_pa": (
        Annotated[list[Six], Field(min_length=6, max_length=6)] | None,
        Field(
            None,
            description="of any material: six rows of the symmetric matrix from strains to stresses in Pa, in the order 11, 22, 33, 23, 13, 12 with doubled shear strains",
        ),
    ),
    "expansion_per_k": (
        Annotated[float, Field(ge=-1e-3, le=1e-3)] | None,
        Field(None, description="coefficient of thermal expansion in 1/K, the same in all directions"),
    ),
    "expansions_per_k": (
        Annotated[list[Annotated[float, Field(ge=-1e-3, le=1e-3)]], Field(min_length=3, max_length=3)] | None,
        Field(None, description="coefficients of thermal expansion [α1, α2, α3] along the axes of the material in 1/K"),
    ),
}
RowTable: Any = create_model(
    "RowTable",
    __base__=_Row,
    __doc__="Constants of a material at one temperature, of the kinds of [material].",
    temperature_c=(float, Field(ge=-273.15, le=5000, description="temperature in °C")),
    young_modulus_pa=(Positive | None, Field(None, description="Young's modulus in Pa")),
    poisson_ratio=(Annotated[float, Field(ge=0, lt=0.5)] | None, Field(None, description="Poisson's ratio")),
    **COLUMNS,
)
MaterialTable: Any = table_of(
    Material,
    base=_PlausibleMaterial,
    name="MaterialTable",
    **COLUMNS,
    orientation=(
        OrientationTable | None,
        Field(None, description="the table of the axes of an anisotropic material; left out: the global axes"),
    ),
    over_temperature=(
        list[RowTable] | None,
        Field(
            None,
            min_length=1,
            max_length=200,
            description="the tables [[material.over_temperature]]: constants and expansion at rising temperatures; linear between, constant beyond",
        ),
    ),
    expansion=(
        Literal["secant", "instantaneous"] | None,
        Field(
            None,
            description="what coefficients over temperature are: secant (strain from expansion_zero_c over the difference of temperature) or instantaneous (slope of the strain)",
        ),
    ),
    expansion_zero_c=(
        float | None,
        Field(None, ge=-273.15, le=5000, description="temperature in °C from which secant coefficients count"),
    ),
)
MaterialTable.__doc__ = "A linear elastic material: isotropic, a cubic crystal, orthotropic, or given by its matrix."


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
