"""What a Python user holds: studies, models and results; progress by the standard logging."""

import io
import logging
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
import xarray as xr
from rich.console import Console
from small_v2 import write_four_masses, write_two_blades
from synthetic_result import KEY, provenance, synthetic_result, tree_of
from synthetic_wheel import campbell_result, modes_result, safe_result

from stickslip.analyses.forced_response.summary import _millimetres
from stickslip.api.model import Model
from stickslip.api.printed import aligned
from stickslip.api.result import Result
from stickslip.api.screen import LOG, Screen, by_default, on_screen
from stickslip.api.study import Study
from stickslip.errors import InputError
from stickslip.model.slow_steps import step
from stickslip.study.coordinates import with_coordinates
from stickslip.study.file.keys import REQUIRED, table_keys
from stickslip.study.store.progress import advance, at_work, stage, sum_up

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def everything() -> Result:
    nodes = {"modes": modes_result(), "campbell": campbell_result(), "safe": safe_result(0.1)}
    return Result(tree_of(provenance(), forced_response=synthetic_result(ratios=(20, 5, 2), n=24), **nodes))


@pytest.fixture(scope="module")
def masses(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, Result]:
    """The smallest study, and its result."""
    study = Study.from_file(write_four_masses(tmp_path_factory.mktemp("masses")))
    return study, study.run()


def test_every_figure_of_the_page_can_be_had_by_name(everything: Result) -> None:
    assert everything.plots[0] == "response"
    assert {"optimisation", "loops_t", "energy", "diameters", "shapes", "campbell", "safe", "mesh"} <= set(
        everything.plots
    )
    assert all(isinstance(everything.plot(name), go.Figure) for name in everything.plots)
    with pytest.raises(InputError, match=r"plot\('respons'\): is no figure of this result\. Did you mean 'response'"):
        everything.plot("respons")


def test_peaks_are_a_table(everything: Result) -> None:
    peaks = everything.peaks
    assert list(peaks) == [KEY, "excitation (N)", "frequency (Hz)", "amplitude (m)"]
    data = everything.data["forced_response"]
    np.testing.assert_array_equal(peaks["frequency (Hz)"], data["peak_frequency_hz"].values)
    assert len(peaks) == 3
    assert peaks.loc[peaks[KEY] == 5, "amplitude (m)"].item() == data["peak_amplitude"].values[1]
    assert "<th>frequency (Hz)</th>" in everything._repr_html_()
    of_modes = Result(tree_of(modes=modes_result())).peaks
    assert of_modes["mode 1 (Hz)"][1] == pytest.approx(float(modes_result().frequency_hz[0, 1, 0]))


def test_a_saved_result_is_the_same_and_opens_with_xarray_alone(everything: Result, tmp_path: Path) -> None:
    again = Result.from_file(everything.save(tmp_path))
    assert again.path == tmp_path / "result.nc"
    nodes = {name: with_coordinates(everything[name], name) for name in everything}
    xr.testing.assert_identical(again.data, tree_of(provenance(), **nodes))
    assert Result.from_file(tmp_path).plots == everything.plots
    with xr.open_datatree(tmp_path / "result.nc", engine="h5netcdf") as tree:
        assert list(tree.children) == ["forced_response", "modes", "campbell", "safe"]
        assert tree["forced_response"]["frequency_hz"].attrs["units"] == "Hz"
    page = again.report()
    assert page == tmp_path / "report.html"
    assert "<h2>Natural frequencies and mode shapes</h2>" in page.read_text(encoding="utf-8")


def test_a_result_says_what_it_is(everything: Result) -> None:
    text = repr(everything)
    assert text.startswith("Result: Two blades, one damper <synthetic>\n  file: in memory")
    assert "forced_response: 3 cases, 81 points" in text
    assert "<synthetic>" not in everything._repr_html_()


def test_cases_of_waves_are_drawn_one_by_one() -> None:
    data = modes_result()
    two = xr.concat([data, data.assign(frequency_hz=2 * data["frequency_hz"])], "case")
    two["case_label"] = "case", ["part.blade.span = 1", "part.blade.span = 2"]
    two = two.assign(vary_value=(("case", "vary"), [[1.0], [2.0]])).assign_coords(vary=["part.blade.span"])
    result = Result(tree_of(modes=two))
    assert result.plots == ("diameters", "shapes", "diameters_1", "shapes_1")
    first, second = (result.plot(name).data[0].y for name in ("diameters", "diameters_1"))
    np.testing.assert_allclose(second, 2 * np.asarray(first))


