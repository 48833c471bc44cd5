"""Natural frequencies and modes of dense and sparse structures: real, at a wave number, or with the Coriolis matrix.

The mass matrix of small models may be singular. With the Coriolis matrix the modes solve ``(K + iω G - ω² M) φ = 0`` with a skew G:
F. Tisseur and K. Meerbergen, "The quadratic eigenvalue problem", SIAM Review 43 (2001) 235-286, section 3.3 (gyroscopic systems).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix, as_array
from stickslip.errors import InputError, SingularError, input_error
from stickslip.model.fe.factorisation import DENSE, Factorisation, Say, Solve, factorise, negative_eigenvalues, silent
from stickslip.model.fe.lanczos import lanczos
from stickslip.model.rigid.motion import refuse_unheld
from stickslip.model.structure import Dofs, Structure
from stickslip.units import HZ

RIGID_STRAIN = 1e-14  # strain energy of a mode over the sum of its terms' magnitudes: less is rounding
FAR = 1e4  # multiple of the mean K_ii / M_ii; no square is below minus this value
LARGEST_ENTRY = 1e100  # entries of matrices above it, or below its inverse, are implausible
INDEFINITE = 1e-9  # fraction of the largest eigenvalue of a mass matrix: a more negative eigenvalue is not rounding
ROUNDED = 1e-12  # eigenvalue over the terms that it is the sum of: less is rounding
SHIFT = 1e-8  # default shift below zero over the mean K_ii / M_ii: K − shift M is then regular for a free body

Factors = Callable[[Matrix], Factorisation]


@dataclass(frozen=True, eq=False)
class Modes:
    """Undamped modes, lowest first.

    Parameters
    ----------
    squares
        (n,) squares of the circular frequencies in rad²/s²; rigid motions have exactly zero.
    shapes
        (N, n) mass-normalised shapes, complex for a complex Hermitian structure.
    """

    squares: FloatArray
    shapes: Matrix

    @property
    def frequencies_hz(self) -> FloatArray:
        """Frequencies (n,) in Hz; negative where the square is, since the motion then diverges."""
        return np.asarray(np.sign(self.squares) * np.sqrt(np.abs(self.squares)) / HZ)

    @property
    def rigid(self) -> int:
        """Number of modes without strain."""
        return int(np.count_nonzero(self.squares == 0))


def normal_modes(
    structure: Structure, n: int, *, shift: float | None = None, say: Say = silent, factors: Factors | None = None
) -> Modes:
    """Return the `n` lowest undamped modes.

    Parameters
    ----------
    structure
        Real symmetric or complex Hermitian, dense or sparse; it may be free to move, and dofs may
        have no mass.
    n
        Number of modes, from one to the number of dofs with mass.
    shift
        Shift in rad²/s², at most the lowest square; the matrix ``K − shift M`` is factorised. By default
        slightly below zero, so that the matrix of a free body is not singular. Squares far below
        it (diverging motions) are found with a second, lower shift.
    say
        Called with a sentence before each long step.
    factors
        Function that factorises ``K − shift M`` of the whole structure, such as the one of `WaveFamily`; None: `factorise`.

    Raises
    ------
    InputError
        If the structure has fewer than `n` modes.
    SingularError
        If ``K − shift M`` is singular: a dof has neither stiffness nor mass, or a body is free and
        the shift zero.

    Notes
    -----
    The signs of the pivots of ``K − shift M`` count the squares below the shift, so that none is missed. SuperLU's factors
    with more than `MAX_COUNTED_ENTRIES` entries are not examined. A mode with a negative square is then found only if it is
    nearer to the shift than the n-th mode; give a shift below all squares.
    """
    _check_count("normal_modes", structure, n)
    refuse_bad_mass(structure, "normal_modes")
    mean = _mean_square(structure)
    squares, shapes = [], []
    for part in connected_parts(structure.stiffness, structure.mass):
        K, M = structure.stiffness, structure.mass
        if len(part) < structure.n:  # a copy of a whole large model would cost a gigabyte
            K, M = submatrix(K, part, part), submatrix(M, part, part)
        count = min(n, int(np.count_nonzero(M.diagonal())))
        if not count:
            continue
        start, solve = -SHIFT * mean if shift is None else shift, None
        own = structure.dofs.take(part)
        factorised = partial(_factorised, dofs=own, say=say, below=start < 0)
        if not _small(K, count):
            known = factors if len(part) == structure.n else None
            solve = factorised(K - start * M) if known is None else known(K - start * M)
        say(f"{count} modes of {len(part)} dofs")
        values, vectors = lowest_modes(K, M, count, solve, start, own)
        if solve is not None:
            found = values, vectors
            values, vectors = _with_missed(K, M, found, (start, solve), mean, factorised)
        values[_strain_share(K, vectors) < RIGID_STRAIN] = 0.0
        whole = np.zeros((structure.n, count), dtype=vectors.dtype)
        whole[part] = vectors
        squares.append(values)
        shapes.append(whole)
    lowest = np.argsort(np.concatenate(squares), kind="stable")[:n]
    return Modes(np.concatenate(squares)[lowest], np.hstack(shapes)[:, lowest])


def _with_missed(
    K: Matrix,
    M: Matrix,
    found: tuple[FloatArray, Matrix],
    shifted: tuple[float, Factorisation],
    mean: float,
    factorised: Callable[[Matrix], Factorisation],
) -> tuple[FloatArray, Matrix]:
    """Return the modes `found` nearest to a shift, with missed modes far below the shift in place of the highest ones."""
    (values, shapes), (shift, solve) = found, shifted
    far = solve.negative
    if not far or far == np.count_nonzero(values < shift):
        return found
    if solve.backend == "feral":  # a young package: its count is checked when it contradicts the modes
        far = negative_eigenvalues(K - shift * M) or far
    # Lagrange multipliers have no mass: their eigenvalues stay negative at any shift and are no modes
    multipliers = negative_eigenvalues(K + FAR * mean * M) or 0
    below = far - multipliers
    if below == np.count_nonzero(values < shift):
        return found
    lower, step = shift, SHIFT * mean
    while solve.negative not in (None, multipliers) and step < FAR * mean:
        step *= 100
        lower = min(shift, 0.0) - step
        solve = factorised(K - lower * M)
    low, first = lowest_modes(K, M, min(below, values.size), solve, lower)
    above = values >= shift
    both = np.concatenate([low, values[above]]), np.hstack([first, shapes[:, above]])
    return both[0][: values.size], both[1][:, : values.size]


def _factorised(matrix: Matrix, dofs: Dofs, say: Say, *, below: bool = True) -> Factorisation:
    """Factorise ``K − shift M`` of a body.

    The error of a singular matrix names the free motion or, with a negative shift, the missing mass.
    """
    try:
        return factorise(matrix, say=say)
    except SingularError as error:
        refuse_unheld(matrix, dofs, "normal_modes")
        if not below:
            raise
        text = (
            "normal_modes: mass and stiffness are singular together: a motion has neither, and nothing says how it moves. So have "
            "single rows or layers of bricks with reduced integration (C3D20R): take C3D20, exact integration, or more bricks "
            f"across; of other matrices leave out what nothing moves ({error})"
        )
        raise SingularError(text) from error


def natural_frequencies(structure: Structure, n: int) -> FloatArray:
    """Return the `n` lowest undamped natural frequencies in Hz; rigid-body modes count as zeros.

    Diverging modes count as zeros, too; `normal_modes` distinguishes them.
    """
    _check_count("natural_frequencies", structure, n)
    return np.maximum(normal_modes(structure, n).frequencies_hz, 0.0)


def with_springs(structure: Structure, operator: Matrix, stiffness: FloatArray) -> Structure:
    """Return the structure with springs added: ``K + operatorᴴ diag(stiffness) operator``.

    Parameters
    ----------
    structure
        Dense or sparse.
    operator
        (m, n) operator from coordinates to elongations of the springs.
    stiffness
        (m,) stiffnesses in N/m.
    """
    sparse = scipy.sparse.csr_array(operator)
    added = sparse.conj().T @ scipy.sparse.diags_array(np.asarray(stiffness, dtype=float)) @ sparse
    if scipy.sparse.issparse(structure.stiffness):
        return replace(structure, stiffness=(structure.stiffness + added).tocsr())
    return replace(structure, stiffness=structure.stiffness + added.toarray())


def connected_parts(*matrices: Matrix) -> list[IntArray]:
    """Return the index sets of bodies that the matrices do not couple.

    Equal bodies have equal frequencies. A Krylov method may miss some of them, unless bodies are solved one by one.
    """
    graph = sum(abs(scipy.sparse.csr_array(m)) for m in matrices)
    count, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    if count > DENSE:  # very many bodies, mostly single masses: dense algebra finds repeated values
        return [np.arange(len(label))]
    return [np.flatnonzero(label == i) for i in range(count)]


def submatrix(matrix: Matrix, rows: IntArray, columns: IntArray) -> Matrix:
    """Return ``matrix[rows][:, columns]`` of a dense or CSR matrix."""
    if scipy.sparse.issparse(matrix):
        return matrix[rows][:, columns]
    return matrix[np.ix_(rows, columns)]


def lowest_modes(
    stiffness: Matrix, mass: Matrix, n: int, solve: Solve | None, shift: float = 0.0, dofs: Dofs | None = None
) -> tuple[FloatArray, Matrix]:
    """Return the `n` lowest squares of circular frequencies and mass-normalised modes.

    Parameters
    ----------
    stiffness, mass
        Real symmetric or complex Hermitian (size, size); the mass may be singular.
    n
        Number of modes, at most the rank of the mass.
    solve
        Solver with ``stiffness − shift · mass`` from `factorise`; not used where dense algebra is faster.
    shift
        Shift in rad²/s², at most the lowest square.
    dofs
        Dofs of the coordinates, for messages.

    Raises
    ------
    InputError
        If fewer than `n` motions have mass.
    """
    if solve is None or _small(stiffness, n):
        K, M = (as_array(m) for m in (stiffness, mass))
        return dense_modes(K, M, n, shift, dofs)
    kind = complex if np.iscomplexobj(stiffness) or np.iscomplexobj(mass) else float
    values, vectors = lanczos(mass, n, solve, shift, kind)
    order = np.argsort(values)
    return values[order], vectors[:, order]


def refuse_bad_mass(structure: Structure, place: str) -> None:
    """Refuse implausible numbers, and a mass matrix that a cheap check shows not to be positive.

    Raises
    ------
    InputError
        If a check fails; the message names the matrix and, if possible, the dof.
    """
    for name in ("mass", "stiffness"):
        matrix = getattr(structure, name)
        largest = float(abs(matrix).max()) if structure.n else 1.0
        unstrained = name == "stiffness" and largest == 0.0  # bodies held by contacts only
        if not (1 / LARGEST_ENTRY < largest < LARGEST_ENTRY or unstrained):
            raise input_error(
                f"{place}: {name}",
                f"has entries up to {largest:.3g}, which no model has",
                "Check the program that wrote it, and its units.",
            )
    diagonal = structure.mass.diagonal().real
    if np.any(diagonal < 0):
        dof = int(np.argmin(diagonal))
        raise input_error(
            f"{place}: mass",
            f"is negative, {diagonal[dof]:.6g}, at {structure.dofs.labels[dof]}",
            "A mass matrix is positive definite: check its source.",
        )
    least = np.where(diagonal > 0, diagonal, np.inf)
    if structure.n and np.min(least) < 1 / LARGEST_ENTRY:
        dof = int(np.argmin(least))
        raise input_error(
            f"{place}: mass",
            f"is {least[dof]:.3g} at {structure.dofs.labels[dof]}, which no model has",
            "Check the program that wrote it, and its units, or write 0.",
        )
    if structure.n > DENSE:
        return
    dense = as_array(structure.mass)
    squares, shapes = np.linalg.eigh(dense)
    if squares[0] < -INDEFINITE * squares[-1]:
        most = structure.dofs.labels[int(np.argmax(np.abs(shapes[:, 0])))]
        raise input_error(
            f"{place}: mass",
            f"is not positive definite: a motion, {most} the most, has {squares[0]:.6g} kg",
            "Check its source: a triangle of a matrix given as the whole, or the stiffness in its place.",
        )


def _check_count(place: str, structure: Structure, n: int) -> None:
    if not 0 < n <= structure.n:
        raise input_error(
            place, f"{n} asked of a structure with {structure.n} dofs", "Ask for at least one and at most as many."
        )
    heavy = int(np.count_nonzero(structure.mass.diagonal()))
    if n > heavy:
        raise input_error(
            place,
            f"{n} asked of a structure with {structure.n} dofs, of which {heavy} have mass",
            "Ask for at most as many as have mass.",
        )


def usual_shift(structure: Structure) -> float:
    """Return the default shift of `normal_modes`, in rad²/s²."""
    return -SHIFT * _mean_square(structure)


def _mean_square(structure: Structure) -> float:
    """Return the mean K_ii over the mean M_ii, in rad²/s²; 1 if no dof has stiffness."""
    stiffness, mass = (m.diagonal().real for m in (structure.stiffness, structure.mass))
    return float(abs(stiffness).sum() / mass.sum()) or 1.0


def _small(stiffness: Matrix, n: int) -> bool:
    size = stiffness.shape[0]
    return bool(size <= DENSE or n > size // 3)


def _strain_share(stiffness: Matrix, shapes: Matrix) -> FloatArray:
    """Return the strain energy of each shape over the sum of the magnitudes of its terms."""
    energy = np.sum((shapes.conj() * (stiffness @ shapes)).real, axis=0)
    terms = np.sum(abs(shapes) * (abs(stiffness) @ abs(shapes)), axis=0)
    return np.asarray(np.abs(energy) / np.where(terms > 0, terms, 1.0))


def dense_modes(
    stiffness: Matrix, mass: Matrix, n: int, shift: float = 0.0, dofs: Dofs | None = None
) -> tuple[FloatArray, Matrix]:
    """Return the `n` lowest squares of circular frequencies and mass-normalised modes.

    Motions without mass follow the others statically, ``K₀₀ x₀ + K₀₁ x₁ = 0``, and are no modes; neither are motions without mass and
    stiffness. Such mass matrices come from bricks with reduced integration (C3D20R) and from static reduction.

    Parameters
    ----------
    stiffness, mass
        (size, size), dense, real symmetric or complex Hermitian.
    n
        Number of modes, at most the rank of the mass.
    shift
        Shift in rad²/s², at most the lowest square.
    dofs
        Dofs of the coordinates, for messages.

    Returns
    -------
    tuple[FloatArray, Matrix]
        (n,) squares in rad²/s², ascending, and (size, n) modes.

    Raises
    ------
    InputError
        If fewer than `n` motions have mass, if a mass is negative, or if coordinates are multipliers of constraints.
    """
    if _definite(mass):
        return _of_full_rank(stiffness, mass, n, shift)
    squares, with_mass, without = _by_mass(mass, dofs)
    if n > squares.size:
        raise input_error(
            "mass",
            f"is singular: {squares.size} of {len(mass)} motions have mass, and {n} modes are asked",
            f"Ask for at most {squares.size} modes.",
        )
    follow = _following(stiffness, with_mass, without, dofs)
    basis = with_mass + without @ follow
    condensed = with_mass.conj().T @ stiffness @ basis
    values, vectors = _of_full_rank((condensed + condensed.conj().T) / 2, np.diag(squares), n, shift)
    return values, np.asarray(basis @ vectors)


def mass_rank(mass: Matrix) -> int:
    """Return the rank of a (size, size) mass matrix, dense or sparse."""
    dense = as_array(mass)
    return len(dense) if _definite(dense) else _by_mass(dense, None)[0].size


def _definite(mass: Matrix) -> bool:
    """Whether every motion has mass, beyond rounding."""
    try:
        pivots = np.diagonal(np.linalg.cholesky(mass)).real ** 2
    except np.linalg.LinAlgError:
        return False
    return bool((pivots > ROUNDED * np.diagonal(mass).real).all())


def _by_mass(mass: Matrix, dofs: Dofs | None) -> tuple[FloatArray, Matrix, Matrix]:
    """Return the (r,) masses of motions, these motions (size, r), and the motions (size, size - r) without mass."""
    diagonal = np.diagonal(mass).real
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = scale[:, None] * mass * scale
    sizes = np.abs(scaled).max(axis=0)
    if not np.all(np.isfinite(sizes)):  # in a positive matrix the diagonal bounds all other entries
        raise _not_positive(np.where(np.isfinite(sizes), 0.0, 1.0), dofs)
    squares, shapes = np.linalg.eigh(scaled)
    if squares[0] < -INDEFINITE * squares[-1]:
        raise _not_positive(shapes[:, 0], dofs)
    heavy = squares > ROUNDED * squares[-1]
    moved = scale[:, None] * shapes
    return squares[heavy], moved[:, heavy], moved[:, ~heavy]


def _not_positive(motion: Matrix, dofs: Dofs | None) -> InputError:
    """Return the error for a mass matrix in which a motion (size,) has negative mass."""
    return input_error(
        "mass",
        f"is not positive: a motion, {_most(motion, dofs)} the most, has a negative one",
        "Check its source: a triangle of a matrix given as the whole, or the stiffness in its place.",
    )


def _following(stiffness: Matrix, with_mass: Matrix, without: Matrix, dofs: Dofs | None) -> Matrix:
    """Return the static motion of the coordinates `without` mass under unit motions `with_mass`.

    Coordinates with neither mass nor stiffness stay at rest. Lagrange multipliers of constraints, which have no stiffness of
    their own but couple to other coordinates, are refused.
    """
    inner = without.conj().T @ stiffness @ without
    terms = np.sum(abs(without) * (abs(stiffness) @ abs(without)), axis=0)
    scale = 1 / np.sqrt(np.where(terms > 0, terms, 1.0))
    values, shapes = np.linalg.eigh(scale[:, None] * inner * scale)
    scaled = scale[:, None] * shapes
    idle = np.abs(values) < ROUNDED
    held = np.abs(stiffness @ without @ scaled[:, idle])
    if (held > ROUNDED * np.abs(stiffness).max() * np.abs(without @ scaled).max()).any():
        first = without @ scaled[:, idle][:, int(np.argmax(held.max(axis=0)))]
        raise input_error(
            "mass",
            f"is singular: {idle.sum()} coordinates without mass are multipliers of constraints, {_most(first, dofs)} one of them",
            "Eliminate the constraints: write matrices of independent coordinates.",
        )
    resisting = scaled[:, ~idle]
    pull = resisting.conj().T @ without.conj().T @ stiffness @ with_mass
    return np.asarray(-resisting @ (pull / values[~idle, None]))


def _most(motion: Matrix, dofs: Dofs | None) -> str:
    """Return the name of the coordinate with the largest motion."""
    at = int(np.argmax(np.abs(motion)))
    return f"coordinate {at}" if dofs is None else dofs.labels[at]


def _of_full_rank(K: Matrix, M: Matrix, n: int, shift: float) -> tuple[FloatArray, Matrix]:
    """Solve the reciprocal problem for few modes: with a fine mesh the direct one gives the lowest to six digits only."""
    few = 2 * n <= len(K)
    try:
        return (_reciprocal if few else _direct)(K, M, n, shift)
    except np.linalg.LinAlgError:  # a mode diverges
        return (_direct if few else _reciprocal)(K, M, n, shift)


def _direct(K: Matrix, M: Matrix, n: int, _: float) -> tuple[FloatArray, Matrix]:
    values, vectors = scipy.linalg.eigh(K, M, subset_by_index=(0, n - 1))
    return np.asarray(values), np.asarray(vectors)


def _reciprocal(K: Matrix, M: Matrix, n: int, shift: float) -> tuple[FloatArray, Matrix]:
    size = len(K)
    largest = (size - n, size - 1)
    inverse, vectors = scipy.linalg.eigh(M, K - shift * M, subset_by_index=largest)
    if inverse[0] <= 0:
        raise np.linalg.LinAlgError("dofs have no mass, or a negative one")
    values = shift + 1.0 / inverse[::-1]
    return np.asarray(values), np.asarray((vectors / np.sqrt(inverse))[:, ::-1])


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
