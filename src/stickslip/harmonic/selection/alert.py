"""Prediction of the Jacobian Alert: change of a solution by missing harmonics (Gastaldi & Berruti 2017, section 4)."""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.event_integrals import Events
from stickslip.errors import check_choice
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.selection.strategy import ErrorMeasure, Solve
from stickslip.harmonic.structured import StructuredJacobian

Form = Literal["newton", "published"]
SILENCE = 1e-12  # contact forces in the missing harmonics, as a share of the load, that count as zero


@dataclass(frozen=True, eq=False)
class Alert:
    """Result of the alert at one frequency.

    Attributes
    ----------
    error
        Predicted relative change (eq. 22, 23, as a fraction); infinite if the enlarged Jacobian is singular.
    worst
        Position of the dof with this error among those of the measure.
    harmonic
        The harmonic with this error.
    start
        Scaled unknowns ``q + Δq`` of the high-order problem.
    seconds_contact
        Time of the contact evaluations, or of the integrals between known events.
    """

    error: float
    worst: int
    harmonic: int
    start: FloatArray
    seconds_contact: float


def jacobian_alert(
    low: HarmonicBalance,
    high: HarmonicBalance,
    x: FloatArray,
    omega: float,
    measure: ErrorMeasure,
    solve: Solve | None = None,
    form: Form = "newton",
    events: Events | None = None,
) -> Alert:
    """Predict the change of a low-order solution by the missing harmonics.

    One Newton step in the larger space from the padded solution, ``Δq = -J̃⁻¹ r̃(q)``. If the contact forces are
    homogeneous of degree one, this equals the published ``J̃ (q + Δq) = F`` (eq. 21), because ``r̃ = J̃ q - F``. With
    preloads, gaps or smooth laws only the Newton form is right.

    Parameters
    ----------
    low, high
        The same problem with few and with many harmonics.
    x
        Scaled solution of `low`.
    omega
        Frequency, rad/s.
    measure
        Dofs and harmonics over which the largest relative change is taken.
    solve
        Function from the enlarged Jacobian and right side to the solution, None if there is none; by default LU. The
        published method partitions the system by harmonics, as a Krylov method with factors of each harmonic does.
    form
        ``newton``, or ``published``: eq. 21 as it stands.
    events
        Events of the contacts at the solution, if its evaluation found them (`Step.events`): then contacts are not
        evaluated again.

    Raises
    ------
    InputError
        If the form is unknown.
    """
    check_form(form)
    q = low.coefficients(x)
    padded = high.unknowns(q)
    start = perf_counter()
    stuck = events is not None and events.none
    if form == "newton" and stuck and not drives_missing(low, high):
        return Alert(0.0, 0, 0, padded, 0.0)
    period = high.forces(padded, omega, events)
    seconds = perf_counter() - start
    if form == "newton" and silent(low, high, period):
        return Alert(0.0, 0, 0, padded, seconds)
    at = high.linearise(padded, omega, period)
    right = -at.residual if form == "newton" else _published(high, at.jac, padded, omega)
    change = (solve or solve_array)(at.jac, right)
    if change is None:
        return Alert(np.inf, 0, 0, padded, seconds)
    return led_to(high, q, omega, padded + change, measure, seconds)


def asked_again(
    low: HarmonicBalance,
    high: HarmonicBalance,
    x: FloatArray,
    omega: float,
    first: Alert,
    measure: ErrorMeasure,
    solve: Solve | None = None,
) -> Alert:
    """Evaluate the contacts at the predicted solution, and take one more Newton step from there.

    The first step keeps the contact states of the low-order solution. If they change, its error may be far too small;
    then the residual at ``q + Δq`` and the second step are large. If they stay the same, the second step is of second
    order.

    Parameters
    ----------
    low, high, x, omega, measure, solve
        See `jacobian_alert`.
    first
        Result of `jacobian_alert`.
    """
    q = low.coefficients(x)
    if np.array_equal(first.start, high.unknowns(q)):  # silent, or singular
        return first
    start = perf_counter()
    period = high.forces(first.start, omega)
    seconds = first.seconds_contact + perf_counter() - start
    at = high.linearise(first.start, omega, period)
    change = (solve or solve_array)(at.jac, -at.residual)
    if change is None:
        return replace(first, error=np.inf, seconds_contact=seconds)
    return led_to(high, q, omega, first.start + change, measure, seconds)


def led_to(
    high: HarmonicBalance, q: ComplexArray, omega: float, start: FloatArray, measure: ErrorMeasure, seconds: float
) -> Alert:
    """Return the alert for the change from the low-order coefficients (H+1, n) to the scaled unknowns `start`."""
    before = high.linear.recover(omega, q)
    rows = measure.rows(len(q), high.order + 1)
    change = high.coefficients(start - high.unknowns(q))[:rows]
    error, worst, harmonic = measure.change(before, high.linear.recover_change(omega, change))
    return Alert(error, worst, harmonic, start, seconds)


def solve_array(jac: FloatArray | StructuredJacobian, right: FloatArray) -> FloatArray | None:
    """Solve by LU factors; None if the matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(jac if isinstance(jac, np.ndarray) else jac.dense(), right))
    except np.linalg.LinAlgError:
        return None


def check_form(form: str) -> None:
    """Refuse an unknown form of the prediction."""
    hint = "'newton' is right for every contact law."
    check_choice("JacobianAlert: form", form, get_args(Form), hint)


def _published(
    high: HarmonicBalance, jac: FloatArray | StructuredJacobian, padded: FloatArray, omega: float
) -> FloatArray:
    """Return ``F - J̃ q``, the right side of eq. 21 for Δq."""
    load = high.linear_load(omega).reshape(-1) / high.force_scale
    product = jac @ padded if isinstance(jac, np.ndarray) else jac.matvec(padded)
    return np.asarray(load - product)


def drives_missing(low: HarmonicBalance, high: HarmonicBalance) -> bool:
    """Whether the load acts on a harmonic that `low` leaves out."""
    return any(
        h in high.harmonics and h not in low.harmonics and bool(np.any(force))
        for h, force in high.linear.load.harmonics.items()
    )


def silent(low: HarmonicBalance, high: HarmonicBalance, period: ContactPeriod) -> bool:
    """Whether no force acts on the missing harmonics, so that Δq = 0 without a factorisation.

    In the rows of the low-order problem the enlarged residual is zero; the other rows contain loads and contact forces
    of the missing harmonics.
    """
    if drives_missing(low, high):
        return False
    missing = [place for place, h in enumerate(high.harmonics) if h not in low.harmonics]
    rows = [row for place in missing for row in (2 * place - 1, 2 * place)]
    forces = period.coefficients[rows]
    return bool(np.max(np.abs(forces), initial=0.0) <= SILENCE * high.force_scale)
