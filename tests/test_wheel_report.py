"""The page of bladed disks: opened in a browser, checked against the data, and tried on results that lack parts."""

import json
from pathlib import Path

import numpy as np
import pytest
from synthetic_wheel import (
    SECTORS,
    campbell_result,
    modes_result,
    safe_result,
    skin,
    variable,
    write_results,
)
from test_report import marks, needs_browser, open_page, page_text

from stickslip.errors import InputError
from stickslip.report.coarse_skin import coarse_skin
from stickslip.report.figure_campbell import campbell_diagram
from stickslip.report.figure_diameters import safe_diagram, zigzag
from stickslip.report.figure_shapes import mode_shapes
from stickslip.report.wheel_page import write_wheel_report
from stickslip.report.wheel_result import load_wheel
from stickslip.report.wheel_tables import interference


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = write_results(
        tmp_path_factory.mktemp("wheel"), modes_result(), campbell_result(), safe_result(0.1)
    )
    write_wheel_report(made, made / "report.html")
    return made


# chooses ND 2, mode 1, phase 90 degrees on the whole wheel, and tells where the drawn points are
PROBE = """<script>
const form = document.getElementById("shapes-form");
form.elements.wave.value = "2";
form.elements.phase.value = "90";
form.dispatchEvent(new Event("input"));
setTimeout(() => {
  const trace = document.getElementById("plot-shapes").data[0];
  document.body.dataset.z = JSON.stringify(Array.from(trace.z));
  document.body.dataset.x = JSON.stringify(Array.from(trace.x));
  document.body.dataset.y = JSON.stringify(Array.from(trace.y));
  document.body.dataset.title = document.getElementById("plot-shapes").layout.title.text;
}, 3000);
</script>"""


@needs_browser
def test_page_draws_every_figure_and_the_wheel_moves_as_the_wave_says(
    folder: Path, tmp_path: Path
) -> None:
    opened = open_page(folder / "report.html", tmp_path, PROBE)
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
    text = page_text(folder / "report.html")
    found = safe_result(0.1)
    near = int(found.pair_near.sum())
    assert near > 0
    assert f"{near} mode{'s' if near > 1 else ''} within 10 % of an engine order" in text
    crossings = campbell_result().sizes["crossing"]
    assert f"{crossings} crossings marked" in text
    assert "14 frequencies compared" in text
    assert "mass of the wheel2 kg" in text


def test_results_of_another_model_are_left_out(tmp_path: Path) -> None:
    other = campbell_result().assign_attrs(model_hash="b")
    folder = write_results(tmp_path, other, modes_result())
    assert list(load_wheel(folder)) == ["modes"]
    assert list(load_wheel(folder / "campbell.nc")) == ["campbell"]


def test_what_is_no_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no result of a bladed disk"):
        load_wheel(tmp_path)
    write_results(tmp_path, modes_result().drop_vars("frequency_hz"))
    with pytest.raises(InputError, match=r"modes\.nc: variables frequency_hz are missing"):
        load_wheel(tmp_path)
    (tmp_path / "modes.nc").write_text("no netCDF")
    with pytest.raises(InputError, match="not a netCDF-4 file"):
        load_wheel(tmp_path)


def test_modes_without_shapes_say_so(tmp_path: Path) -> None:
    folder = write_results(tmp_path, modes_result().drop_vars("shape"))
    plot = mode_shapes(load_wheel(folder)["modes"])
    assert plot.figure is None
    assert "holds no mode shapes" in plot.caption


def test_every_line_of_a_campbell_diagram_can_be_told_without_colours(tmp_path: Path) -> None:
    folder = write_results(tmp_path, campbell_result())
    plot = campbell_diagram(load_wheel(folder)["campbell"])
    assert plot.figure is not None
    lines = [t for t in plot.figure.data if t.mode == "lines+markers+text"]
    labels = [[text for text in line.text if text] for line in lines]
    assert labels == [[f"ND {k}, {m}"] for k in (2, 3) for m in (1, 2, 3)]
    symbols = {line.name: line.marker.symbol for line in lines}
    assert len(set(symbols.values())) == 2
    # labels at one speed stand apart by the height of a letter at least
    top = max(max(line.y) for line in lines)
    at = [(i, line.y[i], line.textposition) for line in lines for i, t in enumerate(line.text) if t]
    heights = [(i, y + 0.02 * top * (1 if "top" in place else -1)) for i, y, place in at]
    for n, (i, one) in enumerate(heights):
        assert all(i != j or abs(one - other) > 0.04 * top for j, other in heights[:n])


def test_orders_that_leave_the_picture_or_the_modes_are_named(tmp_path: Path) -> None:
    data = campbell_result()
    orders = variable("unfollowed", [6]), variable("unfollowed", [4321.0])
    data = data.assign(unfollowed_engine_order=orders[0], unfollowed_from_rpm=orders[1])
    highest = float(data.frequency_hz.max())
    hidden = [m for m in (2, 3, 5, 6) if m * 200.0 > 1.06 * highest]  # at 12000 rpm
    assert hidden
    plot = campbell_diagram(load_wheel(write_results(tmp_path, data))["campbell"])
    assert f"the lines of {', '.join(f'EO {m}' for m in hidden)}." in plot.caption
    assert "EO 6 from 4321 rpm" in plot.caption


def test_orders_that_are_not_judged_are_crossed_out(tmp_path: Path) -> None:
    data = safe_result(0.1)
    data["pair_judged"] = (data.pair_engine_order != 12).astype(int)
    data["pair_resonance_rpm"] = variable("pair", np.full(data.sizes["pair"], np.inf), "rpm")
    result = load_wheel(write_results(tmp_path, data))["safe"]
    plot = safe_diagram(result)
    assert plot.figure is not None
    orders = next(t for t in plot.figure.data if t.name == "engine orders asked")
    crossed = [
        t.strip() for t, s in zip(orders.text, orders.marker.symbol, strict=True) if "x" in s
    ]
    assert crossed == ["EO 12"]
    assert "EO 12, above the highest computed mode" in plot.caption
    table = interference(result)
    assert table.count("order not judged") == 3 - int(
        (data.pair_near.values * (data.pair_engine_order.values == 12)).sum()
    )
    assert "never" in table


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
