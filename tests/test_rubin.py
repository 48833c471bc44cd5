"""Component modes with the kept dofs free: statics, kept and rigid modes, rates, and what cannot be kept."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from cyclic_models import random_sector, turned_frame, wedge
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.errors import InputError, SingularError
from stickslip.model.axis import Axis
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.matrices import chain, lumped
from stickslip.model.modes import natural_frequencies, with_springs
from stickslip.model.structure import Structure, join
from stickslip.reduction.choice import Reduction
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.free_interface import rubin
from stickslip.reduction.truncation import FrequencyError, ModesBelow, frequency_errors

pytestmark = pytest.mark.kernel


def dense(matrix):
    return matrix.toarray() if scipy.sparse.issparse(matrix) else matrix


def squares(structure):
    return scipy.linalg.eigvalsh(dense(structure.stiffness), dense(structure.mass))


@pytest.fixture(scope="module")
def held():
    return assemble_solid(wedge(8), Material())


@pytest.fixture(scope="module")
def free():
    return assemble_solid(wedge(8, clamp=False), Material())


def wave_structure(k, **options):
    return travelling_wave(cyclic_sector(random_sector(5, 1, **options), 5), k)


def test_basis_is_the_published_one(held):
    """Eq. 58 to 60 as printed, but divided by the square of the frequency, in dense algebra."""
    keep = held.dof_set("tip")[:4]
    K, M = dense(held.stiffness), dense(held.mass)
    values, shapes = scipy.linalg.eigh(K, M, subset_by_index=(0, 4))
    R = np.linalg.inv(K)[:, keep] - (shapes / values) @ shapes[keep].T
    delta = R @ np.linalg.inv(R[keep])
    expected = np.hstack([delta, shapes - delta @ shapes[keep]])
    found = rubin(held, keep, 5).basis
    found[:, 4:] *= np.sign(np.sum(found[:, 4:] * expected[:, 4:], axis=0))
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def from_all_modes(structure, keep, count):
    """The space of Rubin's reduction from all modes of the structure: the residual flexibility as the sum it stands for."""
    values, shapes = scipy.linalg.eigh(dense(structure.stiffness), dense(structure.mass))
    rest = shapes[:, count:]
    return np.hstack([(rest / values[count:]) @ rest[keep].T, shapes[:, :count]])


def space_gap(one, other):
    """Sine of the largest angle between two spaces."""
    return np.sin(scipy.linalg.subspace_angles(one, other).max())


@pytest.mark.parametrize("method", [rubin, craig_bampton])
def test_statics_on_kept_dofs_are_exact(held, method):
    keep = held.dof_set("tip")
    small = method(held, keep, 6)
    force = np.random.default_rng(0).standard_normal(keep.size)
    full = np.zeros(held.n)
    full[keep] = force
    load = np.concatenate([force, np.zeros(6)])
    exact = scipy.sparse.linalg.spsolve(held.stiffness.tocsc(), full)
    found = small.expand(np.linalg.solve(small.stiffness, load))
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())
    np.testing.assert_array_equal(small.basis[keep], np.eye(small.n)[: keep.size])


@pytest.mark.parametrize("method", [rubin, craig_bampton])
@pytest.mark.parametrize("k", [0, 1, 2])
def test_statics_are_exact_at_a_wave_number(method, k):
    structure = wave_structure(k, inner=6)
    keep = structure.dof_set("inner")[:6]
    small = method(structure, keep, 8)
    force = np.random.default_rng(0).standard_normal((2, 6)).T @ [1.0, 1.0j]
    full = np.zeros(structure.n, dtype=complex)
    full[keep] = force
    exact = structure.expand(np.linalg.solve(dense(structure.stiffness), full))
    load = np.concatenate([force, np.zeros(8)])
    found = small.expand(np.linalg.solve(small.stiffness, load))
    np.testing.assert_allclose(found, exact, atol=1e-11 * np.abs(exact).max())
    for matrix in (small.mass, small.stiffness):
        assert abs(matrix - matrix.conj().T).max() == 0.0


