"""Frequencies of a list, and responses that are gone through from the top: mirrored where there is one motion, another one beside folds."""

from dataclasses import replace

import numpy as np
import pytest
from models import lifting

from evidence.models.lumped import blades_and_damper, griffin
from stickslip.errors import InputError
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.response import forced_problem, forced_response
from stickslip.response.forced.sweep import Sweep

HZ = 2 * np.pi
LISTED = (150 * HZ, 157 * HZ, 158 * HZ, 160.5 * HZ, 170 * HZ)
SHORT = Sweep(omega_range=(150 * HZ, 170 * HZ), samples=64, points=12, peak_points=3, high=3)


def solved(sweep, model=blades_and_damper):
    system, load = model()
    return forced_problem(system, load, sweep), list(forced_response(system, load, sweep))


def by_frequency(points):
    return {p.omega: p for p in accepted_points(points) if p.stage != "peak"}


@pytest.mark.parametrize("passages", ["double", "single"])
@pytest.mark.parametrize("steps", [{"frequencies": 21}, {"at": LISTED}], ids=["spaced", "listed"])
def test_down_is_up_mirrored_where_there_is_one_motion(passages, steps):
    asked = replace(SHORT, passages=passages, selection="jacobian_alert", peak_points=0, **steps)
    up = solved(asked)[1]
    down = solved(replace(asked, direction="down"))[1]
    there, back = ([p.omega for p in points if p.stage == "low"] for points in (up, down))
    assert there == sorted(there)
    assert back == there[::-1]
    assert any(p.stage == "high" for p in up)
    one, other = by_frequency(up), by_frequency(down)
    assert one.keys() == other.keys()
    for omega, point in one.items():
        assert point.converged
        mirrored = other[omega]
        assert point.support == mirrored.support
        scale = np.abs(point.coefficients[1:]).max()
        assert np.abs(point.coefficients[1:] - mirrored.coefficients[1:]).max() < 1e-6 * scale


def test_a_list_has_the_frequencies_of_its_own_and_the_answers_of_single_ones():
    asked = replace(SHORT, at=LISTED, selection="always_high", peak_points=0)
    points = accepted_points(solved(asked)[1])
    assert [p.omega for p in points] == list(LISTED)
    falling = replace(asked, at=LISTED[::-1], direction="down")
    assert [p.omega for p in accepted_points(solved(falling)[1])] == list(LISTED[::-1])
    alone = accepted_points(solved(replace(asked, at=LISTED[2:3]))[1])[0]
    assert np.allclose(points[2].coefficients, alone.coefficients, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("selection", ["always_low", "jacobian_alert"])
def test_a_branch_is_followed_from_the_top(selection):
    asked = replace(SHORT, selection=selection)
    problem, up = solved(asked)
    down = solved(replace(asked, direction="down"))[1]
    low = [p.omega for p in down if p.stage == "low"]
    assert (low[0], low[-1]) == asked.omega_range[::-1]
    assert np.all(np.diff(low) < 0.0)
    assert all(p.tangent[-1] < 0.0 for p in down if p.stage == "low")
    one, other = (max(map(problem.amplitude, accepted_points(p))) for p in (up, down))
    assert one == pytest.approx(other, rel=1e-3)  # the resolution of a peak on few points
    assert any(p.stage == "peak" for p in down)


# the response bends to lower frequencies: between two folds there are three motions
BENT = Sweep(omega_range=(1.0, 1.6), samples=64, points=16, peak_points=0, selection="always_low")


@pytest.mark.parametrize("steps", [{"frequencies": 25}, {"at": tuple(np.linspace(1.0, 1.6, 25))}])
def test_the_jump_beside_folds_is_another_one_downward(steps):
    problem, up = solved(replace(BENT, **steps), lifting)
    down = solved(replace(BENT, direction="down", **steps), lifting)[1]
    up, down = accepted_points(up), accepted_points(down)
    heights = [np.array([problem.amplitude(p) for p in sorted(points, key=lambda p: p.omega)]) for points in (up, down)]
    assert all(p.converged for p in (*up, *down))
    differ = np.flatnonzero(np.abs(heights[0] - heights[1]) > 0.2 * heights[1])
    # neighbours of each other, and the same motion outside
    assert differ.size >= 2
    assert np.all(np.diff(differ) == 1)
    same = np.setdiff1d(np.arange(25), differ)
    assert heights[0][same] == pytest.approx(heights[1][same], rel=1e-6)
    jumps = [int(np.argmax(np.abs(np.diff(np.log(h))))) for h in heights]
    assert jumps[0] != jumps[1]


def test_a_bent_branch_passes_its_folds_downward():
    fine = replace(BENT, samples=512, points=40, direction="down")
    problem, points = solved(fine, lifting)
    omega = np.array([p.omega for p in points])
    assert all(p.converged for p in points)
    assert (omega[0], omega[-1]) == fine.omega_range[::-1]
    folds = np.flatnonzero(np.diff(np.sign(np.diff(omega)))) + 1
    assert folds.size == 2
    assert omega[folds[0]] < omega[folds[1]]
    up = solved(replace(fine, direction="up"), lifting)[1]
    highest = [max(map(problem.amplitude, p)) for p in (up, points)]
    assert highest[0] == pytest.approx(highest[1], rel=1e-2)


@pytest.mark.parametrize("steps", [{}, {"frequencies": 6}, {"at": LISTED}])
@pytest.mark.parametrize("passages", ["double", "single"])
def test_a_run_downward_is_taken_up_again(steps, passages):
    system, load = blades_and_damper()
    sweep = replace(SHORT, direction="down", passages=passages, selection="jacobian_alert", **steps)
    points = list(forced_response(system, load, sweep))
    for known in (1, len(points) // 2, len(points) - 1):
        rest = list(forced_response(system, load, sweep, done=points[:known]))
        assert len(rest) == len(points) - known
        for new, old in zip(rest, points[known:], strict=True):
            assert new.omega == old.omega
            np.testing.assert_array_equal(new.coefficients, old.coefficients)


def test_the_start_is_at_the_top():
    system, load = griffin(1.0)
    sweep = Sweep(omega_range=(0.8, 1.2), direction="down", selection="always_low", points=5)
    assert next(forced_response(system, load, sweep)).omega == 1.2


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"direction": "sideways"}, "Sweep.direction: 'sideways' is none of up, down"),
        ({"at": (1.0, 1.1), "frequencies": 3}, "both frequencies and at"),
        ({"at": (1.0, 1.1, 1.1)}, "must grow or fall strictly within 0.9 to 1.3"),
        ({"at": (1.0, 1.2, 1.1)}, "must grow or fall strictly"),
        ({"at": (0.5, 1.0)}, "within 0.9 to 1.3 rad/s"),
        ({"at": (1.0, float("nan"))}, "must grow or fall strictly"),
        ({"at": (1.1, 1.0)}, "falls, and the direction is up"),
    ],
)
def test_lists_that_are_none_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Sweep(omega_range=(0.9, 1.3), **wrong)
