"""Picture of a model: bodies, loads and supports, and the motion of its points."""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix, TextArray
from stickslip.assembly.contact import GROUND, NEXT
from stickslip.assembly.forces import Load
from stickslip.assembly.full_field import everywhere
from stickslip.assembly.locations import AXES, Places, picked
from stickslip.assembly.model import Model
from stickslip.assembly.skin import mesh_motion
from stickslip.errors import StickslipError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.fe.solid import node_dofs
from stickslip.model.mesh.solid_mesh import coarse_skin
from stickslip.model.part import Part
from stickslip.model.rigid.body import prism
from stickslip.response.system import System

MOST_POINTS = 2_000  # of all meshes together
MOST_DOFS = 60_000  # of models whose motion is recovered, which needs a second reduction
MOST_COORDINATES = 3_000  # of a model that is not reduced
MOST_HARMONICS = {
    False: 7,
    True: 3,
}  # of motions of a structure, and of a wheel, whose harmonics are different waves
SUPPORTED = 1e-9  # share of the largest stiffness above which a lumped mass counts as supported
_MASS = 0.35  # side of a lumped mass over the distance to the next one
_NODE = 0.012  # side of a node without a mesh over the size of its part
_CUBE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


@dataclass(frozen=True, eq=False)
class Scene:
    """Picture of a model, in m along the global axes; lumped masses without positions are drawn in a row, 1 m apart.

    Parameters
    ----------
    points, triangles
        (n, 3) points and (k, 3) triangles of the drawn surfaces.
    part, kind
        (n,) name of the part of each point, and the source of its drawing: ``mesh``, ``section``, ``contact faces``,
        ``node`` or ``mass``.
    contacts
        (p, 3) positions of the contact points.
    load, load_harmonic
        (l,) name of each load, and its harmonic, 0 for a static one.
    load_points, load_directions
        (l, 3) point at which each load acts, and its direction.
    supports
        (s, 3) supported points.
    moving
        Recovery of the motion; None for models that are too large.
    """

    points: FloatArray
    triangles: IntArray
    part: TextArray
    kind: TextArray
    contacts: FloatArray
    load: TextArray
    load_harmonic: IntArray
    load_points: FloatArray
    load_directions: FloatArray
    supports: FloatArray
    moving: "Moving | None" = None


@dataclass(frozen=True, eq=False)
class Moving:
    """Recovery of the motion of a scene's points from the retained coordinates of a response.

    Parameters
    ----------
    system, load
        The model reduced again, in the coordinates of the ways.
    ways
        (3 (n + p), m) matrices from its coordinates to the displacements of the points and contact points, in the
        harmonics from 1 on; a single one applies to all harmonics.
    harmonics
        Highest harmonic of the motion.
    points
        Number n of drawn points.
    """

    system: System
    load: HarmonicLoad
    ways: tuple[Matrix, ...]
    harmonics: int
    points: int

    def at(self, omega: float, retained: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the motion (H, n, 3) of the drawn points and (H, p, 3) of the contact points in the harmonics from 1 on, m.

        Parameters
        ----------
        omega
            Frequency, rad/s.
        retained
            (H+1, r) motion of the retained coordinates.
        """
        known = np.asarray(retained[: self.harmonics + 1])
        condensed = self.system.condensed(self.load, len(known) - 1)
        every = condensed.recover(omega, known)
        found = np.zeros((self.harmonics, self.ways[0].shape[0]), dtype=complex)
        for h in range(1, len(known)):
            found[h - 1] = self.ways[min(h, len(self.ways)) - 1] @ every[h]
        each = found.reshape(self.harmonics, -1, 3)
        return each[:, : self.points], each[:, self.points :]


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Surface of a part.

    It has points, triangles, origin of the drawing, the (3 n, N) operator of the displacements, and the supported
    points (s, 3).
    """

    points: FloatArray
    triangles: IntArray
    kind: str
    rows: Matrix
    supports: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))


