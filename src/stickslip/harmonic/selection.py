"""Which harmonics a frequency needs: the Jacobian Alert (Gastaldi & Berruti 2017, section 4)."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.structured import StructuredJacobian

Solve = Callable[[FloatArray | StructuredJacobian, FloatArray], FloatArray | None]

SILENCE = (
    1e-12  # contact forces of the missing harmonics, as a share of the load, that count as none
)
FLOOR = 1e-3  # outputs moving less than this share of the largest have no meaningful relative error


@dataclass(frozen=True, eq=False)
class Alert:
    """What the alert says at one frequency.

    Attributes
    ----------
    error
        Predicted relative change of the first harmonic (eq. 22, as a fraction); infinite where the enlarged Jacobian is singular.
    worst
        Position, among the dofs asked for, of the dof with that error.
    start
        Scaled unknowns ``q + Δq`` of the high-order problem.
    seconds_contact
        Time of the one contact evaluation.
    """

    error: float
    worst: int
    start: FloatArray
    seconds_contact: float


def jacobian_alert(
    low: HarmonicBalance,
    high: HarmonicBalance,
    x: FloatArray,
    omega: float,
    dofs: IntArray,
    solve: Solve | None = None,
) -> Alert:
    """Predict how the missing harmonics would change a low-order solution.

    One Newton step in the larger space from the padded solution, ``Δq = -J̃⁻¹ r̃(q)``. Where the contact forces are homogeneous of
    degree one this equals the published ``J̃ (q + Δq) = F`` (eq. 21); with preloads or gaps only the Newton form is right.

    Parameters
    ----------
    low, high
        The same problem with few and with many harmonics.
    x
        Scaled solution of `low`.
    omega
        Frequency, rad/s.
    dofs
        Structure dofs over which the largest relative change of harmonic 1 is taken; those that move less than a thousandth of the
        largest are left out.
    solve
        Solution of the enlarged system from its Jacobian and right side, None where there is none; by default by LU. The published method
        partitions the system by harmonics; a Krylov method with factors of each harmonic does, too.
    """
    q = low.coefficients(x)
    padded = high.unknowns(q)
    start = perf_counter()
    if _silent(low, high, padded, omega):
        return Alert(0.0, 0, padded, perf_counter() - start)
    at = high.linearise(padded, omega)
    change = (solve or _solve_array)(at.jac, -at.residual)
    if change is None:
        return Alert(np.inf, 0, padded, at.seconds_contact)
    dq = high.coefficients(change)
    before = np.abs(low.linear.recover(omega, q)[1, dofs])
    moved = np.abs(low.linear.recover_change(omega, dq)[1, dofs])
    relevant = before > FLOOR * before.max(initial=0.0)
    error = np.where(relevant, moved / np.where(relevant, before, 1.0), 0.0)
    worst = int(np.argmax(error))
    return Alert(float(error[worst]), worst, padded + change, at.seconds_contact)


def _solve_array(jac: FloatArray | StructuredJacobian, right: FloatArray) -> FloatArray | None:
    try:
        return np.asarray(
            np.linalg.solve(jac if isinstance(jac, np.ndarray) else jac.dense(), right)
        )
    except np.linalg.LinAlgError:
        return None


def _silent(low: HarmonicBalance, high: HarmonicBalance, padded: FloatArray, omega: float) -> bool:
    """Whether nothing acts on the missing harmonics, so that Δq = 0 without a factorisation.

    The enlarged residual repeats the low-order one, which is zero, in its first rows; its other rows are loads and contact forces of
    the missing harmonics.
    """
    if any(h > low.order for h in high.linear.load.harmonics):
        return False
    missing = high.contacts(padded, omega).coefficients[2 * low.order + 1 :]
    return bool(np.max(np.abs(missing), initial=0.0) <= SILENCE * high.force_scale)
