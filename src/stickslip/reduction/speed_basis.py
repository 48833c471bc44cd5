"""A travelling wave at all speeds of a range on one small basis, so that a Campbell diagram costs a few full solutions.

The stiffness is ``K_0 + Ω² K_1 + Ω⁴ K_2`` and the Coriolis matrix grows with Ω, both exactly. On a basis that holds the
modes at three speeds they are small dense matrices, exact at these speeds; between them the error is of second order in
what the basis lacks, and is measured at a speed between two of them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.model.dofs import modal_dofs
from stickslip.model.gyroscopic import gyroscopic_modes
from stickslip.model.modes import normal_modes
from stickslip.model.structure import Structure

SPARE = 8  # modes at each speed beyond those followed
DEPENDENT = 1e-10  # eigenvalues of the Gram matrix below are directions that the basis has already


@dataclass(frozen=True, eq=False)
class SpeedBasis:
    """A structure at any speed of a range, on a fixed basis.

    Parameters
    ----------
    speeds
        (3,) ascending, in rad/s, whose modes the basis holds.
    stiffness
        (3, r, r) at these speeds.
    damping
        (r, r) at the last of them.
    error
        Largest relative error of the frequencies at a speed between the first two.
    """

    speeds: FloatArray
    stiffness: ComplexArray
    damping: ComplexArray
    error: float

    def at(self, speed: float) -> Structure:
        """Return the structure at a speed in rad/s, its mass the unit matrix."""
        x, at = speed**2, self.speeds**2
        # Lagrange's interpolation in the square of the speed, which has degree two
        weights = [np.prod([(x - at[j]) / (at[i] - at[j]) for j in range(3) if j != i]) for i in range(3)]
        stiffness = np.einsum("i,ijk->jk", np.array(weights), self.stiffness)
        r = len(stiffness)
        damping = speed / self.speeds[-1] * self.damping
        return Structure(np.eye(r), damping, stiffness, modal_dofs(r))


def speed_basis(
    structure_at: Callable[[float], Structure], speed_range: tuple[float, float], n_modes: int, *, coriolis: bool
) -> SpeedBasis:
    """Return the small model of a family of structures.

    Parameters
    ----------
    structure_at
        Speed in rad/s -> structure.
    speed_range
        Lowest and highest speed.
    n_modes
        Modes that are wanted.
    coriolis
        Whether the damping holds Coriolis terms that count.
    """
    low, high = speed_range
    # in the middle of the squares, on which the stiffness depends
    speeds = np.array([low, np.sqrt((low**2 + high**2) / 2), high])
    family = [structure_at(float(s)) for s in speeds]
    count = min(n_modes + SPARE, int(np.count_nonzero(family[0].mass.diagonal())))

    def modes(structure: Structure) -> tuple[FloatArray, Matrix]:
        found = (gyroscopic_modes if coriolis else normal_modes)(structure, count)
        return found.frequencies_hz, found.shapes

    mass = family[0].mass
    basis = _orthonormal(np.hstack([modes(s)[1] for s in family]), mass)
    small = SpeedBasis(
        speeds,
        np.array([basis.conj().T @ (s.stiffness @ basis) for s in family]),
        basis.conj().T @ (family[-1].damping @ basis),
        np.nan,
    )
    between = float((speeds[0] + speeds[1]) / 2)
    full = modes(structure_at(between))[0][:n_modes]
    reduced = modes(small.at(between))[0][:n_modes]
    error = float(np.max(np.abs(reduced - full) / np.maximum(full, full.max() * 1e-6)))
    return SpeedBasis(small.speeds, small.stiffness, small.damping, error)


def _orthonormal(vectors: Matrix, mass: Matrix) -> ComplexArray:
    """Return a basis of the span of `vectors`, with the unit matrix as its mass."""
    columns = vectors / np.linalg.norm(vectors, axis=0)
    gram = columns.conj().T @ (mass @ columns)
    scale = np.sqrt(np.real(np.diagonal(gram)))
    squares, directions = scipy.linalg.eigh(gram / np.outer(scale, scale))
    kept = squares > DEPENDENT * squares[-1]
    return np.asarray((columns / scale) @ (directions[:, kept] / np.sqrt(squares[kept])))
