"""Modal coordinates for the disturbances of a motion."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import FloatArray, Matrix, as_array
from stickslip.errors import input_error
from stickslip.model.structure import Structure


@dataclass(frozen=True, eq=False)
class ModalStates:
    """Modal states (p, w) with ``u = basis p``, ``u̇ = ω basis (speed w)``, in the time τ = ωt.

    The basis consists of the mass-normalised modes with all contacts stuck; slip and lift-off reduce the stiffness.
    `speed` scales both halves of a state to similar size.
    """

    omega: float
    stiffness: FloatArray  # (n, n) without contacts, over ω²
    damping: FloatArray  # (n, n), over ω
    speed: FloatArray  # (n,)
    gaps: FloatArray  # (3 n_contacts, n)
    basis: FloatArray  # (n, n)

    @property
    def n(self) -> int:
        """Number of coordinates, half the number of states."""
        return int(self.speed.size)

    def matrix(self, contact_stiffness: FloatArray) -> FloatArray:
        """Return A of ``d(p, w)/dτ = A (p, w)`` for the (n_contacts, 3, 3) stiffness of the contacts."""
        n, speed = self.n, self.speed
        a = np.zeros((2 * n, 2 * n))
        a[:n, n:].flat[:: n + 1] = speed
        rows = self.gaps.reshape(-1, 3, n)
        forces = (contact_stiffness @ rows).reshape(self.gaps.shape) / self.omega**2
        a[n:, :n] = -(self.stiffness + self.gaps.T @ forces) / speed[:, None]
        a[n:, n:] = -self.damping * speed / speed[:, None]
        return a

    def pull(self, rows: FloatArray) -> FloatArray:
        """Return the (n, k) rate of w by unit forces along rows (k, n) of the modal gap operator."""
        return rows.T / (self.omega**2 * self.speed[:, None])


def modal_states(structure: Structure, gap_operator: Matrix, springs: FloatArray, omega: float) -> ModalStates:
    """Decompose a structure with its contacts stuck.

    Parameters
    ----------
    structure
        Real matrices, without structural damping.
    gap_operator
        (3 n_contacts, n).
    springs
        (3 n_contacts,) stiffness of sticking contacts, N/m.
    omega
        Frequency of the motion, rad/s.

    Raises
    ------
    InputError
        If there is structural damping, or a coordinate without mass.
    """
    if structure.loss is not None:
        raise input_error(
            "stability",
            "the structure has structural damping, which is defined for vibration at one frequency and not in time",
            "Use viscous damping: modal_damping with half the loss factor has the same effect at resonance.",
        )
    mass, damping, stiffness, rows = (
        _dense(m) for m in (structure.mass, structure.damping, structure.stiffness, gap_operator)
    )
    stuck = stiffness + rows.T @ (springs[:, None] * rows)
    try:
        values, basis = scipy.linalg.eigh(0.5 * (stuck + stuck.T), mass)
    except np.linalg.LinAlgError as error:
        at = int(np.argmin(np.diag(mass)))
        raise input_error(
            "stability",
            f"the mass matrix is not positive definite (smallest diagonal entry {mass[at, at]:.3g} at {structure.dofs.labels[at]})",
            "Disturbances need a mass on every coordinate: condense the massless ones.",
        ) from error
    speed = np.maximum(1.0, np.sqrt(np.abs(values)) / omega)
    return ModalStates(
        omega, basis.T @ stiffness @ basis / omega**2, basis.T @ damping @ basis / omega, speed, rows @ basis, basis
    )


def _dense(matrix: Matrix) -> FloatArray:
    return np.asarray(as_array(matrix), dtype=float)
