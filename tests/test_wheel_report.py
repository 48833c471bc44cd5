"""The page of bladed disks: opened in a browser, checked against the data, and tried on results that lack parts."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from browser import Browser
from synthetic_result import provenance, tree_of, write_result
from synthetic_wheel import SECTORS, campbell_result, modes_result, safe_result, skin, variable
from test_report import marks, needs_browser, open_page, page_text

from stickslip.analyses.page import plots, report_file, report_html
from stickslip.analyses.waves.page.campbell import campbell_diagram
from stickslip.analyses.waves.page.safe import _cards, interference, safe_diagram, zigzag
from stickslip.analyses.waves.page.waves import Waves, view_of
from stickslip.analyses.waves.records import Campbell, Interference
from stickslip.model.mesh.solid_mesh import coarse_skin

TITLE = "A <flat> ring & nothing else"


def view(kind: type, data: xr.Dataset) -> Waves:
    """Return the first case of a node."""
    return view_of(kind)(data.isel(case=0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("wheel")
    tree = tree_of(provenance(title=TITLE), modes=modes_result(), campbell=campbell_result(), safe=safe_result(0.1))
    write_result(tree, made / "result.nc")
    report_file(made)
    return made


# chooses ND 2, mode 1, phase 90 degrees on the whole wheel, and tells where the drawn points are
PROBE = """<script>
const form = document.querySelector("form.shapes");
form.elements.wave.value = "2";
form.elements.phase.value = "90";
form.dispatchEvent(new Event("input"));
setTimeout(() => {
  const trace = document.getElementById("plot-shapes").data[0];
  document.body.dataset.z = JSON.stringify(Array.from(trace.z));
  document.body.dataset.x = JSON.stringify(Array.from(trace.x));
  document.body.dataset.y = JSON.stringify(Array.from(trace.y));
  document.body.dataset.title = document.getElementById("plot-shapes").layout.title.text;
}, 1000);
</script>"""


@needs_browser
def test_page_draws_every_figure_and_the_wheel_moves_as_the_wave_says(
    browser: Browser, folder: Path, tmp_path: Path
) -> None:
    moved = "document.body.dataset.title"
    opened = open_page(browser, folder / "report.html", tmp_path, PROBE, moved)
    assert opened.errors == []
    for key in ("diameters", "campbell", "safe"):
        assert marks(opened.figure(key)) > 10
    assert marks(opened.figure("shapes")) > 0
    assert "ND 2, forward wave, mode 1: 183.303 Hz" in opened.dom
    x, y, z = (np.array(json.loads(_data(opened.dom, axis))) for axis in "xyz")
    points = 36  # of the sector, none of them merged
    assert len(z) == SECTORS * points
    # the formula of the shapes, at phase 90 degrees: Re(i exp(i k angle)), over all angles of the wheel
    # 6 % of the wheel's extent, as the slider says
    expected = -np.sin(2 * np.arctan2(y, x)) * 0.06 * max(np.ptp(x), np.ptp(y))
    np.testing.assert_allclose(z, expected, atol=0.005)
    np.testing.assert_allclose(np.hypot(x, y).max(), 200.0, rtol=1e-5)


def _data(dom: str, name: str) -> str:
    begin = dom.index(f'data-{name}="') + len(name) + 7
    return dom[begin : dom.index('"', begin)]


def test_page_needs_no_network_and_tells_the_numbers(folder: Path) -> None:
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert len(html) < 8e6
    assert 'src="http' not in html
    assert "<title>A &lt;flat&gt; ring &amp; nothing else</title>" in html
    text = page_text((folder / "report.html").read_text(encoding="utf-8"))
    found = safe_result(0.1)
    near = int(found.pair_near.sum())
    assert near > 0
    assert f"{near} mode{'s' if near > 1 else ''} within 10 % of an engine order" in text
    crossings = campbell_result().sizes["crossing"]
    assert f"{crossings} crossings marked" in text
    assert "14 frequencies compared" in text
    assert "mass of the wheel2 kg" in text


def test_modes_without_shapes_have_a_map_alone() -> None:
    assert list(plots(tree_of(modes=modes_result().drop_vars("shape")))) == ["diameters"]


def test_each_case_has_its_chapter_and_buttons_choose(tmp_path: Path) -> None:
    data = modes_result()
    two = xr.concat([data, data.assign(frequency_hz=2 * data["frequency_hz"])], "case")
    two["case_label"] = "case", ["span = 1", "span = 2"]
    two = two.assign(vary_value=(("case", "vary"), [[1.0], [2.0]])).assign_coords(vary=["span"])
    html = report_html(tree_of(provenance(), modes=two))
    assert html.count("<h2>Natural frequencies and mode shapes</h2>") == 1
    assert 'data-case="0" aria-pressed="true"' in html
    assert '<div data-case="0"><p><b>span = 1</b></p><figure id="fig-diameters"' in html
    assert '<div data-case="1" hidden><p><b>span = 2</b></p><figure id="fig-diameters_1"' in html


def test_near_resonance_is_the_answer_and_opens_the_mode_shapes() -> None:
    modes, safe = modes_result(), safe_result(0.1)
    html = report_html(tree_of(provenance(), modes=modes, campbell=campbell_result(), safe=safe))
    near = np.flatnonzero(safe.pair_near.values[0])
    best = near[np.argmin(np.abs(safe.pair_margin.values[0, near]))]
    order, wave, mode = (int(safe[f"pair_{n}"].values[0, best]) for n in ("engine_order", "wave", "mode"))
    head = page_text(html)[: page_text(html).index("Natural frequencies and mode shapes")]
    assert f"EO {order} meets ND {wave}, mode {mode + 1} (" in head
    assert "Figure 1. SAFE diagram" in head
    assert "near resonances within 10 %" in head or "1 near resonance within 10 %" in head
    assert f'"shown":[{wave},{mode}]' in html
    # without a SAFE diagram the crossing that is nearest to the speed of the modes
    html = report_html(tree_of(provenance(), modes=modes, campbell=campbell_result()))
    met = campbell_result()
    k = int(np.argmin(np.abs(met.crossing_speed_rpm.values[0] - 6000.0)))
    diameter = met.nodal_diameter.values[0, met.crossing_wave.values[0, k]]
    assert f'"shown":[{diameter},{int(met.crossing_mode.values[0, k])}]' in html
    assert "Figure 1. Campbell diagram" in page_text(html)
    assert '"shown":[0,0]' in report_html(tree_of(provenance(), modes=modes))


@pytest.mark.parametrize(
    ("margin", "value", "label", "note"),
    [
        (
            0.2,
            "6\u202f546.5 rpm",
            "EO 2 meets ND 2, mode 1 (+9.1 %)",
            "3 near resonances within 20 % of 6\u202f000 rpm, EO 4 meets ND 4, mode 2 (−11 %), EO 5 meets ND 3, mode 3 (−14 %)",
        ),
        (0.1, "6\u202f546.5 rpm", "EO 2 meets ND 2, mode 1 (+9.1 %)", "1 near resonance within 10 % of 6\u202f000 rpm"),
        (
            0.02,
            "No",
            "near resonance within 2 % of 6\u202f000 rpm",
            "the nearest: EO 2 meets ND 2, mode 1 (+9.1 %) at 6\u202f546.54 rpm",
        ),
    ],
)
def test_the_answer_of_a_safe_diagram_names_order_wave_mode_and_margin(
    margin: float, value: str, label: str, note: str
) -> None:
    (card,) = _cards(view(Interference, safe_result(margin)))
    assert (card.value, card.label, card.note) == (value, label, note)


def test_cases_that_are_alike_are_drawn_once() -> None:
    data = modes_result()
    two = xr.concat([data, data], "case")
    two["case_label"] = "case", ["force = 1", "force = 2"]
    html = report_html(tree_of(provenance(), modes=two))
    assert html.count('<figure id="fig-diameters') == 1
    assert "The same in all 2 cases." in html
    assert "<div data-case" not in html


@needs_browser
def test_choosing_a_case_shows_its_chapter(browser: Browser, tmp_path: Path) -> None:
    data = modes_result()
    two = xr.concat([data, data.assign(frequency_hz=2 * data["frequency_hz"])], "case")
    two["case_label"] = "case", ["span = 1", "span = 2"]
    write_result(tree_of(provenance(), modes=two), tmp_path / "result.nc")
    probe = """<script>document.querySelector('.chooser button[data-case="1"]').click();</script>"""
    opened = open_page(browser, report_file(tmp_path), tmp_path, probe)
    assert opened.errors == []
    assert '<div data-case="0" hidden' in opened.dom
    assert marks(opened.figure("diameters_1")) > 10


@needs_browser
def test_a_narrow_screen_shows_the_whole_wheel_and_upright_numbers(browser: Browser, folder: Path) -> None:
    browser.width(400)
    browser.open(folder / "report.html")
    drawn = "document.getElementById('plot-shapes')._fullLayout"
    assert browser.until(f"{drawn}.scene.domain.y[0] > 0 && document.body.dataset.shapes")
    size = f"(({drawn}._size.w) / ({drawn}._size.h * (1 - {drawn}.scene.domain.y[0])))"
    # at 2.2 the wheel fills a square
    assert browser.until(f"{drawn}.scene.aspectratio.x <= 2.2 * Math.min(1, {size}) + 1e-6")
    assert browser.run("document.getElementById('plot-shapes').data[0].colorbar.orientation") == "h"
    assert browser.run("document.getElementById('plot-shapes').data[0].showscale") is True
    angles = (
        "['diameters', 'safe', 'campbell'].map(k => document.getElementById(`plot-${k}`)._fullLayout.xaxis.tickangle)"
    )
    assert browser.run(angles) == [0, 0, 0]
    assert browser.run("document.documentElement.scrollWidth") <= 400
    browser.width(1200)


def test_every_line_of_a_campbell_diagram_can_be_told_without_colours() -> None:
    plot = campbell_diagram(view(Campbell, campbell_result()))
    lines = [t for t in plot.figure.data if t.mode == "lines+markers+text"]
    labels = [[text for text in line.text if text] for line in lines]
    assert labels == [[f"ND {k}: {m}"] for k in (2, 3) for m in (1, 2, 3)]
    symbols = {line.name: line.marker.symbol for line in lines}
    assert len(set(symbols.values())) == 2
    # labels at one speed stand apart by the height of a letter at least
    top = max(max(line.y) for line in lines)
    at = [(i, line.y[i], line.textposition) for line in lines for i, t in enumerate(line.text) if t]
    heights = [(i, y + 0.02 * top * (1 if "top" in place else -1)) for i, y, place in at]
    for n, (i, one) in enumerate(heights):
        assert all(i != j or abs(one - other) > 0.04 * top for j, other in heights[:n])


def test_lines_of_waves_that_coincide_share_a_label() -> None:
    data = campbell_result()
    close = data["frequency_hz"].values.copy()
    close[0, 1, :, 1] = close[0, 0, :, 1] * 1.001
    found = campbell_diagram(view(Campbell, data.assign(frequency_hz=(data["frequency_hz"].dims, close)))).figure
    lines = [t for t in found.data if t.mode == "lines+markers+text"]
    texts = [[text for text in line.text if text] for line in lines]
    assert texts == [["ND 2: 1"], ["ND 2, 3: 2"], ["ND 2: 3"], ["ND 3: 1"], [], ["ND 3: 3"]]


def test_orders_that_leave_the_picture_or_the_modes_are_named() -> None:
    data = campbell_result()
    orders = variable("case unfollowed", [[6]]), variable("case unfollowed", [[4321.0]])
    data = data.assign(unfollowed_engine_order=orders[0], unfollowed_from_rpm=orders[1])
    highest = float(data.frequency_hz.max())
    hidden = [m for m in (2, 3, 5, 6) if m * 200.0 > 1.06 * highest]  # at 12000 rpm
    assert hidden
    plot = campbell_diagram(view(Campbell, data))
    assert f"the lines of {', '.join(f'EO {m}' for m in hidden)}." in plot.caption
    assert "EO 6 from 4321 rpm" in plot.caption


def test_orders_that_are_not_judged_are_crossed_out() -> None:
    data = safe_result(0.1)
    data["pair_judged"] = (data.pair_engine_order != 12).astype(int)
    data["pair_resonance_rpm"] = variable("case pair", np.full((1, data.sizes["pair"]), np.inf), "rpm")
    result = view(Interference, data)
    plot = safe_diagram(result)
    orders = next(t for t in plot.figure.data if t.name == "engine orders asked")
    crossed = [t.strip() for t, s in zip(orders.text, orders.marker.symbol, strict=True) if "x" in s]
    assert crossed == ["EO 12"]
    assert "EO 12, above the highest computed mode" in plot.caption
    table = interference(result)
    said = [row[-1] for row in table.rows]
    assert said.count("order not judged") == 3 - int(
        (data.pair_near.values * (data.pair_engine_order.values == 12)).sum()
    )
    assert "never" in {cell for row in table.rows for cell in row}


@pytest.mark.parametrize("sectors", [8, 9])
def test_zigzag_passes_through_every_engine_order(sectors: int) -> None:
    diameters, hertz = zigzag(25 * 100.0, sectors, 100.0)
    for order in range(25):
        folded = min(order % sectors, -order % sectors)
        assert np.interp(order * 100.0, hertz, diameters) == pytest.approx(folded, abs=1e-12)


def test_coarse_skin_keeps_points_area_and_no_more_than_asked() -> None:
    points, triangles = skin(40)
    kept, faces = coarse_skin(points, triangles, 200)
    assert 60 < len(kept) <= 200
    assert faces.max() < len(kept)
    assert len(np.unique(np.sort(faces, axis=1), axis=0)) == len(faces)

    def area(p: np.ndarray, t: np.ndarray) -> float:
        a, b, c = (p[t[:, i]] for i in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    # a flat skin keeps its area but for the rim, which moves inward by up to half a cell
    assert area(points[kept], faces) == pytest.approx(area(points, triangles), rel=0.2)
    same, untouched = coarse_skin(points, triangles, 10_000)
    np.testing.assert_array_equal(same[untouched], triangles)


def test_shapes_turn_about_the_axis_of_the_model() -> None:
    data = modes_result()
    data["axis_origin"] = variable("case xyz", [[0.1, -0.2, 0.0]], "m")
    html = report_html(tree_of(modes=data))
    assert '"origin":[100.0,-200.0,0.0]' in html.replace("&#34;", '"').replace(": ", ":").replace(", ", ",")
