"""Cyclic faces of a sector: ties of meshes that do not match, and faces that nothing holds.

Of faces with different meshes the finer one follows the other by a mortar tie. A face that would meet its copies in the
neighbouring sectors, though neither tie nor contact holds them, is refused.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.assembly.contact import NEXT
from stickslip.assembly.locations import node_rows
from stickslip.contact.mortar import mortar_tie
from stickslip.contact.surface import Surface
from stickslip.errors import InputError, input_error
from stickslip.model.axis import Axis
from stickslip.model.mesh.solid_mesh import SolidMesh, facets_of, widths_of
from stickslip.model.part import Part
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.waves import check_sectors

KEY = "cyclic"
SMOOTH = 0.7  # smallest cosine between normals of neighbouring facets of one face
ON_AXIS = 1e-5  # relative to the size of a face, m/m


def unlike_faces(part: Part, ahead: int | None = None) -> CyclicSector:
    """Tie the cyclic faces of a sector by the mortar method.

    Parameters
    ----------
    part
        Part with a mesh. Nodes of its faces are clamped in all directions or in none.
    ahead
        Which face follows, as in `CyclicSector`; None: the one with more free nodes, since each of its nodes then follows few
        others. The matrices of a sector of 95,589 dofs have 12 instead of 34 million entries so.

    Raises
    ------
    InputError
        If there is no mesh, the faces do not cover each other, or a node lies on the axis or is clamped in some
        directions.
    """
    check_sectors("part", part.sectors)
    if part.mesh is None:
        raise input_error(
            KEY,
            "needs a mesh, whose facets are the faces",
            "Give the mesh beside the matrices, or match the faces node by node.",
        )
    sides = [_face(part, name) for name in part.faces]
    moves = [np.flatnonzero(np.all(rows >= 0, axis=1)) for _, rows in sides]
    if ahead is None:
        ahead = -1 if moves[0].size > moves[1].size else 1
    follows, leads = (1, 0) if ahead > 0 else (0, 1)
    (follower, rows), (leader, _) = sides[follows], sides[leads]
    there = part.axis.turned(leader.points, ahead * 2 * np.pi / part.sectors)
    neighbour = Surface(there, leader.displacement, leader.facets, None, leader.numbers)
    try:
        weights = mortar_tie(follower, neighbour, held=np.all(rows < 0, axis=1))
    except InputError as error:
        raise _told(part, error, ahead) from None
    block = scipy.sparse.kron(weights[moves[follows]][:, moves[leads]], np.eye(3))
    low, high = (rows[free].ravel() for (_, rows), free in zip(sides, moves, strict=True))
    return CyclicSector(part.structure, part.sectors, low, high, part.axis, scipy.sparse.csr_array(block), ahead)


def _face(part: Part, name: str) -> tuple[Surface, IntArray]:
    """Return a cyclic face including clamped nodes, and the (n, 3) dofs of its nodes, -1 if they are held."""
    mesh = part.mesh
    assert mesh is not None
    free, held = mesh.node_sets.get(name), _held(part.structure, mesh.numbers)
    if free is None:
        raise input_error(KEY, f"there is no set {name!r} in the mesh", "Name both faces.")
    facets = facets_of(mesh, np.union1d(free, np.flatnonzero(held)))
    facets = facets[_on_face(mesh, facets, free)]
    own = facets >= 0
    nodes, number = np.unique(facets[own], return_inverse=True)
    place = np.full(facets.shape, -1)
    place[own] = number
    rows = node_rows(part.structure.dofs, mesh.numbers[nodes])[:, :3]
    partly = (rows >= 0).any(axis=1) & (rows < 0).any(axis=1)
    if partly.any():
        raise input_error(
            KEY,
            f"node {mesh.numbers[nodes[partly][0]]} of {name!r} is held in part",
            "Hold the nodes of the cyclic faces in all directions or in none, or match the faces node by node.",
        )
    size = float(np.ptp(mesh.points[nodes], axis=0).max(initial=0.0))
    centre = np.linalg.norm(part.axis.arm(mesh.points[nodes]), axis=1) <= ON_AXIS * size
    if centre.any():
        raise input_error(
            KEY,
            f"node {mesh.numbers[nodes[centre][0]]} of {name!r} lies on the axis, where all sectors meet",
            "Match the faces node by node, or give the disk a bore.",
        )
    nothing = scipy.sparse.csr_array((3 * nodes.size, part.structure.n))
    surface = Surface(mesh.points[nodes], nothing, place, numbers=mesh.numbers[nodes])
    return surface, rows


def _on_face(mesh: SolidMesh, facets: IntArray, members: IntArray) -> BoolArray:
    """Return whether facets of a face's nodes and of clamped nodes lie on the face, not on a clamped surface beside it.

    A set may lack clamped nodes: facets with nodes outside of the set count if they touch the set and continue its facets.
    """
    _, normal = _facets(mesh.points, facets)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    here = np.asarray(np.isin(facets, members))
    inside = np.all(here | (facets < 0), axis=1)
    around = np.zeros((len(mesh.points), 3))
    row, column = np.nonzero(here & inside[:, None])
    np.add.at(around, facets[row, column], normal[row])
    mean = np.where(here[:, :, None], around[facets], 0.0).sum(axis=1)
    length = np.linalg.norm(mean, axis=1)
    continues = np.einsum("fc,fc->f", mean, normal) >= SMOOTH * length  # also without such facets: zero
    return np.asarray(inside | (np.any(here, axis=1) & continues))


def _held(structure: Structure, numbers: IntArray) -> BoolArray:
    """Return whether each node of a mesh has no dof."""
    return np.asarray(~(node_rows(structure.dofs, numbers) >= 0).any(axis=1))


def _told(part: Part, error: InputError, ahead: int) -> InputError:
    """Return an error that names the faces instead of the sides of a pairing."""
    low, high = part.faces
    a, b = (high, f"{low!r} of the next sector") if ahead > 0 else (low, f"{high!r} of the previous sector")
    return input_error(
        KEY,
        error.problem.replace("side A", repr(a)).replace("side B", b),
        "Check that the faces have the same outline, the number of sectors and the axis.",
    )


REACH = 1e-4  # largest distance of facets that meet, over the size of the part
OF_NORMALS = 0.1  # weight of normals beside places over the size: they may differ by 1e-3
FACING = 1e-3  # smallest component of a normal along the circumference
LEAST_SECTORS, MOST_SECTORS = 3, 1000  # halves are models with a plane of symmetry
OF_SKIN = 0.02  # smallest share of the skin that makes a part a sector; cut faces of sectors have 6 to 13 %
CORNERS = 3  # nodes of the smallest set that is a face
SAME_SET = 0.8  # smallest share of a set's nodes that meet the nodes of its partner
TRIED = (Axis(), Axis((1.0, 0.0, 0.0)), Axis((0.0, 1.0, 0.0)))


@dataclass(frozen=True, eq=False)
class MeetingFaces:
    """Facets of a part that meet others of the same part, turned by a pitch.

    Parameters
    ----------
    sectors
        Number of sectors of the wheel in which they meet.
    axis
        Axis of that wheel.
    low, high
        Nodes of the facets at the lower and at the higher angle, indices into the points of the mesh.
    share
        Their area on one side over the area of the skin.
    """

    sectors: int
    axis: Axis
    low: IntArray
    high: IntArray
    share: float


def untied_faces(parts: Mapping[str, Part], touched: Iterable[str]) -> list[str]:
    """Return a sentence for each part whose faces meet its copies in other sectors, without tie, contact or join.

    Parameters
    ----------
    parts
        Parts of a model.
    touched
        Surfaces of all contacts and joins, ``part.surface`` or ``next.part.surface``.
    """
    copied = {id(part.template) for part in parts.values() if part.template is not None}
    names = [name.removeprefix(NEXT) for name in touched]
    found = []
    for name, part in parts.items():
        if part.mesh is None or part.solid is None or part.template is not None or id(part) in copied or part.alone:
            continue
        own = tuple(sorted({n.removeprefix(f"{name}.") for n in names if n.startswith(f"{name}.")}))
        key = ("untied_faces", own)
        if key not in part.memo:
            part.memo[key] = _sentence(name, part, part.mesh, own)
        found += part.memo[key]
    return found


def _sentence(name: str, part: Part, mesh: SolidMesh, touched: tuple[str, ...]) -> tuple[str, ...]:
    tied = part.faces if part.sectors > 1 else ()
    free = _free_facets(part, mesh, [s for s in (*touched, *tied) if s in mesh.node_sets])
    axes = (part.axis,) if part.sectors > 1 else dict.fromkeys([part.axis, *TRIED])
    every = [one for axis in axes for one in meeting_faces(mesh, axis, free)]
    if part.sectors > 1:
        fits = [one for one in every if one.sectors == part.sectors]
        return (_of_wheel(name, part, mesh, fits[0]),) if fits else ()
    fits = [one for one in every if one.share >= OF_SKIN]
    return (_of_single(name, part, mesh, fits[0]),) if fits else ()


def _of_single(name: str, part: Part, mesh: SolidMesh, found: MeetingFaces) -> str:
    sets = _sets(mesh, found)
    keys = [f"sectors = {found.sectors}"]
    if sets:
        keys += [f'low_face = "{sets[0][0]}"', f'high_face = "{sets[0][1]}"']
    if found.axis != part.axis:
        keys.append(f"axis_direction = {list(found.axis.direction)}")
    faces = (
        f"{sets[0][0]!r} and {sets[0][1]!r}" if sets else f"two faces, {100 * found.share:.2g} % of its surface each,"
    )
    return (
        f"part.{name} looks like one of {found.sectors} sectors of a wheel, and is computed alone: {faces} meet when turned by "
        f"{360 / found.sectors:.5g}°. Give {', '.join(keys)}; or sectors = 1 where it stands alone."
    )


def _of_wheel(name: str, part: Part, mesh: SolidMesh, found: MeetingFaces) -> str:
    sets = _sets(mesh, found)
    faces = f"{sets[0][0]!r} and {sets[0][1]!r}" if sets else f"faces with {100 * found.share:.2g} % of its surface"
    contact, tie = "a contact", "tie them"
    if sets:
        low, high = sets[0]
        contact = f'a contact between = ["{name}.{high}", "next.{name}.{low}"]'
        tie = f'tie them with low_face = "{low}" and high_face = "{high}"'
    is_tied = any(face in part.structure.sets for face in part.faces)
    remedy = f"Give {contact}" if is_tied else f"Give {contact}, {tie}"
    return (
        f"part.{name}: {faces} of neighbouring sectors touch, but nothing holds them: they pass through each other. "
        f"{remedy}, or leave a gap in the mesh."
    )


def uncoupled(parts: Mapping[str, Part], touched: Iterable[str]) -> bool:
    """Return whether neither ties of cyclic faces nor contacts or joins lead to neighbouring sectors."""
    sectors = [part for part in parts.values() if part.sectors > 1]
    tied = any(face in part.structure.sets for part in sectors for face in part.faces)
    return bool(sectors) and not tied and not any(name.startswith(NEXT) for name in touched)


def meeting_faces(mesh: SolidMesh, axis: Axis, free: BoolArray | None = None) -> list[MeetingFaces]:
    """Return the faces of a mesh that meet others of it when turned by 360°/n, back to back, for each n in ascending order.

    Parameters
    ----------
    mesh
        The mesh; the facets of both faces must match.
    axis
        Axis of the wheel.
    free
        Whether each facet of the skin counts; None: all count.
    """
    skin = facets_of(mesh, np.arange(len(mesh.points)))
    centre, normal = _facets(mesh.points, skin)
    area = np.linalg.norm(normal, axis=1)
    size = float(np.ptp(mesh.points, axis=0).max())
    place, along, angle = _cylindrical(axis, centre, normal / area[:, None])
    counts = np.ones(len(skin), dtype=bool) if free is None else free
    low, high = (np.flatnonzero(counts & (side * along[:, 1] > FACING)) for side in (-1.0, 1.0))
    if not (low.size and high.size) or _extent(angle) > math.pi:
        return []
    from scipy.spatial import cKDTree

    one, other = (np.column_stack([place / size, sign * OF_NORMALS * along]) for sign in (1.0, -1.0))
    near = cKDTree(one[low]).sparse_distance_matrix(cKDTree(other[high]), REACH, output_type="coo_matrix")
    i, j = low[near.row], high[near.col]
    apart = np.mod(angle[j] - angle[i], 2 * math.pi)
    n = np.rint(2 * math.pi / np.maximum(apart, math.pi / MOST_SECTORS)).astype(int)
    whole = np.abs(apart - 2 * math.pi / n) * place[i, 0] <= REACH * size
    fits = whole & (n >= LEAST_SECTORS) & (n <= MOST_SECTORS)
    found = []
    for count in np.unique(n[fits]):
        here = fits & (n == count)
        sides = [np.unique(skin[side[here]]) for side in (i, j)]
        share = float(area[np.unique(i[here])].sum() / area.sum())
        found.append(MeetingFaces(int(count), axis, sides[0][sides[0] >= 0], sides[1][sides[1] >= 0], share))
    return found


def _extent(angle: FloatArray) -> float:
    """Return the angle (rad) that holds all `angle`, the circle without the largest gap; whole wheels have 2π."""
    ordered = np.sort(angle)
    return 2 * math.pi - float(np.diff(ordered, append=ordered[0] + 2 * math.pi).max())


def _facets(points: FloatArray, skin: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the centre (m, 3) of the corners of each facet, and its outward normal (m, 3) with the length of its area, m²."""
    three = np.isin(widths_of(skin), (3, 6))[:, None]
    a, b, c = (points[skin[:, k]] for k in range(3))
    d = a if skin.shape[1] == 3 else np.where(three, a, points[skin[:, min(3, skin.shape[1] - 1)]])
    centre = np.where(three, (a + b + c) / 3, (a + b + c + d) / 4)
    return centre, np.cross(c - a, d - b) / 2  # a triangle is a quadrilateral whose last corner is its first


