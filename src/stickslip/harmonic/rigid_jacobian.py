"""Products of the Jacobian of a periodic problem with rigid contacts.

Each rigid gap has a predicted force ``p = -r/f + ε D g``: the force that equilibrium requires, from the residual r
without rigid contacts, and a penalty on displacement or velocity of the gap. The contact law returns its part ``E p``.
With S the Jacobian without rigid contacts, R its rows at the gaps and f the ratio of gap to coordinate,
``J = S + Rᵀ f E (ε D f R - R S / f)``. This adds full rows, yet a product with J costs no more than one with S.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.contact.product import harmonic_means
from stickslip.harmonic.costs import CALL, linear_costs
from stickslip.harmonic.factors import AnyFactors, factorise
from stickslip.harmonic.matrix_products import MAX_SMALL_BLOCK
from stickslip.harmonic.structured import StructuredJacobian, Transposed
from stickslip.operators import Costs

Solve = Callable[[FloatArray], FloatArray]
Product = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class GapLaws:
    """Derivatives of the corrected forces at one motion, gap by gap.

    Attributes
    ----------
    column, factor
        (n_gaps,) retained coordinate of a gap, and ratio of gap to coordinate.
    own
        (n_gaps, m, m) derivatives of the forces by the predicted forces of the same gap.
    tangent, normal
        (k,) tangential gaps whose force depends on the predicted normal force, and the normal gaps of the same
        contacts.
    by_normal
        (k, m, m) derivatives of these forces by the predicted normal force.
    penalty
        (n_gaps,) penalty of the coordinate.
    slides
        (n_gaps,) whether the penalty acts on the velocity by τ = ωt, not on the displacement.
    """

    column: IntArray
    factor: FloatArray
    own: FloatArray
    tangent: IntArray
    normal: IntArray
    by_normal: FloatArray
    penalty: FloatArray
    slides: BoolArray

    @property
    def order(self) -> int:
        """Highest harmonic."""
        return int(self.own.shape[1] - 1) // 2

    def forces(self, predicted: FloatArray) -> FloatArray:
        """Return the change of the forces on the coordinates by a change of the predicted forces, both (n_gaps, m, k)."""
        out = self.own @ predicted
        out[self.tangent] += self.by_normal @ predicted[self.normal]
        return self.factor[:, None, None] * out

    def predictions(self, forces: FloatArray) -> FloatArray:
        """Return the product of the transposed derivatives with `forces`, both (n_gaps, m)."""
        given = (self.factor[:, None] * forces)[:, :, None]
        out = self.own.transpose(0, 2, 1) @ given
        back = self.by_normal.transpose(0, 2, 1) @ given[self.tangent]
        np.add.at(out, self.normal, back)
        return np.asarray(out[:, :, 0])

    def penalised(self, q: FloatArray) -> FloatArray:
        """Return ``ε D q`` of the coefficients (n_gaps, m) of the coordinates at the gaps."""
        rate = q @ derivative(self.order).T
        return self.penalty[:, None] * np.where(self.slides[:, None], rate, q)

    def penalised_transposed(self, q: FloatArray) -> FloatArray:
        """Return ``Dᵀ ε q``."""
        scaled = self.penalty[:, None] * q
        return np.where(self.slides[:, None], scaled @ derivative(self.order), scaled)

    def correct(self, jac: FloatArray) -> None:
        """Add the rigid contacts to a Jacobian without them, (size, size), in place."""
        m = self.own.shape[1]
        rows = self.column[:, None] + jac.shape[0] // m * np.arange(m)
        predicted = -jac[rows] / self.factor[:, None, None]
        rate, unit = derivative(self.order), np.eye(m)
        for g, own in enumerate(rows):
            predicted[g][:, own] += self.penalty[g] * (rate if self.slides[g] else unit)
        jac[rows] += self.forces(predicted)

    @cached_property
    def means(self) -> tuple[ComplexArray, ComplexArray]:
        """(H+1, n_gaps) and (H+1, k) effect of each harmonic of a prediction on the same harmonic of the force."""
        own, other = (harmonic_means(b[:, None])[:, :, 0, 0] for b in (self.own, self.by_normal))
        return own, other


@dataclass(frozen=True, eq=False)
class RigidFactors:
    """Factors of the preconditioner, its costly part.

    Attributes
    ----------
    factors
        Factors of each harmonic.
    rows
        (H+1, n_gaps, n) rows at the gaps of the harmonics without rigid contacts.
    inverses
        (H+1, n, n) inverses of the same matrices, if they are small.
    """

    factors: tuple[AnyFactors, ...]
    rows: ComplexArray
    inverses: ComplexArray | None

    def solve(self, harmonic: int, right: FloatArray | ComplexArray) -> FloatArray | ComplexArray:
        """Solve a harmonic for its right side (n,)."""
        if self.inverses is not None:
            return np.asarray(self.inverses[harmonic] @ right)
        return self.factors[harmonic].solve(right)


@dataclass(frozen=True, eq=False)
class RigidJacobian:
    """The Jacobian with rigid contacts.

    Parameters
    ----------
    soft
        The Jacobian without rigid contacts.
    laws
        Derivatives of the forces of rigid contacts.
    """

    soft: StructuredJacobian
    laws: GapLaws

    @property
    def problem(self) -> object:
        """Key of Jacobians that can share a preconditioner."""
        return self.soft.problem

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.soft.shape

    @property
    def transposed(self) -> Transposed:
        """Transpose of the Jacobian."""
        return Transposed(self)

    def matvec(self, v: FloatArray) -> FloatArray:
        """Return ``J v``."""
        laws = self.laws
        out, q = self._by_row(self.soft.matvec(v)), self._by_row(v)
        predicted = laws.penalised(q[:, laws.column].T)
        predicted -= out[:, laws.column].T / laws.factor[:, None]
        out[:, laws.column] += laws.forces(predicted[:, :, None])[:, :, 0].T
        return out.reshape(-1)

    def rmatvec(self, v: FloatArray) -> FloatArray:
        """Return ``Jᵀ v``."""
        laws = self.laws
        w = self._by_row(v).copy()
        back = laws.predictions(w[:, laws.column].T)
        w[:, laws.column] -= (back / laws.factor[:, None]).T
        out = self._by_row(self.soft.rmatvec(w.reshape(-1)))
        out[:, laws.column] += laws.penalised_transposed(back).T
        return out.reshape(-1)

    @property
    def costs(self) -> Costs:
        """Estimated cost of its linear systems; the harmonics of a product are solved one by one."""
        harmonics = self.laws.order + 1
        derivatives = self.soft.blocks.size + self.laws.own.size + self.laws.by_normal.size
        own = linear_costs(self.soft.linear.n, harmonics, derivatives)
        return replace(own, product=own.product + CALL * harmonics)

    def dense(self) -> FloatArray:
        """Return the Jacobian as an array."""
        jac = self.soft.dense()
        self.laws.correct(jac)
        return jac

    def preconditioner(self) -> RigidFactors | None:
        """Return the factors of the diagonal block of each harmonic; None if one of them is singular."""
        laws, factors, rows = self.laws, [], []
        (own, other), factor = laws.means, laws.factor[:, None]
        for h, (_, matrix) in enumerate(self.soft.own_blocks()):
            rows.append(matrix[laws.column])
            predicted = -rows[-1] / factor
            predicted[np.arange(factor.size), laws.column] += self._penalty(h)
            force = own[h][:, None] * predicted
            force[laws.tangent] += other[h][:, None] * predicted[laws.normal]
            matrix[laws.column] += factor * force
            made = factorise(np.array(matrix.real, order="F") if h == 0 else matrix)
            if made is None:
                return None
            factors.append(made)
        inverses = None
        if self.soft.linear.n <= MAX_SMALL_BLOCK:
            unit = np.eye(self.soft.linear.n, dtype=complex)
            inverses = np.array([one.solve(unit) for one in factors])
        return RigidFactors(tuple(factors), np.array(rows), inverses)

    def preconditioned_by(self, kept: RigidFactors) -> tuple[Solve, Product]:
        """Return the solver of ``P x = y``, and ``J v`` as a function of v and ``P v``."""
        return lambda right: self._sweep(kept, right), lambda v, _: self.matvec(v)

    def transposed_solve(self, kept: RigidFactors) -> Solve:
        """Return the solver with the transposed diagonal blocks of the harmonics."""

        def solve(right: FloatArray) -> FloatArray:
            rows = self._by_row(right).copy()
            for h, factors in enumerate(kept.factors):
                if h == 0:
                    rows[0] = factors.solve_transposed(rows[0])
                    continue
                # the transpose of the real form of A is the real form of Aᴴ
                solved = factors.solve_transposed(rows[2 * h - 1] + 1j * rows[2 * h])
                rows[2 * h - 1], rows[2 * h] = solved.real, solved.imag
            return rows.reshape(-1)

        return solve

    def _sweep(self, kept: RigidFactors, right: FloatArray) -> FloatArray:
        """Solve harmonic by harmonic, from the static one up, with the contact coupling to those already solved."""
        laws, soft = self.laws, self.soft
        rows = self._by_row(right).copy()
        predicted = np.zeros((laws.column.size, len(rows)))
        gap = np.zeros((len(soft.blocks), 3, len(rows)))
        before = first = 0
        for h in range(laws.order + 1):
            last = 2 * h + 1
            soft.subtract_below((before, first, last), gap, rows)
            below = predicted[:, :first]
            force = _each_product(laws.own[:, first:last, :first], below)
            force[laws.tangent] += _each_product(laws.by_normal[:, first:last, :first], below[laws.normal])
            rows[first:last, laws.column] -= laws.factor * force.T
            right_side = rows[0] if h == 0 else rows[first] - 1j * rows[first + 1]
            x = kept.solve(h, right_side)
            found = self._penalty(h) * x[laws.column] - kept.rows[h] @ x / laws.factor
            if h == 0:
                rows[0], predicted[:, 0] = x.real, found.real
            else:
                rows[first], rows[first + 1] = x.real, -x.imag
                predicted[:, first], predicted[:, first + 1] = found.real, -found.imag
            before, first = first, last
        return rows.reshape(-1)

    def _penalty(self, harmonic: int) -> ComplexArray:
        """Return ``ε`` of each coordinate at a gap in a harmonic, times ih for a penalty on the velocity."""
        rate: ComplexArray = np.where(self.laws.slides, 1j * harmonic, 1.0)
        return self.laws.penalty * rate

    def _by_row(self, v: FloatArray) -> FloatArray:
        return np.ascontiguousarray(v.reshape(2 * self.laws.order + 1, -1))


@dataclass(frozen=True, eq=False)
class RigidLinearisation:
    """Scaled residual and derivatives at one state, and the time of the contact evaluation; see `Linearisation`."""

    residual: FloatArray  # (size,)
    jac: FloatArray | RigidJacobian  # (size, size)
    jac_p: FloatArray  # (size,), by ω
    seconds_contact: float
    events: None = None

    def dense_jac(self) -> FloatArray:
        """Return the Jacobian as an array."""
        return self.jac if isinstance(self.jac, np.ndarray) else self.jac.dense()


def _each_product(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return (n, k) products of matrices (n, k, m) with vectors (n, m); matmul would call BLAS for each."""
    return np.asarray(np.einsum("gkm,gm->gk", matrices, vectors))


def derivative(order: int) -> FloatArray:
    """Return the (2 order + 1, 2 order + 1) matrix that differentiates real Fourier coefficients by τ = ωt."""
    out = np.zeros((2 * order + 1, 2 * order + 1))
    h = np.arange(1, order + 1)
    out[2 * h - 1, 2 * h] = h
    out[2 * h, 2 * h - 1] = -h
    return out
