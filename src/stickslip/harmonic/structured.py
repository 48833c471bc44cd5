"""Products of the Jacobian of the harmonic balance, and its preconditioner.

``J = Z + Bᵀ K̂ B`` is block-diagonal in the harmonics except for ``K̂``, which is local to each contact. Thus factors
of ``D_h = Z_h + K̂ʰʰ``, one complex matrix per harmonic or one real matrix for all (`harmonic.shared_factor`), are a
preconditioner. From the lowest harmonic to the highest, each is solved including the contact coupling to those below:
block Gauss-Seidel, ``P = D + Bᵀ K̂_lower B``. It halves the iterations compared with D alone and needs no further
factors. With ``J = P + Bᵀ(K̂ - K_P)B`` no product with Z is needed if D was made at the same frequency.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Protocol

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.contact.interface import SparseRows, add_contact_jacobian
from stickslip.contact.law import PAIRS
from stickslip.contact.product import (
    add_upper,
    contact_product,
    harmonic_means,
    less_means,
    subtract_lower,
    sweep,
    triangles,
)
from stickslip.harmonic.costs import linear_costs, reduced_cost
from stickslip.harmonic.factors import AnyFactors, as_array, factorise, real_part, with_contacts
from stickslip.harmonic.linear import Shareable, StiffnessProducts
from stickslip.harmonic.matrix_products import (
    MAX_SMALL_BLOCK,
    MatrixProducts,
    SmallBlocks,
    dynamic_stiffness,
    small_blocks,
)
from stickslip.harmonic.shared_factor import SharedFactor, SharedInverses, shared_factor
from stickslip.harmonic.sparse_stiffness import SparseProduct
from stickslip.harmonic.stuck_contact_elimination import Coupling, Resting, TransposedElimination, coupling, known
from stickslip.operators import Costs, JacobianOperator

KEPT = 1000  # unknowns up to which the array of a dynamic stiffness is cached
SHARED = 150  # unknowns per harmonic above which one factor for all harmonics costs less than one each

Solve = Callable[[FloatArray], FloatArray]
Product = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class HarmonicFactors:
    """LU factors of ``Z_h + K̂ʰʰ`` for each harmonic, the costly part of the preconditioner.

    Attributes
    ----------
    linear
        The dynamic stiffness in the factors.
    means
        (len(harmonics), n_contacts, 3, 3) contact stiffness in the factors, N/m.
    factors
        Factors of each harmonic, in the scale of the Jacobian; harmonic 0 is real.
    inverses
        The inverses, if the matrices are small.
    """

    linear: StiffnessProducts
    means: ComplexArray
    factors: tuple[AnyFactors, ...]
    inverses: SmallBlocks | None

    def solve(self, place: int, rows: FloatArray) -> FloatArray:
        """Solve harmonic number `place` for its one or two rows (k, n)."""
        if place == 0:
            return np.asarray(self.factors[0].solve(rows[0]), dtype=float)[None]
        solved = self.factors[place].solve(rows[0] - 1j * rows[1])
        return np.stack([solved.real, -solved.imag])

    def solve_transposed(self, place: int, rows: FloatArray) -> FloatArray:
        """Solve with the transpose of the real form of harmonic number `place`."""
        if place == 0:
            return np.asarray(self.factors[0].solve_transposed(rows[0]), dtype=float)[None]
        # the transpose of the real form of A is the real form of Aᴴ
        solved = self.factors[place].solve_transposed(rows[0] + 1j * rows[1])
        return np.stack([solved.real, solved.imag])


Kept = HarmonicFactors | SharedFactor


@dataclass(frozen=True, eq=False)
class StructuredJacobian:
    """The Jacobian ``scale (Z + Bᵀ K̂ B)`` as products with vectors.

    Parameters
    ----------
    linear
        Dynamic stiffness at the frequency.
    blocks
        (n_contacts, P, m, m) derivatives of the contact forces by the gaps, N/m, in the same harmonics.
    rows
        Gap operator by contact.
    scale
        Displacement scale over force scale.
    """

    linear: StiffnessProducts
    blocks: FloatArray
    rows: SparseRows
    scale: float

    @property
    def problem(self) -> object:
        """Key of Jacobians that can share a preconditioner: contacts at the same coordinates, and the same harmonics."""
        return self.rows

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        size = self.linear.n * (2 * len(self.linear.harmonics) - 1)
        return size, size

    def matvec(self, v: FloatArray) -> FloatArray:
        """Return ``J v``."""
        q = self._by_row(v)
        small = self.linear.n <= MAX_SMALL_BLOCK
        moved = dynamic_stiffness(self.linear).product(q) if small else self.linear.product(q)
        return self.scale * self._add_contacts(self.blocks, q, False, moved)

    def rmatvec(self, v: FloatArray) -> FloatArray:
        """Return ``Jᵀ v``."""
        q = self._by_row(v)
        out = self.linear.transposed_product(q)
        return self.scale * self._add_contacts(self.blocks, q, True, out)

    @property
    def transposed(self) -> "Transposed":
        """Transpose of the Jacobian."""
        return Transposed(self)

    @cached_property
    def coupling(self) -> Coupling:
        """Contact forces that couple harmonics."""
        return coupling(self.blocks, self.rows, self.linear.n)

    @cached_property
    def costs(self) -> Costs:
        """Estimated cost of its linear systems."""
        n, harmonics = self.linear.n, len(self.linear.harmonics)
        if isinstance(self.linear, SparseProduct):
            return linear_costs(n, harmonics, self.blocks.size, self.linear.entries)
        shared = n >= SHARED and isinstance(self.linear, Shareable)
        own = linear_costs(n, harmonics, self.blocks.size, shared=shared)
        return Costs(own.product, own.factors, min(own.array, self._reduced_cost))

    @cached_property
    def _reduced_cost(self) -> float:
        """Estimated cost of a solution as an array after elimination of uncoupled unknowns."""
        rested = known(self.linear, self.rows).knows(self.coupling, self.scale)
        return reduced_cost(self.linear.n, self.coupling.counts, known=rested)

    def eliminated(self) -> Resting | None:
        """Return the elimination of unknowns that stuck and open contacts leave uncoupled.

        None if the full array is cheaper.
        """
        if isinstance(self.linear, SparseProduct) or self.costs.array < self._reduced_cost:
            return None
        return known(self.linear, self.rows).without_resting(self.coupling, self.rows, self.scale)

    def dense(self) -> FloatArray:
        """Return the Jacobian as an array."""
        n, linear = self.linear.n, self.linear
        if isinstance(linear, MatrixProducts) and self.shape[0] <= KEPT:
            jac = self.scale * real_form(linear)
        else:
            jac = real_matrix([as_array(linear.block(h)) for h in linear.harmonics])
            jac *= self.scale
        add_contact_jacobian(self.blocks, self.rows.columns, self.rows.values, n, self.scale, jac)
        return jac

    def own_blocks(self) -> Iterator[tuple[ComplexArray, Matrix]]:
        """Yield for each harmonic the contact stiffness (n_contacts, 3, 3), N/m, and ``scale (Z_h + K̂ʰʰ)`` (n, n).

        The matrix is a copy.
        """
        means = harmonic_means(self.blocks)
        for mean, h in zip(means, self.linear.harmonics, strict=True):
            block = with_contacts(self.linear.block(h), mean, self.rows)
            block *= self.scale
            yield mean, block

    def preconditioner(self) -> Kept | None:
        """Factorise the preconditioner; None if it is singular.

        One factor serves all harmonics if the structure allows it; otherwise each ``Z_h + K̂ʰʰ`` is factorised.
        """
        if isinstance(self.linear, Shareable) and self.linear.n >= SHARED:
            shared = shared_factor(self.linear, harmonic_means(self.blocks), self.rows, self.scale)
            if shared is not None:
                return shared
        return self._harmonic_factors()

    def better_preconditioner(self, kept: Kept) -> HarmonicFactors | None:
        """Return the factors of ``Z_h + K̂ʰʰ`` if `kept` is one factor for all harmonics.

        None if `kept` already has a factor per harmonic, or a matrix is singular.
        """
        return self._harmonic_factors() if isinstance(kept, SharedFactor) else None

    def _harmonic_factors(self) -> HarmonicFactors | None:
        factors, means = [], []
        for h, (mean, matrix) in enumerate(self.own_blocks()):
            own = factorise(real_part(matrix) if h == 0 else matrix)
            if own is None:
                return None
            means.append(mean)
            factors.append(own)
        inverses = None
        if self.linear.n <= MAX_SMALL_BLOCK:
            unit = np.eye(self.linear.n, dtype=complex)
            inverses = small_blocks([np.asarray(own.solve(unit), dtype=complex) for own in factors])
        return HarmonicFactors(self.linear, np.array(means), tuple(factors), inverses)

    def preconditioned_by(self, kept: Kept) -> tuple[Solve, Product]:
        """Return the solver of ``P x = y``, and ``J v`` as a function of v and ``P v``.

        P has the kept factors and the contact coupling of this Jacobian.
        """
        own = self._inverses(kept)
        if isinstance(own, HarmonicFactors) and own.inverses is not None:
            return self._by_triangles(own, own.inverses)

        def solve(right: FloatArray) -> FloatArray:
            return self._sweep(own, right)

        if not isinstance(kept, HarmonicFactors) or not self.linear.same(kept.linear):
            return solve, lambda v, _: self.matvec(v)
        left = less_means(self.blocks, kept.means)
        for h in range(1, len(self.linear.harmonics)):
            left[:, :, 2 * h - 1 : 2 * h + 1, : 2 * h - 1] = 0.0

        def product(v: FloatArray, preconditioned: FloatArray) -> FloatArray:
            q = self._by_row(v)
            return preconditioned + self.scale * self._add_contacts(left, q, False, np.zeros_like(q))

        return solve, product

    def _by_triangles(self, own: HarmonicFactors, inverses: SmallBlocks) -> tuple[Solve, Product]:
        """Return the same functions for small matrices, with the coupling of the harmonics stored for all products."""
        parts = triangles(self.blocks, own.means)
        columns, values = self.rows.columns, self.rows.values
        gap, force = np.empty((2, len(self.blocks), 3, 2 * len(self.linear.harmonics) - 1))

        def solve(right: FloatArray) -> FloatArray:
            rows = self._by_row(right).copy()
            out = np.empty_like(rows)
            of = inverses.real, inverses.imaginary, parts.below, parts.lower
            sweep(*of, columns, values, self.scale, rows, gap, force, out)
            return out.reshape(-1)

        if not self.linear.same(own.linear):
            return solve, lambda v, _: self.matvec(v)

        def product(v: FloatArray, preconditioned: FloatArray) -> FloatArray:
            out = self._by_row(preconditioned).copy()
            add_upper(parts.above, parts.upper, columns, values, self.scale, self._by_row(v), gap, force, out)
            return out.reshape(-1)

        return solve, product

    def transposed_solve(self, kept: Kept) -> Solve:
        """Return the solver of ``Pᵀ x = y``: harmonic by harmonic, from the highest one down."""
        own = self._inverses(kept)

        def solve(right: FloatArray) -> FloatArray:
            rows = self._by_row(right).copy()
            for h in range(len(self.linear.harmonics) - 1, -1, -1):
                first, last = max(2 * h - 1, 0), 2 * h + 1
                rows[first:last] = own.solve_transposed(h, rows[first:last])
                if h > 0:
                    self._subtract_from_lower(rows, first, last)
            return rows.reshape(-1)

        return solve

    def _subtract_from_lower(self, rows: FloatArray, first: int, last: int) -> None:
        """Subtract the transposed coupling with the rows from `first` to `last` from the rows before them."""
        gap = self.rows.gaps(rows[first:last]).reshape(2, -1, 3)
        force = np.zeros((first, *gap.shape[1:]))
        for block, (row, col) in enumerate(PAIRS[: self.blocks.shape[1]]):
            force[:, :, col] += np.einsum("cpq,pc->qc", self.blocks[:, block, first:last, :first], gap[:, :, row])
        self.rows.add_forces(-self.scale * force.reshape(first, -1), rows[:first])

    def _inverses(self, kept: Kept) -> HarmonicFactors | SharedInverses:
        if isinstance(kept, HarmonicFactors):
            return kept
        assert isinstance(self.linear, Shareable)  # only such products make a shared factor
        return kept.of(self.linear, harmonic_means(self.blocks), self.scale)

    def _sweep(self, own: HarmonicFactors | SharedInverses, right: FloatArray) -> FloatArray:
        """Solve harmonic by harmonic, from the static one up."""
        rows = self._by_row(right).copy()
        gap = np.zeros((len(self.blocks), 3, len(rows)))
        before = first = 0
        for h in range(len(self.linear.harmonics)):
            last = 2 * h + 1
            self.subtract_below((before, first, last), gap, rows)
            rows[first:last] = own.solve(h, rows[first:last])
            before, first = first, last
        return rows.reshape(-1)

    def subtract_below(self, span: tuple[int, int, int], gap: FloatArray, rows: FloatArray) -> None:
        """Subtract the contact forces of the lower, solved harmonics from a harmonic of the right side `rows`.

        See `subtract_lower` for the arguments.
        """
        subtract_lower(self.blocks, self.rows.columns, self.rows.values, rows, *span, self.scale, gap, rows)

    def _by_row(self, v: FloatArray) -> FloatArray:
        return np.ascontiguousarray(v.reshape(-1, self.linear.n))

    def _add_contacts(self, blocks: FloatArray, q: FloatArray, transposed: bool, out: FloatArray) -> FloatArray:
        m = q.shape[0]
        contact_product(
            blocks, self.rows.columns, self.rows.values, q, transposed, np.empty((3, m)), np.empty((3, m)), out
        )
        return out.reshape(-1)


class Transposable(JacobianOperator, Protocol):
    """A Jacobian that makes a preconditioner for itself and its transpose."""

    @property
    def problem(self) -> object: ...  # noqa: D102

    @property
    def costs(self) -> Costs: ...  # noqa: D102

    def dense(self) -> FloatArray: ...  # noqa: D102

    def preconditioner(self) -> Any: ...  # noqa: D102

    def transposed_solve(self, kept: Any) -> Solve: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class Transposed:
    """The transpose of a Jacobian, known by its products; both share the factors of a preconditioner."""

    transposed: Transposable

    @property
    def problem(self) -> object:
        """Key of the Jacobian; see `StructuredJacobian.problem`."""
        return self.transposed.problem

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.transposed.shape

    @property
    def costs(self) -> Costs:
        """Estimated cost of its linear systems."""
        return self.transposed.costs

    def eliminated(self) -> TransposedElimination | None:
        """Return the transpose of the Jacobian's elimination."""
        if not isinstance(self.transposed, StructuredJacobian):
            return None
        own = self.transposed.eliminated()
        return None if own is None else TransposedElimination(own)

    def dense(self) -> FloatArray:
        """Return the transpose as an array."""
        return self.transposed.dense().T

    def matvec(self, v: FloatArray) -> FloatArray:
        """Return ``Jᵀ v``."""
        return self.transposed.rmatvec(v)

    def rmatvec(self, v: FloatArray) -> FloatArray:
        """Return ``J v``."""
        return self.transposed.matvec(v)

    def preconditioner(self) -> Any:
        """Return the preconditioner of the Jacobian."""
        return self.transposed.preconditioner()

    def preconditioned_by(self, kept: Any) -> tuple[Solve, Product]:
        """Return the solver of ``Pᵀ x = y``, and ``Jᵀ v`` as a function of v and ``Pᵀ v``."""
        return self.transposed.transposed_solve(kept), lambda v, _: self.matvec(v)


def real_matrix(blocks: list[ComplexArray] | ComplexArray) -> FloatArray:
    """Return the harmonic-major real form of complex (n, n) `blocks`, in Fortran order.

    There is one block per harmonic, the static one first.
    """
    m, n = 2 * len(blocks) - 1, blocks[0].shape[0]
    columns = np.zeros((m, n, m, n))  # of the matrix, whose rows come last
    cos, sin = slice(1, None, 2), slice(2, None, 2)
    each = np.transpose(blocks, (0, 2, 1))
    own = np.einsum("hihj->hij", columns)
    own[0], own[cos], own[sin] = each[0].real, each[1:].real, each[1:].real
    np.einsum("hihj->hij", columns[sin, :, cos])[:] = each[1:].imag
    np.einsum("hihj->hij", columns[cos, :, sin])[:] = -each[1:].imag
    return columns.reshape(m * n, m * n).T


@lru_cache(maxsize=4)
def real_form(linear: MatrixProducts) -> FloatArray:
    """Return the real form of the dynamic stiffness at one frequency, N/m.

    It is cached, because a Newton iteration at fixed frequency needs it at every step.
    """
    return real_matrix(linear.condensed.stiffness)
