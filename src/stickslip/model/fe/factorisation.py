"""Factorisations of structural matrices, with one function for all backends."""

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec

import numpy as np
import scipy

from stickslip.arrays import Matrix, as_array
from stickslip.errors import SingularError, StickslipError, input_error, missing_package
from stickslip.model.fe.multifrontal import multifrontal

DENSE = 400  # below this many rows dense algebra is faster than sparse
MIN_FERAL_ROWS = 3000  # below this many rows SuperLU is as fast as the optional package feral
HUGE = 20_000  # below this many rows SuperLU is as fast as the multifrontal method
SINGULAR = 1e13  # condition number above which a solution has no reliable digit
SYMMETRIC = 1e-10  # asymmetry over the largest entry, below which a matrix counts as Hermitian
PIVOTS = 0.01  # SuperLU leaves the diagonal for a pivot more than a hundred times as large
RESIDUAL = 1e-9  # residual of an equation over the sum of its terms, above which factors of feral are not used
MAX_CHECKED_ROWS = 100_000  # rows up to which SuperLU checks the number of negative eigenvalues from feral
MAX_COUNTED_ENTRIES = 50_000_000  # largest number of entries of factors that are copied to count pivots: 0.6 GB
BACKENDS = ("auto", "dense", "multifrontal", "superlu", "feral")

LOG = logging.getLogger("stickslip")
Solve = Callable[[Matrix], Matrix]
Say = Callable[[str], None]


class _DistrustedError(Exception):
    """Error: factors of the package feral are unreliable; the message says why."""


@dataclass(frozen=True, eq=False)
class Factorisation:
    """A factorised matrix; call it with right-hand sides.

    Parameters
    ----------
    solve
        Solver for right-hand sides (n,) or (n, k), real or complex; it returns the same shape.
    backend
        Method of factorisation: ``dense``, ``multifrontal``, ``superlu`` or ``feral``.
    count
        Function that returns the number of negative eigenvalues; None if unavailable from the factors.
    """

    solve: Solve
    backend: str
    count: Callable[[], int | None] = field(default=lambda: None)

    @property
    def negative(self) -> int | None:
        """Number of negative eigenvalues of a Hermitian matrix; None if unavailable from the factors."""
        return self.count()

    def __call__(self, right: Matrix) -> Matrix:
        """Return the solution(s) for right-hand side(s) (n,) or (n, k)."""
        return self.solve(right)


def silent(_: str) -> None:
    """Ignore the sentence; default for functions that report their progress."""


def factorise(matrix: Matrix, *, backend: str = "auto", say: Say = silent) -> Factorisation:
    """Factorise a square matrix.

    Parameters
    ----------
    matrix
        (n, n), dense or sparse, real or complex: symmetric, Hermitian or general.
    backend
        ``dense``; ``multifrontal`` (real symmetric and complex Hermitian, positive definite); ``superlu`` (SciPy's); ``feral``
        (optional, for real symmetric and complex Hermitian matrices); ``auto`` takes the fastest applicable one that is
        installed. If feral fails, finds a vanishing pivot, or solves with too large a residual, ``auto`` takes SuperLU, with a
        warning. Complex matrices that are not positive definite go from ``multifrontal`` to feral, or to SuperLU.
    say
        Called with a sentence before a long factorisation.

    Raises
    ------
    SingularError
        If a pivot vanishes (``multifrontal``: is not positive), or if the condition number exceeds `SINGULAR`.
    InputError
        If `backend` is unknown, or is ``feral`` or ``multifrontal`` for a matrix that is neither symmetric nor Hermitian.
    StickslipError
        If `backend` is ``feral`` and the package is not installed, fails, or solves with too large a residual.
    """
    chosen = _chosen(matrix, backend)
    if chosen == "dense":
        found = _dense(as_array(matrix))
    else:
        say(f"factorising {matrix.shape[0]} equations ({chosen})")
        found = _sparse(matrix, chosen, say, free=backend == "auto")
    refuse_singular(matrix, found)
    return found


def _sparse(matrix: Matrix, backend: str, say: Say, *, free: bool) -> Factorisation:
    """Factorise a sparse matrix; another backend takes over where one fails, if the choice is `free`."""
    try:
        return SPARSE[backend](matrix)
    except _DistrustedError as error:
        if not free:
            raise StickslipError(f"factorise: {error}") from error
        _warn(error)
        return _superlu(matrix)
    except SingularError:
        if backend not in ("multifrontal", "feral") or not free:
            raise
        following = _indefinite() if backend == "multifrontal" else "superlu"
        not_so = "positive definite" if backend == "multifrontal" else "regular for feral"
        say(f"the matrix is not {not_so}: factorising again ({following})")
        return _sparse(matrix, following, say, free=True)


