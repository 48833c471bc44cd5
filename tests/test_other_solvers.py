"""Other solvers' curves: the rows kept in ``tests/data`` always, the complete curves where they lie beside the repository."""

import numpy as np
import pytest

from evidence.validation import case_ansys_vm, case_chain_small, case_nlvib, case_tmdsimpy
from evidence.validation.reference_data import COMPLETE, contact2d, has_complete, nlvib


@pytest.fixture
def complete_curves() -> None:
    if not has_complete():
        pytest.skip(f"the complete curves of other solvers are not at {COMPLETE}; the rows in tests/data are tested")


@pytest.mark.parametrize("name", case_nlvib.NAMES)
def test_residual_vanishes_at_rows_of_nlvib(name):
    case = nlvib(name, complete=False)
    assert len(case.omega) >= 8
    assert max(case_nlvib.residuals(case)) < 1e-9  # of the force; both programs sum the same samples
    wrong = case.rows + 1e-6 * np.max(np.abs(case.rows))
    moved = case.balance.linearise(wrong[0] / case.balance.displacement_scale, float(case.omega[0]))
    assert np.max(np.abs(moved.residual)) > 1e-9  # so the bound can fail


@pytest.mark.parametrize("name", case_nlvib.NAMES)
def test_newton_returns_to_rows_of_nlvib(name):
    assert max(case_nlvib.returns(nlvib(name, complete=False))) < 1e-7


def test_rows_of_tmdsimpy():
    rows = contact2d(complete=False)
    assert len(rows) >= 13
    assert np.max(case_tmdsimpy.differences(rows)) <= case_tmdsimpy.TOLERANCE


def test_duffing_oscillator_has_several_motions_at_one_frequency():
    case = nlvib("a_duffing", complete=False)
    # the curve folds back, so that what is compared is more than one branch
    turns = np.diff(np.sign(np.diff(case.omega)))
    assert np.count_nonzero(turns) == 2


def test_peaks_of_a_verification_manual():
    records = case_ansys_vm.run()
    assert len(records) == 14
    assert [record["quantity"] for record in records if not record["holds"]] == []


def test_peak_of_the_small_chain_under_partial_slip():
    omega, _, converged = case_chain_small.curve(12.0)
    assert omega == pytest.approx(8.36, abs=0.005)
    assert converged == 1.0


@pytest.mark.validation
@pytest.mark.parametrize("name", case_nlvib.NAMES)
def test_all_rows_of_nlvib(name, complete_curves):
    case = nlvib(name, complete=True)
    assert max(case_nlvib.residuals(case)) < 1e-9
    assert max(case_nlvib.returns(case)) < 1e-7


@pytest.mark.validation
def test_all_rows_of_tmdsimpy(complete_curves):
    assert np.max(case_tmdsimpy.differences(contact2d(complete=True))) <= case_tmdsimpy.TOLERANCE
