"""Harmonic balance: residual and Jacobian of ``r(q, ω) = Z q + B λ(Bᵀ q) - F`` in scaled unknowns."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from time import perf_counter
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.contact.compiled import CompiledContacts, Evaluator
from stickslip.contact.event_integrals import Events
from stickslip.contact.interface import Interface, SparseRows, sparse_rows
from stickslip.errors import check_choice, input_error
from stickslip.harmonic.aft import ContactPeriod, contact_forces, forces_between
from stickslip.harmonic.costs import linear_costs, products_pay
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import (
    Harmonics,
    complex_rows,
    harmonics_of,
    is_full,
    real_rows,
    rows_of,
    to_complex,
    to_real,
)
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.matrix_products import known_by_vectors, linear_force, mass_damping_slope, matrices, products
from stickslip.harmonic.sparse_stiffness import SparseStiffness
from stickslip.harmonic.structured import StructuredJacobian, real_form
from stickslip.operators import Costs

REDUCED = 300  # unknowns above which eliminating stuck contacts can cost less than solving the whole array

JacobianForm = Literal["auto", "dense", "structured"]


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Scaled residual and derivatives at one state, and the time of the contact evaluation.

    Derivatives may be computed at first use.
    """

    residual: FloatArray  # (size,)
    by_x: FloatArray | StructuredJacobian | Callable[[], FloatArray]
    by_omega: FloatArray | Callable[[], FloatArray]
    seconds_contact: float
    events: Events | None = None  # of the contacts, where all of them are known

    @cached_property
    def jac(self) -> FloatArray | StructuredJacobian:
        """(size, size) derivative of the residual by the unknowns."""
        return self.by_x() if callable(self.by_x) else self.by_x

    @cached_property
    def jac_p(self) -> FloatArray:
        """(size,) derivative of the residual by the parameter ω."""
        return self.by_omega() if callable(self.by_omega) else self.by_omega

    def dense_jac(self) -> FloatArray:
        """Return the Jacobian as an array."""
        return self.jac if isinstance(self.jac, np.ndarray) else self.jac.dense()


