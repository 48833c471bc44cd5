"""Similarity of Jacobians and norms of harmonic blocks: closed forms, plain twins and what units must not change."""

from dataclasses import replace

import numpy as np
import pytest
from models import balance_of, free_body_3d, solved, table

from evidence.models.lumped import blades_and_damper
from stickslip.contact.interface import Interface
from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.errors import InputError, SingularError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.selection.similarity import harmonic_block_norms, jacobian_similarity
from stickslip.model.structure import Structure
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton, newton


def two_solutions(system, load, hertz, samples=256):
    """Return the balance with five harmonics, the padded solution with one, that with five, and the frequency."""
    omega = 2 * np.pi * hertz
    low, solution = solved(system, load, omega, 1, samples)
    high = low.with_order(5)
    padded = high.unknowns(low.coefficients(solution.x))
    exact = newton(lambda v: high.linearise(v, omega), padded, Newton(max_iterations=60))
    assert exact.status.converged
    return high, padded, exact.x, omega


def by_differences(balance, x, omega, step=1e-6):
    """Return the Jacobian by central differences of the residual, in N/m."""
    columns = []
    for i in range(x.size):
        away = np.zeros(x.size)
        away[i] = step
        ahead, behind = (balance.linearise(x + s * away, omega).residual for s in (1, -1))
        columns.append((ahead - behind) / (2 * step))
    return np.array(columns).T * balance.force_scale / balance.displacement_scale


def test_similarity_against_differences_of_the_residual():
    high, padded, exact, omega = two_solutions(*blades_and_damper(), 164.0)
    ones = np.ones(high.linear.n)
    found = jacobian_similarity(high, padded, exact, omega, scales=ones)
    J, J_exact = (by_differences(high, x, omega) for x in (padded, exact))
    assert found.size == 66
    # differences of forces with kinks are good to the step
    change = np.sqrt(((J - J_exact) ** 2).sum() / (J_exact**2).sum())
    assert found.change == pytest.approx(change, rel=1e-3)
    assert found.change > 1e-3
    gamma = np.linalg.inv(J) @ J_exact
    assert found.trace == pytest.approx(gamma.trace(), rel=1e-5)
    assert found.mean_diagonal == pytest.approx(np.mean(np.diagonal(gamma)), rel=1e-5)
    off = np.abs(gamma - np.diag(np.diagonal(gamma)))
    zeros = (np.count_nonzero(off <= 1e-3) - 66) / (66 * 65)
    assert found.zero_share == pytest.approx(zeros, abs=0.005)
    assert found.tolerance == 1e-3


def test_stuck_contacts_leave_nothing_to_compare():
    high, padded, exact, omega = two_solutions(*blades_and_damper(excitation=0.01), 150.0)
    found = jacobian_similarity(high, padded, exact, omega)
    assert found.change < 1e-12
    assert found.trace == pytest.approx(66, rel=1e-12)
    assert found.mean_diagonal == pytest.approx(1, rel=1e-12)
    assert found.zero_share == 1.0


@pytest.mark.parametrize(("length", "force"), [(1e3, 1.0), (1.0, 1e-3), (1e-2, 50.0)])
def test_similarity_does_not_depend_on_units(length, force):
    one, other = (
        jacobian_similarity(*two_solutions(*blades_and_damper(length=a, force=b), 164.0))
        for a, b in ((1.0, 1.0), (length, force))
    )
    for name in ("change", "trace", "mean_diagonal"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-6)
    assert other.zero_share == pytest.approx(one.zero_share, abs=1e-3)


def test_rotations_may_come_in_any_unit():
    """Coordinates of a free body in degrees instead of radians: sums of squares in natural scales are the same."""
    system, load = free_body_3d()
    system = system.with_retention(1e4)  # a body that slips in both contacts is held by nothing
    unit = np.ones(12)
    unit[9:] = np.pi / 180.0
    structure = system.structure
    turned = replace(
        structure,
        mass=unit[:, None] * structure.mass * unit,
        damping=unit[:, None] * structure.damping * unit,
        stiffness=unit[:, None] * structure.stiffness * unit,
    )
    gaps = system.interface.gap_operator.toarray() * unit
    other = replace(system, structure=turned, interface=Interface(system.interface.names, system.interface.laws, gaps))
    loads = load, HarmonicLoad(load.static * unit, {1: load.harmonics[1] * unit})
    found, plain = [], []
    for own, own_load in zip((system, other), loads, strict=True):
        balance = balance_of(own, own_load, 2)
        rng = np.random.default_rng(3)
        u = 2e-5 * (rng.standard_normal((2, 3, 12)) + 1j * rng.standard_normal((2, 3, 12)))
        u[:, 0] = u[:, 0].real
        u = u / (unit if own is other else 1.0)
        x, y = (balance.unknowns(part[:, own.retained]) for part in u)
        found.append(jacobian_similarity(balance, x, y, 200.0))
        plain.append(jacobian_similarity(balance, x, y, 200.0, scales=np.ones(balance.linear.n)))
    assert found[0].change > 0.01
    assert found[1].change == pytest.approx(found[0].change, rel=1e-6)
    assert found[1].trace == pytest.approx(found[0].trace, rel=1e-6)
    assert found[1].zero_share == pytest.approx(found[0].zero_share, abs=1e-3)
    assert abs(plain[1].change - plain[0].change) > 1e-2 * plain[0].change


