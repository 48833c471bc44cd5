"""Wedge, cylinder and own points: mass, inertia, points, places, and what rotation does to a body."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from stickslip import Study
from stickslip.assembly.assembling import assemble
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.part import damper_part
from stickslip.model.rigid.body import RigidBody, body_of_tensor
from stickslip.model.rigid.dampers import CylinderDamper, WedgeDamper, grow_within
from stickslip.units import RPM

DEG = math.pi / 180
OBLIQUE = Axis(direction=(0.3, -0.5, 1.0), origin=(0.1, 0.2, -0.3))
WEDGE = WedgeDamper(left_angle=40 * DEG, right_angle=65 * DEG, top_width=0.004, height=0.012, length=0.05, mass=0.09)


def cloud(damper, count=160_000):
    """Points that fill a damper evenly: a quasi-random section times the length."""
    corners = damper.outline()
    low, high = corners.min(axis=0), corners.max(axis=0)
    i = np.arange(count)
    unit = np.column_stack([(i * a) % 1 for a in (0.7548776662466927, 0.5698402909980532)])
    xz = low + unit * (high - low)
    after = np.roll(corners, -1, axis=0) - corners
    side = [d[0] * (xz[:, 1] - c[1]) - d[1] * (xz[:, 0] - c[0]) for c, d in zip(corners, after, strict=True)]
    inside = np.all(np.array(side) <= 0, axis=0) | np.all(np.array(side) >= 0, axis=0)
    xz = xz[inside]
    y = ((np.arange(len(xz)) * 0.6180339887498949) % 1 - 0.5) * damper.length
    return np.column_stack([xz[:, 0], y, xz[:, 1]]), np.prod(high - low) * inside.mean()


@pytest.mark.parametrize(
    "damper",
    [
        WEDGE,
        replace(WEDGE, right_angle=90 * DEG, top_width=0.0),
        CylinderDamper(left_angle=40 * DEG, right_angle=60 * DEG, radius=0.006, length=0.04, mass=0.05),
    ],
)
def test_centre_and_inertia_are_those_of_the_matter(damper):
    points, area = cloud(damper)
    body = damper.body()
    centre = points.mean(axis=0)
    np.testing.assert_allclose(body.centre, centre, atol=2e-4 * damper.length)
    arm = points - centre
    tensor = body.mass * (np.eye(3) * np.mean(np.sum(arm**2, axis=1)) - arm.T @ arm / len(arm))
    # the polygon of the cylinder is 0.3 % smaller than the circle
    np.testing.assert_allclose(body.tensor, tensor, atol=4e-3 * tensor.max())
    dense = replace(damper, mass=None, density=7850.0).body()
    assert dense.mass == pytest.approx(7850.0 * area * damper.length, rel=4e-3)
    np.testing.assert_allclose(dense.tensor / dense.mass, body.tensor / body.mass, atol=1e-15)


def test_the_moments_of_a_triangular_wedge_are_the_textbook_ones():
    b, h, length, mass = 0.02, 0.01, 0.05, 0.1
    angle = math.atan2(h, b / 2)
    body = WedgeDamper(left_angle=angle, top_width=0.0, height=h, length=length, mass=mass).body()
    about = mass * np.array([h**2 / 18 + length**2 / 12, h**2 / 18 + b**2 / 24, b**2 / 24 + length**2 / 12])
    np.testing.assert_allclose(body.tensor, np.diag(about), rtol=1e-12)
    np.testing.assert_allclose(body.centre, [0, 0, -2 * h / 3], atol=1e-15)


def test_points_of_a_wedge_lie_on_its_sides_and_look_out():
    part = damper_part(WEDGE)
    assert list(part.surfaces) == ["left", "right"]
    corners = WEDGE.outline()
    for side, (a, b), angle in (("left", corners[[2, 3]], 40), ("right", corners[[0, 1]], 65)):
        points = part.surfaces[side]
        xz = points.position[:, [0, 2]]
        along = (xz - a) @ (b - a) / ((b - a) @ (b - a))
        np.testing.assert_allclose(xz, a + along[:, None] * (b - a), atol=1e-15)
        np.testing.assert_allclose(sorted(set(np.round(along, 9))), [1 / 6, 1 / 2, 5 / 6])
        np.testing.assert_allclose(sorted(set(np.round(points.position[:, 1], 9))), [-1 / 60, 0, 1 / 60])
        normal = points.frame[:, :, 2]
        sign = -1 if side == "left" else 1
        np.testing.assert_allclose(normal[0], [sign * math.sin(angle * DEG), 0, math.cos(angle * DEG)])
        assert np.all((points.position - np.array(WEDGE.body().centre))[:, [0, 2]] @ normal[0, [0, 2]] > 0)
        np.testing.assert_allclose(np.linalg.det(points.frame), 1.0)
    assert part.surfaces["right"].names[0] == "R1.1"


def test_a_cylinder_touches_both_planes_through_the_apex():
    damper = CylinderDamper(left_angle=40 * DEG, right_angle=60 * DEG, radius=0.006, length=0.04, mass=0.05)
    centre = np.array(damper.body().centre)
    for side in ("left", "right"):
        points = damper_part(damper).surfaces[side]
        normal = points.frame[0, :, 2]
        np.testing.assert_allclose(points.position @ normal, 0.0, atol=1e-15)  # the plane holds the origin
        away = points.position - centre - np.outer(points.position[:, 1], [0, 1, 0])
        np.testing.assert_allclose(away, np.tile(0.006 * normal, (3, 1)), atol=1e-15)


def test_a_moved_body_has_its_tensor_in_the_axes_of_the_model():
    turn = OBLIQUE.rotation(0.7)
    body = WEDGE.body()
    there = body.moved(turn, np.array([0.1, 0.2, 0.3]))
    np.testing.assert_allclose(there.tensor, turn @ body.tensor @ turn.T, rtol=1e-12, atol=1e-18)
    np.testing.assert_array_equal(there.structure().mass[3:, 3:], there.tensor)
    np.testing.assert_allclose(there.centre, turn @ body.centre + [0.1, 0.2, 0.3])
    again = body_of_tensor(there.mass, there.tensor, np.array(there.centre))
    np.testing.assert_allclose(again.tensor, there.tensor, atol=1e-12 * there.tensor.max())


def test_spin_softening_and_gyroscopic_matrix_are_derivatives_of_the_exact_energies():
    """Six points with masses, moved rigidly by rotation vectors without any linearisation."""
    rng = np.random.default_rng(2)
    weights, points = rng.uniform(0.1, 0.3, 6), rng.uniform(0.28, 0.32, (6, 3))
    centre = weights @ points / weights.sum()
    arm = points - centre
    square = np.einsum("p,pi,pj->ij", weights, arm, arm)
    body = body_of_tensor(weights.sum(), np.trace(square) * np.eye(3) - square, centre)
    speed, h = 40.0, 1e-4
    spin = speed * OBLIQUE.unit

    def moved(q):
        return centre + q[:3] + Rotation.from_rotvec(q[3:]).apply(arm)

    def velocity(q):  # of steady rotation
        return np.cross(spin, moved(q) - np.array(OBLIQUE.origin))

    def potential(q):
        return -0.5 * weights @ np.sum(velocity(q) ** 2, axis=1)

    def along(q):  # a_i = sum m dx/dq_i . velocity
        ways = [(moved(q + h * e) - moved(q - h * e)) / (2 * h) for e in np.eye(6)]
        return np.array([weights @ np.sum(way * velocity(q), axis=1) for way in ways])

    unit = h * np.eye(6)
    hessian = np.array(
        [[potential(a + b) - potential(a - b) - potential(b - a) + potential(-a - b) for a in unit] for b in unit]
    ) / (4 * h * h)
    steps = np.array([(along(a) - along(-a)) / (2 * h) for a in unit]).T
    found = body.at_speed(speed, OBLIQUE, coriolis=True)
    for mine, exact in ((found.stiffness, hessian), (found.damping, steps - steps.T)):
        for rows in (slice(0, 3), slice(3, 6)):
            for columns in (slice(0, 3), slice(3, 6)):
                scale = np.sqrt(np.abs(mine[rows, rows]).max() * np.abs(mine[columns, columns]).max())
                assert np.abs(mine - exact)[rows, columns].max() < 1e-4 * scale
    force = -np.array([potential(a) - potential(-a) for a in unit]) / (2 * h)
    np.testing.assert_allclose(body.centrifugal(speed, OBLIQUE), force, rtol=1e-5, atol=1e-6)
    assert not body.at_speed(speed, OBLIQUE).damping.any()


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"mass": None}, "WedgeDamper.mass: is missing, and so is the density. Give one of them"),
        ({"density": 7800.0}, "WedgeDamper.mass: and the density are both given"),
        ({"mass": 0.0}, "WedgeDamper.mass: must be positive"),
        ({"left_angle": math.pi / 2, "right_angle": math.pi / 2}, "WedgeDamper.right_angle: is upright"),
        ({"left_distances": (0.001, 0.01)}, "left_distances: must grow and lie on the side, from 0.00"),
        ({"right_distances": (0.012, 0.01)}, "right_distances: must grow and lie on the side"),
        ({"sections": (0.0, 0.03)}, "sections: must grow and lie within half the length, 0.025 m"),
    ],
)
def test_a_wedge_that_cannot_be_is_refused(change, match):
    with pytest.raises(InputError, match=match):
        replace(WEDGE, **change)


@pytest.mark.parametrize(
    ("places", "within"),
    [
        ((-1.0, 0.0, 3.0), True),
        ((-1.0 - 1e-10, 3.0 + 1e-10), True),
        ((-1.0 - 1e-8, 3.0), False),
        ((-1.0, 3.0 + 1e-8), False),
        ((0.0, 0.0), False),
        ((1.0, 0.0), False),
        ((0.5,), True),
    ],
)
def test_places_lie_on_a_side_up_to_its_ends_and_grow(places, within):
    assert grow_within(places, -1.0, 3.0) is within


def test_axes_of_a_body_are_square_to_each_other():
    with pytest.raises(InputError, match=r"RigidBody\.axes: are no three unit vectors"):
        RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), centre=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0), (0, 1, 1)))


RIM = """
schema_version = 2
title = "A body pressed on a rim by its own rotation"

