"""Where contacts are, and the assembly of their derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from models import griffin

from stickslip.contact.interface import Interface, add_contact_jacobian, sparse_rows
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError

LAW = ElasticCoulomb(k_t=1.0, k_w=2.0, k_n=3.0, mu=0.5, preload=4.0)


def test_numbers_must_agree():
    with pytest.raises(InputError, match="2 contact names, 1 laws, 6 rows of the gap operator"):
        Interface(("a", "b"), (LAW,), np.zeros((6, 4)))
    with pytest.raises(InputError, match="1 contact names, 1 laws, 2 rows"):
        Interface(("a",), (LAW,), np.zeros((2, 4)))


def test_coordinates_and_restriction():
    gap = np.zeros((3, 5))
    gap[0, 3], gap[2, 1] = 1.0, -2.0
    interface = Interface(("a",), (LAW,), gap)
    assert interface.coordinates().tolist() == [1, 3]
    small = interface.restricted(interface.coordinates())
    u = np.arange(5.0)
    assert np.array_equal(small.gap_operator @ u[[1, 3]], gap @ u)
    assert interface.stuck_stiffness().tolist() == [1.0, 2.0, 3.0]
    row = interface.compiled().elements[0]
    assert row[:5].tolist() == [1.0, 2.0, 3.0, 0.5, 4.0]
    assert np.isnan(row[5])
    assert interface.resting_force().tolist() == [0.0, 0.0, -4.0]


@pytest.mark.parametrize("empty_contact", [False, True])
def test_sparse_assembly_is_the_dense_product(empty_contact):
    rng = np.random.default_rng(0)
    n, n_contacts, m = 7, 3, 5
    gap = rng.standard_normal((9, n)) * (rng.random((9, n)) < 0.4)
    gap[0, 0] = 1.0
    if empty_contact:
        gap[3:6] = 0.0
    blocks = rng.standard_normal((n_contacts, 5, m, m))
    rows = sparse_rows(gap)
    jac = np.asfortranarray(rng.standard_normal((m * n, m * n)))
    before = jac.copy()
    add_contact_jacobian(blocks, rows.columns, rows.values, n, 0.7, jac)
    want = np.zeros_like(jac)
    for c in range(n_contacts):
        full = np.zeros((3, 3, m, m))
        for block, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 2), (1, 2))):
            full[i, j] = blocks[c, block]
        b = gap[3 * c : 3 * c + 3]
        want += np.einsum("ia,ijpq,jb->paqb", b, full, b).reshape(m * n, m * n)
    assert np.allclose(jac - before, 0.7 * want, rtol=0, atol=1e-12)


def test_system_needs_an_interface_on_its_own_dofs():
    system, _ = griffin(0.1)
    with pytest.raises(InputError, match="the gap operator has 2 columns for 1 dofs"):
        replace(system, interface=Interface(("a",), (LAW,), np.zeros((3, 2))))
