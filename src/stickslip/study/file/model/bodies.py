"""The tables [part.NAME] of rigid bodies: ready shapes, the user's own points, and the placement of the body axes."""

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from stickslip.arrays import FloatArray
from stickslip.model.rigid.body import RigidBody
from stickslip.model.rigid.dampers import CylinderDamper, FlatCurvedDamper, WedgeDamper
from stickslip.study.file.quantities import table_of
from stickslip.study.file.section import Name, Positive, Section, custom_error, once, shown

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Triple = Annotated[list[Coordinate], Field(min_length=3, max_length=3)]
ALONG = 1e-6  # sine of the angle between a direction and the normal, below which it is no tangent
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def axis_vector(given: Any) -> Any:
    """Return the unit vector of an axis, with or without a sign; what is no word stays."""
    if not isinstance(given, str):
        return given
    if given.removeprefix("-") not in AXES:
        raise custom_error(
            f"is no direction, got {shown(given)}", 'Give "x", "y", "z", "-x" ... or a vector [x, y, z].'
        )
    sign = -1.0 if given.startswith("-") else 1.0
    return [sign * part for part in AXES[given.removeprefix("-")]]


Direction = Annotated[Triple, BeforeValidator(axis_vector)]


def shape(name: str) -> tuple[Any, Any]:
    """Return the key `shape` with the fixed value `name`."""
    return Literal[name], Field(description=f'shape = "{name}"')


class Placed(Section):
    """One step of the placement of a part: mirrored, then turned, then moved."""

    mirror: Literal["x", "y", "z"] | None = Field(
        None, description="direction that a mirror through the origin turns round: x, y or z"
    )
    axes: list[str] | None = Field(
        None,
        min_length=3,
        max_length=3,
        description='where the axes x, y, z of the part come to point, such as ["y", "z", "x"] or ["-y", "x", "z"]',
    )
    turn_deg: float = Field(0.0, ge=-360, le=360, description="turn about the axis in degrees")
    axis: Literal["x", "y", "z"] = Field("z", description="axis through the origin of the turn: x, y or z")
    move_m: Triple = Field([0.0, 0.0, 0.0], description="displacement [x, y, z] in m")

    @model_validator(mode="after")
    def _is_a_turn(self) -> Self:
        if self.axes is None:
            return self
        if sorted(word.removeprefix("-") for word in self.axes) != ["x", "y", "z"]:
            raise custom_error(
                f"must name x, y and z once each, got {shown(self.axes)}",
                'A minus turns one round: ["-y", "x", "z"] is a quarter turn about z.',
                "axes",
            )
        if np.linalg.det(self.new_axes) < 0:
            raise custom_error(
                f"makes a right hand a left one, got {shown(self.axes)}",
                "Change the sign of one axis, or use mirror where a mirror image is meant.",
                "axes",
            )
        return self

    @property
    def new_axes(self) -> FloatArray:
        """(3, 3) matrix of the rotation that `axes` names."""
        columns = [np.array(AXES[word[-1]]) * (-1.0 if word.startswith("-") else 1.0) for word in self.axes or "xyz"]
        return np.column_stack(columns)


def _steps(given: Any) -> Any:
    return [given] if isinstance(given, dict) else given


Steps = Annotated[list[Placed], BeforeValidator(_steps), Field(min_length=1, max_length=10)]


def _placed() -> tuple[Any, Any]:
    return Steps | None, Field(
        None,
        description="the table placed, or a list of such tables, one step after the other; left out: as the model's axes",
    )


FlatCurved = table_of(
    FlatCurvedDamper,
    name="FlatCurved",
    optional=("apex", "flat_angle", "curved_angle"),
    shape=shape("flat_curved"),
    placed=_placed(),
)
Wedge = table_of(WedgeDamper, name="Wedge", shape=shape("wedge"), placed=_placed())
Cylinder = table_of(CylinderDamper, name="Cylinder", shape=shape("cylinder"), placed=_placed())


class Surface(Section):
    """Contact points of a rigid body, in the axes of the body."""

    points_m: list[Triple] = Field(
        min_length=1, max_length=10_000, description="positions [x, y, z] of its points in m"
    )
    normal: Direction | None = Field(
        None, description='direction "x", "-z" or [x, y, z] out of the body, the same at all points; or normals'
    )
    normals: list[Direction] | None = Field(None, max_length=10_000, description="such a direction of each point")
    tangent: Direction | None = Field(
        None,
        description='direction "x", "-z" or [x, y, z] whose part in the contact plane is the tangent t; left out: the axis nearest to the plane',
    )
    names: list[Name] | None = Field(
        None, max_length=10_000, description="names of the points; left out: NAME.1, NAME.2, ..."
    )
    areas_m2: list[Positive] | None = Field(
        None,
        max_length=10_000,
        description='area in m² that each point stands for, greater than zero; contacts with per = "area" need it',
    )

    @property
    def directions(self) -> FloatArray:
        """(p, 3) unit normals."""
        given = self.normals if self.normal is None else [self.normal] * len(self.points_m)
        found = np.array(given, dtype=float)
        return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])

    @model_validator(mode="after")
    def _has_directions(self) -> Self:
        if (self.normal is None) == (self.normals is None):
            problem = "and normals are both given" if self.normal else "is missing"
            raise custom_error(problem, "Give normal for all points alike, or normals, one a point.", "normal")
        for key in ("normals", "names", "areas_m2"):
            own = getattr(self, key)
            if own is not None and len(own) != len(self.points_m):
                raise custom_error(f"has {len(own)} entries for {len(self.points_m)} points", "Give one a point.", key)
        once(self.names or [], "names")
        for i, normal in enumerate(self.normals or [self.normal]):
            if not any(normal or ()):
                key = "normal" if self.normals is None else f"normals[{i}]"
                raise custom_error("has no length", "Along z it is [0, 0, 1].", key)
        if self.tangent is not None:
            self._check_tangent(np.array(self.tangent, dtype=float))
        return self

    def _check_tangent(self, tangent: FloatArray) -> None:
        if not np.any(tangent):
            raise custom_error("has no length", "Along z it is [0, 0, 1].", "tangent")
        across = np.linalg.norm(np.cross(self.directions, tangent), axis=1)
        if across.min() < ALONG * np.linalg.norm(tangent):
            raise custom_error(
                f"points along the normal of point {int(np.argmin(across)) + 1}, got {shown(self.tangent)}",
                "Give a direction in the contact plane, or leave it out.",
                "tangent",
            )


RigidBodyTable = table_of(
    RigidBody,
    name="RigidBody",
    shape=shape("rigid_body"),
    surfaces=(
        dict[Name, Surface],
        Field(default_factory=dict, description="the tables surfaces.NAME, points that touch something"),
    ),
    placed=_placed(),
)


BODIES = (RigidBodyTable, FlatCurved, Wedge, Cylinder)
