"""Contact surfaces: nodes, facets, and the operator from coordinates to displacements of the nodes."""

from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.mesh.facets import (
    KINDS,
    centres,
    corner_counts,
    interpolation,
    kinds_of,
    lumped_areas,
    node_normals,
    normals,
)
from stickslip.model.rigid.body import RigidBody
from stickslip.model.structure import Structure

SMOOTH = np.cos(np.radians(30.0))  # facets at a larger angle to the mean normal of a node meet at an edge


@dataclass(frozen=True, eq=False)
class Surface:
    """One side of a contact.

    Parameters
    ----------
    points
        (n, 3) positions of the nodes in metres.
    displacement
        (3 n, n_dofs) sparse operator from the structure's coordinates to the displacements x, y, z of the nodes, node
        by node.
    facets
        (m, k) nodes (positions in `points`) of triangles and quadrilaterals, linear or quadratic: k = 3, 4, 6 or 8,
        corners anticlockwise seen from outside the body, then mid nodes. Shorter rows are padded with -1, so that kinds
        can be mixed. May be empty for node-to-node contacts with given `normals`.
    normals
        (n, 3) outward unit normals at the nodes; None: means of the facets around each node, by angle.
    numbers
        (n,) numbers of the nodes for messages; None: 0 ... n - 1.

    Raises
    ------
    InputError
        If shapes do not fit, a facet names unknown nodes, has no area or is not convex.
    """

    points: FloatArray
    displacement: Matrix
    facets: IntArray
    normals: FloatArray | None = None
    numbers: IntArray | None = None

    def __post_init__(self) -> None:
        n = len(self.points)
        if self.points.shape != (n, 3) or self.displacement.shape[0] != 3 * n:
            raise input_error(
                "Surface",
                f"points {self.points.shape} and {self.displacement.shape[0]} rows of the displacement operator",
                "Give (n, 3) points and three rows for each.",
            )
        if self.normals is not None:
            length = np.linalg.norm(self.normals, axis=-1)
            if self.normals.shape != (n, 3) or np.any(np.abs(length - 1) > 1e-6):
                raise input_error(
                    "Surface.normals",
                    f"need one unit vector for each of {n} nodes, got shape {self.normals.shape}",
                    "Divide each normal by its length.",
                )
        if self.numbers is None:
            object.__setattr__(self, "numbers", np.arange(n))
        _check_facets(self)

    @property
    def used(self) -> IntArray:
        """Nodes that belong to a facet, in ascending order; all nodes if there are no facets."""
        if len(self.facets) == 0:
            return np.arange(len(self.points))
        nodes = np.unique(self.facets)
        return nodes[nodes >= 0]

    def corner_normals(self) -> FloatArray:
        """Return the (m, k, 3) outward unit normals of the facets at their nodes.

        Facets around a node share the mean normal, so that interpolated normals are continuous. At an edge, a facet whose
        own normal deviates from the mean by more than 30 degrees keeps its own.
        """
        if self.normals is not None:
            return np.asarray(self.normals[self.facets])
        own = node_normals(self.points, self.facets)
        mean = self.node_normals()[self.facets]
        own = _unit(own)
        smooth = np.einsum("mkc,mkc->mk", own, mean) >= SMOOTH
        return np.where(smooth[..., None], mean, own)

    def node_normals(self) -> FloatArray:
        """Return the (n, 3) outward unit normals at the nodes; at an edge, the mean of its facets.

        Raises
        ------
        InputError
            If there are neither facets nor normals.
        """
        if self.normals is not None:
            return self.normals
        if len(self.facets) == 0:
            raise input_error(
                "Surface",
                "has neither facets nor normals",
                "Give one of them: the contact frame needs the outward normal of body A.",
            )
        own = node_normals(self.points, self.facets)
        mean = np.zeros((len(self.points), 3))
        real = self.facets >= 0
        np.add.at(mean, self.facets[real], own[real])
        return _unit(mean)

    def tributary_areas(self) -> FloatArray:
        """Return the (n,) tributary area of each node in m²; ones if there are no facets."""
        if len(self.facets) == 0:
            return np.ones(len(self.points))
        areas = np.zeros(len(self.points))
        real = self.facets >= 0
        np.add.at(areas, self.facets[real], lumped_areas(self.points, self.facets)[real])
        return areas

    def at(self, facet: IntArray, reference: FloatArray) -> Matrix:
        """Return the (3 p, n_dofs) operator to the displacements of points on facets.

        Parameters
        ----------
        facet
            (p,) facet of each point.
        reference
            (p, 2) reference coordinates of each point.
        """
        facets = self.facets[facet]
        return self.weighted(np.maximum(facets, 0), interpolation(facets, reference))

    def weighted(self, nodes: IntArray, weights: FloatArray) -> Matrix:
        """Return the (3 p, n_dofs) operator to weighted means of node displacements.

        `nodes` and `weights` have shape (p, k).
        """
        p, k = nodes.shape
        rows = np.repeat(np.arange(p), k)
        shape = (p, len(self.points))
        mean = scipy.sparse.coo_array((weights.ravel(), (rows, nodes.ravel())), shape=shape)
        return scipy.sparse.kron(mean, np.eye(3), format="csr") @ self.displacement


