"""Effect of each missing harmonic on the outputs: residuals weighted by the adjoints of the outputs.

R. Becker and R. Rannacher, "An optimal control approach to a posteriori error estimation in finite element methods",
Acta Numerica 10 (2001) 1-102, sections 2 and 6, applied to harmonics in place of elements. The padded low-order
solution q leaves a residual r̃ only in the missing harmonics. With the adjoint ``Jᵀ z = ∂y/∂q`` of an output y, the
missing harmonics change it by ``-Σ_h z_hᵀ r̃_h``. With the Jacobian at q this is the step of the Jacobian Alert,
accurate to second order in the change. With the mean of the Jacobians at q and at the end of that step (trapezoidal
rule), it is accurate to third order.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
import scipy.linalg

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.event_integrals import Events
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import Harmonics, rows_among
from stickslip.harmonic.selection.alert import silent
from stickslip.harmonic.selection.strategy import ErrorMeasure, Solve
from stickslip.harmonic.structured import StructuredJacobian
from stickslip.model.blas_threads import threads_for

Goal = Literal["motion", "amplitude"]
SINGULAR = 1e-15  # ratio of smallest to largest pivot below which factors are unusable
DOUBTFUL = 0.3  # relative difference of two estimated changes above which a third one is computed
MAX_FULL_EVALUATIONS = 3  # evaluations with all harmonics


@dataclass(frozen=True, eq=False)
class Outputs:
    """Harmonics of dofs whose relative changes ``Δy / y`` define the error.

    The real parts are, to first order, relative changes of the amplitudes, the imaginary parts changes of the phases in
    rad.

    Attributes
    ----------
    harmonics, dofs
        (k,) harmonic and dof of each output.
    motion
        (k,) reference of relative changes, m: the complex displacement, or the measure's reference with the same phase,
        if larger.
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
        """Return the relative changes (k, ...), or their real parts where the goal is ``amplitude``."""
        return change.real.astype(complex) if self.goal == "amplitude" else change

    def some(self, places: IntArray) -> "Outputs":
        """Return the outputs at these places."""
        return Outputs(self.harmonics[places], self.dofs[places], self.motion[places], self.goal)


def outputs_of(measure: ErrorMeasure, before: ComplexArray, goal: Goal = "motion") -> Outputs:
    """Return the outputs of a measure for which a relative error is defined, with their references.

    Parameters
    ----------
    measure
        Dofs and harmonics over which the largest relative change is taken.
    before
        (H+1, n_all) displacement of all dofs, m.
    goal
        ``motion`` or ``amplitude``; see `Outputs`.
    """
    scales = measure.scales(before, len(before))
    motion = before[scales.harmonics[:, None], measure.dofs]
    turn = np.exp(1j * np.angle(motion))  # the reference of a change has the phase of the motion
    row, column = np.nonzero(scales.size > 0.0)
    harmonics, dofs = scales.harmonics[row], measure.dofs[column]
    return Outputs(harmonics, dofs, (scales.size * turn)[row, column], goal)


@dataclass(frozen=True, eq=False)
class Factored:
    """A Jacobian and its LU factors, or a solver if it is known by its products."""

    jac: FloatArray | StructuredJacobian
    factors: tuple[FloatArray, IntArray] | None
    other: Solve | None

    def solve(self, right: FloatArray) -> FloatArray | None:
        """Solve with a right side (n,); None if there is no solution."""
        if self.other is not None:
            return self.other(self.jac, right)
        return None if self.factors is None else _by_factors(self.factors, right, transposed=False)


def factored(jac: FloatArray | StructuredJacobian, solve: Solve | None) -> Factored:
    """Factorise a Jacobian once for all its systems.

    Parameters
    ----------
    jac
        An array, or a Jacobian known by its products, which `solve` solves; without `solve` it becomes an array.
    solve
        Function from matrix and right side to the solution, None if there is none.
    """
    if isinstance(jac, StructuredJacobian):
        if solve is not None:
            return Factored(jac, None, solve)
        jac = jac.dense()
    with threads_for(len(jac)):
        lu, pivots, info = scipy.linalg.lapack.dgetrf(jac)
    size = np.abs(np.diagonal(lu))
    usable = info == 0 and np.all(np.isfinite(size)) and size.min() > SINGULAR * size.max()
    return Factored(jac, (lu, pivots) if usable else None, None)


def _by_factors(factors: tuple[FloatArray, IntArray], right: FloatArray, *, transposed: bool) -> FloatArray:
    solution, _ = scipy.linalg.lapack.dgetrs(*factors, right, trans=int(transposed))
    return np.asarray(solution)


def mean_jacobian(
    one: FloatArray | StructuredJacobian, other: FloatArray | StructuredJacobian
) -> FloatArray | StructuredJacobian:
    """Return the mean of two Jacobians of one problem at one frequency."""
    if isinstance(one, StructuredJacobian) and isinstance(other, StructuredJacobian):
        return replace(one, blocks=0.5 * (one.blocks + other.blocks))
    if isinstance(one, StructuredJacobian) or isinstance(other, StructuredJacobian):
        raise input_error("mean_jacobian", "was given an array and products", "Take both of one problem.")
    return np.asarray(0.5 * (one + other))


