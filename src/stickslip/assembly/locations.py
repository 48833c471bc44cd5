"""Dofs and surfaces by name of a surface, node set, node or dof; surfaces with their clamped rim."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.contact.surface import SMOOTH, Surface, nodal_surface, rigid_surface
from stickslip.errors import InputError, did_you_mean, input_error, nearest_and_known
from stickslip.model.mesh.facets import centres, normals
from stickslip.model.mesh.solid_mesh import facets_of
from stickslip.model.part import BodyPoints, Part
from stickslip.model.structure import Dofs, is_numbered, join_dofs

AXES = ("x", "y", "z")
COMPONENTS = (*AXES, "rx", "ry", "rz")
_DOF = re.compile(r"(?:node(\d+)\.)?(\w+)")
_DOF_NUMBER = re.compile(r".*\.dof\d+", re.IGNORECASE)
_NODE = re.compile(r"node(\d+)")
NO_FACETS = np.zeros((0, 3), dtype=np.int64)
NONE: IntArray = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Spot:
    """Surface or dofs with a name in a model.

    Parameters
    ----------
    name
        Name such as ``part.set``.
    part
        Name of the part.
    surface
        Points with motion along x, y, z, and their operators on the dofs of all parts; None for single dofs.
    dofs
        (k,) single dofs; empty for points.
    frame
        (p, 3, 3) columns t, w, n of the frames of the points; None if normals follow from facets.
    labels
        Names of the points; empty without names.
    nodes
        (p, 3) dofs of points that are nodes, -1 if they are clamped; None for points of rigid bodies.
    area
        (p,) areas of the points of a rigid body, m²; None if the points have no own areas.
    """

    name: str
    part: str
    surface: Surface | None
    dofs: IntArray
    frame: FloatArray | None = None
    labels: tuple[str, ...] = ()
    nodes: IntArray | None = None
    area: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Places:
    """Dofs of all parts in one numbering, and their names.

    Parameters
    ----------
    parts
        Name -> part.
    """

    parts: Mapping[str, Part]

    @cached_property
    def dofs(self) -> Dofs:
        """Table of all dofs."""
        return join_dofs({name: part.structure.dofs for name, part in self.parts.items()})

    @property
    def n(self) -> int:
        """Number of dofs."""
        return sum(part.structure.n for part in self.parts.values())

    def offset(self, name: str) -> int:
        """Return the first dof of a part."""
        names = list(self.parts)
        return sum(self.parts[other].structure.n for other in names[: names.index(name)])

    def own(self, name: str) -> IntArray:
        """Return the dofs of a part."""
        first = self.offset(name)
        return np.arange(first, first + self.parts[name].structure.n)

    def bodies(self, held: IntArray | None = None) -> IntArray:
        """Return the dofs of rigid bodies, without bodies that have a dof among `held`."""
        own = [self.own(name) for name, part in self.parts.items() if part.body is not None]
        return stacked(o for o in own if held is None or not np.isin(o, held).any())

    def part_of(self, name: str, place: str) -> Part:
        """Return a part by name; `place` is the study key, for messages."""
        if name not in self.parts:
            known = list(self.parts)
            raise input_error(place, f"there is no part {name!r}", did_you_mean(name, known))
        return self.parts[name]

    def spot(self, name: str, place: str) -> Spot:
        """Return the surface or the dofs with a name.

        Parameters
        ----------
        name
            ``part`` (a rigid body: its centre), ``part.surface``, ``part.set``, ``part.node12``, ``part.node12.x``,
            ``part.rx``.
        place
            Study key of the name, for messages.

        Raises
        ------
        InputError
            If the name is unknown. The message suggests similar names.
        """
        head, _, rest = name.partition(".")
        part = self.part_of(head, place)
        if not rest:
            return self._centre(head, part, place)
        found = None
        if rest in part.surfaces:
            found = self._body_points(name, head, part, part.surfaces[rest])
        elif part.mesh is not None and rest in part.mesh.node_sets:
            found = self._mesh_nodes(name, head, part.mesh.node_sets[rest])
        elif rest in part.structure.sets:
            found = self._dof_set(name, head, part.structure.sets[rest])
        else:
            found = self._node(name, head, rest) or self._dof(name, head, rest)
        if found is None:
            raise _unknown(name, head, part, place)
        _refuse_followers(part, found, place)
        return found

    def _centre(self, head: str, part: Part, place: str) -> Spot:
        if part.body is None:
            raise input_error(
                place,
                f"{head!r} is a part that is not rigid",
                f"Name one of its sets: {', '.join(part.names) or 'it has none'}.",
            )
        frame = np.eye(3)[None]
        point = BodyPoints((head,), np.array([part.body.centre], dtype=float), frame)
        return self._body_points(head, head, part, point)

    def _body_points(self, name: str, head: str, part: Part, points: BodyPoints) -> Spot:
        assert part.body is not None
        own = self.own(head)
        surface = rigid_surface(part.body, points.position, own, self.n, NO_FACETS)
        return Spot(name, head, surface, own[:0], points.frame, points.names, area=points.area)

    def _mesh_nodes(self, name: str, head: str, nodes: IntArray) -> Spot:
        mesh = self.parts[head].mesh
        assert mesh is not None
        facets = facets_of(mesh, nodes)
        place = np.full(len(mesh.points), -1)
        place[nodes] = np.arange(len(nodes))
        return self._nodal(name, head, mesh.numbers[nodes], mesh.points[nodes], _renumbered(facets, place))

    def _dof_set(self, name: str, head: str, members: IntArray) -> Spot:
        table = self.parts[head].structure.dofs
        node, component = table.node[members], np.array(table.component)[members]
        along = np.isin(component, AXES) & (node >= 0)
        first = np.sort(np.unique(node[along], return_index=True)[1])
        numbers = node[along][first]
        if 2 * numbers.size > np.count_nonzero(along):  # no node moves in two directions
            return Spot(name, head, None, self.offset(head) + members)
        position = table.position[members[along]][first]
        return self._nodal(name, head, numbers, position, NO_FACETS)

    def _node(self, name: str, head: str, rest: str) -> Spot | None:
        found, table = _NODE.fullmatch(rest), self.parts[head].structure.dofs
        members = table.node == int(found[1]) if found else np.zeros(0, dtype=bool)
        if found is None or not members.any():
            return None
        position = table.position[members][:1]
        return self._nodal(name, head, table.node[members][:1], position, NO_FACETS)

    def _dof(self, name: str, head: str, rest: str) -> Spot | None:
        found, table = _DOF.fullmatch(rest), self.parts[head].structure.dofs
        if found is None:
            return None
        number = -1 if found[1] is None else int(found[1])
        hits = np.flatnonzero((table.node == number) & (np.array(table.component) == found[2]))
        return Spot(name, head, None, self.offset(head) + hits) if hits.size == 1 else None

    def _nodal(self, name: str, head: str, numbers: IntArray, points: FloatArray, facets: IntArray) -> Spot:
        """Return nodes of a part with their dofs x, y, z; missing dofs count as held."""
        table = self.parts[head].structure.dofs
        rows = node_rows(table, numbers)[:, :3]
        dofs = np.where(rows >= 0, rows + self.offset(head), -1)
        surface = nodal_surface(points, dofs, self.n, facets)
        surface = Surface(surface.points, surface.displacement, facets, numbers=numbers)
        return Spot(name, head, surface, rows[:0, 0], nodes=dofs)

    def rows(self, head: str, numbers: IntArray) -> IntArray:
        """Return the (k, 6) dofs x, y, z, rx, ry, rz of nodes of a part by number; -1 for missing dofs."""
        rows = node_rows(self.parts[head].structure.dofs, numbers)
        return np.where(rows >= 0, rows + self.offset(head), -1)


def _followers(part: Part) -> IntArray:
    """Return the numbers of the nodes that follow others by equations of the part's file."""
    solid = part.solid
    if solid is None or solid.followers is None:
        return NONE
    follows = (np.diff(solid.followers.indptr) > 0) & ~np.isin(np.arange(solid.mesh.points.size), solid.moving)
    return np.asarray(solid.mesh.numbers[follows.reshape(-1, 3).any(axis=1)])


