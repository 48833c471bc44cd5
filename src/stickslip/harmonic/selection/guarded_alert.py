"""The Jacobian Alert with a check: a prediction is accepted only after the contacts were evaluated at ``q + Δq``.

The published alert (Gastaldi & Berruti 2017) uses the contact states of the low-order solution q. If they change on the
way to the true solution, its one Newton step is unreliable: in the blade-damper-blade benchmark it predicts 1.1 %
instead of 7.3 %. Here a prediction above the threshold is an alarm as before. One below is checked in steps of
increasing cost:

1. If no force acts on the missing harmonics, nor on any other of the judging set (`harmonic.judging`), it is accepted
   without a factorisation.
2. The contacts are evaluated at ``q + Δq``, with twice the harmonics of the reference, and a chord step is taken with
   the existing factors: ``Δq₂ = -J̃⁻¹ (r̃(q + Δq) + K̃ₓ Δqₓ)``. The harmonics x beyond the reference are solved one by
   one, ``Δqₓ = -(Z + K)ₓₓ⁻¹ rₓ``. If the residual decreases and ``|Δq₁| + 2 |Δq₂|`` is small, the prediction is
   accepted.
3. Newton's method continues from there with twice the harmonics of the reference until the decision is clear. With the
   rate ``θ = |Δqₖ₊₁| / |Δqₖ|`` of two such steps, the estimated total change is ``|q_k - q| + θ/(1-θ) |Δqₖ|``. The
   prediction is accepted if this is below the threshold (after one step: as in 2); it is an alarm if the change is
   above it, or the steps do not contract.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.product import contact_product, harmonic_means, less_means
from stickslip.errors import input_error
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.factors import solved, with_contacts
from stickslip.harmonic.harmonic_set import multiples, rows_among
from stickslip.harmonic.judging import UNSEEN, covers, judging_balance
from stickslip.harmonic.selection.adjoint import Factored, factored
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.harmonic.selection.strategy import Solve, Step, Verdict
from stickslip.harmonic.structured import StructuredJacobian

SAMPLES_A_HARMONIC = 8
DOUBT = 2.0  # times the chord step: uncertainty of the prediction


@dataclass(frozen=True)
class GuardedAlert:
    """Repeat with all harmonics of the reference if the error may exceed a threshold.

    The prediction is checked with the contact states after the step.

    Parameters
    ----------
    threshold
        Largest error that is accepted, as a fraction.
    quick
        Share of the threshold below which a prediction plus its uncertainty is accepted after the chord step.
    steps
        Largest number of Newton steps with twice the harmonics of the reference; if the result is still unclear, the
        alarm is given.
    """

    verifies: ClassVar[bool] = True
    threshold: float = 0.05
    quick: float = 0.5
    steps: int = 3

    def __post_init__(self) -> None:
        if not 0.0 <= self.quick <= 1.0:
            raise input_error("GuardedAlert.quick", f"must lie from 0 to 1, got {self.quick}", "0.5 is usual.")
        if self.steps < 0:
            raise input_error("GuardedAlert.steps", f"must not be negative, got {self.steps}", "3 is usual.")

    def judge(self, step: Step) -> Verdict:
        """Predict the change by all harmonics of the reference, and verify the prediction."""
        high = step.reference
        if step.balance.harmonics == high.harmonics:
            return Verdict(0.0, None, step.smallest)
        kept: list[tuple[Factored, float]] = []

        def solve(jac: FloatArray | StructuredJacobian, right: FloatArray) -> FloatArray | None:
            kept.append((factored(jac, step.solve), float(np.linalg.norm(right))))
            return kept[-1][0].solve(right)

        alert = jacobian_alert(step.balance, high, step.x, step.omega, step.measure, solve, events=step.events)
        if not kept and not covers(step.balance, high):
            # no force on the harmonics of the reference; check the other harmonics of the judging set
            wide = judging_balance(step.balance, high.harmonics)
            alert = jacobian_alert(step.balance, wide, step.x, step.omega, step.measure, step.solve, events=step.events)
            known = covers(step.balance, wide)
            error = alert.error if known else max(alert.error, UNSEEN)
            return self._verdict(step, error, wide.coefficients(alert.start))
        if not kept or alert.error > self.threshold:
            return self._verdict(step, alert.error, high.coefficients(alert.start))
        bound, start = self._doubted(step, *kept[0], alert.error, alert.start)
        return self._verdict(step, bound, start)

    def _verdict(self, step: Step, bound: float, start: ComplexArray) -> Verdict:
        again = None if bound <= self.threshold else step.reference.harmonics
        return Verdict(bound, again, step.smallest, start)

    def _doubted(
        self, step: Step, factors: Factored, residual: float, predicted: float, start: FloatArray
    ) -> tuple[float, ComplexArray]:
        """Return an error bound and the best start of a repeat, from the prediction `start`."""
        high, omega = step.reference, step.omega
        beyond = doubled(high)
        at = high.linearise(start, omega)
        wide = beyond.unknowns(high.coefficients(start))
        period = beyond.forces(wide, omega, at.events)
        right = at.residual + truncated(high, beyond, period, omega, step.solve)
        chord = factors.solve(-right)
        if chord is not None and float(np.linalg.norm(at.residual)) <= residual:
            bound = predicted + DOUBT * _error(step, high, chord)
            if bound <= self.quick * self.threshold:
                return bound, high.coefficients(start)
        return self._followed(step, beyond, wide, period, residual)

    def _followed(
        self, step: Step, beyond: HarmonicBalance, x: FloatArray, period: ContactPeriod, residual: float
    ) -> tuple[float, ComplexArray]:
        """Continue Newton's method until the decision is clear; see `_doubted`."""
        begin = beyond.unknowns(step.balance.coefficients(step.x))
        first = float(np.hypot(residual, _unbalanced(step, beyond, begin)))
        before, whole, best = np.nan, np.inf, (np.inf, x)
        for k in range(self.steps):
            at = beyond.linearise(x, step.omega, period if k == 0 else None)
            norm = float(np.linalg.norm(at.residual))
            if norm < best[0]:
                best = (norm, x)
            change = factored(at.jac, step.solve).solve(-at.residual)
            if change is None:
                break
            x = x + change
            moved, size = _error(step, beyond, x - begin), _error(step, beyond, change)
            if moved > self.threshold:
                return moved, beyond.coefficients(x)
            bound = moved + _left(size, before)
            # the first step has no earlier one for a rate of contraction
            limit = self.threshold if k > 0 else self.quick * self.threshold
            # outputs may stand still while the contacts still change
            length = float(np.linalg.norm(change))
            if bound <= limit and norm < first and length < whole:
                return bound, beyond.coefficients(x)
            before, whole = size, length
        return np.inf, beyond.coefficients(best[1])


