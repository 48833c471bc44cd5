"""Newton's method: its rate, each way in which it ends, and the dense solver."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest

from stickslip.solve.linear import solve_dense
from stickslip.solve.newton_method import MAX_STEPS_TO_HALVE, Newton, newton
from stickslip.solve.status import Status

pytestmark = pytest.mark.kernel


@dataclass(frozen=True, eq=False)
class At:
    residual: np.ndarray
    jac: np.ndarray
    seconds_contact: float = 0.25


def scalar(f, slope):
    return lambda x: At(np.array([f(x[0])]), np.array([[slope(x[0])]], order="F"))


def counted(evaluate):
    calls = []

    def wrapped(x):
        calls.append(x.copy())
        return evaluate(x)

    return wrapped, calls


def smooth(x):
    """A smooth system with the solution (1, 2, 3)."""
    a = np.array([[4.0, 1, 0], [1, 5, 2], [0, 2, 6]])
    goal = np.array([1.0, 2, 3])
    return At(a @ x + np.sin(x) - a @ goal - np.sin(goal), np.asfortranarray(a + np.diag(np.cos(x))))


def test_convergence_is_quadratic():
    wrapped, calls = counted(smooth)
    solution = newton(wrapped, np.array([0.5, 2.5, 2.0]), Newton(tolerance=1e-14))
    assert solution.status is Status.CONVERGED
    assert np.allclose(solution.x, [1, 2, 3], atol=1e-13)
    errors = [np.max(np.abs(x - [1, 2, 3])) for x in calls]
    assert solution.iterations <= 6
    # e_{k+1} <= C e_k² with C ~ |f''| / (2 |f'|) < 1 here, until rounding
    for before, after in pairwise(errors):
        assert after <= max(before**2, 1e-14)


def test_linear_problem_takes_one_step():
    solution = newton(lambda x: At(3 * x - 6, 3 * np.eye(2, order="F")), np.zeros(2), Newton())
    assert solution.iterations == 1
    assert np.allclose(solution.x, 2.0, atol=1e-14)


def test_a_solution_is_recognised_at_once():
    solution = newton(smooth, np.array([1.0, 2, 3]), Newton())
    assert (solution.status, solution.iterations) == (Status.CONVERGED, 0)
    assert solution.seconds_contact == 0.25


def test_time_in_contacts_is_that_of_all_evaluations():
    wrapped, calls = counted(smooth)
    solution = newton(wrapped, np.array([0.5, 2.5, 2.0]), Newton())
    assert solution.seconds_contact == pytest.approx(0.25 * len(calls))


def test_line_search_saves_what_full_steps_lose():
    # arctan: full Newton steps diverge from |x| > 1.39
    wrapped, calls = counted(scalar(np.arctan, lambda x: 1 / (1 + x * x)))
    solution = newton(wrapped, np.array([3.0]), Newton())
    assert solution.status is Status.CONVERGED
    assert solution.x[0] == pytest.approx(0.0, abs=1e-10)
    assert len(calls) <= 25 * 7 + 1


def test_a_kink_is_no_obstacle():
    # piecewise linear: slope 1 below, 10 above; semi-smooth Newton is finite
    solution = newton(
        scalar(lambda x: x - 2 if x < 0 else 10 * x - 2, lambda x: 1.0 if x < 0 else 10.0), np.array([-5.0]), Newton()
    )
    assert solution.status is Status.CONVERGED
    assert solution.iterations <= 3


def test_too_many_iterations():
    # a triple root: linear rate 2/3, so that 5 steps are not enough
    solution = newton(scalar(lambda x: x**3, lambda x: 3 * x**2), np.array([1.0]), Newton(max_iterations=5))
    assert (solution.status, solution.iterations) == (Status.TOO_MANY_ITERATIONS, 5)
    assert solution.x[0] == pytest.approx((2 / 3) ** 5)


@pytest.mark.parametrize(("power", "patient"), [(0.6, True), (0.52, False)])
def test_a_start_near_a_solution_is_given_up_where_the_residual_is_not_halved(power, patient):
    # |x|^p: each Newton step takes x to (1 - 1/p) x, so that the residual is halved in 3 steps (p = 0.6) or in 17 (p = 0.52)
    slow = scalar(lambda x: np.sign(x) * abs(x) ** power, lambda x: power * abs(x) ** (power - 1.0))
    options = Newton(max_iterations=500, tolerance=1e-6)
    whole, near = (newton(slow, np.array([1.0]), own) for own in (options, options.near))
    assert whole.status is Status.CONVERGED
    assert near.iterations == (whole.iterations if patient else MAX_STEPS_TO_HALVE)
    assert near.status is (Status.CONVERGED if patient else Status.STALLED)


def test_stalled_where_no_step_helps():
    # |x| + 1 has no root: at its kink every Newton step goes up
    solution = newton(scalar(lambda x: abs(x) + 1, lambda _: 1e-3), np.array([0.0]), Newton())
    assert solution.status is Status.STALLED
    assert solution.residual_norm == 1.0
    assert solution.x[0] == 0.0


def test_singular_jacobian():
    solution = newton(lambda x: At(x - 1, np.ones((2, 2), order="F")), np.zeros(2), Newton())
    assert (solution.status, solution.iterations) == (Status.SINGULAR, 0)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_not_finite(bad):
    solution = newton(lambda x: At(np.array([bad, 0.0]), np.eye(2, order="F")), np.zeros(2), Newton())
    assert solution.status is Status.NOT_FINITE


def test_a_step_into_nan_is_shortened():
    # sqrt is NaN beyond zero: the full step from x = 0.1 leaves the domain, half of it does not
    with np.errstate(invalid="ignore"):
        solution = newton(scalar(lambda x: np.sqrt(x) - 1.5, lambda x: 0.5 / np.sqrt(x)), np.array([30.0]), Newton())
    assert solution.status is Status.CONVERGED
    assert solution.x[0] == pytest.approx(2.25)


def test_the_number_of_evaluations_is_bounded():
    rng = np.random.default_rng(0)

    def nonsense(x):
        return At(rng.standard_normal(4), np.asfortranarray(rng.standard_normal((4, 4))))

    wrapped, calls = counted(nonsense)
    solution = newton(wrapped, np.zeros(4), Newton(max_iterations=10))
    assert solution.status in (Status.TOO_MANY_ITERATIONS, Status.STALLED)
    assert len(calls) <= 1 + 10 * (7 + 31), "seven shares of a step, then thirty-one towards a kink"


def test_each_status_has_advice():
    assert [s.converged for s in Status] == [s is Status.CONVERGED for s in Status]
    assert len({s.advice for s in Status}) == len(Status)


# ---- dense solver -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", ["C", "F"])
def test_solve_dense(order):
    rng = np.random.default_rng(2)
    matrix = rng.standard_normal((6, 6))
    right = rng.standard_normal(6)
    got = solve_dense(np.array(matrix, order=order), right.copy())
    assert np.allclose(matrix @ got, right, atol=1e-12)


@pytest.mark.parametrize(
    "matrix",
    [
        np.zeros((2, 2)),
        np.ones((3, 3)),
        np.diag([1.0, 0.0]),
        np.array([[1.0, np.nan], [0.0, 1.0]]),
        np.diag([1.0, 1e-17]),
    ],
    ids=["zero", "rank one", "zero row", "NaN", "below working precision"],
)
def test_solve_dense_says_when_there_is_no_inverse(matrix):
    assert solve_dense(np.asfortranarray(matrix), np.ones(len(matrix))) is None
