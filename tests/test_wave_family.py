"""Nested dissection, multifrontal factors that leave some rows, and what the waves of a sector share."""

import numpy as np
import pytest
import scipy.sparse

from evidence.models.wheel_sector import sector
from stickslip.model.fe.multifrontal import dissected, multifrontal
from stickslip.model.modes import normal_modes, with_springs
from stickslip.reduction import wave_family
from stickslip.reduction.cyclic import travelling_wave
from stickslip.reduction.wave_family import WaveFamily
from stickslip.reduction.waves import wave
from stickslip.response.rotating.safe import nodal_diameter_map

SECTORS = 7
RNG = np.random.default_rng(2)


@pytest.fixture(scope="module")
def seventh():
    return sector(SECTORS, 6, 5)


def test_every_row_is_eliminated_once_after_what_it_touches_is_known(seventh):
    matrix = seventh.structure.stiffness
    kept = np.concatenate([seventh.low, seventh.high])
    found = dissected(matrix, kept)
    np.testing.assert_array_equal(np.sort(found.order), np.arange(matrix.shape[0]))
    np.testing.assert_array_equal(found.order[-kept.size :], kept)
    assert len(found.fronts) > 3
    filled = abs(matrix)[found.order][:, found.order].toarray() > 0
    row = 0
    for front in found.fronts:
        assert front.first == row
        row = front.last
        rows = np.concatenate([np.arange(front.first, front.last), front.update])
        below = filled[front.last :, front.first : front.last].any(axis=1)
        assert set(front.last + np.flatnonzero(below)) <= set(front.update)
        filled[np.ix_(rows, rows)] = True
    assert row == matrix.shape[0] - kept.size
    assert found.peak >= found.entries > 0


@pytest.mark.parametrize("number", [0, 2])
def test_factors_leave_the_schur_complement_of_the_rows_kept(seventh, number):
    matrix = travelling_wave(seventh, number).stiffness
    n = matrix.shape[0]
    kept = RNG.permutation(n)[:40]
    found = multifrontal(matrix, kept)
    dense = matrix.toarray()
    inverse = np.linalg.inv(dense)[np.ix_(kept, kept)]
    np.testing.assert_allclose(found.rest @ inverse, np.eye(40), atol=1e-9)
    right = RNG.standard_normal((n, 3)) + 1j * RNG.standard_normal((n, 3))
    eliminated = found.forward(right)
    eliminated[-40:] = np.linalg.solve(found.rest, eliminated[-40:])
    solved = found.backward(eliminated)
    np.testing.assert_allclose(dense @ solved, right, atol=1e-9)


def test_fronts_are_complex_only_where_complex_entries_reach(seventh):
    matrix = travelling_wave(seventh, 2).stiffness
    found = multifrontal(matrix)
    kinds = np.array([np.iscomplexobj(factor) for factor in found.lower])
    assert 0 < kinds.sum() < kinds.size
    children = {child for front in found.dissection.fronts for child in front.children}
    for i, front in enumerate(found.dissection.fronts):
        reached = any(kinds[child] for child in front.children)
        own = matrix[found.dissection.order[front.first : front.last]].imag
        assert kinds[i] or not reached
        if not front.children:
            assert i in children
            assert kinds[i] == bool(abs(own).max() > 0)
    for right in (RNG.standard_normal(matrix.shape[0]), RNG.standard_normal((matrix.shape[0], 3)) * 1j):
        np.testing.assert_allclose(matrix @ found.solve(right), right, atol=1e-9)


@pytest.mark.parametrize("contacts", [False, True])
def test_waves_that_share_their_interior_have_the_same_modes(seventh, contacts, monkeypatch):
    """With springs to the neighbour, whose phase the waves have too."""
    monkeypatch.setattr(wave_family, "MIN_SHARED_DOFS", 100)
    structure = seventh.structure
    left, right = (scipy.sparse.eye_array(structure.n, format="csr")[structure.dof_set(s)] for s in ("left", "right"))
    springs = np.full(left.shape[0], 3e6)

    def at(number):
        found = travelling_wave(seventh, number)
        phase = wave(number, SECTORS).phase
        tie = found.basis
        return with_springs(found, (phase * left - right) @ tie, springs) if contacts else found

    family = WaveFamily(at, SECTORS, (0, 1, 3))
    for number in family.numbers:
        moving = at(number)
        shift, factors = family.shifted(number, moving)
        shared = factors(scipy.sparse.csr_array(moving.stiffness - shift * moving.mass))
        assert shared.backend == "shared interior"
        mine = normal_modes(moving, 6, shift=shift, factors=factors)
        alone = normal_modes(moving, 6)
        np.testing.assert_allclose(mine.frequencies_hz, alone.frequencies_hz, rtol=1e-9)
        left_over = moving.stiffness @ mine.shapes - (moving.mass @ mine.shapes) * mine.squares
        assert np.abs(left_over).max() < 1e-6 * np.abs(moving.stiffness @ mine.shapes).max()


def test_what_is_no_family_is_factorised_wave_by_wave(seventh, monkeypatch):
    monkeypatch.setattr(wave_family, "MIN_SHARED_DOFS", 100)
    moving = travelling_wave(seventh, 1)
    assert WaveFamily(lambda k: moving, SECTORS, (1,)).shifted(1, moving) == (None, None)
    assert WaveFamily(lambda k: moving, SECTORS, (1, 2)).shifted(1, moving) == (None, None)
    family = WaveFamily(lambda k: travelling_wave(seventh, k), SECTORS, (1, 2))
    shift, factors = family.shifted(1, moving)
    other = scipy.sparse.csr_array(moving.stiffness - shift * moving.mass)
    other[[3], [3]] *= 1.5
    assert factors(other).backend == "superlu"
    for few in (1, 2):
        whole = sector(few, 6, 5)
        two = WaveFamily(lambda k, whole=whole: travelling_wave(whole, k), few, (0, 1))
        assert two.shifted(0, travelling_wave(whole, 0)) == (None, None)


def test_the_map_of_nodal_diameters_takes_what_waves_share(seventh, monkeypatch):
    plain = nodal_diameter_map(seventh, 4)
    monkeypatch.setattr(wave_family, "MIN_SHARED_DOFS", 100)
    shared = nodal_diameter_map(seventh, 4)
    np.testing.assert_allclose(shared.frequencies_hz, plain.frequencies_hz, rtol=1e-9)
    assert np.any(shared.frequencies_hz != plain.frequencies_hz)
