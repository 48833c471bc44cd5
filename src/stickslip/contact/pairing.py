"""Kinematics of a contact: pairs of touching points of two surfaces, and the operator from displacements to their gaps.

There are three methods, from the cheapest to the most exact: node to node, node to segment, and segment to segment at
quadrature points ("Mortar-like", Krack, Salles & Thouverez 2017, section 2.2).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.projection import facet_balls, project
from stickslip.contact.segmentation import SKIP, Outside, need_facets, segment_points
from stickslip.contact.surface import Surface
from stickslip.errors import InputError, input_error
from stickslip.model.mesh.facets import positions

PARALLEL = 1e-3  # sine of the smallest angle between the direction of t and a normal
LISTED = 5  # points that a message names
RIM = 1e-6  # overhang below which it is rounding, as a share of a facet's size

Direction = FloatArray | tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Pairing:
    """Pairs of material points of two bodies A and B.

    Parameters
    ----------
    gap_operator
        (3 n_points, n_dofs) sparse; rows t, w, n of each point: ``gap = gap_operator @ u = frameᵀ (u_B − u_A)``.
    positions
        (n_points, 3) positions on side A, m.
    frames
        (n_points, 3, 3) columns t, w, n; n is the outward normal of body A.
    weights
        (n_points,) area in m² of each point; ones without facets. Contact force = weight × law per area.
    initial_gap
        (n_points,) normal distance at rest in m, negative where the bodies overlap.
    unpaired
        Nodes of side A (numbers; for segments: facets of side A) left out with ``outside="skip"``.
    """

    gap_operator: Matrix
    positions: FloatArray
    frames: FloatArray
    weights: FloatArray
    initial_gap: FloatArray
    unpaired: IntArray

    @property
    def n_points(self) -> int:
        """Number of pairs."""
        return len(self.weights)


def contact_frames(normal: FloatArray, direction: Direction) -> FloatArray:
    """Return right-handed frames (p, 3, 3), columns t, w, n.

    Parameters
    ----------
    normal
        (p, 3) unit normals.
    direction
        (3,), or (p, 3) one for each point: its projection on the tangent plane gives t.

    Raises
    ------
    InputError
        If the direction is parallel to a normal.
    """
    along = np.broadcast_to(np.asarray(direction, dtype=float), normal.shape)
    length = np.linalg.norm(along, axis=1)
    t = along - np.einsum("pc,pc->p", normal, along)[:, None] * normal
    size = np.linalg.norm(t, axis=1)
    if not np.all((size > PARALLEL * length) & (length > 0)):
        worst = int(np.argmin(size))
        raise input_error(
            "direction of t",
            f"{tuple(float(x) for x in along[worst])} is parallel to the normal {np.round(normal[worst], 6).tolist()} of point {worst}",
            "Give a direction that is nowhere normal to the surface of body A.",
        )
    t = t / size[:, None]
    return np.stack([t, np.cross(normal, t), normal], axis=2)


def node_to_node(
    a: Surface, b: Surface, *, tolerance: float, direction: Direction = (1.0, 0.0, 0.0), outside: Outside = "error"
) -> Pairing:
    """Pair each node of side A with the nearest node of side B, for matching meshes.

    Parameters
    ----------
    a, b
        The two sides.
    tolerance
        Largest distance of partners, m.
    direction
        Its part in the tangent plane is the tangent t; one for all nodes of A, or (n, 3).
    outside
        Treatment of nodes of A without a partner: ``"error"`` or ``"skip"``.

    Raises
    ------
    InputError
        If a node has no partner, or shares it.
    """
    from scipy.spatial import cKDTree

    nodes, others = a.used, b.used
    distance, nearest = cKDTree(b.points[others]).query(a.points[nodes])
    partner = others[nearest]
    lost = distance > tolerance
    if lost.any() and (outside == "error" or lost.all()):
        raise _without_partner(
            "node_to_node",
            a,
            nodes[lost],
            distance[lost],
            f"node of side B nearer than {tolerance:g} m",
            "Raise the tolerance, match the meshes, or pair by node_to_segment$outside.",
        )
    nodes, partner = nodes[~lost], partner[~lost]
    twice, count = np.unique(partner, return_counts=True)
    if np.any(count > 1):
        shared = int(twice[np.argmax(count)])
        mine = _numbers(a, nodes[partner == shared])
        raise input_error(
            "node_to_node",
            f"nodes {mine} of side A have the same nearest node {_numbers(b, np.array([shared]))[0]} of side B",
            "The meshes do not match: use node_to_segment or segment_to_segment.",
        )
    frames = contact_frames(a.node_normals()[nodes], _of_nodes(direction, nodes))
    one = np.ones((len(nodes), 1))
    return _pairing(
        frames,
        a.points[nodes],
        b.points[partner],
        (a.weighted(nodes[:, None], one), b.weighted(partner[:, None], one)),
        a.tributary_areas()[nodes],
        np.array(_numbers(a, a.used[lost]), dtype=np.int64),
    )


def node_to_segment(
    a: Surface,
    b: Surface,
    *,
    reach: float | None = None,
    tolerance: float | None = None,
    direction: Direction = (1.0, 0.0, 0.0),
    outside: Outside = "error",
) -> Pairing:
    """Pair each node of side A with its closest point on the facets of side B, for non-matching meshes.

    The method is simple and cheap, but does not transfer a uniform pressure exactly. Side A should have the finer mesh.

    Parameters
    ----------
    a, b
        The two sides.
    reach
        Largest distance of partners, m; None: the radius of the largest facet.
    tolerance
        Distance in m by which a node may lie beyond the rim of side B; None: rounding only.
    direction
        Its part in the tangent plane is the tangent t; one for all nodes of A, or (n, 3).
    outside
        Treatment of nodes of A without a partner: ``"error"`` or ``"skip"``.

    Raises
    ------
    InputError
        If a node has no partner on side B.
    """
    need_facets("node_to_segment", b)
    radius_b = facet_balls(b)[1]
    radius_a = facet_balls(a)[1] if len(a.facets) else radius_b
    reach = float(max(radius_a.max(), radius_b.max())) if reach is None else reach
    tolerance = RIM * float(radius_b.min()) if tolerance is None else tolerance
    nodes = a.used
    outward = a.node_normals()[nodes]
    feet = project(a.points[nodes], outward, b, reach)
    lost = feet.overhang > tolerance
    if lost.any() and (outside == "error" or lost.all()):
        beyond = feet.overhang[lost]
        if np.isfinite(beyond).all():
            raise _without_partner(
                "node_to_segment",
                a,
                nodes[lost],
                beyond,
                "facet of side B under them: they stand beyond its rim",
                "Give $rim, or make side B the larger one$outside.",
                rim="a tolerance of the largest of these distances, or more",
            )
        raise _without_partner(
            "node_to_segment",
            a,
            nodes[lost],
            beyond,
            f"facet of side B that faces them within {reach:.3g} m",
            "Check that both sides' normals point outward, raise $reach, or make side B the larger one$outside.",
            reach="reach or tolerance",
        )
    kept, facet, reference = nodes[~lost], feet.facet[~lost], feet.reference[~lost]
    facets = b.facets[facet]
    return _pairing(
        contact_frames(outward[~lost], _of_nodes(direction, kept)),
        a.points[kept],
        positions(b.points, facets, reference),
        (a.weighted(kept[:, None], np.ones((len(kept), 1))), b.at(facet, reference)),
        a.tributary_areas()[kept],
        np.array(_numbers(a, nodes[lost]), dtype=np.int64),
    )


def segment_to_segment(
    a: Surface,
    b: Surface,
    *,
    reach: float | None = None,
    degree: int | None = None,
    direction: Direction = (1.0, 0.0, 0.0),
    outside: Outside = "error",
) -> Pairing:
    """Pair quadrature points on the intersections of both sides' facets: "Mortar-like" contact.

    On plane surfaces a uniform pressure is transferred exactly between any two meshes of triangles and parallelograms.
    Points lie on side A, and their partners along its normal, so that a pair of normal forces has no moment.

    Parameters
    ----------
    a, b
        The two sides.
    reach
        Largest distance of partners, m; None: the radius of the largest facet.
    degree
        Polynomials integrated exactly on each piece; None: products of the shape functions of both sides. The degree of
        the shape functions of one side suffices to transfer a uniform pressure, with fewer points.
    direction
        Its part in the tangent plane is the tangent t.
    outside
        Treatment of facets of A without any partner: ``"error"`` or ``"skip"``. A facet that extends beyond side B is
        used where it faces B.

    Raises
    ------
    InputError
        If a facet has no partner on side B, or the sides are too warped to be projected.
    """
    found = segment_points(a, b, reach=reach, degree=degree, outside=outside)
    frames = contact_frames(found.normal, direction)
    return _pairing(
        frames,
        found.place,
        found.partner,
        (a.at(found.facet_a, found.on_a), b.at(found.facet_b, found.on_b)),
        found.weight,
        found.unpaired,
    )


def paired_interface(
    pairing: Pairing, law: ContactLaw | Callable[[float], ContactLaw], name: str = "contact"
) -> Interface:
    """Return the interface with a law per area at every point of a pairing.

    Parameters
    ----------
    pairing
        Points, gap operator and areas.
    law
        One law for all points, with stiffnesses in N/m³ and pressures in Pa; it assumes that the bodies touch at rest, whatever the
        initial gaps of the pairing. Or a function from the initial gap of a point in m to its law, e.g.
        ``lambda gap: ElasticCoulomb(..., k_n=k_n, preload=-k_n * gap)``.
    name
        Contacts are called ``name.1``, ``name.2`` ...
    """
    points = range(pairing.n_points)
    laws = tuple(law(float(pairing.initial_gap[i])) if callable(law) else law for i in points)
    names = tuple(f"{name}.{i + 1}" for i in points)
    return Interface(names, laws, pairing.gap_operator, pairing.weights)


def _pairing(
    frames: FloatArray,
    places: FloatArray,
    partners: FloatArray,
    motions: tuple[Matrix, Matrix],
    weights: FloatArray,
    unpaired: IntArray,
) -> Pairing:
    """Return the pairing from points of A and B and the operators to their displacements."""
    p = len(places)
    blocks = (frames.transpose(0, 2, 1), np.arange(p), np.arange(p + 1))
    to_frame = scipy.sparse.bsr_array(blocks, shape=(3 * p, 3 * p))
    operator = scipy.sparse.csr_array(to_frame @ (motions[1] - motions[0]))
    operator.eliminate_zeros()
    operator.sort_indices()
    gap = np.einsum("pc,pc->p", frames[:, :, 2], partners - places)
    return Pairing(operator, places, frames, weights, gap, unpaired)


def _of_nodes(direction: Direction, nodes: IntArray) -> Direction:
    return direction[nodes] if isinstance(direction, np.ndarray) and direction.ndim > 1 else direction


def _numbers(surface: Surface, nodes: IntArray) -> list[int]:
    assert surface.numbers is not None
    return [int(number) for number in surface.numbers[nodes]]


def _without_partner(
    place: str, a: Surface, nodes: IntArray, distance: FloatArray, partner: str, remedy: str, **words: str
) -> InputError:
    """Return the error that names nodes of side A without a partner, with their positions and distances."""
    worst = np.argsort(-distance)[:LISTED]
    listed = [
        f"node {_numbers(a, nodes[[i]])[0]} at ({', '.join(f'{round(x, 12):.6g}' for x in a.points[nodes[i]])}) m"
        + (f", {distance[i]:.3g} m off" if np.isfinite(distance[i]) else ", none near")
        for i in worst
    ]
    more = "" if len(nodes) <= LISTED else f" and {len(nodes) - LISTED} more"
    return input_error(
        place,
        f"{len(nodes)} nodes of side A have no {partner}: {'; '.join(listed)}{more}",
        remedy,
        outside=SKIP,
        **words,
    )
