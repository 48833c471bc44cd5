"""Fourier coefficients, loads, and the condensation against the whole linear system."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st
from models import table

from stickslip.errors import InputError
from stickslip.harmonic import spectral
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import harmonics_of, padded, to_complex, to_real
from stickslip.harmonic.spectral import ModeTerms, Poles, StateSpace
from stickslip.harmonic.structured import real_matrix
from stickslip.harmonic.travelling import MIN_CACHED_DOFS, condensed_once
from stickslip.model.matrices import lumped
from stickslip.model.structure import Structure

RETAINED = np.array([1, 4, 5])
OMEGA, ORDER = 3.1, 4


# ---- Fourier ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(1, 3), (4, 3), (6, 2, 5)])
def test_real_and_complex_round_trip(shape):
    rng = np.random.default_rng(0)
    real = rng.standard_normal((2 * shape[0] - 1, *shape[1:]))
    assert np.array_equal(to_real(to_complex(real)), real)
    complex_ = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    complex_[0] = complex_[0].real
    assert np.array_equal(to_complex(to_real(complex_)), complex_)


def test_convention_of_the_signal():
    # q(t) = Q0 + Re Q1 e^{iτ} = C cos τ + S sin τ with Q = C - iS
    q = np.array([[0.5], [2.0 - 3.0j]])
    real = to_real(q)[:, 0]
    tau = np.linspace(0, 6, 7)
    signal = q[0, 0].real + np.real(q[1, 0] * np.exp(1j * tau))
    assert np.allclose(signal, real[0] + real[1] * np.cos(tau) + real[2] * np.sin(tau), atol=1e-14)


def test_padding_adds_zeros_or_drops():
    q = np.arange(8.0).reshape(4, 2) + 1j
    assert np.array_equal(padded(q, 6)[:4], q)
    assert not np.any(padded(q, 6)[4:])
    assert np.array_equal(padded(padded(q, 6), 3), q)
    assert np.array_equal(padded(q, 1), q[:2])


def test_load_refuses_what_is_no_harmonic():
    with pytest.raises(InputError, match="an integer from 1 on, got 0"):
        HarmonicLoad(np.zeros(3), {0: np.zeros(3, complex)})
    with pytest.raises(InputError, match=r"harmonic 1 has shape \(2,\), the static load \(3,\)"):
        HarmonicLoad(np.zeros(3), {1: np.zeros(2, complex)})
    with pytest.raises(InputError, match=r"static: must be one row of real forces"):
        HarmonicLoad(np.array([1.0 + 3j, 0.0]))
    assert np.array_equal(HarmonicLoad([1, 2]).static, [1.0, 2.0])
    load = HarmonicLoad(np.array([1.0, -7.0, 0]), {2: np.array([0, 3 + 4j, 0])})
    assert load.scale == 7.0
    assert np.array_equal(load.coefficients(1)[1], np.zeros(3))


def test_products_share_their_stiffness_at_one_frequency_with_the_same_harmonics():
    """What is kept of one of them is used for another: at another frequency the product is another one."""
    rng = np.random.default_rng(2)
    stiffness = rng.standard_normal((6, 6))
    structure = lumped(np.eye(6), stiffness @ stiffness.T + np.eye(6), 0.01 * np.eye(6))
    linear = condense(structure, RETAINED, HarmonicLoad(np.ones(6)))
    at, q = linear.products(OMEGA, (0, 1, 2)), rng.standard_normal((5, 3))
    other_load = linear.with_load(HarmonicLoad(2.0 * np.ones(6))).products(OMEGA, (0, 1, 2))
    assert at.same(other_load)
    np.testing.assert_array_equal(other_load.product(q), at.product(q))
    for other in (linear.products(1.001 * OMEGA, (0, 1, 2)), linear.with_mass_damping(0.1).products(OMEGA, (0, 1, 2))):
        assert not at.same(other)
        assert np.abs(other.product(q) - at.product(q)).max() > 1e-4
    assert not at.same(linear.products(OMEGA, (0, 1, 3)))
    assert not at.same(linear)


@pytest.mark.parametrize("retained", [[-2], [True, False], [0, 0], [0, 2], [0.0]])
def test_only_different_dofs_are_retained(retained):
    structure = lumped(np.ones(2), np.array([[2.0, -1.0], [-1.0, 2.0]]))
    with pytest.raises(InputError, match=r"retained: must be different integers from 0 to 1"):
        condense(structure, np.array(retained), HarmonicLoad(np.ones(2)))


def test_structural_damping_is_refused():
    with pytest.raises(InputError, match="is complex"):
        lumped(np.ones(2), np.array([[2.0 + 0.1j, -1.0], [-1.0, 2.0]]))


# ---- condensation -------------------------------------------------------------------------------------------------------


def positive(rng, n):
    a = rng.standard_normal((n, n))
    return a @ a.T / n + np.eye(n)


def structure_of(kind, seed=0, n=9):
    rng = np.random.default_rng(seed)
    mass, stiffness = positive(rng, n), 20 * positive(rng, n)
    damping = {
        "proportional": 0.01 * mass + 0.02 * stiffness,
        "general": 0.3 * positive(rng, n),
        "none": np.zeros((n, n)),
    }
    if kind == "massless":
        mass[0] = mass[:, 0] = 0.0
        mass[7] = mass[:, 7] = 0.0
    if kind == "sparse":
        return Structure(
            scipy.sparse.csr_array(mass),
            scipy.sparse.csr_array(damping["general"]),
            scipy.sparse.csr_array(stiffness),
            table(("q",) * n),
        )
    if kind.startswith("coriolis"):
        spin = rng.standard_normal((n, n))
        dissipation = np.zeros((n, n)) if kind == "coriolis alone" else damping["general"]
        damping[kind] = dissipation + 1.5 * (spin - spin.T)
    loss = None
    if kind == "uniform loss":
        damping[kind], loss = damping["proportional"], 0.05 * stiffness
    elif "loss" in kind:
        loss = positive(rng, n)
    structure = Structure(mass, damping.get(kind, damping["general"]), stiffness, table(("q",) * n))
    return replace(structure, loss=loss)


def loaded(seed, n=9):
    rng = np.random.default_rng(seed + 100)
    return HarmonicLoad(
        rng.standard_normal(n), {h: rng.standard_normal(n) + 1j * rng.standard_normal(n) for h in (1, 3)}
    )


def dense(matrix):
    return matrix.toarray() if scipy.sparse.issparse(matrix) else matrix


def dynamic(structure, w):
    D = dense(structure.stiffness) + 1j * w * dense(structure.damping) - w**2 * dense(structure.mass)
    return D if structure.loss is None or w == 0 else D + 1j * dense(structure.loss)


def schur(structure, load, omega, order):
    inner = np.setdiff1d(np.arange(structure.n), RETAINED)
    f = load.coefficients(order)
    out, loads = [], []
    for h in range(order + 1):
        d = dynamic(structure, h * omega)
        x = np.linalg.solve(d[np.ix_(inner, inner)], np.column_stack([d[np.ix_(inner, RETAINED)], f[h, inner]]))
        out.append(d[np.ix_(RETAINED, RETAINED)] - d[np.ix_(RETAINED, inner)] @ x[:, :-1])
        loads.append(f[h, RETAINED] - d[np.ix_(RETAINED, inner)] @ x[:, -1])
    return np.array(out), np.array(loads)


KINDS = [
    "proportional",
    "general",
    "none",
    "massless",
    "sparse",
    "coriolis",
    "coriolis alone",
    "coriolis and loss",
    "loss",
    "uniform loss",
]


@pytest.mark.parametrize("kind", KINDS)
def test_condensed_is_the_schur_complement(kind):
    structure, load = structure_of(kind), loaded(0)
    linear = condense(structure, RETAINED, load)
    assert linear.diagonal == (kind in ("proportional", "none", "uniform loss"))
    assert (linear.spectral.terms is None) == ("loss" in kind)
    got = linear.condensed(OMEGA, ORDER)
    stiffness, force = schur(structure, load, OMEGA, ORDER)
    # an undamped interior may be close to resonance: the tolerance leaves room for its condition
    assert np.allclose(got.stiffness, stiffness, rtol=1e-9, atol=1e-9 * np.abs(stiffness).max())
    assert np.allclose(got.load, force, rtol=1e-9, atol=1e-9 * np.abs(force).max())
    assert np.all(got.load[0].imag == 0.0)
    assert np.all(got.derivative[0] == 0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_by_frequency(kind):
    structure, load = structure_of(kind), loaded(0)
    linear = condense(structure, RETAINED, load)
    got = linear.condensed(OMEGA, ORDER)
    step = 1e-4
    at = {s: linear.condensed(OMEGA + s * step, ORDER) for s in (-2, -1, 1, 2)}
    # fourth-order differences: the undamped interior has a resonance near by, where second-order ones are off by 1e-3
    for name, slope in (("stiffness", got.derivative), ("load", got.load_derivative)):
        v = {s: getattr(c, name) for s, c in at.items()}
        difference = (8 * (v[1] - v[-1]) - (v[2] - v[-2])) / (12 * step)
        assert np.allclose(slope, difference, rtol=0, atol=1e-6 * np.abs(difference).max()), name


@pytest.mark.parametrize("kind", KINDS)
def test_condensed_solution_and_recovery_are_the_full_solution(kind):
    structure, load = structure_of(kind, seed=3), loaded(3)
    linear = condense(structure, RETAINED, load)
    condensed = linear.condensed(OMEGA, ORDER)
    f = load.coefficients(ORDER)
    full = np.array([np.linalg.solve(dynamic(structure, h * OMEGA), f[h]) for h in range(ORDER + 1)])
    q = np.linalg.solve(condensed.stiffness, condensed.load[:, :, None])[:, :, 0]
    assert np.allclose(q, full[:, RETAINED], rtol=0, atol=1e-9 * np.abs(full).max())
    assert np.allclose(linear.recover(OMEGA, q), full, rtol=0, atol=1e-9 * np.abs(full).max())


@pytest.mark.parametrize("kind", KINDS)
def test_products_are_those_of_the_schur_complement(kind):
    structure, load = structure_of(kind, seed=5), loaded(5)
    linear = condense(structure, RETAINED, load)
    products = linear.products(OMEGA, harmonics_of(ORDER))
    stiffness, force = schur(structure, load, OMEGA, ORDER)
    slope = linear.condensed(OMEGA, ORDER)  # itself compared with differences above
    size = 1e-9 * np.abs(stiffness).max()
    for h in range(ORDER + 1):
        np.testing.assert_allclose(products.block(h), stiffness[h], rtol=0, atol=size)
    rows = np.random.default_rng(6).standard_normal((2 * ORDER + 1, 3))
    q = to_complex(rows)[:, :, None]
    product, by_omega = products.product_and_slope(rows)
    np.testing.assert_allclose(product, to_real((stiffness @ q)[:, :, 0]), rtol=0, atol=10 * size)
    np.testing.assert_allclose(products.product(rows), product, rtol=0, atol=10 * size)
    expected = to_real((slope.derivative @ q)[:, :, 0])
    np.testing.assert_allclose(by_omega, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(products.load, to_real(force), rtol=0, atol=1e-9 * np.abs(force).max())
    np.testing.assert_allclose(
        products.load_slope, to_real(slope.load_derivative), rtol=0, atol=1e-9 * np.abs(slope.load_derivative).max()
    )
    transposed = real_matrix(stiffness).T @ rows.ravel()
    np.testing.assert_allclose(products.transposed_product(rows).ravel(), transposed, rtol=0, atol=10 * size)


def test_change_of_all_dofs_is_the_difference_of_two_recoveries():
    structure, load = structure_of("general"), loaded(1)
    linear = condense(structure, RETAINED, load)
    rng = np.random.default_rng(9)
    q, dq = (rng.standard_normal((3, 3)) + 1j * rng.standard_normal((3, 3)) for _ in range(2))
    difference = linear.recover(OMEGA, q + dq) - linear.recover(OMEGA, q)
    assert np.allclose(linear.recover_change(OMEGA, dq), difference, atol=1e-12)


def test_another_load_on_the_same_structure():
    structure = structure_of("proportional")
    moved = condense(structure, RETAINED, loaded(0)).with_load(loaded(5)).condensed(OMEGA, ORDER)
    fresh = condense(structure, RETAINED, loaded(5)).condensed(OMEGA, ORDER)
    assert np.array_equal(moved.load, fresh.load)
    assert np.array_equal(moved.load_derivative, fresh.load_derivative)


def test_nothing_to_condense():
    structure, load = structure_of("general"), loaded(0)
    linear = condense(structure, np.arange(9), load)
    got = linear.condensed(OMEGA, 2)
    for h in range(3):
        assert np.allclose(got.stiffness[h], dynamic(structure, h * OMEGA), atol=1e-12)
    assert np.array_equal(got.load, load.coefficients(2))
    assert np.array_equal(linear.recover(OMEGA, got.load), got.load)


def test_retained_in_any_order():
    structure, load = structure_of("general"), loaded(0)
    order = np.array([2, 0, 1])
    a = condense(structure, RETAINED, load).condensed(OMEGA, 2)
    b = condense(structure, RETAINED[order], load).condensed(OMEGA, 2)
    assert np.allclose(b.stiffness, a.stiffness[:, order][:, :, order], atol=1e-12)
    assert np.allclose(b.load, a.load[:, order], atol=1e-12)


# ---- spectral decomposition of the interior -----------------------------------------------------------------------------


def decomposed(structure, load=None):
    linear = condense(structure, RETAINED, load or loaded(0, structure.n))
    return linear, linear.spectral.terms


def assert_schur(structure, omegas, order=ORDER, tolerance=1e-9):
    load = loaded(0, structure.n)
    linear = condense(structure, RETAINED, load)
    for omega in omegas:
        got = linear.condensed(omega, order)
        stiffness, force = schur(structure, load, omega, order)
        assert np.max(np.abs(got.stiffness - stiffness)) <= tolerance * np.max(np.abs(stiffness))
        assert np.max(np.abs(got.load - force)) <= tolerance * np.max(np.abs(force))
    return linear


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    damping=st.sampled_from([1e-3, 0.3, 10.0]),
    dashpots=st.integers(0, 2),
    spread=st.sampled_from([0.0, 3.0]),
    frequency=st.floats(-2.0, 2.0),
)
def test_sum_over_poles_is_the_schur_complement(seed, damping, dashpots, spread, frequency):
    # from light damping to overdamped, interior frequencies over decades, far below and far above them
    rng = np.random.default_rng(seed)
    n = 12
    scale = 10.0 ** (spread * rng.random(n) / 2)
    mass = positive(rng, n)
    stiffness = 20 * scale[:, None] * positive(rng, n) * scale
    c = damping * positive(rng, n)
    c[np.arange(dashpots), np.arange(dashpots)] += 100.0
    linear = assert_schur(Structure(mass, c, stiffness, table(("q",) * n)), [10.0**frequency])
    assert isinstance(linear.spectral.terms, Poles)


@pytest.mark.parametrize("kind", ["proportional", "none"])
def test_proportional_damping_sums_over_modes(kind):
    structure = structure_of(kind)
    _, terms = decomposed(structure)
    assert isinstance(terms, ModeTerms)
    assert_schur(structure, [1e-3, 0.5, OMEGA, 40.0, 1e3])


def test_modal_damping_of_the_interior_beside_other_damping_outside_is_exact():
    # diagonal in the interior's modes, but no multiple of the mass across: neither sum, and still no factorisation
    structure = structure_of("proportional")
    damping = np.array(structure.damping)
    inner = np.setdiff1d(np.arange(9), RETAINED)
    damping[1, inner[0]] = damping[inner[0], 1] = 0.05
    linear = assert_schur(replace(structure, damping=damping), [0.5, OMEGA])
    assert linear.diagonal
    assert linear.spectral.terms is None


def test_coordinates_without_mass_have_no_pole_at_infinity():
    structure = structure_of("massless")
    linear = assert_schur(structure, [0.01, OMEGA, 100.0])
    assert np.all(np.isfinite(linear.spectral.states.nu))
    assert isinstance(linear.spectral.terms, Poles)


def test_equal_bodies_have_equal_poles():
    # eigenvectors of a repeated pole are arbitrary within their space
    rng = np.random.default_rng(4)
    one = {name: s * positive(rng, 4) for name, s in (("m", 1.0), ("c", 0.3), ("k", 20.0))}
    m, c, k = (scipy.linalg.block_diag(np.eye(6), *(3 * [one[name]])) for name in "mck")
    k[1, 6:] = k[6:, 1] = 0.5
    k[1, 1] = 30.0
    structure = Structure(m, c, k, table(("q",) * 18))
    linear = assert_schur(structure, [0.5, OMEGA, 20.0])
    assert isinstance(linear.spectral.terms, Poles)


def oscillators(critical):
    """Interior of two coupled oscillators and one alone with `critical` times its critical damping."""
    m, k = np.eye(6), np.diag([9.0, 4, 3, 9, 9, 9])
    k[2, 3] = k[3, 2] = -1.0
    k[1, :] = k[:, 1] = [1.0, 5.0, 0.5, 0.5, 1.0, 1.0]
    c = np.diag([0.1, 0.1, 0.4, 0.1, 0.1, 0.1])
    c[0, 0] = 2.0 * 3.0 * critical
    return Structure(m, c, k, table(("q",) * 6))


@pytest.mark.parametrize("off", [0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3])
def test_critical_damping_is_factorised_where_its_eigenvectors_are_parallel(off):
    for side in (1.0 + off, 1.0 - off):
        linear = assert_schur(oscillators(side), [0.3, 3.0, 9.0])
        assert not linear.diagonal
        assert (linear.spectral.terms is None) == (off < 1e-8)


@pytest.mark.parametrize("kind", ["proportional", "general", "massless"])
def test_tables_of_residues_and_their_products_are_the_same(kind, monkeypatch):
    structure = structure_of(kind)
    linear, terms = decomposed(structure)
    many = linear.condensed(OMEGA, ORDER)
    assert "table" in vars(terms)
    del vars(terms)["table"]
    monkeypatch.setattr(spectral, "LARGEST_TABLE", 0)
    few = linear.condensed(OMEGA, ORDER)
    assert "table" not in vars(terms)
    for name in ("stiffness", "derivative"):
        theirs = getattr(few, name)
        np.testing.assert_allclose(getattr(many, name), theirs, atol=1e-12 * np.abs(theirs).max())


def test_large_interiors_are_factorised(monkeypatch):
    monkeypatch.setattr(spectral, "LARGEST_STATE_SPACE", 5)
    linear = assert_schur(structure_of("general"), [OMEGA])
    assert linear.spectral.terms is None


def test_no_decomposition_for_the_static_problem():
    linear = condense(structure_of("general"), RETAINED, loaded(0))
    linear.condensed(OMEGA, 0)
    linear.recover(OMEGA, np.ones((1, 3), dtype=complex))
    assert not {"states", "terms"} & set(vars(linear.spectral))


def test_another_load_keeps_the_decomposition():
    linear, terms = decomposed(structure_of("general"))
    assert linear.with_load(loaded(5)).spectral.terms is terms


def test_slope_at_zero_frequency_is_the_damping():
    structure = structure_of("general")
    linear = condense(structure, np.arange(9), loaded(0))
    np.testing.assert_allclose(linear.condensed(0.0, 2).derivative[2], 2j * structure.damping)


def test_products_at_one_frequency_use_the_poles():
    linear, _ = decomposed(structure_of("general"))
    got = linear.condensed(OMEGA, ORDER)
    products = linear.products(OMEGA, harmonics_of(ORDER))
    for h in range(ORDER + 1):
        np.testing.assert_allclose(products.block(h), got.stiffness[h], rtol=1e-11)
    assert all(isinstance(inner[0], StateSpace) for inner in products.inner)


# ---- messages -----------------------------------------------------------------------------------------------------------


def test_a_free_interior_is_refused():
    structure = structure_of("proportional")
    inner = np.setdiff1d(np.arange(9), RETAINED)
    stiffness = np.array(structure.stiffness)
    stiffness[inner[0]] = stiffness[:, inner[0]] = 0.0
    with pytest.raises(InputError, match=r"can move without stiffness .*Retain the dofs of free bodies"):
        condense(replace(structure, stiffness=stiffness), RETAINED, loaded(0))


@pytest.mark.parametrize("unit", [1e-8, 1.0, 1e8])
def test_an_interior_without_mass_and_stiffness_is_refused(unit):
    mass, stiffness = np.diag([1.0, 1, 0, 1]), np.diag([2.0, 2, 0, 2])
    structure = Structure(unit * mass, 0.0 * mass, unit * stiffness, table(("q",) * 4))
    with pytest.raises(InputError, match="can move without stiffness"):
        condense(structure, np.array([0]), HarmonicLoad(np.ones(4)))


@pytest.mark.parametrize("soft", [1e-10, 1e10])
def test_an_interior_of_unequal_stiffnesses_is_held(soft):
    # metres beside radians: entries of very different size are no sign of a free motion
    stiffness = np.diag([2.0, soft, 1.0])
    structure = Structure(np.eye(3), 0.1 * np.eye(3), stiffness, table(("q",) * 3))
    linear = condense(structure, np.array([0]), HarmonicLoad(np.ones(3)))
    moved = linear.recover(0.5, linear.condensed(0.5, 1).load)
    assert moved[0, 1] == pytest.approx(1.0 / soft, rel=1e-12)


def test_a_tiny_mass_is_condensed():
    mass, stiffness = np.diag([1.0, 1, 1e-14, 1]), np.diag([2.0, 2, 3, 2])
    stiffness[0, 2] = stiffness[2, 0] = 0.5
    structure = Structure(mass, 0.1 * stiffness, stiffness, table(("q",) * 4))
    got = condense(structure, np.array([0]), HarmonicLoad(np.ones(4))).condensed(1.0, 1)
    d = dynamic(structure, 1.0)
    assert got.stiffness[1, 0, 0] == pytest.approx(d[0, 0] - d[0, 2] ** 2 / d[2, 2], rel=1e-10)


def test_static_problem_feels_no_loss():
    structure = structure_of("loss")
    with_loss, without = (
        condense(s, RETAINED, loaded(0)).condensed(OMEGA, 0) for s in (structure, replace(structure, loss=None))
    )
    assert np.array_equal(with_loss.stiffness, without.stiffness)
    assert np.array_equal(with_loss.load, without.load)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), spin=st.sampled_from([1e-3, 1.0, 30.0]), frequency=st.floats(-2.0, 2.0))
def test_coriolis_terms_are_summed_over_poles(seed, spin, frequency):
    rng = np.random.default_rng(seed)
    skew = rng.standard_normal((12, 12))
    damping = 0.1 * positive(rng, 12) + spin * (skew - skew.T)
    structure = Structure(positive(rng, 12), damping, 20 * positive(rng, 12), table(("q",) * 12))
    linear = assert_schur(structure, [10.0**frequency])
    assert isinstance(linear.spectral.terms, Poles)


def test_one_triangle_of_a_damping_matrix_is_no_coriolis_matrix():
    structure = structure_of("general")
    with pytest.raises(InputError, match=r"Structure\.damping: holds one triangle alone"):
        condense(replace(structure, damping=np.triu(structure.damping)), RETAINED, loaded(0))


@pytest.mark.parametrize("name", ["mass", "stiffness", "loss"])
def test_a_matrix_that_is_not_symmetric_is_named(name):
    structure = structure_of("loss")
    skew = np.array(getattr(structure, name))
    skew[0, 3] += 1.0
    with pytest.raises(InputError, match=rf"Structure\.{name}: is not symmetric"):
        condense(replace(structure, **{name: skew}), RETAINED, loaded(0))
    skew[0, 3] = np.nan
    with pytest.raises(InputError, match=rf"Structure\.{name}: contains NaN"):
        condense(replace(structure, **{name: skew}), RETAINED, loaded(0))


def test_load_of_another_structure_is_refused():
    with pytest.raises(InputError, match="4 entries for 9 dofs"):
        condense(structure_of("general"), RETAINED, HarmonicLoad(np.zeros(4)))


def test_a_structure_is_condensed_once_until_its_matrices_change():
    rng = np.random.default_rng(0)
    half = rng.standard_normal((MIN_CACHED_DOFS, MIN_CACHED_DOFS))
    stiffness = half @ half.T + MIN_CACHED_DOFS * np.eye(MIN_CACHED_DOFS)
    own = Structure(
        np.eye(MIN_CACHED_DOFS), 1e-3 * stiffness, stiffness, table(tuple(f"a{i}" for i in range(MIN_CACHED_DOFS)))
    )
    first, second = (
        HarmonicLoad(np.zeros(MIN_CACHED_DOFS), {1: rng.standard_normal(MIN_CACHED_DOFS) + 0j}) for _ in range(2)
    )
    retained = np.arange(3)
    one, two = (condensed_once(own, retained, load) for load in (first, second))
    assert two.spectral is one.spectral
    alone = condense(own, retained, second).condensed(2.0, 1)
    np.testing.assert_array_equal(two.condensed(2.0, 1).stiffness, alone.stiffness)
    np.testing.assert_array_equal(two.condensed(2.0, 1).load, alone.load)
    assert condensed_once(own, np.arange(4), first).n == 4
    own.stiffness[0, 0] += 100.0
    changed = condensed_once(own, retained, second).condensed(2.0, 1)
    expected = condense(own, retained, second).condensed(2.0, 1)
    np.testing.assert_array_equal(changed.stiffness, expected.stiffness)
