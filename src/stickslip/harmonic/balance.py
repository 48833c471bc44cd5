"""Harmonic balance: residual and Jacobian of ``r(q, ω) = Z q + B λ(Bᵀ q) - F`` in scaled unknowns."""

from dataclasses import dataclass, replace
from functools import lru_cache
from time import perf_counter
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.compiled import CompiledContacts, Evaluator
from stickslip.contact.interface import Interface, SparseRows, add_contact_jacobian, sparse_rows
from stickslip.errors import input_error
from stickslip.harmonic.aft import ContactPeriod, contact_forces
from stickslip.harmonic.condensed_product import CondensedProduct, at_frequency
from stickslip.harmonic.dynamic_stiffness import CondensedStiffness
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.fourier import padded, to_complex, to_real
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.structured import StructuredJacobian, real_matrix

JacobianForm = Literal["auto", "dense", "structured"]
CROSSOVER = 700  # unknowns above which products and a Krylov method cost less than an array and its LU factors


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Residual and derivatives at one state, all scaled, and the time the contacts took."""

    residual: FloatArray  # (size,)
    jac: FloatArray | StructuredJacobian  # (size, size)
    jac_p: FloatArray  # (size,), by the parameter ω
    seconds_contact: float

    def dense_jac(self) -> FloatArray:
        """Return the Jacobian as an array."""
        return self.jac if isinstance(self.jac, np.ndarray) else self.jac.dense()


@dataclass(frozen=True, eq=False)
class _LinearPart:
    operators: ComplexArray  # (2, H+1, n, n) dynamic stiffness and its ω-derivative
    loads: ComplexArray  # (2, H+1, n, 1) load and its ω-derivative
    matrix: FloatArray  # (n (2H+1), n (2H+1)) real form of the block-diagonal dynamic stiffness


@lru_cache(maxsize=4)
def _linear_part(linear: DynamicStiffness, order: int, omega: float) -> _LinearPart:
    """Assemble the linear side at one frequency; kept, because a Newton iteration at fixed frequency asks for it at every step."""
    part = linear.condensed(omega, order)
    return _LinearPart(
        np.stack([part.stiffness, part.derivative]),
        np.stack([part.load, part.load_derivative])[..., None],
        real_matrix(part.stiffness),
    )


@lru_cache(maxsize=2)
def _product(linear: CondensedStiffness, order: int, omega: float) -> CondensedProduct:
    return at_frequency(linear, omega, order)


@dataclass(frozen=True, eq=False)
class HarmonicBalance:
    """The periodic problem of one structure, one interface and one load with harmonics 0..`order`.

    Unknowns are ``q / displacement_scale``, equations are divided by `force_scale`, so that conditioning and steps do not depend on
    units. Build it with `harmonic_balance`.
    """

    linear: DynamicStiffness
    interface: Interface  # on the retained coordinates
    compiled: CompiledContacts
    rows: SparseRows
    order: int
    samples: int
    displacement_scale: float
    force_scale: float
    jacobian: JacobianForm = "auto"

    @property
    def size(self) -> int:
        """Number of real unknowns."""
        return self.linear.n * (2 * self.order + 1)

    @property
    def structured(self) -> bool:
        """Whether the Jacobian is given by its products; without harmonics, and for a tuned wheel, it is an array."""
        if not isinstance(self.linear, CondensedStiffness):
            return False
        large = self.size > CROSSOVER if self.jacobian == "auto" else self.jacobian == "structured"
        return large and self.order > 0

    def coefficients(self, x: FloatArray) -> ComplexArray:
        """Return the (order+1, n) complex coefficients in metres of scaled unknowns `x`."""
        return to_complex(x.reshape(2 * self.order + 1, self.linear.n)) * self.displacement_scale

    def unknowns(self, coefficients: ComplexArray) -> FloatArray:
        """Return the scaled unknowns of complex `coefficients`, padded or cut to `order`."""
        return to_real(padded(coefficients, self.order)).reshape(-1) / self.displacement_scale

    def contacts(self, x: FloatArray, omega: float) -> ContactPeriod:
        """Return gaps, forces and states of all contacts over one period, at the scaled unknowns `x` and `omega` (rad/s)."""
        q = x.reshape(2 * self.order + 1, self.linear.n) * self.displacement_scale
        return contact_forces(self.rows.gaps(q), self.compiled, self.samples, omega)

    def _forces(self, x: FloatArray, omega: float) -> ContactPeriod:
        """Return what the equations ask of the contacts: coefficients and derivatives."""
        q = x.reshape(2 * self.order + 1, self.linear.n) * self.displacement_scale
        gaps = self.rows.gaps(q)
        return contact_forces(gaps, self.compiled, self.samples, omega, history=False)

    def linearise(self, x: FloatArray, omega: float) -> Linearisation:
        """Return residual, Jacobian and ω-derivative at scaled unknowns `x` (size,) and `omega` (rad/s)."""
        start = perf_counter()
        period = self._forces(x, omega)
        seconds = perf_counter() - start
        jac: FloatArray | StructuredJacobian
        if isinstance(self.linear, CondensedStiffness) and (
            self.size > CROSSOVER or self.structured
        ):
            linear, slope, jac = self._by_products(self.linear, x, omega, period)
        else:
            linear, slope, jac = self._by_matrices(x, omega, period)
        self.rows.add_forces(period.coefficients, linear)
        if period.by_omega is not None:
            self.rows.add_forces(period.by_omega, slope)
        return Linearisation(
            linear.reshape(-1) / self.force_scale,
            jac,
            slope.reshape(-1) / self.force_scale,
            seconds,
        )

    def _by_matrices(
        self, x: FloatArray, omega: float, period: ContactPeriod
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return linear forces and their slope by ω (2H+1, n), and the Jacobian as an array."""
        factor = self.displacement_scale / self.force_scale
        part = _linear_part(self.linear, self.order, omega)
        jac = factor * part.matrix
        add_contact_jacobian(
            period.blocks, self.rows.columns, self.rows.values, self.linear.n, factor, jac
        )
        force, slope = part.operators @ self.coefficients(x)[:, :, None] - part.loads
        return to_real(force[..., 0]), to_real(slope[..., 0]), jac

    def _by_products(
        self, own: CondensedStiffness, x: FloatArray, omega: float, period: ContactPeriod
    ) -> tuple[FloatArray, FloatArray, FloatArray | StructuredJacobian]:
        """Return the same without condensed matrices; the Jacobian by its products too if that was chosen."""
        part = _product(own, self.order, omega)
        q = x.reshape(2 * self.order + 1, self.linear.n) * self.displacement_scale
        linear, slope = part.product_and_slope(q)
        factor = self.displacement_scale / self.force_scale
        jac = StructuredJacobian(part, period.blocks, self.rows, factor)
        return linear - part.load, slope - part.load_slope, jac if self.structured else jac.dense()

    def linear_load(self, omega: float) -> FloatArray:
        """Return the (2H+1, n) real coefficients of the condensed load at `omega` (rad/s)."""
        if isinstance(self.linear, CondensedStiffness):
            return _product(self.linear, self.order, omega).load
        return to_real(self.linear.condensed(omega, self.order).load)

    def linear_block(self, omega: float, harmonic: int) -> ComplexArray:
        """Return the (n, n) condensed dynamic stiffness of a harmonic at `omega` (rad/s), to be changed at will."""
        if isinstance(self.linear, CondensedStiffness):
            return _product(self.linear, self.order, omega).block(harmonic)
        stiffness = self.linear.condensed(omega, self.order).stiffness
        return np.array(stiffness[harmonic], order="F")

    def with_order(self, order: int) -> "HarmonicBalance":
        """Return the same problem with harmonics 0..`order`."""
        samples = _checked_samples(self.samples, order)
        # rows of its own: they tell a solver which Jacobians can share a preconditioner
        return replace(self, order=order, samples=samples, rows=replace(self.rows))


