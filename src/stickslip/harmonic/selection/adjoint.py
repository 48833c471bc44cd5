"""What each missing harmonic does to the outputs: residuals weighted by the adjoints of the outputs.

R. Becker and R. Rannacher, "An optimal control approach to a posteriori error estimation in finite element methods", Acta Numerica 10
(2001) 1-102, sections 2 and 6, applied to harmonics in place of elements. The padded solution q of few harmonics leaves a residual r̃ in
the missing ones alone. With the adjoint ``Jᵀ z = ∂y/∂q`` of an output y, its change by all missing harmonics is ``-Σ_h z_hᵀ r̃_h``. With the
Jacobian at q this is the step of the Jacobian Alert, right to second order in the change; with the mean of the Jacobians at q and at the end
of that step (the trapezoidal rule on the way) to third.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy.linalg

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.selection.strategy import FLOOR, ErrorMeasure, Solve
from stickslip.harmonic.structured import StructuredJacobian
from stickslip.harmonic.support import Harmonics, rows_of

Goal = Literal["motion", "amplitude"]
SILENCE = 1e-12  # residual in the missing harmonics, as a share of the load, that counts as none
SINGULAR = 1e-15  # smallest pivot over largest below which a Jacobian has no usable factors


@dataclass(frozen=True, eq=False)
class Outputs:
    """Harmonics of dofs, one after the other, whose relative changes ``Δy / y`` make the error.

    Their real parts are, to first order, relative changes of the amplitudes, and their imaginary parts changes of the phases in rad.

    Attributes
    ----------
    harmonics, dofs
        (k,) what the outputs are.
    motion
        (k,) complex displacement, m.
    goal
        ``motion``: relative changes are complex; ``amplitude``: only their real parts count.
    """

    harmonics: IntArray
    dofs: IntArray
    motion: ComplexArray
    goal: Goal = "motion"

    def relative(self, change: ComplexArray) -> ComplexArray:
        """Return the (k,) relative changes from a change (H+1, n_all) of all dofs."""
        return self.counted(change[self.harmonics, self.dofs] / self.motion)

    def counted(self, change: ComplexArray) -> ComplexArray:
        """Return what of the relative changes (k, ...) counts."""
        return change.real.astype(complex) if self.goal == "amplitude" else change

    def some(self, places: IntArray) -> "Outputs":
        """Return the outputs at these places."""
        return Outputs(self.harmonics[places], self.dofs[places], self.motion[places], self.goal)


def outputs_of(measure: ErrorMeasure, before: ComplexArray, goal: Goal = "motion") -> Outputs:
    """Return the outputs of a measure that move enough to have a relative error.

    Parameters
    ----------
    measure
        Dofs and harmonics over which the largest relative change is taken.
    before
        (H+1, n_all) displacement of all dofs, m.
    goal
        What of their changes counts.
    """
    own = np.array([h for h in measure.harmonics if h < len(before)], dtype=np.int64)
    motion = before[own[:, None], measure.dofs]
    size = np.abs(motion)
    row, column = np.nonzero(size > FLOOR * size.max(axis=1, initial=0.0, keepdims=True))
    return Outputs(own[row], measure.dofs[column], motion[row, column], goal)


@dataclass(frozen=True, eq=False)
class Factored:
    """A Jacobian and its LU factors, which serve the system and the transposed one; for one known by its products, a solver."""

    jac: FloatArray | StructuredJacobian
    factors: tuple[FloatArray, IntArray] | None
    other: Solve | None

    def solve(self, right: FloatArray) -> FloatArray | None:
        """Solve with a right side (n,); None where there is no solution."""
        if self.other is not None:
            return self.other(self.jac, right)
        return None if self.factors is None else _by_factors(self.factors, right, transposed=False)


def factored(jac: FloatArray | StructuredJacobian, solve: Solve | None) -> Factored:
    """Factorise a Jacobian once for all that is solved with it.

    Parameters
    ----------
    jac
        An array, or a Jacobian by its products, for which `solve` is taken; without one it is made an array.
    solve
        Solution of a system from its matrix and right side, None where there is none.
    """
    if isinstance(jac, StructuredJacobian):
        if solve is not None:
            return Factored(jac, None, solve)
        jac = jac.dense()
    lu, pivots, info = scipy.linalg.lapack.dgetrf(jac)
    size = np.abs(np.diagonal(lu))
    usable = info == 0 and np.all(np.isfinite(size)) and size.min() > SINGULAR * size.max()
    return Factored(jac, (lu, pivots) if usable else None, None)


def _by_factors(
    factors: tuple[FloatArray, IntArray], right: FloatArray, *, transposed: bool
) -> FloatArray:
    solution, _ = scipy.linalg.lapack.dgetrs(*factors, right, trans=int(transposed))
    return np.asarray(solution)


def mean_jacobian(
    one: FloatArray | StructuredJacobian, other: FloatArray | StructuredJacobian
) -> FloatArray | StructuredJacobian:
    """Return the mean of two Jacobians of one problem at one frequency."""
    if isinstance(one, StructuredJacobian) and isinstance(other, StructuredJacobian):
        return replace(one, blocks=0.5 * (one.blocks + other.blocks))
    if isinstance(one, StructuredJacobian) or isinstance(other, StructuredJacobian):
        raise input_error(
            "mean_jacobian", "was given an array and products", "Take both of one problem."
        )
    return np.asarray(0.5 * (one + other))


@dataclass(frozen=True, eq=False)
class Estimate:
    """How the missing harmonics change the outputs, relative to their amplitudes; all infinite where a Jacobian is singular.

    Attributes
    ----------
    first
        (k,) complex changes by the Jacobian at the solution: those of the Jacobian Alert.
    second
        (k,) complex changes by the mean Jacobian.
    start
        Scaled unknowns of the reference at the end of the second step.
    residual
        Scaled residual r̃ of the padded solution.
    mean
        The mean Jacobian; None where nothing acts on the missing harmonics, or where it is singular.
    """

    first: ComplexArray
    second: ComplexArray
    start: FloatArray
    residual: FloatArray
    mean: Factored | None

    @property
    def error(self) -> float:
        """Largest estimated relative error."""
        return float(np.max(np.abs(self.second), initial=0.0))

    @property
    def bound(self) -> float:
        """Largest relative error that is to be expected; never below the prediction of the Jacobian Alert."""
        return float(np.max(self.bounds, initial=0.0))

    @property
    def doubt(self) -> float:
        """Distance between both changes of the worst output over the second one: below 1 where they tell the same story."""
        if not np.any(self.second):
            return 0.0
        worst = int(np.argmax(self.bounds))
        size = float(np.abs(self.second[worst]))
        away = float(np.abs(self.second[worst] - self.first[worst]))
        return away / size if np.isfinite(size) and size > 0.0 else np.inf

    @property
    def bounds(self) -> FloatArray:
        """(k,) size of the second change and its distance from the first one, by which the trapezoidal rule may be wrong."""
        if not np.all(np.isfinite(self.second)):
            return np.full(self.second.size, np.inf)
        return np.asarray(np.abs(self.second) + np.abs(self.second - self.first))


def estimate(
    low: HarmonicBalance,
    high: HarmonicBalance,
    x: FloatArray,
    omega: float,
    outputs: Outputs,
    solve: Solve | None = None,
) -> Estimate:
    """Estimate the error that the missing harmonics make in the outputs of a low-order solution.

    Two evaluations of the problem with all harmonics, at the padded solution and one Newton step from there.

    Parameters
    ----------
    low, high
        The same problem with few and with many harmonics.
    x
        Scaled solution of `low`.
    omega
        Frequency, rad/s.
    outputs
        What the error is taken of.
    solve
        For Jacobians known by their products: solution of a system from its matrix and right side; None: LU.
    """
    padded = high.unknowns(low.coefficients(x))
    unknown = np.full(outputs.dofs.size, complex(np.inf))
    at = high.linearise(padded, omega)
    residual = at.residual
    acting = residual.reshape(high.n_rows, -1)[_rows(high.harmonics, _missing(low, high))]
    if np.max(np.abs(acting), initial=0.0) <= SILENCE:
        nothing = np.zeros_like(unknown)
        return Estimate(nothing, nothing, padded, residual, None)
    first = factored(at.jac, solve).solve(-residual)
    if first is None:
        return Estimate(unknown, unknown, padded, residual, None)
    changed = _relative(high, omega, outputs, first)
    beyond = high.linearise(padded + first, omega)
    mean = factored(mean_jacobian(at.jac, beyond.jac), solve)
    second = mean.solve(-residual)
    if second is None:
        return Estimate(changed, unknown, padded, residual, None)
    return Estimate(
        changed, _relative(high, omega, outputs, second), padded + second, residual, mean
    )


def contributions(
    low: HarmonicBalance, high: HarmonicBalance, omega: float, outputs: Outputs, found: Estimate
) -> ComplexArray:
    """Return the (k, n_missing) parts of the missing harmonics in the changes `found.second` of the outputs.

    By two transposed solves an output (one for the static part) with the factors that the estimate has. A Jacobian
    that is known by its products is solved for each missing harmonic's residual instead, which gives the same numbers.

    Parameters
    ----------
    low, high
        The same problem with few and with many harmonics.
    omega
        Frequency, rad/s.
    outputs
        Those of the estimate, or some of them.
    found
        An estimate whose mean Jacobian is regular.
    """
    mean, missing = found.mean, _missing(low, high)
    if mean is None:
        return np.zeros((outputs.dofs.size, len(missing)), dtype=complex)
    parts = []
    if mean.factors is not None:
        adjoint = _adjoints(high, omega, outputs, mean.factors)
        weighted = -adjoint * found.residual[:, None]
        by_row = weighted.reshape(high.n_rows, -1, outputs.dofs.size).sum(axis=1)
        parts = [by_row[_rows(high.harmonics, (h,))].sum(axis=0) for h in missing]
    else:
        for h in missing:
            alone = np.zeros((high.n_rows, high.linear.n))
            own = _rows(high.harmonics, (h,))
            alone[own] = -found.residual.reshape(alone.shape)[own]
            change = mean.solve(alone.reshape(-1))
            if change is None:
                parts.append(np.full(outputs.dofs.size, complex(np.inf)))
            else:
                parts.append(_relative(high, omega, outputs, change))
    return outputs.counted(np.array(parts).T)


def _adjoints(
    high: HarmonicBalance, omega: float, outputs: Outputs, factors: tuple[FloatArray, IntArray]
) -> ComplexArray:
    """Return z (size, k) of ``Jᵀ z = ∂y/∂x`` for the complex relative changes y of the outputs."""
    k = outputs.dofs.size
    gradient = np.zeros((high.n_rows, high.linear.n, k), dtype=complex)
    for h in np.unique(outputs.harmonics):
        mine = np.flatnonzero(outputs.harmonics == h)
        row = high.linear.output_rows(omega, int(h), outputs.dofs[mine])
        row *= high.displacement_scale / outputs.motion[mine, None]
        rows = _rows(high.harmonics, (int(h),))
        gradient[rows[0]][:, mine] = row.T
        if h > 0:  # Q = C - iS
            gradient[rows[1]][:, mine] = -1j * row.T
    flat = gradient.reshape(high.size, k)
    both = _by_factors(factors, np.hstack([flat.real, flat.imag]), transposed=True)
    return np.asarray(both[:, :k] + 1j * both[:, k:])


def _relative(
    high: HarmonicBalance, omega: float, outputs: Outputs, change: FloatArray
) -> ComplexArray:
    """Return the relative changes of the outputs by a change of the scaled unknowns."""
    return outputs.relative(high.linear.recover_change(omega, high.coefficients(change)))


def _missing(low: HarmonicBalance, high: HarmonicBalance) -> Harmonics:
    return tuple(h for h in high.harmonics if h not in low.harmonics)


def _rows(harmonics: Harmonics, some: Harmonics) -> IntArray:
    """Return the rows of `some` harmonics among the real coefficients of a support."""
    place = rows_of(harmonics)
    wanted = rows_of((0, *(h for h in some if h > 0)))[0 if 0 in some else 1 :]
    return np.searchsorted(place, wanted)