def _chosen(matrix: Matrix, backend: str) -> str:
    """Return the name of the backend for `matrix`."""
    if backend not in BACKENDS:
        raise input_error("factorise: backend", f"got {backend!r}", f"Use one of {', '.join(BACKENDS)}.")
    if backend in ("feral", "multifrontal") and not _hermitian(matrix):
        raise input_error(
            "factorise: backend",
            f"{backend} factorises real symmetric and complex Hermitian matrices, which this is not",
            "Use superlu.",
        )
    if backend != "auto":
        return backend
    if matrix.shape[0] <= DENSE or not scipy.sparse.issparse(matrix):
        return "dense"
    if matrix.shape[0] <= MIN_FERAL_ROWS or not _hermitian(matrix):
        return "superlu"
    if _has_feral() and not np.iscomplexobj(matrix):
        return "feral"
    positive = matrix.shape[0] > HUGE and np.all(matrix.diagonal().real > 0)
    return "multifrontal" if positive else "superlu"


def _indefinite() -> str:
    """Return the backend for a large Hermitian matrix that is not positive definite."""
    return "feral" if _has_feral() else "superlu"


def _has_feral() -> bool:
    """Whether feral is installed; a folder of the same name in the working directory has no origin and does not count."""
    spec = find_spec("feral")
    return spec is not None and spec.origin is not None


def _hermitian(matrix: Matrix) -> bool:
    largest = np.max(np.abs(matrix.data if scipy.sparse.issparse(matrix) else matrix), initial=0.0)
    difference = abs(matrix - matrix.conj().T).max() if largest > 0 else 0.0
    return bool(difference <= SYMMETRIC * largest)


def _dense(matrix: Matrix) -> Factorisation:
    if not np.all(np.isfinite(matrix)):
        raise SingularError("factorise: the matrix has entries that are not finite")
    getrf = scipy.linalg.get_lapack_funcs("getrf", (matrix,))
    lu, pivots, info = getrf(matrix)
    if info != 0:
        raise SingularError("factorise: the matrix is singular")
    return Factorisation(lambda b: np.asarray(scipy.linalg.lu_solve((lu, pivots), b)), "dense")


def negative_eigenvalues(matrix: Matrix, *, say: Say = silent) -> int | None:
    """Return the number of negative eigenvalues of a Hermitian matrix (Sylvester's law of inertia).

    Parameters
    ----------
    matrix
        (n, n), dense or sparse, real symmetric or complex Hermitian.
    say
        Called with a sentence before a long factorisation.

    Returns
    -------
    int or None
        None if a pivot vanishes, or the factors are too large to be examined.
    """
    chosen = _chosen(matrix, "auto")
    if chosen == "multifrontal":
        chosen = _indefinite()
    if chosen == "dense":
        whole = as_array(matrix)
        whole = (whole + whole.conj().T) / 2  # makes the diagonal exactly real
        blocks = scipy.linalg.ldl(whole, hermitian=True)[1]  # diagonal blocks of one or two rows
        beside = np.abs(np.diag(blocks, -1))
        signs = scipy.linalg.eigvalsh_tridiagonal(np.diag(blocks).real, beside)
        return int(np.count_nonzero(signs < 0))
    say(f"factorising {matrix.shape[0]} equations ({chosen}) to count frequencies")
    return _by_feral(matrix, say) if chosen == "feral" else _by_superlu(matrix)


def _by_superlu(matrix: Matrix) -> int | None:
    """Count negative pivots with SuperLU, all on the diagonal: only then do their signs count eigenvalues."""
    try:
        return _superlu(matrix, threshold=0.0).negative
    except SingularError:
        return None


def _by_feral(matrix: Matrix, say: Say) -> int | None:
    """Count negative pivots with feral; up to `MAX_CHECKED_ROWS` rows, check with SuperLU, which is trusted if they differ."""
    try:
        found = _feral(matrix).negative
    except (SingularError, _DistrustedError) as error:
        if isinstance(error, _DistrustedError):
            _warn(error)
        return _by_superlu(matrix)
    if matrix.shape[0] > MAX_CHECKED_ROWS:
        say(f"{found} negative pivots by feral alone: too many equations to count them again")
        return found
    again = _by_superlu(matrix)
    if again is None or again == found:
        return found
    _warn(f"it counts {found} negative pivots of {matrix.shape[0]}, SuperLU {again}")
    return again


