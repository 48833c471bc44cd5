"""Static equilibrium against closed forms of a block in a groove of two 45° contacts."""

from dataclasses import replace

import numpy as np
import pytest
from models import free_body_3d, table

from evidence.models.lumped import blades_and_damper
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import SingularError
from stickslip.model.structure import Structure
from stickslip.response.equilibrium import preload
from stickslip.response.system import System

K_N, LOAD = 2e6, 100.0


def groove(k_t, mu, dofs=("x", "z"), k_w=0.0):
    """A block pressed upwards (+z) into a groove whose two sides stand at 45°."""
    n = len(dofs)
    z = dofs.index("z")
    half = np.sqrt(0.5)
    gap = np.zeros((6, n))
    for contact, side in enumerate((-1.0, 1.0)):
        # the normal points out of the block: up and to the side
        gap[3 * contact, [0, z]] = -half, side * half
        gap[3 * contact + 2, [0, z]] = -side * half, -half
        if "y" in dofs:
            gap[3 * contact + 1, dofs.index("y")] = -1.0
    law = ElasticCoulomb(k_t=k_t, k_w=k_w, k_n=K_N, mu=mu)
    structure = Structure(0.1 * np.eye(n), np.zeros((n, n)), np.zeros((n, n)), table(dofs))
    return System(structure, Interface(("left", "right"), (law, law), gap), np.array([0]), free=np.arange(n))


def test_block_that_sticks():
    # each contact gives (k_n + k_t)/2 vertically
    q = preload(groove(1e6, 0.8), np.array([0.0, LOAD]))
    assert q[1] == pytest.approx(LOAD / (K_N + 1e6), rel=1e-12)
    assert q[0] == pytest.approx(0.0, abs=1e-18)


def test_block_that_slips_in():
    # k_t > mu k_n: both sides slide, sqrt(2) N (1 + mu) = P
    mu = 0.3
    q = preload(groove(1e6, mu), np.array([0.0, LOAD]))
    assert q[1] == pytest.approx(LOAD / (K_N * (1 + mu)), rel=1e-10)
    assert q[0] == pytest.approx(0.0, abs=1e-16)


def test_block_without_friction():
    q = preload(groove(1e6, 0.0), np.array([0.0, LOAD]))
    assert q[1] == pytest.approx(LOAD / K_N, rel=1e-10)


def test_sideways_load_that_opens_one_side():
    # a sideways force larger than the upward one opens the left side; the right one alone is a k_n and a k_t spring
    x, z = preload(groove(1e6, 2.0), np.array([1.2 * LOAD, LOAD]))
    assert x - z > 0, "the left side is open"
    assert x + z == pytest.approx((1.2 + 1.0) * LOAD / K_N, rel=1e-10)
    assert x - z == pytest.approx((1.2 - 1.0) * LOAD / 1e6, rel=1e-10)


def test_equilibrium_holds_the_load():
    system, load = blades_and_damper(m=None)
    q = preload(system, load.static)
    b = system.interface.gap_operator
    gap = b @ q
    normal = np.maximum(-3e5 * gap[2::3], 0.0)
    tangent = np.clip(3e5 * gap[0::3], -0.5 * normal, 0.5 * normal)
    force = np.zeros(6)
    force[0::3], force[2::3] = tangent, -normal
    assert np.allclose(system.structure.stiffness @ q + b.T @ force, load.static, rtol=0, atol=1e-8)


def test_no_load_no_displacement():
    assert not np.any(preload(groove(1e6, 0.3), np.zeros(2)))


def test_a_preload_of_the_contacts_is_a_load():
    # the two contacts push the free body with their preload although no force acts on it from outside
    system = free_body_3d(preload=30.0)[0].with_retention(1e3)
    q = preload(system, np.zeros(12))
    b = system.interface.gap_operator
    gap = b @ q
    normal = np.array([30.0, 15.0]) - 3e5 * gap[2::3]
    assert np.all(normal > 0.0)
    force = np.zeros(6)
    for direction, k in ((0, 2e5), (1, 1e5)):
        force[direction::3] = np.clip(k * gap[direction::3], -0.4 * normal, 0.4 * normal)
    force[2::3] = -normal
    pushed = b.T @ np.array([0, 0, -30.0, 0, 0, -15.0])
    assert np.max(np.abs(pushed)) > 20.0
    # Newton's tolerance, 1e-10 of the preload
    assert np.allclose(system.structure.stiffness @ q, -(b.T @ force), rtol=0, atol=1e-8)


@pytest.mark.parametrize("share", [1e-12, 1e-9, 1e-6, 1e-4, 1e-2])
def test_a_tiny_load_beside_a_preload_moves_the_seat_by_little(share):
    # forces are measured by the largest of load and preloads: by the load alone no residual could ever be small enough
    system = free_body_3d(preload=30.0)[0].with_retention(1e3)
    seat = preload(system, np.zeros(12))
    moved = preload(system, share * np.ones(12)) - seat
    whole = preload(system, 1e-2 * np.ones(12)) - seat
    # the same contacts stick and slip at all of them: the seat moves in proportion, up to Newton's tolerance of the preload
    rounding = 1e-9 * np.max(np.abs(seat))
    np.testing.assert_allclose(moved, whole * share / 1e-2, rtol=1e-6, atol=rounding)
    assert np.max(np.abs(whole)) > 100 * rounding


@pytest.mark.parametrize("m", [0.0, 0.7, -1.0])
@pytest.mark.parametrize("k_w", [0.0, 1e6])
def test_residual_traction_does_not_move_the_seat(m, k_w):
    # a residual traction is a force without a stiffness: it chooses a mean of the vibration, not the seat of the body
    dofs = ("x", "z") if k_w == 0.0 else ("x", "y", "z")
    load = np.array([0.0] * (len(dofs) - 1) + [LOAD])
    system = groove(1e6, 0.3, dofs, k_w)
    laws = tuple(replace(law, residual_traction=m) for law in system.interface.laws)
    leaning = replace(system, interface=replace(system.interface, laws=laws))
    assert np.array_equal(preload(leaning, load), preload(system, load))


@pytest.mark.parametrize("seed", range(6))
def test_a_rotation_that_two_points_do_not_hold_is_named(seed):
    # two point contacts leave the rotation about the line through them: singular up to rounding only
    system, load = free_body_3d(seed, preload=0.0)
    with pytest.raises(SingularError, match=r"coordinate (node\d+\.)?\w+ is held by nothing"):
        preload(system, load.static)


def test_unheld_coordinate_is_named():
    system = groove(1e6, 0.3, dofs=("x", "y", "z"))
    with pytest.raises(SingularError, match=r"coordinate node1\.y is held by nothing even with all contacts stuck"):
        preload(system, np.array([0.0, 0.0, LOAD]))
    # a retention spring or a tangential stiffness holds it
    assert preload(system.with_retention(10.0), np.array([0.0, 0.0, LOAD]))[1] == 0.0
    assert preload(groove(1e6, 0.3, ("x", "y", "z"), k_w=1e6), np.array([0.0, 0.0, LOAD]))[1] == 0.0


def test_load_that_pulls_the_block_out():
    with pytest.raises(SingularError, match="presses the damper against both platforms"):
        preload(groove(1e6, 0.3), np.array([0.0, -LOAD]))


def test_retention_carries_the_block_where_contacts_do_not():
    q = preload(groove(1e6, 0.3).with_retention(50.0), np.array([0.0, -LOAD]))
    assert q[1] == pytest.approx(-LOAD / 50.0, rel=1e-9)