def test_a_study_runs_and_goes_on_from_what_is_there(masses: tuple[Study, Result]) -> None:
    study, result = masses
    assert result.path == study.folder / "result.nc"
    assert result.data["forced_response"].sizes["point"] > 10
    again = study.run()
    xr.testing.assert_equal(again.data["forced_response"].to_dataset(), result.data["forced_response"].to_dataset())
    assert "first.x" in str(result.plot("response").layout) or result.plots[0] == "response"


def test_a_replaced_study_has_a_folder_of_its_own(masses: tuple[Study, Result]) -> None:
    study, result = masses
    soft = study.replace({"contact.brake.slip_limit_n": 1.0})
    assert soft.folder != study.folder
    assert soft.folder.parent == study.folder.parent
    found = soft.run()
    assert found.path == soft.folder / "result.nc"
    assert found.peaks["amplitude (m)"][0] != result.peaks["amplitude (m)"][0]
    assert "# contact.brake.slip_limit_n = 1.0" in found.data.attrs["study_toml"]
    assert study.content.tables.contact["brake"] is not soft.content.tables.contact["brake"]
    for key, said in (("contact.break.slip_limit_n", "contact.break"), ("contact.brake.slip_limit", "slip_limit")):
        with pytest.raises(InputError) as caught:
            study.replace({key: 1.0})
        assert said in str(caught.value)
    with pytest.raises(InputError, match=r"contact\.brake\.slip_limit_n"):
        study.replace({"contact.brake.slip_limit_n": -1.0})


def test_a_model_gives_the_numbers_of_its_study_without_files(masses: tuple[Study, Result], tmp_path: Path) -> None:
    study, result = masses
    model = study.model()
    assert isinstance(model, Model)
    assert "contact stop: chain.m4 with ground, UnilateralSpring" in repr(model)
    found = model.forced_response(hz=(8.0, 16.0), points=10, peak_points=2, stability="peak")
    assert found.path is None
    for name in ("frequency_hz", "amplitude", "contact_force"):
        there, here = (r.data["forced_response"][name].values for r in (result, found))
        np.testing.assert_array_equal(there, here)
    assert found.verdicts
    assert found.verdicts == result.verdicts
    kept = model.forced_response(hz=[9.0, 10.0, 11.0], peak_points=0, folder=tmp_path / "made")
    assert kept.path == tmp_path / "made" / "result.nc"
    with pytest.raises(
        InputError, match=r"forced_response: selektion: is no key of this question\. Did you mean 'selection'"
    ):
        model.forced_response(hz=(8, 20), selektion="always_high")
    with pytest.raises(InputError, match=r"forced_response: low: .*got 0"):
        model.forced_response(hz=(8, 20), low=0)
    modes = model.modes(number=2, contacts="stuck")
    known = found.data["forced_response"]["frequency_stuck_full_hz"].values[0, :2]
    np.testing.assert_allclose(modes.data["modes"]["frequency_hz"].values[0, 0], known, rtol=1e-9)


def in_fifteen_lines() -> float:
    """Run the example on a coarse mesh, in the working folder, and return the frequency of its peak, Hz."""
    text = (ROOT / "examples" / "two_blades_python.py").read_text(encoding="utf-8")
    code = [line for line in text.split('"""')[2].splitlines() if line.strip()]
    assert len(code) <= 15
    changes = {
        "ss.BladePair()": "ss.BladePair(airfoil_size=0.05, platform_size=0.02, foot_size=0.05)",
        "hz=(150, 187), high=5, peak_points=12": "hz=(185, 207), points=4, peak_points=2, samples=64, stability='off'",
        "newton=22.1": "newton=0.221",
    }
    for old, new in changes.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    names: dict[str, Any] = {}
    exec(compile(text, "two_blades_python.py", "exec"), names)  # our own example
    return float(names["result"].peaks["frequency (Hz)"][0])


def test_two_blades_in_fifteen_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert 185.0 < in_fifteen_lines() < 207.0  # within the range: a peak, no end of it
    assert (tmp_path / "two_blades.html").is_file()


