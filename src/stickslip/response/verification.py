"""Check of the harmonics: predicted change with a judging set (Gastaldi & Berruti 2017, section 6).

The contribution of each missing harmonic to the outputs is the criterion of `GoalOriented`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import InputError, input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import Harmonics, harmonics_of
from stickslip.harmonic.judging import (
    SAMPLES_A_HARMONIC,
    UNSEEN,
    covers,
    judging_balance,
    judging_set,
    judging_set_of,
    ringing,
)
from stickslip.harmonic.selection.adjoint import Goal, contributions, estimate, outputs_of
from stickslip.harmonic.selection.alert import Alert, asked_again, jacobian_alert, led_to
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, with_stiffness
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.newton_method import newton

MAX_ROWS = 2000  # largest system that is solved if two predictions differ,
MAX_ITERATIONS = 15  # and its largest number of Newton iterations
SAME_RTOL = 0.02  # relative difference up to which two predictions agree


@dataclass(frozen=True, slots=True)
class SupportCheck:
    """Predicted change of a solved point by further harmonics.

    Attributes
    ----------
    omega
        Frequency, rad/s.
    kept, harmonics
        Harmonics of the point and of the comparison.
    error
        Predicted relative change, a fraction; infinite if the enlarged Jacobian is singular.
    harmonic
        The harmonic with this change.
    dof, label
        The dof with this change, and its name.
    seconds_contact
        Time of the contact evaluations, s.
    """

    omega: float
    kept: Harmonics
    harmonics: Harmonics
    error: float
    harmonic: int
    dof: int
    label: str
    seconds_contact: float


@by_one_thread
def check_support(problem: ForcedProblem, points: Sequence[ForcedPoint], factor: int = 2) -> tuple[SupportCheck, ...]:
    """Predict the change of every solved point by more harmonics.

    These are all up to a multiple of the reference order, and the judging set.

    Each point takes two Newton steps: two contact evaluations and two linear solutions. The first step keeps the
    contact states of the point; the second uses the states after the first. If the two predictions differ by more than
    2 %, the motion is solved with these harmonics (up to `MAX_ROWS`). If this fails, the second prediction serves as a
    warning, which is usually too large and is no bound. Harmonics that the reference omits, such as even ones, are part
    of the comparison.

    Parameters
    ----------
    problem
        The forced response (`forced_problem`).
    points
        Points of the response (`accepted_points`) with the reference harmonics or fewer; points that did not converge
        are skipped.
    factor
        Highest harmonic of the check over the highest of the reference, at least 2.

    Returns
    -------
    tuple of SupportCheck
        One for each converged point, in their order. ``max(checks, key=lambda c: c.error)`` is the worst.

    Raises
    ------
    InputError
        If `factor` is below 2, or a tuned wheel has too few waves.
    """
    if factor != int(factor) or factor < 2:
        raise input_error(
            "check_support: factor",
            f"must be an integer of at least 2, got {factor!r}",
            "2 asks for at least twice as many harmonics as the reference has.",
        )
    enlarged = _enlarged(problem, int(factor))
    return tuple(_check(problem, enlarged, point) for point in points if point.converged)


def own_error(problem: ForcedProblem, point: ForcedPoint) -> float:
    """Return the predicted relative change of a solution by its judging set.

    It comes from the continuation or from Newton steps.

    For a motion found by shooting, return the estimated error of the time step.

    Parameters
    ----------
    problem
        The forced response.
    point
        One of its points.

    Returns
    -------
    float
        A fraction; 0 without forces on these harmonics; NaN if unknown, or for a point that did not converge.
    """
    if not point.converged:
        return float("nan")
    if point.shot:
        return point.shot[0].error
    # in the published passages, a strategy ignores harmonics beyond its reference
    fed = judging_set(point.support, problem.driven)
    looked = problem.sweep.auto or set(fed) <= set(problem.high.harmonics)
    if problem.strategy.verifies and looked and not np.isnan(point.predicted_error):
        return point.predicted_error
    if problem.system.interface.rigid:
        return float("nan")
    if point not in problem.own_errors:
        problem.own_errors[point] = _predicted(problem, point)
    return problem.own_errors[point]


def _predicted(problem: ForcedProblem, point: ForcedPoint) -> float:
    """Predict the relative change of a solution by its judging set with Newton steps; see `own_error`."""
    own = with_stiffness(problem.balance(point.support))
    x = own.unknowns(point.coefficients)
    wide = with_waves(problem, own, judging_set_of(own)[-1])
    more = judging_balance(wide, ringing(wide, x, point.omega))
    if more.harmonics == own.harmonics:
        return float("nan")  # the wheel has no further waves
    found = _led_on(problem, own, more, x, point.omega)
    known = covers(own, more) and point.by_dof is None
    return found.error if known else max(found.error, UNSEEN)


def _led_on(problem: ForcedProblem, low: HarmonicBalance, high: HarmonicBalance, x: FloatArray, omega: float) -> Alert:
    """Return the error predicted by two Newton steps with more harmonics.

    If they disagree, Newton's method is used.
    """
    first = jacobian_alert(low, high, x, omega, problem.measure, problem.alert_solve)
    second = asked_again(low, high, x, omega, first, problem.measure, problem.alert_solve)
    if abs(second.error - first.error) <= SAME_RTOL * second.error or high.size > MAX_ROWS:
        return second
    q, few = low.coefficients(x), replace(problem.sweep.newton, max_iterations=MAX_ITERATIONS)
    found = newton(lambda v: high.linearise(v, omega), high.unknowns(q), few, NaturalLevel())
    if not found.status.converged:
        return second
    return led_to(high, q, omega, found.x, problem.measure, second.seconds_contact + found.seconds_contact)


def with_waves(problem: ForcedProblem, own: HarmonicBalance, top: int) -> HarmonicBalance:
    """Return a problem condensed for harmonics up to `top` if the wheel has the waves, otherwise the problem itself."""
    most = own.linear.most
    if most is None or most >= top:
        return own
    try:
        wide = problem.system.condensed(own.linear.load, top)
        known = wide.most  # along an engine-order line, waves are condensed when first needed
    except InputError:
        return own
    return replace(own, linear=wide) if known is None or known > most else own


def _enlarged(problem: ForcedProblem, factor: int) -> HarmonicBalance:
    """Return the enlarged problem with enough samples.

    It has all harmonics up to `factor` times the reference order, and its judging set.

    The waves of a wheel limit the judging set.
    """
    high = with_stiffness(problem.high)
    wanted, fed = harmonics_of(factor * high.order), judging_set_of(high)
    most = with_waves(problem, high, max(wanted[-1], fed[-1])).linear.most
    harmonics = tuple(sorted({*wanted, *(h for h in fed if most is None or h <= most)}))
    linear = problem.system.condensed(high.linear.load, harmonics[-1])
    samples = max(high.samples, SAMPLES_A_HARMONIC * harmonics[-1])
    return replace(high, linear=linear, samples=samples).with_harmonics(harmonics)


def _check(problem: ForcedProblem, enlarged: HarmonicBalance, point: ForcedPoint) -> SupportCheck:
    own = with_stiffness(problem.balance(point.support))
    alert = _led_on(problem, own, enlarged, own.unknowns(point.coefficients), point.omega)
    dof = int(problem.measure.dofs[alert.worst])
    return SupportCheck(
        point.omega,
        point.support,
        enlarged.harmonics,
        alert.error,
        alert.harmonic,
        dof,
        problem.system.structure.dofs.labels[dof],
        alert.seconds_contact,
    )


@dataclass(frozen=True, eq=False)
class HarmonicContributions:
    """Relative changes of outputs by missing harmonics, with one row for each output and one column for each harmonic.

    Attributes
    ----------
    omega
        Frequency, rad/s.
    kept, missing
        Harmonics of the point, and missing harmonics of the reference.
    harmonics, dofs
        (k,) harmonic and dof of each output; outputs that hardly move are omitted.
    labels
        k names of the dofs.
    parts
        (k, n_missing) relative change of the output by each missing harmonic: to first order, the real part is the
        relative change of the amplitude, and the imaginary part the change of the phase, rad. The sum over a row is the
        estimated change. Infinite if the Jacobian is singular.
    bound
        Largest expected relative change of any output, at least the prediction of the Jacobian Alert.
    """

    omega: float
    kept: Harmonics
    missing: Harmonics
    harmonics: IntArray
    dofs: IntArray
    labels: tuple[str, ...]
    parts: ComplexArray
    bound: float


def harmonic_contributions(problem: ForcedProblem, point: ForcedPoint, goal: Goal = "motion") -> HarmonicContributions:
    """Estimate the change of the outputs at a solved point by each missing harmonic of the reference.

    The residuals of the missing harmonics are weighted by the adjoints of the outputs (Becker & Rannacher 2001, section
    2), with the mean Jacobian of two or three evaluations with all harmonics and without iteration.

    Parameters
    ----------
    problem
        The forced response (`forced_problem`) with the reference harmonics of ``Sweep.high``.
    point
        A converged point of the response.
    goal
        Measure of the change: ``motion``, amplitude and phase; or ``amplitude``, its real part only.

    Returns
    -------
    HarmonicContributions
        Contributions; no columns if the point has all harmonics of the reference.

    Raises
    ------
    InputError
        If the point is not a solution.
    """
    if not point.converged:
        raise input_error(
            "harmonic_contributions: point",
            f"at {point.omega:g} rad/s is not a solution, its status is {point.status.name}",
            "Give one of accepted_points(...) that converged.",
        )
    own, high = (with_stiffness(b) for b in (problem.balance(point.support), problem.high))
    x = own.unknowns(point.coefficients)
    outputs = outputs_of(problem.measure, own.linear.recover(point.omega, point.coefficients), goal)
    missing = tuple(h for h in high.harmonics if h not in own.harmonics)
    parts, bound = np.zeros((outputs.dofs.size, len(missing)), dtype=complex), 0.0
    if missing:
        found = estimate(own, high, x, point.omega, outputs, problem.alert_solve)
        bound = found.bound
        singular = found.mean is None and bound > 0.0
        parts = (
            np.full(parts.shape, complex(np.inf)) if singular else contributions(own, high, point.omega, outputs, found)
        )
    names = problem.system.structure.dofs.labels
    labels = tuple(names[dof] for dof in outputs.dofs)
    return HarmonicContributions(
        point.omega, own.harmonics, missing, outputs.harmonics, outputs.dofs, labels, parts, bound
    )
