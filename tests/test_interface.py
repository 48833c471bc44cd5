"""Where contacts are, and the assembly of their derivatives."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st

from evidence.models.lumped import griffin
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


def random_operator(seed: int, n_contacts: int, n: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.standard_normal((3 * n_contacts, n)) * (rng.random((3 * n_contacts, n)) < 0.3)


@given(st.integers(0, 2**31), st.integers(0, 5), st.integers(1, 8), st.integers(1, 7))
@settings(max_examples=40, deadline=None)
def test_gaps_and_forces_by_contact_are_products_with_the_operator(seed, n_contacts, n, m):
    operator = random_operator(seed, n_contacts, n)
    rows = sparse_rows(operator)
    rng = np.random.default_rng(seed)
    vector, force = rng.standard_normal((m, n)), rng.standard_normal((m, 3 * n_contacts))
    # sums of a few numbers of size one
    np.testing.assert_allclose(rows.gaps(vector), vector @ operator.T, rtol=0, atol=1e-13)
    out = np.ones((m, n))
    rows.add_forces(force, out)
    np.testing.assert_allclose(out - 1.0, force @ operator, rtol=0, atol=1e-13)


@pytest.mark.parametrize("form", ["csr", "csc", "coo", "lil"])
def test_sparse_and_dense_operators_make_the_same_interface(form):
    dense = random_operator(4, 3, 9)
    dense[:, 5] = 0.0
    sparse = scipy.sparse.csr_array(dense).asformat(form)
    names, laws = ("a", "b", "c"), (LAW,) * 3
    one, other = (Interface(names, laws, operator) for operator in (dense, sparse))
    assert isinstance(one.gap_operator, scipy.sparse.csr_array)
    assert np.array_equal(one.gap_operator.toarray(), dense)
    assert np.array_equal(other.gap_operator.toarray(), dense)
    assert np.array_equal(one.coordinates(), other.coordinates())
    assert 5 not in one.coordinates()
    for a, b in zip(
        (sparse_rows(dense).columns, sparse_rows(dense).values),
        (sparse_rows(sparse).columns, sparse_rows(sparse).values),
        strict=True,
    ):
        assert np.array_equal(a, b)


def test_stored_zeros_and_duplicates_of_a_sparse_operator_are_no_contacts():
    places = ([0, 0, 2], [1, 1, 3])
    operator = scipy.sparse.coo_array(([2.0, -0.5, 0.0], places), shape=(3, 4))
    interface = Interface(("a",), (LAW,), operator)
    assert interface.coordinates().tolist() == [1]
    assert interface.gap_operator[0, 1] == 1.5
    assert operator.nnz == 3  # what was given is left as it is


def test_thousands_of_contacts_keep_no_zeros():
    n = 5000
    operator = scipy.sparse.eye_array(3 * n, 10**5, format="csr")
    interface = Interface(tuple(map(str, range(n))), (LAW,) * n, operator)
    local = interface.restricted(interface.coordinates())
    assert local.gap_operator.shape == (3 * n, 3 * n)  # dense: 1.8 GB, and 12 GB of the whole
    assert local.gap_operator.nnz == 3 * n
    rows = sparse_rows(local.gap_operator)
    assert rows.values.shape == (n, 3, 3)
    vector = np.arange(6.0 * n).reshape(2, -1)
    assert np.array_equal(rows.gaps(vector), vector)


def test_system_needs_an_interface_on_its_own_dofs():
    system, _ = griffin(0.1)
    with pytest.raises(InputError, match="the gap operator has 2 columns for 1 dofs"):
        replace(system, interface=Interface(("a",), (LAW,), np.zeros((3, 2))))
