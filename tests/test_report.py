"""The report: opened in a browser, checked against the data, and tried on results that lack parts."""

import json
import math
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from html import unescape
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest
import xarray as xr
from browser import CHROMIUM, Browser
from study_texts import JENKINS, study_of
from synthetic_result import HIGH, KEY, provenance, synthetic_result, tree_of, write_result

import stickslip as ss
from stickslip.analyses.forced_response.page.at_peak.bodies import body_motion, rigid_bodies
from stickslip.analyses.forced_response.page.at_peak.contacts import hysteresis_t
from stickslip.analyses.forced_response.page.chapter import cards, peaks
from stickslip.analyses.forced_response.page.checks import stability, statistics_in_time, time_integration
from stickslip.analyses.forced_response.page.curves import frequency_response
from stickslip.analyses.forced_response.page.harmonics import (
    choice,
    errors,
    flagged_ranges,
    kept_harmonics,
    more_harmonics,
)
from stickslip.analyses.forced_response.page.optimisation import optimisation
from stickslip.analyses.forced_response.page.response import NEEDED, Response
from stickslip.analyses.inputs import Varied, as_run, inputs, told
from stickslip.analyses.page import plots, report_file, report_html
from stickslip.analyses.pictures import edges, reduction, skin_picture
from stickslip.api.as_tables import as_tables
from stickslip.api.model import Model
from stickslip.assembly.forces import Load
from stickslip.errors import InputError
from stickslip.report.frame import Chapter, Placing, page_html
from stickslip.report.plot import Plot, log_ticks, styled
from stickslip.report.quantities import amplitude, column, number, percent, quantity, runs, scale_for
from stickslip.report.result import Node
from stickslip.report.section import Table
from stickslip.report.tiles import patches, triangulated
from stickslip.study.file.case_names import without_common_words
from stickslip.study.questions import ANALYSES, Home
from stickslip.study.verdict import Verdict, to_json

needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the path: the page is not opened")
FIGURES = (
    "response",
    "low_order",
    "harmonics",
    "errors",
    "error_scatter",
    "optimisation",
    "loops_t",
    "loops_w",
    "states",
    "motion_damper",
    "energy",
    "mesh",
)


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


def open_page(browser: Browser, html: Path, folder: Path, probe: str = "", wait: str = "true") -> Opened:
    """Open a page with a probe at its end until something is true, and record what goes wrong in it."""
    text = html.read_text(encoding="utf-8")
    watched, end = folder / "watched.html", text.rindex("</body>")
    watched.write_text(f"{text[:end]}{probe}{text[end:]}", encoding="utf-8")
    browser.errors.clear()
    browser.width(1200, 2000)
    browser.open(watched)
    browser.until(wait)
    return Opened(browser.run("document.documentElement.outerHTML"), list(browser.errors))


def marks(figure: str) -> int:
    """Count what a figure draws inside its axes: lines, points, bars, tiles; a canvas for 3-D."""
    drawn = r'class="js-line"[^>]* d="M[^"]+"|<path class="point"|class="point"><path|<image [^>]*data:image'
    found = len(re.findall(drawn, figure))
    return found + len(re.findall(r"<canvas", figure)) * ("gl-container" in figure)


def report(dataset: xr.Dataset, folder: Path, **root: object) -> Path:
    """Write the result and its report; return the page."""
    write_result(tree_of(provenance(**root), forced_response=dataset), folder / "result.nc")
    return report_file(folder)


def small_result() -> xr.Dataset:
    """Return a result of three load cases and one contact of each line, quick to draw: a contact takes a panel of each figure."""
    return synthetic_result(ratios=(20, 5, 2), n=24).isel(contact=[0, 3, 6])


def light(dataset: xr.Dataset) -> xr.Dataset:
    """Leave out what takes longest to draw and stands below the curves: the mesh, and what contacts and dampers do."""
    heavy = ("surface", "retained", "peak_gap", "peak_force", "peak_state", "peak_time", "dissipated", "verify")
    return _without(*heavy)(dataset)


def html_of(dataset: xr.Dataset, **root: object) -> str:
    """Return the page of a result that is not written."""
    return report_html(tree_of(provenance(**root), forced_response=dataset))


def page_text(html: str) -> str:
    """Return the page without scripts and tags."""
    text = re.sub(r"<(script|style)\b.*?</\1>", " ", html, flags=re.DOTALL)
    return re.sub(r"\s+", " ", unescape(re.sub(r"<[^>]+>", "", text)))


# least ratio of luminances between text and the nearest background behind it, plotly's figures left out
CONTRAST = """(() => {
  const parts = text => text.match(/[\\d.]+/g).map(Number);
  const light = rgb => rgb.slice(0, 3).map(v => v / 255).map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, k) => sum + v * [0.2126, 0.7152, 0.0722][k], 0);
  const behind = own => {
    for (let e = own; e; e = e.parentElement) {
      const found = parts(getComputedStyle(e).backgroundColor);
      if (found.length < 4 || found[3] > 0) return found;
    }
    return [255, 255, 255];
  };
  const texts = [...document.querySelectorAll("main *")].filter(e => !e.closest(".js-plotly-plot, figcaption b[style], option")
    && [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim()) && e.checkVisibility());
  return Math.min(...texts.map(e => {
    const [a, b] = [light(parts(getComputedStyle(e).color)), light(behind(e))];
    return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  }));
})()"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return report(synthetic_result(ratios=(20, 5, 2)).isel(contact=[0, 3, 6]), tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def light_page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three cases at few points and without what stands below their curves, quicker to open."""
    page = tmp_path_factory.mktemp("light") / "report.html"
    page.write_text(html_of(light(small_result())), encoding="utf-8")
    return page


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


# bottoms of the verdict line, the answer and its figure, height of the curve's panel, and the words that are shown above 900 px
FIRST = """(() => {
  const bottom = s => document.querySelector(s).getBoundingClientRect().bottom + scrollY;
  const walk = document.createTreeWalker(document.querySelector("main"), NodeFilter.SHOW_TEXT), words = [];
  while (walk.nextNode()) {
    const own = walk.currentNode, range = document.createRange();
    range.selectNodeContents(own);
    const box = range.getBoundingClientRect();
    if (own.parentElement.closest("svg, script, style, .modebar") || !own.parentElement.checkVisibility() || box.top + scrollY > 900) continue;
    words.push(...own.data.split(/\\s+/).filter(Boolean));
  }
  const drawn = document.querySelector("figure .nsewdrag").getBoundingClientRect();
  return {verdict: bottom(".box"), answer: bottom(".answer"), figure: bottom("figure"), wide: drawn.width, words: words.length, all: words.join(" ")};
})()"""


