"""Static state of an unconstrained rotating solid, such as a ring in a groove or a finite-element damper below platforms."""

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.errors import SingularError
from stickslip.model.fe.factorisation import Solve, factorise
from stickslip.model.fe.rotation import RotatingSolid

ROUNDING_FORCE = 1e-9  # force on a dof over the sum of its terms' magnitudes: less is rounding
# Mismatch of two tied faces in a rigid motion, over its largest displacement. Below this value the mismatch comes from
# coordinates with few digits (5 or more) in the file. Above it the tie hinders the motion: a translation of a sector across
# the axis has a mismatch of 2 sin(pi/n) for n sectors, 3e-3 for 2000.
MISMATCH = 2e-4


def inertia_relief(
    solid: RotatingSolid, tie: Matrix | None = None
) -> tuple[FloatArray, FloatArray, FloatArray | None] | None:
    """Return the static displacement of a free solid under its centrifugal load, in balance with its own inertia.

    The load minus the inertia of the rigid motions that it would cause is in equilibrium and deforms the solid. Contacts carry the
    subtracted part; stresses from these contact forces are neglected.

    Parameters
    ----------
    solid
        The solid.
    tie
        (n, m) sparse: displacements ``tie @ q`` are admissible (a cyclic sector's tie at wave number 0); None: all.

    Returns
    -------
    tuple[FloatArray, FloatArray, FloatArray | None] | None
        (n,) displacement at 1 rad/s in m s², without rigid motion, the (n,) load in N s² that contacts must carry, and the (n,)
        displacement by thermal strain in m, without rigid motion (None without thermal strain); None if supports prevent rigid
        motion.

    Raises
    ------
    SingularError
        If the solid has a motion without strain that is not rigid.
    """
    free = rigid_motions(solid, tie)
    if not free.shape[1]:
        return None
    mass, stiffness = solid.structure.mass, solid.structure.stiffness
    weighted = mass @ free
    square = free.T @ weighted
    carried = weighted @ np.linalg.solve(square, free.T @ solid.centrifugal)
    loads = [solid.centrifugal - carried, *([] if solid.thermal_load is None else [solid.thermal_load])]
    own = free
    if tie is not None:
        loads, own = [tie.T @ load for load in loads], _on(tie, free)
        stiffness = tie.T @ stiffness @ tie
    # as many coordinates are held as there are rigid motions: the load is in equilibrium, so reactions vanish
    _, _, order = scipy.linalg.qr(own.T, mode="economic", pivoting=True)
    rest = np.sort(order[own.shape[1] :])
    solve = _held(scipy.sparse.csr_array(stiffness)[rest][:, rest])
    found = []
    for load in loads:
        moved = np.zeros(own.shape[0])
        moved[rest] = solve(load[rest])
        moved = moved if tie is None else np.asarray(tie @ moved)
        found.append(moved - free @ np.linalg.solve(square, weighted.T @ moved))
    return found[0], carried, found[1] if len(found) > 1 else None


def _held(stiffness: Matrix) -> Solve:
    """Factorise the stiffness of a solid with held rigid motions; an error names the missing support."""
    try:
        return factorise(stiffness)
    except SingularError as error:
        text = (
            "a free solid can move without strain in more ways than rigidly, as few bricks with reduced integration can (C3D20R): "
            f"take C3D20, exact integration, or more bricks ({error})"
        )
        raise SingularError(text) from error


def rigid_motions(solid: RotatingSolid, tie: Matrix | None = None) -> FloatArray:
    """Return the (n, k) rigid motions that neither supports nor the tie prevent; k from 0 to 6.

    Elements never resist rigid motions, even with rounded coordinates. A tie between faces with rounded coordinates does, in
    proportion to the mismatch. Supports and tie therefore have different thresholds.
    """
    places = solid.mesh.points[solid.free]
    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    unit = np.eye(3)
    every = np.empty((solid.mesh.points.size, 6))
    every[:, :3] = np.tile(unit, (len(solid.mesh.points), 1))
    whole = (solid.mesh.points - places.mean(axis=0)) / size
    for k in range(3):
        every[:, 3 + k] = np.cross(unit[k], whole).ravel()
    motions = every[solid.moving]
    stiffness = scipy.sparse.csr_array(solid.structure.stiffness)
    cost = (abs(stiffness) @ np.abs(motions)).max(axis=1, keepdims=True)
    # a point mass without stiffness in a direction moves there at no cost
    hindered = [(stiffness @ motions) / (ROUNDING_FORCE * np.where(cost > 0, cost, 1.0))]
    if tie is not None:
        hindered.append((motions - tie @ _on(tie, motions)) / MISMATCH)
    allowed = np.vstack(hindered)
    _, _, rows = np.linalg.svd(allowed, full_matrices=False)
    whole = np.abs(motions @ rows.T).max(axis=0)
    return np.asarray((motions @ rows.T)[:, np.abs(allowed @ rows.T).max(axis=0) < whole])


def _on(tie: Matrix, motions: FloatArray) -> FloatArray:
    """Return the (m, k) coordinates of the admissible displacements nearest to `motions` (n, k)."""
    square = scipy.sparse.csr_array(tie.T @ tie)
    solve = factorise(square)
    return np.column_stack([solve(np.asarray(tie.T @ column)) for column in motions.T])