@pytest.mark.validation
def test_a_study_of_two_blades_has_contacts_retention_and_mesh_of_the_fifteen_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    few = {"forced_response.points": "4", "forced_response.stability": '"off"'}
    study = Study.from_file(write_two_blades(tmp_path / "study", few))
    assert in_fifteen_lines() == pytest.approx(study.run().peaks["frequency (Hz)"][0], rel=1e-5)


@pytest.mark.parametrize(
    ("cells", "same"),
    [
        (["0.25035", "0.40891", "1.1868"], ["0.2504", "0.4089", "1.1868"]),
        (["13.954", "180.777"], ["13.954", "180.777"]),
        (["12", "7"], ["12", "7"]),
        (["123.45", "", "0.012"], ["123.450", "", "0.012"]),
        (["0.5", "-"], ["0.5", "-"]),
    ],
)
def test_numbers_of_a_column_have_the_same_decimals(cells: list[str], same: list[str]) -> None:
    assert aligned(cells) == same


def said(width: int = 200, **options: bool) -> tuple[Screen, io.StringIO]:
    stream = io.StringIO()
    return Screen(Console(file=stream, width=width), **options), stream


def test_the_screen_writes_lines_and_every_tenth_of_a_job() -> None:
    screen, stream = said(warnings=False, verbose=True)
    with on_screen(screen):
        LOG.info("reading")
        for step in range(101):
            LOG.info(f"step {step}", extra={"fraction": step / 100, "job": "modes"})
        LOG.warning("doubtful")
    lines = stream.getvalue().splitlines()
    assert lines[0] == "reading"
    assert len(lines) == 1 + 11
    assert lines[-1] == "  modes 100 %: step 100"
    assert LOG.handlers == []


def test_a_job_leaves_one_line_and_points_are_said_where_they_are_asked_for() -> None:
    for verbose, count in ((False, 2), (True, 5)):
        screen, stream = said(warnings=False, verbose=verbose)
        with on_screen(screen):
            LOG.info("reading")
            with at_work("response: a = 1"):
                advance(0.5, "point 3")
                sum_up("peak 2 mm", "a = 1: peak 2 mm, 3 Newton steps")
        lines = stream.getvalue().splitlines()
        assert len(lines) == count, lines
        assert lines[-1] == "response: a = 1: peak 2 mm (0 s)"


