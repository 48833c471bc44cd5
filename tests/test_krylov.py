"""Many contacts: the Jacobian by its products, its preconditioner, and Krylov methods, against arrays and LU."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from newton_bounds import unknowns_bound

from stickslip.contact.interface import Interface, sparse_rows
from stickslip.contact.law import PAIRS
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.product import add_stiffness, contact_product, harmonic_means, less_means, triangles
from stickslip.errors import InputError
from stickslip.harmonic import balance as balance_module
from stickslip.harmonic import matrix_products as matrix_products_module
from stickslip.harmonic import shared_factor as shared_factor_module
from stickslip.harmonic import structured as structured_module
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.costs import linear_costs, products_pay
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.factors import factorise
from stickslip.harmonic.harmonic_set import harmonics_of, to_complex, to_real
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.harmonic.selection.strategy import ErrorMeasure
from stickslip.harmonic.shared_factor import SharedFactor, SharedInverses
from stickslip.harmonic.structured import HarmonicFactors, StructuredJacobian, real_matrix
from stickslip.model.structure import Dofs, Structure
from stickslip.operators import Bordered, Costs, array_of
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.response import forced_problem, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.continuation import Following, StepControl, start_point, trace
from stickslip.solve.krylov import MIN_WORN_ITERATIONS, Automatic, Krylov, gmres, to_tolerance
from stickslip.solve.linear import Dense
from stickslip.solve.newton_method import Newton, newton
from stickslip.solve.status import Status

N_CONTACTS, INNER = 6, 5
STATES = {"stick": 0.05, "micro-slip": 1.2, "gross slip": 6.0, "lift-off": 40.0}
OMEGA = 0.8


def body(proportional: bool = True, seed: int = 0) -> Structure:
    """A random elastic body with its contacts' relative displacements first and a few inner coordinates."""
    rng = np.random.default_rng(seed)
    n = 3 * N_CONTACTS + INNER
    shapes = np.linalg.qr(rng.standard_normal((n, n)))[0]
    stiffness = shapes @ np.diag(np.linspace(0.6, 12.0, n)) @ shapes.T
    mass = np.eye(n) + 0.02 * np.ones((n, n))
    damping = 0.02 * mass + 0.01 * stiffness
    if not proportional:
        damping = damping + np.diag(rng.uniform(0.0, 0.02, n))
    stiffness, damping = (stiffness + stiffness.T) / 2, (damping + damping.T) / 2
    table = Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3)))
    return Structure(mass, damping, stiffness, table)


def system(seed: int = 0, relative: bool = True) -> System:
    """The body with contacts of different laws at its first coordinates, or at mixtures of them."""
    structure = body(seed=seed)
    rng = np.random.default_rng(seed + 1)
    laws = tuple(
        ElasticCoulomb(k_t=1.0, k_w=0.8, k_n=1.5, mu=0.4, preload=float(p)) for p in rng.uniform(0.5, 1.5, N_CONTACTS)
    )
    operator = np.zeros((3 * N_CONTACTS, structure.n))
    operator[:, : 3 * N_CONTACTS] = np.eye(3 * N_CONTACTS)
    if not relative:
        for c in range(N_CONTACTS):
            other = 3 * ((c + 1) % N_CONTACTS)
            operator[3 * c : 3 * c + 3, other : other + 3] = 0.2 * rng.standard_normal((3, 3))
    names = tuple(f"c{i}" for i in range(N_CONTACTS))
    interface = Interface(names, laws, operator, rng.uniform(0.5, 1.5, N_CONTACTS))
    return System(structure, interface, np.array([structure.n - 1]))


def load(share: float) -> HarmonicLoad:
    """Static and alternating forces on all coordinates, contacts and inner ones."""
    rng = np.random.default_rng(5)
    n = 3 * N_CONTACTS + INNER
    force = rng.standard_normal(n) + 1j * rng.standard_normal(n)
    return HarmonicLoad(0.1 * rng.standard_normal(n), {1: share * force})


def problem(share: float, order: int = 3, relative: bool = True) -> HarmonicBalance:
    made = system(relative=relative)
    linear = condense(made.structure, made.retained, load(share))
    return harmonic_balance(linear, made.interface, order, 64, jacobian="structured")


def state(name: str, order: int = 3, relative: bool = True) -> tuple[HarmonicBalance, np.ndarray]:
    """A balance and unknowns at which its contacts are as the name says."""
    balance = problem(STATES[name], order, relative)
    x = bonded_start(balance, OMEGA, system(relative=relative))
    found = balance.contacts(x, OMEGA).state
    shares = [float(np.mean(found == which)) for which in range(3)]
    sticks, slips, opens = shares
    assert {
        "stick": sticks == 1.0,
        "micro-slip": 0.0 < slips < 0.5 and sticks > 0.5,
        "gross slip": slips > 0.3,
        "lift-off": opens > 0.2,
    }[name], (name, shares)
    return balance, x