def _cylindrical(axis: Axis, centre: FloatArray, normal: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return radius and height (m, 2), the components (m, 3) of normals along radius, circumference and axis, and angles, rad."""
    arm = axis.arm(centre)
    radius = np.linalg.norm(arm, axis=1)
    outward = arm / np.where(radius > 0, radius, 1.0)[:, None]
    along = np.column_stack(
        [np.sum(normal * outward, axis=1), np.sum(normal * (outward @ axis.cross.T), axis=1), normal @ axis.unit]
    )
    first = np.linalg.svd(axis.unit[None])[2][1]
    angle = np.arctan2(arm @ (axis.cross @ first), arm @ first)
    return np.column_stack([radius, (centre - np.asarray(axis.origin)) @ axis.unit]), along, angle


def _free_facets(part: Part, mesh: SolidMesh, taken: Iterable[str]) -> BoolArray:
    """Return whether each facet has a node free in all directions and a node outside of the sets in `taken`, each by itself."""
    skin = facets_of(mesh, np.arange(len(mesh.points)))
    assert part.solid is not None
    dofs = np.bincount(part.solid.moving // 3, minlength=len(mesh.points))
    here = skin >= 0
    counts = ((dofs[skin] == 3) & here).any(axis=1)
    for name in taken:
        inside = np.zeros(len(mesh.points), dtype=bool)
        inside[mesh.node_sets[name]] = True
        held = inside | (dofs < 3)
        counts &= ~((held[skin] | ~here).all(axis=1) & (inside[skin] & here).any(axis=1))
    return np.asarray(counts)


def _sets(mesh: SolidMesh, found: MeetingFaces) -> list[tuple[str, str]]:
    """Return the pairs of node sets on the low and on the high face whose nodes meet, the largest first."""
    from scipy.spatial import cKDTree

    moved = found.axis.turned(mesh.points[found.low], 2 * math.pi / found.sectors)
    distance, nearest = cKDTree(mesh.points[found.high]).query(moved)
    image = np.full(len(mesh.points), -1)
    near = distance <= 2 * REACH * float(np.ptp(mesh.points, axis=0).max())
    image[found.low[near]] = found.high[nearest[near]]
    sets = {name: nodes for name, nodes in mesh.node_sets.items() if nodes.size >= CORNERS}
    pairs = []
    for low, here in sets.items():
        if np.mean(image[here] >= 0) < SAME_SET:
            continue
        for high, there in sets.items():
            met = np.intersect1d(image[here], there).size
            if high != low and met >= SAME_SET * max(here.size, there.size):
                pairs.append((met, low, high))
    return [(low, high) for _, low, high in sorted(pairs, key=lambda pair: -pair[0])]
