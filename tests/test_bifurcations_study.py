"""Bifurcations through a study: dataset, verdicts, terminal and page of the example of an impacting mass."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.response.forced.response import forced_response
from stickslip.study.analyses.forced import bifurcating
from stickslip.study.analyses.forced.bifurcating import located
from stickslip.study.analyses.forced.points import collect
from stickslip.study.analyses.forced_response import FORCED_RESPONSE
from stickslip.study.models.study import read_study

EXAMPLE = Path(__file__).parents[1] / "examples" / "impacting_mass" / "study.toml"


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """Return what the terminal said, the dataset and the page of the example."""
    folder = tmp_path_factory.mktemp("impacting")
    shutil.copy(EXAMPLE, folder)
    found = CliRunner().invoke(app, ["run", str(folder / EXAMPLE.name)])
    results = folder / "results"
    with xr.open_dataset(results / "result.nc", group="forced_response") as data:
        return found.output, data.load(), (results / "report.html").read_text()


def test_the_dataset_holds_bifurcations_and_the_branches_that_leave(ran):
    _, data, _ = ran
    assert [str(k) for k in data["bifurcation_kind"].values] == ["period doubling"]
    hz = float(data["bifurcation_frequency_hz"].values[0])
    # of a unit mass the period doubles at 2.36096 times its frequency without the stop, by SciPy (tests/test_bifurcations.py)
    true = 2.36096 * 100 / (2 * np.pi)
    assert abs(hz - true) <= float(data["bifurcation_frequency_error_hz"].values[0]) < 0.01
    assert data["bifurcation_multiplier"].values[0] == pytest.approx([-1.0, 0.0], abs=1e-4)
    assert int(data["side_branch_periods"].values[0]) == 2
    sizes = data["side_point_subharmonic"].values
    assert sizes[-1] > 5 * sizes[0] > 0.0
    stable = data["motion_stability"].values
    above = data["frequency_hz"].values > hz
    assert np.all(stable[above] == 1)
    assert np.all(stable[~above] != 1)


def test_terminal_verdicts_and_page_name_them(ran):
    said, _, page = ran
    told = " ".join(said.split())
    assert "Period doubling at 37.57" in told
    assert "a machine does not stay there: multipliers lie outside the unit circle" in told
    assert "The branch that leaves there is drawn with the response." in told
    assert "Located on the branch: 1 period doubling. Dotted: 1 that leaves there." in page
    assert "<h3>Bifurcations</h3>" in page


def test_a_word_that_is_none_is_refused(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(EXAMPLE.read_text().replace('"branches"', '"every"'))
    with pytest.raises(InputError, match="bifurcations"):
        read_study(study)


def test_check_names_the_cost(tmp_path):
    shutil.copy(EXAMPLE, tmp_path)
    said = CliRunner().invoke(app, ["check", str(tmp_path / EXAMPLE.name)]).output
    assert "bifurcations: multipliers along the branch, of at most 300 motions" in " ".join(said.split())  # fmt: skip


class Kept(dict):
    """Notes without a file."""

    def put(self, name, values):
        self[name] = dict(values)


def test_an_interrupted_search_asks_for_no_multipliers_again(monkeypatch):
    (case,) = read_study(EXAMPLE).cases()
    asked = FORCED_RESPONSE.inputs(case, case.build())
    sweep = asked.sweep
    points = list(forced_response(asked.model.system, asked.model.load, sweep))
    response = collect(asked.problem, points, asked.model.peak_output)
    notes = Kept()
    first = located(asked, response, notes)

    def refused(problem, point):
        raise AssertionError

    monkeypatch.setattr(bifurcating, "stability", refused)
    again = located(asked, response, notes)
    assert [b.sentence for b in again.found] == [b.sentence for b in first.found]
    assert again.examined == first.examined > 20