def test_kept_modes_are_exact(held):
    found = natural_frequencies(rubin(held, held.dof_set("tip"), 8), 8)
    np.testing.assert_allclose(found, natural_frequencies(held, 8), rtol=1e-9)
    wave = wave_structure(1, inner=6)
    small = rubin(wave, wave.dof_set("inner")[:6], 8)
    np.testing.assert_allclose(squares(small)[:8], squares(wave)[:8], rtol=1e-10)


def test_reduced_matrices_are_projections():
    full = wave_structure(2, inner=4)
    bare = Structure(full.mass, full.damping, full.stiffness, full.dofs)
    for method in (rubin, craig_bampton):
        small = method(bare, np.array([5, 2]), 4)
        for name in ("mass", "damping", "stiffness"):
            expected = small.basis.conj().T @ dense(getattr(full, name)) @ small.basis
            scale = np.abs(expected).max()
            np.testing.assert_allclose(getattr(small, name), expected, atol=1e-12 * scale)
        skew = small.damping - small.damping.conj().T
        assert abs(skew).max() > 1e-3 * abs(small.damping).max()  # Coriolis forces are not lost


def test_rigid_motions_are_exact(free):
    keep = free.dof_set("tip")
    small = rubin(free, keep, 10)
    found, exact = squares(small), squares(free)
    assert np.all(np.abs(found[:6]) < 1e-8 * exact[6])
    np.testing.assert_allclose(found[6:10], exact[6:10], rtol=1e-8)
    # each rigid motion is in the space: its image is what it was
    points = free.dofs.position[::3]
    for motion in (np.eye(3)[None].repeat(len(points), 0), -np.cross(points[:, None], np.eye(3))):
        for i in range(3):
            u = motion[:, :, i].ravel()
            q = np.linalg.lstsq(small.basis, u)[0]
            assert np.linalg.norm(small.basis @ q - u) < 1e-9 * np.linalg.norm(u)


def test_statics_of_a_free_body_under_balanced_loads(free):
    """Inertia relief: with loads in equilibrium the strain is that of the full model."""
    keep = free.dof_set("tip")
    small = rubin(free, keep, 8)
    rng = np.random.default_rng(1)
    arms = free.dofs.position[keep[::3]]
    rigid = np.hstack([np.tile(np.eye(3), (len(arms), 1)), np.vstack([np.cross(np.eye(3), a) for a in arms])])
    force = rng.standard_normal(keep.size)
    force -= rigid @ np.linalg.lstsq(rigid, force)[0]
    full = np.zeros(free.n)
    full[keep] = force
    u = np.linalg.lstsq(dense(free.stiffness), full, rcond=1e-12)[0]
    q = np.linalg.lstsq(small.stiffness, np.concatenate([force, np.zeros(8)]), rcond=1e-12)[0]
    energy = u @ free.stiffness @ u
    assert q @ small.stiffness @ q == pytest.approx(energy, rel=1e-8)


def test_free_sector_of_a_wheel_has_its_rigid_motions_at_each_wave(free):
    sector = cyclic_sector(free, 8)
    for k, rigid in ((0, 2), (1, 2), (2, 0), (4, 0)):
        wave = travelling_wave(sector, k)
        small = rubin(wave, wave.dof_set("tip"), 6)
        found, exact = squares(small), squares(wave)
        assert np.all(np.abs(found[:rigid]) < 1e-8 * exact[rigid])
        np.testing.assert_allclose(found[rigid:6], exact[rigid:6], rtol=1e-7)


def test_free_chain_without_geometry():
    stiffness = 100.0 * (2 * np.eye(20) - np.eye(20, k=1) - np.eye(20, k=-1))
    stiffness[0, 0] = stiffness[19, 19] = 100.0
    floating = lumped(np.ones(20), stiffness)
    small = rubin(floating, np.array([0, 19]), 4)
    np.testing.assert_allclose(natural_frequencies(small, 4), natural_frequencies(floating, 4), atol=1e-7)
    assert space_gap(small.basis, from_all_modes(floating, np.array([0, 19]), 4)) < 1e-9


