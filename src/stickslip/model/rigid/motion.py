"""Rigid motions of bodies, and detection of unconstrained bodies."""

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import SingularError
from stickslip.model.structure import Dofs

ROUNDING = 1e-12  # extent of a body over its coordinates: with less, all points coincide
RIGID_ENERGY = 1e-9  # strain energy of a rigid motion over the energy of single dofs: with less, the motion is free
COMPONENTS = {"x": 0, "y": 1, "z": 2, "rx": 3, "ry": 4, "rz": 5}
SHOWN_NODES = 5  # largest number of node numbers in a message
NAMES = tuple(f"{kind} {axis}" for kind in ("translation along", "rotation about") for axis in "xyz")


def refuse_unheld(stiffness: Matrix, dofs: Dofs, place: str) -> None:
    """Raise a `SingularError` if a body can move rigidly without strain.

    Parameters
    ----------
    stiffness
        (n, n), real symmetric or complex Hermitian, dense or sparse.
    dofs
        Table of the n dofs.
    place
        Beginning of the message.

    Raises
    ------
    SingularError
        If a body is free; the message names the number of free bodies, the nodes of the first one, and its motions.
    """
    free = [(part, found) for part in _bodies(stiffness) if (found := _free(stiffness, dofs, part))]
    if not free:
        return
    part, found = free[0]
    count = "one body is" if len(free) == 1 else f"{len(free)} bodies are"
    which = "it" if len(free) == 1 else "the first"
    raise SingularError(
        f"{place}: {count} not held, the stiffness is singular; {which}, {_name(dofs.take(part))}, "
        f"can move without strain: {found}. Clamp it, or fix or keep dofs that hold it"
    )


def _bodies(stiffness: Matrix) -> list[IntArray]:
    """Return the index sets of bodies that the stiffness does not couple, largest first."""
    graph = abs(scipy.sparse.csr_array(stiffness))
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted(parts, key=len, reverse=True)


def _name(dofs: Dofs) -> str:
    """Return ``1200 dofs of nodes 3, 4, 5, …``, or for a body without mesh the label of its first dof."""
    nodes = np.unique(dofs.node[dofs.node >= 0])
    if not nodes.size:
        return f"the body of dof {dofs.labels[0]} ({len(dofs)} dofs)"
    shown = ", ".join(str(n) for n in nodes[:SHOWN_NODES]) + (", …" if len(nodes) > SHOWN_NODES else "")
    part = f" of {dofs.part[0]}" if dofs.part[0] else ""
    return f"the body of dof {dofs.labels[0]} ({len(nodes)} nodes{part}: {shown})"


def loose_motions(stiffness: Matrix, dofs: Dofs) -> list[tuple[IntArray, FloatArray]]:
    """Return the bodies that can move without strain: their dofs, and their free motions (m, f) with largest entry one.

    Parameters
    ----------
    stiffness
        (n, n), real symmetric, dense or sparse.
    dofs
        Table of the n dofs. Bodies with other dofs than displacements and rotations of nodes are checked only if small.
    """
    found = []
    for part in _bodies(stiffness):
        shapes = _free_shapes(_own(stiffness, part), dofs.take(part))
        if shapes.shape[1]:
            found.append((part, shapes / np.abs(shapes).max(axis=0)))
    return found


def in_words(dofs: Dofs, shapes: FloatArray) -> str:
    """Describe rigid motions (n, f) of dofs: ``translation along x, rotation about z``."""
    motions, centre, size = _six_motions(dofs)
    basis = np.linalg.qr(shapes)[0]
    six, *_ = np.linalg.lstsq(motions, basis, rcond=1e-9)
    if np.linalg.norm(motions @ six - basis) > 1e-6:  # dofs without position take part
        most = [dofs.labels[int(np.argmax(np.abs(shape)))] for shape in shapes.T]
        return f"moving without strain, {', '.join(dict.fromkeys(most))} the most"
    return _motion_names(six, motions, basis) or _screw(six, centre, size)


def _own(stiffness: Matrix, part: IntArray) -> Matrix:
    if scipy.sparse.issparse(stiffness):
        return stiffness[part][:, part]
    return stiffness[np.ix_(part, part)]