@dataclass(frozen=True)
class Tried:
    """What came of a page in windows of several widths, in the dark, and on paper."""

    sideways: dict[int, int]  # width of the window -> pixels by which the page is wider
    contrasts: dict[str, float]  # colour scheme -> least contrast of text to what is behind it
    sheets: int
    folded: int  # chapters folded away while it was printed


@pytest.fixture(scope="module")
def opened(browser: Browser, page: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Opened, Tried]:
    drawn = "document.body.dataset.colours"
    seen = open_page(browser, page, tmp_path_factory.mktemp("browser"), PROBE, drawn)
    contrasts = {}
    for scheme in ("light", "dark"):
        browser.scheme(scheme)
        contrasts[scheme] = browser.run(CONTRAST)
    browser.scheme("light")
    sideways = {}
    for width in (400, 760, 1600):
        browser.width(width)
        wider = "document.documentElement.scrollWidth - innerWidth"
        browser.until(f"{wider} <= 0")
        sideways[width] = browser.run(wider)
    browser.run(
        "addEventListener('beforeprint', () => { window.folded = document.querySelectorAll('details:not([open])').length; })"
    )
    sheets = len(re.findall(rb"/Type\s*/Page\b", browser.pdf()))
    tried = Tried(sideways, contrasts, sheets, browser.run("window.folded ?? -1"))
    dom = browser.run("document.documentElement.outerHTML")
    return Opened(dom, [*seen.errors, *browser.errors]), tried


@needs_browser
@pytest.mark.parametrize("verdicts", [8, 9])
def test_paper_has_the_answer_before_a_long_list_of_verdicts(browser: Browser, light_page: Path, verdicts: int) -> None:
    browser.width(760)
    browser.open(light_page)
    items = "<li>a verdict</li>" * verdicts
    box = f"<details class='box good'><summary>All trusted.</summary><ul>{items}</ul></details>"
    browser.run(f'document.querySelector(".box").outerHTML = "{box}"')
    where = "['details.box', 'p.box', '.answer', '.cards'].map(s => [...document.querySelector('main').children].indexOf(document.querySelector(s)))"
    before = browser.run(where)
    browser.run("dispatchEvent(new Event('beforeprint'))")
    box, line, answer, numbers = browser.run(where)
    assert box == numbers + 1 if verdicts > 8 else box < answer
    assert (line >= 0) == (verdicts > 8)
    assert line < answer
    assert browser.run("document.querySelector('details.box').open")
    browser.run("dispatchEvent(new Event('afterprint'))")
    assert browser.run(where) == before


def first_screen_of(browser: Browser, page: Path) -> dict[str, Any]:
    """Check the order and the words of the first screen at 760 px, and return what stands there."""
    browser.width(760)
    browser.open(page)
    browser.until("document.querySelector('figure .nsewdrag')")
    first: dict[str, Any] = browser.run(FIRST)
    assert first["verdict"] < first["answer"] < first["figure"] < 900
    assert first["wide"] >= 480
    assert 20 < first["words"] <= 90, first["all"]
    return first


@needs_browser
@pytest.mark.parametrize("ratios", [(50, 20, 5), (5,)])
def test_the_first_screen_holds_verdict_answer_and_figure_in_few_words(
    browser: Browser, tmp_path: Path, ratios: tuple[float, ...]
) -> None:
    page = tmp_path / "report.html"
    page.write_text(html_of(light(synthetic_result(ratios=ratios))), encoding="utf-8")
    first_screen_of(browser, page)


@needs_browser
@pytest.mark.parametrize("ratios", [(50, 20, 5), (5,)])
def test_the_first_screen_of_a_comparison_holds_verdict_answer_and_figure(
    browser: Browser, tmp_path: Path, ratios: tuple[float, ...]
) -> None:
    results = [
        ss.Result(tree_of(forced_response=light(synthetic_result(ratios=own)))) for own in (ratios, ratios[::-1])
    ]
    page = tmp_path / "both.html"
    ss.compare(*results, names=("before", "after")).report(page)
    first = first_screen_of(browser, page)
    assert "peak, equal to" in first["all"]


@needs_browser
def test_the_numbers_of_a_map_fit_their_cells_on_a_narrow_screen(browser: Browser, tmp_path: Path) -> None:
    names = [f"tangential stiffness {k} N/mm, force {f} N" for k in (20, 50, 100) for f in (2, 5, 10)]
    columns = ["0.5", "1", "2", "5", "20"]
    texts = [[f"{300 + 10 * row + k}" for k in range(5)] for row in range(9)]
    title, rows = without_common_words(names)
    cells = go.Heatmap(x=columns, y=rows, z=np.arange(45.0).reshape(9, 5), text=texts, texttemplate="%{text}")
    figure = styled(go.Figure(cells.update(showscale=False)), 400).update_yaxes(type="category", title_text=title)
    figure.update_xaxes(type="category")
    shown = Placing()([Plot("map", "Map", "", figure)])
    page = tmp_path / "map.html"
    page.write_text(page_html("Map", "", [Chapter("map", "Map", shown)]), encoding="utf-8")
    browser.width(400)
    browser.open(page)
    browser.until("document.querySelectorAll('.heatmap-label').length === 45")
    widest = browser.run(
        "Math.max(...[...document.querySelectorAll('.heatmap-label')].map(t => t.getBoundingClientRect().width))"
    )
    panel = browser.run("document.querySelector('.nsewdrag').getBoundingClientRect().width")
    assert 12 < widest < panel / 5


@needs_browser
@pytest.mark.parametrize(("width", "beside"), [(400, False), (760, False), (1200, True)])
def test_a_legend_stands_below_its_panel_on_a_narrow_screen(
    browser: Browser, light_page: Path, width: int, beside: bool
) -> None:
    browser.width(width)
    browser.open(light_page)
    browser.until("document.querySelector('#plot-response .legend')")
    legend, panel = (
        browser.run(f"document.querySelector('#plot-response {part}').getBoundingClientRect().toJSON()")
        for part in (".legend", ".nsewdrag")
    )
    assert (legend["left"] >= panel["right"]) is beside
    assert (legend["top"] >= panel["bottom"]) is not beside
    if not beside:  # the figure has grown: axis title above, caption below the legend
        title, caption = (
            browser.run(f"document.querySelector('#fig-response {part}').getBoundingClientRect().toJSON()")
            for part in (".xtitle", "figcaption")
        )
        browser.until(
            "document.querySelector('#plot-response .legend').getBoundingClientRect().top >= "
            "document.querySelector('#plot-response .xtitle').getBoundingClientRect().bottom"
        )
        assert title["bottom"] < caption["top"]