def harmonic_balance(
    linear: DynamicStiffness,
    interface: Interface,
    order: int,
    samples: int,
    evaluator: Evaluator = "intervals",
    jacobian: JacobianForm = "auto",
) -> HarmonicBalance:
    """Set up the periodic problem.

    Parameters
    ----------
    linear
        Condensed structure and load.
    interface
        Contacts on the dofs of the whole structure.
    order
        Highest harmonic; the static term is always kept.
    samples
        Samples per period of the contact forces.
    evaluator
        How piecewise-linear laws are evaluated: by ``intervals`` of the samples, at exact ``events``, or as all others by a ``march``.
    jacobian
        Its form: an array (``dense``), products (``structured``, for a Krylov method), or what costs less at this size (``auto``).

    Raises
    ------
    InputError
        If the contacts touch dofs that are not retained, the load excites a harmonic above `order`, there are fewer than four samples a
        harmonic, or no such evaluator or form.
    """
    _check_order(linear.load, order)
    if jacobian not in get_args(JacobianForm):
        raise input_error(
            "harmonic_balance: jacobian",
            f"{jacobian!r} is none of {', '.join(get_args(JacobianForm))}",
            "'auto' takes what costs less.",
        )
    missing = np.setdiff1d(interface.coordinates(), linear.retained)
    if missing.size:
        raise input_error(
            "harmonic_balance",
            f"contact dofs {missing[:5].tolist()} are not retained",
            "Retain all contact dofs.",
        )
    local = interface.restricted(linear.retained)
    # a preload is no scale for the load: beside a large one the load's own equations would be solved coarsely
    force_scale = linear.load.scale or float(np.max(np.abs(local.resting_force()), initial=0.0))
    if force_scale <= 0.0:
        raise input_error("HarmonicLoad", "is zero", "Give a static or a harmonic force.")
    stiffness = local.stuck_stiffness()
    return HarmonicBalance(
        linear,
        local,
        local.compiled(evaluator),
        sparse_rows(local.gap_operator),
        order,
        _checked_samples(samples, order),
        force_scale / _typical_stiffness(stiffness, linear),
        force_scale,
        jacobian,
    )


def _typical_stiffness(contact: FloatArray, linear: DynamicStiffness) -> float:
    """Geometric mean of the contact stiffnesses; of the structure's diagonal where there is no contact."""
    values = contact[contact > 0] if np.any(contact > 0) else np.abs(np.diagonal(linear.nn[0]))
    values = values[values > 0]
    return float(np.exp(np.mean(np.log(values)))) if values.size else 1.0


def _check_order(load: HarmonicLoad, order: int) -> None:
    if order != int(order) or order < 0:
        raise input_error("order", f"must be an integer from 0 on, got {order!r}", "Give a count.")
    top = max((h for h, f in load.harmonics.items() if np.any(f)), default=0)
    if top > order:
        raise input_error(
            "HarmonicLoad",
            f"excites harmonic {top}, but only {order} are kept",
            f"Keep {top} or more.",
        )


def _checked_samples(samples: int, order: int) -> int:
    if samples < 4 * order + 1:
        raise input_error(
            "samples",
            f"{samples} samples a period for {order} harmonics",
            f"Give at least {max(8 * order, 16)} (eight a harmonic).",
        )
    return samples
