"""Static equilibrium of dampers: the linear program against closed forms, and the words of check."""

import numpy as np
import pytest

from stickslip.analyses.forced_response.physics.limits import angle_sentence, slip_sentence
from stickslip.response.damper_statics import Flank, largest_ratios, statics_of

PULL = np.array([0.0, 0.0, 1.0])


def flank(name: str, points: list[list[float]], normal: list[float], mu: float) -> Flank:
    """Return a flank in the plane x, z that pushes its platform along minus `normal`; t lies in the plane, w along y."""
    n = np.array(normal) / np.linalg.norm(normal)
    w = np.array([0.0, 1.0, 0.0])
    t = np.cross(w, n)
    p = np.array(points)
    return Flank(
        name, np.tile([t, w, n], (len(p), 1, 1)), p, np.tile([0.0, 0.0, -1.0], (len(p), 1)), np.full(len(p), mu)
    )


def cylinder(left_deg: float, right_deg: float, mu: float, r: float = 0.005) -> tuple[Flank, Flank]:
    """Return both lines of a cylinder under undersides at these angles to the pull along z."""
    found = []
    for name, angle, side in (("left", left_deg, -1.0), ("right", right_deg, 1.0)):
        a = np.radians(angle)
        n = -np.array([side * np.cos(a), 0.0, np.sin(a)])
        found.append(flank(name, [(-r * n + [0.0, y, 0.0]).tolist() for y in (-0.01, 0.01)], n.tolist(), mu))
    return found[0], found[1]


def in_the_plane(flanks: tuple[Flank, Flank], k: int) -> tuple[float, float]:
    """Return the largest T/N of flank `k` in both senses by brute force: three equations for two forces of two lines, one parameter left."""
    rows = []
    for one in flanks:
        at, (t, _, n) = one.points.mean(axis=0), one.directions[0]
        rows += [[d[0], d[2], at[2] * d[0] - at[0] * d[2]] for d in (t, -n)]  # a normal force pushes along minus n
    matrix = np.array(rows).T  # T and N of the first flank, then of the second
    base = np.linalg.lstsq(matrix, np.array([0.0, 1.0, 0.0]), rcond=None)[0]
    free = np.linalg.svd(matrix)[2][-1]
    every = base + np.linspace(-300.0, 300.0, 1_200_001)[:, None] * free
    friction, normal = every[:, ::2], every[:, 1::2]
    mu = np.array([one.mu[0] for one in flanks])
    allowed = np.all((normal >= 0.0) & (np.abs(friction) <= mu * normal * (1 + 1e-9)), axis=1)
    ratio = friction[allowed, k] / normal[allowed, k]
    return float(ratio.max()), float(-ratio.min())


@pytest.mark.parametrize("k", [0, 1])
@pytest.mark.parametrize(("left", "right", "mu"), [(45.0, 45.0, 0.3), (60.0, 30.0, 0.5), (20.0, 70.0, 0.2)])
def test_the_largest_ratio_of_two_lines_is_that_of_the_equations(k: int, left: float, right: float, mu: float) -> None:
    """Steps of 5e-4 N in the one free parameter of the brute force bound the ratio to 1e-3; the program is exact."""
    flanks = cylinder(left, right, mu)
    found = largest_ratios(flanks, k, np.r_[PULL, 0.0, 0.0, 0.0])
    assert found == pytest.approx(in_the_plane(flanks, k), abs=1e-3)


def test_equal_friction_on_both_lines_of_a_cylinder_leaves_the_wider_one_stuck() -> None:
    """No moment acts, so both lines carry the same T: the one with the larger normal force has the smaller T/N.

    Undersides at angles a and b to the pull: without friction N sin-rule, N_a / N_b = cos b / cos a. The flank at 60 degrees carries more.
    """
    left, right = cylinder(60.0, 30.0, 0.2)
    found = statics_of("damper", _pressed((left, right), np.r_[PULL, 0.0, 0.0, 0.0]))
    assert found is not None
    at_60, at_30 = found.flanks
    assert at_30.slips
    assert not at_60.slips
    assert at_60.angle_deg == pytest.approx(30.0)
    # between T = mu N of the other line and the smaller normal forces beside it
    assert 0.0 < min(at_60.most) < 0.2
    assert slip_sentence(at_60).startswith("left cannot slip to and fro, T/N reaches only 0.")
    assert slip_sentence(at_30) == "right can slip to and fro, T/N reaches the friction coefficient 0.2"
    # its own angle lies in the ranges in which it cannot slip, and that of the other does not
    assert any(low <= 30.0 <= high for low, high in at_60.held_deg)
    assert not any(low <= 60.0 <= high for low, high in at_30.held_deg)
    assert angle_sentence(at_60).startswith("left is inclined by 30 degrees (0 is square to the pull); it cannot slip ")


def test_a_line_carries_the_pull_of_its_points() -> None:
    """Force and moment of the flanks at rest balance the pull, and a turn moves neither the middle nor the length of a flank."""
    flanks = _pressed(cylinder(45.0, 45.0, 0.3), np.r_[PULL, 0.0, 0.0, 0.0])
    assert np.sum([f.wrench for f in flanks], axis=0) == pytest.approx(np.r_[PULL, 0.0, 0.0, 0.0], abs=1e-12)
    turned = flanks[0].turned(0.3, np.array([0.0, 1.0, 0.0]))
    assert turned.points.mean(axis=0) == pytest.approx(flanks[0].points.mean(axis=0))
    n, other = flanks[0].directions[0, 2], turned.directions[0, 2]
    assert np.arccos(n @ other) == pytest.approx(0.3)
    assert np.cross(n, other) @ np.array([0.0, 1.0, 0.0]) == pytest.approx(np.sin(0.3))


def test_an_open_flank_has_no_statics() -> None:
    left, right = cylinder(45.0, 45.0, 0.3)
    assert (
        statics_of("damper", (left, Flank("right", right.directions, right.points, 0.0 * right.force, right.mu)))
        is None
    )


def _pressed(flanks: tuple[Flank, Flank], pull: np.ndarray) -> tuple[Flank, Flank]:
    """Return the flanks with normal forces alone that balance a pull."""
    columns = np.hstack([-f.wrenches[:, 2].T for f in flanks])
    normal = np.split(np.linalg.lstsq(columns, pull, rcond=None)[0], 2)
    made = []
    for f, n in zip(flanks, normal, strict=True):
        made.append(Flank(f.name, f.directions, f.points, np.outer(-n, [0.0, 0.0, 1.0]), f.mu))
    return made[0], made[1]
