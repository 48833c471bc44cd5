"""Natural frequencies with the Coriolis matrix: ``(K + iω G - ω² M) φ = 0`` with a skew G.

F. Tisseur and K. Meerbergen, "The quadratic eigenvalue problem", SIAM Review 43 (2001) 235-286, section 3.3 (gyroscopic systems).
"""

from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.errors import input_error
from stickslip.model.fe.factorisation import DENSE, factorise
from stickslip.model.modes import Factors, connected_parts, lowest_modes, normal_modes, usual_shift
from stickslip.model.structure import Structure
from stickslip.units import HZ

SPARE_MODES = 10  # modes of the basis beyond twice the requested number
RIGID_SQUARE = 1e-12  # fraction of the largest square: a negative square nearer to zero belongs to a rigid motion
STILL = 1e-9  # fraction of the largest rate: a smaller frequency is rounding, and the motion grows or decays without oscillation
KNOWN = 1e-8  # fraction of a static response outside the span of the modes; less is rounding


@dataclass(frozen=True, eq=False)
class GyroscopicModes:
    """Modes in the rotating frame, ``u = Re φ exp((growth + 2πif) t)``, lowest frequency first.

    Parameters
    ----------
    frequencies_hz
        (n,) natural frequencies. Negative only for waves that rotation has overtaken: the frequency passes through zero, and
        the wave then travels in the other direction.
    shapes
        (N, n) complex mode shapes of unit mass: ``φᴴ M φ = 1``.
    growth
        (n,) growth rate in 1/s, zero if the structure is stable; of a diverging pair, the growing mode precedes the decaying one.
    """

    frequencies_hz: FloatArray
    shapes: ComplexArray
    growth: FloatArray


def gyroscopic_modes(
    structure: Structure,
    n_modes: int,
    *,
    n_basis: int | None = None,
    shift: float | None = None,
    factors: Factors | None = None,
) -> GyroscopicModes:
    """Return the lowest modes of a structure whose damping matrix holds Coriolis terms.

    Parameters
    ----------
    structure
        Real and symmetric, or Hermitian at a wave number; only the skew part of `damping` is used, dissipation is neglected.
    n_modes
        Number of frequencies. At a wave number these are waves ``exp(+iωt)``; waves in the opposite direction belong to the negative
        wave number.
    n_basis
        Modes at rest that span the basis, by default twice `n_modes` plus ten. Modes alone converge slowly, so the static
        responses to their Coriolis forces are added. Structures of a few hundred dofs are solved without a basis.
    shift, factors
        As in `normal_modes`.

    Raises
    ------
    InputError
        If more modes are requested than there are dofs, or vectors in the basis.
    """
    movable = int(np.count_nonzero(structure.mass.diagonal()))
    n_basis = min(2 * n_modes + SPARE_MODES if n_basis is None else n_basis, movable)
    if not 0 < n_modes <= n_basis:
        raise input_error(
            "gyroscopic_modes",
            f"{n_modes} modes asked of {movable} dofs with mass, {n_basis} in the basis",
            "Ask for at least one, and at most as many as the basis has.",
        )
    G = structure.coriolis
    if structure.n <= DENSE:
        modes = normal_modes(structure, movable)
        squares, shapes = modes.squares, modes.shapes
    else:
        squares, shapes = _enriched(structure, G, n_basis, shift, factors)
    rates, amplitudes = _eigenpairs(squares, shapes.conj().T @ (G @ shapes))
    first = np.lexsort((-rates.real, _without_rounding(rates)))[:n_modes]
    return GyroscopicModes(rates.imag[first] / HZ, shapes @ amplitudes[:, first], rates.real[first])


def _eigenpairs(squares: FloatArray, coriolis: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return rates λ with ``Im λ ≥ 0`` and vectors of unit length of ``λ² + λ G + diag(squares)``."""
    n = squares.size
    if squares[0] >= 0.0:
        # the state (√K q, q̇) has a skew matrix; i times it is Hermitian, so the frequencies are exactly real
        root = np.diag(np.sqrt(squares))
        state = np.block([[np.zeros((n, n)), 1j * root], [-1j * root, -1j * coriolis]])
        omega, states = scipy.linalg.eigh(state)
        rates: ComplexArray = -1j * omega
    else:
        state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(squares), -coriolis]])
        rates, states = scipy.linalg.eig(state)
    # both rates of a motion without oscillation have the frequency zero: the growing one comes first
    kept = np.lexsort((-rates.real, -_without_rounding(rates)))[:n]
    # shapes from velocities, λ times the displacements: they vanish only where λ does
    shapes = states[n:, kept]
    still = np.linalg.norm(shapes, axis=0) == 0.0
    shapes[:, still] = states[:n, kept][:, still]
    return rates[kept], shapes / np.linalg.norm(shapes, axis=0)


def _without_rounding(rates: ComplexArray) -> FloatArray:
    """Return the circular frequencies of rates, with rounding set to zero."""
    omega = rates.imag
    return np.where(np.abs(omega) <= STILL * np.max(np.abs(rates), initial=0.0), 0.0, omega)


def _enriched(
    structure: Structure, coriolis: Matrix, n_basis: int, shift: float | None, factors: Factors | None
) -> tuple[FloatArray, Matrix]:
    """Return squares and shapes in the span of the lowest modes and the static responses to their Coriolis forces."""
    K, M = structure.stiffness, structure.mass
    start = usual_shift(structure) if shift is None else shift
    solve = (factors or factorise)(K - start * M)
    if len(connected_parts(K, M)) == 1:  # one factorisation for both
        modes = lowest_modes(K, M, n_basis, solve, start)[1]
    else:
        modes = normal_modes(structure, n_basis).shapes
    answers = solve(np.asarray(coriolis @ modes))
    size = np.linalg.norm(answers, axis=0)
    answers = answers - modes @ (modes.conj().T @ (M @ answers))
    # without Coriolis forces, or within the span of the modes, nothing is left of a response
    left = np.linalg.norm(answers, axis=0) > KNOWN * size
    columns = [each / np.linalg.norm(each, axis=0) for each in (modes, answers[:, left])]
    basis = np.linalg.qr(np.hstack(columns))[0]
    squares, vectors = scipy.linalg.eigh(*(basis.conj().T @ (a @ basis) for a in (K, M)))
    # the squares of rigid motions are zero: negative ones are rounding
    return np.where(squares < -RIGID_SQUARE * squares[-1], squares, np.maximum(squares, 0.0)), basis @ vectors
