"""The report: opened in a browser, checked against the data, and tried on results that lack parts."""

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from synthetic_result import synthetic_result, write_result

from stickslip.errors import InputError
from stickslip.report.choice import choice, flagged_ranges
from stickslip.report.figure_mesh import edges
from stickslip.report.figures_damper import damper_motion
from stickslip.report.figures_error import errors
from stickslip.report.figures_response import frequency_response
from stickslip.report.page import write_report
from stickslip.report.quantities import number, percent, quantity, scale_for
from stickslip.report.result import NEEDED, load_result
from stickslip.report.summary import headline

CHROMIUM = (
    shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
)
needs_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no chromium on the path: the page is not opened"
)
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--enable-logging=stderr", "--v=0",
    "--window-size=1200,2000", "--virtual-time-budget=20000", "--dump-dom",
)  # fmt: skip
FIGURES = (
    "frf", "low-order", "errors", "error-scatter", "optimisation", "loops-t", "loops-w", "states", "damper",
    "energy", "mesh",
)  # fmt: skip


@dataclass(frozen=True)
class Opened:
    """What a browser made of a page."""

    dom: str
    errors: list[str]

    def figure(self, key: str) -> str:
        """Return the DOM of one figure."""
        found = re.search(rf'<figure id="fig-{key}".*?</figure>', self.dom, re.DOTALL)
        assert found, f"figure {key} is not in the page"
        return found[0]


# inserted ahead of everything: the log of the browser does not tell console.error from console.log
RECORDER = """<script>
const failures = [];
const record = text => {
  failures.push(String(text));
  document.documentElement.dataset.failures = JSON.stringify(failures);
};
console.error = (...words) => record(words.join(" "));
addEventListener("error", event => record(event.message || "a resource did not load"), true);
addEventListener("unhandledrejection", event => record(event.reason));
</script>"""


def open_page(html: Path, folder: Path, probe: str = "") -> Opened:
    """Open a page in headless Chromium, with a probe at its end, and record what goes wrong in it."""
    text = html.read_text(encoding="utf-8")
    assert text.count("<head>") >= 1
    head, body = text.split("<head>", 1)
    watched = folder / "watched.html"
    end = body.rindex("</body>")
    watched.write_text(f"{head}<head>{RECORDER}{body[:end]}{probe}{body[end:]}", encoding="utf-8")
    command = [str(CHROMIUM), *FLAGS, f"--user-data-dir={folder / 'profile'}", watched.as_uri()]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=180, check=True)
    assert "</html>" in ran.stdout
    recorded = re.search(r'<html[^>]* data-failures="([^"]*)"', ran.stdout)
    errors = json.loads(unescape(recorded[1])) if recorded else []
    errors += re.findall(r"CONSOLE[:(]\d+\)?\] \"(Uncaught.*?)\", source", ran.stderr)
    return Opened(ran.stdout, errors)


def marks(figure: str) -> int:
    """Count what a figure draws inside its axes: lines, points, bars, tiles; a canvas for 3-D."""
    drawn = r'class="js-line"[^>]* d="M[^"]+"|<path class="point"|class="point"><path|<image [^>]*data:image'
    found = len(re.findall(drawn, figure))
    return found + len(re.findall(r"<canvas", figure)) * ("gl-container" in figure)


def report(dataset: xr.Dataset, folder: Path) -> Path:
    """Write the result and its report; return the page."""
    html = folder / "report.html"
    write_report(write_result(dataset, folder / "result.nc"), html)
    return html


def small_result() -> xr.Dataset:
    """Return a result of three load cases, quick to draw."""
    return synthetic_result(ratios=(20, 5, 2), n=24)


def page_text(html: Path) -> str:
    """Return the page without scripts and tags."""
    text = re.sub(
        r"<(script|style)\b.*?</\1>", " ", html.read_text(encoding="utf-8"), flags=re.DOTALL
    )
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", "", text))


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return report(synthetic_result(), tmp_path_factory.mktemp("report"))


