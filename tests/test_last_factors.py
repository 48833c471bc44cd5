"""The factors of the last Newton step in place of those of the solution."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.solve import chord_newton
from stickslip.solve.branch import Latest, tangent_at, upward
from stickslip.solve.chord_newton import LastFactors
from stickslip.solve.continuation import Following, StepControl, start_point, trace
from stickslip.solve.krylov import Automatic, Krylov
from stickslip.solve.linear import Dense
from stickslip.solve.newton_method import Newton, newton

MATRIX = np.array([[3.0, 1.0], [0.5, 2.0]])
CONTROL = StepControl(scale=1.0, first=0.05, largest=0.05)
FOLLOWING = Following(newton=Newton(tolerance=1e-12), control=CONTROL, weights=np.ones(2))


@dataclass(frozen=True, eq=False)
class At:
    """An evaluation that counts how often its Jacobian is asked for."""

    residual: np.ndarray
    own: np.ndarray
    jac_p: np.ndarray
    asked: list
    seconds_contact: float = 0.0

    @property
    def jac(self):
        self.asked.append(1)
        return np.array(self.own, order="F")


@dataclass(frozen=True, eq=False)
class Springs:
    """Two springs, the first of which hardens by `bend` and is stiffer by `kink` beyond 1."""

    bend: float = 0.0
    kink: float = 0.0
    asked: list = field(default_factory=list)

    def linearise(self, x, p):
        beyond = max(x[0] - 1.0, 0.0)
        force = MATRIX @ x + np.array([self.kink * beyond + self.bend * x[0] ** 3, 0.0])
        jac = MATRIX.copy()
        jac[0, 0] += self.kink * (beyond > 0.0) + 3.0 * self.bend * x[0] ** 2
        return At(force - np.array([p, 1.0]), jac, np.array([-1.0, 0.0]), self.asked)


@pytest.mark.parametrize("bend", [0.0, 0.01])
def test_first_tangent_is_that_of_the_solution(bend):
    springs = Springs(bend)
    point = start_point(springs, np.array([0.4, 0.3]), 2.0, FOLLOWING)
    expected, sign = tangent_at(springs, point.y, upward(3), FOLLOWING)
    np.testing.assert_allclose(point.tangent, expected, rtol=1e-6)
    assert point.orientation == sign == 1.0


def test_linear_start_asks_for_one_jacobian():
    springs = Springs()
    point = start_point(springs, np.array([0.4, 0.3]), 2.0, FOLLOWING)
    assert point.solution.iterations == len(springs.asked) == 1


def test_most_tangents_of_a_branch_cost_no_jacobian():
    """On both sides of a kink they come from the last Newton step, and are those of the side."""
    springs = Springs(bend=0.05, kink=5.0)
    start = start_point(springs, np.zeros(2), 0.0, FOLLOWING)
    springs.asked.clear()
    points = list(trace(springs, start, 6.0, FOLLOWING))
    steps = sum(p.solution.iterations for p in points)
    assert len(springs.asked) < steps + 0.2 * len(points)
    assert points[0].x[0] < 1.0 < points[-1].x[0]
    for point in points:
        expected, _ = tangent_at(springs, point.y, point.tangent, FOLLOWING)
        np.testing.assert_allclose(point.tangent, expected, atol=1e-5)


def test_factors_are_not_those_of_a_solution_far_from_them():
    """A step that leaves a hundredth of the residual ended where the Jacobian is another one."""
    springs = Springs(bend=0.3)
    latest, factors = Latest(springs), LastFactors(Dense())
    solution = newton(lambda v: latest.linearise(v, 3.0), np.zeros(2), Newton(tolerance=0.05), linear=factors)
    assert solution.status.converged
    assert solution.residual_norm > 1e-3 * np.abs(factors.residual).max()
    assert factors.at(solution) is None


def test_another_solver_stays_in_charge():
    factors = LastFactors(Krylov())
    with pytest.raises(InputError, match="Give Dense for an array"):
        factors.solve(MATRIX, np.ones(2))
    assert factors.inverse is None


@pytest.mark.parametrize("bordered", [False, True])
def test_factors_do_not_outlive_a_later_step_by_products(monkeypatch, bordered):
    """What a system costs depends on its contacts: one step may be factorised, and the next one not."""
    factors, right = LastFactors(Automatic()), np.ones(2)
    factors.solve(MATRIX.copy(order="F"), right)
    assert factors.inverse is not None
    monkeypatch.setattr(chord_newton, "is_factorised", lambda _: False)
    if bordered:
        factors.solve_bordered(2.0 * MATRIX, right, right, 1.0, np.ones(3))
    else:
        factors.solve(2.0 * MATRIX, right)
    near = newton(lambda v: Springs().linearise(v, 2.0), np.zeros(2), Newton(tolerance=1e-12))
    assert near.status.converged
    assert factors.at(near) is None
