"""The tables [part.NAME]: shapes, lumped masses, rigid bodies, models from files with their node sets, and copies of other parts."""

from collections.abc import Callable
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Discriminator, Field, Tag, ValidationInfo, field_validator, model_validator

from stickslip.assembly.contact import NEXT
from stickslip.errors import did_you_mean, nearest
from stickslip.model.axis import Axis
from stickslip.model.fe.beam import Beam, Bending
from stickslip.model.mesh.blade_pair import BladePair
from stickslip.model.mesh.sector import BladedSector
from stickslip.study.file.model.bodies import (
    Cylinder,
    Direction,
    FlatCurved,
    RigidBodyTable,
    Steps,
    Triple,
    Wedge,
    shape,
)
from stickslip.study.file.model.material import (
    DampingTable,
    FileTemperature,
    MaterialTable,
    ReductionTable,
    TemperatureTable,
)
from stickslip.study.file.quantities import table_of
from stickslip.study.file.section import FilePath, Name, Positive, Section, custom_error, once, own_object, shown

Pair = Annotated[list[Triple], Field(min_length=2, max_length=2)]


class SetTable(Section):
    """A node set: the nodes that satisfy all of its conditions."""

    nodes: list[Annotated[int, Field(ge=0)]] | None = Field(
        None, min_length=1, max_length=100_000, description="node numbers of the file"
    )
    pattern: str | None = Field(
        None,
        min_length=1,
        max_length=100,
        description="nodes of all sets of the file whose names fit, capitals aside; * stands for any letters, ? for one, "
        'such as "SHROUD_*"',
    )
    box_m: Pair | None = Field(
        None, description="two corners [[x, y, z], [x, y, z]] in m, along the axes, of the box that holds them"
    )
    cylinder_m: Pair | None = Field(
        None,
        description="two points [[x, y, z], [x, y, z]] in m on the axis of the cylinder that holds them, at its ends; goes with "
        "radius_m",
    )
    radius_m: Annotated[list[Annotated[float, Field(ge=0)]], Field(min_length=2, max_length=2)] | None = Field(
        None, description="inner and outer radius [m, m] of the cylinder; 0 inside: it is full"
    )

    @model_validator(mode="after")
    def _picks(self) -> Self:
        if self.nodes is None and self.pattern is None and self.box_m is None and self.cylinder_m is None:
            raise custom_error("picks nothing", "Give nodes, pattern, box_m, or cylinder_m with radius_m.", "pattern")
        once(self.nodes or [], "nodes")
        if (self.cylinder_m is None) != (self.radius_m is None):
            key = "cylinder_m" if self.cylinder_m is None else "radius_m"
            raise custom_error("is missing beside the other", "Give both or neither.", key)
        if self.cylinder_m is not None and self.cylinder_m[0] == self.cylinder_m[1]:
            raise custom_error("has no length", "Give two points, one at each end.", "cylinder_m")
        if self.radius_m is not None and self.radius_m[0] >= self.radius_m[1]:
            raise custom_error(f"must rise, got {self.radius_m}", "Give the inner radius first.", "radius_m")
        return self


class PartTable(Section):
    """Common keys of parts that have modes."""

    material: MaterialTable | None = Field(
        None, description="the table of its material; left out: the table [material]"
    )
    temperature: TemperatureTable | None = Field(
        None, description="the table of its temperature; left out: the table [temperature]"
    )
    damping: DampingTable | None = Field(None, description="the table of its damping; left out: the table [damping]")
    reduction: ReductionTable | None = Field(
        None, description="the table of its reduction; left out: the table [reduction]"
    )

    def files(self) -> dict[str, str]:
        """Return the keys that name files, and the file names."""
        return {}


