"""Pressure fields of a flow solver as nodal forces: each point acts on the nearest facet with its normal."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.assembly.locations import Places, Spot, with_rim
from stickslip.contact.projection import facet_balls
from stickslip.contact.surface import Surface
from stickslip.errors import input_error
from stickslip.model.mesh.facets import centres, closest, corner_counts, interpolation, normals, positions

# largest distance of a field from a surface, relative to the surface's size: no flow solver's mesh is so far away
FAR = 0.1
BETWEEN = 0.1  # largest share of points closer to the middle of a thin body than to its surface
AROUND = 8  # neighbouring points from which the pressure is interpolated
# distance of a position from the field, relative to the spacing of its points, above which the field does not cover it
ELSEWHERE = 1.2
BARE = 0.1, 0.25  # share of an uncovered surface: reported, refused
PLANE = 1e-6  # singular values below this share of the largest: the points lie on a line
CANDIDATE_FACETS = 8  # nearest facets, by their centres, among which the facet of a point is selected
ACROSS = 0.5  # cosine to a facet's normal below which another facet is preferred
AVERTED = -0.2  # cosine below which the facet is on the other side
CLEAR = 0.5  # ratio of misfits of both orientations of the normals below which the orientation is certain
MIXED = 0.01  # share of the area above which wrong normals are not accidental


@dataclass(frozen=True, eq=False)
class PressureField:
    """Complex pressure at points of a blade's surface, ``Re(p e^{ihωt})``; real for a static one.

    Parameters
    ----------
    points
        (n, 3) positions in m, in the axes of the model.
    pressure
        (n,) in Pa: positive presses on the surface.
    area
        (n, 3) area vector of each point in m², normal to the surface; all point out of the body, or all into it. None:
        the pressure is interpolated and integrated on the facets of the structure.
    source
        File or origin of the field, for messages.

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
        if shapes != ((n, 3), (n,)) or n < 3 or (self.area is not None and self.area.shape != (n, 3)):
            raise input_error(
                self.source, f"has {shapes[0]} points for {shapes[1]} pressures", "Give (n, 3) and (n,), n from 3 on."
            )

    def on(self, places: Places, name: str, place: str) -> "Projected":
        """Return the field as forces on the nodes of a surface and of its clamped rim.

        `place` is the study key of the surface.

        Raises
        ------
        InputError
            If the surface has no facets, the field is elsewhere, or its normals point partly out of the body and partly
            into it.
        """
        spot = places.spot(name, place)
        surface = _with_facets(spot, place)
        moves = scipy.sparse.csr_array(surface.displacement)
        key = (name, places.n, surface.points.tobytes(), moves.indptr.tobytes(), moves.indices.tobytes())
        if key not in self.memo:
            self.memo[key] = put_on(self, with_rim(places, spot), name)
        found: Projected = self.memo[key]
        return found


@dataclass(frozen=True, eq=False)
class Projected:
    """A pressure field on the nodes of a surface.

    Parameters
    ----------
    force
        (N,) forces on the dofs of all parts, N, without the part on clamped nodes.
    before, after
        (2, 3) resultant force (N) and moment about the origin (N m) of the field, and of the forces on all nodes of the surface.
    clamped
        (3,) force on clamped nodes, N.
    offset
        Largest distance of a point of the field from the surface, m.
    inward
        Whether the normals of the field point into the body.
    warnings
        Warnings for the user.
    """

    force: ComplexArray
    before: ComplexArray
    after: ComplexArray
    clamped: ComplexArray
    offset: float
    inward: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def newton(self) -> float:
        """Magnitude of the resultant force, N."""
        return float(np.linalg.norm(self.after[0]))


def _with_facets(spot: Spot, place: str) -> Surface:
    if spot.surface is None or not len(spot.surface.facets):
        raise input_error(
            place,
            f"{spot.name!r} has no facets, on which a pressure could act",
            "Name a node set that holds whole faces of elements.",
        )
    return spot.surface


