"""The rigid body and the flat-curved damper: frames, kinematics, statics, messages."""

import math

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.model.damper import FlatCurvedDamper, gap_operator
from stickslip.model.rigid_body import RigidBody

# contact stiffness of the whole interface, N/m, in t, w, n; shared among the points of a side
SIDE_STIFFNESS = {"flat": (450e6, 450e6, 520e6), "curved": (20e6, 450e6, 25e6)}


def point_stiffness(points):
    share = {side: points.side.count(side) for side in SIDE_STIFFNESS}
    return np.concatenate([np.array(SIDE_STIFFNESS[s]) / share[s] for s in points.side])


def test_nine_points_three_a_line():
    points = FlatCurvedDamper().contact_points()
    assert points.names == ("L1.1", "L1.2", "L1.3", "L2.1", "L2.2", "L2.3", "R.1", "R.2", "R.3")
    assert points.side == ("flat",) * 6 + ("curved",) * 3
    for line in ("L1", "L2", "R"):
        assert np.all(np.diff(points.position[points.on_line(line), 1]) > 0)


@pytest.mark.parametrize("angles", [(45, 45), (30, 55)])
def test_frames_are_orthonormal_right_handed_and_point_into_the_blades(angles):
    flat, curved = np.radians(angles)
    points = FlatCurvedDamper(flat_angle=flat, curved_angle=curved).contact_points()
    for side, frame in zip(points.side, points.frame, strict=True):
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-15)
        assert np.linalg.det(frame) == pytest.approx(1.0)
        assert abs(frame[1, 1]) == 1.0  # w = ±y
        assert frame[2, 2] > 0  # outward: the platforms are above the damper
        assert (frame[0, 2] < 0) == (side == "flat")  # the flat side faces the left blade


def test_points_lie_on_planes_through_the_apex():
    damper = FlatCurvedDamper(flat_angle=math.radians(40), curved_angle=math.radians(50))
    points = damper.contact_points()
    apex = np.array([damper.apex[0], 0.0, damper.apex[1]])
    height = np.einsum("pi,pi->p", points.position - apex, points.frame[:, :, 2])
    np.testing.assert_allclose(height, 0.0, atol=1e-17)


def test_displacement_operator_is_a_rotation_to_first_order():
    body = RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), centre=(0.1, -0.2, 0.3))
    points = np.random.default_rng(1).standard_normal((5, 3))
    theta = np.array([0.3, -0.7, 0.2])
    moved = body.displacement_operator(points) @ np.concatenate([[1.0, 2.0, 3.0], theta])
    shift = np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(moved, shift + np.cross(theta, points - body.centre))


def test_default_mass_and_inertia_are_those_of_a_steel_prism():
    """Mass and inertia of the defaults are those of a steel prism with the outline's section."""
    damper = FlatCurvedDamper()
    x, z = damper.outline().T
    x_next, z_next = np.roll(x, -1), np.roll(z, -1)
    cross = z * x_next - x * z_next
    area = cross.sum() / 2
    centre = np.array([((x + x_next) * cross).sum(), ((z + z_next) * cross).sum()]) / (6 * area)
    assert area > 0
    length = damper.mass / (7850 * area)
    assert np.ptp(damper.sections) < length < 0.06
    # the outline is a sketch: the stated numbers are rounded to about 1 %
    np.testing.assert_allclose(centre, damper.centre_of_mass[[0, 2]], atol=2e-4)
    second = [((a**2 + a * b + b**2) * cross).sum() / 12 for a, b in ((z, z_next), (x, x_next))]
    about_z, about_x = (
        damper.mass * (s / area - c**2) for s, c in zip(second, centre[::-1], strict=True)
    )
    axial = damper.mass * length**2 / 12
    expected = (about_z + axial, about_x + about_z, about_x + axial)
    np.testing.assert_allclose(damper.inertia, expected, rtol=0.02)


def test_gap_operator_ignores_rigid_motion_of_everything():
    damper = FlatCurvedDamper()
    points, body = damper.contact_points(), damper.body()
    operator = gap_operator(points, np.arange(27).reshape(9, 3), np.arange(27, 33), 33, body)
    for motion in np.eye(6):
        blades = (body.displacement_operator(points.position) @ motion).ravel()
        gap = operator @ np.concatenate([blades, motion])
        np.testing.assert_allclose(gap, 0.0, atol=1e-15)


def test_gap_opens_when_the_damper_moves_inward():
    damper = FlatCurvedDamper()
    points = damper.contact_points()
    operator = gap_operator(
        points, np.arange(27).reshape(9, 3), np.arange(27, 33), 33, damper.body()
    )
    inward = np.zeros(33)
    inward[29] = -1.0
    gap = (operator @ inward).reshape(9, 3)
    np.testing.assert_allclose(gap[:, 2], math.cos(damper.flat_angle))
    np.testing.assert_allclose(gap[:, 1], 0.0, atol=1e-15)


def test_pressed_outward_all_nine_points_are_in_compression():
    """Rigid blades, bilateral springs: the resultant passes between L1 and L2."""
    damper = FlatCurvedDamper()
    points, body = damper.contact_points(), damper.body()
    to_frame = points.frame.transpose(0, 2, 1)
    closing = (to_frame @ body.displacement_operator(points.position)).reshape(27, 6)
    k = point_stiffness(points)
    motion = np.linalg.solve(closing.T @ (k[:, None] * closing), [0, 0, 1.0, 0, 0, 0])
    force = (k * (closing @ motion)).reshape(9, 3)
    assert force[:, 2].min() > 0.01  # of the load
    total = np.einsum("pij,pj->i", points.frame, force)
    np.testing.assert_allclose(total, [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": -0.1}, "RigidBody.mass: must be positive, got -0.1"),
        ({"mass": math.nan}, "must be positive, got nan"),
        ({"inertia": (1e-5, 0.0, 1e-5)}, "three positive moments"),
        ({"inertia": (1e-6, 1e-6, 1e-5)}, "largest moment exceeds"),
        ({"centre": (0.0, math.inf, 0.0)}, "three finite numbers"),
        ({"flat_angle": 45.0}, "FlatCurvedDamper.flat_angle: must lie between 0 and pi/2"),
        ({"flat_distances": (0.009, 0.007)}, "need 0 < L1 < L2"),
        ({"curved_distance": 0.0}, "curved_distance: must be positive"),
        ({"sections": (0.01, 0.0)}, "in increasing order"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(InputError, match=message):
        FlatCurvedDamper(**change)