def _refuse_followers(part: Part, found: Spot, place: str) -> None:
    """Refuse a surface with nodes that follow others: they are no coordinates."""
    if found.surface is None or found.surface.numbers is None:
        return
    own = np.intersect1d(found.surface.numbers, _followers(part))
    if own.size:
        raise _following(place, f"{own.size} nodes of {found.name!r}, e.g. node {own[0]},")


def _following(place: str, what: str) -> InputError:
    return input_error(
        place,
        f"{what} follow others by equations of the part's file",
        "Take them out, or name the nodes that they follow: an equation lets the node in the fewest node sets follow.",
    )


def _unknown(name: str, head: str, part: Part, place: str) -> InputError:
    """Return the error about a name that a part does not have."""
    if name.partition(".")[2].upper() in map(str.upper, part.clamped_sets):
        return input_error(
            place, f"every node of {name!r} is clamped", "Name a set whose nodes can move, or clamp less."
        )
    node = _NODE.match(name.partition(".")[2])
    if node is not None and int(node[1]) in _followers(part):
        return _following(place, f"some directions of {name!r}")
    table, n = part.structure.dofs, part.structure.n
    numbered = [is_numbered(component) for component in table.component]
    known = [f"{head}.{word}" for word in part.names]
    if n and all(numbered):
        has = f"The part has {n} dofs, {head}.dof1 to {head}.dof{n}"
        remedy = f"{has}{', and the sets ' if known else ''}{', '.join(known)}."
    elif _DOF_NUMBER.fullmatch(name) and n:
        first = f"{head}.{table.labels[0]}"
        remedy = f"Dofs of this part are called by node and direction: {first!r}."
    else:
        remedy = nearest_and_known(name, known) if known else "The part has no sets."
    return input_error(place, f"there is no surface or set {name!r}", remedy)