def test_a_free_body_whose_frequencies_lie_far_apart():
    """One spring a hundred million times as stiff as the others: shifts meant for it drown the elastic modes."""
    stiffness = 2 * np.eye(40) - np.eye(40, k=1) - np.eye(40, k=-1)
    stiffness[0, 0] = stiffness[39, 39] = 1.0
    stiffness[20:22, 20:22] += 1e8 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    floating, keep = lumped(np.ones(40), stiffness), np.array([0, 39])
    for count in (1, 2, 5):
        small = rubin(floating, keep, count)
        assert space_gap(small.basis, from_all_modes(floating, keep, count)) < 1e-6


def test_several_bodies_of_which_one_is_free():
    stiffness = 100.0 * (2 * np.eye(9) - np.eye(9, k=1) - np.eye(9, k=-1))
    stiffness[0, 0] = stiffness[8, 8] = 100.0
    whole = join(held=chain(9, 1.0, 120.0), free=lumped(np.ones(9), stiffness))
    keep = np.array([8, 9])
    small = rubin(whole, keep, 6)
    assert space_gap(small.basis, from_all_modes(whole, keep, 6)) < 1e-9
    np.testing.assert_allclose(natural_frequencies(small, 6), natural_frequencies(whole, 6), atol=1e-7)


def rates(method, counts):
    """Errors of the second frequency of a bar with a spring at its end, and the slope of the last ones."""
    bar = chain(300, mass=1.0 / 300, stiffness=300.0)
    spring = np.zeros((1, 300))
    spring[0, -1] = 1.0
    exact = squares(with_springs(bar, spring, np.array([2.0])))[1]
    errors = []
    for count in counts:
        small = method(bar, np.array([299]), count)
        springs = np.eye(small.n)[:1]
        errors.append(squares(with_springs(small, springs, np.array([2.0])))[1] / exact - 1)
    return np.array(errors), np.log(errors[-1] / errors[-2]) / np.log(counts[-1] / counts[-2])


def test_rates_of_convergence_on_a_bar():
    """The tail of Σ 1/d⁴ falls with the third power of the number of modes, that of Σ 1/d⁶ with the fifth."""
    errors, slope = rates(craig_bampton, [4, 8, 16, 32])
    assert np.all(errors > 0)
    assert np.all(np.diff(errors) < 0)
    assert slope == pytest.approx(-3.0, abs=0.25)
    errors, slope = rates(rubin, [3, 6, 12])
    assert np.all(errors > 0)
    assert np.all(np.diff(errors) < 0)
    assert slope == pytest.approx(-5.0, abs=0.35)


def test_rubin_needs_fewer_modes_than_craig_bampton_where_contacts_stick(held):
    keep = held.dof_set("tip")
    spring = np.zeros((keep.size, held.n))
    spring[np.arange(keep.size), keep] = 1.0
    stiff = np.full(keep.size, 1e8)
    exact = natural_frequencies(with_springs(held, spring, stiff), 5)
    worst = {}
    for method in (rubin, craig_bampton):
        small = method(held, keep, 10)
        found = natural_frequencies(with_springs(small, small.basis[keep], stiff), 5)
        worst[method] = np.max(found / exact - 1)
        assert np.all(found > exact * (1 - 1e-9))
    assert worst[rubin] < 0.3 * worst[craig_bampton]


