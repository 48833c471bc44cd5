"""Mapping of pressure points to facets, by distance and by the direction of the normal."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.facets import centres, normals, positions
from stickslip.contact.projection import closest, facet_balls
from stickslip.contact.surface import Surface
from stickslip.errors import input_error

CANDIDATE_FACETS = 8  # facets, by their middles, among which the one of a point is looked for
ACROSS = 0.5  # cosine to a facet's normal below which a point rather belongs to another facet
AVERTED = -0.2  # below this the facet belongs to the other side
CLEAR = 0.5  # of the misfit of one sense of all normals to that of the other: there is no doubt
MIXED = 0.01  # share of the area beyond which normals of the wrong sense are no accident


@dataclass(frozen=True, eq=False)
class Feet:
    """Points of a field on facets.

    Parameters
    ----------
    facet, reference
        (n,) facet of each point, and (n, 2) the place on it.
    offset
        (n,) distance to it, m.
    sense
        1 where the normals of the field point out of the body, -1 into it.
    misfit
        (n,) distance in m, longer where the facet looks elsewhere.
    """

    facet: IntArray
    reference: FloatArray
    offset: FloatArray
    sense: float
    misfit: FloatArray


def nearest(surface: Surface, points: FloatArray) -> Feet:
    """Return the nearest facet of each point."""
    middle, _ = facet_balls(surface)
    return _best(surface, points, _near(middle, points), None)


def on_sides(
    surface: Surface, points: FloatArray, area: FloatArray, reach: float, source: str, name: str
) -> tuple[Feet, tuple[str, ...]]:
    """Return the nearest facet that looks as a point's normal does, all normals out of the body or all into it, and warnings.

    Parameters
    ----------
    surface, points
        Facets, and (n, 3) places.
    area
        (n, 3) vectors of areas.
    reach
        Largest distance of a point from its facet, m.
    source, name
        Of the field, and of the surface, for messages.

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
            "Check the axes of its normals: they are those of the sector, as for its points.",
        )
    if min(one, other) < CLEAR * max(one, other):
        return chosen, ()
    text = (
        f"the points of {source} stand {1e3 * float(np.median(chosen.offset)):.3g} mm off {name} (median), too far to tell by its "
        "facets whether the normals point out of the body; they are taken so. Check the place of the points, and the normals."
    )
    return chosen, (text,)


def between_sides(surface: Surface, feet: Feet, points: FloatArray, reach: float) -> float:
    """Return the share of points, each at its nearest facet, that stand more than half as far off as the other side of the body is."""
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
    """Return the best of some facets (n, k) for each point; `side`: normals of facets and points, their sense, the reach."""
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
    """Return the outward unit normals at places (n, 2) on facets (n,)."""
    normal = normals(surface.points, surface.facets[facet], reference)
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))
