"""The small linear systems of a time step, beside NumPy."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit

from stickslip.response.time.stepping.step_newton import _factor, _substitute


@njit  # the functions have no Python wrapper of their own
def solve(lu, pivot, x, k):  # type: ignore[no-untyped-def]
    _factor(lu, pivot, k)
    _substitute(lu, pivot, x, k)


@settings(max_examples=60, deadline=None)
@given(k=st.integers(1, 9), extra=st.integers(0, 2), seed=st.integers(0, 10_000))
def test_factors_with_row_pivoting_solve_the_system(k: int, extra: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix, right = rng.standard_normal((k, k)), rng.standard_normal(k)
    matrix[np.arange(k), np.arange(k)] *= rng.choice([0.0, 1e-3, 1.0], k)  # rows have to change places
    assume(np.linalg.cond(matrix) < 1e8)
    lu, pivot, x = np.zeros((k + extra, k + extra)), np.zeros(k + extra, dtype=np.int64), np.zeros(k + extra)
    lu[:k, :k], x[:k] = matrix.T, right
    solve(lu, pivot, x, k)
    bound = 1e3 * np.finfo(float).eps * np.linalg.cond(matrix) * np.linalg.norm(right)
    assert np.linalg.norm(matrix @ x[:k] - right) <= bound * max(1.0, np.linalg.norm(x))
    assert x[k:] == pytest.approx(0.0)
