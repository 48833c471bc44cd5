"""Rigid contacts in harmonic balance: the dynamic Lagrangian frequency-time method (Nacivet et al. 2003).

The force of a rigid contact along a gap follows from equilibrium, ``Λ = F - Z q``. Plus a penalty ``ε`` on the
forbidden motion, sliding or penetration, it is a predicted force, which Coulomb's and Signorini's laws correct in the
time domain. At a solution the correction returns Λ, whatever ε is: ε is a penalty of the method, not a contact
stiffness.

Products of the Jacobian: each rigid gap has a predicted force ``p = -r/f + ε D g`` with the residual r without rigid
contacts, and the contact law returns its part ``E p``. With S the Jacobian without rigid contacts, R its rows at the gaps
and f the ratio of gap to coordinate, ``J = S + Rᵀ f E (ε D f R - R S / f)``. This adds full rows, yet a product with J
costs no more than one with S.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from time import perf_counter

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.compiled import CompiledContacts, Evaluator, compile_contacts
from stickslip.contact.interface import Interface, SparseRows, sparse_rows
from stickslip.contact.intervals import prefix_sums
from stickslip.contact.law import TN, TT, UNCOUPLED_TANGENTS, Rigid
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.rigid_coulomb import RigidPeriod, project
from stickslip.contact.product import harmonic_means
from stickslip.errors import input_error
from stickslip.harmonic.aft import ContactPeriod, contact_forces
from stickslip.harmonic.balance import HarmonicBalance, check_retained, harmonic_balance
from stickslip.harmonic.costs import CALL, linear_costs
from stickslip.harmonic.factors import AnyFactors, factorise
from stickslip.harmonic.harmonic_set import Harmonics, harmonics_of
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.matrix_products import MAX_SMALL_BLOCK
from stickslip.harmonic.rigid_contacts import NORMAL, STIFF, RigidContacts, rigid_contacts
from stickslip.harmonic.structured import StructuredJacobian, Transposed
from stickslip.operators import Costs

Solve = Callable[[FloatArray], FloatArray]
Product = Callable[[FloatArray, FloatArray], FloatArray]
LOSS = 1e-13  # relative to the largest stiffness, negligible
MIN_MEAN_HARMONICS = 5  # harmonics in the mean at least: with only one, a resonance would dominate it
SAMPLES_OF_OTHERS = 8  # per harmonic, at least, for contacts with stiffness


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


@dataclass(frozen=True, eq=False)
class Penalty:
    """The penalty ε of each coordinate (n,), N/m, and its derivative by ω."""

    value: FloatArray
    slope: FloatArray


@lru_cache(maxsize=4)
def dynamic_penalty(linear: DynamicStiffness, omega: float, order: int) -> Penalty:
    """Return the geometric mean over the harmonics of ``1 / (h |H(hω)|)``.

    H is the compliance seen by a force along a coordinate. The velocity by τ = ωt has h times the amplitude of the
    displacement, so that with this penalty sliding predicts the force with which the structure would respond. The
    penalty does not depend on the choice of coordinates, and changes smoothly with ω. The geometric mean of h is
    replaced by its limit (order + 1) / e, because logarithms of the order would spoil an extrapolation in the order.

    Parameters
    ----------
    linear
        Condensed structure.
    omega
        Frequency, rad/s.
    order
        Highest harmonic of the problem.
    """
    highest = max(order, MIN_MEAN_HARMONICS)
    part = linear.condensed(omega, highest)
    h = np.arange(1, highest + 1)
    stiffness = part.stiffness[h]
    largest = float(np.max(np.abs(np.diagonal(stiffness, axis1=1, axis2=2))))
    # without damping a harmonic may hit a resonance exactly, and there is no inverse
    inverse = np.linalg.inv(stiffness + 1j * LOSS * largest * np.eye(linear.n))
    compliance = np.diagonal(inverse, axis1=1, axis2=2)
    slope = -np.sum((inverse @ part.derivative[h]) * inverse.swapaxes(1, 2), axis=2)
    value = (highest + 1) / math.e * np.exp(-np.mean(np.log(h[:, None] ** 2 * np.abs(compliance)), axis=0))
    return Penalty(value, -value * np.mean((slope / compliance).real, axis=0))


@dataclass(frozen=True, eq=False)
class DynamicLagrangian:
    """The periodic problem with rigid contacts; build it with `dynamic_lagrangian`.

    A `HarmonicBalance` contains the linear side and the contacts with stiffness; its scales and solvers are used.
    """

    balance: HarmonicBalance
    interface: Interface  # all contacts, on the retained coordinates
    rigid: RigidContacts
    samples: int
    penalty: float | None

    @property
    def harmonics(self) -> Harmonics:
        """Kept harmonics: all up to the highest."""
        return self.balance.harmonics

    @property
    def compiled(self) -> CompiledContacts:
        """The contacts with stiffness."""
        return self.balance.compiled

    @cached_property
    def rows(self) -> SparseRows:
        """Gap operator of all contacts by contact."""
        return sparse_rows(self.interface.gap_operator)

    @cached_property
    def springs(self) -> Interface:
        """The interface with all contacts stuck, rigid ones replaced by stiff springs."""
        stiffness = np.abs(np.diagonal(self.linear.nn[0]))[self.interface.coordinates()]
        return self.interface.sprung(STIFF * float(stiffness.max()))

    @property
    def size(self) -> int:
        """Number of real unknowns."""
        return self.balance.size

    @property
    def order(self) -> int:
        """Highest harmonic."""
        return self.balance.order

    @property
    def linear(self) -> DynamicStiffness:
        """The condensed structure and its load."""
        return self.balance.linear

    @property
    def displacement_scale(self) -> float:
        """Displacement of a scaled unknown of one, m."""
        return self.balance.displacement_scale

    @property
    def force_scale(self) -> float:
        """Force of a scaled residual of one, N."""
        return self.balance.force_scale

    def coefficients(self, x: FloatArray) -> ComplexArray:
        """Return the (order+1, n) complex coefficients in metres of scaled unknowns `x`."""
        return self.balance.coefficients(x)

    def unknowns(self, coefficients: ComplexArray) -> FloatArray:
        """Return the scaled unknowns of complex `coefficients`, padded or cut to `order`."""
        return self.balance.unknowns(coefficients)

    def linear_load(self, omega: float) -> FloatArray:
        """Return the (m, n) real coefficients of the condensed load at `omega` (rad/s)."""
        return self.balance.linear_load(omega)

    def linear_block(self, omega: float, harmonic: int) -> Matrix:
        """Return the (n, n) condensed dynamic stiffness of a harmonic at `omega` (rad/s), as a copy."""
        return self.balance.linear_block(omega, harmonic)

    def with_harmonics(self, harmonics: Harmonics) -> "DynamicLagrangian":
        """Return the same problem with all harmonics up to the highest of `harmonics`."""
        return self.with_order(harmonics[-1])

    def with_order(self, order: int) -> "DynamicLagrangian":
        """Return the same problem with harmonics 0..`order`."""
        samples = _checked_samples(self.samples, order)
        inner = replace(
            self.balance,
            harmonics=harmonics_of(order),
            samples=_samples_of_others(samples, order),
            rows=replace(self.balance.rows),
        )
        own = rigid_contacts(self.interface, self.rigid.index, inner)
        return replace(self, balance=inner, rigid=own, samples=samples)

    def linearise(self, x: FloatArray, omega: float) -> RigidLinearisation:
        """Return residual, Jacobian and ω-derivative at scaled unknowns `x` (size,) and `omega` (rad/s)."""
        at = self.balance.linearise(x, omega)
        start = perf_counter()
        rigid = self.rigid
        found = self._corrected(x, omega, at.residual)
        laws = _gap_laws(rigid, found)
        residual, jac_p = (v.reshape(2 * self.order + 1, -1).copy() for v in (at.residual, at.jac_p))
        own = found.coefficients[:, rigid.contact, rigid.direction]
        residual[:, rigid.column] += rigid.factor * own
        # derivatives of the predictions by ω
        predicted = (found.penalty.slope / found.penalty.value * found.forbidden).T
        predicted -= (jac_p[:, rigid.column] / rigid.factor).T
        jac_p[:, rigid.column] += laws.forces(predicted[:, :, None])[:, :, 0].T
        jac: FloatArray | RigidJacobian
        if isinstance(at.jac, np.ndarray):
            jac = at.jac
            laws.correct(jac)
        else:
            jac = RigidJacobian(at.jac, laws)
        seconds = at.seconds_contact + perf_counter() - start
        return RigidLinearisation(residual.reshape(-1), jac, jac_p.reshape(-1), seconds)

    def contacts(self, x: FloatArray, omega: float) -> ContactPeriod:
        """Return gaps, forces and states of all contacts over one period, at the scaled unknowns `x` and `omega` (rad/s).

        The gaps do not include initial gaps. For rigid contacts the blocks are derivatives by predicted forces.
        """
        balance, rigid = self.balance, self.rigid
        found = self._corrected(x, omega, balance.linearise(x, omega).residual)
        q = x.reshape(2 * self.order + 1, -1) * balance.displacement_scale
        n = self.interface.n_contacts
        others = np.setdiff1d(np.arange(n), rigid.index)
        soft = balance.contacts(x, omega)
        shown = contact_forces(balance.rows.gaps(q), balance.compiled, self.samples, omega)
        gap = _in_time(q @ self.interface.gap_operator.T, self.samples).reshape(n, 3, self.samples)
        coefficients = np.empty((q.shape[0], n, 3))
        coefficients[:, others] = soft.coefficients.reshape(q.shape[0], others.size, 3)
        coefficients[:, rigid.index] = balance.force_scale * found.coefficients
        force, state = np.empty_like(gap), np.empty((n, 2, self.samples), dtype=np.int64)
        force[others], state[others] = shown.force, shown.state
        force[rigid.index] = balance.force_scale * found.period.force
        state[rigid.index] = found.period.state
        blocks = np.zeros((n, soft.blocks.shape[1], *soft.blocks.shape[2:]))
        blocks[others] = soft.blocks
        blocks[rigid.index, :UNCOUPLED_TANGENTS] = found.period.blocks
        flat = coefficients.reshape(q.shape[0], -1)
        return ContactPeriod(flat, blocks, None, gap, force, state, soft.unsettled)

    def penalties(self, omega: float) -> Penalty:
        """Return ε of each gap at `omega` (rad/s), scaled, and its derivative by ω."""
        gaps = self.rigid.column.size
        stiffness = self.force_scale / self.displacement_scale
        if self.penalty is not None:
            return Penalty(np.full(gaps, self.penalty / stiffness), np.zeros(gaps))
        found = dynamic_penalty(self.linear, omega, self.order)
        share = 1.0 / (stiffness * self.rigid.factor**2)
        column = self.rigid.column
        return Penalty(share * found.value[column], share * found.slope[column])

    def _corrected(self, x: FloatArray, omega: float, residual: FloatArray) -> "_Corrected":
        """Predict the forces of the rigid contacts from the `residual` without them, and correct them."""
        rigid, m = self.rigid, 2 * self.order + 1
        penalty = self.penalties(omega)
        n = rigid.index.size
        equilibrium = -residual.reshape(m, -1)[:, rigid.column] / rigid.factor
        elastic = penalty.value * rigid.factor * x.reshape(m, -1)[:, rigid.column]
        elastic[0] += penalty.value * rigid.offset
        sliding = np.where(rigid.direction == NORMAL, elastic, derivative(self.order) @ elastic)
        predicted = np.zeros((m, n, 3))
        predicted[:, rigid.contact, rigid.direction] = equilibrium + sliding
        in_time = _in_time(predicted.reshape(m, -1), self.samples).reshape(n, 3, self.samples)
        period = project(in_time, rigid.mu, rigid.constant, self.order)
        stuck = (rigid.direction != NORMAL) & period.stuck[rigid.contact, rigid.direction % 2]
        if np.any(stuck):
            held = predicted.copy()
            held[:, rigid.contact[stuck], rigid.direction[stuck]] = (equilibrium + elastic)[:, stuck]
            _hold(period, held, stuck, rigid)
        coefficients = _in_harmonics(period.force.reshape(3 * n, -1), self.order)
        forbidden = np.where(stuck, elastic, sliding)
        return _Corrected(period, coefficients.reshape(m, n, 3), stuck, penalty, forbidden)


@dataclass(frozen=True, eq=False)
class _Corrected:
    period: RigidPeriod
    coefficients: FloatArray  # (m, n_rigid, 3)
    stuck: BoolArray  # (n_gaps,) tangents that stick throughout the period
    penalty: Penalty
    forbidden: FloatArray  # (m, n_gaps) penalty times the forbidden motion


def _in_time(coefficients: FloatArray, samples: int) -> FloatArray:
    """Return (n, samples) values of real Fourier coefficients (m, n)."""
    basis = _basis((coefficients.shape[0] - 1) // 2, samples)
    return np.ascontiguousarray((basis @ coefficients).T)


def _in_harmonics(values: FloatArray, order: int) -> FloatArray:
    """Return the real Fourier coefficients (m, n) of `values` (n, samples)."""
    coefficients = (values @ _basis(order, values.shape[1])).T * (2.0 / values.shape[1])
    coefficients[0] *= 0.5
    return np.asarray(coefficients)


@lru_cache(maxsize=32)
def _basis(order: int, samples: int) -> FloatArray:
    return prefix_sums(order, samples)[0]


def _hold(period: RigidPeriod, held: FloatArray, stuck: BoolArray, rigid: RigidContacts) -> None:
    """Fill in, for tangents that stick throughout the period, the force of a slider that starts at zero displacement.

    If a contact never slides, sliding velocities do not determine its position. A spring of stiffness ε on the
    predicted displacement does: it is unstretched at zero, or dragged as far as the contact slips in a first period.
    """
    m = held.shape[0]
    which = np.unique(rigid.contact[stuck])
    laws = tuple(_slider(rigid.mu[c], rigid.constant[c]) for c in which)
    march = contact_forces(held[:, which].reshape(m, -1), compile_contacts(laws), period.force.shape[2])
    place = np.searchsorted(which, rigid.contact[stuck])
    for c, d, at in zip(rigid.contact[stuck], rigid.direction[stuck], place, strict=True):
        period.force[c, d] = march.force[at, d]
        period.state[c, d] = march.state[at, d]
        period.blocks[c, TT + d] = march.blocks[at, TT + d]
        period.blocks[c, TN + d] = march.blocks[at, TN + d]


def _slider(mu: float, constant: float) -> ElasticCoulomb:
    """Return an elastic Coulomb contact with unit springs, for gaps given as forces."""
    if np.isnan(constant):
        return ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=mu)
    return ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=0.0, mu=mu, preload=constant)


def _gap_laws(rigid: RigidContacts, found: _Corrected) -> GapLaws:
    """Return the derivatives of the corrected forces by gap.

    The penalty acts on the displacement of normal gaps and of tangents that stick throughout.
    """
    blocks, along = found.period.blocks, rigid.direction == NORMAL
    pairs = (rigid.contact[:, None] == rigid.contact) & ~along[:, None] & along
    tangent, normal = np.nonzero(pairs)
    return GapLaws(
        rigid.column,
        rigid.factor,
        blocks[rigid.contact, TT + rigid.direction],
        tangent,
        normal,
        blocks[rigid.contact[tangent], TN + rigid.direction[tangent]],
        found.penalty.value * rigid.factor,
        ~(along | found.stuck),
    )


def dynamic_lagrangian(
    linear: DynamicStiffness,
    interface: Interface,
    order: int,
    samples: int,
    penalty: float | None = None,
    evaluator: Evaluator = "intervals",
) -> DynamicLagrangian:
    """Set up the periodic problem of an interface with rigid contacts (`RigidCoulomb`), all or some.

    Parameters
    ----------
    linear
        Condensed structure and load.
    interface
        Contacts on the dofs of the whole structure; each gap of a rigid contact must be a factor times a retained
        coordinate.
    order
        Highest harmonic.
    samples
        Samples per period. With ``2 order + 1``, as many as there are coefficients, the laws hold exactly at the
        samples, and the solution does not depend on the penalty. With eight or more per harmonic, the solution is more
        accurate, and depends on the penalty less than on missing harmonics.
    penalty
        Penalty ε of the method (N/m); None: the dynamic stiffness of the structure at each gap, see `dynamic_penalty`.
    evaluator
        Evaluator of the contacts with stiffness; see `harmonic_balance`.

    Raises
    ------
    InputError
        If no contact is rigid, a gap of a rigid contact is not a coordinate, or there are fewer samples than
        coefficients.
    """
    rigid = np.array([i for i, law in enumerate(interface.laws) if isinstance(law, Rigid)], dtype=np.int64)
    if not rigid.size:
        raise input_error("dynamic_lagrangian", "no contact is rigid", "Use harmonic_balance.")
    if penalty is not None and not (np.isfinite(penalty) and penalty > 0.0):
        raise input_error(
            "dynamic_lagrangian: penalty", f"must be positive and finite, got {penalty}", "Give it in N/m, or None."
        )
    check_retained("dynamic_lagrangian", linear, interface)
    _checked_samples(samples, order)
    balance = harmonic_balance(linear, _without(interface, rigid), order, _samples_of_others(samples, order), evaluator)
    local = interface.restricted(linear.retained)
    own = rigid_contacts(local, rigid, balance)
    return DynamicLagrangian(balance, local, own, samples, penalty)


def _without(interface: Interface, rigid: IntArray) -> Interface:
    """Return the contacts that have a stiffness."""
    keep = np.setdiff1d(np.arange(interface.n_contacts), rigid)
    rows = (3 * keep[:, None] + np.arange(3)).ravel()
    return Interface(
        tuple(interface.names[i] for i in keep),
        tuple(interface.laws[i] for i in keep),
        interface.gap_operator[rows],
        None if interface.weights is None else interface.weights[keep],
    )


def _checked_samples(samples: int, order: int) -> int:
    if samples < 2 * order + 1:
        raise input_error(
            "samples",
            f"{samples} samples a period for {order} harmonics",
            f"Give at least {2 * order + 1}, as many as there are coefficients.",
        )
    return samples


def _samples_of_others(samples: int, order: int) -> int:
    return max(samples, SAMPLES_OF_OTHERS * order, 16)