@dataclass(frozen=True, eq=False)
class HarmonicBalance:
    """The periodic problem of one structure, one interface and one load; build it with `harmonic_balance`.

    The static term is always kept: ``m = 2 len(harmonics) - 1`` real coefficients per coordinate. Unknowns are
    ``q / displacement_scale`` and equations are divided by `force_scale`, so that conditioning and steps do not depend
    on units.
    """

    linear: DynamicStiffness
    interface: Interface  # on the retained coordinates
    compiled: CompiledContacts
    rows: SparseRows
    harmonics: Harmonics
    samples: int
    displacement_scale: float
    force_scale: float
    jacobian: JacobianForm = "auto"

    @property
    def order(self) -> int:
        """Highest harmonic."""
        return self.harmonics[-1]

    @property
    def springs(self) -> Interface:
        """The interface, which gives the stiffness where no contact slips or opens."""
        return self.interface

    @cached_property
    def n_rows(self) -> int:
        """Number of real coefficients per coordinate."""
        return 2 * len(self.harmonics) - 1

    @cached_property
    def size(self) -> int:
        """Number of real unknowns."""
        return self.linear.n * self.n_rows

    @cached_property
    def structured(self) -> bool:
        """Whether the Jacobian is given by products with vectors.

        With the static term alone it is an array, unless nothing is condensed.
        """
        large = self.large if self.jacobian == "auto" else self.jacobian == "structured"
        return large and (self.order > 0 or isinstance(self.linear, SparseStiffness))

    @cached_property
    def _costs(self) -> Costs:
        contacts = self.compiled.n_contacts * self.compiled.pairs
        sparse = self.linear.entries if isinstance(self.linear, SparseStiffness) else 0
        return linear_costs(self.linear.n, len(self.harmonics), contacts * self.n_rows**2, sparse)

    @cached_property
    def reduced(self) -> bool:
        """Whether a Jacobian that is solved as an array is passed in parts.

        From these the solver can eliminate the unknowns of stuck contacts.
        """
        return self.jacobian == "auto" and self.order > 0 and self.size >= REDUCED

    @cached_property
    def large(self) -> bool:
        """Whether products cost less than an array, for ``jacobian="auto"``."""
        return self.jacobian != "dense" and products_pay(self._costs)

    def coefficients(self, x: FloatArray) -> ComplexArray:
        """Return the (order+1, n) complex coefficients, m, of scaled unknowns `x`; zeros for missing harmonics."""
        rows = x.reshape(self.n_rows, self.linear.n)
        return complex_rows(rows, self.harmonics) * self.displacement_scale

    def unknowns(self, coefficients: ComplexArray) -> FloatArray:
        """Return the scaled unknowns of complex `coefficients` (H+1, n), padded or cut to the kept harmonics."""
        return real_rows(coefficients, self.harmonics).reshape(-1) / self.displacement_scale

    def contacts(self, x: FloatArray, omega: float) -> ContactPeriod:
        """Return gaps, forces and states of all contacts over one period, at the scaled unknowns `x` and `omega` (rad/s)."""
        return contact_forces(self._gaps(x), self.compiled, self.samples, omega)

    def _gaps(self, x: FloatArray) -> FloatArray:
        """Return the (2 order + 1, 3 n_contacts) coefficients of the gaps, m; zeros at harmonics left out."""
        kept = self.rows.gaps(x.reshape(self.n_rows, self.linear.n) * self.displacement_scale)
        if is_full(self.harmonics):
            return kept
        gaps = np.zeros((2 * self.order + 1, kept.shape[1]))
        gaps[rows_of(self.harmonics)] = kept
        return gaps

    def forces(self, x: FloatArray, omega: float, events: Events | None = None) -> ContactPeriod:
        """Return the contact forces for the equations: coefficients and derivatives in the kept harmonics.

        If the `events` of this motion are known from an evaluation with fewer harmonics (`Linearisation.events`), forces are
        integrated between them, without another evaluation of the contacts.
        """
        if events is None:
            gaps = self._gaps(x)
            period = contact_forces(gaps, self.compiled, self.samples, omega, history=False)
        else:
            period = forces_between(events, self.compiled, self.order)
        if is_full(self.harmonics):
            return period
        own = rows_of(self.harmonics)
        by_omega = None if period.by_omega is None else period.by_omega[own]
        blocks = period.blocks[:, :, own[:, None], own]
        return replace(period, coefficients=period.coefficients[own], blocks=blocks, by_omega=by_omega)

    def linearise(self, x: FloatArray, omega: float, period: ContactPeriod | None = None) -> Linearisation:
        """Return residual, Jacobian and ω-derivative at scaled unknowns `x` (size,) and `omega` (rad/s).

        Contacts are not evaluated if their `period` at `x` is given, from `forces`.
        """
        start = perf_counter()
        if period is None:
            period = self.forces(x, omega)
        seconds = perf_counter() - start
        by_x: FloatArray | StructuredJacobian | Callable[[], FloatArray]
        by_omega: FloatArray | Callable[[], FloatArray]
        if self.large or self.structured:
            linear, slope, by_x = self._by_products(x, omega, period)
            by_omega = self._with_forces(slope, period.by_omega)
        else:
            linear = self._linear_force(x, omega)
            own = partial(self._array, omega, period.blocks)
            by_x = self._parts(omega, period.blocks) if self.reduced else own
            by_omega = partial(self._slope, x, omega, period.by_omega)
        return Linearisation(
            self._with_forces(linear, period.coefficients),
            by_x,
            by_omega,
            seconds,
            period.events if period.events is not None and period.events.whole else None,
        )

    def _with_forces(self, rows: FloatArray, contacts: FloatArray | None) -> FloatArray:
        """Return the (size,) scaled equations: `rows` (m, n), to which the coefficients of the contact forces are added."""
        if contacts is not None:
            self.rows.add_forces(contacts, rows)
        return rows.reshape(-1) / self.force_scale

    def scaled_forces(self, contacts: FloatArray) -> FloatArray:
        """Return the (size,) contact forces in the scaled equations, from their coefficients (m, 3 n_contacts), N."""
        return self._with_forces(np.zeros((self.n_rows, self.linear.n)), contacts)

    def residual(self, x: FloatArray, omega: float, period: ContactPeriod) -> FloatArray:
        """Return the (size,) scaled residual from contacts with a known `period`.

        If possible, condensed matrices are not formed.
        """
        direct = known_by_vectors(self.linear)
        if direct is None or self.large or self.structured:
            return self.linearise(x, omega, period).residual
        linear = real_rows(linear_force(direct, omega, self.coefficients(x)), self.harmonics)
        self.rows.add_forces(period.coefficients, linear)
        return linear.reshape(-1) / self.force_scale

    def linear_residual(self, x: FloatArray, omega: float) -> FloatArray:
        """Return the (size,) scaled residual without the contact forces."""
        if self.large or self.structured:
            part = products(self.linear, self.harmonics, omega)
            q = x.reshape(self.n_rows, -1) * self.displacement_scale
            return (part.product(q) - part.load).reshape(-1) / self.force_scale
        return self._linear_force(x, omega).reshape(-1) / self.force_scale

    def by_mass_damping(self, x: FloatArray, omega: float, mass: Callable[[int], Matrix]) -> FloatArray:
        """Return the (size,) derivative of the scaled residual by the rate, 1/s, of a mass-proportional damping.

        The `mass` is a function of the harmonic. If products with vectors cannot give the derivative, the motion is
        expanded to all dofs, and its inertia force is condensed like a load.
        """
        direct = known_by_vectors(self.linear)
        if direct is not None:
            known = mass_damping_slope(direct, omega, self.coefficients(x))
            return real_rows(known, self.harmonics).reshape(-1) / self.force_scale
        spread = self.linear.recover_change(omega, self.coefficients(x))
        moving = (h for h in self.harmonics if h > 0)
        force = {h: -1j * h * omega * (mass(h) @ spread[h]) for h in moving}
        load = HarmonicLoad(np.zeros(spread.shape[1]), force)
        condensed = self.linear.with_load(load).products(omega, self.harmonics).load
        return -condensed.reshape(-1) / self.force_scale

    def _linear_force(self, x: FloatArray, omega: float) -> FloatArray:
        """Return the (m, n) coefficients of the equations without the contact forces, N."""
        part, q = matrices(self.linear, self.harmonics, omega), self.displacement_scale * x
        if self.reduced:
            return part.product(q.reshape(self.n_rows, -1)) - part.load
        force = (real_form(part) @ q).reshape(self.n_rows, -1)
        force -= part.load
        return force

    def _array(self, omega: float, blocks: FloatArray) -> FloatArray:
        """Return the (size, size) Jacobian as an array."""
        return self._parts(omega, blocks).dense()

    def by_parts(self, omega: float, blocks: FloatArray) -> StructuredJacobian:
        """Return the Jacobian with derivatives (n_contacts, P, m, m) of the contact forces, N/m, by its products."""
        part = products(self.linear, self.harmonics, omega)
        factor = self.displacement_scale / self.force_scale
        return StructuredJacobian(part, blocks, self.rows, factor)

    def _parts(self, omega: float, blocks: FloatArray) -> StructuredJacobian:
        """Return the Jacobian by its parts, whose matrices are formed."""
        part = matrices(self.linear, self.harmonics, omega)
        return StructuredJacobian(part, blocks, self.rows, self.displacement_scale / self.force_scale)

    def _slope(self, x: FloatArray, omega: float, contacts: FloatArray | None) -> FloatArray:
        """Return the (size,) ω-derivative of the scaled residual, with the derivative `contacts` of the forces."""
        part = matrices(self.linear, self.harmonics, omega).condensed
        q = to_complex(x.reshape(self.n_rows, self.linear.n)) * self.displacement_scale
        slope = (part.derivative @ q[:, :, None])[..., 0] - part.load_derivative
        return self._with_forces(to_real(slope), contacts)

    def _by_products(
        self, x: FloatArray, omega: float, period: ContactPeriod
    ) -> tuple[FloatArray, FloatArray, FloatArray | StructuredJacobian]:
        """Return linear forces, their ω-derivative and the Jacobian without condensed matrices.

        The Jacobian stays in products if `structured`.
        """
        part = products(self.linear, self.harmonics, omega)
        q = x.reshape(self.n_rows, self.linear.n) * self.displacement_scale
        linear, slope = part.product_and_slope(q)
        jac = self.by_parts(omega, period.blocks)
        return linear - part.load, slope - part.load_slope, jac if self.structured else jac.dense()

    def linear_load(self, omega: float) -> FloatArray:
        """Return the (m, n) real coefficients of the condensed load at `omega` (rad/s)."""
        return products(self.linear, self.harmonics, omega).load

    def linear_block(self, omega: float, harmonic: int) -> Matrix:
        """Return the (n, n) condensed dynamic stiffness of a harmonic at `omega` (rad/s), as a copy.

        It is sparse if nothing is condensed.
        """
        return products(self.linear, self.harmonics, omega).block(harmonic)

    def with_order(self, order: int) -> "HarmonicBalance":
        """Return the same problem with harmonics 0..`order`."""
        return self.with_harmonics(harmonics_of(order))

    def with_harmonics(self, harmonics: Harmonics) -> "HarmonicBalance":
        """Return the same problem with the `harmonics` of `harmonics_of`."""
        samples = _checked_samples(self.samples, harmonics[-1])
        # a new `SparseRows` object: solvers share preconditioners between Jacobians with the same one
        return replace(self, harmonics=harmonics, samples=samples, rows=replace(self.rows))