# counts the colours of the mesh picture, then chooses the first load case
PROBE = """<script>
Plotly.toImage("plot-mesh", {format: "png", width: 900, height: 500}).then(url => {
  const image = new Image();
  image.onload = () => {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [900, 500];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const pixels = context.getImageData(0, 0, 900, 500).data;
    const seen = new Set();
    for (let i = 0; i < pixels.length; i += 4) seen.add(pixels.slice(i, i + 3).join());
    document.body.dataset.colours = seen.size;
  };
  image.src = url;
});
document.querySelector('.chooser button[data-case="0"]').click();
const shown = document.getElementById("plot-states").data.filter(t => t.type === "heatmap" && t.visible);
document.body.dataset.shown = shown.map(t => t.meta).join();
</script>"""


@pytest.fixture(scope="module")
def opened(page: Path, tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_page(page, tmp_path_factory.mktemp("browser"), PROBE)


def test_page_is_one_small_file_without_network(page: Path) -> None:
    html = page.read_text(encoding="utf-8")
    assert page.stat().st_size < 8e6
    outside = re.sub(r"<script\b.*?</script>", "", html, flags=re.DOTALL)
    assert not re.search(r"(src|href)\s*=", outside)
    assert "@import" not in outside
    assert not re.search(r"<script[^>]*\ssrc", html)
    assert html.count("plotly.js v") == 1


@needs_browser
def test_page_opens_without_console_error(opened: Opened) -> None:
    assert opened.errors == []


@needs_browser
@pytest.mark.parametrize("key", FIGURES)
def test_every_figure_has_marks(opened: Opened, key: str) -> None:
    assert marks(opened.figure(key)) > 0


@needs_browser
def test_the_mesh_is_drawn_by_webgl(opened: Opened) -> None:
    """An export of the picture shows lit steel, edges and contact points: many colours."""
    colours = re.search(r'data-colours="(\d+)"', opened.dom)
    assert colours, "the picture could not be exported"
    # axes and text alone make some hundred shades by antialiasing; a lit mesh makes thousands
    assert int(colours[1]) > 500


@needs_browser
def test_choosing_a_load_case_changes_figures_and_captions(opened: Opened) -> None:
    assert 'data-shown="0"' in opened.dom
    for key in ("loops-t", "loops-w", "states", "damper", "energy"):
        assert re.findall(r'<span data-case="(\d)">', opened.figure(key)) == ["0"]


@needs_browser
def test_the_browser_check_sees_a_broken_page(page: Path, tmp_path: Path) -> None:
    breakage = (
        "<script>console.error('on purpose')</script><script>undefinedFunction()</script>"
        "<script>Plotly.restyle('plot-frf', {visible: false})</script>"
    )
    seen = open_page(page, tmp_path, breakage)
    assert any("on purpose" in error for error in seen.errors)
    assert any("undefinedFunction" in error for error in seen.errors)
    assert marks(seen.figure("frf")) == 0
    assert marks(seen.figure("errors")) > 0


def test_headline_numbers_come_from_the_data(tmp_path: Path) -> None:
    data = synthetic_result()
    text = page_text(report(data, tmp_path))
    response = (data.peak_amplitude / data.excitation_n).values
    best = int(np.argmin(response))
    assert f"FCL/FHE = {number(float(data.load_ratio[best]), 4)}damper optimum" in text
    assert f"smallest peak: {number(1e6 * response[best])} µm/N" in text
    error = data.predicted_error_percent.values
    known = np.isfinite(error)
    assert f"{int((error[known] > 5).sum())} of {int(known.sum())} checked points above 5 %" in text
    worst = int(np.nanargmax(error))
    assert f"{percent(float(error[worst]))}worst predicted error" in text
    assert f"at {number(float(data.frequency_hz[worst]), 5)} Hz" in text


def test_text_of_the_dataset_is_escaped(tmp_path: Path) -> None:
    data = synthetic_result()
    evil = "</script><script>document.title = 'owned'</script>"
    data.attrs |= {
        "title": evil,
        "study_toml": evil,
        "warnings": json.dumps([evil]),
        "alert_explanation": evil,
    }
    data.attrs |= {"created": evil, "versions": json.dumps({evil: evil}), "report_output": evil}
    data["contact"] = [evil + str(k) for k in range(9)]
    data["output"] = [evil, "b", "c"]
    html = report(data, tmp_path).read_text(encoding="utf-8")
    assert "<script>document.title" not in html
    assert "&lt;script&gt;document.title" in html


def test_warnings_are_named(tmp_path: Path) -> None:
    data = synthetic_result(failed=3)
    data.attrs |= {"complete": 0, "warnings": json.dumps(["The damper may drift along y."])}
    data["retention_peak_shift"][-1] = 0.2
    data["verify_difference_percent"][1] = 7.0
    text = page_text(report(data, tmp_path))
    assert "5 warnings" in text
    assert "The run is not complete" in text
    assert "The damper may drift along y." in text
    assert "3 points of FCL/FHE = 2 did not converge, between 178 and 180 Hz" in text
    assert "the peak changes by 20 %" in text
    assert "differ by more than 1 % in 1 check" in text


def test_a_clean_run_says_so(page: Path) -> None:
    assert "No warnings. The run is complete and all 343 points converged." in page_text(page)


def _without(*prefixes: str) -> Callable[[xr.Dataset], xr.Dataset]:
    def drop(data: xr.Dataset) -> xr.Dataset:
        return data.drop_vars([n for n in data.data_vars if str(n).startswith(prefixes)])

    return drop


def _no_peaks(data: xr.Dataset) -> xr.Dataset:
    data["peak_point"][:] = -1
    for name in ("peak_amplitude", "peak_frequency_hz", "peak_gap", "peak_force"):
        data[name][:] = np.nan
    return data


def _one_harmonic(data: xr.Dataset) -> xr.Dataset:
    data = data.isel(harmonic=slice(0, 2))
    data["order"][:] = 1
    data["real_error_percent"][:] = np.nan
    return data


def _nothing_flagged(data: xr.Dataset) -> xr.Dataset:
    data["predicted_error_percent"] = data["predicted_error_percent"].clip(max=1.0)
    return data


def _nothing_converged(data: xr.Dataset) -> xr.Dataset:
    data["status"][:] = 1
    data["amplitude"][:] = np.nan
    return _no_peaks(data)


def _only_first_case_done(data: xr.Dataset) -> xr.Dataset:
    data = data.isel(point=np.flatnonzero(data["case"].values == 0))
    data["peak_point"][1:] = -1
    data["peak_gap"][1:] = np.nan
    data.attrs["complete"] = 0
    return data


def _nothing_done(data: xr.Dataset) -> xr.Dataset:
    data = _without("verify")(data.isel(load_case=slice(0, 0), point=slice(0, 0)))
    data.attrs["complete"] = 0
    return data


def _bare(data: xr.Dataset) -> xr.Dataset:
    bare = data[list(NEEDED)]
    bare.attrs = {}
    return bare.drop_vars(["output", "contact", "retained"], errors="ignore")


PARTIAL = {
    "no verification": (_without("verify"), "Time integration was not asked for in this run"),
    "no peaks": (_no_peaks, "no load case has its peak reconstructed in time"),
    "one harmonic": (_one_harmonic, "no point was solved at both orders"),
    "nothing flagged": (_nothing_flagged, "nowhere"),
    "nothing converged": (_nothing_converged, "no point of the run has converged yet"),
    "no predicted error": (_without("predicted"), "No predicted error was computed"),
    "one case done": (_only_first_case_done, "this file holds 3 load cases, 1 of them with a peak"),
    "nothing done": (_nothing_done, "this file holds 0 load cases"),
    "no mesh": (_without("surface"), "the skin of the mesh is not in this result"),
    "no contact geometry": (_without("contact_position", "contact_frame"), "The meshed blades"),
    "no energy": (_without("dissipated"), "the dissipated energy is not in this result"),
    "no damper": (
        _without("retained"),
        "the damper's coordinates at a peak are not in this result",
    ),
    "no reduction": (
        _without("frequency_full", "frequency_stuck"),
        "The reduction was not checked",
    ),
    "bare": (_bare, "Not shown"),
}


@pytest.mark.parametrize("name", PARTIAL)
def test_partial_results_make_a_page_that_says_what_is_missing(name: str, tmp_path: Path) -> None:
    change, sentence = PARTIAL[name]
    assert sentence in page_text(report(change(small_result()), tmp_path))


def test_one_load_case_makes_a_page(tmp_path: Path) -> None:
    text = page_text(report(synthetic_result(ratios=(5,)), tmp_path))
    assert "the curves need the peaks of at least two load cases" in text


@needs_browser
@pytest.mark.parametrize("name", ["bare", "nothing converged", "one harmonic"])
def test_partial_pages_open_without_console_error(name: str, tmp_path: Path) -> None:
    data = _without("surface")(PARTIAL[name][0](small_result()))
    seen = open_page(report(data, tmp_path), tmp_path)
    assert seen.errors == []
    drawn = re.findall(r'<figure id="fig-([\w-]+)" class="(?:by|all)-case', seen.dom)
    assert [key for key in drawn if marks(seen.figure(key)) == 0] == []


def test_failed_points_are_crosses_even_without_amplitude(tmp_path: Path) -> None:
    data = synthetic_result(failed=3)
    data["amplitude"][data["status"].values != 0] = np.nan
    figure = frequency_response(load_result(write_result(data, tmp_path / "r.nc"))).figure
    assert figure is not None
    crosses = next(t for t in figure.data if t.name == "did not converge")
    assert list(crosses.x) == data["frequency_hz"].values[data["status"].values != 0].tolist()
    assert np.isfinite(crosses.y).all()
    curve = figure.data[6]
    assert int(np.isnan(curve.y).sum()) == 3, "the curve must be left open where points failed"


def test_bad_input_names_file_and_remedy(tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    with pytest.raises(InputError, match=r"none\.nc: no such file\. Give the result\.nc"):
        write_report(tmp_path / "none.nc", page)
    text = tmp_path / "text.nc"
    text.write_text("not a dataset", encoding="utf-8")
    with pytest.raises(InputError, match=r"text\.nc: not a netCDF-4 file"):
        write_report(text, page)
    other = write_result(synthetic_result().drop_vars(["case", "status"]), tmp_path / "other.nc")
    with pytest.raises(InputError, match=r"other\.nc: variables case, status are missing"):
        write_report(other, page)
    good = write_result(synthetic_result(ratios=(5,)), tmp_path / "good.nc")
    with pytest.raises(
        InputError, match=r"report\.html: cannot be written \(No such file or directory\)"
    ):
        write_report(good, tmp_path / "missing" / "report.html")


def test_flagged_ranges_are_runs_of_neighbouring_points(tmp_path: Path) -> None:
    data = synthetic_result(ratios=(5,), n=10)
    hz = np.concatenate([np.arange(100.0, 110.0), [104.1, 104.2, 104.3]])
    error = np.array([0, 6, 0, 0, 7, 9, 8, 0, 0, 0, np.nan, np.nan, np.nan])
    data["frequency_hz"][:], data["predicted_error_percent"][:] = hz, error
    result = load_result(write_result(data, tmp_path / "r.nc"))
    assert flagged_ranges(result, result.cases[0]) == [(101, 101), (104, 106)]


def test_largest_error_is_told_where_none_is_above_the_threshold(tmp_path: Path) -> None:
    data = synthetic_result(ratios=(5,), n=4)
    data["frequency_hz"][:4] = np.arange(100.0, 104.0)
    data["predicted_error_percent"][:] = [0.1, 1.2, 1, 0.1, np.nan, np.nan, np.nan]
    page = choice(load_result(write_result(data, tmp_path / "r.nc")))
    assert "<td>nowhere</td><td>1.2 % at 101 Hz</td>" in page


def test_the_report_knows_of_alerts_whose_points_a_branch_replaced(tmp_path: Path) -> None:
    data = synthetic_result(ratios=(5,), n=10)
    data["predicted_error_percent"][:] = np.nan
    data["alert_case"] = "alert_point", np.zeros(6, dtype=int)
    data["alert_frequency_hz"] = "alert_point", np.array([100.0, 102, 103, 104, 105, 107])
    data["alert_error_percent"] = "alert_point", np.array([1.0, 6, 250, 8, 2, 9])
    result = load_result(write_result(data, tmp_path / "r.nc"))
    assert flagged_ranges(result, result.cases[0]) == [(102, 104), (107, 107)]
    assert "102 to 104 Hz<br>107 Hz" in choice(result)
    assert "4 of 6 checked points above 5 %" in headline(result)
    assert "over 100 %" in headline(result)
    assert "over 100 % at 103 Hz" in choice(result)
    assert "4 of 6 checked points lie above it" in errors(result).caption


def test_curves_follow_frequency_but_a_folded_branch_its_own_order(tmp_path: Path) -> None:
    data = synthetic_result(ratios=(5,), n=6)
    result = load_result(write_result(data, tmp_path / "r.nc"))
    assert np.all(np.diff(result.floats("frequency_hz")[result.points(result.cases[0])]) >= 0)
    data["frequency_hz"][:6] = [1, 3, 4, 2, 5, 6]
    folded = load_result(write_result(data, tmp_path / "f.nc"))
    assert folded.points(folded.cases[0]).tolist() == [0, 1, 2, 3, 4, 5]


def test_damper_motion_is_the_fourier_series(tmp_path: Path) -> None:
    data = synthetic_result(ratios=(5,), n=6)
    values = data["retained_displacement"]
    values[:] = 0.0
    at = {
        "point": int(data["peak_point"][0]),
        "retained": list(data["retained"].values).index("damper.rx"),
    }
    values[{**at, "harmonic": 0, "part": 0}] = 7.0
    values[{**at, "harmonic": 2, "part": 0}] = 3.0
    values[{**at, "harmonic": 3, "part": 1}] = -2.0
    result = load_result(write_result(data, tmp_path / "r.nc"))
    mean, motion = damper_motion(result, result.cases[0], samples=16)
    phase = 2 * np.pi * np.arange(17) / 16
    assert mean.tolist() == [0, 0, 0, 7, 0, 0]
    # Re(3 e^{2iτ} − 2i e^{3iτ}) = 3 cos 2τ + 2 sin 3τ, to rounding
    np.testing.assert_allclose(motion[3], 3 * np.cos(2 * phase) + 2 * np.sin(3 * phase), atol=1e-13)
    assert not motion[[0, 1, 2, 4, 5]].any()


def test_a_stuck_contact_dissipates_nothing_in_spite_of_rounding(tmp_path: Path) -> None:
    data = synthetic_result(ratios=(5000,), n=6)
    data["dissipated_energy"][:] = 1e-19
    text = page_text(report(data, tmp_path))
    assert text.count("No loop encloses an area: nothing is dissipated in this direction.") == 2
    assert "At the peak nothing is dissipated: every point sticks." in text
    assert "No point dissipates energy." in text


def test_edges_of_a_cube() -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    pairs, sharp = edges(corners, triangles)
    assert len(pairs) == 18  # twelve edges and six diagonals
    assert int(sharp.sum()) == 12
    assert np.allclose(np.linalg.norm(np.diff(corners[pairs[sharp]], axis=1), axis=-1), 1.0)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (1234567.0, "1\u202f230\u202f000"), (187.6543, "188"), (0.05, "0.05"), (-21.94, "−21.9"),
        (9.996, "10"), (1e-7, "1.00·10<sup>−7</sup>"), (float("nan"), "–"),
    ],
)  # fmt: skip
def test_numbers_have_three_digits(value: float, text: str) -> None:
    assert number(value) == text


def test_engineering_prefixes() -> None:
    assert quantity(12.3e-6, "m") == "12.3 µm"
    assert quantity(1e-6, "m") == "1 µm"
    assert quantity(999.96e-6, "m", 5) == "999.96 µm"
    assert quantity(0.0, "m") == "0 m"
    assert quantity(4.2e-20, "J").startswith("4.20·10")
    assert scale_for(np.array([np.nan, 2e-3, 5.0]), "J").unit == "J"
    assert percent(2e-6) == "< 0.0001 %"
