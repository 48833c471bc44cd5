"""The tables [load.NAME], [rotation] and [output]."""

from os.path import realpath
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from stickslip.response.forced.choices import AmplitudeOf
from stickslip.study.file.model.bodies import Triple, axis_vector
from stickslip.study.file.section import (
    FilePath,
    Name,
    Positive,
    Range,
    Section,
    custom_error,
    once,
    rising_pair,
    shown,
)

Component = Literal["x", "y", "z", "rx", "ry", "rz"]
Speed = Annotated[float, Field(ge=0, le=1e7)]  # rpm
HIGHEST_ORDER = 1000


def unit_direction(given: Any) -> Any:
    """Return the unit vector of a direction: an axis, with or without a sign, or a vector."""
    given = axis_vector(given)
    if given is None:
        return None
    numbers = isinstance(given, list) and len(given) == 3
    if numbers and all(isinstance(v, float | int) and not isinstance(v, bool) for v in given):
        length = sum(v * v for v in given) ** 0.5
        if 0 < length < float("inf"):
            return [v / length if length != 1.0 else float(v) for v in given]
    raise custom_error(f"is no direction, got {shown(given)}", 'Give "x", "y", "z", "-x" ... or a vector [x, y, z].')


class LoadTable(Section):
    """A static or harmonic force."""

    on: Name = Field(
        description='a rigid part ("damper", at its centre of mass), a node set ("blade.tip", shared equally '
        'among its nodes), a node ("blade.node12") or a dof ("chain.m1")'
    )
    force_n: float | None = Field(
        None, description="the whole force, or its amplitude, in N; or give ratio_of and ratio, or pressure"
    )
    pressure: FilePath | None = Field(
        None,
        description="file of a pressure field that acts on the faces of the node set, relative to the study: CSV (columns x_m, y_m, z_m, "
        "real_pa, imag_pa) or a surface of VTK (.vtk, .vtu)",
    )
    length_unit: Literal["m", "mm"] = Field("m", description="unit of the places in a VTK file of pressures: m or mm")
    modal_forces: int = Field(
        3, ge=0, le=50, description="number of modes whose modal force by the pressure is told, 0 to 50"
    )
    ratio_of: Name | None = Field(
        None, description='another load, such as "load.pull", of which this one is a fraction'
    )
    ratio: Annotated[float, Field(gt=0, le=1e9)] | None = Field(
        None, description="the force of ratio_of over the force of this load, greater than zero"
    )
    direction: Annotated[Triple | None, BeforeValidator(unit_direction)] = Field(
        None, description='"x", "y", "z", "-x" ... or a vector [x, y, z]; left out for single dofs'
    )
    harmonic: int = Field(1, ge=0, le=30, description="multiple of the frequency that it acts with; 0: a static force")
    phase_deg: float = Field(0.0, ge=-360, le=360, description="phase of a harmonic force in degrees, -360 to 360")
    engine_order: int | None = Field(
        None,
        ge=0,
        le=HIGHEST_ORDER,
        description="number of periods of the force around the circumference of a wheel; left out: not a wheel",
    )

    frequency_hz: Annotated[float, Field(gt=0, le=1e9)] | None = Field(
        None,
        description="frequency of this load in Hz, for [quasi_periodic]; left out: the frequency of the response",
    )
    frequency_ratio: Annotated[float, Field(gt=0, le=1e6)] | None = Field(
        None, description="the same as a multiple of the frequency of the other loads"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.frequency_hz is not None and self.frequency_ratio is not None:
            raise custom_error("cannot stand beside frequency_hz", "Give one of them.", "frequency_ratio")
        for key in ("frequency_hz", "frequency_ratio"):
            if getattr(self, key) is not None and self.harmonic == 0:
                raise custom_error("is given for a static force", "Leave it out.", key)
        given = [k for k in ("force_n", "ratio_of", "pressure") if getattr(self, k) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none of them"
            raise custom_error(
                f"needs one of force_n, ratio_of and pressure, got {found}", "Give exactly one.", "force_n"
            )
        if self.pressure is not None and self.direction is not None:
            raise custom_error("is given for a pressure, which acts along normals", "Leave it out.", "direction")
        strange = sorted({"length_unit", "modal_forces"} & self.model_fields_set)
        if self.pressure is None and strange:
            raise custom_error("belongs to a pressure", "Leave it out.", strange[0])
        if (self.ratio_of is None) != (self.ratio is None):
            raise custom_error(
                "goes together with the other of ratio_of and ratio",
                'For example ratio_of = "load.pull", ratio = 20.',
                "ratio" if self.ratio is None else "ratio_of",
            )
        if self.harmonic == 0 and self.phase_deg:
            raise custom_error("is given for a static force", "Leave it out.", "phase_deg")
        return self


class Rotation(Section):
    """The rotor's speed, and the effects of rotation that are kept."""

    speed_rpm: Speed = Field(
        0.0,
        description="speed in rpm, 0 is the wheel at rest; about the axis_direction of the parts from files, or else about z",
    )
    tangent: Literal["consistent", "textbook"] = Field(
        "consistent",
        description="stiffness at speed: consistent (with the displacements of the static solution) or textbook "
        "(stress stiffening and spin softening alone, some per cent off)",
    )
    coriolis: bool = Field(False, description="keep the Coriolis matrix: true or false")
    centrifugal: bool = Field(
        True, description="whether the centrifugal load of what rotates is a static load: true or false"
    )

    @model_validator(mode="before")
    @classmethod
    def _axis_of_parts(cls, given: Any) -> Any:
        found = [key for key in given if str(key).startswith("axis")] if isinstance(given, dict) else []
        if found:
            remedy = 'The axis belongs to the part that has a file: [part.NAME] axis_direction = "y". Without it the model turns about z.'
            raise custom_error(f"unknown key {found[0]!r}", remedy, found[0])
        return given


class Operation(Section):
    """Where the machine runs. Answers say whether a resonance lies there, and the margin if not; nothing else depends on it."""

    operating_hz: Range | None = Field(
        None,
        description="operating range [lowest, highest] of the excitation in Hz, for [forced_response], [campbell], [safe] and [run_up]",
    )
    operating_rpm: Range | None = Field(
        None,
        description="operating speeds [lowest, highest] in rpm, for [campbell], [safe] and [run_up], and for [forced_response] with an engine order",
    )

    @model_validator(mode="after")
    def _agree(self) -> Self:
        rising_pair(self.operating_hz or [], "operating_hz")
        rising_pair(self.operating_rpm or [], "operating_rpm", "speed")
        if self.operating_hz and self.operating_rpm:
            raise custom_error("cannot stand beside operating_hz", "Give one of them.", "operating_rpm")
        return self


class Point(Section):
    """A point whose motion is reported."""

    on: Name = Field(
        description='a node set ("blade.tip", its first node), a node, a dof, or a part together with near_m'
    )
    near_m: Triple | None = Field(None, description="place [x, y, z] in m: the nearest node of the part is taken")
    directions: list[Component] | None = Field(
        None, min_length=1, description="of x, y, z, rx, ry, rz; left out: output.directions"
    )


def _point(given: Any) -> Any:
    return {"on": given} if isinstance(given, str) else given


class Output(Section):
    """Points whose motion is reported, and the folder of the results."""

    folder: str = Field(
        "results", min_length=1, max_length=200, validate_default=True, description="a folder inside the study's folder"
    )
    points: dict[Name, Annotated[Point, BeforeValidator(_point)]] = Field(
        default_factory=dict,
        description='names of points and where they are: tip = "blade.tip", or {on = "blade", near_m = [x, y, z]}',
    )
    directions: list[Component] | None = Field(
        None, min_length=1, description="of x, y, z, rx, ry, rz; left out: all that a point has"
    )
    peak: str = Field(
        "", max_length=100, description="label whose peak is resolved, such as tip.x; left out: the first"
    )

    measure: AmplitudeOf = Field(
        "first",
        description="what the amplitude of an output is: first (of the harmonic that loads drive, the norm over several), half_peak_to_peak, or rms (over "
        "a period, about the mean); for the forced response and run-ups",
    )

    @field_validator("points")
    @classmethod
    def _are_names(cls, given: dict[str, Point]) -> dict[str, Point]:
        for name in given:
            if "." in name:
                raise custom_error(f"the name {name!r} has a dot", "Labels are name.direction: leave it out.")
        return given

    @model_validator(mode="after")
    def _differ(self) -> Self:
        once(self.directions or [], "directions")
        return self

    @field_validator("folder")
    @classmethod
    def _stays_inside(cls, name: str, info: ValidationInfo) -> str:
        """Refuse a folder outside the study's folder, after following links; without a study file only the name is checked."""
        relative, remedy = Path(name), "Give a plain relative name such as 'results'."
        if not name.isprintable() or relative.is_absolute() or ".." in relative.parts or relative == Path():
            raise custom_error(f"must be a folder inside the study's folder, got {name!r}", remedy)
        home = Path(realpath((info.context or {}).get("study", "study.toml"))).parent
        target = Path(realpath(home / relative))  # a link to itself stays a link, which the run refuses
        if target == home or not target.is_relative_to(home):
            raise custom_error(
                f"leads out of the study's folder, got {name!r}, which is a link to {target}",
                "Remove the link, or name another folder.",
            )
        return name


class Retention(Section):
    """A weak spring from rigid bodies to the ground, for states in which friction does not determine their mean position."""

    stiffness_n_per_m: float = Field(
        0.0, ge=0, description="stiffness in N/m that holds a body's mean position, 0 for none"
    )


class Limits(Section):
    """Limits on the cost of a run; a study with a higher estimate is refused before it starts."""

    memory_gb: Positive = Field(4.0, description="memory in GB that a run may take, greater than zero")
    work_s: Positive = Field(
        7200.0, description="estimated seconds that one case of an analysis may take on one core, greater than zero"
    )
    job_s: Positive | None = Field(
        None,
        description="seconds after which a job, one case of one analysis, is ended and set aside, greater than zero; left out: none",
    )
    job_memory_gb: Positive | None = Field(
        None,
        description="memory in GB at which the process of a job is ended, and at the second time the job set aside, greater than zero; "
        "left out: none",
    )
