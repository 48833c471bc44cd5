"""A stopped examination of stability goes on where it was: by points, and by pieces of a point that Hill's method was at."""

import itertools
import logging
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_flutter_wheel import forced

from stickslip.analyses.forced_response.stability import examining
from stickslip.analyses.forced_response.stability.bifurcating import Remembered
from stickslip.analyses.forced_response.stability.examining import Looked
from stickslip.analyses.forced_response.stability.stable import Examined, as_note
from stickslip.response.stability import hill_stability
from stickslip.response.stability.hill_method.hill_segment import NODES, Segment
from stickslip.study import analysis
from stickslip.study.store.archive import decode, encode
from stickslip.units import HZ


class Journal:
    """Notes that a job of so many more notes is stopped after."""

    def __init__(self) -> None:
        self.stored: dict[str, bytes] = {}
        self.left = 10**6

    def put(self, name: str, values: Mapping[str, Any]) -> None:
        if not self.left:
            raise KeyboardInterrupt
        self.left -= 1
        self.stored[name] = encode(values)

    def get(self, name: str) -> dict[str, Any] | None:
        return decode(self.stored[name]) if name in self.stored else None

    def forget(self, name: str) -> None:
        del self.stored[name]


def noted(examined: list[Examined]) -> list[bytes]:
    """Return what is put down of points, to the last bit."""
    return [encode(as_note(e)) for e in examined]


@pytest.fixture(scope="module")
def motion() -> Any:
    """A forced motion of a wheel that Hill's method looks at."""
    return forced(2.0)[:2]


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[complex]:
    """The exponents that matrices are made at; every piece of them takes a second."""
    exponents: list[complex] = []
    node = Segment.node

    def counted(self: Segment, sigma: complex) -> Any:
        exponents.append(sigma)
        return node(self, sigma)

    monkeypatch.setattr(Segment, "node", counted)
    monkeypatch.setattr(analysis, "perf_counter", itertools.count().__next__)
    return exponents


def test_points_and_pieces_are_taken_over_and_told(
    motion: Any, made: list[complex], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    problem, point = motion

    def examine(_question: Any, accepted: Any, keep: Any) -> Examined:
        found = hill_stability(problem, accepted.point, keep).stability
        return Examined(accepted.point.omega, found.verdict, found.multiplier, found.multiplier_error, "")

    monkeypatch.setattr(examining, "examine", examine)
    accepted: Any = SimpleNamespace(point=point)
    question: Any = SimpleNamespace(said=lambda text: text)
    straight = Looked(question, Journal())
    whole = [straight(accepted), straight(accepted)]
    nodes, journal = len(made), Journal()
    made.clear()
    caplog.set_level(logging.INFO, "stickslip")
    found = None
    for more in (2, 3, 10**6):
        journal.left = more
        again = Looked(question, journal)
        try:
            found = [again(accepted), again(accepted)]
        except KeyboardInterrupt:
            assert len(journal.stored) in (2, 5)
    assert found is not None
    assert noted(found) == noted(whole)
    assert len(made) == nodes + 2 * NODES  # what was at work at each stop
    assert sorted(journal.stored) == ["stability.0", "stability.1"]  # pieces are given up
    (line,) = (r.getMessage() for r in caplog.records if not hasattr(r, "fraction"))
    assert line == f"stability: {point.omega / HZ:.3f} Hz: 5 pieces are taken over from a run that was stopped"
    after = Looked(question, journal)
    assert noted([after(accepted), after(accepted)]) == noted(whole)
    after.tell()
    assert [r.getMessage() for r in caplog.records if not hasattr(r, "fraction")][1:] == [
        "stability: 2 points that were examined before are taken over from a run that was stopped"
    ]
    assert len(made) == nodes + 2 * NODES


def test_multipliers_along_a_branch_go_on_within_a_point(motion: Any, made: list[complex]) -> None:
    whole = Remembered(Journal(), hill=True)(*motion)
    nodes, journal = len(made), Journal()
    made.clear()
    found = None
    for more in (3, 10**6):
        journal.left = more
        try:
            found = Remembered(journal, hill=True)(*motion)
        except KeyboardInterrupt:
            assert len(journal.stored) == 3
    assert found is not None
    assert len(made) == nodes + NODES
    assert list(journal.stored) == ["bifurcations.1"]
    np.testing.assert_array_equal(found.floquet.multipliers, whole.floquet.multipliers)
    np.testing.assert_array_equal(found.errors, whole.errors)