def test_page_is_one_small_file_without_network(page: Path) -> None:
    html = page.read_text(encoding="utf-8")
    assert page.stat().st_size < 6.1e6
    outside = re.sub(r"<script\b.*?</script>", "", html, flags=re.DOTALL)
    assert not re.search(r"(src|href)\s*=", outside)
    assert "@import" not in outside
    assert not re.search(r"<script[^>]*\ssrc", html)
    assert html.count("plotly.js v") == 1


@needs_browser
def test_page_opens_without_console_error(opened: tuple[Opened, Tried]) -> None:
    assert opened[0].errors == []


@needs_browser
def test_the_page_fits_narrow_and_wide_windows_light_and_dark_and_paper(opened: tuple[Opened, Tried]) -> None:
    tried = opened[1]
    assert max(tried.sideways.values()) <= 0, tried.sideways
    assert min(tried.contrasts.values()) >= 4.5, tried.contrasts  # of WCAG AA
    assert tried.sheets >= 5
    assert tried.folded == 0


@needs_browser
@pytest.mark.parametrize("key", FIGURES)
def test_every_figure_has_marks(opened: tuple[Opened, Tried], key: str) -> None:
    assert marks(opened[0].figure(key)) > 0


@needs_browser
def test_the_mesh_is_drawn_by_webgl(opened: tuple[Opened, Tried]) -> None:
    """An export of the picture shows lit steel, edges and contact points: many colours."""
    colours = re.search(r'data-colours="(\d+)"', opened[0].dom)
    assert colours, "the picture could not be exported"
    # axes and text alone make some hundred shades by antialiasing; a lit mesh makes thousands
    assert int(colours[1]) > 500


@needs_browser
def test_choosing_a_load_case_changes_figures_and_captions(opened: tuple[Opened, Tried]) -> None:
    assert 'data-shown="0"' in opened[0].dom
    for key in ("loops_t", "loops_w", "states", "motion_damper", "energy"):
        assert re.findall(r'<span data-case="(\d)">', opened[0].figure(key)) == ["0"]


@needs_browser
def test_the_browser_check_sees_a_broken_page(browser: Browser, light_page: Path, tmp_path: Path) -> None:
    breakage = (
        "<script>console.error('on purpose')</script><script>undefinedFunction()</script>"
        "<script>Plotly.restyle('plot-response', {visible: false})</script>"
    )
    seen = open_page(browser, light_page, tmp_path, breakage)
    assert any("on purpose" in error for error in seen.errors)
    assert any("undefinedFunction" in error for error in seen.errors)
    assert marks(seen.figure("response")) == 0
    assert marks(seen.figure("errors")) > 0


def test_headline_numbers_come_from_the_data() -> None:
    data = light(synthetic_result(ratios=(50, 20, 5), n=24))
    text = page_text(html_of(data))
    response = (data.peak_amplitude / data.excitation_n).values
    best = int(np.argmin(response))
    at = f"at {number(float(data.peak_frequency_hz[best]), 5)} Hz"
    assert f"{1e3 * data.peak_amplitude.values[best]:.4g} mm {at} with {KEY} = " in text
    assert f"with {KEY} = {data.vary_value[best, 0].item():g}, the smallest peak per newton of " in text
    assert (
        f"{number(1e6 * response[best], 4)} µm/N, {percent(100 * response[best] / response.max())} of the largest"
        in text
    )


def test_text_of_the_dataset_is_escaped() -> None:
    evil = "</script><script>document.title = 'owned'</script>"
    data = small_result()
    n = data.sizes["case"]
    data.attrs |= {
        "verdicts": to_json([Verdict("wrong", evil, 1.0, evil, evil), Verdict("trusted", evil, None, evil)]),
        "alert_explanation": evil,
        "report_output": evil,
        "error_over": evil,
    }
    data = data.assign_coords(
        contact=[evil + str(k) for k in range(data.sizes["contact"])], output=[evil, "b", "c"], vary=[evil]
    )
    data["contact_group"], data["contact_law"] = ("contact", [evil] * 3), ("contact", [evil] * 3)
    data["case_label"] = "case", [f"{evil} = {k}" for k in range(n)]
    data["retained"] = [str(v).replace("damper", evil) for v in data["retained"].values]
    root = {"title": evil, "study_toml": evil, "created": evil, "versions": json.dumps({evil: evil})}
    html = html_of(data, **root)
    assert "<script>document.title" not in html
    assert "&lt;script&gt;document.title" in html


def test_verdicts_are_listed_the_worst_first_with_their_remedies() -> None:
    data = light(synthetic_result(ratios=(5, 2), failed=3))
    each = (
        Verdict("doubtful", "", None, "the damper may drift along y", "Hold it."),
        Verdict("wrong", f"{KEY} = 2", 170.0, "did not converge", "Take more points."),
        Verdict("trusted", "", None, "the response folds", "Points outside belong to the fold."),
        Verdict("trusted", f"{KEY} = 5", 171.0, "peak with H = 5, stable"),
    )
    data.attrs["verdicts"] = to_json(each)
    text = page_text(html_of(data, complete=0))
    told = "Not to be trusted as it stands: the run is not complete; forced response: wrong. See the verdicts."
    assert told in text
    assert f"WRONG: {KEY} = 2: 170.00 Hz: did not converge. Take more points." in text
    assert text.index("did not converge. Take") < text.index("DOUBTFUL: The run is not complete")
    assert "DOUBTFUL: The damper may drift along y. Hold it." in text
    assert "NOTE: The response folds. Points outside belong to the fold." in text
    assert f"TRUSTED: {KEY} = 5: 171.00 Hz: peak with H = 5, stable." in text
    assert "Trusted, with the checks: 1" in text


def test_harmonics_that_were_raised_along_the_branch_are_told_as_such() -> None:
    data = light(synthetic_result(ratios=(5,), n=10))
    n = data.sizes["point"]
    data.attrs["passages"] = "auto"
    data["own_error_percent"] = "point", np.linspace(0.5, 3.5, n)
    data["audit_error_percent"] = "point", np.where(np.arange(n) == 4, 1.25, np.nan)
    text = page_text(html_of(data))
    assert "Harmonics are raised along the branch, from H = 1 up to 5" in text
    assert "3.5 %; 1.2 %" in text
    assert "predicts for the harmonics of each accepted solution" in text
    assert "first solved with" not in text
    assert "were asked to repeat" not in text
    view = Response(data)
    np.testing.assert_allclose(view.alert.error, data.own_error_percent)
    assert "of points asked for more harmonics" not in [c.label for c in cards(view)]


