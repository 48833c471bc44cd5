"""Check of the harmonics: prediction from a solution to a judging set (Gastaldi & Berruti 2017, section 6).

The contribution of each missing harmonic to the outputs is the term by which `GoalOriented` chooses.
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

MAX_ROWS = 2000  # of a system that is solved where two steps say different things,
MAX_ITERATIONS = 15  # of Newton's method there
SAME_RTOL = 0.02  # difference of what two steps say, with which they say the same


@dataclass(frozen=True, slots=True)
class SupportCheck:
    """Predicted change of a solved point by further harmonics.

    Attributes
    ----------
    omega
        Frequency, rad/s.
    kept, harmonics
        Harmonics of the point, and those of the comparison.
    error
        Predicted relative change, a fraction; infinite where the enlarged Jacobian is singular.
    harmonic
        The harmonic with that change.
    dof, label
        The dof with that change, and its name.
    seconds_contact
        Time of the contact evaluations.
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
    """Predict the change of every solved point by all harmonics up to a multiple of the reference order, and by its judging set.

    Two Newton steps a point: two contact evaluations and two linear solutions. The first keeps the contact states of the point; the second asks the
    contacts where the first leads. Where it changes what is predicted by more than a fiftieth, the motion is solved with these harmonics (up to `MAX_ROWS`); where that
    fails, the second step is a warning and no bound, as a rule too large. Harmonics that the reference leaves out, such as the even ones, are among those that it is held against.

    Parameters
    ----------
    problem
        The forced response (`forced_problem`).
    points
        Points of the response (`accepted_points`), with the reference support or fewer harmonics; those without a solution
        are passed over.
    factor
        Highest harmonic of the check over that of the reference, at least 2.

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
    """Return the predicted relative change of a solution by its judging set: the estimate from the continuation, otherwise from Newton steps.

    For a motion found by shooting it is the estimated error of the time step.

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
    # in the published passages a strategy looks at nothing beyond its reference
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
    """Predict by Newton steps the relative change of a solution by the harmonics of its judging set; see `own_error`."""
    own = with_stiffness(problem.balance(point.support))
    x = own.unknowns(point.coefficients)
    wide = with_waves(problem, own, judging_set_of(own)[-1])
    more = judging_balance(wide, ringing(wide, x, point.omega))
    if more.harmonics == own.harmonics:
        return float("nan")  # the wheel has no more waves
    found = _led_on(problem, own, more, x, point.omega)
    known = covers(own, more) and point.by_dof is None
    return found.error if known else max(found.error, UNSEEN)


def _led_on(problem: ForcedProblem, low: HarmonicBalance, high: HarmonicBalance, x: FloatArray, omega: float) -> Alert:
    """Return the error predicted by two Newton steps with more harmonics; where they disagree, Newton's method continues."""
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
    """Return a problem condensed for harmonics up to `top`, if the wheel has the waves; else the problem itself."""
    most = own.linear.most
    if most is None or most >= top:
        return own
    try:
        wide = problem.system.condensed(own.linear.load, top)
        known = wide.most  # along an engine-order line the waves are condensed when first asked for
    except InputError:
        return own
    return replace(own, linear=wide) if known is None or known > most else own


def _enlarged(problem: ForcedProblem, factor: int) -> HarmonicBalance:
    """Return the problem with all harmonics up to `factor` times the reference order and its judging set (limited by the waves of a wheel), with enough samples."""
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
    """Relative changes of outputs by the harmonics that a solution lacks, one row an output and one column a harmonic.

    Attributes
    ----------
    omega
        Frequency, rad/s.
    kept, missing
        Harmonics of the point, and those of the reference that it lacks.
    harmonics, dofs
        (k,) what the outputs are: a harmonic of a dof each; those that hardly move are left out.
    labels
        k names of the dofs.
    parts
        (k, n_missing) change of the output by each missing harmonic over the output itself: the real part is, to first order,
        the relative change of the amplitude, the imaginary part that of the phase in rad. The sum over a row is the estimated
        change. Infinite where the Jacobian is singular.
    bound
        Largest relative change that is to be expected of any output; never below the prediction of the Jacobian Alert.
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

    Residuals of the missing harmonics weighted by the adjoints of the outputs (Becker & Rannacher 2001, section 2), with the
    mean Jacobian of two or three evaluations with all harmonics; nothing is iterated.

    Parameters
    ----------
    problem
        The forced response (`forced_problem`); its reference harmonics are those of ``Sweep.high``.
    point
        A converged point of the response.
    goal
        Measure of the change: ``motion``, amplitude and phase; or ``amplitude``, its real part only.

    Returns
    -------
    HarmonicContributions
        Without columns where the point has all harmonics of the reference.

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
