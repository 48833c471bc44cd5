"""Bifurcations of a branch against SciPy's integration of the same oscillators, which shares nothing with the package."""

from functools import cache

import numpy as np
import pytest
import scipy.integrate

import stickslip as ss
from stickslip.errors import InputError
from stickslip.response.bifurcations import bifurcations

DAMPING, STOP = 0.05, 10.0  # of a mass that meets a stop ten times as stiff as its spring


def impacting(omega_range, *, highest=15, points=20):
    """Return the response of a mass of 1 kg on a spring of 1 N/m, driven by 1 N, with an elastic stop at rest: problem and points."""
    structure = ss.model.lumped(
        np.ones(1), np.ones((1, 1)), damping=np.array([[2 * DAMPING]]), names=("mass",)
    )
    stop = ss.Interface(
        ("stop",), (ss.UnilateralSpring(k_n=STOP),), np.array([[0.0], [0.0], [1.0]])
    )
    system = ss.System(structure, stop, outputs=structure.sets["mass"])
    load = ss.HarmonicLoad(np.zeros(1), {1: np.ones(1, dtype=complex)})
    sweep = ss.Sweep(
        omega_range=omega_range, low=highest, high=highest, selection="always_high", points=points
    )
    problem = ss.response.forced_problem(system, load, sweep)
    return problem, ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))


@cache
def doubling():
    """Return the response from 2 to 2.6 rad/s and its bifurcations."""
    problem, points = impacting((2.0, 2.6))
    return problem, points, bifurcations(problem, points)


def marched(omega, state, periods=1):
    """Return state and its derivative after some periods, by SciPy, begun anew where the stop is met or left."""

    def rate(stiffness):
        matrix = np.array([[0.0, 1.0], [-stiffness, -2 * DAMPING]])
        return lambda t, y: np.append(
            matrix @ y[:2] + [0.0, np.cos(omega * t)], (matrix @ y[2:].reshape(2, 2)).ravel()
        )

    def crossing(t, y):
        return y[0]

    crossing.terminal = True
    t, y, end = 0.0, np.append(state, [1.0, 0.0, 0.0, 1.0]), 2 * np.pi / omega * periods
    touches = state[0] < 0.0
    while t < end:
        crossing.direction = 1.0 if touches else -1.0
        found = scipy.integrate.solve_ivp(
            rate(1.0 + STOP * touches), (t, end), y, "DOP853", events=crossing, rtol=1e-9, atol=1e-11
        )  # fmt: skip
        t, y, touches = found.t[-1], found.y[:, -1], touches ^ (found.status == 1)
    return y[:2], y[2:].reshape(2, 2)


def periodic(omega, state, periods=1):
    """Return the periodic motion near a state and its derivative, by Newton's method."""
    for _ in range(20):
        after, matrix = marched(omega, state, periods)
        change = np.linalg.solve(matrix - np.eye(2), state - after)
        state = state + change
        if np.abs(change).max() < 1e-7:
            break
    return state, matrix


def start_of(point):
    """Return displacement and velocity of the only mass at t = 0."""
    row = point.coefficients[:, 0]
    return np.array([row.real.sum(), (1j * np.arange(row.size) * point.omega * row).real.sum()])


def test_period_doubling_of_an_impacting_mass_lies_where_scipy_finds_it():
    _, _, all_of_it = doubling()
    (found,) = all_of_it.found
    assert (found.kind, found.multiplicity) == ("period doubling", 1)
    assert found.certain
    state = start_of(found.point)

    def above(omega):
        return float(1.0 + np.linalg.eigvals(periodic(omega, state)[1]).real.min())

    assert found.omega_error < 1e-3
    assert above(found.omega - found.omega_error) > 0.0 > above(found.omega + found.omega_error)
    assert abs(found.multiplier + 1.0) < 1e-4


def test_multipliers_are_asked_for_within_what_is_allowed():
    problem, points, _ = doubling()
    few = bifurcations(problem, points, most=20)
    assert few.examined <= 20
    assert [b.kind for b in few.found] == ["period doubling"] or few.unseen


def test_bad_requests_are_refused():
    problem, points, _ = doubling()
    with pytest.raises(InputError, match="tolerance"):
        bifurcations(problem, points, tolerance=0.0)
    with pytest.raises(InputError, match="most"):
        bifurcations(problem, points, most=3)