@settings(max_examples=8)
@given(seed=st.integers(0, 300), count=st.integers(0, 6), mirror=st.booleans(), k=st.integers(0, 2))
def test_rotation_and_mirror_change_nothing(seed, count, mirror, k):
    """In turned or mirrored axes the reduced model has the same frequencies and the same estimated errors."""
    full = wave_structure(k, inner=4)
    rng = np.random.default_rng(seed)
    axis = Axis(tuple(rng.standard_normal(3)))
    Q = turned_frame(axis) @ np.diag([1.0, 1.0, -1.0 if mirror else 1.0])
    turn = scipy.sparse.kron(scipy.sparse.eye_array(full.n // 3), Q, format="csr")
    other = Structure(*(turn @ m @ turn.T for m in (full.mass, full.damping, full.stiffness)), full.dofs, full.sets)
    full = Structure(full.mass, full.damping, full.stiffness, full.dofs, full.sets)
    keep = full.dof_set("inner")[:3]
    for method in (craig_bampton, rubin):
        one, two = (method(s, keep, count) for s in (full, other))
        np.testing.assert_allclose(squares(one), squares(two), rtol=1e-9)
        errors = [frequency_errors(s, r, 1e3).relative for s, r in ((full, one), (other, two))]
        np.testing.assert_allclose(*errors, rtol=1e-5, atol=1e-12)


@settings(max_examples=8)
@given(seed=st.integers(0, 300), k=st.integers(0, 2), steps=st.lists(st.integers(0, 12), min_size=2, max_size=2))
def test_frequencies_come_from_above_and_fall(seed, k, steps):
    """Cauchy's interlacing, on random travelling waves; Rubin's space, too, is a subspace."""
    structure = travelling_wave(cyclic_sector(random_sector(5, seed, inner=4), 5), k)
    keep = structure.dof_set("inner")[:4]
    exact = squares(structure)
    few, many = sorted(steps)
    for method in (craig_bampton, rubin):
        coarse, fine = (squares(method(structure, keep, m)) for m in (few, many))
        assert np.all(fine > exact[: fine.size] * (1 - 1e-10))
        if method is craig_bampton:
            assert np.all(coarse > fine[: coarse.size] * (1 - 1e-10))


def test_modes_below_a_frequency(held):
    exact = natural_frequencies(held, 12)
    small = rubin(held, held.dof_set("tip"), ModesBelow(0.5 * (exact[6] + exact[7]), factor=1.0))
    assert len(small.dof_set("modes")) == 7


def test_rigid_motions_may_not_be_left_out(free):
    with pytest.raises(InputError, match=r"got 4, and the structure has 6 rigid motions.*at least 6"):
        rubin(free, free.dof_set("tip"), 4)


def test_dofs_without_residual_flexibility_are_named():
    soft = join(soft=chain(2, 1.0, 1.0), stiff=chain(5, 1.0, 1e6))
    with pytest.raises(SingularError, match=r"kept dofs soft.node1.x: the residual.*Keep fewer modes"):
        rubin(soft, np.array([1, 6]), 2)
    # two dofs tied by a rod a hundred million times as stiff: either is free to go, both are not
    stiff = chain(8, mass=1.0, stiffness=1e3).stiffness.copy()
    stiff[3:5, 3:5] += 3e11 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(SingularError, match=r"kept dofs node[34].x, node[34].x: the residual"):
        rubin(lumped(np.ones(8), stiff), np.array([3, 4]), 2)


def test_wrong_choices_are_refused():
    full = chain(8, mass=1.0, stiffness=1e3)
    with pytest.raises(InputError, match="rubin: n_modes: got 7, and 6 dofs are not kept"):
        rubin(full, np.array([2, 5]), 7)
    with pytest.raises(InputError, match="rubin: keep: dof 8 is not among"):
        rubin(full, np.array([8]), 1)
    with pytest.raises(InputError, match="rubin: n_modes: got FrequencyError"):
        rubin(full, np.array([2]), FrequencyError(1e-3, 10.0))


def test_a_part_whose_modes_describe_its_kept_dofs_keeps_all():
    k = np.diag([1.0, 2.0, 3.0, 4.0])
    one = Structure(np.eye(4), np.zeros((4, 4)), k, chain(4, 1.0, 1.0).dofs)
    small = Reduction(n_modes=100, method="rubin").of(one, np.array([0]))
    assert small.n == 4
    assert squares(small) == pytest.approx([1.0, 2.0, 3.0, 4.0])
    with pytest.raises(SingularError):
        Reduction(n_modes=1, method="rubin").of(one, np.array([0]))
