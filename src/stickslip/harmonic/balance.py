"""Harmonic balance: residual and Jacobian of ``r(q, ω) = Z q + B λ(Bᵀ q) - F`` in scaled unknowns."""

from dataclasses import dataclass, replace
from functools import lru_cache
from time import perf_counter

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.compiled import CompiledContacts, Evaluator
from stickslip.contact.interface import Interface, SparseRows, add_contact_jacobian, sparse_rows
from stickslip.errors import input_error
from stickslip.harmonic.aft import ContactPeriod, contact_forces
from stickslip.harmonic.dynamic_stiffness import Condensed, CondensedStiffness
from stickslip.harmonic.fourier import padded, to_complex, to_real


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Residual and derivatives at one state, all scaled, and the time the contacts took."""

    residual: FloatArray  # (size,)
    jac: FloatArray  # (size, size)
    jac_p: FloatArray  # (size,), by the parameter ω
    seconds_contact: float


@dataclass(frozen=True, eq=False)
class _LinearPart:
    condensed: Condensed
    matrix: FloatArray  # (n (2H+1), n (2H+1)) real form of the block-diagonal dynamic stiffness


@lru_cache(maxsize=4)
def _linear_part(linear: CondensedStiffness, order: int, omega: float) -> _LinearPart:
    """Assemble the linear side at one frequency; kept, because a Newton iteration at fixed frequency asks for it at every step."""
    condensed = linear.condensed(omega, order)
    n = linear.n
    matrix = np.zeros((n * (2 * order + 1), n * (2 * order + 1)), order="F")
    matrix[:n, :n] = condensed.stiffness[0].real
    for h in range(1, order + 1):
        cos, sin = slice((2 * h - 1) * n, 2 * h * n), slice(2 * h * n, (2 * h + 1) * n)
        matrix[cos, cos] = matrix[sin, sin] = condensed.stiffness[h].real
        matrix[cos, sin] = condensed.stiffness[h].imag
        matrix[sin, cos] = -condensed.stiffness[h].imag
    return _LinearPart(condensed, matrix)


@dataclass(frozen=True, eq=False)
class HarmonicBalance:
    """The periodic problem of one structure, one interface and one load with harmonics 0..`order`.

    Unknowns are ``q / displacement_scale``, equations are divided by `force_scale`, so that conditioning and steps do not depend on
    units. Build it with `harmonic_balance`.
    """

    linear: CondensedStiffness
    interface: Interface  # on the retained coordinates
    compiled: CompiledContacts
    rows: SparseRows
    order: int
    samples: int
    displacement_scale: float
    force_scale: float

    @property
    def size(self) -> int:
        """Number of real unknowns."""
        return self.linear.n * (2 * self.order + 1)

    def coefficients(self, x: FloatArray) -> ComplexArray:
        """Return the (order+1, n) complex coefficients in metres of scaled unknowns `x`."""
        return to_complex(x.reshape(2 * self.order + 1, self.linear.n)) * self.displacement_scale

    def unknowns(self, coefficients: ComplexArray) -> FloatArray:
        """Return the scaled unknowns of complex `coefficients`, padded or cut to `order`."""
        return to_real(padded(coefficients, self.order)).reshape(-1) / self.displacement_scale

    def contacts(self, x: FloatArray, omega: float) -> ContactPeriod:
        """Return gaps, forces and states of all contacts over one period, at the scaled unknowns `x` and `omega` (rad/s)."""
        q = x.reshape(2 * self.order + 1, self.linear.n) * self.displacement_scale
        return contact_forces(q @ self.interface.gap_operator.T, self.compiled, self.samples, omega)

    def linearise(self, x: FloatArray, omega: float) -> Linearisation:
        """Return residual, Jacobian and ω-derivative at scaled unknowns `x` (size,) and `omega` (rad/s)."""
        n, m = self.linear.n, 2 * self.order + 1
        factor = self.displacement_scale / self.force_scale
        part = _linear_part(self.linear, self.order, omega)
        jac = factor * part.matrix
        q = self.coefficients(x)[:, :, None]
        linear = (part.condensed.stiffness @ q)[:, :, 0] - part.condensed.load
        slope = (part.condensed.derivative @ q)[:, :, 0] - part.condensed.load_derivative
        start = perf_counter()
        period = self.contacts(x, omega)
        add_contact_jacobian(period.blocks, self.rows.columns, self.rows.values, n, factor, jac)
        seconds = perf_counter() - start
        residual = to_real(linear) + period.coefficients @ self.interface.gap_operator
        by_omega = to_real(slope)
        if period.by_omega is not None:
            by_omega += period.by_omega @ self.interface.gap_operator
        return Linearisation(
            residual.reshape(m * n) / self.force_scale,
            jac,
            by_omega.reshape(m * n) / self.force_scale,
            seconds,
        )

    def with_order(self, order: int) -> "HarmonicBalance":
        """Return the same problem with harmonics 0..`order`."""
        return replace(self, order=order, samples=_checked_samples(self.samples, order))


def harmonic_balance(
    linear: CondensedStiffness,
    interface: Interface,
    order: int,
    samples: int,
    evaluator: Evaluator = "intervals",
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

    Raises
    ------
    InputError
        If the contacts touch dofs that are not retained, or there are fewer than four samples a harmonic.
    """
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
    )


def _typical_stiffness(contact: FloatArray, linear: CondensedStiffness) -> float:
    """Geometric mean of the contact stiffnesses; of the structure's diagonal where there is no contact."""
    values = contact[contact > 0] if np.any(contact > 0) else np.abs(np.diagonal(linear.nn[0]))
    values = values[values > 0]
    return float(np.exp(np.mean(np.log(values)))) if values.size else 1.0


def _checked_samples(samples: int, order: int) -> int:
    if samples < 4 * order + 1:
        raise input_error(
            "samples",
            f"{samples} samples a period for {order} harmonics",
            f"Give at least {max(8 * order, 16)} (eight a harmonic).",
        )
    return samples