def test_the_figure_of_errors_says_what_became_of_what_lies_above_the_threshold() -> None:
    data = synthetic_result(ratios=(5,), n=10)
    n = data.sizes["point"]
    data.attrs["passages"] = "auto"
    own, audit, level = np.full(n, 0.5), np.full(n, np.nan), np.zeros(n, dtype=np.int64)
    own[[3, 4]], audit[[3, 4]] = (np.inf, 6.0), (2.5, 1.0)
    data["own_error_percent"], data["audit_error_percent"] = ("point", own), ("point", audit)
    data["verdict"] = "point", level
    caption = errors(Response(data)).caption
    assert "Above it: 2 points, 2 of them solved again with more harmonics" in caption
    assert "the difference is 2.5 % at most. None of them is doubtful or wrong." in caption
    own[5], level[5] = 8.0, 1
    caption = errors(Response(data)).caption
    assert "Above it: 3 points, 2 of them solved again" in caption
    assert "1 of them is doubtful or wrong." in caption
    assert "None lies above it." in errors(Response(data.assign(own_error_percent=("point", np.full(n, 0.5))))).caption


def test_errors_of_rounding_alone_are_not_drawn() -> None:
    data = synthetic_result(ratios=(5,), n=10).drop_vars("real_error_percent")
    data.attrs["passages"] = "auto"
    data["own_error_percent"] = "point", np.full(data.sizes["point"], 8.7e-5)
    assert errors(Response(data)) is None
    data["own_error_percent"][3] = 0.002
    assert errors(Response(data)) is not None


def test_warnings_of_older_results_are_doubts() -> None:
    data = light(small_result())
    data.attrs["warnings"] = json.dumps(["3 points did not converge. Take more."])
    assert "DOUBTFUL: 3 points did not converge. Take more." in page_text(html_of(data))


def test_symbols_say_what_is_doubtful_and_what_is_wrong() -> None:
    data = synthetic_result(ratios=(5,), n=10)
    levels = np.zeros(data.sizes["point"], dtype=np.int64)
    levels[[2, 3]] = 1, 2
    data["verdict"] = ("point", levels)
    data["verdict_reason"] = ("point", [("", "too few harmonics <5", "it left")[k] for k in levels])
    data["case_verdict"] = ("case", [1])
    view = Response(data)
    plot = frequency_response(view)
    assert plot is not None
    trace, at = plot.figure.data[0], view.points(view.cases[0]).tolist()
    shape = "diamond" if view.more[2] else "circle"
    assert trace.marker.symbol[at.index(2)] == f"{shape}-open"
    assert trace.marker.symbol[at.index(3)] == "x"
    trusted = [s for k, s in zip(at, trace.marker.symbol, strict=True) if levels[k] == 0]
    assert set(trusted) == {"circle", "diamond"}
    assert trace.customdata[at.index(2)][3] == "<br>doubtful: too few harmonics &lt;5"
    assert "1 doubtful point (open symbols), 1 wrong (crosses)" in plot.caption
    assert {"doubtful", "wrong"} <= {t.name for t in plot.figure.data}
    assert "doubtful" in peaks(view).rows[0]
    assert "Next" not in cards(view)[0].note  # no verdict says what to do
    remedy = "Lower harmonics.alert_threshold_percent to keep more harmonics; the rest is told below. And more."
    elsewhere = Verdict("doubtful", view.cases[0].label, 1e3, "too few", "Raise something else.")
    own = Verdict("doubtful", view.cases[0].label, view.peak_hz(view.cases[0]), "too few", remedy)
    told = Response(data.assign_attrs(verdicts=to_json([elsewhere, own])))
    assert cards(told)[0].note.endswith("Next: lower harmonics.alert_threshold_percent to keep more harmonics.")


def test_the_table_of_cases_names_the_harmonics_of_the_first_passage() -> None:
    """With ``always_high`` that is what is kept at every frequency, not the few of `low`."""
    data = small_result()
    few, many = "with H = 1", f"with H = {HIGH}"
    assert {few, many} <= set(peaks(Response(data)).head)
    data.attrs["selection"] = "always_high"
    head = list(peaks(Response(data)).head)
    assert few not in head
    assert head[head.index(many) + 1] == "with other H"


def test_the_answer_is_the_smallest_peak_of_the_best_verdict_and_says_what_to_do_next() -> None:
    data = synthetic_result(ratios=(50, 20, 5), n=24)
    view = Response(data)
    order = sorted(view.cases, key=view.peak_response)
    levels = np.zeros(3, dtype=np.int64)
    levels[order[0].index] = 1
    data["case_verdict"] = ("case", levels)
    view = Response(data)
    order = sorted(view.cases, key=view.peak_response)
    card = cards(view)[0]
    assert card.label == f"with {order[1].label}, the smallest peak per newton of 2 trusted of 3 cases"
    assert f"mm is doubtful with {order[0].label}." in card.note
    values = sorted(c.value for c in view.cases)
    if order[1].value in (values[0], values[-1]):
        told = f"values beyond {order[1].value:g}, where a smaller peak may lie."
        assert card.note.endswith(f"Next: give [vary] load.shaker.ratio {told}")
    else:
        assert card.note.endswith("Next: give [vary] load.shaker.ratio values between 5 and 50.")


def test_checks_name_their_case_and_what_decided() -> None:
    data = synthetic_result(ratios=(20, 5), n=10)
    rows = {
        "case": [0, 1],
        "frequency_hz": [180.0, 181.0],
        "verdict": ["stable", "undecided"],
        "multiplier": [1.05, 0.9],
        "multiplier_error": [0.2, 0.0],
        "sentence": [
            "180.000 Hz: stable, the motion in time being attained; by the multipliers undecided: x",
            "181.000 Hz: undecided: y",
        ],
    }
    for name, own in rows.items():
        data[f"stability_{name}"] = "examined", own
    (table,) = stability(Response(data))
    assert isinstance(table, Table)
    assert [row[2:] for row in table.rows] == [
        ["stable", "motion in time", "1.05", "0.2"],
        ["undecided", "–", "0.9", "none"],
    ]
    assert table.items[1] == f"{KEY} = 5: 181.000 Hz: undecided: y"


def test_a_reduction_is_told_by_the_analysis_that_knows_the_full_model() -> None:
    frequency = ("mode", [100.0])
    reduced = xr.Dataset({"frequency_reduced_hz": frequency})
    both = reduced.assign(frequency_full_hz=frequency)
    assert reduction({"modes": Node(reduced)}) is None
    table = reduction({"modes": Node(reduced), "forced_response": Node(both)})
    assert table is not None
    assert table.rows == [["free 1", "100.000", "100.000", percent(0.0)]]


