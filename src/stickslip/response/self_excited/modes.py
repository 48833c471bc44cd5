"""Linear modes about the static state with stuck contacts, the start of every self-excited vibration."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix, as_array
from stickslip.harmonic.linear import one_structure
from stickslip.model.blas_threads import by_one_thread
from stickslip.model.modes import gyroscopic_modes, normal_modes, with_springs
from stickslip.model.structure import Structure
from stickslip.reduction.aerodynamics import Feedback
from stickslip.reduction.basis import in_basis, in_coordinates
from stickslip.reduction.contact_coordinates import own_motions
from stickslip.response.rotating.flutter import damping_ratio, followed_mode
from stickslip.response.system import System

WHOLE = 400  # coordinates up to which the full eigenvalue problem is solved
SPARE = 20  # undamped modes in addition to twice the requested number
STILL = 1e-7  # frequency over the largest eigenvalue, below which a mode creeps or is a rigid body with rounding


@dataclass(frozen=True, eq=False)
class StuckMode:
    """Mode of the structure in the first harmonic, with stuck contacts.

    Parameters
    ----------
    number
        Number from 1, by frequency.
    omega
        Modulus of the eigenvalue, rad/s.
    ratio
        Damping ratio ``−Re λ / |λ|`` of the eigenvalue with all damping, Coriolis and aerodynamic forces. Negative: the
        mode grows.
    shape
        (n,) complex displacement of all coordinates, normalised to unit modal mass; for a wheel with copies of dofs in
        several phases, also the constraint forces of the copies.
    """

    number: int
    omega: float
    ratio: float
    shape: ComplexArray

    @property
    def unstable(self) -> bool:
        """Whether small vibrations in the mode grow."""
        return self.ratio < 0.0


@by_one_thread
def stuck_modes(system: System, count: int, holds: BoolArray | None = None) -> list[StuckMode]:
    """Return the lowest modes of the structure in the first harmonic.

    For a wheel they belong to the wave excited by its engine order.

    Parameters
    ----------
    system
        Structure with contacts.
    count
        Number of modes; the result has fewer if the structure has fewer, or some do not oscillate.
    holds
        (n_contacts,) contact points that stick under the static loads; None: all.

    Raises
    ------
    InputError
        If the structure is not reduced.

    Notes
    -----
    Eigenvalues of ``λ²M + λC + K`` include Coriolis terms and unsymmetric aerodynamic terms, since undamped modes have
    other shapes where rotation separates forward and backward waves, or both have equal frequencies. Aerodynamic
    coefficients are evaluated at each mode's own frequency. With more than 400 coordinates, the basis consists of
    undamped modes and of static responses to the forces that couple them.
    """
    springs = system.springs.stuck_stiffness()
    if holds is not None:
        springs = np.where(np.repeat(holds, 3), springs, 0.0)
    return sprung_modes(system, count, springs)


def sprung_modes(
    system: System, count: int, springs: FloatArray, harmonic: int = 1, whole: int = WHOLE
) -> list[StuckMode]:
    """Return the lowest modes of the structure with linear springs in place of its contacts; see `stuck_modes`.

    Parameters
    ----------
    system, count
        As in `stuck_modes`.
    springs
        (3 n_contacts,) stiffnesses t, w, n of each contact, N/m.
    harmonic
        Harmonic whose matrices are used; on a wheel, harmonics of a load travel as different waves.
    whole
        Number of coordinates up to which the full eigenvalue problem is solved.
    """
    if not system.structure.reduced:
        one_structure(system.structure, "stuck_modes")
    bound, elastic, way = _bound(system, springs, harmonic)
    dofs = elastic.dofs.take(np.arange(way.shape[1]))
    still, free = (in_coordinates(one, way, dofs, {}) for one in (elastic, bound))
    basis, rigid = _basis(still, free, count, whole)
    feedback = system.structure.feedback_of(harmonic)
    if feedback is not None:
        feedback = replace(feedback, patterns=(way @ basis).conj().T @ feedback.patterns)
    stiffness, damping = (in_basis(m, basis) for m in (free.stiffness, free.damping))
    if free.loss is not None:
        stiffness = stiffness + 1j * in_basis(free.loss, basis)
    values, vectors = _eigenpairs(stiffness, damping, feedback, count - rigid)
    shapes = _with_forces(elastic, way @ (basis @ vectors), system.structure.multipliers)
    ratios = damping_ratio(values)
    return [
        StuckMode(rigid + i + 1, float(abs(value)), float(ratio), np.asarray(shape, dtype=complex))
        for i, (value, ratio, shape) in enumerate(zip(values, ratios, shapes.T, strict=True))
    ]


def natural_frequencies(system: System, count: int, springs: FloatArray, harmonic: int = 1) -> FloatArray:
    """Return the lowest natural frequencies in Hz, with Coriolis forces and without damping.

    Parameters
    ----------
    system, count, springs, harmonic
        As in `sprung_modes`.
    """
    elastic, way = _bound(system, springs, harmonic)[1:]
    moving = in_coordinates(elastic, way, elastic.dofs.take(np.arange(way.shape[1])), {})
    return gyroscopic_modes(moving, min(count, int(np.count_nonzero(moving.mass.diagonal())))).frequencies_hz


def _bound(system: System, springs: FloatArray, harmonic: int) -> tuple[Structure, Structure, Matrix]:
    """Return the structure with springs, the same with symmetric stiffness and mass, and the basis of its independent coordinates."""
    bound = with_springs(system.structure.of_harmonic(harmonic), system.interface.gap_operator, springs)
    elastic = replace(bound, stiffness=_hermitian(bound.stiffness), mass=_hermitian(bound.mass))
    # copies of dofs for contacts, and their constraint forces, have no mass and are no independent coordinates
    return bound, elastic, own_motions(elastic, system.structure.multipliers)


def _basis(still: Structure, free: Structure, count: int, whole: int) -> tuple[Matrix, int]:
    """Return a basis of unit mass for the lowest modes.

    The second result is the number of requested undamped modes that do not vibrate.
    """
    moving = int(np.count_nonzero(still.mass.diagonal()))
    wanted = moving if moving <= whole else min(moving, 2 * count + SPARE)
    modes = normal_modes(still, wanted)
    rigid = int(np.count_nonzero(modes.squares[: min(count, moving)] <= 0.0))
    shapes = np.asarray(modes.shapes)
    if wanted == moving:
        return shapes, rigid
    coupling = free.damping @ shapes * np.sqrt(np.maximum(modes.squares, 0.0))
    coupling = coupling + (free.stiffness - still.stiffness) @ shapes
    shift = float(np.max(modes.squares)) * 1e-3  # a free body has a static response, too
    answers = np.linalg.solve(still.stiffness + shift * still.mass, coupling)
    answers = answers[:, np.any(answers != 0.0, axis=0)]
    both = np.hstack([shapes, answers / np.linalg.norm(answers, axis=0)])
    square, turn = np.linalg.eigh(both.conj().T @ (still.mass @ both))
    kept = square > 1e-10 * square[-1]
    return both @ (turn[:, kept] / np.sqrt(square[kept])), rigid


def _eigenpairs(
    stiffness: Matrix, damping: Matrix, feedback: Feedback | None, count: int
) -> tuple[ComplexArray, ComplexArray]:
    """Return the lowest eigenvalues with positive frequency, and their shapes, in a basis of unit mass."""
    stiffness, damping = (np.asarray(m, dtype=complex) for m in (stiffness, damping))
    n = len(stiffness)
    zero, one = np.zeros((n, n)), np.eye(n)
    values, vectors = np.linalg.eig(np.block([[zero, one], [-stiffness, -damping]]))
    turning = np.flatnonzero(values.imag > STILL * np.abs(values).max(initial=0.0))
    lowest = turning[np.argsort(values.imag[turning], kind="stable")][: max(count, 0)]
    shapes = vectors[:n, lowest] / np.linalg.norm(vectors[:n, lowest], axis=0)
    values = values[lowest]
    if feedback is None or not feedback.influence.depends_on_frequency:
        return values, shapes
    P = np.asarray(feedback.patterns)
    stiff, damp = feedback.influence.frozen(feedback.phase_angle, feedback.reference)

    def beyond(eigenvalue: complex) -> Matrix:
        # a table depends on the frequency only; the matrices contain the frozen form for frequency and growth
        inner = feedback.force(eigenvalue.imag) - stiff - eigenvalue * damp
        return np.asarray(P @ inner @ P.conj().T)

    for i in range(values.size):
        start = complex(values[i]), shapes[:, i]
        values[i], shapes[:, i] = followed_mode(stiffness, damping, beyond, start)
    return values, shapes


def _with_forces(bound: Structure, shapes: Matrix, multipliers: IntArray) -> Matrix:
    """Return shapes with the constraint forces of copied dofs.

    They balance contact forces only, as copies have no mass.
    """
    if not multipliers.size:
        return shapes
    copies = multipliers - multipliers.size
    held = bound.stiffness[np.ix_(copies, multipliers)]
    forces = np.linalg.solve(held, -(bound.stiffness @ shapes)[copies])
    out = shapes.astype(np.result_type(shapes, forces))
    out[multipliers] = forces
    return out


def _hermitian(matrix: Matrix) -> Matrix:
    dense: FloatArray | ComplexArray = as_array(matrix)
    return 0.5 * (dense + dense.conj().T)