@dataclass(frozen=True, eq=False)
class Feet:
    """Projections of the points of a field on facets.

    Parameters
    ----------
    facet, reference
        (n,) facet of each point, and (n, 2) its local coordinates on it.
    offset
        (n,) distance from the facet, m.
    sense
        1 if the normals of the field point out of the body, -1 if they point into it.
    misfit
        (n,) distance, m, enlarged if the normals of facet and point differ.
    """

    facet: IntArray
    reference: FloatArray
    offset: FloatArray
    sense: float
    misfit: FloatArray


def put_on(given: PressureField, surface: Surface, name: str) -> Projected:
    """Return a field as forces on the nodes of a surface; `name` is the name of the surface, for messages.

    Raises
    ------
    InputError
        As `PressureField.on`.
    """
    size = float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    feet = nearest(surface, given.points)
    warnings: tuple[str, ...] = ()
    offset = feet.offset
    farthest = int(offset.argmax())
    if offset[farthest] > FAR * size:
        raise input_error(
            given.source,
            f"has a point {given.points[farthest].tolist()} m that is {offset[farthest]:.3g} m away from {name!r}, "
            f"which is {size:.3g} m large",
            "Check the unit and the axes of its points; the sector's axes hold.",
        )
    if given.area is None:
        facet, reference, at, forces, bare = _integrated(given, surface, feet)
        warnings = _bare(bare, given.source, name)
        if between_sides(surface, feet, given.points, FAR * size) > BETWEEN:
            text = (
                f"the points of {given.source} stand {1e3 * float(np.median(offset)):.3g} mm off {name} (median), where it is so "
                "thin that the pressures of both its sides are mixed. Put the points in place, or give area_m2 and the normals."
            )
            warnings = (*warnings, text)
    else:
        feet, warnings = on_sides(surface, given.points, given.area, FAR * size, given.source, name)
        facet, reference, at, offset = feet.facet, feet.reference, given.points, feet.offset
        forces = -feet.sense * given.pressure[:, None] * given.area
    nodes = surface.facets[facet]
    weights = interpolation(nodes, reference)
    on_nodes = np.zeros((len(surface.points), 3), dtype=complex)
    np.add.at(on_nodes, np.maximum(nodes, 0), weights[:, :, None] * forces[:, None])
    moves = scipy.sparse.csr_array(surface.displacement)
    still = (np.diff(moves.indptr) == 0).reshape(-1, 3)
    return Projected(
        moves.T @ on_nodes.ravel(),
        _sums(at, forces),
        _sums(surface.points, on_nodes),
        np.where(still, on_nodes, 0).sum(axis=0),
        float(offset.max()),
        feet.sense < 0,
        warnings,
    )


def _sums(points: FloatArray, forces: ComplexArray) -> ComplexArray:
    """Return the (2, 3) force and moment about the origin of forces (n, 3)."""
    return np.array([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])


def _integrated(
    given: PressureField, surface: Surface, feet: Feet
) -> tuple[IntArray, FloatArray, FloatArray, ComplexArray, float]:
    """Integrate the interpolated pressure over the facets.

    Return quadrature points on the facets, their positions, the forces there, and the uncovered area share.
    """
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
    theirs = unit_normals(surface, feet.facet, feet.reference)
    pressure, elsewhere = _interpolated(given, theirs, place, unit_normals(surface, f, r))
    size = np.linalg.norm(area, axis=1)
    return f, r, place, -pressure[:, None] * area, float(size[elsewhere].sum() / size.sum())


def _bare(share: float, source: str, name: str) -> tuple[str, ...]:
    """Warn of a field that covers a surface only partly, or refuse it."""
    told, refused = BARE
    if share <= told:
        return ()
    why = f"leaves {100 * share:.0f} % of the area of {name!r} without a point near that looks the same way"
    remedy = "Name a set of the faces that the field covers, or give area_m2 and the normals."
    if share > refused:
        raise input_error(source, why, remedy)
    return (f"{source} {why}: the nearest pressure acts there, too. {remedy}",)


