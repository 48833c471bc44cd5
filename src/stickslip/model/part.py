"""Parts: a structure with named surfaces, its position, and the number of sectors."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, Protocol, get_args

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.errors import check_choice, input_error
from stickslip.model.axis import Axis
from stickslip.model.damping import Damping
from stickslip.model.fe.cell_laws import Temperature
from stickslip.model.fe.elements import EXACT, Rules
from stickslip.model.fe.links import Links
from stickslip.model.fe.material import Materials
from stickslip.model.fe.rotation import RotatingSolid, rotating_solid
from stickslip.model.matrices_at_speeds import SpeedMatrices
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.rigid.body import BodySolid, RigidBody, from_faces, prism
from stickslip.model.rigid.dampers import CylinderDamper, FlatCurvedDamper, WedgeDamper
from stickslip.model.structure import Structure

FACES = ("cyclic_low", "cyclic_high")
CyclicTie = Literal["node_to_node", "segment_to_segment"]
Damper = FlatCurvedDamper | WedgeDamper | CylinderDamper
Z_AXIS = Axis()


class Reducing(Protocol):
    """Protocol of reductions to some dofs and a few modes, such as `reduction.Reduction`."""

    def of(self, structure: Structure, keep: IntArray) -> Structure:
        """Return a structure reduced to the dofs `keep` and its modes."""
        ...

    @property
    def in_words(self) -> str:
        """Method and number of modes, for a line about the part."""
        ...


@dataclass(frozen=True, eq=False)
class BodyPoints:
    """Contact points on a rigid body.

    Parameters
    ----------
    names
        Name of each point, e.g. ``L1.1``.
    position
        (p, 3) positions in m, global axes.
    frame
        (p, 3, 3) columns t, w, n; n points out of the body.
    area
        (p,) area of each point in m², for laws per area; None if unknown.

    Raises
    ------
    InputError
        If the numbers of names, positions, frames and areas differ, or an area is not positive.
    """

    names: tuple[str, ...]
    position: FloatArray
    frame: FloatArray
    area: FloatArray | None = None

    def __post_init__(self) -> None:
        p = len(self.names)
        if self.position.shape != (p, 3) or self.frame.shape != (p, 3, 3):
            raise input_error(
                "BodyPoints",
                f"{p} names, positions {self.position.shape}, frames {self.frame.shape}",
                "Give (p, 3) positions and (p, 3, 3) frames.",
            )
        if self.area is not None and not (self.area.shape == (p,) and np.all(self.area > 0)):
            raise input_error(
                "BodyPoints.area",
                f"must be {p} positive numbers, got {self.area.tolist()}",
                "Give each point its part of the side's area in m², or none.",
            )


@dataclass(frozen=True, eq=False)
class Place:
    """Placement of a part, which is mirrored, rotated, then translated: ``x = turn @ x0 + move``.

    Parameters
    ----------
    turn
        (3, 3) orthogonal matrix; a mirror has determinant -1.
    move
        (3,) translation in m.

    Raises
    ------
    InputError
        If the matrix is not orthogonal.
    """

    turn: FloatArray
    move: FloatArray

    def __post_init__(self) -> None:
        turn, move = np.asarray(self.turn, dtype=float), np.asarray(self.move, dtype=float)
        if turn.shape != (3, 3) or move.shape != (3,) or not np.allclose(turn @ turn.T, np.eye(3)):
            raise input_error(
                "Place",
                f"turn {turn.tolist()} with move {move.tolist()} is no rigid placement",
                "Give an orthogonal (3, 3) matrix and three metres.",
            )
        object.__setattr__(self, "turn", turn)
        object.__setattr__(self, "move", move)

    def put(self, points: FloatArray) -> FloatArray:
        """Return the points (n, 3) after the placement."""
        return np.asarray(points @ self.turn.T + self.move)

    def then(self, after: "Place") -> "Place":
        """Return the combined placement: this one, then `after`."""
        return Place(after.turn @ self.turn, after.turn @ self.move + after.move)

    @property
    def mirrors(self) -> bool:
        """Whether the placement is a mirror image."""
        return bool(np.linalg.det(self.turn) < 0)

    def keeps(self, axis: Axis) -> bool:
        """Whether the placement is a rotation about `axis` with a translation along it, so that the copy has the same axis."""
        origin = np.asarray(axis.origin, dtype=float)
        near = np.linalg.norm(axis.arm(self.put(origin[None]))) <= 1e-12 * (1 + np.linalg.norm(origin))
        return bool(near and not self.mirrors and np.allclose(self.turn @ axis.unit, axis.unit))


@dataclass(frozen=True, eq=False, kw_only=True)
class Part:
    """A body of a model before reduction.

    Parameters
    ----------
    structure
        Structure at rest with free cyclic faces; sets contain x, y, z of each node in turn, or single dofs.
    mesh
        Mesh for facets of surfaces and pictures; None for matrices, rigid bodies, lumped masses.
    solid
        Rotating solid from which the structure was assembled; None without a mesh.
    turning
        Matrices at several speeds, whose first is the structure; None if there are none. Without `solid` and `turning` the
        structure does not depend on the speed.
    body
        Rigid body; None unless the part is rigid.
    surfaces
        Named points of a rigid body.
    drawn
        Surface of a rigid body in pictures; None if its shape is unknown.
    sectors
        Number of sectors of the wheel, if the part is one of its sectors; 1: no cyclic symmetry.
    faces
        Names of the sets of the low and the high cyclic face.
    cyclic
        Tie of these faces: node to node, or in the mean if their meshes do not match; then the high face is dependent.
    axis
        Axis of rotation.
    reduction
        Reduction of the part; None: no reduction.
    damping
        Damping that replaces the structure's damping matrix; None: the matrix stays.
    template, place
        For a copy: the original part, whose reduction it shares, and its placement; `copy_of` makes one.
    warnings
        Warnings for the user.
    clamped_sets
        Names of sets whose nodes are all clamped, so that nothing can act on them.
    supports
        What holds the part, in words: nodes held by its file and by the study; empty if the file has no nodes.
    own_speed
        Speed in the part's file, rad/s; 0: the file has none. All parts of a model have the same speed.
    alone
        Whether the part is known to be no sector of a wheel, or its faces to be free. Else faces that would meet the part's
        copies in the neighbouring sectors are doubted where nothing holds them.

    Raises
    ------
    InputError
        If `cyclic` is no known word.
    """

    structure: Structure
    mesh: SolidMesh | None = None
    solid: RotatingSolid | None = None
    turning: SpeedMatrices | None = None
    body: RigidBody | None = None
    surfaces: Mapping[str, BodyPoints] = field(default_factory=dict)
    drawn: BodySolid | None = None
    sectors: int = 1
    faces: tuple[str, str] = FACES
    cyclic: CyclicTie = "node_to_node"
    axis: Axis = field(default_factory=Axis)
    reduction: Reducing | None = None
    damping: Damping | None = None
    template: "Part | None" = None
    place: Place | None = None
    warnings: tuple[str, ...] = ()
    clamped_sets: tuple[str, ...] = ()
    supports: str = ""
    own_speed: float = 0.0
    alone: bool = False
    memo: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)  # reductions already computed

    def __post_init__(self) -> None:
        check_choice("Part.cyclic", self.cyclic, get_args(CyclicTie))

    def __repr__(self) -> str:
        """Describe the part in a line."""
        kind = "rigid body" if self.body else "mesh" if self.mesh else "matrices"
        words = [kind, f"{self.structure.n} dofs"]
        if self.sectors > 1:
            words.append(f"one of {self.sectors} sectors")
        if self.template is not None:
            words.append("a copy")
        if self.reduction is not None:
            words.append(self.reduction.in_words)
        names = self.names
        more = ", ..." if len(names) > 8 else ""
        return f"<Part: {'; '.join(words)}; {', '.join(names[:8])}{more}>"

    def __getstate__(self) -> dict[str, Any]:
        """Drop cached values, which can be computed again."""
        own = {f.name: getattr(self, f.name) for f in fields(self)}
        return own | {"memo": {}}

    @property
    def follows_speed(self) -> bool:
        """Whether the part is elastic and its matrices depend on the speed."""
        return self.solid is not None or self.turning is not None

    @property
    def names(self) -> list[str]:
        """Names of the part's surfaces, node sets and sets of dofs."""
        sets = {} if self.mesh is None else self.mesh.node_sets
        return list(dict.fromkeys([*self.surfaces, *sets, *self.structure.sets]))


