"""Harmonics of each coordinate (Maple, Grolet; Gastaldi & Berruti 2017, section 4.5.2.1), against the plain twin of `test_rivals`."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from test_rivals import HZ, ORDER, errors, jacobian, residual, response, rows_of_step, step_at

import stickslip as ss
from evidence.models.lumped import blades_and_damper
from stickslip.harmonic.harmonic_set import joined, kept_by_dof, of_all, supports_of
from stickslip.harmonic.harmonics_per_dof import LocalBalance
from stickslip.harmonic.selection.grolet import Grolet
from stickslip.harmonic.selection.maple import Maple
from stickslip.harmonic.selection.strategy import Verdict
from stickslip.response.forced.passages import _more
from stickslip.response.forced.response import forced_problem, forced_response
from stickslip.solve.newton_method import Newton, newton

OWN = ((0, 1), (0, 1, 2, 3), (0, 1, 3), (0, 1), tuple(range(ORDER + 1)), (0, 1, 2, 4, 5))


def local_at(hertz=161.0):
    """The blades and their damper where it slips and lifts off, each coordinate with harmonics of its own."""
    step = step_at(hertz=hertz, harmonics=tuple(range(ORDER + 1)))
    balance = LocalBalance(step.balance, OWN)
    start = balance.unknowns(step.balance.coefficients(step.x))
    found = newton(lambda x: balance.linearise(x, step.omega), start, Newton(max_iterations=40))
    assert found.status.converged
    return step, balance, found.x


def wanted():
    return np.concatenate([[0], np.repeat(np.arange(1, ORDER + 1), 2)])


def test_galerkin_asks_for_equilibrium_where_a_coordinate_keeps_a_harmonic():
    step, balance, x = local_at()
    rows = rows_of_step(replace(step, x=balance.whole(x)))
    kept = np.array([[h in own for own in OWN] for h in wanted()])
    assert balance.size == kept.sum()
    assert np.all(rows[~kept] == 0.0)
    left = residual(rows, step.omega)
    assert np.abs(left[kept]).max() < 1e-8 * balance.force_scale
    # and nowhere else: the forces that the missing harmonics leave
    assert np.abs(left[~kept]).max() > 1e-3 * balance.force_scale


def test_the_jacobian_is_that_of_the_equations_that_are_kept():
    step, balance, x = local_at()
    size, at = 1e-7, balance.linearise(x, step.omega)
    columns = []
    for i in range(x.size):
        aside = np.zeros(x.size)
        aside[i] = size
        ahead, behind = (balance.linearise(x + s * aside, step.omega).residual for s in (1, -1))
        columns.append((ahead - behind) / (2 * size))
    scale = np.abs(at.jac).max()
    np.testing.assert_allclose(at.jac, np.array(columns).T, rtol=0, atol=1e-5 * scale)


def test_the_same_harmonics_everywhere_are_the_plain_problem():
    system, load = blades_and_damper()
    sweep = ss.Sweep(omega_range=(161 * HZ, 162 * HZ), high=5, selection="grolet")
    problem = forced_problem(system, load, sweep)
    n = problem.low.linear.n
    assert problem.local((0, 1), ((0, 1),) * n) is problem.low
    assert problem.local((0, 1), None) is problem.low


def test_supports_and_pairs_are_two_ways_to_say_the_same():
    together = of_all(OWN)
    assert together == tuple(range(ORDER + 1))
    assert supports_of(kept_by_dof(OWN, together), together) == OWN
    more = joined(OWN, ((0, 5),) * len(OWN))
    assert more[0] == (0, 1, 5)
    assert more[4] == OWN[4]


def share_of_each(rows, h):
    """Eq. 10 of each coordinate by itself."""
    total = rows[0] ** 2 + np.sum(rows[1:] ** 2, axis=0)
    own = rows[0] ** 2 if h == 0 else rows[2 * h - 1] ** 2 + rows[2 * h] ** 2
    return own / total


def test_maple_raises_the_coordinates_whose_last_harmonic_is_large():
    step, balance, x = local_at()
    step = replace(step, x=balance.whole(x), by_dof=OWN)
    rows = rows_of_step(step)
    last = np.array([share_of_each(rows, own[-1])[i] for i, own in enumerate(OWN)])
    threshold = float(np.median(last))
    verdict = Maple(threshold=threshold, per_dof=True).judge(step)
    assert verdict.indicator == pytest.approx(last.max(), rel=1e-9)
    expected = tuple(
        (*own, own[-1] + 1) if share > threshold and own[-1] < ORDER else own
        for own, share in zip(OWN, last, strict=True)
    )
    assert expected != OWN
    assert verdict.again_by_dof == expected
    assert verdict.following_by_dof == OWN
    quiet = Maple(threshold=1.1 * last.max(), per_dof=True).judge(step)
    assert quiet.again is None
    assert quiet.again_by_dof is None


@pytest.mark.parametrize("threshold", [1e-6, 1e-4, 1e-2])
def test_grolet_keeps_what_the_tangent_foretells_for_each_coordinate(threshold):
    step = step_at(harmonics=(0, 1, 3))
    rows, size = rows_of_step(step), 1e-4
    by_omega = residual(rows, step.omega + size) - residual(rows, step.omega - size)
    right = -by_omega.reshape(-1) / (2 * size) * (step.next_omega - step.omega)
    ahead = rows + np.linalg.solve(jacobian(), right).reshape(rows.shape)
    shares = np.array([share_of_each(ahead, h) for h in range(ORDER + 1)])
    expected = tuple(tuple(h for h in range(ORDER + 1) if h < 2 or shares[h, i] > threshold) for i in range(6))
    verdict = Grolet(threshold=threshold, per_dof=True).judge(step)
    assert verdict.indicator == pytest.approx(shares[[2, 4, 5]].max(), rel=1e-4)
    assert verdict.following_by_dof == expected
    assert verdict.following == of_all(expected)
    assert verdict.again is None
    again = Grolet(threshold=threshold, per_dof=True, repeats=True).judge(step)
    both = tuple(tuple(sorted({0, 1, 3, *own})) for own in expected)
    assert again.again_by_dof == (None if set(both) == {(0, 1, 3)} else both)


def two_masses():
    """A mass on a slider beside a mass on a spring, which do not hear each other."""
    structure = ss.model.lumped(
        mass=np.eye(2), stiffness=np.diag([1.0, 1.3]), damping=0.02 * np.eye(2), names=("rubs", "hangs")
    )
    gap = np.zeros((6, 2))
    gap[0, 0] = gap[3, 1] = 1.0
    laws = ss.Jenkins(k_t=0.5, limit=0.03), ss.Bonded(k_t=0.2, k_w=0.0, k_n=0.0)
    interface = ss.Interface(("slider", "spring"), laws, gap)
    load = ss.HarmonicLoad(np.zeros(2), {1: np.array([0.1 + 0j, 0.1])})
    return ss.System(structure, interface, outputs=np.array([0, 1])), load


@pytest.mark.parametrize(("made", "silent"), [(Maple, (0, 1, 3)), (Grolet, (0, 1))])
def test_a_coordinate_that_nothing_shakes_in_a_harmonic_does_without_it(made, silent):
    # Maple's rule knows that a harmonic is small once it has it
    system, load = two_masses()
    options = {"high": (1, 3, 5)}
    hertz = (0.33 / HZ, 0.45 / HZ)
    strategy = made(threshold=1e-9, per_dof=True)
    problem, points = response(system, load, hertz, 6, strategy, **options)
    _, same = response(system, load, hertz, 6, made(threshold=1e-9), **options)
    ours = {p.omega: p for p in points}
    theirs = {p.omega: p for p in same}
    assert any(p.by_dof is not None for p in ours.values())
    for omega, point in ours.items():
        assert point.converged
        other = theirs[omega]
        assert point.support == other.support
        if point.by_dof is not None:
            assert point.by_dof == (point.support, silent)
            assert other.unknowns - point.unknowns == 2 * (len(point.support) - len(silent))
        size = np.abs(other.coefficients).max()
        np.testing.assert_allclose(point.coefficients, other.coefficients, rtol=0, atol=1e-8 * size)
        assert problem.real_error(point, other) < 1e-6


def test_through_the_frequencies_and_taken_up_again():
    system, load = blades_and_damper()
    strategy = Grolet(threshold=1e-6, per_dof=True, repeats=True)
    _, wrong = errors(system, load, (155.0, 173.0), 7, strategy)
    assert wrong.max() < 0.02
    sweep = ss.Sweep(
        omega_range=(155 * HZ, 173 * HZ), frequencies=7, selection=strategy, high=5, passages="single", peak_points=0
    )
    points = list(forced_response(system, load, sweep))
    assert any(p.by_dof is not None for p in points)
    for done in (1, 3, len(points) - 1):
        rest = list(forced_response(system, load, sweep, done=points[:done]))
        for one, other in zip(rest, points[done:], strict=True):
            assert one.by_dof == other.by_dof
            np.testing.assert_array_equal(one.coefficients, other.coefficients)


@pytest.mark.parametrize(
    ("by_dof", "again", "again_by_dof", "expected"),
    [
        (None, None, None, (None, None)),
        (None, (1,), None, (None, None)),
        (None, (0, 3), None, ((0, 1, 3), None)),
        (None, None, ((0, 1), (0, 3)), ((0, 1, 3), ((0, 1), (0, 1, 3)))),
        (None, None, ((0,), (0, 1)), (None, None)),
        (((0, 1), (0,)), (0, 3), None, ((0, 1, 3), ((0, 1, 3), (0, 3)))),
        (((0, 1), (0,)), None, ((0,), (0, 2)), ((0, 1, 2), ((0, 1), (0, 2)))),
        (((0, 1), (0,)), None, ((1,), (0,)), (None, None)),
        (((0, 1), (0,)), None, None, (None, None)),
    ],
)
def test_a_repeat_has_new_harmonics_of_all_coordinates_or_of_some(by_dof, again, again_by_dof, expected):
    problem = SimpleNamespace(low=SimpleNamespace(linear=SimpleNamespace(n=2)))
    verdict = Verdict(1.0, again, (0, 1), again_by_dof=again_by_dof)
    assert _more(problem, (0, 1), by_dof, verdict) == expected
