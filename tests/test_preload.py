"""Static equilibrium against closed forms of a block in a groove of two 45° contacts."""

import numpy as np
import pytest
from models import blades_and_damper, table

from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import SingularError
from stickslip.model.structure import Structure
from stickslip.response.preload import preload
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
    return System(
        structure, Interface(("left", "right"), (law, law), gap), np.array([0]), free=np.arange(n)
    )


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


def test_unheld_coordinate_is_named():
    system = groove(1e6, 0.3, dofs=("x", "y", "z"))
    with pytest.raises(
        SingularError, match=r"coordinate node1\.y is held by nothing even with all contacts stuck"
    ):
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
