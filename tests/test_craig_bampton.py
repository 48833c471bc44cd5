"""Craig-Bampton reduction, natural frequencies, added springs, lumped structures."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse

from stickslip.errors import InputError, SingularError
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.matrices import chain, lumped
from stickslip.model.mesh.blade_pair import BladePair, mesh_blade_pair
from stickslip.model.modes import natural_frequencies, with_springs
from stickslip.model.rigid.dampers import FlatCurvedDamper, gap_operator
from stickslip.model.structure import Structure, join
from stickslip.reduction.fixed_interface import craig_bampton

pytestmark = pytest.mark.kernel

COARSE = {"airfoil_size": 0.05, "platform_size": 0.02, "foot_size": 0.05}


@pytest.fixture(scope="module")
def blades():
    mesh = mesh_blade_pair(BladePair(**COARSE), FlatCurvedDamper().contact_points())
    return assemble_solid(mesh, Material())


@pytest.fixture(scope="module")
def reduced(blades):
    keep = np.concatenate([blades.dof_set(name) for name in ("contact", "force", "output")])
    return craig_bampton(blades, keep, 25)


def stuck(blades):
    """Join the blades with the damper by two-way springs at the contacts."""
    damper = FlatCurvedDamper()
    points, body = damper.contact_points(), damper.body()
    whole = join(blades=blades, damper=body.structure())
    contact = whole.dof_set("blades.contact").reshape(9, 3)
    operator = gap_operator(points, contact, whole.dof_set("damper"), whole.n, body)
    share = {"flat": np.array([450e6, 450e6, 520e6]) / 6, "curved": np.array([20e6, 450e6, 25e6]) / 3}
    return with_springs(whole, operator, np.concatenate([share[s] for s in points.side]))


def random_chain():
    """A chain with a full damping matrix, so that nothing is diagonal by luck."""
    base = chain(12, mass=2.0, stiffness=1e4, damping_factor=1e-3)
    shift = np.random.default_rng(3).standard_normal((12, 12))
    return base.with_damping(base.damping + shift @ shift.T)


def test_five_frequencies_free_and_stuck_to_a_thousandth(blades, reduced):
    """The agreement that a study asks of its reduction, and convergence from above."""
    for full, small in ((blades, reduced), (stuck(blades), stuck(reduced))):
        exact, found = natural_frequencies(full, 5), natural_frequencies(small, 5)
        np.testing.assert_allclose(found, exact, rtol=1e-3)
        assert np.all(found > exact * (1 - 1e-9))


def test_first_bending_mode_and_the_dampers_effect(blades):
    free = natural_frequencies(blades, 2)
    held = natural_frequencies(stuck(blades), 2)
    # equal blades; the mesh is coarse, the range is that of the default case
    assert free[1] == pytest.approx(free[0], rel=1e-6)
    assert 150 < free[0] < 200
    assert held[0] > 1.005 * free[0]
    assert held[1] > 1.1 * free[0]


def test_reduction_is_exact_in_statics(blades, reduced):
    load = np.random.default_rng(0).standard_normal(reduced.n)
    load[reduced.dof_set("modes")] = 0.0
    full = np.zeros(blades.n)
    kept = np.concatenate([blades.dof_set(name) for name in ("contact", "force", "output")])
    full[kept] = load[: len(kept)]
    exact = scipy.sparse.linalg.spsolve(blades.stiffness.tocsc(), full)
    found = reduced.expand(np.linalg.solve(reduced.stiffness, load))
    # ten digits: the conditioning of a slender blade's stiffness takes the others
    np.testing.assert_allclose(found, exact, atol=1e-8 * np.abs(exact).max())


def test_reduced_matrices_are_projections():
    full = random_chain()
    small = craig_bampton(full, np.array([11, 4]), 3)
    for name in ("mass", "damping", "stiffness"):
        expected = small.basis.T @ getattr(full, name) @ small.basis
        found = getattr(small, name)
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())
    np.testing.assert_allclose(small.mass[2:, 2:], np.eye(3), atol=1e-13)
    np.testing.assert_array_equal(small.expand(np.eye(5))[[11, 4]], np.eye(5)[:2])


def test_all_modes_kept_change_nothing():
    full = random_chain()
    small = craig_bampton(full, np.array([0, 11]), 10)
    np.testing.assert_allclose(natural_frequencies(small, 12), natural_frequencies(full, 12))


def test_frequencies_fall_as_modes_are_added():
    full = chain(30, mass=1.0, stiffness=1e4)
    found = [natural_frequencies(craig_bampton(full, np.array([29]), m), 3) for m in (3, 5, 9)]
    assert np.all(np.diff(found, axis=0) < 0)
    assert np.all(found[-1] > natural_frequencies(full, 3))


def test_reducing_twice_leads_back_to_the_full_model():
    full = chain(10, mass=1.0, stiffness=1e4)
    once = craig_bampton(full, np.array([4, 9]), 8)
    twice = craig_bampton(once, np.array([1]), 9)
    static = np.linalg.solve(twice.stiffness, np.eye(10)[0])
    tip = np.linalg.solve(full.stiffness, np.eye(10)[9])
    np.testing.assert_allclose(twice.expand(static), tip, rtol=1e-10)


def test_sets_and_labels_survive(blades, reduced):
    for name in ("contact", "contact_R", "force", "output"):
        before = blades.dofs.take(blades.dof_set(name))
        after = reduced.dofs.take(reduced.dof_set(name))
        assert after.labels == before.labels
    assert len(reduced.dof_set("modes")) == 25
    partly = craig_bampton(blades, blades.dof_set("contact")[:6], 1)
    assert "contact" not in partly.sets
    assert reduced.n == 27 + 3 + 9 + 25


def test_keeping_all_dofs_needs_no_modes():
    full = random_chain()
    np.testing.assert_allclose(craig_bampton(full, np.arange(12), 0).stiffness, full.stiffness, atol=1e-9)


@pytest.mark.parametrize(
    ("keep", "modes", "message"),
    [
        ([0, 3, 0], 1, r"dof 0 \(node0.x\) is listed more than once"),
        ([0, 12], 1, "dof 12 is not among the structure's 12 dofs"),
        ([-1], 1, "dof -1 is not among"),
        ([0, 1], 11, "got 11, and 10 dofs are not kept"),
        ("TIP", 1, r"craig_bampton: keep: holds the name 'TIP', which is no set.*dof_set"),
        ([True, False], 1, r"keep: is a mask. Give indices: np.flatnonzero"),
        ([0.5, 1.0], 1, "keep: holds .*0.5.*, which is no index"),
    ],
)
def test_bad_choices_are_named(keep, modes, message):
    with pytest.raises(InputError, match=message):
        craig_bampton(chain(12, mass=1.0, stiffness=1.0), np.array(keep), modes)


def test_nothing_kept_is_modal_truncation():
    """Documented: the lowest modes of a structure that its supports hold."""
    full = chain(12, mass=1.0, stiffness=1.0)
    small = craig_bampton(full, np.array([]), 3)
    np.testing.assert_allclose(natural_frequencies(small, 3), natural_frequencies(full, 3), rtol=1e-12)


def test_the_name_of_a_set_is_told_from_its_dofs():
    full = replace(chain(12, mass=1.0, stiffness=1.0), sets={"tip": np.array([11])})
    with pytest.raises(InputError, match=r"holds the name 'tip'. Give its dofs: structure.dof_set\('tip'\)"):
        craig_bampton(full, "tip", 1)


def test_a_body_that_nothing_holds_is_named():
    damper = FlatCurvedDamper().body().structure()
    whole = join(blades=chain(5, mass=1.0, stiffness=1.0), damper=damper)
    with pytest.raises(SingularError, match=r"fixed: 6 bodies are not held.*damper\.x"):
        craig_bampton(whole, np.array([0]), 1)


def test_a_floating_chain_is_singular():
    stiffness = 100.0 * (2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1))
    stiffness[0, 0] = stiffness[4, 4] = 100.0
    floating = lumped(np.ones(5), stiffness)
    with pytest.raises(SingularError, match=r"with the kept dofs fixed: one body is not held.*translation along x"):
        craig_bampton(floating, np.array([], dtype=int), 2)
    assert natural_frequencies(floating, 1)[0] == pytest.approx(0.0, abs=1e-6)


def test_chain_has_its_closed_form_frequencies():
    n, m, k = 600, 0.2, 5e4  # large enough for the sparse solver
    dense = chain(n, m, k)
    sparse = Structure(*(scipy.sparse.csr_array(x) for x in (dense.mass, dense.damping, dense.stiffness)), dense.dofs)
    angle = (2 * np.arange(1, 7) - 1) * math.pi / (2 * (2 * n + 1))
    exact = 2 * math.sqrt(k / m) * np.sin(angle) / (2 * math.pi)
    np.testing.assert_allclose(natural_frequencies(sparse, 6), exact, rtol=1e-9)
    np.testing.assert_allclose(
        natural_frequencies(chain(20, m, k), 1), 2 * math.sqrt(k / m) * math.sin(math.pi / 82) / (2 * math.pi)
    )


def test_equal_uncoupled_parts_keep_all_their_frequencies():
    one = chain(500, 1.0, 1e4)
    pair = join(left=one, right=one)
    sparse = Structure(*(scipy.sparse.csr_array(x) for x in (pair.mass, pair.damping, pair.stiffness)), pair.dofs)
    single = natural_frequencies(one, 3)
    np.testing.assert_allclose(natural_frequencies(sparse, 6), np.repeat(single, 2), rtol=1e-8)


def test_added_springs_dense_and_sparse():
    base = chain(4, 1.0, 10.0)
    operator = np.array([[0.0, 1.0, 0.0, -1.0]])
    found = with_springs(base, operator, np.array([7.0])).stiffness - base.stiffness
    expected = 7.0 * operator.T @ operator
    np.testing.assert_allclose(found, expected, atol=1e-14)
    sparse = Structure(*(scipy.sparse.csr_array(x) for x in (base.mass, base.damping, base.stiffness)), base.dofs)
    found = with_springs(sparse, operator, np.array([7.0])).stiffness
    assert scipy.sparse.issparse(found)
    np.testing.assert_allclose(found.toarray() - base.stiffness, expected, atol=1e-14)


@pytest.mark.parametrize("n", [0, 13])
def test_too_many_frequencies_are_refused(n):
    with pytest.raises(InputError, match=f"{n} asked of a structure with 12 dofs"):
        natural_frequencies(chain(12, 1.0, 1.0), n)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.eye(2), [[1.0, 2.0], [3.0, 4.0]]), r"stiffness: is not symmetric: entry \(0, 1\)"),
        ((np.eye(2), np.eye(3)), r"stiffness: must be square of size 2, got shape \(3, 3\)"),
        ((np.eye(2), [[math.nan, 0.0], [0.0, 1.0]]), "stiffness: holds NaN"),
        (([1.0, -1.0], np.eye(2)), "mass: must be positive definite, its lowest eigenvalue is -1"),
        ((np.eye(2), np.eye(2), None, ["a", "a"]), "need 2 different names"),
    ],
)
def test_bad_matrices_are_named(arguments, message):
    with pytest.raises(InputError, match=message):
        lumped(*arguments)


def test_names_become_sets_and_bad_chains_are_refused():
    assert lumped(np.ones(2), np.eye(2), names=["hub", "tip"]).dof_set("tip").tolist() == [1]
    with pytest.raises(InputError, match="positive stiffness, got 3 and 0"):
        chain(3, 1.0, 0.0)
