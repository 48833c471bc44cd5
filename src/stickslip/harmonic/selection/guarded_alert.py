"""The Jacobian Alert with a second look: no prediction is believed before the contacts were asked at ``q + Δq``.

The published alert (Gastaldi & Berruti 2017) takes the contact states of the low-order solution q for those of the true one. Where
they change on the way, its one Newton step says little: in the blade-damper-blade benchmark it predicts 1.1 % where 7.3 % are true. Here a
prediction above the threshold is an alarm as it was; one below it has to prove itself, by steps whose cost grows with the doubt:

1. Nothing acts on the missing harmonics, nor on any other of the judging set (`harmonic.judging`): silent, without a factorisation.
2. The contacts are evaluated at ``q + Δq``, with twice the harmonics of the reference, and a chord step is taken with the factors that
   are there: ``Δq₂ = -J̃⁻¹ (r̃(q + Δq) + K̃ₓ Δqₓ)``. The harmonics x beyond the reference are solved one by one,
   ``Δqₓ = -(Z + K)ₓₓ⁻¹ rₓ``. A residual that fell, and a small ``|Δq₁| + 2 |Δq₂|``, prove the prediction.
3. Newton's method goes on from there with twice the harmonics of the reference, and stops as soon as the answer is clear: the change
   so far with what is left of it at the rate ``θ = |Δqₖ₊₁| / |Δqₖ|`` of two such steps, that is ``|q_k - q| + θ/(1-θ) |Δqₖ|``,
   is below the threshold (after one step: as in 2), or the change is above it. What does not contract is an alarm.
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
DOUBT = 2.0  # times the chord step that the true change may go beyond the prediction


@dataclass(frozen=True)
class GuardedAlert:
    """Repeat with all harmonics of the reference if the error may exceed a threshold, also judged with the contact states after the step.

    Parameters
    ----------
    threshold
        Largest error that is accepted, as a fraction.
    quick
        Share of the threshold below which a prediction plus its uncertainty is accepted after the chord step.
    steps
        Largest number of Newton steps with twice the harmonics of the reference; if the result is still unclear, the alarm is given.
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
            # silent on harmonics that the reference has; what acts on the others of the judging set?
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
        """Return an error bound and the best start of a repeat, from the prediction ``q + Δq`` and the solution q."""
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
            # the first step has none of its kind to be compared with
            limit = self.threshold if k > 0 else self.quick * self.threshold
            # outputs may stand still while contacts are on their way elsewhere
            length = float(np.linalg.norm(change))
            if bound <= limit and norm < first and length < whole:
                return bound, beyond.coefficients(x)
            before, whole = size, length
        return np.inf, beyond.coefficients(best[1])


def _unbalanced(step: Step, beyond: HarmonicBalance, begin: FloatArray) -> float:
    """Return the scaled residual that a solution leaves on the harmonics beyond the reference."""
    period = beyond.forces(begin, step.omega, step.events)
    force = np.zeros((beyond.n_rows, beyond.linear.n))
    beyond.rows.add_forces(period.coefficients, force)
    force[rows_among(beyond.harmonics, step.reference.harmonics)] = 0.0
    return float(np.linalg.norm(force)) / beyond.force_scale


def _left(size: float, before: float) -> float:
    """Return the estimated remaining change of a sequence after a step: a geometric series, for the first step its uncertainty."""
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
    """Return the same problem with harmonics up to twice the highest (limited by the waves of a tuned wheel), multiples of the common divisor of the kept ones."""
    order = 2 * reference.order
    most = reference.linear.most
    order = order if most is None else min(order, most)
    samples = max(reference.samples, SAMPLES_A_HARMONIC * order)
    return replace(reference, samples=samples).with_harmonics(multiples(reference.harmonics, order))


def truncated(
    high: HarmonicBalance, beyond: HarmonicBalance, period: ContactPeriod, omega: float, solve: Solve | None = None
) -> FloatArray:
    """Return the contribution to the reference's scaled residual of harmonics that it leaves out, each solved alone.

    Parameters
    ----------
    high, beyond
        The reference and the same problem with all of its harmonics and more.
    period
        Contacts with the harmonics of `beyond` at a motion that has those of `high` alone.
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
    """Return the rows (m, n) of the motion in the harmonics that the reference leaves out, m, under the contact forces (m, n)."""
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
            continue  # a resonance without damping: the Newton steps that follow see it
        moved[2 * place - 1], moved[2 * place] = q.real, -q.imag
    return moved