PrismBlades = table_of(
    BladePair,
    base=PartTable,
    name="PrismBlades",
    shape=shape("prism_blades"),
    nodes_at=(
        Annotated[list[Name], Field(max_length=20)],
        Field(
            default_factory=list,
            description="surfaces of a flat_curved part whose points become nodes of the mesh, such as damper.flat",
        ),
    ),
)
Sector = table_of(BladedSector, base=PartTable, name="BladedSector", shape=shape("bladed_sector"))
BeamTable = table_of(
    Beam,
    base=PartTable,
    name="Beam",
    without=("material",),
    shape=shape("beam"),
    elements=(int, Field(20, ge=1, le=10_000, description="number of equal elements, 1 to 10000")),
    bending=(Bending, Field("z", description="direction of the deflection: y, z or both")),
    axial=(bool, Field(False, description="whether it stretches too: true or false")),
)


def _link(given: Any) -> Any:
    if not (
        isinstance(given, list)
        and len(given) == 3
        and all(isinstance(end, str | int) and not isinstance(end, bool) for end in given[:2])
        and isinstance(given[2], float | int)
        and not isinstance(given[2], bool)
    ):
        raise custom_error(
            f"must be [end, end, value], got {shown(given)}",
            'Ends are "ground", names of masses or their numbers from 1: ["ground", 1, 1e5].',
        )
    return [given[0], given[1], float(given[2])]


Link = Annotated[list[Any], BeforeValidator(_link)]


class Lumped(PartTable):
    """Masses that move along one direction, springs and dashpots between them, to the ground and to the next sector."""

    shape: Literal["lumped"] = Field(description='shape = "lumped"')
    masses_kg: list[Positive] = Field(min_length=1, max_length=2000, description="the masses in kg, greater than zero")
    names: list[Name] | None = Field(
        None, description="names of the masses, which are sets of the part; left out: m1, m2, ..."
    )
    springs_n_per_m: list[Link] = Field(
        default_factory=list,
        max_length=100_000,
        description='springs [end, end, stiffness in N/m]; ends are "ground", names of masses or their numbers from 1, and on a wheel '
        'masses of the next sector, such as "next.m1"',
    )
    dashpots_n_s_per_m: list[Link] = Field(
        default_factory=list,
        max_length=100_000,
        description="dashpots [end, end, coefficient in N s/m]; ends as of springs",
    )
    sectors: int = Field(
        1, ge=1, le=1000, description="number of equal sectors that make the wheel; 1 where it stands alone"
    )

    @property
    def labels(self) -> list[str]:
        """Names of the masses."""
        return self.names or [f"m{i + 1}" for i in range(len(self.masses_kg))]

    @model_validator(mode="after")
    def _fits(self) -> Self:
        once(self.labels, "names")
        if len(self.labels) != len(self.masses_kg):
            raise custom_error(
                f"has {len(self.labels)} names for {len(self.masses_kg)} masses",
                "Name every mass, or leave names out.",
                "names",
            )
        for key in ("springs_n_per_m", "dashpots_n_s_per_m"):
            for i, link in enumerate(getattr(self, key)):
                for end in link[:2]:
                    self._check_end(end, f"{key}[{i}]")
        return self

    def _check_end(self, end: str | int, key: str) -> None:
        own = end.removeprefix(NEXT) if isinstance(end, str) and self.sectors > 1 else end
        if end == "ground" or own in self.labels:
            return
        if isinstance(end, int) and 1 <= end <= len(self.masses_kg):
            return
        known = [*self.labels, "ground", *(NEXT + m for m in self.labels if self.sectors > 1)]
        raise custom_error(f"there is no mass {end!r}", did_you_mean(str(end), known), key)


class SpeedTable(Section):
    """Matrices of a part at one speed of rotation, on the dofs of its file, and the static displacement of this speed."""

    speed_rpm: Positive = Field(description="speed in rpm")
    file: FilePath = Field(
        description="stiffness at this speed, with stress stiffening and spin softening, in a format of the part's file"
    )
    damping_matrix: FilePath | None = Field(
        None, description="Coriolis matrix at this speed, if it is in a separate file"
    )
    displacement: FilePath | None = Field(
        None,
        description="static displacement of this speed: a .frd file of CalculiX, or CSV with the columns node, x, y, z in the file's unit of length",
    )


