"""What a model is put together from: a structure with named surfaces, its place, and, if it is a sector, of how many."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from stickslip.arrays import FloatArray
from stickslip.model.axis import Axis
from stickslip.model.fe.rotation import RotatingSolid
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.rigid.body import RigidBody
from stickslip.model.structure import Structure


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """Contact points on a rigid body.

    Parameters
    ----------
    names
        One a point, e.g. ``L1.1``.
    position
        (p, 3) in m, global axes.
    frame
        (p, 3, 3) columns t, w, n; n points out of the body.
    """

    names: tuple[str, ...]
    position: FloatArray
    frame: FloatArray


@dataclass(frozen=True, eq=False)
class Place:
    """How a copy is put in its place: mirrored, turned, then moved: ``x = turn @ x0 + move``.

    Parameters
    ----------
    turn
        (3, 3) orthogonal matrix; a mirror has determinant -1.
    move
        (3,) in m.
    """

    turn: FloatArray
    move: FloatArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Part:
    """A body of a model before reduction.

    Parameters
    ----------
    structure
        At rest, its cyclic faces free; sets hold x, y, z of each node in turn, or single dofs.
    mesh
        For facets of surfaces and pictures; None for matrices, rigid bodies, lumped masses.
    solid
        What the structure was assembled from, for speeds; None where no speed changes it.
    body
        None unless the part is rigid.
    surfaces
        Named points of a rigid body.
    sectors
        Of the wheel that the part is one sector of; 1: it stands alone.
    faces
        Names of the sets of the low and the high cyclic face.
    axis
        Of rotation.
    n_modes
        Fixed-interface modes kept in the reduction; None: the part is not reduced.
    damping_ratio, between
        Rayleigh damping: the ratio at two circular frequencies (rad/s); zero for none.
    template, place
        Of a copy: the part it copies, whose reduction it shares, and where it stands.
    warnings
        What the user should know.
    """

    structure: Structure
    mesh: SolidMesh | None = None
    solid: RotatingSolid | None = None
    body: RigidBody | None = None
    surfaces: Mapping[str, BodyPoints] = field(default_factory=dict)
    sectors: int = 1
    faces: tuple[str, str] = ("cyclic_low", "cyclic_high")
    axis: Axis = field(default_factory=Axis)
    n_modes: int | None = None
    damping_ratio: float = 0.0
    between: tuple[float, float] = (1.0, 2.0)
    template: "Part | None" = None
    place: Place | None = None
    warnings: tuple[str, ...] = ()