def _unbalanced(step: Step, beyond: HarmonicBalance, begin: FloatArray) -> float:
    """Return the scaled residual of a solution in the harmonics beyond the reference."""
    period = beyond.forces(begin, step.omega, step.events)
    force = np.zeros((beyond.n_rows, beyond.linear.n))
    beyond.rows.add_forces(period.coefficients, force)
    force[rows_among(beyond.harmonics, step.reference.harmonics)] = 0.0
    return float(np.linalg.norm(force)) / beyond.force_scale


def _left(size: float, before: float) -> float:
    """Return the estimated remaining change of a sequence after a step: a geometric series.

    After the first step it is the uncertainty of that step.
    """
    if np.isnan(before):
        return DOUBT * size
    if size >= before:
        return np.inf if size > 0.0 else 0.0
    rate = size / before
    return size * rate / (1.0 - rate)


def _error(step: Step, balance: HarmonicBalance, change: FloatArray) -> float:
    """Return the relative change of the measured dofs by a change of the scaled unknowns of `balance`."""
    linear, q = balance.linear, step.balance.coefficients(step.x)
    rows = step.measure.rows(len(q), balance.order + 1)
    moved = linear.recover_change(step.omega, balance.coefficients(change)[:rows])
    return step.measure.change(linear.recover(step.omega, q), moved)[0]


@lru_cache(maxsize=8)
def doubled(reference: HarmonicBalance) -> HarmonicBalance:
    """Return the same problem with all multiples of the common divisor of its harmonics up to twice the highest.

    The waves of a tuned wheel may limit the highest one.
    """
    order = 2 * reference.order
    most = reference.linear.most
    order = order if most is None else min(order, most)
    samples = max(reference.samples, SAMPLES_A_HARMONIC * order)
    return replace(reference, samples=samples).with_harmonics(multiples(reference.harmonics, order))


def truncated(
    high: HarmonicBalance, beyond: HarmonicBalance, period: ContactPeriod, omega: float, solve: Solve | None = None
) -> FloatArray:
    """Return the contribution of neglected harmonics, each solved alone, to the scaled residual of the reference.

    Parameters
    ----------
    high, beyond
        The reference, and the same problem with additional harmonics.
    period
        Contacts with the harmonics of `beyond` at a motion with the harmonics of `high`.
    omega
        Frequency, rad/s.
    solve
        Solver of systems known by their products; None: harmonic by harmonic.
    """
    rows, n = beyond.rows, beyond.linear.n
    force = np.zeros((beyond.n_rows, n))
    rows.add_forces(period.coefficients, force)
    moved = _moved(high, beyond, period, omega, force, solve)
    gap, own = np.empty((3, beyond.n_rows)), np.empty((3, beyond.n_rows))
    out = np.zeros_like(force)
    contact_product(period.blocks, rows.columns, rows.values, moved, False, gap, own, out)
    kept = rows_among(beyond.harmonics, high.harmonics)
    return np.asarray(out[kept].reshape(-1) / high.force_scale)


def _moved(
    high: HarmonicBalance,
    beyond: HarmonicBalance,
    period: ContactPeriod,
    omega: float,
    force: FloatArray,
    solve: Solve | None,
) -> FloatArray:
    """Return the motion (m, n), m, in the harmonics beyond the reference, under the contact forces (m, n)."""
    means = harmonic_means(period.blocks)
    moved = np.zeros_like(force)
    if beyond.structured and solve is not None:
        own = period.blocks - less_means(period.blocks, means)
        moved -= force
        moved[rows_among(beyond.harmonics, high.harmonics)] = 0.0
        found = solve(beyond.by_parts(omega, own), moved.reshape(-1) / beyond.force_scale)
        return np.zeros_like(force) if found is None else beyond.displacement_scale * found.reshape(force.shape)
    for place, h in enumerate(beyond.harmonics):
        if h in high.harmonics:
            continue
        matrix = with_contacts(beyond.linear_block(omega, h), means[place], beyond.rows)
        try:
            q = -solved(matrix, force[2 * place - 1] - 1j * force[2 * place])
        except np.linalg.LinAlgError:
            continue  # a resonance without damping: the Newton steps that follow account for it
        moved[2 * place - 1], moved[2 * place] = q.real, -q.imag
    return moved