def node_rows(table: Dofs, numbers: IntArray) -> IntArray:
    """Return the (k, 6) rows x, y, z, rx, ry, rz of nodes by number in a table of dofs; -1 for missing dofs."""
    order = np.argsort(numbers, kind="stable")
    mine = np.flatnonzero(np.isin(table.node, numbers) & (table.node >= 0))
    at = order[np.searchsorted(numbers, table.node[mine], sorter=order)]
    out = np.full((len(numbers), 6), -1, dtype=np.int64)
    code = {component: i for i, component in enumerate(COMPONENTS)}
    which = np.array([code.get(table.component[i], -1) for i in mine], dtype=np.int64)
    known = which >= 0
    out[at[known], which[known]] = mine[known]
    return out


def stacked(arrays: Iterable[IntArray]) -> IntArray:
    """Return integer arrays concatenated; an empty array for none."""
    return np.concatenate([np.zeros(0, dtype=np.int64), *arrays])


def picked(index: IntArray, n: int) -> Matrix:
    """Return the CSR matrix (len(index), n) that picks entries; rows of zeros where the index is -1."""
    row = np.flatnonzero(index >= 0)
    entries = (np.ones(row.size), (row, index[row]))
    return scipy.sparse.csr_array(entries, shape=(index.size, n))


def clamped_rim(places: Places, spot: Spot) -> tuple[IntArray, IntArray]:
    """Return the facets that continue a surface smoothly onto clamped nodes, and these nodes.

    Nodes are indices of mesh points.

    Returns
    -------
    facets : (m, k) nodes of each facet; empty if the surface has no facets, or contains clamped nodes itself
    nodes : clamped nodes of these facets
    """
    from scipy.spatial import cKDTree

    part, word = places.parts[spot.part], spot.name.partition(".")[2]
    mesh, none = part.mesh, (np.zeros((0, 3), dtype=np.int64), NONE)
    if mesh is None or spot.surface is None or not len(spot.surface.facets):
        return none
    own, still = mesh.node_sets.get(word, NONE), mesh.node_sets.get("root", NONE)
    if part.solid is not None:
        still = np.flatnonzero(~part.solid.free)
    if not still.size or np.isin(own, still).any():
        return none
    both = facets_of(mesh, np.concatenate([own, still]))
    mine = np.isin(both, own) | (both < 0)
    rim = both[np.isin(both, own).any(axis=1) & ~mine.all(axis=1)]
    if not len(rim):
        return none
    kept, lost = (_middles(mesh.points, facets) for facets in (facets_of(mesh, own), rim))
    near = cKDTree(kept[0]).query(lost[0])[1]
    flush = rim[np.einsum("pc,pc->p", lost[1], kept[1][near]) > SMOOTH]
    return flush, np.setdiff1d(flush[flush >= 0], own)


def with_rim(places: Places, spot: Spot) -> Surface:
    """Return the surface of a spot together with its `clamped_rim`, whose clamped nodes have no displacements."""
    assert spot.surface is not None
    surface, mesh = spot.surface, places.parts[spot.part].mesh
    facets, still = clamped_rim(places, spot)
    if mesh is None or not still.size:
        return surface
    own, n = mesh.node_sets[spot.name.partition(".")[2]], len(surface.points)
    place = np.full(len(mesh.points), -1)
    place[own], place[still] = np.arange(n), n + np.arange(len(still))
    moving = surface.displacement.tocsr(copy=True)
    moving.resize((3 * (n + len(still)), moving.shape[1]))
    return Surface(
        np.vstack([surface.points, mesh.points[still]]),
        moving,
        np.vstack([surface.facets, _renumbered(facets, place)]),
        numbers=np.concatenate([mesh.numbers[own], mesh.numbers[still]]),
    )


def _renumbered(facets: IntArray, place: IntArray) -> IntArray:
    """Return facets (m, k) by the new places of their nodes; fillers -1 stay."""
    return np.where(facets >= 0, place[facets], -1)


def _middles(points: FloatArray, facets: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the centres of facets and their unit normals."""
    normal = normals(points, facets, centres(facets))
    own = (facets >= 0)[:, :, None]
    middle = np.sum(points[facets], axis=1, where=own) / own.sum(axis=1)
    return middle, normal / np.linalg.norm(normal, axis=1, keepdims=True)