def test_every_table_of_checks_ends_with_what_they_said() -> None:
    data = synthetic_result(ratios=(20, 5), n=10)
    for name in ("reference_worst_percent", "reference_worst_hz", "reference_above"):
        data[name] = "case", [1.0, 2.0]
    for key in ("hz", "amplitude"):
        data[f"not_periodic_line_{key}"] = ("not_periodic", "line"), [[100.0], [200.0]]
    for key in ("largest", "least", "rms", "mean", "amplitudes"):
        data[f"not_periodic_{key}"] = ("not_periodic", "output"), np.ones((2, data.sizes["output"]))
    for key in ("case", "periods", "settled", "frequency_hz", "spread"):
        data[f"not_periodic_{key}"] = "not_periodic", [0, 1]
    checks = {"reference": more_harmonics, "verify": time_integration, "not_periodic": statistics_in_time}
    for name, page_table in checks.items():
        dimension = {"reference": "case", "verify": "check"}.get(name, name)
        said = [f"{name} {k}" for k in range(data.sizes[dimension])]
        data[f"{name}_sentence"] = dimension, said
        table = page_table(Response(data))
        assert isinstance(table, Table)
        assert [item.rpartition(": ")[2] for item in table.items] == said


def test_the_smallest_peak_is_one_of_resonance() -> None:
    data = synthetic_result(ratios=(50, 20, 5), n=24)
    view = Response(data)
    peaks = [view.peak_response(c) for c in view.cases]
    assert all(map(view.resonates, view.cases))
    least = int(np.argmin(peaks))
    data["highest_hz"] = "case", [np.nan] * 3
    data["lowest_hz"] = ("case", [view.peak_hz(c) if c.index == least else np.nan for c in view.cases])
    card = cards(Response(data))[0]
    assert view.cases[least].where.strip() not in card.label
    assert card.label.endswith(", the smallest peak per newton of 2 cases")
    assert "In 1 other the largest stands at the end of the sweep." in card.note
    plot = optimisation(Response(data))
    assert plot is not None
    assert (
        f"At {view.cases[least].label} the largest amplitude stands at the end of the sweep, which is no resonance."
        in plot.caption
    )


def test_the_panels_of_harmonics_end_at_the_highest_that_is_kept() -> None:
    data = synthetic_result(ratios=(20, 5), n=10)
    data.attrs["high_order"] = 41
    data.attrs.pop("high_harmonics", None)
    plot = kept_harmonics(Response(data))
    assert plot is not None
    assert plot.figure.layout.showlegend is False  # the panels are called as the cases
    assert plot.figure.layout.yaxis.range[1] < HIGH + 1
    assert "; no point keeps 6 to 41." in plot.caption
    assert runs([1, 3, 4, 6, 7, 8, 10]) == "1, 3, 4, 6 to 8, 10"


def test_a_clean_run_says_so(page: Path) -> None:
    assert "Every answer is trusted." in page_text(page.read_text(encoding="utf-8"))


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
    data = data.isel(point=np.flatnonzero(data["point_case"].values == 0))
    data["peak_point"][1:] = -1
    data["peak_gap"][1:] = np.nan
    return data


def _bare(data: xr.Dataset) -> xr.Dataset:
    bare = data[[*NEEDED, "excitation_n"]]
    bare.attrs = {}
    return bare.drop_vars(["output", "contact", "retained", "vary"], errors="ignore")


SAID = {
    "the table of time integration": "by time integration",
    "loops": "Hysteresis loops at the peak",
    "the prediction": "Does the prediction hold?",
    "the response": "Frequency response of all cases",
    "where more was needed": "makes forces at multiples of the excitation frequency",
    "the mesh": "Skin of the mesh",
    "contact points": "Contact points, coloured by contact",
    "energy": "Energy dissipated in a cycle",
    "the damper": "Motion of damper",
    "the reduction": "The reduced model reproduces",
    "optimisation": "Optimisation curves",
}
PARTIAL = {
    "no verification": (_without("verify"), {"the table of time integration"}),
    "no peaks": (_no_peaks, {"loops", "the damper", "optimisation"}),
    "one harmonic": (_one_harmonic, {"the prediction"}),
    "nothing flagged": (_nothing_flagged, set()),
    "nothing converged": (_nothing_converged, {"the response", "loops", "energy", "the damper", "optimisation"}),
    "no predicted error": (_without("predicted"), {"where more was needed", "the prediction"}),
    "one case done": (_only_first_case_done, {"optimisation", "the prediction"}),
    "no mesh": (_without("surface"), {"the mesh", "contact points"}),
    "no contact geometry": (_without("contact_position", "contact_frame"), set()),
    "no energy": (_without("dissipated"), {"energy"}),
    "no damper": (_without("retained"), {"the damper"}),
    "no reduction": (_without("frequency_full", "frequency_stuck"), {"the reduction"}),
    "bare": (_bare, set(SAID) - {"the response"}),
}


@pytest.mark.parametrize("name", PARTIAL)
def test_what_is_missing_is_left_out_of_the_page_and_nothing_else(name: str) -> None:
    change, missing = PARTIAL[name]
    text = page_text(html_of(change(small_result())))
    assert {what for what, said in SAID.items() if said not in text} == missing


def test_a_run_without_a_finished_case_makes_a_page() -> None:
    data = _without("verify")(small_result().isel(case=slice(0, 0), point=slice(0, 0)))
    html = html_of(data, complete=0)
    assert "the run is not complete" in html
    assert "<figure" not in html


def test_one_case_without_vary_speaks_of_no_cases() -> None:
    data = synthetic_result(ratios=(5,)).drop_vars(["vary", "vary_value"])
    data["case_label"] = "case", [""]
    text = page_text(html_of(data))
    assert "Optimisation curves" not in text
    assert "Figure 1. Frequency responseFirst harmonic" in text
    assert "Hz peak of tip1.x" in text
    assert "lost in a cycle at the peak" in text
    assert "by all contacts together" in text
    assert KEY not in text


def test_what_a_tuned_wheel_loses_is_told_of_one_sector() -> None:
    data = synthetic_result(ratios=(5,)).drop_vars(["vary", "vary_value"])
    assert Response(data).of_sector == ""
    assert Response(data.assign_attrs(sectors=24)).of_sector == " of one sector"


def test_without_excitation_amplitudes_are_not_divided() -> None:
    data = synthetic_result(ratios=(5, 2))
    response = Response(data.assign(excitation_n=data["excitation_n"] * np.nan))
    assert response.unit == "m"
    np.testing.assert_array_equal(response.response(), data["amplitude"].values[:, 0])


