"""Facets at the rim of a surface with clamped nodes, which readers remove from its node set."""

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.assembly.locations import Places, Spot
from stickslip.contact.facets import centres, normals
from stickslip.contact.surface import SMOOTH, Surface
from stickslip.model.mesh.solid_mesh import facets_of

NONE: IntArray = np.zeros(0, dtype=np.int64)


def clamped_rim(places: Places, spot: Spot) -> tuple[IntArray, IntArray]:
    """Return the facets that continue a surface smoothly on to clamped nodes, and these nodes; indices into the points of its mesh.

    Returns
    -------
    facets : (m, k), none where the surface has no facets of its own or holds clamped nodes itself
    nodes : the clamped ones among them
    """
    from scipy.spatial import cKDTree

    part, word = places.parts[spot.part], spot.name.partition(".")[2]
    mesh, none = part.mesh, (np.zeros((0, 3), dtype=np.int64), NONE)
    if mesh is None or spot.surface is None or not len(spot.surface.facets):
        return none
    own, still = mesh.node_sets.get(word, NONE), mesh.node_sets.get("root", NONE)
    if part.solid is not None:
        still = np.flatnonzero(~np.isin(mesh.numbers, part.structure.dofs.node))
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
    return flush, np.setdiff1d(flush, own)


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
        np.vstack([surface.facets, place[facets]]),
        numbers=np.concatenate([mesh.numbers[own], mesh.numbers[still]]),
    )


def _middles(points: FloatArray, facets: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the middles of facets and their unit normals."""
    normal = normals(points, facets, centres(facets))
    middle = points[facets].mean(axis=1)
    return middle, normal / np.linalg.norm(normal, axis=1, keepdims=True)
