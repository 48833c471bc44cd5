"""Rigid motions of bodies, and the bodies that nothing holds."""

import numpy as np
import scipy.sparse
import scipy.sparse.csgraph

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import SingularError
from stickslip.model.dofs import Dofs

RIGID = 1e-9  # strain energy of a rigid motion over that of single dofs: below, nothing holds it
COMPONENTS = {"x": 0, "y": 1, "z": 2, "rx": 3, "ry": 4, "rz": 5}
SHOWN = 5  # node numbers in a message
NAMES = tuple(
    f"{kind} {axis}" for kind in ("translation along", "rotation about") for axis in "xyz"
)


def refuse_unheld(stiffness: Matrix, dofs: Dofs, place: str) -> None:
    """Raise where a body can move rigidly without strain.

    Parameters
    ----------
    stiffness
        (n, n), real symmetric or complex Hermitian, dense or sparse.
    dofs
        Its n dofs.
    place
        Beginning of the message.

    Raises
    ------
    SingularError
        Naming how many bodies are free, the nodes of the first, and its motions.
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
    """Return the index sets that the stiffness joins, largest first."""
    graph = abs(scipy.sparse.csr_array(stiffness))
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted(parts, key=len, reverse=True)


def _name(dofs: Dofs) -> str:
    """Return ``1200 dofs of nodes 3, 4, 5, …`` or the label of the first dof of a body of no mesh."""
    nodes = np.unique(dofs.node[dofs.node >= 0])
    if not nodes.size:
        return f"the body of dof {dofs.labels[0]} ({len(dofs)} dofs)"
    shown = ", ".join(str(n) for n in nodes[:SHOWN]) + (", …" if len(nodes) > SHOWN else "")
    part = f" of {dofs.part[0]}" if dofs.part[0] else ""
    return f"the body of dof {dofs.labels[0]} ({len(nodes)} nodes{part}: {shown})"


def _free(stiffness: Matrix, dofs: Dofs, part: IntArray) -> str:
    """Return the motions of a body that cost no energy, in words; empty where it is held."""
    if scipy.sparse.issparse(stiffness):
        stiffness = stiffness[part][:, part]
    else:
        stiffness = stiffness[np.ix_(part, part)]
    own = dofs.take(part)
    motions, centre, size = _six_motions(own)
    left, values, right = np.linalg.svd(motions, full_matrices=False)
    kept = values > 1e-9 * max(values[0], 1e-300)
    base = left[:, kept]
    scale = float(np.max(np.abs(stiffness.diagonal()), initial=0.0))
    if scale == 0:
        return "it has no stiffness"
    if not base.shape[1]:
        return ""
    energy = base.conj().T @ (stiffness @ base)
    free, shapes = np.linalg.eigh((energy + energy.conj().T) / 2)
    null = free <= RIGID * scale / len(part)
    if not np.any(null):
        return ""
    six = right[kept].T / values[kept] @ shapes[:, null]  # coefficients of the six motions
    return _motion_names(six, motions, base @ shapes[:, null]) or _screw(six, centre, size)


def _motion_names(six: Matrix, motions: FloatArray, null: Matrix) -> str:
    """Name the motions along and about the axes that span the free ones; empty if they do not."""
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
    rounded = np.round(vector, 9) + 0.0  # no minus before a zero
    return f"({rounded[0]:.3g}, {rounded[1]:.3g}, {rounded[2]:.3g})"


def _six_motions(dofs: Dofs) -> tuple[FloatArray, FloatArray, float]:
    """Return translations and rotations (n, 6) about the centre, the centre, and the body's size.

    Rotations are those of an angle ``1 / size``, so that all columns are of like magnitude.
    """
    place = np.array([COMPONENTS.get(c, -1) for c in dofs.component])
    known = np.all(np.isfinite(dofs.position), axis=1)
    motions = np.zeros((len(dofs), 6))
    moving, turning = np.flatnonzero((place >= 0) & (place < 3) & known), np.flatnonzero(place >= 3)
    if not moving.size:
        return motions, np.zeros(3), 1.0
    centre = dofs.position[moving].mean(axis=0)
    arm = dofs.position[moving] - centre
    size = float(np.max(np.abs(arm))) or 1.0
    direction = np.eye(3)[place[moving]]
    for i in range(3):
        motions[moving, i] = direction[:, i]
        rotated = np.cross(np.eye(3)[i], arm / size)
        motions[moving, 3 + i] = np.sum(rotated * direction, axis=1)
    motions[turning, place[turning]] = 1.0 / size
    return motions, centre, size