def _free(stiffness: Matrix, dofs: Dofs, part: IntArray) -> str:
    """Describe the motions of a body without strain energy; empty if there are none."""
    own, table = _own(stiffness, part), dofs.take(part)
    if not np.any(own.diagonal()):
        return "it has no stiffness"
    shapes = _free_shapes(own, table, judged=0)
    return in_words(table, shapes) if shapes.shape[1] else ""


def _free_shapes(stiffness: Matrix, dofs: Dofs, judged: int = 1000) -> Matrix:
    """Return the (n, f) motions of a body without strain energy; bodies without positions only up to `judged` dofs."""
    motions, _, _ = _six_motions(dofs)
    left, values, _ = np.linalg.svd(motions, full_matrices=False)
    base = left[:, values > 1e-9 * max(values[0], 1e-300)]
    if not base.shape[1] and len(dofs) <= judged:
        base = np.eye(len(dofs))
    scale = float(np.max(np.abs(stiffness.diagonal()), initial=0.0))
    energy = base.conj().T @ (stiffness @ base)
    free, shapes = np.linalg.eigh((energy + energy.conj().T) / 2)
    return base @ shapes[:, free <= RIGID_ENERGY * scale / len(dofs)]


def _motion_names(six: Matrix, motions: FloatArray, null: Matrix) -> str:
    """Name the motions along and about the axes that span the free motions; empty if they do not span them."""
    norms = np.linalg.norm(motions, axis=0)
    inside = np.linalg.norm(null.conj().T @ motions, axis=0) > (1 - 1e-9) * norms
    chosen = inside & (norms > 1e-9 * norms.max())
    if np.linalg.matrix_rank(motions[:, chosen]) < six.shape[1]:
        return ""
    return ", ".join(name for name, take in zip(NAMES, chosen, strict=True) if take)


def _screw(six: Matrix, centre: FloatArray, size: float) -> str:
    """Describe free motions that are oblique to the axes."""
    if six.shape[1] > 1 or np.iscomplexobj(six):
        return f"{six.shape[1]} combinations of translations and rotations"
    shift, turn = six[:3, 0], six[3:, 0] / size
    if np.linalg.norm(turn) * size < 1e-6 * np.linalg.norm(shift):
        return f"translation along {_triple(shift / np.linalg.norm(shift))}"
    point = centre + np.cross(turn, shift) / (turn @ turn)
    point = size * np.round(point / size, 9)
    return f"rotation about {_triple(turn / np.linalg.norm(turn))} through {_triple(point)} m"


def _triple(vector: FloatArray) -> str:
    rounded = np.round(vector, 9) + 0.0  # turns -0 into 0
    return f"({rounded[0]:.3g}, {rounded[1]:.3g}, {rounded[2]:.3g})"


def _six_motions(dofs: Dofs) -> tuple[FloatArray, FloatArray, float]:
    """Return translations and rotations (n, 6) about the centre, the centre, and the body's size.

    The angle of the rotations is ``1 / size``, so that all columns have similar magnitude.
    """
    place = np.array([COMPONENTS.get(c, -1) for c in dofs.component])
    known = np.all(np.isfinite(dofs.position), axis=1)
    position = dofs.position
    if not known.any():  # a rigid body: all dofs at its centre
        known, position = np.ones(len(dofs), dtype=bool), np.zeros((len(dofs), 3))
    motions = np.zeros((len(dofs), 6))
    moving, turning = np.flatnonzero((place >= 0) & (place < 3) & known), np.flatnonzero(place >= 3)
    if not moving.size:
        return motions, np.zeros(3), 1.0
    centre = position[moving].mean(axis=0)
    arm = position[moving] - centre
    size = float(np.max(np.abs(arm)))
    if size <= ROUNDING * float(np.max(np.abs(position[moving]))):  # all points coincide
        arm, size = np.zeros_like(arm), 1.0
    direction = np.eye(3)[place[moving]]
    for i in range(3):
        motions[moving, i] = direction[:, i]
        rotated = np.cross(np.eye(3)[i], arm / size)
        motions[moving, 3 + i] = np.sum(rotated * direction, axis=1)
    motions[turning, place[turning]] = 1.0 / size
    return motions, centre, size
