"""Bifurcations through a study: dataset, verdicts, terminal and page of the example of an impacting mass."""

import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from stickslip.analyses.forced_response.analysis import FORCED_RESPONSE
from stickslip.analyses.forced_response.stability import bifurcating
from stickslip.analyses.forced_response.stability.bifurcating import limits, located
from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.response.forced.collected import collect
from stickslip.response.forced.response import forced_response
from stickslip.study.models.study import read_study
from stickslip.study.store.netcdf import read_tree

pytestmark = pytest.mark.usefixtures("peak_alone")

EXAMPLE = Path(__file__).parents[1] / "examples" / "impacting_mass" / "study.toml"


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """Return what the terminal said, the dataset and the page of the example."""
    folder = tmp_path_factory.mktemp("impacting")
    shutil.copy(EXAMPLE, folder)
    found = CliRunner().invoke(app, ["run", str(folder / EXAMPLE.name)])
    results = folder / "results"
    data = read_tree(results / "result.nc")["forced_response"].to_dataset()
    return found.output, data, (results / "report.html").read_text()


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
    assert "are unstable: a machine does not stay there" in told
    assert "The branch that leaves there is drawn with the response." in told
    assert "Located on the branch: 1 period doubling. Dotted: 1 that leaves there." in page
    assert "<h3>Bifurcations</h3>" in page


def test_a_word_that_is_none_is_refused(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(EXAMPLE.read_text().replace('"branches"', '"every"'))
    with pytest.raises(InputError, match="bifurcations"):
        read_study(study)


def test_false_is_taken_for_off(tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(EXAMPLE.read_text().replace('"branches"', "false"))
    with pytest.raises(InputError, match=r"got False\. Did you mean 'off'"):
        read_study(study)


def asked_of(path):
    """Return what the only case of a study asks for, and its response."""
    (case,) = read_study(path).cases()
    asked = FORCED_RESPONSE.inputs(case, case.build())
    points = list(forced_response(asked.model.system, asked.model.load, asked.sweep))
    return asked, collect(asked.problem, points, asked.model.peak_output)


@pytest.mark.validation
def test_structural_damping_is_located_by_hill(tmp_path, monkeypatch):
    quick = partial(bifurcating.bifurcations, tolerance=1e-4)
    monkeypatch.setattr(bifurcating, "bifurcations", quick)
    study, plain = tmp_path / "study.toml", EXAMPLE.read_text()
    damped = plain.replace('dashpots_n_s_per_m = [["ground", 1, 10.0]]', "")
    damped = damped.replace("[25.0, 42.0]\npoints = 20", "[36.0, 38.2]\npoints = 2")
    damped = damped.replace("= 15", "= 7")
    # the loss of the viscous one at half the frequency of the load, at which the doubled motion vibrates most
    study.write_text(damped.replace("[contact.stop]", "[damping]\nloss_factor = 0.1\n\n[contact.stop]"))
    asked, response = asked_of(study)
    found = located(asked, response, Kept())
    assert [b.kind for b in found.found] == ["period doubling"]
    assert found.found[0].omega / (2 * np.pi) == pytest.approx(37.57, abs=0.05)
    assert "they come from Hill's method" in " ".join(limits(asked, found))


def test_what_is_refused_is_told_and_not_taken_for_none(monkeypatch):
    asked, response = asked_of(EXAMPLE)

    def refused(problem, point):
        raise InputError("of this motion", "nothing is known", "Ask for another one.")

    monkeypatch.setattr(bifurcating, "stability", refused)
    found = located(asked, response, Kept())
    assert found.none_met == ("no fold was met on the branch",)
    assert any("nothing is known" in line for line in limits(asked, found))


def test_check_names_the_cost(tmp_path):
    shutil.copy(EXAMPLE, tmp_path)
    said = CliRunner().invoke(app, ["check", str(tmp_path / EXAMPLE.name)]).output
    assert "bifurcations: multipliers along the branch, of at most 300 motions" in " ".join(said.split())


class Kept(dict):
    """Notes without a file."""

    def put(self, name, values):
        self[name] = dict(values)

    def forget(self, name):
        self.pop(name, None)


def test_an_interrupted_search_asks_for_no_multipliers_again(monkeypatch):
    asked, response = asked_of(EXAMPLE)
    notes = Kept()
    first = located(asked, response, notes)

    def refused(problem, point):
        raise AssertionError

    monkeypatch.setattr(bifurcating, "stability", refused)
    again = located(asked, response, notes)
    assert [b.sentence for b in again.found] == [b.sentence for b in first.found]
    assert again.examined == first.examined > 20