def test_optimisation_follows_the_first_varied_number_one_curve_for_each_other_value() -> None:
    data = synthetic_result(ratios=(20, 10, 5, 3.5, 3, 2))
    values = np.array([[law, k] for law in ("stiff", "soft") for k in ("0.2", "0.4", "0.6")], dtype=object)
    labels = [f"contact.flat.law = {law}, contact.flat.friction_coefficient = {k}" for law, k in values]
    data = data.drop_vars(["vary", "vary_value"]).assign(
        vary_value=(("case", "vary"), values), case_label=("case", labels)
    )
    data = data.assign_coords(vary=["contact.flat.law", "contact.flat.friction_coefficient"])
    drawn = optimisation(Response(data))
    assert drawn is not None
    assert drawn.figure.layout.xaxis2.title.text == "friction coefficient"
    left = [t for t in drawn.figure.data if t.xaxis == "x"]
    assert [t.name for t in left] == ["contact.flat.law = stiff", "contact.flat.law = soft"]
    assert all(list(t.x) == [0.2, 0.4, 0.6] for t in left)


@needs_browser
@pytest.mark.parametrize("name", ["bare", "nothing converged", "one harmonic"])
def test_partial_pages_open_without_console_error(browser: Browser, name: str, tmp_path: Path) -> None:
    data = _without("surface")(PARTIAL[name][0](small_result()))
    seen = open_page(browser, report(data, tmp_path), tmp_path)
    assert seen.errors == []
    drawn = re.findall(r'<figure id="fig-([\w-]+)" class="(?:by|all)-case', seen.dom)
    assert [key for key in drawn if marks(seen.figure(key)) == 0] == []


def test_failed_points_are_crosses_even_without_amplitude() -> None:
    data = synthetic_result(failed=3)
    data["amplitude"][data["status"].values != 0] = np.nan
    drawn = frequency_response(Response(data))
    assert drawn is not None
    figure = drawn.figure
    crosses = next(t for t in figure.data if t.name == "did not converge")
    assert list(crosses.x) == data["frequency_hz"].values[data["status"].values != 0].tolist()
    assert np.isfinite(crosses.y).all()
    curve = figure.data[6]
    assert int(np.isnan(curve.y).sum()) == 3, "the curve must be left open where points failed"


def test_bad_input_names_file_and_remedy(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.nc: no such file\. Give the result\.nc"):
        report_file(tmp_path / "none.nc")
    text = tmp_path / "text.nc"
    text.write_text("not a dataset", encoding="utf-8")
    with pytest.raises(InputError, match=r"text\.nc: is no netCDF-4 file, or a damaged one"):
        report_file(text)
    other = write_result(tree_of(forced_response=small_result().drop_vars("status")), tmp_path / "other.nc")
    with pytest.raises(
        InputError, match=r"other\.nc: holds none of forced_response, .*limit_cycle, .*modes, campbell, flutter, safe"
    ):
        report_file(other)
    good = write_result(tree_of(forced_response=light(synthetic_result(ratios=(5,)))), tmp_path / "good.nc")
    with pytest.raises(InputError, match=r"report\.html: cannot be written \(No such file or directory\)"):
        report_file(good, tmp_path / "missing" / "report.html")


def test_a_toy_analysis_adds_its_section_by_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    from plotly import graph_objects as go

    from stickslip.report.plot import Plot
    from stickslip.report.result import Node
    from stickslip.report.section import Block, Section, Words

    def figure(node: Node) -> Plot:
        return Plot("toy", "A toy", "Its answer.", go.Figure([go.Scatter(y=node.floats("answer"))]))

    own = ModuleType("toy_page")
    section = Section("toy", ("answer",), Node, (Block("toy", "The toy", (figure, lambda _: Words(("**42** < 43",)))),))
    monkeypatch.setattr(own, "SECTION", section, raising=False)
    monkeypatch.setitem(sys.modules, "toy_page", own)
    monkeypatch.setitem(ANALYSES, "toy", Home("", page="toy_page:SECTION"))
    tree = tree_of(
        toy=xr.Dataset(
            {"answer": (("case", "n"), [[1.0, 2.0]])}, attrs={"verdicts": to_json([Verdict("doubtful", why="so so")])}
        )
    )
    html = report_html(tree)
    assert "<h2>The toy</h2>" in html
    assert "<summary>Figure 1. A toy</summary><span>Its answer." in html
    assert "<p><b>42</b> &lt; 43</p>" in html
    assert list(plots(tree)) == ["toy"]
    assert '<li><b class="doubtful">DOUBTFUL:</b> So so.' in html


def test_flagged_ranges_are_runs_of_neighbouring_points() -> None:
    data = synthetic_result(ratios=(5,), n=10)
    hz = np.concatenate([np.arange(100.0, 110.0), [104.1, 104.2, 104.3]])
    error = np.array([0, 6, 0, 0, 7, 9, 8, 0, 0, 0, np.nan, np.nan, np.nan])
    data["frequency_hz"][:], data["predicted_error_percent"][:] = hz, error
    result = Response(data)
    assert flagged_ranges(result, result.cases[0]) == [(101, 101), (104, 106)]


def test_largest_error_is_told_where_none_is_above_the_threshold() -> None:
    data = synthetic_result(ratios=(5,), n=4)
    data["frequency_hz"][:4] = np.arange(100.0, 104.0)
    data["predicted_error_percent"][:] = [0.1, 1.2, 1, 0.1, np.nan, np.nan, np.nan]
    table = choice(Response(data))[0]
    assert isinstance(table, Table)
    assert list(table.rows[0][1:3]) == ["nowhere", "1.2 % at 101 Hz"]


def test_the_report_knows_of_alerts_whose_points_a_branch_replaced() -> None:
    data = synthetic_result(ratios=(5,), n=10)
    data["predicted_error_percent"][:] = np.nan
    data["alert_case"] = "alert_point", np.zeros(6, dtype=int)
    data["alert_frequency_hz"] = "alert_point", np.array([100.0, 102, 103, 104, 105, 107])
    data["alert_error_percent"] = "alert_point", np.array([1.0, 6, 250, 8, 2, 9])
    result = Response(data)
    assert flagged_ranges(result, result.cases[0]) == [(102, 104), (107, 107)]
    table = choice(result)[0]
    assert isinstance(table, Table)
    assert "102 to 104 Hz\n107 Hz" in table.rows[0]
    assert "over 100 % at 103 Hz" in table.rows[0]
    drawn = errors(result)
    assert drawn is not None
    assert "4 of 6 checked points lie above it" in drawn.caption


def test_curves_follow_frequency_but_a_folded_branch_its_own_order() -> None:
    data = synthetic_result(ratios=(5,), n=6)
    result = Response(data)
    assert np.all(np.diff(result.floats("frequency_hz")[result.points(result.cases[0])]) >= 0)
    data["frequency_hz"][:6] = [1, 3, 4, 2, 5, 6]
    folded = Response(data)
    assert folded.points(folded.cases[0]).tolist() == [0, 1, 2, 3, 4, 5]


def test_motion_of_a_body_is_the_fourier_series() -> None:
    data = synthetic_result(ratios=(5,), n=6)
    values = data["retained_displacement"]
    values[:] = 0.0
    at = {"point": int(data["peak_point"][0]), "retained": list(data["retained"].values).index("damper.rx")}
    values[{**at, "harmonic": 0, "part": 0}] = 7.0
    values[{**at, "harmonic": 2, "part": 0}] = 3.0
    values[{**at, "harmonic": 3, "part": 1}] = -2.0
    result = Response(data)
    mean, motion = body_motion(result, result.cases[0], rigid_bodies(result)["damper"], samples=16)
    phase = 2 * np.pi * np.arange(17) / 16
    assert mean.tolist() == [0, 0, 0, 7, 0, 0]
    # Re(3 e^{2iτ} − 2i e^{3iτ}) = 3 cos 2τ + 2 sin 3τ, to rounding
    np.testing.assert_allclose(motion[3], 3 * np.cos(2 * phase) + 2 * np.sin(3 * phase), atol=1e-13)
    assert not motion[[0, 1, 2, 4, 5]].any()


def test_a_stuck_contact_dissipates_nothing_in_spite_of_rounding() -> None:
    data = synthetic_result(ratios=(5000,), n=6)
    data["dissipated_energy"][:] = 1e-19
    data = _without("surface", "retained", "verify")(data)
    text = page_text(html_of(data))
    assert text.count("No loop encloses an area: nothing is dissipated in this direction.") == 2
    assert "At the peak nothing is dissipated: no point slips." in text
    assert "No point dissipates energy at any frequency." in text


def test_a_loop_is_wide_by_its_own_box_whatever_the_size_of_its_forces() -> None:
    data = synthetic_result(ratios=(5,), n=6)
    said = []
    for size in (1.0, 1e-10, 1e10):
        small = data.copy(deep=True)
        small["peak_force"] *= size
        drawn, *_ = hysteresis_t(Response(small))
        said.append([re.findall(r"(\d+) of \d+ points? enclose", text) for text in drawn.case_captions.values()])
    assert all(said[0])
    assert said == [said[0]] * 3


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
        (0.0, "0"),
        (1234567.0, "1\u202f230\u202f000"),
        (187.6543, "188"),
        (0.05, "0.05"),
        (-21.94, "−21.9"),
        (9.996, "10"),
        (1e-7, "1.00·10⁻⁷"),
        (float("nan"), "–"),
    ],
)
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


