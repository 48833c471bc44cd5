"""Measured peaks: read and judged before anything is computed, kept in the result, drawn with error bars."""

import re
from pathlib import Path

import numpy as np
import pytest
from small_v2 import EXAMPLES
from synthetic_result import synthetic_result
from typer.testing import CliRunner

import stickslip as ss
from stickslip.analyses.forced_response.page.optimisation import optimisation
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.dataset import with_measured
from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.study.file.study import read_file
from stickslip.study.models.measured import measured_peaks

pytestmark = pytest.mark.usefixtures("peak_alone")

KEY = "load.shaker.force_n"
FILE = f"""# rig 3
{KEY},peak_amplitude_um,peak_amplitude_std_um,peak_frequency_hz,peak_frequency_half_width_hz,note
1,240,20,13.8,0.1,first
2,300,30,13.2,0.1,
3,400,,12.9,,worn
5,1300,100,,,
"""


QUICK = '[8.0, 16.0]\nfrequencies = 9\npeak_points = 0\nstability = "off"'
TABLE = '[measured]\nfile = "peaks.csv"\nsource = "rig 3 & co"\n'


def write(folder: Path, text: str, change: tuple[str, str] = ("", ""), table: str = TABLE) -> Path:
    """Write the smallest study with measured peaks; `change` replaces a part of it."""
    study = (EXAMPLES / "four_masses" / "study.toml").read_text()
    study = study.replace("[8.0, 16.0]", QUICK) + "\n" + table
    assert change[0] in study
    path = folder / "study.toml"
    path.write_text(study.replace(*change) if change[0] else study)
    (folder / "peaks.csv").write_text(text)
    return path


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ss.Result]:
    quick = '[harmonics]\nhigh = 1\nselection = "always_low"\n'
    path = write(tmp_path_factory.mktemp("measured"), FILE, table=quick + TABLE)
    return path, ss.Study.from_file(path).run()


def traces(result: ss.Result, panel: str) -> list:
    figure = result.plot("optimisation")
    return [t for t in figure.data if t.legendgroup and t.xaxis == panel]


def test_points_are_drawn_with_their_bars(run: tuple[Path, ss.Result]) -> None:
    (left, bare), (right, other) = (traces(run[1], panel) for panel in ("x", "x2"))
    # the page divides by the force: 240 µm at 1 N, 300 µm at 2 N, which was not computed
    assert list(left.x) == [1, 2, 5]
    np.testing.assert_allclose(left.y, [240, 150, 260])
    np.testing.assert_allclose(left.error_y.array, [20, 15, 20])
    np.testing.assert_allclose([*bare.x, *bare.y], [3, 400 / 3])
    assert list(right.x) == [1, 2]
    np.testing.assert_allclose(right.error_y.array, [0.1, 0.1])
    np.testing.assert_allclose([*other.x, *other.y], [3, 12.9])
    assert bare.error_y.array is None
    assert other.error_y.array is None
    assert [t.name for t in (left, bare, right, other) if t.showlegend] == ["measured"]


def test_the_caption_tells_source_bars_and_agreement(run: tuple[Path, ss.Result]) -> None:
    _, result = run
    page = result.report().read_text()
    said = re.search(r"Measured: 4 points.*?</figcaption>", page)[0]
    assert "from rig 3 &amp; co (<code>peaks.csv</code>)" in said
    assert "bars: standard deviation of amplitudes and half-width of frequencies" in said
    computed = result.peaks
    off = np.abs(1e6 * computed["amplitude (m)"] - [240, 400, 1300])
    inside = int((off[[0, 2]] <= [40, 200]).sum())
    assert f"({inside} of 2 within two standard deviations)" in said
    close = int(abs(computed["frequency (Hz)"][0] - 13.8) <= 0.1)
    assert f"({close} of 1 within the half-width)" in said