def scene_of(model: Model, harmonics: int) -> Scene:
    """Return the picture of a model; `harmonics` is the highest harmonic of the response."""
    places = model.places
    row = _row(places)
    drawn = {name: own for name, part in model.parts.items() if (own := _drawn(model, name, part, row)) is not None}
    each = list(drawn.values())
    counts = [len(own.points) for own in each]
    first = np.cumsum([0, *counts])
    contacts, of_contacts = _contacts(model, row)
    rows = scipy.sparse.vstack([*(own.rows for own in each), of_contacts], format="csr")
    loads = [at for name, load in model.loads.items() if (at := _load(places, name, load, row)) is not None]
    return Scene(
        points=np.vstack([np.zeros((0, 3)), *(own.points for own in each)]),
        triangles=np.vstack(
            [np.zeros((0, 3), dtype=np.int64), *(own.triangles + n for own, n in zip(each, first, strict=False))]
        ),
        part=np.array([name for name, n in zip(drawn, counts, strict=True) for _ in range(n)], dtype=str),
        kind=np.array([own.kind for own, n in zip(each, counts, strict=True) for _ in range(n)], dtype=str),
        contacts=contacts,
        load=np.array([name for name, _, _ in loads], dtype=str),
        load_harmonic=np.array([model.driven[name] for name, _, _ in loads], dtype=np.int64),
        load_points=np.array([point for _, point, _ in loads]).reshape(-1, 3),
        load_directions=np.array([unit for _, _, unit in loads]).reshape(-1, 3),
        supports=np.vstack([np.zeros((0, 3)), *(own.supports for own in each)]),
        moving=_moving(model, harmonics, rows, int(first[-1])),
    )


def _moving(model: Model, harmonics: int, rows: Matrix, points: int) -> Moving | None:
    """Reduce a model again, and return the recovery of the motion in its picture; None if the motion is not drawn."""
    if model.places.n > MOST_DOFS or not rows.shape[0]:
        return None
    wheel = model.sectors > 1
    most = max(h for h in (1, *model.driven.values()))
    highest = max(min(harmonics, MOST_HARMONICS[wheel]), most)
    try:
        whole = everywhere(model, highest)
    except StickslipError:
        return None
    if whole.system.structure.n > MOST_COORDINATES:
        return None
    ways = [whole.way(rows, h) for h in (range(1, highest + 1) if wheel else (1,))]
    return Moving(whole.system, whole.load, tuple(ways), highest, points)


def _row(places: Places) -> dict[int, FloatArray]:
    """Return the drawn positions of dofs of all parts without a position in space: one behind the other along x."""
    free = [
        int(dof)
        for name, part in places.parts.items()
        if part.mesh is None and part.body is None and not _placed(part)
        for dof in places.own(name)
    ]
    return {dof: np.array([float(k), 0.0, 0.0]) for k, dof in enumerate(free)}


def _placed(part: Part) -> bool:
    """Whether the nodes of a part have positions."""
    position = part.structure.dofs.position
    known = position[np.isfinite(position).all(axis=1)]
    return bool(known.size) and bool(np.ptp(known, axis=0).max() > 0)


def _drawn(model: Model, name: str, part: Part, row: dict[int, FloatArray]) -> _Drawn | None:
    """Return the surface of a part; None if it has neither position nor shape."""
    if part.mesh is not None:
        return _of_mesh(model, name, part)
    if part.body is not None:
        return _of_body(model, name, part)
    return _of_nodes(model, name, part) if _placed(part) else _of_masses(model, name, part, row)


def _of_mesh(model: Model, name: str, part: Part) -> _Drawn:
    mesh = part.mesh
    assert mesh is not None
    meshes = [p.mesh for p in model.parts.values() if p.mesh is not None]
    share = len(np.unique(mesh.surface)) / sum(len(np.unique(m.surface)) for m in meshes)
    kept, triangles = coarse_skin(mesh.points, mesh.surface, max(100, int(MOST_POINTS * share)))
    rows = mesh_motion(part, mesh)[node_dofs(kept)] @ picked(model.places.own(name), model.places.n)
    # nodes of a deck's matrices may be condensed; nodes of a solid move unless they are clamped
    held = np.zeros(len(kept), dtype=bool) if part.solid is None else ~part.solid.free[kept]
    return _Drawn(mesh.points[kept], triangles, "mesh", rows, mesh.points[kept][held])


def _of_body(model: Model, name: str, part: Part) -> _Drawn | None:
    if part.drawn is None or part.body is None:
        return None
    points = part.drawn.points
    moved = part.body.displacement_operator(points).reshape(3 * len(points), 6)
    into = picked(model.places.own(name), model.places.n)
    return _Drawn(points, part.drawn.triangles, part.drawn.drawn_from, scipy.sparse.csr_array(moved) @ into)


def _of_nodes(model: Model, name: str, part: Part) -> _Drawn | None:
    """Draw the nodes of a part without a mesh, such as those of a beam, as small cubes."""
    table, first = part.structure.dofs, model.places.offset(name)
    at = np.flatnonzero(np.isfinite(table.position).all(axis=1) & (table.node >= 0))
    numbers, where = np.unique(table.node[at], return_index=True)
    dofs = np.full((numbers.size, 3), -1)
    for k in at:
        if table.component[k] in AXES:
            dofs[np.searchsorted(numbers, table.node[k]), AXES.index(table.component[k])] = first + k
    centres = table.position[at[where]]
    return _cubes(model, centres, _NODE * float(np.ptp(centres, axis=0).max()), dofs, "node")


