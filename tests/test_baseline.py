"""The comparison with the results of an earlier commit sees what differs."""

import numpy as np
import pytest

from evidence.baseline.compare import compare_forced, compare_table, differing
from evidence.baseline.stored import stored


@pytest.fixture(scope="module")
def blades():
    return stored("two_blades")[1]["forced_response"]


@pytest.fixture(scope="module")
def modes():
    return stored("shrouded_sector")[1]["modes"]


def failing(findings):
    return [one.what for one in findings if not one.holds]


def test_baseline_agrees_with_itself(blades, modes):
    assert failing(compare_forced(blades, blades)) == []
    assert failing(compare_table(modes, modes)) == []


def test_rounding_is_no_difference(blades, modes):
    shifted = blades | {"contact_force": blades["contact_force"] * (1 + 1e-11)}
    assert failing(compare_forced(blades, shifted)) == []
    digests = stored("shrouded_sector")[0]["modes"]
    last_bit = np.nextafter(modes["frequency_hz"], np.inf)
    assert "frequency_hz" not in differing(digests, modes)
    assert "frequency_hz" in differing(digests, modes | {"frequency_hz": last_bit})


def test_a_changed_force_is_found(blades):
    force = blades["contact_force"].copy()
    force[5, 1] *= 1 + 1e-4
    assert failing(compare_forced(blades, blades | {"contact_force": force})) == [
        "case 0: contact_force"
    ]


def test_a_changed_state_is_found(blades):
    status = blades["status"].copy()
    status[-1] = 2
    state = blades["peak_state"].copy()
    state[3, 0] = 2 - state[3, 0]
    changed = blades | {"status": status, "peak_state": state}
    assert failing(compare_forced(blades, changed)) == ["peak_state", "case 8: status"]


def test_points_of_a_fold_may_lie_elsewhere_on_the_same_curve(blades):
    # every other point of the fold of case 7 is left out: those that remain are points of the same curve
    case = np.flatnonzero(blades["point_case"] == 7)
    kept = np.setdiff1d(np.arange(len(blades["point_case"])), case[10:40:2])
    per_point = len(blades["point_case"])
    thinned = {k: v[kept] if len(v) == per_point else v for k, v in blades.items()}
    assert failing(compare_forced(blades, thinned)) == []


def test_points_off_the_curve_are_found(blades):
    moved = np.where(
        blades["point_case"] == 7, blades["frequency_hz"] + 2.0, blades["frequency_hz"]
    )
    assert "case 7: other points" in failing(
        compare_forced(blades, blades | {"frequency_hz": moved})
    )
