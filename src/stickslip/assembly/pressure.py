"""Pressure fields of a flow solver, put on the facets of a structure's surface as forces of its nodes."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.spatial

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.assembly.places import Spot
from stickslip.contact.facets import (
    corner_counts,
    interpolation,
    normals,
    positions,
)
from stickslip.contact.projection import closest
from stickslip.contact.surface import Surface
from stickslip.errors import input_error

NEAR = 8  # facets, by their middles, among which the nearest one is looked for
FAR = 0.1  # of the surface's size: no flow solver's mesh stands so far off
AROUND = 8  # points of a field from which the pressure between them follows
PLANE = 1e-6  # singular values below this share of the largest: the points lie on a line


@dataclass(frozen=True, eq=False)
class PressureField:
    """Complex pressure at points of a blade's surface, ``Re(p e^{ihωt})``; real for a static one.

    Parameters
    ----------
    points
        (n, 3) places in m, in the axes of the model.
    pressure
        (n,) in Pa: positive presses on the surface.
    area
        (n, 3) vector of the area in m² that belongs to each point, normal to the surface, either way; None: the pressure is interpolated
        and integrated on the facets of the structure.
    source
        Where it comes from, for messages.

    Raises
    ------
    InputError
        If shapes do not agree, or there are too few points.
    """

    points: FloatArray
    pressure: ComplexArray
    area: FloatArray | None = None
    source: str = "pressure"
    memo: dict[Any, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        n = len(self.points)
        shapes = (self.points.shape, np.shape(self.pressure))
        if (
            shapes != ((n, 3), (n,))
            or n < 3
            or (self.area is not None and self.area.shape != (n, 3))
        ):
            raise input_error(
                self.source, f"has {shapes[0]} points for {shapes[1]} pressures", "Give (n, 3) and (n,), n from 3 on."
            )  # fmt: skip

    def on(self, spot: Spot, place: str) -> "Projected":
        """Return the field as forces on the nodes of a surface; `place` is the key that names the surface.

        Raises
        ------
        InputError
            If the surface has no facets, or the field lies elsewhere.
        """
        key = (spot.name, spot.part)
        if key not in self.memo:
            self.memo[key] = _projected(self, spot, place)
        found: Projected = self.memo[key]
        return found


@dataclass(frozen=True, eq=False)
class Projected:
    """A pressure field on the nodes of a surface.

    Parameters
    ----------
    force
        (N,) on the dofs of all parts, N; what acts on clamped nodes is in none of them.
    before, after
        (2, 3) force in N and moment about the origin in N m: of the field, and of the forces on all nodes of the surface.
    offset
        Largest distance of a point of the field from the surface, m.
    """

    force: ComplexArray
    before: ComplexArray
    after: ComplexArray
    offset: float

    @property
    def newton(self) -> float:
        """Magnitude of the whole force, N."""
        return float(np.linalg.norm(self.after[0]))


def _projected(given: PressureField, spot: Spot, place: str) -> Projected:
    surface = spot.surface
    if surface is None or not len(surface.facets):
        raise input_error(
            place,
            f"{spot.name!r} has no facets, on which a pressure could act",
            "Name a node set that holds whole faces of elements.",
        )
    size = float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    facet, reference, offset = _nearest(surface, given.points)
    farthest = int(offset.argmax())
    if offset[farthest] > FAR * size:
        raise input_error(
            given.source,
            f"has a point {given.points[farthest].tolist()} m that is {offset[farthest]:.3g} m away from {spot.name!r}, "
            f"which is {size:.3g} m large",
            "Check the unit and the axes of its points: they are those of the sector.",
        )
    if given.area is None:
        facet, reference, at, forces = _integrated(given, surface)
    else:
        at = given.points
        outward = normals(surface.points, surface.facets[facet], reference)
        sign = np.sign(np.einsum("nc,nc->n", outward, given.area))
        forces = -(given.pressure * sign)[:, None] * given.area
    nodes = surface.facets[facet]
    weights = interpolation(nodes, reference)
    on_nodes = np.zeros((len(surface.points), 3), dtype=complex)
    np.add.at(on_nodes, np.maximum(nodes, 0), weights[:, :, None] * forces[:, None])
    force = surface.displacement.T @ on_nodes.ravel()
    before, after = _sums(at, forces), _sums(surface.points, on_nodes)
    return Projected(force, before, after, float(offset.max()))


def _sums(points: FloatArray, forces: ComplexArray) -> ComplexArray:
    """Return the (2, 3) force and moment about the origin of forces (n, 3)."""
    return np.array([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])


def _nearest(surface: Surface, points: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the facet (n,) nearest to each point, the place (n, 2) on it and the distance (n,)."""
    facets = surface.facets
    middle = np.array([surface.points[row[row >= 0]].mean(axis=0) for row in facets])
    count = min(NEAR, len(facets))
    _, near = scipy.spatial.cKDTree(middle).query(points, k=count)
    near = np.asarray(near).reshape(len(points), count)
    best = np.full(len(points), np.inf)
    facet = np.zeros(len(points), dtype=np.int64)
    reference = np.zeros((len(points), 2))
    for candidate in near.T:
        own, _ = closest(surface.points, facets[candidate], points)
        away = np.linalg.norm(positions(surface.points, facets[candidate], own) - points, axis=1)
        better = away < best
        best[better], facet[better], reference[better] = (
            away[better],
            candidate[better],
            own[better],
        )
    return facet, reference, best


def _integrated(
    given: PressureField, surface: Surface
) -> tuple[IntArray, FloatArray, FloatArray, ComplexArray]:
    """Return quadrature points on the facets, their places and the forces of the interpolated pressure there."""
    x, w = np.polynomial.legendre.leggauss(4)
    square = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    weights = np.outer(w, w).ravel()
    u, v = (1 + square.T) / 2
    rules = {4: (square, weights), 3: (np.column_stack([u, v * (1 - u)]), weights * (1 - u) / 4)}
    facet, reference, share = [], [], []
    corners = corner_counts(surface.facets)
    for count, (at, weight) in rules.items():
        rows = np.flatnonzero(corners == count)
        facet.append(np.repeat(rows, len(at)))
        reference.append(np.tile(at, (len(rows), 1)))
        share.append(np.tile(weight, len(rows)))
    f, r, s = np.concatenate(facet), np.concatenate(reference), np.concatenate(share)
    area = normals(surface.points, surface.facets[f], r) * s[:, None]
    place = positions(surface.points, surface.facets[f], r)
    pressure = _interpolated(given, place)
    return f, r, place, -pressure[:, None] * area


def _interpolated(given: PressureField, places: FloatArray) -> ComplexArray:
    """Return the pressure at places: by a plane through the nearest points, the nearer the heavier; between all of them."""
    count = min(AROUND, len(given.points))
    away, near = scipy.spatial.cKDTree(given.points).query(places, k=count)
    reach = away[:, -1:] * 1.001 + np.finfo(float).tiny
    weight = (1 - (away / reach) ** 2) ** 2
    shift = (given.points[near] - places[:, None]) / reach[:, :, None]
    rows = np.concatenate([np.ones((*shift.shape[:2], 1)), shift], axis=2)
    inverse = np.linalg.pinv(weight[:, :, None] * rows, rcond=PLANE)
    values = given.pressure[near]
    found = np.einsum("pk,pk->p", inverse[:, 0], weight * values)
    # no pressure beyond those around it
    low, high = (part(values.real, axis=1) for part in (np.min, np.max))
    below, above = (part(values.imag, axis=1) for part in (np.min, np.max))
    return np.asarray(np.clip(found.real, low, high) + 1j * np.clip(found.imag, below, above))
