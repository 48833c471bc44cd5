"""Quadrature points on the common pieces of two surfaces, found again on both of them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.facets import DEGREE, interpolation, kinds_of, normals, positions
from stickslip.contact.projection import facet_balls, meet
from stickslip.contact.quadrature import HIGHEST_DEGREE
from stickslip.contact.segmentation import segments
from stickslip.contact.surface import Surface
from stickslip.errors import InputError, input_error

SKIP = "; or leave them out with outside='skip'"

Outside = Literal["error", "skip"]


@dataclass(frozen=True, eq=False)
class SegmentPoints:
    """Quadrature points on the common pieces of two sides' facets, on both sides.

    Parameters
    ----------
    facet_a, facet_b
        (p,) facets.
    on_a, on_b
        (p, 2) reference coordinates there.
    place, partner, normal
        (p, 3) places on both sides, m, and the unit normal of side A.
    weight
        (p,) area, m².
    unpaired
        Facets of side A no part of which has a partner.
    """

    facet_a: IntArray
    facet_b: IntArray
    on_a: FloatArray
    on_b: FloatArray
    place: FloatArray
    partner: FloatArray
    normal: FloatArray
    weight: FloatArray
    unpaired: IntArray


def segment_points(
    a: Surface, b: Surface, *, reach: float | None = None, degree: int | None = None, outside: Outside = "error"
) -> SegmentPoints:
    """Place quadrature points on the common pieces of two sides' facets; see `segment_to_segment`."""
    need_facets("segment_to_segment", a, b)
    radius_a, radius_b = facet_balls(a)[1], facet_balls(b)[1]
    reach = float(max(radius_a.max(), radius_b.max())) if reach is None else reach
    if degree is None:
        highest = [max(DEGREE[int(kind)] for kind in kinds_of(side.facets)) for side in (a, b)]
        degree = min(sum(highest), HIGHEST_DEGREE)
    found = segments(a, b, reach, degree)
    facets_a, facets_b = a.facets[found.facet_a], b.facets[found.facet_b]
    on_a, missed_a = meet(a.points, facets_a, found.place, found.axes)
    places = positions(a.points, facets_a, on_a)
    normal = np.einsum("pk,pkc->pc", interpolation(facets_a, on_a), a.corner_normals()[found.facet_a])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    on_b, missed_b = meet(b.points, facets_b, places, _across(normal))
    _refuse_warped(found.facet_a[np.union1d(missed_a, missed_b)])
    partner = positions(b.points, facets_b, on_b)
    near = np.linalg.norm(partner - places, axis=1) <= reach
    left = np.setdiff1d(np.arange(len(a.facets)), found.facet_a[near])
    if left.size and (outside == "error" or not near.any()):
        raise _without_facet(a, left, reach)
    # the plane of a cell and the curved facet above it differ in area
    own = normals(a.points, facets_a, on_a)
    plane = np.cross(found.axes[:, 0], found.axes[:, 1])
    tilt = np.einsum("pc,pc->p", own, plane) / np.linalg.norm(own, axis=1)
    return SegmentPoints(
        found.facet_a[near],
        found.facet_b[near],
        on_a[near],
        on_b[near],
        places[near],
        partner[near],
        normal[near],
        (found.weight / tilt)[near],
        left,
    )


def _across(normal: FloatArray) -> FloatArray:
    """Return two unit vectors (p, 2, 3) across each unit normal (p, 3)."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def need_facets(place: str, *sides: Surface) -> None:
    """Refuse sides that have none."""
    for name, side in zip("AB"[-len(sides) :], sides, strict=True):
        if len(side.facets) == 0:
            raise input_error(place, f"side {name} has no facets", "Give facets, or pair by node_to_node.")


def _without_facet(a: Surface, left: IntArray, reach: float) -> InputError:
    row = a.facets[left[0]]
    middle = a.points[row[row >= 0]].mean(axis=0)
    return input_error(
        "segment_to_segment",
        f"{len(left)} of {len(a.facets)} facets of side A have no facet of side B opposite to them within {reach:.3g} m, e.g. facet "
        f"{left[0]} at ({', '.join(f'{x:.6g}' for x in middle)}) m",
        "Check that both sides' normals point outward, or raise $reach$outside.",
        outside=SKIP,
        reach="reach",
    )


def _refuse_warped(facets: IntArray) -> None:
    if facets.size:
        raise input_error(
            "segment_to_segment",
            f"points of {np.unique(facets).size} facets of side A, e.g. facet {facets[0]}, cannot be projected on both sides",
            "Facets are folded or too warped there: refine the mesh.",
        )