@pytest.mark.parametrize("ends", [(10.53, 10.68), (136.0, 249.0), (1.0, 8.0), (0.1, 900.0)])
def test_every_logarithmic_axis_has_ticks(ends):
    ticks = log_ticks(np.array(ends))
    inside = [t for t in ticks["tickvals"] if ends[0] <= t <= ends[1]]
    assert len(inside) >= 3
    assert len(set(ticks["ticktext"])) == len(ticks["tickvals"]) <= 14


def test_keys_of_a_study_are_told_in_words() -> None:
    assert told("normal_stiffness_n_per_m", 5.2e8) == "normal stiffness 520 MN/m"
    assert told("between_hz", [150.0, 300.0]) == "between 150 and 300 Hz"
    assert told("frequency_hz", [150.0, 184.0]) == "frequency 150 to 184 Hz"
    assert told("dashpots_n_s_per_m", [["a", "b", 2.0]]) == "dashpots (a, b, 2) N s/m"
    assert told("coriolis", True) == "coriolis yes"
    assert told("force_n", Varied((4.0, 2e4))) == "force 4 N, 20 kN (varied)"
    assert told("law", Varied(("jenkins", "dahl"))) == "law jenkins, dahl (varied)"


def test_a_varied_key_is_told_with_the_values_that_were_run() -> None:
    """Of lists in one table and in tables of their own; a key that its table leaves out is told as well."""
    study = {
        "contact": {"flat": {"friction_coefficient": 0.6}},
        "load": {"a": {"force_n": 1.0}},
        "vary": [
            {"contact": {"flat": {"friction_coefficient": [0.1, 0.2], "preload_n": [5.0, 6.0]}}},
            {"load.a.force_n": [2.0, 3.0], "load.b.force_n": [1.0]},
        ],
    }
    run = as_run(study)
    flat = run["contact"]["flat"]
    assert flat == {"friction_coefficient": Varied((0.1, 0.2)), "preload_n": Varied((5.0, 6.0))}
    assert run["load"] == {"a": {"force_n": Varied((2.0, 3.0))}}
    assert study["load"] == {"a": {"force_n": 1.0}}


def test_two_values_are_too_few_for_an_optimisation_curve_and_the_page_says_so() -> None:
    needed = "need 3 values or more"
    text = page_text(html_of(light(synthetic_result(ratios=(20, 5), n=24))))
    assert f"Curves over ratio, and where friction works, {needed}; there are 2. Add values to [vary]." in text
    for ratios in ((20,), (20, 10, 5)):
        assert needed not in page_text(html_of(light(synthetic_result(ratios=ratios, n=24))))


def test_peaks_are_told_in_millimetres_as_on_the_terminal() -> None:
    assert amplitude(7.09898e-5, "m") == "0.07099 mm"
    assert amplitude(2.0, "rad") == "2 rad"
    assert amplitude(2e3, "m") == "more than a kilometre"
    assert amplitude(float("nan"), "m") == "–"
    assert column(np.array([4.435e-5, 1e-3]), "m", millimetres=True) == ("mm", ["0.044", "1.000"])
    assert column(np.array([0.01]), "rad", millimetres=True)[0] == "mrad"
    view = Response(synthetic_result(ratios=(20, 5)))
    best = min(view.cases, key=view.peak_response)
    size = f"{number(1e3 * view.peak_response(best) * best.excitation, 4)} mm"
    card = cards(view)[0]
    assert card.value.startswith(f"{size} at ")
    assert "m/N, " in card.note
    assert "peak (mm)" in peaks(view).head


def test_the_head_of_the_page_tells_what_went_in() -> None:
    study = """
[load.shaker]
on = "blades.force"
direction = "x"
ratio_of = "load.pull"
ratio = 20
[contact.flat]
between = ["damper.flat", "blades.under"]
friction_coefficient = 0.6
[damping]
ratio = 0.003
[output]
points = { tip1 = "blades.tip1" }
[vary]
load.shaker.ratio = [20, 5]
"""
    text = page_text(html_of(light(synthetic_result(ratios=(20, 5))), study_toml=study))
    assert "load shakerload.pull over 20, 5 (varied) on blades.force along x; harmonic 1" in text
    assert "flatdamper.flat, blades.under" in text
    assert "friction coefficient 0.6" in text
    assert "cases: load.shaker.ratio20, 5" in text
    assert "tip1.xmotion along x of node set or dof blades.tip1; its peak counts" in text
    assert text.index("Frequency response of all cases") < text.index("What was computed") < text.index("Provenance")


