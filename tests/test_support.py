"""Harmonic supports: any set of harmonics, against the full problem with rows and columns struck out."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from models import balance_of
from newton_bounds import FINE, unknowns_bound

from evidence.models.lumped import blades_and_damper, griffin
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import complex_rows, harmonics_of, is_full, real_rows, rows_of, to_real
from stickslip.response.forced.response import Sweep, forced_problem, forced_response
from stickslip.solve.newton_method import Newton, newton

SUPPORTS = [(0, 1), (0, 1, 3), (0, 2, 3), (0, 1, 2, 3), (0, 1, 5)]
some_harmonics = st.sets(st.integers(1, 7), min_size=1, max_size=5).map(harmonics_of)


@given(some_harmonics, st.integers(0, 9), st.integers(1, 3))
@settings(max_examples=60, deadline=None)
def test_rows_pick_and_put_back(harmonics, order, n):
    rng = np.random.default_rng(order * 10 + n)
    q = rng.standard_normal((order + 1, n)) + 1j * rng.standard_normal((order + 1, n))
    q[0] = q[0].real
    rows = real_rows(q, harmonics)
    assert rows.shape == (2 * len(harmonics) - 1, n)
    full = to_real(np.vstack([q, np.zeros((8, n))]))[rows_of(harmonics)]
    assert np.array_equal(rows, full)
    back = complex_rows(rows, harmonics)
    assert np.array_equal(real_rows(back, harmonics), rows)
    left_out = [h for h in range(harmonics[-1] + 1) if h not in harmonics]
    assert not np.any(back[left_out])
    assert is_full(harmonics) is (not left_out)


@pytest.mark.parametrize("wrong", [-1, [1, -3], [0.5], "odd", [1, "x"], None])
def test_what_is_no_harmonic_is_refused(wrong):
    with pytest.raises(InputError, match=r"Sweep\.high: must be the highest harmonic or a list"):
        harmonics_of(wrong, "Sweep.high")


@pytest.mark.parametrize("form", ["dense", "structured"])
@pytest.mark.parametrize("harmonics", SUPPORTS)
def test_a_support_is_the_full_problem_with_rows_and_columns_struck_out(harmonics, form):
    omega, top = 2 * np.pi * 161.0, 5
    full = replace(balance_of(*blades_and_damper(), order=top), jacobian="dense")
    few = replace(full.with_harmonics(harmonics), jacobian=form)
    rng = np.random.default_rng(3)
    x = rng.standard_normal(few.size)
    padded = full.unknowns(few.coefficients(x))
    n = few.linear.n
    own = (rows_of(harmonics)[:, None] * n + np.arange(n)).reshape(-1)
    assert few.size == own.size
    small, whole = few.linearise(x, omega), full.linearise(padded, omega)
    assert np.allclose(small.residual, whole.residual[own], rtol=0, atol=1e-11)
    jac = whole.dense_jac()[np.ix_(own, own)]
    assert np.allclose(small.dense_jac(), jac, rtol=0, atol=1e-11 * np.abs(jac).max())
    assert np.allclose(small.jac_p, whole.jac_p[own], rtol=1e-9, atol=1e-11)
    v = rng.standard_normal(few.size)
    if form == "structured" and few.structured:
        assert np.allclose(small.jac.matvec(v), jac @ v, rtol=0, atol=1e-10 * np.abs(jac).max())
        assert np.allclose(small.jac.rmatvec(v), jac.T @ v, rtol=0, atol=1e-10 * np.abs(jac).max())


@pytest.mark.kernel
def test_structured_support_is_solved_by_iteration():
    omega = 2 * np.pi * 161.0
    few = replace(balance_of(*blades_and_damper(), order=5).with_harmonics((0, 1, 3, 5)), jacobian="structured")
    start = np.zeros(few.size)
    start[: few.linear.n] = 1e-2
    solutions = [
        newton(lambda x, own=own: own.linearise(x, omega), start, Newton(max_iterations=100))
        for own in (few, replace(few, jacobian="dense"))
    ]
    assert all(s.status.converged for s in solutions)
    reached = (few.linearise(s.x, omega) for s in solutions)
    assert np.abs(solutions[0].x - solutions[1].x).max() <= unknowns_bound(solutions[0].x, *reached)


@pytest.mark.kernel
def test_odd_harmonics_suffice_where_the_force_is_odd():
    # a Jenkins spring and a harmonic load: even harmonics vanish by symmetry, so leaving them out changes nothing
    system, load = griffin(0.05)
    sweep = Sweep(
        omega_range=(0.9, 1.3), low=7, high=7, selection="always_low", frequencies=9, peak_points=0, newton=FINE
    )
    all_seven = list(forced_response(system, load, sweep))
    odd = list(forced_response(system, load, replace(sweep, low=(1, 3, 5, 7), high=(1, 3, 5, 7))))
    balance = forced_problem(system, load, sweep).low
    for one, other in zip(all_seven, odd, strict=True):
        assert one.converged
        assert other.converged
        assert other.support == (0, 1, 3, 5, 7)
        ends = [balance.unknowns(point.coefficients) for point in (one, other)]
        bound = unknowns_bound(ends[0], *(balance.linearise(x, one.omega) for x in ends))
        assert np.abs(ends[0] - ends[1]).max() <= bound


def test_a_driven_harmonic_must_be_kept():
    system, load = griffin(0.1)
    both = HarmonicLoad(load.static, {1: load.harmonics[1], 2: load.harmonics[1]})
    sweep = Sweep(omega_range=(0.9, 1.3), low=(1, 3), high=(1, 3, 5))
    with pytest.raises(InputError, match="excites harmonic 2, but the first passage keeps 0, 1, 3"):
        next(forced_response(system, both, sweep))


def test_low_must_be_part_of_high():
    with pytest.raises(InputError, match="Give low at least harmonic 1, and high all of low"):
        Sweep(omega_range=(1.0, 2.0), low=2, high=(1, 3, 5))
