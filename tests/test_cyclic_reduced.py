"""Sectors and waves that are reduced: first reduced and then tied, first tied and then reduced, and the way back."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from cyclic_models import random_sector, wedge

from stickslip.errors import InputError
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.reduction.contact_coordinates import in_relative_coordinates
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.full_wheel import wheel, wheel_shape
from stickslip.reduction.truncation import frequency_errors

SECTORS = 8


def dense(matrix):
    return matrix.toarray() if scipy.sparse.issparse(matrix) else matrix


def squares(structure):
    return scipy.linalg.eigvalsh(dense(structure.stiffness), dense(structure.mass))


@pytest.fixture(scope="module")
def full():
    return assemble_solid(wedge(SECTORS, cells=(3, 2, 1)), Material())


@pytest.fixture(scope="module")
def once(full):
    """The sector reduced with free faces, which is done once for all wave numbers."""
    names = ("cyclic_low", "cyclic_high", "tip")
    return craig_bampton(full, np.concatenate([full.dof_set(n) for n in names]), 40)


def test_a_reduced_sector_is_tied_like_a_full_one(full, once):
    whole, small = cyclic_sector(full, SECTORS), cyclic_sector(once, SECTORS)
    for k in (0, 1, 4):
        wave, reduced = travelling_wave(whole, k), travelling_wave(small, k)
        exact, found = (np.sqrt(squares(s)[:4]) / (2 * np.pi) for s in (wave, reduced))
        errors = frequency_errors(wave, reduced, 1.001 * exact[-1])
        np.testing.assert_allclose(errors.relative, found / exact - 1, rtol=1e-2, atol=1e-10)
        assert errors.worst < 1e-4


def test_its_modes_lead_back_to_the_whole_wheel(full, once):
    whole, small = cyclic_sector(full, SECTORS), cyclic_sector(once, SECTORS)
    wave = travelling_wave(small, 3)
    values, vectors = scipy.linalg.eigh(wave.stiffness, wave.mass)
    shape = wheel_shape(small, 3, vectors[:, 0], dofs=full.dofs)
    assert shape.shape == (SECTORS, full.n)
    np.testing.assert_allclose(shape[2, whole.high], shape[3, whole.low], atol=1e-11)
    energy = shape[0].conj() @ full.stiffness @ shape[0]
    assert energy.real == pytest.approx(values[0], rel=1e-9)
    with pytest.raises(InputError, match="the full field has 270 coordinates, the table 157"):
        wheel_shape(small, 3, vectors[:, 0])
    with pytest.raises(InputError, match=r"vector: has shape \(3,\) for a structure"):
        wheel_shape(small, 3, np.zeros(3))


def test_the_wheel_of_reduced_sectors_has_the_union_and_the_way_back(full, once):
    small = cyclic_sector(once, SECTORS)
    assembled = wheel(small)
    union = np.sort(np.concatenate([squares(travelling_wave(small, k)) for k in range(SECTORS)]))
    values, vectors = scipy.linalg.eigh(dense(assembled.stiffness), dense(assembled.mass))
    np.testing.assert_allclose(values, union, rtol=1e-8)
    # each sector in its own axes: the energies of the sectors add up to that of the wheel
    fields = assembled.expand(vectors[:, 5]).reshape(SECTORS, full.n)
    energy = sum(u @ full.stiffness @ u for u in fields)
    assert energy == pytest.approx(values[5], rel=1e-8)


def test_wave_reduction_and_relative_coordinates_expand_to_the_sector(full):
    sector = cyclic_sector(full, SECTORS)
    wave = travelling_wave(sector, 2)
    first = craig_bampton(wave, wave.dof_set("tip"), 20)
    gap = np.zeros((3, first.n))
    tip = first.dof_set("tip").reshape(-1, 3)
    gap[np.arange(3), tip[0]] = 1.0
    gap[np.arange(3), tip[1]] = -1.0
    second, operator = in_relative_coordinates(first, gap)
    np.testing.assert_allclose(squares(second), squares(first), rtol=1e-9)
    state = np.random.default_rng(0).standard_normal((second.n, 2)) @ [1.0, 1.0j]
    field = second.expand(state)
    assert field.shape == (full.n,)
    nodes = full.dof_set("tip").reshape(-1, 3)
    np.testing.assert_allclose(field[nodes[0]] - field[nodes[1]], operator @ state, atol=1e-12)
    np.testing.assert_array_equal(wheel_shape(sector, 2, state, structure=second)[0], field)


def gyroscopic(structure):
    """Eigenvalues of ``λ² M + λ C + K``, sorted by imaginary part, then real part."""
    M, C, K = (dense(m) for m in (structure.mass, structure.damping, structure.stiffness))
    n = len(M)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    return np.sort_complex(np.round(-1j * np.linalg.eigvals(state), 9))


def test_a_mirrored_wheel_has_its_waves_the_other_way_round():
    """Mirror image in the plane through the axis: low and high change places, wave k is wave n_s − k.

    The random damping has a skew part, which parts forward from backward waves.
    """
    one = random_sector(5, 7, inner=3)
    mirror = np.tile([1.0, -1.0, 1.0], one.n // 3)
    turn = scipy.sparse.diags_array(mirror).tocsr()
    position = one.dofs.position * [1.0, -1.0, 1.0]
    sets = {**one.sets, "cyclic_low": one.sets["cyclic_high"], "cyclic_high": one.sets["cyclic_low"]}
    other = replace(
        one,
        mass=turn @ one.mass @ turn,
        damping=turn @ one.damping @ turn,
        stiffness=turn @ one.stiffness @ turn,
        dofs=replace(one.dofs, position=position),
        sets=sets,
    )
    image, original = cyclic_sector(other, 5), cyclic_sector(one, 5)
    differ = 0.0
    for k in (1, 2):
        found = gyroscopic(travelling_wave(image, k))
        expected = gyroscopic(travelling_wave(original, 5 - k))
        np.testing.assert_allclose(found, expected, atol=1e-7)
        differ = max(differ, np.abs(found - gyroscopic(travelling_wave(original, k))).max())
    assert differ > 1e-3