def _interpolated(
    given: PressureField, theirs: FloatArray, places: FloatArray, outward: FloatArray
) -> tuple[ComplexArray, BoolArray]:
    """Return the pressure at positions, and where the field does not cover them.

    A plane is fitted through the nearest points, with larger weights for nearer ones; the result stays within their
    range. Points count as nearer if the normals of their facets, `theirs`, are similar to the normals at the positions,
    `outward`: a thin body has another pressure on its other side. The plane lies along the surface, so that points may
    be off the surface.
    """
    from scipy.spatial import cKDTree

    count = min(AROUND, len(given.points))
    apart = cKDTree(given.points).query(given.points, k=count)[0][:, -1]
    far = float(np.median(apart))
    tree = cKDTree(np.hstack([given.points, far * theirs]))
    away, near = tree.query(np.hstack([places, far * outward]), k=count)
    reach = away[:, -1:] * 1.001 + np.finfo(float).tiny
    weight = (1 - (away / reach) ** 2) ** 2
    shift = (given.points[near] - places[:, None]) / reach[:, :, None]
    shift -= np.einsum("pkc,pc->pk", shift, outward)[:, :, None] * outward[:, None]
    rows = np.concatenate([np.ones((*shift.shape[:2], 1)), shift], axis=2)
    inverse = np.linalg.pinv(weight[:, :, None] * rows, rcond=PLANE)
    values = given.pressure[near]
    found = np.einsum("pk,pk->p", inverse[:, 0], weight * values)
    # the pressure stays within the range of the surrounding points
    low, high = (part(values.real, axis=1) for part in (np.min, np.max))
    below, above = (part(values.imag, axis=1) for part in (np.min, np.max))
    inside = np.clip(found.real, low, high) + 1j * np.clip(found.imag, below, above)
    return np.asarray(inside), away[:, 0] > ELSEWHERE * far


def nearest(surface: Surface, points: FloatArray) -> Feet:
    """Return the nearest facet of each point."""
    middle, _ = facet_balls(surface)
    return _best(surface, points, _near(middle, points), None)


def on_sides(
    surface: Surface, points: FloatArray, area: FloatArray, reach: float, source: str, name: str
) -> tuple[Feet, tuple[str, ...]]:
    """Return the nearest facet with the normal of each point, and warnings.

    All normals point out of the body, or all into it.

    Parameters
    ----------
    surface, points
        Facets, and (n, 3) positions.
    area
        (n, 3) area vectors.
    reach
        Largest distance of a point from its facet, m.
    source, name
        Names of the field and of the surface, for messages.

    Raises
    ------
    InputError
        If normals point partly out of the body and partly into it, or along its surface.
    """
    middle, _ = facet_balls(surface)
    facing = unit_normals(surface, np.arange(len(surface.facets)), centres(surface.facets))
    size = np.linalg.norm(area, axis=1)
    unit = area / size[:, None]
    there = _near(middle, points)
    found = {}
    for sense in (1.0, -1.0):
        alike = np.hstack([middle, reach * facing]), np.hstack([points, sense * reach * unit])
        candidates = np.hstack([there, _near(*alike)])
        found[sense] = _best(surface, points, candidates, (facing, unit, sense, reach))

    def mean(feet: Feet, rows: BoolArray) -> float:
        return float(np.sqrt(np.sum(feet.misfit[rows] ** 2 * size[rows]) / size[rows].sum()))

    def differing(feet: Feet, against: Feet) -> BoolArray:
        """Return the points that the other sense fits far better, if others are at home in this one or these nowhere."""
        wrong = against.misfit < CLEAR * feet.misfit
        few = size[wrong].sum() <= MIXED * size.sum()
        if few or wrong.all():
            return wrong & False
        apart = mean(feet, ~wrong) < CLEAR * mean(feet, wrong) or mean(feet, wrong) >= reach
        return wrong & apart

    out, into = found[1.0], found[-1.0]
    mixed = min(differing(out, into), differing(into, out), key=np.count_nonzero)
    if mixed.any():
        raise input_error(
            source,
            f"has normals that point out of {name!r} at some points and into it at others: {np.count_nonzero(mixed)} of "
            f"{len(points)} points, {100 * size[mixed].sum() / size.sum():.3g} % of the area, differ from the rest, "
            f"e.g. {points[int(mixed.argmax())].tolist()} m",
            "Let all normals point out of the body; or name a set that holds both sides of it.",
        )
    every = np.ones(len(points), dtype=bool)
    one, other = mean(out, every), mean(into, every)
    chosen = into if other < CLEAR * one else out
    turned = chosen.sense * np.einsum("nc,nc->n", facing[chosen.facet], unit)
    if np.average(turned, weights=size) < ACROSS:
        raise input_error(
            source,
            f"has normals that are not those of {name!r} there: {np.degrees(np.arccos(np.median(turned))):.0f}° off in the median",
            "Check the axes of its normals; the sector's axes hold, as for its points.",
        )
    if min(one, other) < CLEAR * max(one, other):
        return chosen, ()
    text = (
        f"the points of {source} stand {1e3 * float(np.median(chosen.offset)):.3g} mm off {name} (median), too far to tell by its "
        "facets whether the normals point out of the body; they are taken so. Check the place of the points, and the normals."
    )
    return chosen, (text,)