def _superlu(matrix: Matrix, threshold: float = PIVOTS) -> Factorisation:
    """Factorise a real or complex matrix with SuperLU."""
    from scipy.sparse.linalg import splu

    try:
        lu = splu(
            scipy.sparse.csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=threshold,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise SingularError(f"factorise: {error}") from error

    def count() -> int | None:
        if lu.nnz > MAX_COUNTED_ENTRIES:
            return None
        if np.array_equal(lu.perm_r, lu.perm_c):  # U = D Lᴴ, D real
            return int(np.count_nonzero(lu.U.diagonal().real < 0))
        return negative_eigenvalues(matrix) if threshold > 0 else None

    if not np.iscomplexobj(matrix):
        return Factorisation(_of_complex(lambda b: np.asarray(lu.solve(b))), "superlu", count)
    return Factorisation(lambda b: np.asarray(lu.solve(np.asarray(b, dtype=complex))), "superlu", count)


def _multifrontal(matrix: Matrix) -> Factorisation:
    """Factorise a Hermitian positive definite matrix with the multifrontal method."""
    return Factorisation(multifrontal(scipy.sparse.csr_array(matrix)).solve, "multifrontal", lambda: 0)


def _feral(matrix: Matrix) -> Factorisation:
    """Factorise a symmetric matrix with feral, or a Hermitian one as a real matrix of twice the size.

    Raises
    ------
    SingularError
        If a pivot vanishes.
    _DistrustedError
        If the package fails, or solves with a residual above `RESIDUAL`.
    """
    try:
        import feral
    except ImportError as error:
        raise missing_package("feral-solver", error, "sparse") from error
    with _failures_of(feral):
        found = _of_feral(feral, matrix)
        left = _residual(matrix, found)
    if not left <= RESIDUAL:
        raise _DistrustedError(f"it leaves a residual of {left:.1g} in {matrix.shape[0]} equations, above {RESIDUAL:g}")
    return found


def _of_feral(feral: Matrix, matrix: Matrix) -> Factorisation:
    if not np.iscomplexobj(matrix):
        own = _factored(feral, matrix)
        return Factorisation(_of_complex(own.solve), "feral", lambda: own.num_negative_eigenvalues)
    real, imaginary = matrix.real, matrix.imag.copy()  # without the copy, zeros would be removed from `matrix` as well
    imaginary.eliminate_zeros()
    doubled = scipy.sparse.block_array([[real, -imaginary], [imaginary, real]], format="csc")
    solver, n = _factored(feral, doubled), matrix.shape[0]

    def solve(right: Matrix) -> Matrix:
        both = solver.solve(np.concatenate([np.real(right), np.imag(right)]))
        return np.asarray(both[:n] + 1j * both[n:])

    return Factorisation(solve, "feral", lambda: solver.num_negative_eigenvalues // 2)


def _factored(feral: Matrix, matrix: Matrix) -> Matrix:
    """Return the package's solver of a real symmetric CSC matrix.

    It uses one thread, since a study has a process for each core. Fused multiply-add changes only the last digits.
    """
    lower = scipy.sparse.tril(matrix, format="csc")
    lower.sort_indices()
    solver = feral.Solver(parallel=False, fma=True)
    pattern = lower.indptr.astype(np.int64), lower.indices.astype(np.int64)
    solver.factor(feral.CscMatrix(lower.shape[0], *pattern, lower.data))
    if solver.inertia.n_zero:
        raise SingularError(
            f"factorise: the matrix of {lower.shape[0]} equations is singular: {solver.inertia.n_zero} pivots vanish"
        )
    return solver


@contextmanager
def _failures_of(feral: Matrix) -> Iterator[None]:
    """Convert errors of feral into a `_DistrustedError`; a Rust panic is a `BaseException`, but no `Exception`."""
    try:
        yield
    except BaseException as error:
        if isinstance(error, feral.FeralError) or type(error).__name__ == "PanicException":
            raise _DistrustedError(f"it failed ({error})") from error
        raise


def _residual(matrix: Matrix, solve: Solve) -> float:
    """Return the backward error of a random system: the relative change of the entries that makes its solution exact.

    Componentwise backward error of Oettli & Prager (1964).
    """
    size = np.sqrt(np.asarray(abs(matrix).sum(axis=1)).ravel())
    right = size * np.random.default_rng(1).standard_normal(matrix.shape[0])
    with np.errstate(all="ignore"):  # the caller judges an overflow
        answer = solve(right)
        terms = abs(matrix) @ abs(answer) + abs(right)
        return float(np.max(abs(matrix @ answer - right) / terms))


def _warn(why: object) -> None:
    LOG.warning("feral-solver is not used: %s. SuperLU takes its place.", why)


def _of_complex(solve: Solve) -> Solve:
    """Extend the solver of a real matrix to complex right-hand sides."""

    def both(b: Matrix) -> Matrix:
        if np.iscomplexobj(b):
            return solve(np.ascontiguousarray(b.real)) + 1j * solve(np.ascontiguousarray(b.imag))
        return solve(np.asarray(b, dtype=float))

    return both


def refuse_singular(matrix: Matrix, solve: Solve) -> None:
    """Raise a `SingularError` if two steps of inverse iteration find a condition number above `SINGULAR`.

    Rows are scaled by their sums, so that units do not matter.
    """
    size = np.sqrt(np.asarray(abs(matrix).sum(axis=1)).ravel())
    vector = np.random.default_rng(0).standard_normal(len(size))
    for _ in range(2):
        vector = vector / np.linalg.norm(vector)
        with np.errstate(all="ignore"):  # an overflow is judged below
            vector = size * solve(size * vector)
        growth = float(np.linalg.norm(vector))
        if not growth < SINGULAR:
            raise SingularError(
                f"factorise: the matrix of {len(size)} equations is singular to working precision "
                f"(condition number above {growth:.1g})"
            )


SPARSE = {"multifrontal": _multifrontal, "superlu": _superlu, "feral": _feral}