def assert_same(found: np.ndarray, expected: np.ndarray, digits: float = 1e-13) -> None:
    """Agreement to rounding: sums of some hundred products, relative to the largest entry."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=digits * np.max(np.abs(expected)))


# ---- products ------------------------------------------------------------------------------------------------------------


@given(st.integers(0, 2**31), st.integers(1, 4), st.integers(0, 4), st.sampled_from([5, 7, 9]), st.integers(3, 8))
@settings(max_examples=30, deadline=None)
def test_contact_product_is_that_of_the_assembled_matrix(seed, n_contacts, order, pairs, n):
    rng = np.random.default_rng(seed)
    m = 2 * order + 1
    blocks = rng.standard_normal((n_contacts, pairs, m, m))
    operator = rng.standard_normal((3 * n_contacts, n)) * (rng.random((3 * n_contacts, n)) < 0.5)
    rows = sparse_rows(operator)
    full = np.zeros((3 * n_contacts, m, 3 * n_contacts, m))
    for c in range(n_contacts):
        for k, (force, gap) in enumerate(PAIRS[:pairs]):
            full[3 * c + force, :, 3 * c + gap, :] = blocks[c, k]
    v = rng.standard_normal((m, n))
    gaps = operator @ v.T
    for transposed, force in (
        (False, np.einsum("apbq,bq->ap", full, gaps)),
        (True, np.einsum("apbq,ap->bq", full, gaps)),
    ):
        out = np.ones((m, n))
        contact_product(blocks, rows.columns, rows.values, v, transposed, np.empty((3, m)), np.empty((3, m)), out)
        # sums of a few hundred numbers of size one
        np.testing.assert_allclose(out - 1.0, (operator.T @ force).T, rtol=0, atol=1e-12)


@given(st.integers(0, 2**31), st.integers(1, 3), st.integers(0, 4), st.sampled_from([5, 7, 9]))
@settings(max_examples=30, deadline=None)
def test_means_and_what_they_leave_make_up_the_blocks(seed, n_contacts, order, pairs):
    rng = np.random.default_rng(seed)
    m = 2 * order + 1
    blocks = rng.standard_normal((n_contacts, pairs, m, m))
    means = harmonic_means(blocks)
    left = less_means(blocks, means)
    # what is left has no mean, and with the real form of the means it is the whole
    assert np.max(np.abs(harmonic_means(left))) < 1e-14
    for c in range(n_contacts):
        whole = real_matrix(means[:, c]).reshape(m, 3, m, 3)
        for k, (force, gap) in enumerate(PAIRS[:pairs]):
            np.testing.assert_allclose(left[c, k] + whole[:, force, :, gap], blocks[c, k], rtol=0, atol=1e-14)


def test_means_are_the_nearest_complex_numbers():
    rng = np.random.default_rng(3)
    block = rng.standard_normal((1, 5, 3, 3))
    left = less_means(block, harmonic_means(block))[0, 0, 1:, 1:]
    for number in (0.1, 0.1j, -0.1j, -0.1):
        turned = real_matrix(np.array([[[0.0]], [[number]]], dtype=complex))[1:, 1:]
        assert np.linalg.norm(left + turned) > np.linalg.norm(left)


def test_stiffness_of_contacts_that_share_coordinates_adds_up():
    rng = np.random.default_rng(2)
    operator = rng.standard_normal((6, 4))
    rows = sparse_rows(operator)
    stiffness = rng.standard_normal((2, 3, 3)) + 1j * rng.standard_normal((2, 3, 3))
    out = np.zeros((4, 4), dtype=complex)
    add_stiffness(stiffness, rows.columns, rows.values, out)
    expected = operator.T @ scipy.linalg.block_diag(*stiffness) @ operator
    np.testing.assert_allclose(out, expected, rtol=1e-13)


@pytest.mark.parametrize("proportional", [True, False])
def test_products_are_those_of_the_condensed_matrices(proportional):
    structure = body(proportional)
    rng = np.random.default_rng(4)
    forces = load(1.0)
    linear = condense(structure, np.arange(3 * N_CONTACTS), forces)
    assert linear.diagonal is proportional
    order, n = 3, linear.n
    condensed, products = (linear.condensed(OMEGA, order), linear.products(OMEGA, harmonics_of(order)))
    rows = rng.standard_normal((2 * order + 1, n))
    q = to_complex(rows)[:, :, None]
    product, slope = products.product_and_slope(rows)
    assert_same(product, to_real((condensed.stiffness @ q)[:, :, 0]))
    assert_same(slope, to_real((condensed.derivative @ q)[:, :, 0]))
    assert_same(products.product(rows), product)
    assert_same(products.load, to_real(condensed.load))
    assert_same(products.load_slope, to_real(condensed.load_derivative))
    matrix = real_matrix(condensed.stiffness)
    assert_same(products.transposed_product(rows).ravel(), matrix.T @ rows.ravel())
    for h in range(order + 1):
        assert_same(products.block(h), condensed.stiffness[h])


@pytest.mark.parametrize("name", STATES)
@pytest.mark.parametrize("relative", [True, False])
def test_structured_linearisation_is_the_dense_one(name, relative):
    balance, x = state(name, relative=relative)
    at = balance.linearise(x, OMEGA)
    dense = replace(balance, jacobian="dense").linearise(x, OMEGA)
    assert isinstance(at.jac, StructuredJacobian)
    assert_same(at.residual, dense.residual)
    assert_same(at.jac_p, dense.jac_p)
    assert_same(at.jac.dense(), dense.jac)
    assert at.jac.shape == dense.jac.shape
    v = np.random.default_rng(1).standard_normal(x.size)
    assert_same(at.jac.matvec(v), dense.jac @ v)
    assert_same(at.jac.rmatvec(v), dense.jac.T @ v)


@pytest.mark.parametrize("n", [1, 63, 64, 65, 150])
@pytest.mark.parametrize("dtype", [float, complex])
def test_factors_solve_as_lapack_does(n, dtype):
    rng = np.random.default_rng(n)
    matrix, right = rng.standard_normal((n, n)).astype(dtype), rng.standard_normal(n).astype(dtype)
    if dtype is complex:
        matrix, right = matrix + 1j * rng.standard_normal((n, n)), right * np.exp(0.3j)
    matrix[:, -1] *= 1e-6  # rows must change places, and columns differ in size
    expected = np.linalg.solve(matrix, right)
    found = factorise(np.array(matrix, order="F")).solve(right)
    assert found.dtype == matrix.dtype
    # both are exact for a matrix that differs by rounding, times a growth of at most n
    left = np.linalg.norm(matrix @ found - right)
    assert left <= n * 1e-14 * np.linalg.norm(matrix) * np.linalg.norm(expected)
    np.testing.assert_allclose(found, expected, rtol=1e-7 * n)


@pytest.mark.parametrize("n", [1, 63, 64, 65, 150])
@pytest.mark.parametrize("dtype", [float, complex])
def test_factors_solve_the_transposed_system(n, dtype):
    rng = np.random.default_rng(n)
    matrix, right = rng.standard_normal((n, n)).astype(dtype), rng.standard_normal(n).astype(dtype)
    if dtype is complex:
        matrix, right = matrix + 1j * rng.standard_normal((n, n)), right * np.exp(0.3j)
    matrix[:, -1] *= 1e-6
    found = factorise(np.array(matrix, order="F")).solve_transposed(right)
    assert found.dtype == matrix.dtype
    # as above: exact for a matrix that differs by rounding, times a growth of at most n
    left = np.linalg.norm(matrix.T @ found - right)
    assert left <= n * 1e-14 * np.linalg.norm(matrix) * np.linalg.norm(found)


@pytest.mark.parametrize("name", STATES)
def test_few_coordinates_take_one_loop_and_many_one_harmonic_at_a_time(name, monkeypatch):
    balance = problem(STATES[name])
    rng = np.random.default_rng(7)
    x, y = rng.standard_normal((2, balance.size))
    for omega in (OMEGA, 1.1 * OMEGA):  # with factors of this frequency, and of another
        jac = replace(balance, jacobian="structured").linearise(x, omega).jac
        told = []
        for small in (0, 1000):
            monkeypatch.setattr(structured_module, "MAX_SMALL_BLOCK", small)
            kept = replace(balance, jacobian="structured").linearise(x, OMEGA).jac.preconditioner()
            assert (kept.inverses is None) == (small == 0)
            solve, product = jac.preconditioned_by(kept)
            told.append((jac.matvec(y), solve(y), product(solve(y), y)))
        for one, other in zip(*told, strict=True):
            assert_same(one, other)


@given(st.integers(0, 10**6), st.integers(1, 40))
@settings(deadline=None, max_examples=40)
def test_gmres_is_exact_after_as_many_products_as_unknowns(seed, n):
    rng = np.random.default_rng(seed)
    matrix, right = rng.standard_normal((n, n)) + 2.0 * np.eye(n), rng.standard_normal(n)
    most = int(rng.integers(1, n + 1))
    solution, left = gmres(lambda v: matrix @ v, right, 1e-10, most)
    assert left == pytest.approx(np.linalg.norm(right - matrix @ solution) / np.linalg.norm(right), abs=1e-8)
    # the smallest residual of the Krylov space, by least squares over its powers
    powers = [right / np.linalg.norm(right)]
    for _ in range(most - 1):
        powers.append(np.linalg.qr(np.stack([*powers, matrix @ powers[-1]], axis=1))[0][:, -1])
    space = matrix @ np.stack(powers, axis=1)
    best = right - space @ np.linalg.lstsq(space, right, rcond=None)[0]
    assert left <= max(np.linalg.norm(best) / np.linalg.norm(right), 1e-10) + 1e-7


def test_singular_matrix_has_no_factors():
    assert factorise(np.ones((3, 3), order="F")) is None
    assert factorise(np.zeros((2, 2), dtype=complex, order="F")) is None


# ---- solves --------------------------------------------------------------------------------------------------------------


def dense_solution(jac: StructuredJacobian, right: np.ndarray) -> np.ndarray:
    return np.linalg.solve(jac.dense(), right)


@pytest.mark.parametrize("name", STATES)
@pytest.mark.parametrize("method", ["gmres", "bicgstab"])
def test_solution_is_that_of_lu(name, method):
    balance, x = state(name, relative=False)
    at = balance.linearise(x, OMEGA)
    exact = dense_solution(at.jac, -at.residual)
    for tolerance in (1e-2, 1e-6, 1e-11):
        krylov = Krylov(method=method, tolerance=tolerance)
        found = krylov.solve(at.jac, -at.residual)
        left = np.linalg.norm(at.jac.matvec(found) + at.residual) / np.linalg.norm(at.residual)
        assert left <= 1.01 * tolerance  # rounding of the product that judges
        assert krylov.counts.failures == 0
    # the residual of 1e-11 times the condition of these matrices, about 1e2
    assert np.linalg.norm(found - exact) <= 1e-8 * np.linalg.norm(exact)


@pytest.mark.parametrize(
    ("entries", "below", "above"),
    [
        ([], False, False),
        ([(0, 0), (1, 1), (2, 2), (3, 3), (4, 4)], False, False),  # equal diagonals: means alone
        ([(1, 1)], False, True),
        ([(3, 4)], False, True),
        ([(4, 3)], False, True),
        ([(0, 3)], False, True),
        ([(2, 4)], False, True),
        ([(1, 0)], True, False),
        ([(4, 1)], True, False),
        ([(3, 2), (1, 4)], True, True),
        ([(p, q) for p in range(5) for q in range(5) if q > 2 * ((p + 1) // 2)], False, True),
    ],
)
def test_triangles_hold_the_blocks_that_have_entries_in_them(entries, below, above):
    """What has none costs nothing in a product: a stuck contact has its means, an open one nothing."""
    blocks = np.zeros((3, 5, 5, 5))
    for p, q in entries:
        blocks[1, 2, p, q] = 2.0
    found = triangles(blocks, harmonic_means(blocks))
    assert found.below.tolist() == [[1, 2]] * below
    assert found.above.tolist() == [[1, 2]] * above
    assert found.lower.size == 8 * below
    assert found.upper.size == 17 * above
    assert found.lower.sum() == 2.0 * sum(q < 2 * ((p + 1) // 2) - 1 for p, q in entries)


def test_preconditioner_is_exact_where_all_sticks():
    balance, x = state("stick")
    at = balance.linearise(x, OMEGA)
    solve, _ = at.jac.preconditioned_by(at.jac.preconditioner())
    assert_same(solve(at.jac.matvec(x)), x, 1e-11)
    krylov = Krylov(tolerance=1e-10)
    krylov.solve(at.jac, at.residual)
    assert krylov.counts.products <= 2  # one, and the one that checks


@pytest.mark.parametrize("name", STATES)
@pytest.mark.parametrize("at_other", [OMEGA, 1.001 * OMEGA])
def test_product_after_a_kept_preconditioner_is_the_product(name, at_other):
    # at the same frequency without the dynamic stiffness, at another with it
    kept = problem(STATES["stick"]).linearise(np.zeros(problem(1.0).size), OMEGA)
    balance, x = state(name)
    loaded = replace(balance, linear=problem(1.0).linear)
    jac = loaded.linearise(x, at_other).jac
    kept = loaded.linearise(0.01 * x, OMEGA).jac
    solve, product = jac.preconditioned_by(kept.preconditioner())
    v = np.random.default_rng(0).standard_normal(x.size)
    solved = solve(v)
    assert jac.linear.same(kept.linear) is (at_other == OMEGA)
    assert_same(product(solved, v), jac.matvec(solved), 1e-11)


@pytest.mark.parametrize("relative", [True, False])
def test_preconditioner_holds_all_below_the_harmonics(relative):
    # P is J without what higher harmonics do to lower ones, and with a complex number for each harmonic's own stiffness
    balance, x = state("lift-off", relative=relative)
    jac = balance.linearise(x, OMEGA).jac
    means = harmonic_means(jac.blocks)
    own = replace(jac, blocks=jac.blocks - less_means(jac.blocks, means)).dense()
    size, m = balance.linear.n, 2 * balance.order + 1
    harmonic = np.repeat((np.arange(m) + 1) // 2, size)
    lower = harmonic[:, None] > harmonic[None, :]
    expected = np.where(lower, jac.dense(), own)
    solve, _ = jac.preconditioned_by(jac.preconditioner())
    v = np.random.default_rng(2).standard_normal(x.size)
    assert np.linalg.norm(np.where(lower, jac.dense(), 0.0)) > 0.01 * np.linalg.norm(own)
    assert_same(solve(expected @ v), v, 1e-11)


# ---- one factor for all harmonics -------------------------------------------------------------------------------------------


@pytest.fixture
def shared(monkeypatch):
    monkeypatch.setattr(structured_module, "SHARED", 0)
    monkeypatch.setattr(matrix_products_module, "MAX_SMALL_BLOCK", 0)  # small matrices are not formed
    monkeypatch.setattr(shared_factor_module, "MODE_RANGE", 0.0)  # as many modes as there may be


@pytest.mark.parametrize("name", STATES)
def test_solution_by_a_shared_factor_is_that_of_lu(name, shared):
    balance, x = state(name, relative=False)
    at = balance.linearise(x, OMEGA)
    exact = dense_solution(at.jac, -at.residual)
    for tolerance in (1e-2, 1e-11):
        krylov = Krylov(tolerance=tolerance)
        found = krylov.solve(at.jac, -at.residual)
        left = np.linalg.norm(at.jac.matvec(found) + at.residual) / np.linalg.norm(at.residual)
        assert left <= 2.01 * tolerance  # of the second pass; see ROUNDING
        assert krylov.counts.failures == 0
        np.testing.assert_array_equal(Krylov(tolerance=tolerance).solve(at.jac, -at.residual), found)
    assert np.linalg.norm(found - exact) <= 1e-8 * np.linalg.norm(exact)
    kept = at.jac.preconditioner()
    assert isinstance(kept, SharedFactor)
    assert kept.factor.lu.dtype == np.float32


@pytest.mark.parametrize("at_other", [OMEGA, 1.3 * OMEGA])
def test_shared_factor_with_all_modes_is_exact_at_every_frequency(at_other, shared, monkeypatch):
    monkeypatch.setattr(shared_factor_module, "LEAST_MODES", 1000)
    monkeypatch.setattr(shared_factor_module, "MIN_COORDINATES_PER_MODE", 1)
    balance, x = state("stick")
    kept = balance.linearise(x, OMEGA).jac.preconditioner()
    jac = balance.linearise(x, at_other).jac
    solve, _ = jac.preconditioned_by(kept)
    assert_same(solve(jac.matvec(x)), x, 1e-10)


@pytest.mark.parametrize("name", STATES)
def test_transposed_system_takes_the_shared_factor(name, shared):
    balance, x = state(name, relative=False)
    jac = balance.linearise(x, OMEGA).jac
    kept = jac.preconditioner()
    a, b = np.random.default_rng(7).standard_normal((2, x.size))
    solve, _ = jac.preconditioned_by(kept)
    back, _ = jac.transposed.preconditioned_by(kept)
    # <P⁻¹ a, b> = <a, P⁻ᵀ b>, in single precision
    assert abs(solve(a) @ b - a @ back(b)) <= 1e-5 * np.linalg.norm(solve(a)) * np.linalg.norm(b)
    found = Krylov(tolerance=1e-11).solve(jac.transposed, a)
    exact = np.linalg.solve(jac.dense().T, a)
    assert np.linalg.norm(found - exact) <= 1e-8 * np.linalg.norm(exact)


def test_harmonics_above_all_modes_have_factors_of_their_own(monkeypatch):
    monkeypatch.setattr(structured_module, "SHARED", 0)
    monkeypatch.setattr(matrix_products_module, "MAX_SMALL_BLOCK", 0)
    balance, x = state("lift-off")  # the third harmonic is above a quarter of the modes
    kept = balance.linearise(x, OMEGA).jac.preconditioner()
    assert isinstance(kept, HarmonicFactors)


def test_masses_at_few_coordinates_leave_each_harmonic_its_factors():
    # fifteen masses have fewer modes than a shared factor wants
    n = 150
    chain = 2.5 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    masses = (np.arange(n) % 10 == 0).astype(float)
    structure = Structure(np.diag(masses), 0.01 * chain, chain, Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3))))
    law = ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=0.3, preload=1.0)
    interface = Interface(tuple(f"c{i}" for i in range(n // 3)), (law,) * (n // 3), np.eye(n))
    load = HarmonicLoad(np.zeros(n), {1: masses.astype(complex)})
    condensed = condense(structure, np.arange(n), load)
    balance = harmonic_balance(condensed, interface, 3, 64, jacobian="structured")
    jac = balance.linearise(np.zeros(7 * n), 0.5).jac
    assert isinstance(jac.preconditioner(), HarmonicFactors)


def test_harmonics_have_factors_of_their_own_where_a_shared_one_does_not_do(shared, monkeypatch):
    balance, x = state("lift-off")
    at = balance.linearise(x, OMEGA)
    monkeypatch.setattr(SharedInverses, "solve", lambda _, place, rows: (place % 2) * rows)
    krylov = Krylov(tolerance=1e-8)
    found = krylov.solve(at.jac, -at.residual)
    exact = dense_solution(at.jac, -at.residual)
    assert np.linalg.norm(found - exact) <= 1e-6 * np.linalg.norm(exact)
    assert (krylov.counts.preconditioners, krylov.counts.failures) == (2, 0)


def test_shared_factor_turns_to_double_precision_where_single_tells_too_little(shared, monkeypatch):
    monkeypatch.setattr(shared_factor_module, "MAX_SINGLE_RESIDUAL", 1e-10)
    balance, x = state("lift-off")
    kept = balance.linearise(x, OMEGA).jac.preconditioner()
    assert kept.factor.lu.dtype == np.float64


@pytest.mark.parametrize("name", STATES)
def test_bordered_solution_is_that_of_lu(name):
    balance, x = state(name)
    at = balance.linearise(x, OMEGA)
    rng = np.random.default_rng(0)
    row, right = rng.standard_normal(x.size), rng.standard_normal(x.size + 1)
    krylov = Krylov(tolerance=1e-11, tangent_tolerance=1e-11)
    tangent = np.append(np.zeros(x.size), 1.0)
    for right_side in (right, tangent):
        found, sign = krylov.solve_bordered(at.jac, at.jac_p, row, 0.3, right_side)
        exact, known = Dense().solve_bordered(at.jac.dense(), at.jac_p, row, 0.3, right_side)
        assert np.linalg.norm(found - exact) <= 1e-7 * np.linalg.norm(exact)
        assert np.isnan(sign)
        assert known in {-1.0, 1.0}


@pytest.mark.parametrize("relative", [True, False])
@pytest.mark.parametrize("name", STATES)
def test_transposed_system_shares_the_factors(name, relative):
    balance, x = state(name, relative=relative)
    jac = balance.linearise(x, OMEGA).jac
    kept = jac.preconditioner()
    rng = np.random.default_rng(7)
    a, b = rng.standard_normal((2, x.size))
    solve, _ = jac.preconditioned_by(kept)
    back, product = jac.transposed.preconditioned_by(kept)
    # <P⁻¹ a, b> = <a, P⁻ᵀ b>
    assert solve(a) @ b == pytest.approx(a @ back(b), rel=1e-10)
    assert_same(product(a, b), jac.dense().T @ a)
    assert jac.transposed.transposed is jac
    krylov = Krylov(tolerance=1e-11)
    krylov.solve(jac, a)
    found = krylov.solve(jac.transposed, a)
    exact = np.linalg.solve(jac.dense().T, a)
    assert np.linalg.norm(found - exact) <= 1e-8 * np.linalg.norm(exact)
    assert krylov.counts.preconditioners == 1


@pytest.mark.parametrize("name", STATES)
@pytest.mark.parametrize("m", [2, 3])
def test_several_borders_are_solved_as_by_lu(name, m):
    balance, x = state(name)
    at = balance.linearise(x, OMEGA)
    rng = np.random.default_rng(m)
    column, row = rng.standard_normal((x.size, m)), rng.standard_normal((m, x.size))
    column[:, 0] = at.jac_p
    corner = rng.standard_normal((m, m))
    krylov = Krylov(tolerance=1e-11, tangent_tolerance=1e-11)
    whole = array_of(Bordered(at.jac.dense(), column, row, corner))
    for right in (rng.standard_normal(x.size + m), np.eye(x.size + m)[-1]):
        found, _ = krylov.solve_bordered(at.jac, column, row, corner, right)
        exact = np.linalg.solve(whole, right)
        assert np.linalg.norm(found - exact) <= 1e-7 * np.linalg.norm(exact)
        # the same borders one around the other
        inner = Bordered(at.jac, column[:, :-1], row[:-1], corner[:-1, :-1])
        outer = np.append(column[:, -1], corner[:-1, -1]), np.append(row[-1], corner[-1, :-1])
        nested, _ = krylov.solve_bordered(inner, *outer, corner[-1, -1], right)
        assert np.linalg.norm(nested - exact) <= 1e-7 * np.linalg.norm(exact)
        assert_same(krylov.solve(Bordered(inner, *outer, corner[-1, -1]), right), nested, 1e-9)


class Nearly:
    """A Jacobian with a preconditioner of which it is a small change."""

    def __init__(self, matrix: np.ndarray, preconditioner: np.ndarray) -> None:
        self.matrix, self.nearby = matrix, preconditioner
        self.shape = matrix.shape
        self.made = 0

    @property
    def problem(self):
        return self

    def matvec(self, v):
        return self.matrix @ v

    def rmatvec(self, v):
        return self.matrix.T @ v

    @property
    def transposed(self):
        return Nearly(self.matrix.T, self.nearby.T)

    def preconditioner(self):
        self.made += 1
        return np.linalg.inv(self.nearby)

    def preconditioned_by(self, kept):
        return lambda right: kept @ right, lambda v, _: self.matrix @ v


def fold(lacks: int = 1, nearby: float = 1e-6, n: int = 30) -> tuple[Nearly, Bordered]:
    """A Jacobian that lacks some rank, borders that make it regular, and a preconditioner that is almost as singular."""
    rng = np.random.default_rng(8)
    left, _, right = np.linalg.svd(rng.standard_normal((n, n)))
    sizes = np.linspace(1.0, 2.0, n)
    singular, close = sizes.copy(), sizes.copy()
    singular[n - lacks :], close[n - lacks :] = 0.0, nearby
    made = Nearly(left @ np.diag(singular) @ right, left @ np.diag(close) @ right)
    corner = np.zeros((lacks, lacks))
    return made, Bordered(made, left[:, n - lacks :] + 0.1, right[n - lacks :] + 0.1, corner)


@pytest.mark.parametrize("method", ["gmres", "bicgstab"])
@pytest.mark.parametrize("lacks", [1, 2])
@pytest.mark.parametrize("nearby", [1e-3, 1e-6, 1e-9, 1e-12])
def test_bordered_system_at_a_fold(lacks, nearby, method):
    jac, bordered = fold(lacks, nearby)
    whole = array_of(replace(bordered, jac=jac.matrix))
    assert np.linalg.cond(jac.matrix) > 1e13
    assert np.linalg.cond(whole) < 100.0
    tight = Krylov(method=method, tolerance=1e-11, tangent_tolerance=1e-6)
    for right, tolerance in ((np.eye(30 + lacks)[-1], 1e-6), (np.ones(30 + lacks), 1e-11)):
        for system, matrix in ((bordered, whole), (bordered.transposed, whole.T)):
            found, _ = tight.solve_bordered(system.jac, system.column, system.row, system.corner, right)
            left = matrix @ found - right
            # the rounding of the product that judges comes on top
            assert np.linalg.norm(left) <= 2.0 * tolerance * np.linalg.norm(right)
    assert Dense().solve(jac.matrix.copy(), np.ones(30)) is None


def test_preconditioner_is_kept_while_it_serves():
    balance, x = state("micro-slip")
    krylov = Krylov(tolerance=1e-6)
    for scale in (1.0, 1.001, 1.002):
        at = balance.linearise(scale * x, OMEGA)
        krylov.solve(at.jac, -at.residual)
    assert krylov.counts.systems == 3
    assert krylov.counts.preconditioners == 1


def test_worn_preconditioner_is_made_anew():
    rng = np.random.default_rng(1)
    jac = Nearly(np.eye(80), np.eye(80))
    krylov = Krylov(tolerance=1e-8)
    krylov.solve(jac, np.ones(80))
    jac.matrix = jac.nearby = np.eye(80) + 0.06 * rng.standard_normal((80, 80))
    before = krylov.counts.products
    krylov.solve(jac, np.ones(80))
    assert jac.made == 1  # it still served, though badly
    assert krylov.counts.products - before > MIN_WORN_ITERATIONS
    assert_same(jac.matrix @ krylov.solve(jac, np.ones(80)), np.ones(80), 1e-8)
    assert jac.made == 2
    # one that fails is made anew at once
    jac.matrix = jac.nearby = np.roll(np.eye(80), 1, axis=0)
    assert replace(krylov, max_products=40).solve(jac, np.eye(80)[0]) is not None
    assert jac.made == 3


def test_problems_that_are_gone_leave_no_factors():
    krylov = Krylov()
    jac = Nearly(np.eye(4), np.eye(4))
    krylov.solve(jac, np.ones(4))
    assert len(krylov.memory) == 1
    del jac
    assert len(krylov.memory) == 0


def test_orders_of_a_problem_keep_factors_apart():
    low, x = state("micro-slip", order=1)
    high = low.with_order(3)
    krylov = Krylov()
    for balance in (low, high, low, high):
        at = balance.linearise(balance.unknowns(low.coefficients(x)), OMEGA)
        krylov.solve(at.jac, -at.residual)
    assert krylov.counts.preconditioners == 2


def test_right_side_zero_needs_no_work():
    balance, x = state("stick")
    krylov = Krylov()
    jac = balance.linearise(x, OMEGA).jac
    assert np.array_equal(krylov.solve(jac, np.zeros(x.size)), np.zeros(x.size))
    assert krylov.counts.products == krylov.counts.preconditioners == 0


# ---- failure -------------------------------------------------------------------------------------------------------------


def hopeless(n: int = 60) -> Nearly:
    """A shift, of which every product but the last says nothing about the solution."""
    return Nearly(np.roll(np.eye(n), 1, axis=0), np.eye(n))


def test_no_solution_is_none_and_counted():
    krylov = Krylov(max_products=10)
    jac = hopeless()
    assert krylov.solve(jac, np.eye(60)[0]) is None
    solution, sign = krylov.solve_bordered(jac, np.zeros(60), np.zeros(60), 1.0, np.eye(61)[0])
    assert solution is None
    assert np.isnan(sign)
    assert krylov.counts.failures == 2


def test_newton_without_a_step_says_so():
    jac = hopeless()

    class At:
        residual, seconds_contact = np.eye(60)[0], 0.0

    At.jac = jac
    solution = newton(lambda _: At(), np.zeros(60), Newton(linear=Krylov(max_products=10)))
    assert solution.status is Status.SINGULAR
    assert "Krylov" in solution.status.advice


def test_harmonic_without_stiffness_has_no_preconditioner():
    balance, x = state("stick")
    at = balance.linearise(x, OMEGA)
    loose = replace(at.jac, blocks=np.zeros_like(at.jac.blocks))
    matrices = loose.linear.condensed
    nothing = replace(matrices, stiffness=np.zeros_like(matrices.stiffness))
    linear = replace(loose.linear, condensed=nothing)
    krylov = Krylov()
    assert krylov.solve(replace(loose, linear=linear), at.residual) is None
    assert krylov.counts.failures == 1


def test_array_and_unknown_method_are_refused():
    with pytest.raises(InputError, match="Krylov needs a Jacobian that makes its preconditioner, and got ndarray"):
        Krylov().solve(np.eye(2), np.ones(2))
    with pytest.raises(InputError, match=r"Krylov\.method.*'qmr'"):
        Krylov(method="qmr")


def test_dense_puts_together_what_is_known_by_its_parts():
    balance, x = state("micro-slip")
    at = balance.linearise(x, OMEGA)
    array = at.jac.dense()
    assert_same(Dense().solve(at.jac, x), np.linalg.solve(array, x), 1e-11)
    right, border = np.append(x, 1.0), (at.jac_p, x, 0.5)
    found, sign = Dense().solve_bordered(at.jac, *border, right)
    exact, known_sign = Dense().solve_bordered(array, *border, right)
    assert_same(found, exact, 1e-11)
    assert sign == known_sign


# ---- problems ------------------------------------------------------------------------------------------------------------


def test_size_chooses_the_form(monkeypatch):
    made = replace(problem(1.0), jacobian="auto")
    assert not made.structured
    assert isinstance(made.linearise(np.zeros(made.size), OMEGA).jac, np.ndarray)
    monkeypatch.setattr(balance_module, "products_pay", lambda _: False)
    assert not replace(made).structured
    monkeypatch.setattr(balance_module, "products_pay", lambda _: True)
    made = replace(made)  # the choice is kept
    assert made.structured
    assert isinstance(made.linearise(np.zeros(made.size), OMEGA).jac, StructuredJacobian)
    # without harmonics nothing is saved, and the static problem is small
    static = problem(1.0).with_order(0)
    x = np.random.default_rng(0).standard_normal(static.size)
    assert isinstance(static.linearise(x, OMEGA).jac, np.ndarray)
    monkeypatch.setattr(balance_module, "products_pay", lambda _: True)
    by_products = static.linearise(x, OMEGA)
    assert isinstance(by_products.jac, np.ndarray)
    monkeypatch.setattr(balance_module, "products_pay", lambda _: False)
    assert_same(by_products.jac, static.linearise(x, OMEGA).jac)


def test_products_pay_from_some_three_hundred_unknowns():
    def pay(coordinates, order):
        contacts = coordinates // 3
        return products_pay(linear_costs(coordinates, order + 1, 5 * contacts * (2 * order + 1) ** 2))

    assert not pay(24, 3)  # 168 unknowns
    assert not pay(36, 3)  # 252
    assert pay(36, 5)  # 396
    assert pay(33, 41)  # 2739
    assert pay(300, 5)  # 3300


def test_costs_grow_as_the_work_does():
    """Entries of a matrix are the square of the coordinates, its factors the cube; harmonics count once each, unknowns of an array cubed."""
    small, large = (linear_costs(n, 1, 0) for n in (20_000, 40_000))
    assert large.product / small.product == pytest.approx(4, rel=0.01)
    assert large.factors / small.factors == pytest.approx(8, rel=0.1)
    assert large.array / small.array == pytest.approx(8, rel=0.1)
    shared = [linear_costs(n, 1, 0, shared=True).factors for n in (20_000, 40_000)]
    assert shared[1] / shared[0] == pytest.approx(8, rel=0.2)
    once, twice = (linear_costs(20_000, h, 0) for h in (50, 100))
    assert twice.factors / once.factors == pytest.approx(2, rel=1e-12)
    assert twice.array / once.array == pytest.approx((199 / 99) ** 3, rel=1e-3)
    sparse = [linear_costs(100, 4, 0, entries).product for entries in (10**9, 2 * 10**9)]
    assert sparse[1] / sparse[0] == pytest.approx(2, rel=1e-3)
    derivatives = [linear_costs(100, 4, n).product for n in (10**9, 2 * 10**9)]
    assert derivatives[1] / derivatives[0] == pytest.approx(2, rel=1e-3)


def priced(monkeypatch, product: float, array: float) -> None:
    """Let systems cost what a test wants."""
    costs = Costs(product, 0.0, array)
    monkeypatch.setattr(structured_module, "linear_costs", lambda *_, **__: costs)
    monkeypatch.setattr(structured_module, "reduced_cost", lambda *_, **__: np.inf)


def test_what_costs_more_by_products_is_factorised_for_a_while(monkeypatch):
    balance, x = state("gross slip")
    right = np.random.default_rng(0).standard_normal(balance.size)
    exact = np.linalg.solve(balance.linearise(x, OMEGA).jac.dense(), right)
    dear, automatic = [], Automatic(krylov=Krylov(tolerance=1e-13))
    priced(monkeypatch, 1.0, 13.0)
    at = balance.linearise(x, OMEGA)
    for _ in range(20):
        before = automatic.krylov.counts.systems
        found = automatic.solve(at.jac, right)
        dear.append(automatic.krylov.counts.systems > before)
        if not dear[-1]:
            assert_same(found, exact, 1e-9)
    # products are tried until they owe an array, and again after a longer while
    assert np.flatnonzero(dear).tolist() == [0, 1, 6, 7, 16, 17]
    # where few unknowns are left, products are not tried, and where they cost much less, nothing else
    for array, tried in ((1.0, 0), (1000.0, 10)):
        priced(monkeypatch, 1.0, array)
        automatic = Automatic()
        for _ in range(10):
            assert_same(automatic.solve(balance.linearise(x, OMEGA).jac, right), exact, 0.1)
        assert automatic.krylov.counts.systems == tried


def test_products_that_cost_much_less_again_are_soon_tried_again(monkeypatch):
    """The pauses grow as long as products are dear; where they have paid since, the next one is as short as the first."""
    balance, x = state("gross slip")
    right = np.random.default_rng(0).standard_normal(balance.size)
    automatic = Automatic(krylov=Krylov(tolerance=1e-13))

    def tried(array: float, systems: int) -> list[bool]:
        priced(monkeypatch, 1.0, array)
        found = []
        for _ in range(systems):
            before = automatic.krylov.counts.systems
            automatic.solve(balance.linearise(x, OMEGA).jac, right)
            found.append(automatic.krylov.counts.systems > before)
        return found

    def pauses(systems: list[bool]) -> list[int]:
        by_products = np.flatnonzero(systems)
        return [int(n) for n in np.diff(by_products) - 1 if n]

    assert pauses(tried(13.0, 18)) == [4, 8]
    assert tried(1000.0, 24) == [False] * 16 + [True] * 8
    assert pauses(tried(13.0, 40))[:1] == [4]


def test_what_a_krylov_method_does_not_solve_is_factorised():
    balance, x = state("gross slip")
    at = balance.linearise(x, OMEGA)
    right = np.random.default_rng(0).standard_normal(balance.size + 1)
    krylov = Krylov(tolerance=1e-12, max_products=2)
    assert krylov.solve(at.jac, right[:-1]) is None
    automatic = Automatic(krylov=krylov)
    for jac in (at.jac, at.jac.transposed):
        assert_same(automatic.solve(jac, right[:-1]), np.linalg.solve(jac.dense(), right[:-1]), 1e-9)
    border = (at.jac_p, x, 0.5)
    found, sign = Automatic(krylov=krylov).solve_bordered(at.jac, *border, right)
    whole = np.block([[at.jac.dense(), at.jac_p[:, None]], [x[None], np.array([[0.5]])]])
    assert_same(found, np.linalg.solve(whole, right), 1e-9)
    assert sign == np.sign(np.linalg.slogdet(whole)[0])


def test_the_choice_of_solver_is_pickled_without_what_it_saw():
    balance, x = state("gross slip")
    at = balance.linearise(x, OMEGA)
    automatic = Automatic(krylov=Krylov(tolerance=1e-3))
    automatic.solve(at.jac, at.residual)
    copy = pickle.loads(pickle.dumps(automatic))
    assert copy.krylov.tolerance == 1e-3
    assert len(automatic.accounts) == 1
    assert len(copy.accounts) == 0


@pytest.mark.kernel
@pytest.mark.parametrize("name", STATES)
def test_newton_finds_the_same_solution(name):
    balance, x = state(name)
    options = Newton(tolerance=1e-12, max_iterations=60)
    found = newton(lambda v: balance.linearise(v, OMEGA), x, options)
    dense = replace(balance, jacobian="dense")
    expected = newton(lambda v: dense.linearise(v, OMEGA), x, options)
    assert found.status is expected.status is Status.CONVERGED
    ends = balance.linearise(found.x, OMEGA), dense.linearise(expected.x, OMEGA)
    assert np.max(np.abs(found.x - expected.x)) <= unknowns_bound(found.x, *ends)


@pytest.mark.kernel
def test_branch_is_the_same():
    balance = problem(STATES["gross slip"])
    weights = np.ones(balance.size)
    control = StepControl(scale=0.2, max_points=200)
    ends = []
    for form in ("structured", "dense"):
        made = replace(balance, jacobian=form)
        following = Following(newton=Newton(tolerance=1e-12, max_iterations=25), control=control, weights=weights)
        start = start_point(made, bonded_start(made, 0.3, system()), 0.3, following)
        points = [start, *trace(made, start, 0.5, following)]
        assert all(point.solution.status.converged for point in points)
        ends.append((points[-1], made.linearise(points[-1].x, 0.5)))
    (one, reached), (other, there) = ends
    assert one.p == other.p == 0.5
    assert np.max(np.abs(one.x - other.x)) <= unknowns_bound(one.x, reached, there)


def test_alert_is_the_same():
    low, x = state("gross slip", order=1)
    solution = newton(lambda v: low.linearise(v, OMEGA), x, Newton(tolerance=1e-12))
    assert solution.status.converged
    high = low.with_order(3)
    measure = ErrorMeasure(np.arange(3 * N_CONTACTS + INNER))
    krylov = Krylov()
    solve = to_tolerance(krylov, 1e-11).solve
    iterated = jacobian_alert(low, high, solution.x, OMEGA, measure, solve)
    assert krylov.counts.products > 0
    direct = jacobian_alert(low, replace(high, jacobian="dense"), solution.x, OMEGA, measure)
    assert iterated.error == pytest.approx(direct.error, rel=1e-9)
    assert iterated.worst == direct.worst
    assert direct.error > 1e-3  # there is something to compare
    assert jacobian_alert(low, high, solution.x, OMEGA, measure).error == pytest.approx(direct.error, rel=1e-9)


def test_alert_without_a_solution_is_infinite():
    low, x = state("gross slip", order=1)
    high = low.with_order(3)
    alert = jacobian_alert(low, high, x, OMEGA, ErrorMeasure(np.arange(3)), lambda *_: None)
    assert alert.error == np.inf


def test_tolerance_is_set_through_the_choice_of_solver():
    automatic = Automatic()
    finer = to_tolerance(automatic, 1e-9)
    assert finer.krylov.tolerance == 1e-9
    assert finer.krylov.memory is automatic.krylov.memory
    assert to_tolerance(Dense(), 1e-9) == Dense()


def test_forced_response_is_the_same(monkeypatch):
    sweep = Sweep(
        omega_range=(0.3, 0.5), low=1, high=3, samples=64, points=6, peak_points=2, newton=Newton(tolerance=1e-12)
    )
    made, forces = system(), load(STATES["gross slip"])
    dense = list(forced_response(made, forces, sweep))
    monkeypatch.setattr(balance_module, "products_pay", lambda _: True)
    assert forced_problem(made, forces, sweep).low.structured
    iterated = list(forced_response(made, forces, sweep))
    assert all(p.converged for p in [*dense, *iterated])
    assert {p.stage for p in iterated} >= {"low", "high"}
    for found, expected in zip(
        [p for p in iterated if p.stage == "low"][::100], [p for p in dense if p.stage == "low"][::100], strict=True
    ):
        assert_same(found.coefficients, expected.coefficients, 1e-9)
    last = [[p for p in points if p.stage == "low"][-1] for points in (iterated, dense)]
    assert last[0].omega == last[1].omega == 0.5
    assert_same(last[0].coefficients, last[1].coefficients, 1e-9)
    assert last[0].predicted_error == pytest.approx(last[1].predicted_error, rel=1e-4)
