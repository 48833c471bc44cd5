"""The second reduction: characteristic constraint modes of interface dofs."""

import numpy as np
import pytest
import scipy.linalg
from cyclic_models import wedge

from stickslip.errors import InputError, SingularError
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.modes import natural_frequencies
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton, reduce_interface
from stickslip.reduction.free_interface import rubin
from stickslip.reduction.full_wheel import wheel_shape
from stickslip.reduction.truncation import FrequencyError, ModesBelow, frequency_errors


@pytest.fixture(scope="module")
def sector():
    return assemble_solid(wedge(8, cells=(3, 2, 1)), Material())


@pytest.fixture(scope="module")
def once(sector):
    """The faces and the rim are kept, and enough modes that the first reduction counts for nothing."""
    names = ("tip", "cyclic_low", "cyclic_high")
    keep = np.concatenate([sector.dof_set(name) for name in names])
    return craig_bampton(sector, keep, 60)


def faces(structure):
    return np.concatenate([structure.dof_set(n) for n in ("cyclic_low", "cyclic_high")])


def test_modes_are_those_of_the_statically_condensed_interface(once):
    """With nothing else kept: the eigenvectors of the paper, from its two matrices."""
    nodal = np.setdiff1d(np.arange(once.n), once.dof_set("modes"))
    K, M = (m[np.ix_(nodal, nodal)] for m in (once.stiffness, once.mass))
    squares = scipy.linalg.eigvalsh(K, M)
    small = reduce_interface(once, nodal, 9)
    assert small.n == 60 + 9
    at = small.dof_set("interface_modes")
    np.testing.assert_allclose(np.diag(small.stiffness)[at], squares[:9], rtol=1e-9)
    np.testing.assert_allclose(small.mass[np.ix_(at, at)], np.eye(9), atol=1e-10)
    assert list(small.dof_set("modes")) == list(range(60))


def test_contact_dofs_stay_physical_and_exact_in_statics(sector, once):
    small = reduce_interface(once, faces(once), 5)
    tip = small.dof_set("tip")
    force = np.random.default_rng(0).standard_normal(tip.size)
    load = np.zeros(small.n)
    load[tip] = force
    full = np.zeros(sector.n)
    full[sector.dof_set("tip")] = force
    exact = scipy.sparse.linalg.spsolve(sector.stiffness.tocsc(), full)
    found = small.expand(np.linalg.solve(small.stiffness, load))
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())
    assert small.dofs.take(tip).labels == sector.dofs.take(sector.dof_set("tip")).labels
    assert "cyclic_low" not in small.sets


def test_frequencies_fall_to_those_before_the_reduction(once):
    exact = natural_frequencies(once, 5)
    errors = []
    for count in (3, 10, 30, 60):
        small = reduce_interface(once, faces(once), count)
        errors.append(natural_frequencies(small, 5) / exact - 1)
    assert np.all(np.array(errors) > -1e-12)
    assert np.all(np.diff(errors, axis=0) < 0)
    assert np.max(errors[-1]) < 1e-3
    whole = reduce_interface(once, faces(once), faces(once).size)
    np.testing.assert_allclose(natural_frequencies(whole, 5), exact, rtol=1e-9)


def test_its_error_is_estimated(once):
    exact = natural_frequencies(once, 5)
    for count, tolerance in ((30, 0.02), (60, 0.002)):
        small = reduce_interface(once, faces(once), count)
        errors = frequency_errors(once, small, 1.01 * exact[-1])
        true = errors.frequencies_hz / exact - 1
        np.testing.assert_allclose(errors.relative, true, rtol=tolerance)


def test_number_by_an_error_or_a_frequency(once):
    exact = natural_frequencies(once, 4)
    small = reduce_interface(once, faces(once), FrequencyError(1e-3, up_to_hz=1.01 * exact[-1]))
    assert np.max(natural_frequencies(small, 4) / exact - 1) < 1.02e-3
    assert small.dof_set("interface_modes").size < faces(once).size / 2
    inner = faces(once)
    squares = scipy.linalg.eigvalsh(*(m[np.ix_(inner, inner)] for m in (once.stiffness, once.mass)))
    limit = 2 * exact[-1]
    below = reduce_interface(once, inner, ModesBelow(exact[-1], factor=2.0))
    expected = np.count_nonzero(np.sqrt(squares) < 2 * np.pi * limit)
    assert below.dof_set("interface_modes").size == expected


@pytest.mark.parametrize("k", [0, 3])
def test_the_chain_of_a_wave_expands_to_the_wheel(sector, k):
    """Wave, Craig-Bampton, interface reduction: the mode that comes back solves the sector's equations."""
    cyclic = cyclic_sector(sector, 8)
    wave = travelling_wave(cyclic, k)
    first = craig_bampton(wave, np.concatenate([wave.dof_set("tip"), wave.dof_set("cyclic_low")]), 40)
    second = reduce_interface(first, first.dof_set("cyclic_low"), 36)
    values, vectors = scipy.linalg.eigh(second.stiffness, second.mass)
    shape = wheel_shape(cyclic, k, vectors[:, 0], structure=second)
    assert shape.shape == (8, sector.n)
    exact = scipy.linalg.eigvalsh(wave.stiffness.toarray(), wave.mass.toarray())[0]
    assert 0 < values[0] / exact - 1 < 1e-4
    own = shape[0]
    energy = (own.conj() @ sector.stiffness @ own).real
    assert energy == pytest.approx(values[0] * (own.conj() @ sector.mass @ own).real, rel=1e-9)
    # the high face follows the low one
    np.testing.assert_allclose(shape[0, cyclic.high], shape[1, cyclic.low], atol=1e-12)


def test_free_interface_keeps_its_rigid_motions():
    free = assemble_solid(wedge(8, clamp=False), Material())
    nodes = np.concatenate([free.dof_set("cyclic_low"), free.dof_set("tip")])
    once = craig_bampton(free, nodes, 10)
    small = reduce_interface(once, np.arange(nodes.size), 12)
    squares = scipy.linalg.eigvalsh(small.stiffness, small.mass)
    assert np.all(np.abs(squares[:6]) < 1e-7 * squares[6])
    line = np.arange(nodes.size - 9, nodes.size)  # the rim holds all but the turn about itself
    with pytest.raises(SingularError, match="reduce_interface: with the other dofs fixed: one body"):
        reduce_interface(once, np.setdiff1d(np.arange(nodes.size), line), 12)


def test_it_takes_what_rubin_left(sector):
    names = ("tip", "cyclic_low")
    keep = np.concatenate([sector.dof_set(name) for name in names])
    first = rubin(sector, keep, 12)
    exact = natural_frequencies(sector, 4)
    small = reduce_interface(first, first.dof_set("cyclic_low"), 20)
    np.testing.assert_allclose(natural_frequencies(small, 4), exact, rtol=1e-6)


def test_wrong_choices_are_refused(once):
    with pytest.raises(InputError, match=r"interface: coordinate \d+ is modal"):
        reduce_interface(once, once.dof_set("modes")[:2], 1)
    with pytest.raises(InputError, match="n_modes: got 5 for 4 interface dofs"):
        reduce_interface(once, np.arange(4), 5)
    with pytest.raises(InputError, match=r"reduce_interface: keep: dof 0 .*more than once"):
        reduce_interface(once, np.array([0, 0]), 1)