def nodal_surface(points: FloatArray, dofs: IntArray, n: int, facets: IntArray) -> Surface:
    """Return the surface whose nodes have their own dofs.

    Parameters
    ----------
    points
        (n_points, 3) positions in metres.
    dofs
        (n_points, 3) dof indices of x, y, z of each node; -1 for supported components.
    n
        Number of dofs of the whole structure.
    facets
        As in `Surface`.
    """
    row = np.arange(dofs.size)
    free = dofs.ravel() >= 0
    entries = (np.ones(np.count_nonzero(free)), (row[free], dofs.ravel()[free]))
    operator = scipy.sparse.coo_array(entries, shape=(dofs.size, n)).tocsr()
    return Surface(np.asarray(points, dtype=float), operator, np.asarray(facets))


def structure_surface(structure: Structure, facets: IntArray) -> Surface:
    """Return the surface of a structure's own nodes.

    Parameters
    ----------
    structure
        Structure whose coordinates include x, y, z of every node of the surface.
    facets
        (m, k) node numbers as in the structure's table of dofs, otherwise as in `Surface`.

    Raises
    ------
    InputError
        If a coordinate of a node is not in the table.
    """
    table = structure.dofs
    used = np.unique(facets)
    used = used[used >= 0]
    component = np.array(table.component)
    dofs = np.full((len(used), 3), -1, dtype=np.int64)
    for axis, name in enumerate("xyz"):
        rows = np.flatnonzero((component == name) & np.isin(table.node, used))
        dofs[np.searchsorted(used, table.node[rows]), axis] = rows
    missing = used[np.any(dofs < 0, axis=1)]
    if missing.size:
        raise input_error(
            "structure_surface",
            f"{missing.size} nodes have no dofs x, y, z in the structure, e.g. {missing[:5].tolist()}",
            "Keep the surface's nodes in the reduction, or use nodal_surface with -1 for clamped nodes.",
        )
    local = np.where(facets < 0, -1, np.searchsorted(used, facets))
    surface = nodal_surface(table.position[dofs[:, 0]], dofs, structure.n, local)
    return Surface(surface.points, surface.displacement, surface.facets, numbers=used)


def rigid_surface(body: RigidBody, points: FloatArray, dofs: IntArray, n: int, facets: IntArray) -> Surface:
    """Return a surface of a rigid body.

    Parameters
    ----------
    body
        Rigid body that moves the points.
    points, facets
        As in `Surface`.
    dofs
        (6,) dof indices of `body`.
    n
        Number of dofs of the whole structure.
    """
    motion = body.displacement_operator(points).reshape(-1, 6)
    row, column = np.meshgrid(np.arange(len(motion)), dofs, indexing="ij")
    entries = (motion.ravel(), (row.ravel(), column.ravel()))
    operator = scipy.sparse.coo_array(entries, shape=(len(motion), n)).tocsr()
    return Surface(np.asarray(points, dtype=float), operator, np.asarray(facets))


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))


def _check_facets(surface: Surface) -> None:
    facets = surface.facets
    if len(facets) == 0:
        return
    kinds = kinds_of(facets)
    fillers_last = np.all((facets >= 0) == (np.arange(facets.shape[1]) < kinds[:, None]), axis=1)
    unknown = ~(np.isin(kinds, KINDS) & fillers_last)
    if unknown.any():
        row = int(np.flatnonzero(unknown)[0])
        raise input_error(
            "Surface.facets",
            f"facet {row} is {facets[row].tolist()}",
            f"Facets have {', '.join(map(str, KINDS))} nodes; fill shorter rows up with -1 at their end.",
        )
    if facets.max() >= len(surface.points):
        raise input_error(
            "Surface.facets",
            f"names node {facets.max()}, but there are {len(surface.points)} points",
            "Facets count positions in points from 0.",
        )
    mean = normals(surface.points, facets, centres(facets))
    bad = np.zeros(len(facets), dtype=bool)
    for corners in np.unique(corner_counts(facets)):
        rows = np.flatnonzero(corner_counts(facets) == corners)
        edges = np.diff(surface.points[facets[rows][:, [*range(corners), 0, 1]]], axis=1)
        turns = np.einsum("mkc,mc->mk", np.cross(edges[:, :-1], edges[:, 1:]), mean[rows])
        bad[rows] = turns.min(axis=1, initial=np.inf) <= 0
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        raise input_error(
            "Surface.facets",
            f"{np.count_nonzero(bad)} facets have no area or are not convex, e.g. facet {row}, nodes {facets[row].tolist()}",
            "Order the corners around the facet and move nodes apart.",
        )