def test_the_result_keeps_them_with_their_source(run: tuple[Path, ss.Result]) -> None:
    path, result = run
    data = ss.Result.from_file(path.parent / "results")["forced_response"]
    assert data.attrs["measured_source"] == "rig 3 & co"
    assert data.attrs["measured_file"] == "peaks.csv"
    assert data.attrs["measured_key"] == KEY
    np.testing.assert_allclose(data["measured_amplitude"], [240e-6, 300e-6, 400e-6, 1300e-6])
    assert data["measured_amplitude"].attrs["units"] == "m"
    assert "standard deviation" in data["measured_amplitude_error"].attrs["long_name"]
    table = result.measured
    assert list(table) == [
        KEY,
        "excitation (N)",
        "frequency (Hz)",
        "its half-width (Hz)",
        "amplitude (m)",
        "its standard deviation (m)",
    ]
    np.testing.assert_allclose(table["frequency (Hz)"], [13.8, 13.2, 12.9, np.nan])
    assert len(ss.Result(result.data).measured) == 4


def test_other_points_cost_no_other_computation(run: tuple[Path, ss.Result], caplog) -> None:
    path, before = run
    (path.parent / "peaks.csv").write_text(f"{KEY},peak_frequency_hz\n4,12\n")
    again = ss.Study.from_file(path).run()
    (path.parent / "peaks.csv").write_text(FILE)
    assert "jobs to do: 0" in (path.parent / "results" / "run.log").read_text()
    assert list(again.measured[KEY]) == [4]
    np.testing.assert_array_equal(again["forced_response"].amplitude, before["forced_response"].amplitude)
    assert [t.xaxis for t in again.plot("optimisation").data if t.name == "measured"] == ["x2"]


def test_a_result_without_measurements_has_none() -> None:
    data = synthetic_result(ratios=(20, 5, 2), n=24)
    assert all(t.name != "measured" for t in optimisation(Response(data)).figure.data)


def test_check_tells_them(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["check", str(write(tmp_path, FILE))])
    assert done.exit_code == 0
    assert f"measured: 4 points of peaks.csv over {KEY}, rig 3 & co" in done.output


def test_forces_of_values_between_the_cases_are_those_of_the_study(tmp_path: Path) -> None:
    pull = '[load.pull]\non = "chain.m1"\nforce_n = 30.0\nharmonic = 0\n'
    path = write(tmp_path, "load.shaker.ratio,peak_amplitude_mm\n4,1\n3,1\n", table=pull + TABLE)
    text = path.read_text().replace("force_n = 5.0", 'ratio_of = "load.pull"\nratio = 4.0')
    path.write_text(text.replace(f"{KEY} = [1.0, 3.0, 5.0]", "load.shaker.ratio = [4.0, 2.0]"))
    found = measured_peaks(read_file(path))
    np.testing.assert_allclose(found.excitation, [7.5, 10.0])


def test_a_force_that_depends_on_more_than_the_file_tells_is_refused(tmp_path: Path) -> None:
    more = f'[[vary]]\nload.second.force_n = [1.0, 9.0]\n[load.second]\non = "chain.m2"\nforce_n = 1.0\n{TABLE}'
    path = write(tmp_path, f"{KEY},peak_amplitude_mm\n3,1\n", ("\n[vary]", "\n[[vary]]"), more)
    with pytest.raises(
        InputError,
        match=r"line 2: the force depends on load.second.force_n, which the file does not tell. Add a column",
    ):
        measured_peaks(read_file(path))
    (tmp_path / "peaks.csv").write_text(f"{KEY},load.second.force_n,peak_amplitude_mm\n3,1,1\n3,9,1\n")
    np.testing.assert_allclose(measured_peaks(read_file(path)).excitation, [3.0, 9.0])