# ---- blocks -------------------------------------------------------------------------------------------------------------


def one_mass(law):
    one = np.ones((1, 1))
    structure = Structure(one, 0.02 * one, one.copy(), table(("x",)))
    interface = Interface(("c",), (law,), np.array([[1.0], [0.0], [0.0]]))
    system = System(structure, interface, np.array([0]))
    return system, HarmonicLoad(np.zeros(1), {1: np.array([0.1 + 0j])})


def test_blocks_of_a_cubic_spring_in_closed_form():
    """At ``g = a cos τ`` the stiffness is ``3 c g² = 3/2 c a² (1 + cos 2τ)``: it couples h with h and h ± 2 only."""
    c, a, omega = 0.7, 0.4, 0.8
    balance = balance_of(*one_mass(CubicSpring(cubic_t=c)), order=4)
    x = balance.unknowns(np.array([[0], [a]], dtype=complex))
    ones = np.ones(1)
    contact = harmonic_block_norms(balance, x, omega, "contact", scales=ones)
    p = 1.5 * c * a**2
    want = np.zeros((5, 5))
    for h in range(5):
        want[h, h] = p
        if h + 2 < 5:
            want[h, h + 2] = want[h + 2, h] = p / 2
    want[1, 1] = 1.5 * p  # its mirror image at -1 adds half
    want[2, 0] = p  # and a constant shifts cos 2τ twice as much as cos 2τ the constant
    assert np.allclose(contact, want, rtol=0, atol=1e-12)
    jacobian = harmonic_block_norms(balance, x, omega, scales=ones)
    z = np.array([1 - (h * omega) ** 2 + 0.02j * h * omega for h in range(5)])
    off = ~np.eye(5, dtype=bool)
    assert np.allclose(jacobian[off], contact[off], rtol=0, atol=1e-12)
    # where K̂ʰʰ is a number the block is the complex number Z_h + p
    for h in (0, 2, 3, 4):
        assert jacobian[h, h] == pytest.approx(abs(z[h] + p), rel=1e-12)


@pytest.mark.parametrize("kept", [(0, 1), (0, 2), (0, 1, 3)])
def test_what_a_solution_neglects_is_what_its_jacobian_lacks(kept):
    """J - ΔJ has the blocks of the Jacobian with few harmonics, and beside them only the diagonal (eq. 20)."""
    system, load = blades_and_damper()
    omega = 2 * np.pi * 161.0
    few = balance_of(system, load, 1, 256)
    _, solution = solved(system, load, omega, 1, 256)
    high = few.with_order(3)
    x = high.unknowns(few.coefficients(solution.x))
    whole = harmonic_block_norms(high, x, omega)
    missing = harmonic_block_norms(high, x, omega, "missing", kept)
    same = [high.harmonics.index(h) for h in kept]
    own = few.with_harmonics(kept) if kept[-1] > 1 else few
    if 1 in kept:  # else the motion itself is cut
        at = own.unknowns(few.coefficients(solution.x))
        assert np.allclose(harmonic_block_norms(own, at, omega), whole[np.ix_(same, same)], rtol=1e-9, atol=1e-12)
    left = whole - missing
    for i, h in enumerate(high.harmonics):
        for j, k in enumerate(high.harmonics):
            if h == k or (h in kept and k in kept):
                assert missing[i, j] == 0.0
            else:
                assert abs(left[i, j]) < 1e-12
                assert missing[i, j] > 1e-3


def test_bonded_contacts_couple_nothing():
    balance = balance_of(*one_mass(Bonded(k_t=1.0, k_w=1.0, k_n=1.0)), order=3)
    rng = np.random.default_rng(0)
    norms = harmonic_block_norms(balance, rng.standard_normal(balance.size), 0.5, "contact")
    # natural scale: structure and contact together have a stiffness of two
    assert np.allclose(norms, 0.5 * np.eye(4), rtol=0, atol=1e-12)


def test_products_give_the_blocks_of_the_array():
    system, load = blades_and_damper()
    high, padded, exact, omega = two_solutions(system, load, 164.0)
    products = replace(high, jacobian="structured")
    assert products.structured
    assert jacobian_similarity(products, padded, exact, omega).change == pytest.approx(
        jacobian_similarity(high, padded, exact, omega).change, rel=1e-9
    )
    for part in ("jacobian", "contact"):
        one, other = (harmonic_block_norms(b, padded, omega, part) for b in (high, products))
        assert np.allclose(one, other, rtol=1e-9, atol=1e-12)


def test_what_cannot_be_compared_is_refused():
    balance = balance_of(*blades_and_damper(), order=3)
    x = np.zeros(balance.size)
    with pytest.raises(InputError, match=r"reference: has shape \(3,\) for 42 unknowns"):
        jacobian_similarity(balance, x, np.zeros(3), 900.0)
    with pytest.raises(InputError, match="scales: must be 6 positive"):
        jacobian_similarity(balance, x, x, 900.0, scales=np.zeros(6))
    with pytest.raises(InputError, match="part = 'missing', kept = None"):
        harmonic_block_norms(balance, x, 900.0, "missing")
    with pytest.raises(InputError, match="part = 'all'"):
        harmonic_block_norms(balance, x, 900.0, "all")
    x[5] = -1e3  # the damper hangs free of both blades
    with pytest.raises(SingularError, match="Jacobian at 900 rad/s"):
        jacobian_similarity(balance, x, x, 900.0)