def test_tile_and_table_tell_the_quality_factor_of_the_case_shown() -> None:
    data = synthetic_result(ratios=(20, 5))
    data["peak_damping"] = "case", [0.004, 0.02]
    view = Response(data)
    (card,) = (c for c in cards(view) if c.label == "quality factor at the peak")
    shown = next(c for c in view.cases if c.index == view.chosen)
    assert card.value == {0: "125", 1: "25"}[shown.index]
    assert "0.4 % to 2 % over 2 cases" in card.note
    found = peaks(view)
    at = list(found.head).index("quality factor")
    assert [row[at] for row in found.rows] == ["125", "25"]
    assert [row[at - 1] for row in found.rows] == ["0.40", "2.00"]


def test_patches_fill_a_flat_face_and_show_what_its_points_do() -> None:
    x, y = np.meshgrid(np.arange(4.0), [0.0, 1.5, 2.0])
    position = np.column_stack([x.ravel(), np.zeros(12), y.ravel()])
    frame = np.broadcast_to(np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]]), (12, 3, 3))
    found = patches(position, frame, np.full(12, 0.5), range(12))
    corners, triangles = triangulated(found.values())
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(6.0)
    for k, own in found.items():  # every corner is nearer to its point than to another one
        away = np.linalg.norm(own[:, None] - position, axis=2)
        assert np.all(away[:, k] <= away.min(axis=1) + 1e-12)
    assert not patches(position, frame, np.full(12, np.nan), range(12))
    data = synthetic_result(ratios=(20,))
    dots = skin_picture(Response(data))
    data["contact_area"] = "contact", np.full(data.sizes["contact"], 4e-6)
    filled = skin_picture(Response(data))
    kinds = [{t.name: t.type for t in p.figure.data if t.legend == "legend2" and t.showlegend} for p in (dots, filled)]
    assert set(kinds[0]) == set(kinds[1])
    assert set(kinds[0].values()) == {"scatter3d"}
    assert set(kinds[1].values()) == {"mesh3d"}


def test_the_page_of_a_python_model_tells_its_loads(tmp_path: Path) -> None:
    model = study_of(JENKINS, tmp_path).model()
    law = replace(model.contacts["damper"].law, limit=0.2)
    damper = replace(model.contacts["damper"], law=law)
    own = Model(parts=model.parts, contacts={"damper": damper}, loads=model.loads)
    result = own.forced_response((0.1, 0.3), high=1, points=5, peak_points=0, stability="off")
    text = page_text(result.report(tmp_path / "page.html").read_text(encoding="utf-8"))
    assert "load shaker100 mN on blade.m1; harmonic 1" in text
    assert "slip limit 200 mN" in text
    assert "frequency 0.1 to 0.3 Hz" in text
    assert "shaker.xmotion along x of node set or dof blade.m1" in text


def test_the_tables_of_a_python_model_have_the_units_of_their_keys(tmp_path: Path) -> None:
    """All that `as_tables` converts: frequencies in Hz, phases in degrees, speeds in rpm, gaps by their sign."""
    model = study_of(JENKINS, tmp_path).model()
    damper, law = model.contacts["damper"], model.contacts["damper"].law
    loads = {
        "plain": Load(on="blade.m1", newton=0.5),
        "own": Load(on="blade.m1", newton=-2.0, harmonic=2, phase=math.pi / 2, omega=100 * math.pi),
        "ratio": Load(on="blade.m1", newton=1.0, omega_ratio=1.5, engine_order=3, direction=(0.0, -1.0, 0.0)),
        "oblique": Load(on="blade.m1", newton=1.0, harmonic=0, direction=(0.6, 0.0, 0.8)),
    }
    contacts = {
        "open": replace(damper, gap=1e-4, law=replace(law, limit=0.3)),
        "pressed": replace(damper, gap=-2e-4, preload=5.0, law=replace(law, limit=0.4)),
    }
    found = as_tables(replace(model, loads=loads, contacts=contacts, retention=3.0), "modes", {"number": 4})
    assert found["load"] == {
        "plain": {"force_n": 0.5, "on": "blade.m1", "harmonic": 1},
        "own": {"force_n": -2.0, "on": "blade.m1", "harmonic": 2, "phase_deg": 90.0, "frequency_hz": 50.0},
        "ratio": {
            "force_n": 1.0, "on": "blade.m1", "harmonic": 1, "direction": "-y", "engine_order": 3, "frequency_ratio": 1.5,
        },
        "oblique": {"force_n": 1.0, "on": "blade.m1", "harmonic": 0, "direction": [0.6, 0.0, 0.8]},
    }  # fmt: skip
    stuck = {"between": list(damper.between), "law": "jenkins", "tangential_stiffness_n_per_m": law.k_t}
    assert found["contact"] == {
        "open": {**stuck, "slip_limit_n": 0.3, "gap_m": 1e-4},
        "pressed": {**stuck, "slip_limit_n": 0.4, "interference_m": 2e-4, "preload_n": 5.0},
    }
    assert found["retention"] == {"stiffness_n_per_m": 3.0}
    assert found["modes"] == {"number": 4}


def test_every_table_of_a_study_has_a_row_with_its_keys() -> None:
    study = {
        "title": "a wheel",
        "part": {"blade": {"file": "fan.inp", "units": "mm-t-s"}},
        "contact": {"strip": {"between": ["blade.A", "next.blade.B"], "normal_stiffness_n_per_m": 5e7}},
        "rotation": {"speed_rpm": 8000.0},
        "modes": {"number": 5, "contacts": "open"},
        "campbell": {"speeds_rpm": [4000.0, 9000.0], "engine_orders": [4, 13]},
        "vary": {"modes.number": [5, 6]},
    }
    (table,) = inputs(study, {})
    rows = {name: text.replace("\u202f", "") for name, text in table.rows}
    assert rows == {
        "part blade": "fan.inp; units mm-t-s",
        "contact strip": "between blade.A, next.blade.B; normal stiffness 50 MN/m",
        "rotation": "speed 8000 rpm",
        "modes": "number 5, 6 (varied); contacts open",
        "campbell": "speeds 4000 to 9000 rpm; engine orders 4, 13",
        "cases: modes.number": "5, 6",
    }