def test_points_of_other_varied_keys_go_to_their_curves(tmp_path: Path) -> None:
    other = "contact.brake.slip_limit_n"
    text = f"{KEY},{other},peak_amplitude_um\n1,2,250\n1,4,90\n3,2,400\n"
    more = f"[[vary]]\n{other} = [2.0, 4.0]\n{TABLE}"
    path = write(tmp_path, text, ("\n[vary]", "\n[[vary]]"), more)
    found = measured_peaks(read_file(path))
    assert found.others == (f"{other} = 2", f"{other} = 4", f"{other} = 2")
    data = synthetic_result(ratios=(20, 10, 5, 3.5))
    values = np.array([[f, s] for f in (1.0, 3.0) for s in (2.0, 4.0)])
    labels = [f"{KEY} = {f:g}, {other} = {s:g}" for f, s in values]
    data = data.drop_vars(["vary", "vary_value"]).assign(
        vary_value=(("case", "vary"), values), case_label=("case", labels)
    )
    drawn = optimisation(Response(with_measured(data.assign_coords(vary=[KEY, other]), found)))
    names = [t.name for t in drawn.figure.data if t.name.startswith("measured")]
    assert names == [f"measured, {other} = 2", f"measured, {other} = 4"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            f"{KEY},peak_amplitude_um\n1,x\n",
            "peaks.csv: line 2: peak_amplitude_um: is no finite number, got 'x'. Leave the cell empty",
        ),
        (f"{KEY},peak_amplitude_um\n\n1,-3\n", "peaks.csv: line 3: peak_amplitude_um: must be above zero, got '-3'"),
        (
            f"{KEY},peak_amplitude_um,peak_amplitude_std_um\n1,3,-1\n",
            "line 2: peak_amplitude_std_um: must not be negative, got '-1'",
        ),
        (
            f"{KEY},peak_amplitude_um,peak_amplitud_std_um\n1,3,1\n",
            "line 1: has a column 'peak_amplitud_std_um'.*Did you mean 'peak_amplitude_std_um'",
        ),
        (
            f"{KEY},peak_amplitude_um,run\n1,3,1\n",
            f"line 1: has a column 'run', which is not known. The columns are {KEY}, peak_amplitude_um",
        ),
        (
            "load.shaker.forc_n,peak_amplitude_um\n1,3\n",
            f"line 1: has no column {KEY}. Did you mean 'load.shaker.forc_n'",
        ),
        (f"{KEY},note\n1,3\n", "has neither peak amplitudes nor frequencies. Add a column such as peak_amplitude_um"),
        (f"{KEY},peak_amplitude_um,peak_frequency_hz\n1,,\n", "line 2: has neither amplitude nor frequency"),
        (f"{KEY},peak_amplitude_um,peak_amplitude_mm\n1,1,1\n", "has both peak_amplitude_mm and peak_amplitude_um"),
        (
            f"{KEY},peak_amplitude_um,peak_amplitude_um_per_n\n1,1,1\n",
            "has both peak_amplitude_um and peak_amplitude_um_per_n",
        ),
        (
            f"{KEY},peak_amplitude_um,peak_amplitude_std_um_per_n\n1,1,1\n",
            "peak_amplitude_std is in m/N, peak_amplitude in m",
        ),
        (
            f"{KEY},peak_amplitude_um,peak_amplitude_std_um,peak_amplitude_half_width_um\n1,1,1,1\n",
            "has both peak_amplitude_std and peak_amplitude_half_width",
        ),
        (f"{KEY},peak_amplitude_um,excitation_n\n1,1,0\n", "line 2: excitation_n: must be above zero, got '0'"),
        (f"{KEY},peak_amplitude_um\n1,1,1\n", "line 2: has 3 cells, the first line 2"),
        (f"{KEY},peak_amplitude_um\n", "holds no numbers"),
    ],
)
def test_a_file_is_refused_with_line_column_and_value_before_anything_is_computed(
    tmp_path: Path, text: str, message: str
) -> None:
    path = write(tmp_path, text)
    done = CliRunner().invoke(app, ["run", str(path)])
    assert done.exit_code == 2
    assert re.search(message, done.stderr), done.stderr
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("peaks.csv", "peak.csv", r"study.toml: measured.file: there is no file .*peak.csv. Check the name"),
        ("file =", "fil =", r"measured.fil: unknown key 'fil'. Did you mean 'file'"),
        (f"{KEY} = [1.0, 3.0, 5.0]", "", "measured: has nothing to be drawn over: .vary. varies no number"),
        (f"[forced_response]\nfrequency_hz = {QUICK}", "[modes]", "has peaks, and the study computes none"),
        (
            f"{KEY} = [1.0, 3.0, 5.0]",
            f'{KEY} = [1.0, 3.0]\nmeasured.source = ["a", "b"]',
            "measured: is varied. Leave it out",
        ),
    ],
)
def test_a_table_without_what_it_needs_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = write(tmp_path, FILE, (old, new))
    with pytest.raises(InputError, match=message):
        ss.Study.from_file(path)