@pytest.mark.parametrize(
    ("wall", "cpu", "told"),
    [
        (400.0, 90.0, "(400 s, 90 s of CPU)"),  # the machine does other work
        (100.0, 95.0, "(100 s)"),
        (100.0, 0.5, "(100 s)"),  # another process computes
        (10.0, 2.0, "(10 s)"),
    ],
)
def test_a_job_on_a_busy_machine_says_its_cpu_time(
    wall: float, cpu: float, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = {"monotonic": 0.0, "process_time": 0.0}
    monkeypatch.setattr("stickslip.api.screen.monotonic", lambda: now["monotonic"])
    monkeypatch.setattr("stickslip.api.screen.process_time", lambda: now["process_time"])
    screen, stream = said(warnings=False)
    with on_screen(screen), at_work("modes"):
        now |= {"monotonic": wall, "process_time": cpu}
    assert stream.getvalue().splitlines()[-1] == f"modes: done {told}"


def test_a_silent_run_says_where_it_is_without_a_terminal() -> None:
    stream = io.StringIO()
    screen = Screen(Console(file=stream, width=200), quiet=0.05)

    def next_line() -> str:
        count, end = len(stream.getvalue().splitlines()), monotonic() + 10.0
        while len(stream.getvalue().splitlines()) == count and monotonic() < end:
            sleep(0.01)
        return stream.getvalue().splitlines()[-1]

    with on_screen(screen):
        with step("reducing part blade: 17082 dofs"):
            assert next_line() == "  reducing part blade: 17082 dofs, 0 s"
        with at_work("response: a = 1"):
            advance(0.5, "more harmonics, point 3: 169.62 Hz")
            assert next_line() == "  response: a = 1 50 %: more harmonics, point 3: 169.62 Hz, 0 s"
            stage("stability, point 2: 170.00 Hz")
            assert next_line() == "  response: a = 1 50 %: stability, point 2: 170.00 Hz, 0 s"
            advance(0.2, "audit")  # what is repeated does not lead back
            assert "a = 1 50 %: audit" in next_line()
        assert stream.getvalue().splitlines()[-1].startswith("response: a = 1: done")  # written as the job ends
        told = stream.getvalue()
        sleep(0.2)
        assert stream.getvalue() == told  # nothing is at work


def test_bars_say_the_stage() -> None:
    stream = io.StringIO()
    console = Console(file=stream, width=120, force_terminal=True)
    with on_screen(Screen(console, bars=2)):
        with step("building the parts"):
            sleep(0.3)
        assert "building the parts" in stream.getvalue()
        with at_work("response: a = 1"):
            stage("check in time: [170.00 Hz]")
            sleep(0.3)
    assert "check in time: [170.00 Hz]" in stream.getvalue()
    assert "response: a = 1: done" in stream.getvalue()


def test_keys_of_a_table_are_told_with_defaults_and_meanings() -> None:
    (found,) = table_keys("forced_response")
    told = {key: (default, meaning) for key, default, meaning in found.rows}
    assert told["peak_points"][0] == "8"
    assert told["points"][1]
    (law,) = table_keys("contact.elastic_coulomb")
    assert law.title == '[contact.NAME] with law = "elastic_coulomb"'
    assert ("friction_coefficient", REQUIRED) in [row[:2] for row in law.rows]
    with pytest.raises(InputError, match="forced_response"):
        table_keys("forced_responses")


def test_kinds_are_found_by_their_names_alone() -> None:
    with pytest.raises(InputError, match=r"'stickslip keys part\.wedge'"):
        table_keys("wedge")
    with pytest.raises(InputError, match=r"'stickslip keys contact\.jenkins'"):
        table_keys("jenkins")
    assert table_keys("part.NAME") == table_keys("part")
    titles = [own.title for own in table_keys("part")]
    assert titles[-2:] == ['[part.NAME] with file = "..."', '[part.NAME] with of = "..."']
    (of_file,) = table_keys("part.file")
    assert "axis_direction" in [row[0] for row in of_file.rows]


def test_a_name_of_ones_own_behind_the_dot_is_told_as_one() -> None:
    """A designer asks for part.damper: the kinds described as dampers come first, and a command shows the keys of one."""
    with pytest.raises(
        InputError, match=r'a name of your own; shape decides.* one of "flat_curved", .*keys part\.flat_curved'
    ):
        table_keys("part.damper")
    with pytest.raises(InputError, match=r"a name of your own; law decides .*Known: bonded"):
        table_keys("contact.left")
    assert table_keys("load.shaker") == table_keys("load")
    (found,) = table_keys("forced_response.points")
    assert [row[0] for row in found.rows] == ["points"]
    assert len(table_keys("part.damper.mass_kg")) > 1
    assert [row[0] for row in table_keys("contact.left.law")[0].rows] == ["law"]
    with pytest.raises(InputError, match=r"is no key of \[campbell\]. Did you mean 'engine_orders'"):
        table_keys("campbell.engine_order")
    with pytest.raises(InputError, match=r"It is a key of \[part\]: 'stickslip keys part\.mass_kg'"):
        table_keys("mass_kg")


def test_silence_is_a_matter_of_the_logging_level(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(logging.getLogger(), "handlers", [])
    with by_default():
        LOG.info("heard")
    monkeypatch.setattr(LOG, "level", logging.WARNING)
    LOG.setLevel(logging.WARNING)
    try:
        with by_default():
            LOG.info("not heard")
            LOG.warning("doubtful")
    finally:
        LOG.setLevel(logging.NOTSET)
    told = capsys.readouterr().err
    assert "heard" in told
    assert "not heard" not in told
    assert "WARNING: doubtful" in told


def test_who_has_a_handler_of_his_own_gets_no_other() -> None:
    with by_default():
        assert LOG.handlers == []  # pytest has put one at the root


def test_peaks_of_a_column_are_rounded_once() -> None:
    assert _millimetres(0.60625159) == "0.6062516"
    assert aligned([_millimetres(v) for v in (0.60625159, 1.25)]) == ["0.6063", "1.2500"]
    assert aligned(["0.6062516"]) == ["0.60625"]