[part.body]
shape = "rigid_body"
mass_kg = 0.05
inertia_kg_m2 = [1e-6, 1e-6, 1e-6]
centre_m = [0.3, 0.0, 0.0]

[part.body.surfaces.top]
points_m = [[0.31, 0.01, 0.0], [0.31, -0.005, 0.008], [0.31, -0.005, -0.008]]
normal = [1.0, 0.0, 0.0]

[part.held]
shape = "lumped"
masses_kg = [1.0]
springs_n_per_m = [["ground", 1, 1e6]]

[contact.rim]
between = ["body.top", "ground"]
law = "elastic_coulomb"
normal_stiffness_n_per_m = 1e6
tangential_stiffness_n_per_m = 1e6
axial_stiffness_n_per_m = 1e6
friction_coefficient = 0.3

[rotation]
speed_rpm = 1000.0

[load.shaker]
on = "body"
direction = "x"
force_n = 1.0

[forced_response]
frequencies_hz = [100.0]
"""


def test_rotation_alone_presses_a_body_where_no_part_is_a_mesh(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(RIM)
    force = assemble(Study.from_file(path).model(), 1).static_force
    growth = 0.05 * (1000.0 * RPM) ** 2  # N/m: the further out, the stronger it is pulled
    assert force[:, 2].sum() == pytest.approx(-growth * 0.3 / (1.0 - growth / 1e6), rel=1e-9)


@pytest.mark.parametrize("rpm", [5.0, 1000.0])
def test_a_body_that_rotation_takes_off_its_seat_is_refused_however_slow(tmp_path: Path, rpm: float) -> None:
    path = tmp_path / "study.toml"
    inside = RIM.replace("0.31, ", "0.29, ").replace("normal = [1.0", "normal = [-1.0")
    path.write_text(inside.replace("speed_rpm = 1000.0", f"speed_rpm = {rpm}"))
    with pytest.raises(InputError, match=r"rotation.speed_rpm: pulls part.body off"):
        assemble(Study.from_file(path).model(), 1)
