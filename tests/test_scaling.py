"""Contacts far stiffer or softer than the structure, and other units, change what physics says and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from evidence.models.lumped import blades_and_damper, griffin
from stickslip.response.forced.response import Sweep, accepted_points, forced_problem, forced_response
from stickslip.solve.iterate import MAX_ROUNDING_RESIDUAL
from stickslip.solve.newton_method import GLOBALISATIONS, Newton, newton
from stickslip.solve.status import Status


def with_stiffness(system, factor):
    """Contacts whose springs are `factor` times as stiff."""
    laws = tuple(
        replace(law, k_t=factor * law.k_t, k_w=factor * law.k_w, k_n=factor * law.k_n) for law in system.interface.laws
    )
    return replace(system, interface=replace(system.interface, laws=laws))


AT = (500.0, 520.0, 533.0, 534.5, 536.0, 560.0)  # rad/s, about the resonance of blades that stick together


def amplitudes(system, load, **options):
    """Of the first output at the frequencies `AT`, all of them found."""
    sweep = Sweep(omega_range=(AT[0], AT[-1]), at=AT, peak_points=0, **options)
    problem = forced_problem(system, load, sweep)
    points = accepted_points(list(forced_response(system, load, sweep)))
    assert all(p.converged for p in points)
    assert tuple(p.omega for p in points) == AT
    return np.array([problem.amplitude(p) for p in points])


@pytest.mark.parametrize("factor", [1e7, 1e8, 1e9])
def test_two_blades_with_stiff_contacts_tend_to_the_rigid_limit(factor):
    system, load = blades_and_damper(m=None)
    thousand, ten_thousand, found = (amplitudes(with_stiffness(system, f), load) for f in (1e3, 1e4, factor))
    # beside a rigid contact a spring gives way in proportion to 1/factor, which extrapolates
    rigid = ten_thousand + (ten_thousand - thousand) / 9.0
    np.testing.assert_allclose(found, rigid, rtol=1e-6)
    assert np.max(np.abs(thousand / rigid - 1.0)) > 1e-5


@pytest.mark.parametrize("factor", [1e7, 1e8, 1e9])
def test_a_blade_that_slips_is_solved_to_the_last_digits(factor):
    system, load = griffin(0.05)
    omega, guess = 0.95, None
    for stiffness in (1.0, 1e2, 1e4, 1e6, factor):
        problem = forced_problem(with_stiffness(system, stiffness), load, Sweep(omega_range=(0.9, 1.1), low=5, high=5))
        x = np.zeros(problem.low.size) if guess is None else problem.low.unknowns(guess)
        before = guess
        found = newton(lambda v, b=problem.low: b.linearise(v, omega), x, Newton(max_iterations=60))
        assert found.status.converged
        guess = problem.low.coefficients(found.x)
    # a millionth of the stiffness turns round later by its root
    assert np.max(np.abs(guess - before)) < 1e-3 * np.max(np.abs(guess))
    assert found.residual_norm < 1e-15 * factor * np.max(np.abs(guess)) / 0.1


def test_soft_contacts_are_none():
    system, load = griffin(1e3)
    omega = 1.01
    exact = 0.1 / abs(1.0 - omega**2 + 0.02j * omega)
    problem = forced_problem(with_stiffness(system, 1e-6), load, Sweep(omega_range=(0.9, 1.1)))
    b = problem.low
    found = newton(lambda v: b.linearise(v, omega), np.zeros(b.size), Newton())
    assert found.status.converged
    assert abs(b.coefficients(found.x)[1, 0]) == pytest.approx(exact, rel=2e-5)


@pytest.mark.kernel
@pytest.mark.parametrize("factor", [1e-6, 1.0, 1e8])
def test_units_change_nothing(factor):
    # metres and newtons, millimetres and kilonewtons, and units of no sense
    answers = []
    for length, force in ((1.0, 1.0), (1e-3, 1e3), (1e5, 1e-7)):
        system, load = blades_and_damper(m=None, length=length, force=force)
        answers.append(length * amplitudes(with_stiffness(system, factor), load))
    np.testing.assert_allclose(answers[1:], [answers[0]] * 2, rtol=1e-7)


class At:
    """What a corrector asks for."""

    def __init__(self, residual, jac):
        self.residual, self.jac, self.seconds_contact = residual, np.asfortranarray(jac), 0.0


@pytest.mark.parametrize("globalisation", ["line_search", "dogleg"])
def test_a_residual_that_only_rounding_leaves_is_a_solution(globalisation):
    # a stiff spring between two points that move far: k (x1 - x2) cannot fall below k eps |x|
    k, stiffness = 1e9, np.array([[1.0, 0.0], [0.0, 2.0]])
    whole = stiffness + k * np.array([[1.0, -1.0], [-1.0, 1.0]])

    def evaluate(x):
        force = k * (x[0] - x[1])
        return At(stiffness @ x + np.array([force - 100.0 / 3.0, -force]), whole.copy())

    found = newton(evaluate, np.zeros(2), Newton(globalisation=globalisation))
    assert found.status is Status.CONVERGED
    assert 1e-10 < found.residual_norm < 1e-5
    np.testing.assert_allclose(found.x, 100.0 / 9.0, rtol=1e-7)


@pytest.mark.parametrize("globalisation", GLOBALISATIONS)
def test_a_residual_that_is_no_rounding_is_none(globalisation):
    # a minimum above zero, below what may be called rounding
    height = 0.1 * MAX_ROUNDING_RESIDUAL

    def evaluate(x):
        return At(x**2 + height, np.diag(2.0 * x))

    found = newton(evaluate, np.array([1.0]), Newton(globalisation=globalisation))
    assert not found.status.converged
