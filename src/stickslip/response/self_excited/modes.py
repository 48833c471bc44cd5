"""Linear modes about the static state, contacts stuck: where every self-excited vibration begins."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix
from stickslip.model.modes import normal_modes, with_springs
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_coordinates
from stickslip.reduction.nodal import own_motions
from stickslip.response.system import System


@dataclass(frozen=True, eq=False)
class StuckMode:
    """A mode of what vibrates in the first harmonic, its contacts stuck.

    Parameters
    ----------
    number
        From 1, by frequency.
    omega
        rad/s, undamped.
    ratio
        Damping ratio by the energy method: the work of all damping and aerodynamic forces along the mode over ``4π`` times its energy.
        Negative: the mode grows.
    shape
        (n,) complex displacement of all coordinates, normalised to unit modal mass; of a wheel whose contacts know a dof in several
        phases also the forces that hold its copies.
    """

    number: int
    omega: float
    ratio: float
    shape: ComplexArray

    @property
    def unstable(self) -> bool:
        """Whether small vibrations grow."""
        return self.ratio < 0.0


def stuck_modes(system: System, count: int, holds: BoolArray | None = None) -> list[StuckMode]:
    """Return the lowest modes of what vibrates in the first harmonic: of a wheel, of the wave that its engine order excites.

    Parameters
    ----------
    system
        What vibrates, and its contacts.
    count
        How many; fewer where there are fewer.
    holds
        (n_contacts,) contact points that stick under the static loads; None: all.
    """
    own = system.structure.of_harmonic(1)
    springs = system.springs.stuck_stiffness()
    if holds is not None:
        springs = np.where(np.repeat(holds, 3), springs, 0.0)
    elastic = replace(own, stiffness=_hermitian(own.stiffness), mass=_hermitian(own.mass))
    bound = with_springs(elastic, system.interface.gap_operator, springs)
    # copies that contacts know, and what holds them, have no mass and are no motions of their own
    way = own_motions(bound, system.structure.multipliers)
    free = in_coordinates(bound, way, bound.dofs.take(np.arange(way.shape[1])), {})
    moving = int(np.count_nonzero(free.mass.diagonal()))
    found = normal_modes(free, min(count, moving))
    shapes = _with_forces(bound, way @ found.shapes, system.structure.multipliers)
    return [
        _mode(own, i + 1, float(square), shapes[:, i])
        for i, square in enumerate(found.squares)
        if square > 0.0
    ]


def _with_forces(bound: Structure, shapes: Matrix, multipliers: IntArray) -> Matrix:
    """Return shapes with the forces that hold copies, which the contacts pull and no mass does."""
    if not multipliers.size:
        return shapes
    copies = multipliers - multipliers.size
    held = bound.stiffness[np.ix_(copies, multipliers)]
    forces = np.linalg.solve(held, -(bound.stiffness @ shapes)[copies])
    out = shapes.astype(np.result_type(shapes, forces))
    out[multipliers] = forces
    return out


def _mode(structure: Structure, number: int, square: float, shape: Matrix) -> StuckMode:
    omega = float(np.sqrt(square))
    work = omega * _along(structure.damping, shape).real + _along(structure.stiffness, shape).imag
    if structure.loss is not None:
        work += _along(structure.loss, shape).real
    ratio = work / (2.0 * square * _along(structure.mass, shape).real)
    return StuckMode(number, omega, float(ratio), np.asarray(shape, dtype=complex))


def _along(matrix: Matrix, shape: Matrix) -> complex:
    return complex(np.conj(shape) @ (matrix @ shape))


def _hermitian(matrix: Matrix) -> Matrix:
    dense: FloatArray | ComplexArray = np.asarray(
        matrix.toarray() if scipy.sparse.issparse(matrix) else matrix
    )
    return 0.5 * (dense + dense.conj().T)