@dataclass(frozen=True, eq=False)
class Estimate:
    """Estimated relative changes of the outputs by the missing harmonics; infinite if a Jacobian is singular.

    Attributes
    ----------
    changes
        (k,) complex changes of the outputs, one array per estimate: first with the Jacobian at the solution, as the
        Jacobian Alert predicts, then with mean Jacobians.
    start
        Scaled unknowns of the reference after the last step.
    residual
        Scaled residual r̃ of the padded solution.
    mean
        The last mean Jacobian; None if no force acts on the missing harmonics, or if it is singular.
    """

    changes: tuple[ComplexArray, ...]
    start: FloatArray
    residual: FloatArray
    mean: Factored | None

    @property
    def error(self) -> float:
        """Largest estimated relative error."""
        return float(np.max(np.abs(self.changes[-1]), initial=0.0))

    @property
    def errors(self) -> FloatArray:
        """(k,) largest expected relative error of each output: the larger one of last estimate and Jacobian Alert."""
        return np.maximum(np.abs(self.changes[0]), np.abs(self.changes[-1]))

    @property
    def bound(self) -> float:
        """Largest expected relative error, at least the prediction of the Jacobian Alert."""
        return float(np.max(self.errors, initial=0.0))

    @property
    def doubt(self) -> float:
        """Largest relative difference of two successive estimates: far below 1 if they agree."""
        if self.mean is None:
            return 0.0 if self.bound == 0.0 else np.inf
        return max(_away(one, other, self.changes[-1]) for one, other in pairwise(self.changes))


def _away(one: ComplexArray, other: ComplexArray, scale: ComplexArray) -> float:
    size = float(np.max(np.abs(scale), initial=0.0))
    return float(np.max(np.abs(other - one))) / size if size > 0.0 else 0.0


def estimate(
    low: HarmonicBalance,
    high: HarmonicBalance,
    x: FloatArray,
    omega: float,
    outputs: Outputs,
    solve: Solve | None = None,
    events: Events | None = None,
) -> Estimate:
    """Estimate the error of the outputs of a low-order solution due to missing harmonics.

    The problem with all harmonics is evaluated at the padded solution and one Newton step from there. If the first two
    steps differ by more than `DOUBTFUL`, a third evaluation follows at the end of the second step.

    Parameters
    ----------
    low, high
        The same problem with few and with many harmonics.
    x
        Scaled solution of `low`.
    omega
        Frequency, rad/s.
    outputs
        Outputs of the error.
    solve
        For Jacobians known by their products: function from matrix and right side to the solution; None: LU.
    events
        Events of the contacts at the solution, if its evaluation found them (`Step.events`).
    """
    padded = high.unknowns(low.coefficients(x))
    period = high.forces(padded, omega, events)
    if silent(low, high, period):
        nothing = np.zeros(outputs.dofs.size, dtype=complex)
        return Estimate((nothing, nothing), padded, np.zeros(high.size), None)
    at = high.linearise(padded, omega, period)
    jac: FloatArray | StructuredJacobian = at.jac
    changes: list[ComplexArray] = []
    start = padded
    while True:
        mean = factored(jac, solve)
        change = mean.solve(-at.residual)
        if change is None or not np.all(np.isfinite(change)):
            changes.append(np.full(outputs.dofs.size, complex(np.inf)))
            return Estimate(tuple(changes), start, at.residual, None)
        start = padded + change
        changes.append(_relative(high, omega, outputs, change))
        clear = len(changes) > 1 and _away(changes[-2], changes[-1], changes[-1]) <= DOUBTFUL
        if clear or len(changes) == MAX_FULL_EVALUATIONS:
            return Estimate(tuple(changes), start, at.residual, mean)
        jac = mean_jacobian(at.jac, high.linearise(start, omega).jac)


def contributions(
    low: HarmonicBalance, high: HarmonicBalance, omega: float, outputs: Outputs, found: Estimate
) -> ComplexArray:
    """Return the (k, n_missing) contributions of the missing harmonics to the last changes of an estimate.

    Each output takes two transposed solutions (one for the static part) with the factors of the estimate. A Jacobian
    known by its products is solved for the residual of each missing harmonic instead, with the same result.

    Parameters
    ----------
    low, high
        The same problem with few and with many harmonics.
    omega
        Frequency, rad/s.
    outputs
        Outputs of the estimate, or some of them.
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
        parts = [by_row[rows_among(high.harmonics, (h,))].sum(axis=0) for h in missing]
    else:
        for h in missing:
            alone = np.zeros((high.n_rows, high.linear.n))
            own = rows_among(high.harmonics, (h,))
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
    """Return the adjoints z (size, k) of the complex relative changes y of the outputs, ``Jᵀ z = ∂y/∂x``."""
    k = outputs.dofs.size
    gradient = np.zeros((high.n_rows, high.linear.n, k), dtype=complex)
    for h in np.unique(outputs.harmonics):
        mine = np.flatnonzero(outputs.harmonics == h)
        row = high.linear.output_rows(omega, int(h), outputs.dofs[mine])
        row *= high.displacement_scale / outputs.motion[mine, None]
        rows = rows_among(high.harmonics, (int(h),))
        gradient[rows[0]][:, mine] = row.T
        if h > 0:  # Q = C - iS
            gradient[rows[1]][:, mine] = -1j * row.T
    flat = gradient.reshape(high.size, k)
    both = _by_factors(factors, np.hstack([flat.real, flat.imag]), transposed=True)
    return np.asarray(both[:, :k] + 1j * both[:, k:])


def _relative(high: HarmonicBalance, omega: float, outputs: Outputs, change: FloatArray) -> ComplexArray:
    """Return the relative changes of the outputs by a change of the scaled unknowns."""
    own = high.coefficients(change)[: int(np.max(outputs.harmonics, initial=0)) + 1]
    return outputs.relative(high.linear.recover_change(omega, own))


def _missing(low: HarmonicBalance, high: HarmonicBalance) -> Harmonics:
    return tuple(h for h in high.harmonics if h not in low.harmonics)
