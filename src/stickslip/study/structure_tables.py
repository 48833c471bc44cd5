"""The tables of a study of a bladed disk: model, rotation and what is asked of it."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from stickslip.model.axis import Axis
from stickslip.study.messages import custom_error
from stickslip.study.sections import Section

Speed = Annotated[float, Field(ge=0, le=1e7)]  # rpm
Place = Annotated[float, Field(ge=-1e6, le=1e6)]
Order = Annotated[int, Field(ge=1, le=1000)]
Diameter = Annotated[int, Field(ge=0, le=1000)]
FilePath = Annotated[str, Field(min_length=1, max_length=500)]
SetName = Annotated[str, Field(min_length=1, max_length=100)]


def once(values: list[int], key: str) -> None:
    """Refuse a list that holds a number twice."""
    if len(set(values)) < len(values):
        raise custom_error(f"holds a number twice, got {values}", "Give every number once.", key)


class FileModel(Section):
    """One sector, or a whole structure, from the files of a finite-element program."""

    path: FilePath = Field(
        description="the model's file, relative to the study: a mesh with its node sets (CalculiX or Abaqus .inp, ANSYS .cdb) "
        "or matrices (.sti, .full, .npz, .mtx and others, see 'bring your model')"
    )
    units: Literal["SI", "mm-t-s", "mm-kg-ms", "mm-kg-s", "inch-lbf-s", "foot-slug-s"] = Field(
        description="the file's unit system: SI, mm-t-s (mm, tonne, s: N, MPa), mm-kg-ms, mm-kg-s, inch-lbf-s or foot-slug-s"
    )
    plausible: bool = Field(
        True,
        description="whether mass and size are checked against what solids have: true, or false where the numbers are right",
    )
    sectors: int | None = Field(
        None,
        ge=1,
        le=1000,
        description="number of equal sectors that make the wheel; left out: that of the deck's cyclic symmetry, else 1 for "
        "the whole structure",
    )
    low_face: SetName | None = Field(
        None,
        description="name of the node set of the cyclic face at the lower angle; left out: the faces of the deck's cyclic tie",
    )
    high_face: SetName | None = Field(
        None, description="name of the node set of the cyclic face at the higher angle"
    )
    clamped: list[SetName] = Field(
        default_factory=list,
        max_length=100,
        description="names of the node sets of a mesh that are held in all directions, beside what a deck holds itself",
    )
    axis_direction: list[Place] | None = Field(
        None,
        min_length=3,
        max_length=3,
        description="direction [x, y, z] of the axis of rotation; left out: that of the deck, else the z axis",
    )
    axis_origin_m: list[Place] = Field(
        [0.0, 0.0, 0.0],
        min_length=3,
        max_length=3,
        description="a point [x, y, z] of the axis in m, whatever the file's units; goes with axis_direction",
    )
    quadrature: Literal["exact", "calculix"] = Field(
        "exact",
        description="integration of a mesh's matrices: exact, or calculix (the rules of that program, for comparisons)",
    )
    mesh: FilePath | None = Field(
        None,
        description="beside matrices without coordinates: the mesh file with the nodes and their sets (.inp for CalculiX's .sti)",
    )
    mass: FilePath | None = Field(
        None, description="with matrices in separate files: that of the mass; path is the stiffness"
    )
    damping: FilePath | None = Field(
        None, description="with matrices in separate files: that of the damping"
    )
    nodes: FilePath | None = Field(
        None,
        description="with matrices in separate files: CSV of node, component, x, y, z of every row",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if (self.low_face is None) != (self.high_face is None):
            missing = "low_face" if self.low_face is None else "high_face"
            raise custom_error(
                "is missing, the other face is given", "Name both faces or neither.", missing
            )
        if self.axis_direction is not None and not any(self.axis_direction):
            raise custom_error("has no length", "The z axis is [0, 0, 1].", "axis_direction")
        return self

    def axis(self) -> Axis | None:
        """Return the axis of rotation; None where the study names none."""
        if self.axis_direction is None:
            return None
        (a, b, c), (x, y, z) = self.axis_direction, self.axis_origin_m
        return Axis((a, b, c), (x, y, z))


class Rotation(Section):
    """The rotor's speed and which of its effects are kept."""

    speed_rpm: Speed = Field(
        0.0, description="speed in rpm of 'modes' and 'safe'; 0 is the wheel at rest"
    )
    tangent: Literal["consistent", "textbook"] = Field(
        "consistent",
        description="stiffness at speed: consistent (with the displacements of the static solution) or textbook "
        "(stress stiffening and spin softening alone, some per cent off)",
    )
    coriolis: bool = Field(False, description="keep the Coriolis matrix: true or false")


class Modes(Section):
    """Natural frequencies and mode shapes for each nodal diameter."""

    number: int = Field(
        6, ge=1, le=200, description="number of modes of each nodal diameter, 1 to 200"
    )
    nodal_diameters: list[Diameter] | None = Field(
        None,
        min_length=1,
        max_length=501,
        description="nodal diameters, a list of whole numbers from 0 to half the number of sectors; left out: all",
    )
    shapes: bool = Field(True, description="store the mode shapes on the skin: true or false")
    reference: FilePath | None = Field(
        None,
        description="CSV file of frequencies to compare with, relative to the study; columns nodal_diameter, mode (1 is the "
        "lowest), frequency_hz",
    )
    reference_case: str | None = Field(
        None,
        max_length=100,
        description="keep only the rows of the reference whose column 'case' has this value",
    )

    @model_validator(mode="after")
    def _differ(self) -> Self:
        once(self.nodal_diameters or [], "nodal_diameters")
        if self.reference_case is not None and self.reference is None:
            raise custom_error(
                "is given without a reference",
                "Name the CSV file, or leave it out.",
                "reference_case",
            )
        return self


class CampbellTable(Section):
    """Frequencies against rotor speed and their crossings with engine orders."""

    speeds_rpm: list[Speed] = Field(
        min_length=2,
        max_length=2,
        description="the range [lowest, highest] of the speed in rpm, the lower first",
    )
    points: int = Field(9, ge=2, le=1000, description="number of speeds in the range, 2 to 1000")
    engine_orders: list[Order] = Field(
        min_length=1, max_length=200, description="engine orders, a list of whole numbers from 1"
    )
    modes: int = Field(4, ge=1, le=100, description="number of modes that are followed, 1 to 100")
    nodal_diameters: list[Diameter] | None = Field(
        None,
        min_length=1,
        max_length=501,
        description="nodal diameters; left out: those that the engine orders excite",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        once(self.engine_orders, "engine_orders")
        once(self.nodal_diameters or [], "nodal_diameters")
        if not self.speeds_rpm[0] < self.speeds_rpm[1]:
            raise custom_error(
                f"must be the lower before the higher, got {self.speeds_rpm}",
                "Give the lower speed first.",
                "speeds_rpm",
            )
        return self


class SafeTable(Section):
    """Which modes engine orders can excite at one speed (SAFE, interference diagram)."""

    speed_rpm: Speed | None = Field(
        None, description="speed in rpm, above zero; left out: that of [rotation]"
    )
    engine_orders: list[Order] = Field(
        min_length=1, max_length=200, description="engine orders, a list of whole numbers from 1"
    )
    margin_percent: float = Field(
        5.0,
        gt=0,
        lt=100,
        description="a mode that an engine order would meet within this change of speed is called a near resonance, in percent",
    )
    modes: int = Field(
        6, ge=1, le=200, description="number of modes of each nodal diameter, 1 to 200"
    )

    @model_validator(mode="after")
    def _differ(self) -> Self:
        once(self.engine_orders, "engine_orders")
        return self
