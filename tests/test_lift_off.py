"""Lift-off without a periodic motion: with ``rescue = "off"`` a sweep gives up soon, and time integration says why."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from evidence.benchmarks import bench_lift_off
from evidence.models.many_contacts import two_plates
from stickslip.errors import InputError
from stickslip.response.forced.response import Sweep, forced_response
from stickslip.study.analyses.forced.not_periodic import without_periodic

OMEGA = 2.0 * np.pi * 1067.0


def test_without_a_rescue_a_frequency_is_given_up_after_the_correctors_own_starts() -> None:
    plates = two_plates(8)
    sweep = Sweep(
        omega_range=(OMEGA, 1.1 * OMEGA), at=(OMEGA, 1.1 * OMEGA), low=9, high=9, selection="always_high", peak_points=0,
        rescue="off",
    )  # fmt: skip
    points = list(forced_response(plates.system, plates.load(0.3), sweep))
    assert not any(p.converged for p in points)
    spent = Counter({p.index: 0 for p in points})
    for point in points:
        spent[point.index] += point.iterations
    assert 0 < max(spent.values()) <= 3 * sweep.newton.max_iterations
    with pytest.raises(InputError, match="rescue"):
        Sweep(omega_range=(1.0, 2.0), rescue="none")  # type: ignore[arg-type]


def test_the_march_tells_what_repeats_from_what_does_not() -> None:
    plates = two_plates(8)
    faint, strong = (bench_lift_off.march(plates, share, 1067.0) for share in (0.03, 0.3))
    assert faint.verdict == "periodic"
    assert np.isnan(faint.growth)
    assert strong.verdict == "not periodic"
    assert strong.growth > 1.0
    assert strong.wander > 0.05


def test_as_many_points_are_marched_as_the_study_says() -> None:
    points = [SimpleNamespace(point=SimpleNamespace(omega=w, converged=w == 3.0)) for w in range(1, 7)]  # fmt: skip
    response = SimpleNamespace(accepted=points, top=points[2])
    for most, wanted in ((1, [2]), (3, [1, 2, 4]), (9, [1, 2, 4, 5, 6])):
        question = SimpleNamespace(not_periodic_points=most)
        found = without_periodic(question, response, [])  # type: ignore[arg-type]
        assert sorted(omega for omega, _, _ in found) == wanted
