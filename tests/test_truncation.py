"""How many modes: by a frequency, by an estimated error, and how good the estimate is."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from cyclic_models import random_sector, wedge
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.errors import InputError
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.matrices import chain
from stickslip.model.modes import natural_frequencies
from stickslip.model.structure import join, modal_dofs
from stickslip.reduction.basis import in_coordinates
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.truncation import FrequencyError, FrequencyErrors, ModesBelow, enough_modes, frequency_errors


@pytest.fixture(scope="module")
def solid():
    """A clamped wedge of a ring and the dofs of its rim."""
    structure = assemble_solid(wedge(8, cells=(3, 2, 1)), Material())
    return structure, structure.dof_set("tip")


def fixed_frequencies(structure, keep):
    inner = np.setdiff1d(np.arange(structure.n), keep)
    K, M = (m.toarray()[np.ix_(inner, inner)] for m in (structure.stiffness, structure.mass))
    return np.sqrt(scipy.linalg.eigvalsh(K, M)) / (2 * np.pi)


def test_modes_below_a_frequency_are_all_of_them(solid):
    structure, keep = solid
    exact = fixed_frequencies(structure, keep)
    for limit in (0.3 * exact[0], 0.5 * (exact[6] + exact[7]), 0.5 * (exact[40] + exact[41])):
        reduced = craig_bampton(structure, keep, ModesBelow(limit / 1.5))
        assert len(reduced.dof_set("modes")) == np.count_nonzero(exact < limit)
        same = craig_bampton(structure, keep, ModesBelow(limit, factor=1.0))
        assert same.n == reduced.n


def test_equal_bodies_keep_equal_numbers():
    twins = join(a=chain(30, 1.0, 1e4), b=chain(30, 1.0, 1e4))
    reduced = craig_bampton(twins, np.array([29, 59]), ModesBelow(8.0))
    assert len(reduced.dof_set("modes")) % 2 == 0


def test_error_that_was_asked_for_is_met(solid):
    """The true errors, by a dense solver, are below what was asked, and not by far."""
    structure, keep = solid
    band = 6000.0
    exact = natural_frequencies(structure, 40)
    exact = exact[exact < band]
    sizes = []
    for error in (1e-2, 1e-3, 1e-4):
        reduced = craig_bampton(structure, keep, FrequencyError(error, up_to_hz=band))
        found = natural_frequencies(reduced, len(exact))
        true = found / exact - 1
        assert np.all(true > -1e-9)
        assert true.max() < 1.05 * error
        sizes.append(reduced.n)
    assert sizes[0] < sizes[1] < sizes[2] < structure.n / 2


def test_estimate_tends_to_the_true_error(solid):
    """Effectivity: one to first order, so nearer to it the smaller the error."""
    structure, keep = solid
    exact = natural_frequencies(structure, 8)
    for count, tolerance in ((12, 2e-2), (20, 2e-3), (60, 1e-3)):
        reduced = craig_bampton(structure, keep, count)
        errors = frequency_errors(structure, reduced, 1.02 * exact[-1])
        true = errors.frequencies_hz[:6] / exact[:6] - 1
        np.testing.assert_allclose(errors.relative[:6] / true, 1.0, atol=tolerance)


@settings(max_examples=15)
@given(seed=st.integers(0, 500), k=st.integers(0, 4), count=st.integers(8, 20))
def test_estimate_holds_at_a_wave_number_too(seed, k, count):
    sector = cyclic_sector(random_sector(5, seed, inner=8), 5)
    structure = travelling_wave(sector, k)
    keep = structure.dof_set("inner")[:4]
    reduced = craig_bampton(structure, keep, count)
    exact = scipy.linalg.eigvalsh(structure.stiffness.toarray(), structure.mass.toarray())
    exact = np.sqrt(np.maximum(exact, 0)) / (2 * np.pi)
    cutoff = fixed_frequencies(structure, keep)[count]
    errors = frequency_errors(structure, reduced, 0.7 * cutoff)
    true = errors.frequencies_hz / exact[: errors.frequencies_hz.size] - 1
    small = (errors.relative < 1e-3) & (true > 1e-9)
    np.testing.assert_allclose(errors.relative[small], true[small], rtol=0.1)


def test_rigid_motions_have_no_error():
    free = assemble_solid(wedge(8, clamp=False), Material())
    keep = free.dof_set("cyclic_low")[:30]
    errors = frequency_errors(free, craig_bampton(free, keep, 5), 1e4)
    assert np.count_nonzero(errors.frequencies_hz == 0) == 6
    assert np.all(errors.relative[:6] == 0)
    assert np.all(errors.relative[6:] > 0)


def test_all_modes_leave_no_error():
    full = chain(12, mass=1.0, stiffness=1e4)
    errors = frequency_errors(full, craig_bampton(full, np.array([11]), 11), 1e3)
    assert errors.frequencies_hz.size == 12
    assert errors.worst < 1e-12


def test_error_of_a_chain_of_reductions(solid):
    """Estimated against the first model and against the one between, with the basis found back."""
    structure, keep = solid
    once = craig_bampton(structure, keep, 40)
    twice = craig_bampton(once, np.arange(6), 12)
    whole = frequency_errors(structure, twice, 3000.0)
    between = frequency_errors(once, twice, 3000.0)
    exact = natural_frequencies(once, whole.frequencies_hz.size)
    true = between.frequencies_hz / exact - 1
    np.testing.assert_allclose(between.relative[:3], true[:3], rtol=0.2)
    assert np.all(whole.relative > between.relative)


def test_wrong_questions_are_refused(solid):
    structure, keep = solid
    reduced = craig_bampton(structure, keep, 3)
    with pytest.raises(InputError, match="nothing was reduced"):
        frequency_errors(structure, structure, 1.0)
    with pytest.raises(InputError, match="leads back to 12 dofs, the structure has"):
        frequency_errors(structure, craig_bampton(chain(12, 1.0, 1.0), np.array([3]), 2), 1.0)
    other = craig_bampton(structure, keep, 5)
    with pytest.raises(InputError, match="are no combinations of those of the other"):
        frequency_errors(reduced, craig_bampton(other, np.array([0]), 3), 1.0)
    with pytest.raises(InputError, match=r"ModesBelow.factor: must be positive, got 0"):
        ModesBelow(100.0, factor=0.0)
    with pytest.raises(InputError, match=r"FrequencyError.error: must be positive, got nan"):
        FrequencyError(float("nan"), 100.0)


def test_estimate_for_a_free_body(solid):
    """The shift that makes a free body's stiffness regular leaves the estimate alone."""
    free = assemble_solid(wedge(8, cells=(3, 2, 1), clamp=False), Material())
    keep = free.dof_set("tip")[:6]
    keep = np.concatenate([keep, free.dof_set("cyclic_low")[:6]])
    exact = natural_frequencies(free, 14)
    reduced = craig_bampton(free, keep, 25)
    errors = frequency_errors(free, reduced, 1.001 * exact[-1])
    true = errors.frequencies_hz[6:14] / exact[6:] - 1
    assert true.max() > 1e-4
    np.testing.assert_allclose(errors.relative[6:14], true, rtol=3e-2)