class FileModel(PartTable):
    """One sector, or a whole structure, from the files of a finite-element program."""

    file: FilePath = Field(
        description="the model's file, relative to the study: a mesh with its node sets (CalculiX or Abaqus .inp, ANSYS .cdb) "
        "or matrices (.sti, .full, .npz, .mtx and others, see 'bring your model')"
    )
    units: Literal["SI", "mm-t-s", "mm-kg-ms", "mm-kg-s", "inch-lbf-s", "foot-slug-s"] = Field(
        description="the file's unit system, one of SI, mm-t-s (mm, tonne, s; N, MPa), mm-kg-ms, mm-kg-s, inch-lbf-s or foot-slug-s"
    )
    reader: str | None = Field(
        None,
        description="my_module:function, a reader of your own for the file, with --allow-code: function(path, units=units) returns a structure or a mesh in SI; left out: a reader by the file's suffix",
    )
    plausible: bool = Field(
        True,
        description="whether mass and size are checked against what solids have, and faces that would meet neighbouring sectors against ties and contacts: true, or false where the model is right",
    )
    sectors: int | None = Field(
        None,
        ge=1,
        le=1000,
        description="number of equal sectors of the wheel; left out: as in the deck's cyclic symmetry, or 1 for the whole structure. A given 1 says that faces which look like those of a sector are free",
    )
    low_face: Name | None = Field(
        None,
        description="name of the node set of the cyclic face at the lower angle; left out: the faces of the deck's cyclic tie",
    )
    high_face: Name | None = Field(None, description="name of the node set of the cyclic face at the higher angle")
    cyclic: Literal["node_to_node", "segment_to_segment", "none"] = Field(
        "node_to_node",
        description="how the cyclic faces are tied. node_to_node: meshes match; segment_to_segment: meshes do not match, and the finer face follows the other one in the mean; none: the part has no such faces, and only contacts and joins connect it to its neighbours, as a damper between blades",
    )
    clamped: list[Name] = Field(
        default_factory=list,
        max_length=100,
        description="names of the node sets of a mesh that are held in all directions, beside what a deck holds itself",
    )
    axis_direction: Direction | None = Field(
        None,
        description='direction "x", "-z" or [x, y, z] of the axis of rotation; left out: as in the deck, or the z axis',
    )
    axis_origin_m: Triple = Field(
        [0.0, 0.0, 0.0],
        description="a point [x, y, z] of the axis in m, whatever the file's units; goes with axis_direction",
    )
    sets: dict[Name, SetTable] = Field(
        default_factory=dict,
        description="the tables sets.NAME: further node sets, picked by names, in a box or in a cylinder",
    )
    temperature: FileTemperature | None = Field(
        None,
        description="the table of its temperature; left out: the table [temperature], or else the deck's temperatures",
    )
    quadrature: Literal["exact", "calculix"] = Field(
        "exact",
        description="integration of a mesh's matrices: exact, or calculix (the rules of that program, for comparisons)",
    )
    hourglass: float | None = Field(
        None,
        gt=0,
        le=1,
        description="hourglass stiffness of C3D8R bricks as a fraction of Young's modulus; left out: 0.0005, as CalculiX, or 0.005 for a deck of Abaqus (*PART, *ASSEMBLY)",
    )
    mesh: FilePath | None = Field(
        None,
        description="beside matrices without coordinates: the mesh file with the nodes and their sets (.inp for CalculiX's .sti)",
    )
    mass: FilePath | None = Field(
        None, description="mass matrix, if matrices are in separate files; file is then the stiffness"
    )
    damping_matrix: FilePath | None = Field(None, description="damping matrix, if matrices are in separate files")
    nodes: FilePath | None = Field(
        None, description="with matrices in separate files: CSV of node, component, x, y, z of every row"
    )

    at_speed: list[SpeedTable] = Field(
        default_factory=list,
        max_length=50,
        description="with matrices: the tables [[part.NAME.at_speed]], the same part at two or more speeds; its own file is at rest",
    )
    between: Literal["polynomial", "pchip"] = Field(
        "polynomial",
        description="the stiffness between the speeds of at_speed: polynomial (of the square of the speed, exact for linear elasticity) or pchip (monotone pieces, where temperatures or contacts inside follow the speed)",
    )

    @field_validator("reader")
    @classmethod
    def _is_code(cls, given: str | None, info: ValidationInfo) -> str | None:
        if given is not None:
            own_object(info, given, "function", ("__call__",))
        return given

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if (self.low_face is None) != (self.high_face is None):
            missing = "low_face" if self.low_face is None else "high_face"
            raise custom_error("is missing, the other face is given", "Name both faces or neither.", missing)
        if self.axis_direction is not None and not any(self.axis_direction):
            raise custom_error("has no length", "The z axis is [0, 0, 1].", "axis_direction")
        return self

    def files(self) -> dict[str, str]:
        """Return the keys that name files, and the file names."""
        named = {key: getattr(self, key) for key in ("file", "mesh", "mass", "damping_matrix", "nodes")}
        if self.temperature is not None and self.temperature.file is not None:
            named["temperature.file"] = self.temperature.file
        for i, own in enumerate(self.at_speed):
            named |= {f"at_speed[{i}].{key}": getattr(own, key) for key in ("file", "damping_matrix", "displacement")}
        return {key: name for key, name in named.items() if name is not None}

    def axis(self) -> Axis | None:
        """Return the axis of rotation; None if the study names none."""
        if self.axis_direction is None:
            return None
        (a, b, c), (x, y, z) = self.axis_direction, self.axis_origin_m
        return Axis((a, b, c), (x, y, z))