def harmonic_balance(
    linear: DynamicStiffness,
    interface: Interface,
    order: int | Harmonics,
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
        Highest harmonic, or a list of the kept ones; the static term is always kept.
    samples
        Samples per period of the contact forces.
    evaluator
        Evaluator of piecewise-linear laws: ``intervals`` of the samples, exact ``events``, or a ``march``, as for all
        other laws.
    jacobian
        Form of the Jacobian: an array (``dense``), products (``structured``, for a Krylov method), or the cheaper one
        at this size (``auto``).

    Raises
    ------
    InputError
        If contacts act on dofs that are not retained, the load excites a harmonic above `order`, there are fewer than
        four samples per harmonic, or the evaluator or form is unknown.
    """
    harmonics = harmonics_of(order, "order")
    _check_load(linear.load, harmonics)
    hint = "'auto' takes what costs less."
    check_choice("harmonic_balance: jacobian", jacobian, get_args(JacobianForm), hint)
    check_retained("harmonic_balance", linear, interface)
    local = interface.restricted(linear.retained)
    # the load sets the scale, not the preload: beside a large preload, the response to the load would be solved
    # coarsely
    force_scale = linear.load.scale or float(np.max(np.abs(local.resting_force()), initial=0.0))
    if force_scale <= 0.0:
        raise input_error("HarmonicLoad", "is zero", "Give a static or a harmonic force.")
    stiffness = local.stuck_stiffness()
    return HarmonicBalance(
        linear,
        local,
        local.compiled(evaluator),
        sparse_rows(local.gap_operator),
        harmonics,
        _checked_samples(samples, harmonics[-1]),
        force_scale / _typical_stiffness(stiffness, linear),
        force_scale,
        jacobian,
    )


def _typical_stiffness(contact: FloatArray, linear: DynamicStiffness) -> float:
    """Return the geometric mean of the contact stiffnesses, or of the structure's diagonal if there is no contact."""
    values = contact[contact > 0] if np.any(contact > 0) else np.abs(linear.nn[0].diagonal())
    values = values[values > 0]
    return float(np.exp(np.mean(np.log(values)))) if values.size else 1.0


def check_retained(place: str, linear: DynamicStiffness, interface: Interface) -> None:
    """Raise `InputError` unless all dofs on which contacts act are retained."""
    missing = np.setdiff1d(interface.coordinates(), linear.retained)
    if missing.size:
        raise input_error(place, f"contact dofs {missing[:5].tolist()} are not retained", "Retain all contact dofs.")


def _check_load(load: HarmonicLoad, harmonics: Harmonics) -> None:
    for h, force in load.harmonics.items():
        if h not in harmonics and np.any(force):
            raise input_error(
                "HarmonicLoad",
                f"excites harmonic {h}, but only {', '.join(map(str, harmonics))} are kept",
                f"Keep {h} or more.",
            )


def _checked_samples(samples: int, order: int) -> int:
    if samples < 4 * order + 1:
        raise input_error(
            "samples",
            f"{samples} samples a period for {order} harmonics",
            f"Give at least {max(8 * order, 16)} (eight a harmonic).",
        )
    return samples
