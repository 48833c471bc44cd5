"""The rigid body and the flat-curved damper: frames, kinematics, statics, messages."""

import math

import numpy as np
import pytest
from small_v2 import write_two_blades

from stickslip.assembly.assembling import assemble
from stickslip.errors import InputError
from stickslip.model.rigid.body import RigidBody
from stickslip.model.rigid.dampers import FlatCurvedDamper, gap_operator
from stickslip.study.models.study import read_study


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


def test_default_mass_and_inertia_are_those_of_a_titanium_prism():
    """A prism of 40 mm with the outline's section, of titanium: what the defaults say they are."""
    damper, length, density = FlatCurvedDamper(), 0.040, 4430.0
    x, z = damper.outline().T
    x_next, z_next = np.roll(x, -1), np.roll(z, -1)
    cross = z * x_next - x * z_next
    area = cross.sum() / 2
    assert area > 0, "clockwise"
    assert np.ptp(damper.sections) < length
    # the stated numbers are rounded to about 1 %
    mass = density * area * length
    assert mass == pytest.approx(damper.mass, rel=0.01)
    centre = np.array([((x + x_next) * cross).sum(), ((z + z_next) * cross).sum()]) / (6 * area)
    np.testing.assert_allclose(centre, damper.centre_of_mass[[0, 2]], atol=2e-4)
    second = [((a**2 + a * b + b**2) * cross).sum() / 12 for a, b in ((z, z_next), (x, x_next))]
    about_z, about_x = (mass * (s / area - c**2) for s, c in zip(second, centre[::-1], strict=True))
    axial = mass * length**2 / 12
    expected = (about_z + axial, about_x + about_z, about_x + axial)
    np.testing.assert_allclose(damper.inertia, expected, rtol=0.02)


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"curved_distance": 0.02},
        {"curved_distance": 0.001, "flat_distances": (0.01, 0.03)},  # R above L1
        {"curved_distance": 0.02, "flat_distances": (0.002, 0.015)},  # R below L2
        {"curved_distance": 0.012, "curved_radius": 0.008},  # the arc's circle ends above L2
        {"flat_angle": math.radians(30), "curved_angle": math.radians(55)},
    ],
)
def test_outline_touches_both_platforms_at_the_contact_lines_only(change):
    damper = FlatCurvedDamper(**change)
    outline = damper.outline() - damper.apex
    lines = damper.contact_points().position[::3][:, [0, 2]] - damper.apex
    np.testing.assert_allclose(outline[[0, -1]], lines[:2], atol=1e-16)
    for normal in (damper.flat_normal, damper.curved_normal):
        assert np.max(outline @ normal[[0, 2]]) < 1e-16, "a corner lies inside a platform"
    # R lies on the arc: off the polygon by no more than the rise of one of its segments
    a, b = outline[1:-2], outline[2:-1]
    along = np.clip(np.sum((lines[2] - a) * (b - a), 1) / np.sum((b - a) ** 2, 1), 0.0, 1.0)
    distance = np.linalg.norm(a + along[:, None] * (b - a) - lines[2], axis=1).min()
    longest = np.linalg.norm(b - a, axis=1).max()
    assert distance <= longest**2 / (8 * damper.curved_radius) * 1.01 + 1e-16


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
    operator = gap_operator(points, np.arange(27).reshape(9, 3), np.arange(27, 33), 33, damper.body())
    inward = np.zeros(33)
    inward[29] = -1.0
    gap = (operator @ inward).reshape(9, 3)
    angles = np.where([side == "flat" for side in points.side], damper.flat_angle, damper.curved_angle)
    np.testing.assert_allclose(gap[:, 2], np.cos(angles))
    np.testing.assert_allclose(gap[:, 1], 0.0, atol=1e-15)


def test_pressed_outward_all_nine_points_are_in_compression(tmp_path):
    """The example on a coarse mesh, its contacts free to slip and to open; no spring helps."""
    path = write_two_blades(tmp_path, {"reduction.fixed_interface_modes": "2", "retention.stiffness_n_per_m": "0.0"})
    found = assemble(read_study(path).model(), 1)
    pull = 442.0
    assert found.contacts.names == ("L1.1", "L1.2", "L1.3", "L2.1", "L2.2", "L2.3", "R.1", "R.2", "R.3")
    assert np.max(found.static_force[:, 2]) < -0.02 * pull
    held = found.system.interface.gap_operator.T @ found.static_force.ravel()
    dofs = [i for i, part in enumerate(found.system.structure.dofs.part) if part == "damper"]
    # Newton's tolerance, 1e-10 of the load
    np.testing.assert_allclose(held[dofs], [0.0, 0.0, pull, 0.0, 0.0, 0.0], atol=1e-9 * pull)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mass": -0.1}, "FlatCurvedDamper.mass: must be positive, got -0.1"),
        ({"mass": math.nan}, "must be positive, got nan"),
        ({"inertia": (1e-5, 0.0, 1e-5)}, "FlatCurvedDamper.inertia: must be positive"),
        ({"inertia": (1e-6, 1e-6, 1e-5)}, "largest moment exceeds"),
        ({"centre": (0.0, math.inf, 0.0)}, "FlatCurvedDamper.centre: must be finite"),
        ({"flat_angle": 45.0}, r"FlatCurvedDamper.flat_angle: must lie in \(0, 1.571\)"),
        ({"flat_distances": (0.009, 0.007)}, "need 0 < L1 < L2"),
        ({"curved_distance": 0.0}, "curved_distance: must be positive"),
        ({"sections": (0.01, 0.0)}, "in increasing order"),
    ],
)
def test_bad_input_is_named(change, message):
    with pytest.raises(InputError, match=message):
        FlatCurvedDamper(**change)
