"""A branch that runs back beside itself is left, and what it told is forgotten."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from stickslip.response.continuation.adaptive_continuation import RUN_BACK, turned_for_nothing
from stickslip.response.continuation.branch import Curve, Followed, Judged, Route
from stickslip.solve.continuation import Point

ROUTE = Route(first=0.0, last=40.0, points=40)


class Width(Curve):
    """Motions of one number are alike within five hundredths."""

    levels = 3

    def alike(self, one: Followed, other: Followed) -> bool:
        return bool(abs(one.point.x[0] - other.point.x[0]) <= 0.05)


def branch(*points: tuple[float, float], level: int = 2) -> Sequence[Followed]:
    """Return converged points at (parameter, state)."""
    solution: Any = SimpleNamespace(status=SimpleNamespace(converged=True))
    none = np.zeros(2)
    return [
        Followed("point", i, level, Point(np.array([x]), p, none, 0.1, solution, 1.0), Judged(), 0.0)
        for i, (p, x) in enumerate(points)
    ]


THERE = [(float(p), 0.1 * p) for p in range(11)]


@pytest.mark.parametrize(
    ("apart", "step", "count", "left"),
    [
        (0.03, 0.2, RUN_BACK, True),
        (0.03, 0.2, RUN_BACK - 1, False),  # too few
        (0.03, 0.05, RUN_BACK, False),  # over less than a step: beside every fold two motions meet
        (0.2, 0.2, RUN_BACK, False),  # the other sheet of a fold
        (0.03, 0.2, 3 * RUN_BACK, True),
    ],
)
def test_what_runs_back_beside_itself_is_left(apart: float, step: float, count: int, left: bool) -> None:
    back = [(10.0 - step * k, 0.1 * (10.0 - step * k) + apart) for k in range(1, count + 1)]
    assert turned_for_nothing(Width(), ROUTE, branch(*THERE, *back)) == count * left
    assert turned_for_nothing(Width(), ROUTE, branch(*THERE)) == 0
    assert (
        turned_for_nothing(Width(), ROUTE, branch(*THERE, *back, level=1)) == 0
    )  # a fold that has more harmonics before it


def test_a_sheet_that_leaves_the_other_is_followed() -> None:
    """Near at its last points, but another motion between: the last ones alone decide, and these are far."""
    back = [(10.0 - 0.2 * k, 0.1 * (10.0 - 0.2 * k) + 0.01 * k) for k in range(1, RUN_BACK + 1)]
    assert turned_for_nothing(Width(), ROUTE, branch(*THERE, *back)) == 0
