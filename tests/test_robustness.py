"""The cascade on systems drawn at random: everything converges, and what it took is counted."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
import pytest

from evidence.models.random_machines import draw
from stickslip.operators import times
from stickslip.response.continuation.starting_solutions import growing_load, homotopies
from stickslip.response.equilibrium import preload
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.solve.fallbacks import solve_robustly
from stickslip.solve.newton_method import Newton, newton
from stickslip.solve.status import Rung, Status

SEED = 1


def prepared(number, share=0.4):
    """A drawn system with many harmonics, a frequency inside its range, and its static equilibrium."""
    drawn = draw(SEED, number)
    problem = forced_problem(drawn.system, drawn.load, drawn.sweep)
    first, last = drawn.sweep.omega_range
    static = preload(drawn.system, drawn.load.static)
    return problem, first + share * (last - first), static


def residual_norm(balance, x, omega):
    return np.max(np.abs(balance.linearise(x, omega).residual))


@pytest.mark.parametrize(
    "number", [pytest.param(3, marks=pytest.mark.validation), 12, pytest.param(33, marks=pytest.mark.validation)]
)
def test_a_drawn_system_converges(number):
    drawn = draw(SEED, number)
    points = accepted_points(list(forced_response(drawn.system, drawn.load, drawn.sweep)))
    assert all(p.converged for p in points)
    problem = forced_problem(drawn.system, drawn.load, drawn.sweep)
    for p in points:
        balance = problem.balance(p.support)
        norm = residual_norm(balance, balance.unknowns(p.coefficients), p.omega)
        # once more through metres and back: rounding
        assert norm <= 1.1 * drawn.sweep.newton.tolerance
    counted = Counter(p.rescue for p in points)
    assert set(counted) <= set(Rung)
    assert counted[Rung.FULL_STEPS] > len(points) / 2


@pytest.mark.parametrize("number", [33, 12, 20])
def test_the_load_grows_to_the_whole_through_folds(number):
    problem, omega, static = prepared(number)
    balance = problem.high

    def evaluate(x):
        # not finite at the start: only a homotopy can help
        at = balance.linearise(x, omega)
        return at if np.any(x) else replace(at, residual=np.full(x.size, np.nan))

    ways = list(homotopies(balance, omega, static))
    weights = problem.following(balance).weights
    solution = solve_robustly(evaluate, [np.zeros(balance.size)], problem.sweep.newton, ways[:1], weights)
    assert solution.status is Status.CONVERGED
    assert solution.rung is Rung.HOMOTOPY
    assert residual_norm(balance, solution.x, omega) <= problem.sweep.newton.tolerance


def test_the_higher_harmonics_join_a_balance_of_the_driven_ones():
    problem, omega, static = prepared(33)
    balance = problem.high
    (way,) = homotopies(balance, omega, static)
    growing, joining = way.legs
    rng = np.random.default_rng(1)
    x = balance.unknowns(static[None].astype(complex))
    x = x + np.max(np.abs(x)) * rng.normal(size=x.size)
    # where the load is whole the harmonics begin to join, and in the end all of them have
    np.testing.assert_allclose(growing.linearise(x, 1.0).residual, joining.linearise(x, 0.0).residual, rtol=1e-12)
    np.testing.assert_allclose(joining.linearise(x, 1.0).residual, balance.linearise(x, omega).residual, rtol=1e-12)
    # linear in the share, and its derivative by the unknowns is that of the residual
    at, step = joining.linearise(x, 0.3), 1e-6 * np.max(np.abs(x)) * rng.normal(size=x.size)
    change = joining.linearise(x, 1.0).residual - joining.linearise(x, 0.0).residual
    np.testing.assert_allclose(at.jac_p, change, rtol=0, atol=1e-10 * np.max(np.abs(change)))
    moved = [joining.linearise(x + s * step, 0.3).residual for s in (1.0, -1.0)]
    slope = 0.5 * (moved[0] - moved[1])
    np.testing.assert_allclose(times(at.jac, step), slope, rtol=0, atol=1e-4 * np.max(np.abs(slope)))


def test_a_point_without_a_solution_ends_within_its_budget():
    # a residual that no unknowns make zero: x² + 1, in as many equations as a point of 60 unknowns has
    counted = Counter()

    @dataclass(frozen=True)
    class At:
        residual: np.ndarray
        jac: np.ndarray
        seconds_contact: float = 0.0

    def rootless(x):
        counted["evaluations"] += 1
        return At(x**2 + 1.0, np.diag(2.0 * x))

    solution = solve_robustly(rootless, [np.linspace(0.5, 1.5, 60)], Newton())
    assert not solution.status.converged
    assert 0 < solution.iterations <= 300
    assert counted["evaluations"] < 10_000


def test_the_whole_load_is_the_balance_and_none_is_rest():
    problem, omega, static = prepared(33)
    balance = problem.high
    growing = growing_load(balance, omega)
    x = balance.unknowns(static[None].astype(complex))
    whole, none = growing.linearise(x, 1.0), growing.linearise(x, 0.0)
    assert np.array_equal(whole.residual, balance.linearise(x, omega).residual)
    assert np.allclose(none.residual - whole.residual, -whole.jac_p, rtol=0, atol=1e-12)
    at_rest = newton(lambda v: growing.linearise(v, 0.0), x, Newton())
    assert at_rest.status is Status.CONVERGED
    assert np.allclose(balance.coefficients(at_rest.x)[1:], 0.0)