def _of_masses(model: Model, name: str, part: Part, row: dict[int, FloatArray]) -> _Drawn | None:
    own = model.places.own(name)
    copies = part.structure.sets.get(part.faces[1], own[:0]) if part.sectors > 1 else own[:0]
    own = np.setdiff1d(own, copies + model.places.offset(name))
    table = model.places.dofs
    axis = [AXES.index(table.component[k]) if table.component[k] in AXES else 0 for k in own]
    dofs = np.full((own.size, 3), -1)
    dofs[np.arange(own.size), axis] = own
    centres = np.array([row[int(k)] for k in own]).reshape(-1, 3)
    found = _cubes(model, centres, _MASS, dofs, "mass")
    stiffness = part.structure.stiffness
    net = np.abs(np.asarray(stiffness.sum(axis=1)).ravel())[own - model.places.offset(name)]
    held = net > SUPPORTED * float(np.abs(stiffness.diagonal()).max(initial=0.0))
    above = centres[held] + [0.0, 0.0, _MASS]
    return None if found is None else replace(found, supports=above)


def _cubes(model: Model, centres: FloatArray, side: float, dofs: IntArray, kind: str) -> _Drawn | None:
    if not len(centres):
        return None
    cube = prism(_CUBE * side, -side / 2, side / 2)
    k = len(cube.points)
    points = (centres[:, None, :] + cube.points).reshape(-1, 3)
    triangles = (cube.triangles + k * np.arange(len(centres))[:, None, None]).reshape(-1, 3)
    return _Drawn(points, triangles, kind, picked(np.repeat(dofs, k, axis=0).ravel(), model.places.n))


def _contacts(model: Model, row: dict[int, FloatArray]) -> tuple[FloatArray, Matrix]:
    """Return the positions of the contact points, and the (3 p, N) operator to displacements of the first surfaces."""
    places, pairs = model.places, model.pairs
    position = pairs.position.copy()
    blocks = []
    for name in dict.fromkeys(pairs.groups):
        at = np.flatnonzero(np.array(pairs.groups) == name)
        between = model.contacts[name].between
        spot = places.spot(between[0], f"contact.{name}.between")
        if spot.surface is not None:
            here = scipy.spatial.KDTree(spot.surface.points).query(np.nan_to_num(position[at]))[1]
            rows = (3 * here[:, None] + np.arange(3)).ravel()
            blocks.append((at, scipy.sparse.csr_array(spot.surface.displacement)[rows]))
            continue
        dofs = np.full((at.size, 3), -1)
        dofs[:, 0] = np.resize(spot.dofs, at.size)
        blocks.append((at, picked(dofs.ravel(), places.n)))
        position[at] = [_beside(places, row, int(dof), between[1]) for dof in dofs[:, 0]]
    if not blocks:
        return position, scipy.sparse.csr_array((0, places.n))
    order = np.argsort(np.concatenate([at for at, _ in blocks]), kind="stable")
    stacked = scipy.sparse.vstack([own for _, own in blocks], format="csr")
    return position, stacked[(3 * order[:, None] + np.arange(3)).ravel()]


def _beside(places: Places, row: dict[int, FloatArray], dof: int, other: str) -> FloatArray:
    """Return the position at which a contact of single dofs is drawn.

    It is below a mass that touches the ground, else between both dofs.
    """
    here = row.get(dof, places.dofs.position[dof])
    if other == GROUND or other.startswith(NEXT):
        return np.asarray(here - [0.0, 0.0, _MASS])
    spot = places.spot(other, "contact")
    there = row.get(int(spot.dofs[0]), places.dofs.position[spot.dofs[0]]) if spot.dofs.size else here
    return np.asarray((here + there) / 2)


def _load(
    places: Places, name: str, load: Load, row: dict[int, FloatArray]
) -> tuple[str, FloatArray, FloatArray] | None:
    """Return the name of a load, its point and its direction; None for pressure fields, which act on whole surfaces."""
    if load.field is not None:
        return None
    spot = places.spot(load.on, f"load.{name}.on")
    if spot.surface is not None:
        unit = np.array(load.direction, dtype=float)
        return name, spot.surface.points.mean(axis=0), np.sign(load.newton or 1.0) * unit / np.linalg.norm(unit)
    dof = int(spot.dofs[0])
    component = places.dofs.component[dof]
    unit = np.eye(3)[AXES.index(component) if component in AXES else 0]
    where = row.get(dof, places.dofs.position[dof])
    return (name, np.asarray(where), np.sign(load.newton or 1.0) * unit) if np.isfinite(where).all() else None
