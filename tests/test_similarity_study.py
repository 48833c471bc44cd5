"""``harmonics.similarity``: what a result stores of Jacobians with few and many harmonics, and how it is drawn."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from test_similarity import by_differences

import stickslip as ss
from stickslip.analyses.forced_response.analysis import FORCED_RESPONSE
from stickslip.analyses.page import plots, report_html
from stickslip.harmonic.selection.similarity import natural_scales
from stickslip.response.forced.compared_jacobians import reference_of
from stickslip.response.forced.sweep import Sweep
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study

pytestmark = pytest.mark.usefixtures("peak_alone")

EXAMPLE = Path(__file__).parents[1] / "examples" / "four_masses" / "study.toml"
LISTED = [11.0, 13.55, 13.9, 14.1]  # Hz; all stick at the first
RANGE = "frequency_hz = [8.0, 16.0]"
ON = "similarity = true"


def written(folder: Path, harmonics: str = "", vary: str = "") -> Path:
    """Write the four masses at 2 N and at listed frequencies, with three harmonics."""
    text = EXAMPLE.read_text().partition("[vary]")[0]
    listed = f'frequencies_hz = {LISTED}\npeak_points = 0\nstability = "off"'
    for old, new in ((RANGE, listed), ("force_n = 5.0", "force_n = 2.0")):
        assert old in text
        text = text.replace(old, new)
    high = "" if "high" in harmonics.replace("always_high", "") else "high = 3\n"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(f"{text}\n[harmonics]\n{high}{harmonics}\n{vary}")
    return path


def run(folder: Path, harmonics: str = "", vary: str = "") -> xr.DataTree:
    return run_study(read_study(written(folder, harmonics, vary))).tree


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> xr.DataTree:
    return run(tmp_path_factory.mktemp("on"), ON)


@pytest.fixture(scope="module")
def data(tree: xr.DataTree) -> xr.Dataset:
    return tree["forced_response"].to_dataset()


def test_change_and_gamma_are_those_of_differences_of_the_residual(tmp_path: Path, data: xr.Dataset) -> None:
    """Solutions of two runs without the key, one harmonic and three, give both Jacobians by differences of residuals."""
    motions = {}
    for name in ("always_low", "always_high"):
        own = run(tmp_path / name, f'selection = "{name}"')["forced_response"].to_dataset()
        motions[name] = own.retained_displacement.values[..., 0] + 1j * own.retained_displacement.values[..., 1]
    case = read_study(written(tmp_path / "model")).cases()[0]
    balance = FORCED_RESPONSE.inputs(case, case.build()).problem.balance((0, 1, 2, 3))
    scales = np.tile(natural_scales(balance), balance.n_rows)
    for i, hertz in enumerate(LISTED):
        omega = 2 * np.pi * hertz

        def jacobians(step: float, i: int = i, omega: float = omega) -> list[Any]:
            ends = (balance.unknowns(motions[n][i]) for n in ("always_low", "always_high"))
            return [scales[:, None] * by_differences(balance, x, omega, step) * scales for x in ends]

        def numbers(step: float) -> Any:
            few, many = jacobians(step)
            gamma = np.linalg.solve(few, many)
            return np.array([100 * np.linalg.norm(few - many) / np.linalg.norm(many), np.trace(gamma) / len(few)])

        fine, coarse = numbers(1e-6), numbers(2e-6)
        # differences through kinks are off by a share of the step; rounding of residuals, 1e-16 over a step of 1e-6, in addition
        off = 4 * np.abs(fine - coarse) + [100 * 1e-8, 1e-8]
        stored = [float(data[n].values[i]) for n in ("jacobian_change_percent", "gamma_mean_diagonal")]
        assert np.all(np.abs(stored - fine) <= off), (hertz, stored, fine, off)
        assert np.all(off < [0.05, 1e-3])  # worth something
    assert int(data.jacobian_rows[0]) == balance.size
    assert int(data.jacobian_reference[0]) == 3


def test_stuck_contacts_leave_the_jacobian_as_it_is_and_slip_changes_it(data: xr.Dataset) -> None:
    change, gamma, zero = (
        data[n].values for n in ("jacobian_change_percent", "gamma_mean_diagonal", "gamma_zero_percent")
    )
    assert change[0] == pytest.approx(0.0, abs=1e-9)
    assert gamma[0] == pytest.approx(1.0, abs=1e-9)
    assert zero[0] == 100.0
    assert change.max() > 0.1
    assert zero.min() < 100.0


def test_blocks_at_the_peak_and_those_neglected(data: xr.Dataset) -> None:
    norms, missing = data.jacobian_block_norm[0].values, data.neglected_block_norm[0].values
    assert norms.shape == missing.shape == (4, 4)
    assert np.all(np.diag(norms) > 0.1)
    assert np.all(missing[:2, :2] == 0.0)  # between the harmonics that are kept nothing is neglected
    assert np.all(np.diag(missing) == 0.0)
    assert missing[1, 3] > 0.01  # odd friction: the third harmonic acts on the first
    worst = int(np.nanargmax(data.jacobian_change_percent.values))
    assert float(data.neglected_frequency_hz[0]) == float(data.frequency_hz[worst])


def test_without_the_key_the_result_is_the_same_to_the_bit(tmp_path: Path, data: xr.Dataset) -> None:
    plain = run(tmp_path)["forced_response"].to_dataset()
    added = set(data.data_vars) - set(plain.data_vars)
    assert added == {
        "jacobian_reference",
        "jacobian_rows",
        "jacobian_change_percent",
        "jacobian_block_norm",
        "gamma_mean_diagonal",
        "gamma_zero_percent",
        "neglected_block_norm",
        "neglected_frequency_hz",
    }
    timed = [n for n in plain.data_vars if "seconds" in str(n)]
    xr.testing.assert_identical(data.drop_vars([*added, *timed]), plain.drop_vars(timed))


def test_the_page_draws_both_and_says_the_largest_change(tree: xr.DataTree, data: xr.Dataset) -> None:
    found = plots(tree)
    above, below = (found["jacobian_change"].data[k].y for k in (0, 1))
    np.testing.assert_array_equal(above, data.jacobian_change_percent.values)
    np.testing.assert_array_equal(below, data.gamma_mean_diagonal.values)
    one, other = found["jacobian_blocks"].data
    assert 10.0 ** one.z[1][1] == pytest.approx(float(data.jacobian_block_norm[0, 1, 1]))
    assert 10.0 ** other.z[1][3] == pytest.approx(float(data.neglected_block_norm[0, 1, 3]))
    assert np.isnan(other.z[0][0])
    html = report_html(tree)
    assert f"Largest ΔJ: {float(data.jacobian_change_percent.max()):.3g} %"[:16] in html
    assert "what H = 1 neglects" in html


def test_cases_with_different_harmonics_stand_beside_each_other_with_buttons(tmp_path: Path) -> None:
    tree = run(tmp_path, ON, "[vary]\nharmonics.high = [2, 3]")
    data = tree["forced_response"].to_dataset()
    assert data.jacobian_block_norm.shape == (2, 4, 4)
    assert np.isnan(data.jacobian_block_norm[0, 3]).all()
    assert [int(n) for n in data.jacobian_reference] == [2, 3]
    shown = plots(tree)["jacobian_blocks"]
    assert len(shown.data) == 4
    assert sum(trace.visible for trace in shown.data) == 2


def test_what_cannot_be_compared_is_refused_by_its_key(tmp_path: Path) -> None:
    def refused(path: Path) -> str:
        case = read_study(path).cases()[0]
        with pytest.raises(ss.InputError, match=r"harmonics\.similarity") as error:
            FORCED_RESPONSE.inputs(case, case.build())
        return str(error.value)

    assert 'low and high are both 3. Give high = "auto"' in refused(written(tmp_path / "same", f"low = 3\n{ON}"))
    path = written(tmp_path / "rigid", f'selection = "always_high"\n{ON}')
    stop = 'law = "unilateral_spring", normal_stiffness_n_per_m = 5e3, gap_m = 1e-3'
    assert stop in path.read_text()
    path.write_text(path.read_text().replace(stop, 'law = "rigid_coulomb", friction_coefficient = 0.1, gap_m = 1e-3'))
    assert "compares derivatives of contact forces, and contact.stop is rigid_coulomb" in refused(path)


def test_auto_compares_with_the_solution_of_most_harmonics_within_2000_rows() -> None:
    sweep = Sweep(omega_range=(1.0, 2.0))
    assert reference_of(sweep, 3)[-1] == 5
    assert reference_of(sweep, 3, solved=9)[-1] == 9
    assert reference_of(sweep, 100, solved=25)[-1] == 9  # 19 rows a coordinate; 15 harmonics would make 3100
    assert reference_of(Sweep(omega_range=(1.0, 2.0), low=3, high=7), 3)[-1] == 7
