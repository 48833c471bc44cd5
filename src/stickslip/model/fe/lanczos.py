"""Block Lanczos iteration for the lowest modes of large structures.

R. G. Grimes, J. G. Lewis and H. D. Simon, "A shifted block Lanczos algorithm for solving sparse symmetric generalized
eigenproblems", SIAM Journal on Matrix Analysis and Applications 15 (1994) 228-272; here with full reorthogonalisation and
one shift.
"""

from collections.abc import Callable

import numpy as np

from stickslip.arrays import FloatArray, Matrix
from stickslip.errors import input_error
from stickslip.model.fe.factorisation import Solve

BLOCK = 8  # vectors of a block
CONVERGED = 1e-10  # residual of a mode over its eigenvalue; the frequency's error is its square
PROBE = 2  # random directions added after convergence, to find repeated frequencies that the blocks missed
STEPS = 5  # steps with these directions before the next check
KNOWN = 1e-10  # relative change of an eigenvalue above which these directions have found a new one
ROUNDING = 1e-14  # smallest attainable residual over the largest eigenvalue; also the threshold of the rank
ROUNDING_SQUARES = (1e-24, 1e-12)  # squared length over the largest, before and after normalisation: less is rounding


def lanczos(mass: Matrix, n: int, solve: Solve, shift: float, kind: type) -> tuple[FloatArray, Matrix]:
    """Return the `n` eigenvalues of ``K φ = λ M φ`` nearest to `shift`, and M-orthonormal vectors.

    Parameters
    ----------
    mass
        (size, size) mass, positive semidefinite.
    n
        Number of eigenvalues, at most the rank of the mass.
    solve
        Solver of systems with ``K − shift M``.
    shift
        Shift, between eigenvalues.
    kind
        `float` or `complex`.

    Raises
    ------
    InputError
        If the rank of the mass is below `n`.

    Notes
    -----
    The Krylov space of ``(K − shift M)⁻¹ M``, which is self-adjoint in the mass, is built from blocks. The start block is
    multiplied by this operator, which removes motions without mass. Of a repeated eigenvalue a Krylov space contains at most as
    many vectors as a block has. Therefore random directions are added after convergence, until they give no new eigenvalue.
    """
    size = mass.shape[0]
    random = np.random.default_rng(0)  # the same in every run

    def fresh(count: int) -> Matrix:
        block = solve(mass @ random.standard_normal((size, count)).astype(kind))
        length = np.sqrt(np.sum((block.conj() * (mass @ block)).real, axis=0))
        return block / np.where(length > 0, length, 1.0)

    basis = np.empty((size, min(size, 2 * n + 12 * BLOCK)), dtype=kind, order="F")
    projected: Matrix = np.zeros((0, 0), dtype=kind)
    known, turn = basis[:, :0], np.zeros((0, 0))
    largest: FloatArray = np.zeros(0)
    block, heavy = _orthonormal(mass, fresh(min(BLOCK, size)), known, fresh)[:2]
    before, pause = largest, 0
    while block.shape[1]:
        basis, known = _appended(basis, len(projected), block)
        image = solve(heavy)
        column = known.conj().T @ (mass @ image)
        image -= known @ column
        projected = _bordered(projected, column)
        block, heavy, remainder = _orthonormal(mass, image, known, fresh)
        pause -= 1
        if (len(projected) < n or pause > 0) and block.shape[1]:
            continue
        largest, turn = _largest(projected, n)
        rest = np.linalg.norm((block.conj().T @ remainder) @ turn[-image.shape[1] :], axis=0)
        found = before.size and np.any(abs(largest - before) > KNOWN * abs(largest))
        if np.all(rest <= np.maximum(CONVERGED * abs(largest), ROUNDING * abs(largest[0]))):
            if before.size and not found:
                break
            before, pause = largest, STEPS
            probe = _without(mass, fresh(min(PROBE, size)), known)
            block, heavy = _orthonormal(mass, probe, known, fresh)[:2]
        elif found and block.shape[1] < BLOCK:  # more equal frequencies may follow
            more = _without(mass, fresh(BLOCK - block.shape[1]), known)
            block, heavy = _orthonormal(mass, np.hstack([block, more]), known, fresh)[:2]
    rank = int(np.count_nonzero(abs(largest) > ROUNDING * np.max(abs(largest), initial=0.0)))
    if rank < n:
        raise input_error(
            "normal_modes", f"{n} asked of {size} dofs whose mass has the rank {rank}", "Ask for at most as many."
        )
    return shift + 1.0 / largest, known @ turn


def _largest(projected: Matrix, n: int) -> tuple[FloatArray, Matrix]:
    """Return the `n` eigenvalues of largest magnitude, and their vectors."""
    values, vectors = np.linalg.eigh(projected, UPLO="U")
    chosen = np.argsort(-abs(values))[:n]
    return values[chosen], vectors[:, chosen]


def _without(mass: Matrix, block: Matrix, known: Matrix) -> Matrix:
    """Return `block` without its M-orthogonal projection on the orthonormal vectors `known`."""
    return block - known @ (known.conj().T @ (mass @ block))


def _appended(basis: Matrix, count: int, block: Matrix) -> tuple[Matrix, Matrix]:
    """Return the basis with `block` after its first `count` columns, enlarged where needed, and its used part."""
    end = count + block.shape[1]
    if end > basis.shape[1]:
        larger = np.empty((len(basis), 2 * end), dtype=basis.dtype, order="F")
        larger[:, :count] = basis[:, :count]
        basis = larger
    basis[:, count:end] = block
    return basis, basis[:, :end]


def _bordered(projected: Matrix, column: Matrix) -> Matrix:
    """Return the projected operator with new columns; only its upper triangle is used."""
    old, end = len(projected), len(column)
    larger = np.zeros((end, end), dtype=column.dtype)
    larger[:old, :old] = projected
    larger[:, old:] = column
    return larger


def _orthonormal(
    mass: Matrix, image: Matrix, known: Matrix, fresh: Callable[[int], Matrix]
) -> tuple[Matrix, Matrix, Matrix]:
    """Return M-orthonormal columns of `image`, their products with M, and ``M @ image``.

    `image` is already M-orthogonal to `known`, up to rounding errors of the size of the part removed, so it is
    orthogonalised again. Columns that consist of such errors only are replaced by new directions, as long as there are any.
    """
    block, added = image, False
    heavy = of_image = mass @ block
    for again in (False, True, True):
        reference = np.max(np.sum((block.conj() * heavy).real, axis=0), initial=0.0)
        if again:
            block = block - known @ (known.conj().T @ heavy)
            heavy = mass @ block
        squares, turn = np.linalg.eigh(block.conj().T @ heavy)
        weak = squares <= ROUNDING_SQUARES[again] * reference
        turn = turn[:, ~weak] / np.sqrt(squares[~weak])
        block, heavy = block @ turn, heavy @ turn
        if np.any(weak) and not again:
            new = fresh(int(np.count_nonzero(weak)))
            block, heavy, added = np.hstack([block, new]), np.hstack([heavy, mass @ new]), True
        elif again and not added:
            break
    return block, heavy, of_image
