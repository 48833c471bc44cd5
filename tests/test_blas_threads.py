"""BLAS has one thread where matrices are small, and those that it had where a large one is factorised or nothing of ours runs."""

from collections.abc import Iterator
from functools import partial

import pytest

import stickslip as ss
from evidence.models.lumped import griffin
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.model import blas_threads
from stickslip.model.blas_threads import MIN_THREADED_ROWS, by_one_thread, one_loaded_blas_thread, threads_for
from stickslip.response import (
    all_motions,
    bifurcations,
    nonlinear_modes,
    quasi_periodic,
    residual_tractions,
    self_excited,
    stability,
)
from stickslip.response.rigid import rigid_response

LAYER = (
    ss.forced_response,
    ss.preload,
    ss.response.branch_in_parameter,
    ss.response.integrate,
    ss.response.shoot,
    ss.response.track_peak,
    rigid_response,
    stability.stability,
    stability.hill_stability,
    bifurcations.bifurcations,
    nonlinear_modes.nonlinear_mode,
    self_excited.limit_cycles,
    quasi_periodic.second_tone,
    all_motions.all_motions,
    residual_tractions.traction_bounds,
)


@pytest.fixture
def counts(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of threads of two libraries."""
    own = [5, 7]
    pairs = [(partial(own.__getitem__, i), partial(own.__setitem__, i)) for i in range(2)]
    monkeypatch.setattr(blas_threads, "loaded", lambda: pairs)
    monkeypatch.setattr(blas_threads, "SAID", False)
    return own


def test_each_step_of_a_generator_has_one_thread_and_what_happens_between_has_all(counts: list[int]) -> None:
    ended = []

    @by_one_thread
    def steps(n: int) -> Iterator[list[int]]:
        try:
            for _ in range(n):
                yield list(counts)
        finally:
            ended.append(list(counts))

    for inside in steps(3):
        assert inside == [1, 1]
        assert counts == [5, 7]
    next(steps(2))  # given up after one
    assert ended[0] == [1, 1]
    assert len(ended) == 2
    assert counts == [5, 7]


def test_blocks_within_blocks_and_errors_give_the_threads_back(counts: list[int]) -> None:
    @by_one_thread
    def fails() -> None:
        with one_loaded_blas_thread():
            pass
        assert counts == [1, 1]
        raise ValueError("no solution")

    with pytest.raises(ValueError, match="no solution"):
        fails()
    assert counts == [5, 7]


def test_a_large_matrix_has_all_threads_but_in_a_study(counts: list[int]) -> None:
    @by_one_thread
    def factorise(rows: int) -> list[int]:
        with threads_for(rows):
            return list(counts)

    assert factorise(MIN_THREADED_ROWS - 1) == [1, 1]
    assert factorise(MIN_THREADED_ROWS) == [5, 7]
    with one_loaded_blas_thread():
        assert factorise(MIN_THREADED_ROWS) == [1, 1]
    assert counts == [5, 7]


@pytest.mark.parametrize("function", LAYER, ids=lambda f: f.__name__)
def test_the_lower_layer_takes_one_thread(function: object) -> None:
    assert hasattr(function, "__wrapped__")


def test_a_response_of_the_lower_layer_is_solved_by_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blas_threads, "SAID", False)
    before = [get() for get, _ in blas_threads.loaded()]
    seen: set[int] = set()
    linearise = HarmonicBalance.linearise

    def watched(self: HarmonicBalance, *words: object, **named: object) -> object:
        seen.update(get() for get, _ in blas_threads.loaded())
        return linearise(self, *words, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(HarmonicBalance, "linearise", watched)
    system, load = griffin(0.2)
    sweep = ss.Sweep(omega_range=(0.8, 1.3), selection="always_low", points=3, peak_points=0)
    try:
        for _, put in blas_threads.loaded():
            put(2)
        between = []
        for _ in ss.forced_response(system, load, sweep):
            between += [get() for get, _ in blas_threads.loaded()]
    finally:
        for (_, put), count in zip(blas_threads.loaded(), before, strict=True):
            put(count)
    assert seen == {1}
    assert set(between) == {2}
