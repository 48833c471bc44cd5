"""Bases for a range of speeds: one small basis for all speeds, and modal coordinates that change little with the speed.

The stiffness is exactly ``K_0 + Ω² K_1 + Ω⁴ K_2``, and the Coriolis matrix is proportional to Ω. On a basis of the modes at
three speeds they become small dense matrices. Frequencies are exact at these speeds, so a Campbell diagram costs a few full
solutions. Between the speeds the error is of second order in the error of the basis; it is measured at one speed between two
of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix, as_array
from stickslip.model.modes import gyroscopic_modes, normal_modes
from stickslip.model.structure import Structure, modal_dofs
from stickslip.reduction.basis import in_coordinates, surviving_sets, with_modal_dofs
from stickslip.reduction.choice import Reduction

SPARE_MODES = 8  # modes at each speed beyond those followed
DEPENDENT = 1e-10  # relative eigenvalue of the Gram matrix below which a direction is redundant


@dataclass(frozen=True, eq=False)
class SpeedBasis:
    """A structure at any speed of a range, on a fixed basis.

    Parameters
    ----------
    speeds
        (3,) speeds whose modes span the basis, ascending, rad/s.
    stiffness
        (3, r, r) stiffness at these speeds.
    damping
        (r, r) damping at the last of them.
    error
        Largest relative error of the frequencies at a speed between the first two.
    """

    speeds: FloatArray
    stiffness: ComplexArray
    damping: ComplexArray
    error: float

    def at(self, speed: float) -> Structure:
        """Return the structure at a speed in rad/s; its mass is the unit matrix."""
        x, at = speed**2, self.speeds**2
        # Lagrange interpolation is exact: the stiffness is of degree two in the square of the speed
        weights = [np.prod([(x - at[j]) / (at[i] - at[j]) for j in range(3) if j != i]) for i in range(3)]
        stiffness = np.einsum("i,ijk->jk", np.array(weights), self.stiffness)
        r = len(stiffness)
        damping = speed / self.speeds[-1] * self.damping
        return Structure(np.eye(r), damping, stiffness, modal_dofs(r))


def speed_basis(
    structure_at: Callable[[float], Structure], speed_range: tuple[float, float], n_modes: int, *, coriolis: bool
) -> SpeedBasis:
    """Return the small model of a structure over a range of speeds.

    Parameters
    ----------
    structure_at
        Function from a speed in rad/s to the structure.
    speed_range
        Lowest and highest speed.
    n_modes
        Number of modes to be represented.
    coriolis
        Whether Coriolis terms in the damping are taken into account.
    """
    low, high = speed_range
    # the second speed is in the middle of the squares, on which the stiffness depends
    speeds = np.array([low, np.sqrt((low**2 + high**2) / 2), high])
    family = [structure_at(float(s)) for s in speeds]
    count = min(n_modes + SPARE_MODES, int(np.count_nonzero(family[0].mass.diagonal())))

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
    """Return a mass-orthonormal basis of the span of `vectors`."""
    columns = vectors / np.linalg.norm(vectors, axis=0)
    gram = columns.conj().T @ (mass @ columns)
    scale = np.sqrt(np.real(np.diagonal(gram)))
    squares, directions = scipy.linalg.eigh(gram / np.outer(scale, scale))
    kept = squares > DEPENDENT * squares[-1]
    return np.asarray((columns / scale) @ (directions[:, kept] / np.sqrt(squares[kept])))


MIN_COMMON_COSINE = 0.7  # smallest cosine of the angle between the modal spaces of two states that count as the same


class ModesExchangedError(ValueError):
    """Error: the lowest modes of two states span different spaces, so no rotation aligns them."""


def modes_of(structure: Structure, keep: IntArray, reduction: Reduction) -> Matrix:
    """Return the (n, m) modes that a reduction adds to the static shapes of the kept dofs."""
    return _basis(structure, keep, reduction)[1][:, len(keep) :]


def on_modes_of_others(
    structure: Structure, keep: IntArray, reduction: Reduction, others: Sequence[Matrix]
) -> Structure:
    """Return a structure reduced to the dofs `keep` and modal coordinates that change smoothly from state to state.

    Modes of neighbouring states, such as two speeds, may differ in sign and order, and change fast if frequencies are close.
    The space that they span changes little.

    Parameters
    ----------
    structure
        The structure in one state.
    keep
        (k,) dofs that stay physical.
    reduction
        Reduction of the structure.
    others
        Modes in other states (`modes_of`). With one state, the structure's own modes are rotated to be as close to these as
        possible. With several states, dominant directions of the space that all of them span replace the structure's own modes;
        there are 1.5 times as many.

    Raises
    ------
    ModesExchangedError
        If there is one other state, and its modes span another space.
    """
    small, basis = _basis(structure, keep, reduction)
    static, modes = basis[:, : len(keep)], basis[:, len(keep) :]
    if len(others) > 1:
        common = _spanned(others, structure.mass)
        dofs = with_modal_dofs(structure.dofs.take(keep), common.shape[1])
        return in_coordinates(structure, np.hstack([static, common]), dofs, surviving_sets(structure, keep))
    (other,) = others
    sizes = [np.linalg.norm(_in_mass(m, structure.mass, m), 2) ** 0.5 for m in (modes, other)]
    left, common, right = np.linalg.svd(_in_mass(modes, structure.mass, other))
    if modes.shape != other.shape or common.min(initial=np.inf) < MIN_COMMON_COSINE * sizes[0] * sizes[1]:
        raise ModesExchangedError
    turn = np.eye(small.n, dtype=np.result_type(left, right))
    turn[len(keep) :, len(keep) :] = left @ right
    turned = in_coordinates(replace(small, basis=None), turn, small.dofs, small.sets)
    return replace(turned, basis=structure.expand(basis @ turn))


def _basis(structure: Structure, keep: IntArray, reduction: Reduction) -> tuple[Structure, Matrix]:
    small = reduction.of(replace(structure, basis=None), keep)
    basis: Matrix = small.basis
    return small, as_array(basis)


def _in_mass(one: Matrix, mass: Matrix, other: Matrix) -> Matrix:
    return one.conj().T @ (mass @ other)


def _spanned(modes: Sequence[Matrix], mass: Matrix) -> Matrix:
    """Return the dominant mass-orthonormal directions of the modes of several states, 1.5 times as many as modes of one state."""
    count = max(m.shape[1] for m in modes)
    basis = np.hstack(list(modes))
    most = min(count + (count + 1) // 2, np.linalg.matrix_rank(basis))
    for _ in range(2):  # the second pass removes rounding errors
        basis = basis / np.sqrt(np.einsum("ij,ij->j", basis.conj(), mass @ basis).real)
        values, vectors = np.linalg.eigh(_in_mass(basis, mass, basis))
        basis = basis @ (vectors[:, -most:] / np.sqrt(values[-most:]))
    return np.asarray(basis)