def between_sides(surface: Surface, feet: Feet, points: FloatArray, reach: float) -> float:
    """Return the share of points between both sides of the body.

    They are farther from the nearest facet than half their distance from the other side.
    """
    middle, _ = facet_balls(surface)
    facing = unit_normals(surface, np.arange(len(surface.facets)), centres(surface.facets))
    unit = -facing[feet.facet]
    alike = np.hstack([middle, reach * facing]), np.hstack([points, reach * unit])
    across = _best(surface, points, _near(*alike), (facing, unit, 1.0, reach))
    return float(np.mean(feet.offset > CLEAR * across.misfit))


def _near(middle: FloatArray, points: FloatArray) -> IntArray:
    from scipy.spatial import cKDTree

    count = min(CANDIDATE_FACETS, len(middle))
    return np.asarray(cKDTree(middle).query(points, k=count)[1]).reshape(len(points), count)


def _best(
    surface: Surface, points: FloatArray, candidates: IntArray, side: tuple[FloatArray, FloatArray, float, float] | None
) -> Feet:
    """Return the best of some facets (n, k) for each point.

    `side`: normals of facets and points, orientation, reach.
    """
    n = len(points)
    best, offset = np.full(n, np.inf), np.zeros(n)
    facet, reference = np.zeros(n, dtype=np.int64), np.zeros((n, 2))
    middle, radius = facet_balls(surface)

    def misfit(away: FloatArray, rows: IntArray, facets: IntArray) -> FloatArray:
        if side is None:
            return away
        facing, unit, sense, reach = side
        cosine = sense * np.einsum("nc,nc->n", facing[facets], unit[rows])
        long = away + 2 * radius[facets] * np.maximum(ACROSS - cosine, 0.0)
        return np.where(cosine < AVERTED, reach + away, np.minimum(long, reach))

    for candidate in candidates.T:
        least = np.linalg.norm(middle[candidate] - points, axis=1) - radius[candidate]
        rows = np.flatnonzero(misfit(np.maximum(least, 0.0), np.arange(n), candidate) < best)
        facets = candidate[rows]
        own, _ = closest(surface.points, surface.facets[facets], points[rows])
        foot = positions(surface.points, surface.facets[facets], own)
        away = np.linalg.norm(foot - points[rows], axis=1)
        found = misfit(away, rows, facets)
        better = found < best[rows]
        into = rows[better]
        best[into], offset[into] = found[better], away[better]
        facet[into], reference[into] = facets[better], own[better]
    return Feet(facet, reference, offset, 1.0 if side is None else side[2], best)


def unit_normals(surface: Surface, facet: IntArray, reference: FloatArray) -> FloatArray:
    """Return the outward unit normals at local coordinates (n, 2) on facets (n,)."""
    normal = normals(surface.points, surface.facets[facet], reference)
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))