class Copy(Section):
    """A copy of another part, whose reduction it shares."""

    of: Name = Field(description="name of the part that is copied")
    placed: Steps = Field(
        description="the table placed: mirror, axes, turn_deg, axis, move_m; or a list of such tables, one step after the other"
    )


SHAPES: dict[str, type[Section]] = {
    "prism_blades": PrismBlades,
    "bladed_sector": Sector,
    "beam": BeamTable,
    "lumped": Lumped,
    "rigid_body": RigidBodyTable,
    "flat_curved": FlatCurved,
    "wedge": Wedge,
    "cylinder": Cylinder,
}
KINDS: dict[str, type[Section]] = {**SHAPES, "file": FileModel, "of": Copy}


def _kind(given: Any) -> str | None:
    """Return the kind of a part's table."""
    if isinstance(given, dict):
        return next((key for key in ("file", "of") if key in given), given.get("shape"))
    return next((kind for kind, table in KINDS.items() if type(given) is table), None)


def _known_kind(given: Any) -> Any:
    if not isinstance(given, dict) or _kind(given) in KINDS:
        return given
    shapes = ", ".join(SHAPES)
    if "shape" not in given:
        elsewhere = {key for table in KINDS.values() for key in table.model_fields}
        for key in map(str, given):
            if key not in elsewhere and nearest(key, ["shape", "file"]):
                remedy = did_you_mean(key, ["shape", "file"])
                raise custom_error(f"unknown key {key!r}", remedy, key)
        raise custom_error(
            "is missing", f'Say what the part is: a shape ({shapes}), file = "...", or of = "...".', "shape"
        )
    raise custom_error(
        f"is not known, got {shown(given['shape'])}", did_you_mean(str(given["shape"]), list(SHAPES)), "shape"
    )


def union_of(kinds: dict[str, type[Section]], which: Callable[[Any], str | None]) -> Any:
    """Return the union type of several kinds of a table; `which` returns the kind of a given table."""
    members = tuple(Annotated[table, Tag(kind)] for kind, table in kinds.items())
    joined: Any = members[0]
    for member in members[1:]:
        joined = joined | member
    return Annotated[joined, Discriminator(which)]


AnyPart: Any = Annotated[union_of(KINDS, _kind), BeforeValidator(_known_kind)]