def test_an_error_beyond_reach_is_said_early():
    """Few kept dofs and a small error: it went on through 405 modes, each time with an eigensolution of its own."""
    structure = assemble_solid(wedge(8, cells=(5, 3, 2)), Material())
    told = []
    with pytest.raises(InputError, match=r"1e-06 up to 8000 Hz is not met with 200 modes: .*Keep"):
        craig_bampton(structure, structure.dof_set("tip")[:9], FrequencyError(1e-6, 8000.0, most=200), say=told.append)
    steps = [int(line.split()[0]) for line in told if "asked for" in line]
    assert len(steps) > 2
    assert steps[-1] < 120
    assert "modes will be needed" in told[-1]


@pytest.mark.parametrize("rate", [1.5, 3.0])
@pytest.mark.parametrize("most", [50, 400, 10000])
def test_number_of_modes_is_forecast_from_the_rate(rate, most):
    """Errors that fall by a power law: met, or refused with the number that it gives, within a factor of two."""
    tried = []

    def errors(count):
        tried.append(count)
        return FrequencyErrors(np.ones(1), np.array([float(count) ** -rate]))

    error = 1e-5
    needed = error ** (-1 / rate)
    choice = FrequencyError(error, 1.0, most=most)
    if needed <= most:
        assert needed <= enough_modes(choice, 4, 10**6, errors, print) < 1.5 * needed
    else:
        with pytest.raises(InputError, match=f"about {float(f'{needed:.2g}'):.0f} modes would be"):
            enough_modes(choice, 4, 10**6, errors, print)
        assert max(tried) <= most
        if needed > 2 * most:
            assert len(tried) < 6


def test_all_modes_there_are_may_be_taken():
    """Beyond them is nothing to forecast."""
    full = chain(12, mass=1.0, stiffness=1e4)
    assert craig_bampton(full, np.array([11]), FrequencyError(1e-13, 1e3)).n == 12


@pytest.mark.parametrize("form", [np.asarray, scipy.sparse.csr_array])
def test_a_frequency_that_is_missing_is_told(form):
    """Of two bodies only one moves the kept dof: no residual shows the other, 0.3 % above, whose mode is left out."""
    one, other = chain(30, 1.0, 1e4), chain(30, 1.0, 1.006e4)
    twins = join(a=one, b=other)
    twins = replace(twins, **{name: form(getattr(twins, name)) for name in ("mass", "damping", "stiffness")})
    exact = natural_frequencies(twins, 4)
    squares = scipy.linalg.eigh(one.stiffness, one.mass)
    basis = np.zeros((60, 3))
    basis[:30] = squares[1][:, :3]
    small = in_coordinates(twins, basis, modal_dofs(3), {})
    errors = frequency_errors(twins, small, 1.001 * exact[3])
    assert np.max(errors.relative) < 1e-12  # the two that are there are exact, and yet
    assert exact[1] / exact[0] - 1 == pytest.approx(3e-3, rel=1e-2)
    assert errors.missing == 2
    assert errors.worst == math.inf
    below = frequency_errors(twins, small, 0.5 * (exact[0] + exact[1]))
    assert below.missing == 0
    assert below.worst < 1e-12


def test_modes_are_added_until_none_is_missing(solid):
    """With nothing kept of one of two bodies: every frequency below the limit is there in the end."""
    structure, keep = solid
    twins = join(a=structure, b=structure)
    exact = natural_frequencies(twins, 20)
    limit = 0.5 * (exact[11] + exact[12])
    reduced = craig_bampton(twins, keep[:3], FrequencyError(1e-2, limit))
    errors = frequency_errors(twins, reduced, limit)
    assert errors.missing == 0
    np.testing.assert_allclose(natural_frequencies(reduced, 12), exact[:12], rtol=1.05e-2)
