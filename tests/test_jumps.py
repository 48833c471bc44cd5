"""Jumps between neighbours of a branch: the onset of slip is none, the fold that the shipped example jumps over is one."""

import numpy as np
import pytest

from stickslip.response.forced.collected import LOSS_SEEN, jumps

# evidence/models/two_blades.toml at ratio 4 with high = 5, as solved at commit 6ff2cce: Hz, amplitude of tip1.x in m, dissipation in J, and whether
# a point keeps one harmonic; the contacts store 0.01455 J, and 0.00966 J is the largest dissipation, at 174.2 Hz
FOLD = np.array(
    [
        [164.108, 1.7004e-04, 1.1396e-05, 1],
        [164.954, 1.7883e-04, 1.3835e-05, 1],
        [165.800, 1.8860e-04, 1.6560e-05, 1],
        [166.644, 1.9952e-04, 1.9546e-05, 1],
        [167.488, 2.1180e-04, 2.2739e-05, 1],
        [168.328, 2.2846e-04, 3.8304e-04, 0],
        [169.137, 3.4935e-04, 5.7665e-03, 0],
        [169.896, 3.6933e-04, 6.1956e-03, 0],
        [170.540, 3.8177e-04, 6.4176e-03, 0],
        [174.246, 6.0247e-04, 9.6604e-03, 0],
    ]
)
ELASTIC = 0.01455  # J


def test_the_fold_that_ratio_4_jumps_over_is_found() -> None:
    hz, amplitude, loss, few = FOLD.T
    (found,) = jumps(amplitude, loss, few > 0, ELASTIC)
    assert hz[found.step : found.step + 2].tolist() == [168.328, 169.137]
    assert found.size == pytest.approx(15.05, rel=1e-3)
    assert found.what == "dissipation 15.1 times"


@pytest.mark.parametrize("rounding", [0.0, 1e-17, 0.5 * LOSS_SEEN * ELASTIC])
def test_slip_that_begins_is_no_jump(rounding: float) -> None:
    """From rounding to a share of the largest dissipation in one step, and slower from there on."""
    loss = np.array([rounding, rounding, 0.0, 3e-3, 3.4e-3, 3.8e-3, 4e-3])
    amplitude, few = np.linspace(1.0, 1.5, loss.size), np.ones(loss.size, dtype=bool)
    assert jumps(amplitude, loss, few, ELASTIC) == ()
    assert jumps(amplitude[::-1], loss[::-1], few, ELASTIC) == ()
    # the same step from what is more than rounding is one
    seen = np.where(loss < 3e-3, 2.0 * LOSS_SEEN * ELASTIC, loss)
    assert [j.step for j in jumps(amplitude, seen, few, ELASTIC)] == [2]


def test_slip_that_grows_evenly_is_no_jump() -> None:
    loss = np.array([1e-7, 1e-5, 4e-4, 8e-4, 1.2e-3, 1.6e-3])
    assert jumps(np.ones(6), loss, np.ones(6, dtype=bool), ELASTIC) == ()
