"""Contacts between neighbouring sectors of a wheel, such as shrouds or touching platforms."""

from collections.abc import Callable

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.pairing import contact_frames
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.model.structure import Structure

MAX_THICKNESS = 1e-3  # thickness of a plane face over its width

Z_AXIS = Axis()


def neighbour_interface(
    wheel: Structure,
    sectors: int,
    law: ContactLaw | Callable[[int], ContactLaw],
    *,
    low: str,
    high: str,
    axis: Axis = Z_AXIS,
    normal: FloatArray | None = None,
) -> Interface:
    """Pair the nodes of the high face of every sector with the nodes of the low face of the next sector.

    Parameters
    ----------
    wheel
        `ReducedWheel.structure` or `wheel`, with the sets ``sector0.low`` and so on, x, y, z of each node.
    sectors
        Number of sectors.
    law
        One law for all contacts, or a function from the index of the node in its set to a law.
    low, high
        Names of the sets; the i-th nodes of both are partners.
    axis
        Axis of the wheel.
    normal
        (3,) outward unit normal of sector 0's high face; None: normal of the plane through its nodes.

    Returns
    -------
    Interface
        Contacts ``sector0.1`` ... in the order of the sectors. t lies in the face along the radius, w = n × t; gaps are
        positive when open. The faces touch at rest; clearances and preloads are parameters of the law.

    Raises
    ------
    InputError
        If the sets do not match, or the nodes of a face do not lie in a plane.
    """
    pitch = 2 * np.pi / sectors
    frame = _frame(wheel, (f"sector0.{low}", f"sector0.{high}"), axis, normal)
    parts = []
    for n in range(sectors):
        here = _nodes(wheel, f"sector{n}.{high}")
        there = _nodes(wheel, f"sector{(n + 1) % sectors}.{low}")
        to_frame = (axis.rotation(n * pitch) @ frame).T
        parts.append(_rows(there, to_frame, wheel.n) - _rows(here, to_frame, wheel.n))
    gaps = scipy.sparse.vstack(parts, format="csr")
    laws = tuple(law(i) if callable(law) else law for i in range(len(here))) * sectors
    names = tuple(f"sector{n}.{i + 1}" for n in range(sectors) for i in range(len(here)))
    return Interface(names, laws, gaps)


def neighbour_gaps(
    sector: Structure, sectors: int, *, low: str, high: str, axis: Axis = Z_AXIS, normal: FloatArray | None = None
) -> tuple[Matrix, Matrix]:
    """Return the gaps between a sector's high face and the low face of the next sector.

    Parameters
    ----------
    sector
        One sector, with the sets `low` and `high`.
    sectors, low, high, axis, normal
        As in `neighbour_interface`.

    Returns
    -------
    own, following
        (3 p, n) CSR each: ``gap = own u^(0) + following u^(1)`` for displacements of both sectors in their own axes,
        rows t, w, n of each pair; for `tuned_wheel`.

    Raises
    ------
    InputError
        As `neighbour_interface` does.
    """
    to_frame = _frame(sector, (low, high), axis, normal).T
    turned = to_frame @ axis.rotation(2 * np.pi / sectors)
    return (-_rows(_nodes(sector, high), to_frame, sector.n), _rows(_nodes(sector, low), turned, sector.n))


def _frame(structure: Structure, names: tuple[str, str], axis: Axis, normal: FloatArray | None) -> FloatArray:
    """Return the (3, 3) columns t, w, n of the high face of sector 0."""
    low, high = names
    own, partner = _nodes(structure, high), _nodes(structure, low)
    if own.shape != partner.shape:
        raise input_error(
            "neighbours",
            f"{high!r} has {len(own)} nodes and {low!r} has {len(partner)}",
            "Keep partners on both faces; the meshes of shrouds match by their order.",
        )
    points = structure.dofs.position[own[:, 0]]
    outward = _plane_normal(points, axis, high) if normal is None else np.asarray(normal, float)
    radial = axis.arm(points.mean(axis=0)[None])[0]
    return np.asarray(contact_frames(outward[None], radial)[0])


def _rows(nodes: IntArray, to_frame: FloatArray, n: int) -> Matrix:
    """Return the (3 p, n) operator to the displacements of nodes (p, 3) in a frame."""
    row = np.arange(nodes.size)
    pick = scipy.sparse.csr_array((np.ones(nodes.size), (row, nodes.ravel())), shape=(nodes.size, n))
    turn = scipy.sparse.kron(scipy.sparse.eye_array(len(nodes)), to_frame, format="csr")
    return scipy.sparse.csr_array(turn @ pick)


def _nodes(wheel: Structure, name: str) -> IntArray:
    """Return the (p, 3) dofs x, y, z of the nodes of a set."""
    index = wheel.dof_set(name)
    nodes = index.reshape(-1, 3) if index.size % 3 == 0 else np.zeros((0, 3), dtype=np.int64)
    components = np.array(wheel.dofs.component)[nodes]
    if not nodes.size or np.any(components != np.array(["x", "y", "z"])):
        raise input_error(
            "neighbours",
            f"the set {name!r} does not hold x, y, z of each of its nodes, in this order",
            "Keep whole nodes in the reduction.",
        )
    return nodes


def _plane_normal(points: FloatArray, axis: Axis, name: str) -> FloatArray:
    """Return the unit normal of the plane through `points`, towards the next sector."""
    spread = points - points.mean(axis=0)
    size, directions = np.linalg.svd(spread, full_matrices=True)[1:]
    if len(points) < 3 or size[1] < MAX_THICKNESS * size[0] or size[2] > MAX_THICKNESS * size[1]:
        raise input_error(
            f"neighbours: {name}",
            f"its {len(points)} nodes do not lie in one plane that they define",
            "Keep three nodes or more of a plane face that are not in a row, or give the normal.",
        )
    ahead = axis.cross @ axis.arm(points.mean(axis=0)[None])[0]
    normal = directions[2]
    return np.asarray(normal if normal @ ahead > 0 else -normal)