def solid_part(
    mesh: SolidMesh,
    material: Materials,
    axis: Axis = Z_AXIS,
    *,
    clamped: tuple[str, ...] = ("root",),
    held: BoolArray | None = None,
    quadrature: Rules = EXACT,
    temperature: Temperature | None = None,
    links: Links | None = None,
    **others: Any,
) -> Part:
    """Return a part of finite elements.

    Parameters
    ----------
    mesh, material, axis, clamped, held, quadrature, temperature, links
        As in `rotating_solid`.
    **others
        Further fields of `Part`: ``sectors``, ``faces``, ``reduction``, ``damping``, ``warnings``.
    """
    solid = rotating_solid(
        mesh,
        material,
        axis,
        clamped=clamped,
        held=held,
        quadrature=quadrature,
        links=links,
        temperature=temperature,
    )
    return Part(structure=solid.structure, mesh=mesh, solid=solid, axis=axis, **others)


def structure_part(structure: Structure, **others: Any) -> Part:
    """Return a part of matrices: lumped masses, a beam, matrices from a reader.

    `others` are as in `solid_part`, and ``mesh`` for pictures.
    """
    return Part(structure=structure, **others)


def rigid_part(body: RigidBody, surfaces: Mapping[str, BodyPoints] | None = None, **others: Any) -> Part:
    """Return a rigid part with its contact surfaces by name.

    Pictures derive its shape from these surfaces, unless `others` contains ``drawn``.
    """
    own = dict(surfaces or {})
    if others.get("drawn") is None and own:
        points = np.vstack([one.position for one in own.values()])
        normals = np.vstack([one.frame[:, :, 2] for one in own.values()])
        others["drawn"] = from_faces(points, normals, np.array(body.centre))
    return Part(structure=body.structure(), body=body, surfaces=own, **others)


def damper_part(damper: Damper, **others: Any) -> Part:
    """Return a rigid damper with its sides as surfaces: ``flat`` and ``curved``, or ``left`` and ``right``."""
    points = damper.contact_points()
    surfaces = {}
    for side in dict.fromkeys(points.side):
        own = points.on_sides((side,))
        area = own.area if np.all(np.isfinite(own.area)) else None
        surfaces[side] = BodyPoints(own.names, own.position, own.frame, area)
    return rigid_part(damper.body(), surfaces, drawn=prism(damper.outline(), *damper.ends), **others)
