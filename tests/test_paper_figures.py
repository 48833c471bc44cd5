"""Figures for papers: what matplotlib draws of a figure of the page, and the files of `stickslip figure`."""

import re
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import plotly.graph_objects as go
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from plotly.subplots import make_subplots
from synthetic_result import provenance, synthetic_result, tree_of, write_result
from synthetic_wheel import campbell_result, modes_result, safe_result
from typer.testing import CliRunner

from stickslip import Result
from stickslip.cli import app
from stickslip.errors import InputError, StickslipError
from stickslip.report.paper.figure import STYLE, draw, inches, on_paper, write_figure
from stickslip.report.paper.looks import worded

COLUMN = 85 / 25.4  # inches
SOLIDS = {"shapes", "mesh"}


@pytest.fixture(scope="module")
def result() -> Result:
    nodes = {"modes": modes_result(), "campbell": campbell_result(), "safe": safe_result(0.1)}
    return Result(tree_of(provenance(), forced_response=synthetic_result(ratios=(20, 5, 2), n=24), **nodes))


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    tree = tree_of(provenance(), forced_response=synthetic_result(ratios=(5,), n=12))
    return write_result(tree, tmp_path_factory.mktemp("run") / "result.nc")


def test_every_flat_figure_fits_on_a_column(result: Result) -> None:
    flat = [name for name in result.plots if on_paper(result.plot(name))]
    assert set(result.plots) - set(flat) == SOLIDS
    with mpl.rc_context(STYLE):
        for name in flat:
            drawn = draw(result.plot(name), name, width=COLUMN)
            drawn.draw_without_rendering()
            width, height = drawn.get_size_inches()
            box = drawn.get_tightbbox()
            assert width == pytest.approx(COLUMN), name
            # a tick label that stands out half a letter is within the tolerance; a title cut off is not
            assert box.x0 >= -0.03, name
            assert box.x1 <= width + 0.08, name
            assert box.y0 >= -0.03, name
            assert box.y1 <= height + 0.08, name


def test_numbers_scales_and_titles_are_those_of_the_page(result: Result) -> None:
    page, drawn = result.plot("response"), result.plot("response", backend="matplotlib")
    assert isinstance(drawn, Figure)
    (axes,) = drawn.axes
    curves = [trace for trace in page.data if trace.mode == "lines+markers" and trace.visible is not False]
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) > 1]
    assert len(lines) == len(curves) == 3
    for line, trace in zip(lines, curves, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), np.asarray(trace.x, dtype=float))
        np.testing.assert_array_equal(line.get_ydata(), np.asarray(trace.y, dtype=float))
    assert axes.get_yscale() == page.layout.yaxis.type == "log"
    assert axes.get_xlabel() == page.layout.xaxis.title.text
    assert axes.get_ylabel() == page.layout.yaxis.title.text


def test_lines_markers_and_marks_keep_their_look() -> None:
    page = go.Figure()
    page.add_scatter(x=[1, 2, 4], y=[1, 10, 100], name="stable", mode="lines", line={"color": "#0072b2", "width": 4})
    page.add_scatter(x=[1, 2, 4], y=[2, None, 50], name="unstable", mode="lines", line={"dash": "dash"})
    page.add_scatter(x=[2], y=[3], name="fold", mode="markers", marker={"symbol": "diamond-open", "color": "red"})
    page.add_scatter(x=[2], y=[9], name="hidden", mode="markers", visible=False)
    page.add_hline(y=5.0, line={"dash": "dot", "color": "black"})
    page.update_yaxes(type="log", range=[0, 3], title_text="a<sub>t</sub> &lt; b<br>(µm)")
    axes = draw(page, "own").axes[0]
    stable, unstable, fold, limit = axes.get_lines()
    assert (stable.get_linestyle(), unstable.get_linestyle(), limit.get_linestyle()) == ("-", "--", ":")
    assert stable.get_linewidth() == 2 * unstable.get_linewidth() == 2 * mpl.rcParams["lines.linewidth"]
    assert stable.get_color() == to_rgba("#0072b2")
    assert np.isnan(unstable.get_ydata()[1])
    assert (fold.get_marker(), fold.get_markerfacecolor()) == ("D", "none")
    assert fold.get_markeredgecolor() == to_rgba("red")
    assert list(limit.get_ydata()) == [5.0, 5.0]
    assert axes.get_ylim() == (1.0, 1000.0)
    assert axes.get_ylabel() == worded("a<sub>t</sub> &lt; b<br>(µm)") == "a$_{\\mathrm{t}}$ < b\n(µm)"
    (legend,) = axes.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["stable", "unstable", "fold"]


def test_bars_maps_and_areas_keep_their_numbers() -> None:
    page = make_subplots(1, 3, subplot_titles=["bars", "map", "band"])
    page.add_bar(x=["a", "b"], y=[1, 2], row=1, col=1, name="one")
    page.add_bar(x=["a", "b"], y=[3, 4], row=1, col=1, name="two")
    page.update_layout(barmode="stack")
    page.add_heatmap(z=[[0, 1], [2, 0]], y=["L", "R"], row=1, col=2, showscale=False)
    page.add_scatter(x=[0, 1], y=[0, 1], row=1, col=3, mode="lines", showlegend=False)
    page.add_scatter(x=[0, 1], y=[2, 3], row=1, col=3, mode="lines", fill="tonexty", showlegend=False)
    bars, states, band = draw(page, "own", width=10).axes
    assert [axes.get_title() for axes in (bars, states, band)] == ["bars", "map", "band"]
    assert [(own.get_y(), own.get_height()) for own in bars.patches] == [(0, 1), (0, 2), (1, 3), (2, 4)]
    assert states.collections[0].get_array().ravel().tolist() == [0, 1, 2, 0]
    assert [text.get_text() for text in states.get_yticklabels()] == ["L", "R"]
    corners = band.patches[0].get_xy()[:4].tolist()
    assert corners == [[0, 2], [1, 3], [1, 1], [0, 0]]


def test_own_axes_are_drawn_in_and_returned(result: Result) -> None:
    axes = Figure().subplots(1, 2)
    assert result.plot("response", ax=axes[0]) is axes[0]
    assert axes[0].get_lines()
    assert not axes[1].get_lines()
    assert result.plot("optimisation", ax=axes) is axes
    assert axes[1].get_lines()
    with pytest.raises(InputError, match=r"has one pair of axes\. Give 2 pairs"):
        result.plot("optimisation", ax=axes[0])


def test_a_case_is_chosen_where_the_page_has_buttons(result: Result) -> None:
    first, last = (result.plot("loops_t", backend="matplotlib", case=case) for case in (0, 2))
    force = [own.axes[4].collections[0].get_offsets()[:, 1] for own in (first, last)]
    assert np.ptp(force[0]) != np.ptp(force[1])
    with pytest.raises(InputError, match=r"case: is 3. Give one of 0, 1, 2"):
        result.plot("loops_t", case=3)
    with pytest.raises(InputError, match="the figure shows all cases"):
        result.plot("response", case=1)


def test_solids_and_unknown_backends_are_refused_with_the_remedy(result: Result) -> None:
    with pytest.raises(InputError, match=r"three dimensions.*ParaView"):
        result.plot("mesh", backend="matplotlib")
    with pytest.raises(InputError, match="Give one of plotly, matplotlib"):
        result.plot("response", backend="bokeh")  # type: ignore[arg-type]


def test_a_missing_matplotlib_is_told_with_its_extra(result: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(StickslipError, match=re.escape("pip install 'stickslip[figure]'")):
        result.plot("response", backend="matplotlib")


def test_matplotlib_is_loaded_only_when_a_figure_is_drawn() -> None:
    code = "import sys, stickslip.api.result, stickslip.report.paper.figure; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_file_is_as_wide_as_asked_for_of_vectors_and_always_the_same(result: Result, tmp_path: Path) -> None:
    for name in ("one.pdf", "two.pdf"):
        write_figure(result.plot("response"), "response", tmp_path / name, "85mm")
    one, two = ((tmp_path / name).read_bytes() for name in ("one.pdf", "two.pdf"))
    assert one == two
    box = re.search(rb"/MediaBox \[ 0 0 ([0-9.]+)", one)
    assert box is not None
    assert float(box[1]) == pytest.approx(85 / 25.4 * 72, abs=0.01)
    assert b"/Subtype /Image" not in one
    write_figure(result.plot("response"), "response", tmp_path / "one.svg", "85mm")
    assert ">frequency (Hz)</text>" in (tmp_path / "one.svg").read_text(encoding="utf-8")


def test_a_style_of_the_user_goes_before_the_own(result: Result, tmp_path: Path) -> None:
    style = tmp_path / "own.mplstyle"
    style.write_text("font.size: 20\naxes.labelsize: 20\n", encoding="utf-8")
    write_figure(result.plot("safe"), "safe", tmp_path / "own.svg", "175mm", str(style))
    assert re.search(r"20px[^>]*>frequency \(Hz\)</text>", (tmp_path / "own.svg").read_text(encoding="utf-8"))
    with pytest.raises(InputError, match="style"):
        write_figure(result.plot("safe"), "safe", tmp_path / "own.svg", "175mm", "no such style")


@pytest.mark.parametrize(("given", "size"), [("25.4mm", 1.0), ("8.5 cm", 85 / 25.4), ("3in", 3.0), ("72.27pt", 1.0)])
def test_widths_of_journals(given: str, size: float) -> None:
    assert inches(given) == pytest.approx(size)


@pytest.mark.parametrize("given", ["85", "mm", "1.2.3mm", "3furlong", "2m", "1mm", "-85mm", ""])
def test_wrong_widths(given: str) -> None:
    with pytest.raises(InputError, match="such as 85mm"):
        inches(given)


def invoke(*words: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["figure", *words])
    return done.exit_code, done.output


def test_the_command_writes_a_figure_and_lists_the_names(file: Path, tmp_path: Path) -> None:
    target = tmp_path / "fig.pdf"
    assert invoke(str(file), "response", "--to", str(target), "--width", "85mm") == (0, f"{target} written\n")
    assert target.read_bytes().startswith(b"%PDF")
    code, told = invoke(str(file))
    assert code == 2
    assert "Figures: response, states, loops_t" in told
    assert "mesh" not in told
    code, told = invoke(str(file), "respons")
    assert code == 2
    assert "Did you mean 'response'?" in told
    code, told = invoke(str(file), "response", "--to", str(tmp_path / "fig.doc"))
    assert (code, ".pdf, .svg, .eps, .png" in told) == (2, True)
    code, told = invoke(str(file), "response", "--to", str(tmp_path / "none" / "fig.pdf"))
    assert (code, "cannot be written" in told) == (2, True)


def boxes(paper):
    """Return the extents of all visible labels of a figure."""
    paper.draw_without_rendering()
    renderer = paper.canvas.get_renderer()
    return [note.get_window_extent(renderer) for axes in paper.axes for note in axes.texts if note.get_visible()]


@pytest.mark.parametrize("apart", [400.0, 60.0, 10.0])
def test_labels_of_curves_do_not_overlap_on_narrow_paper(apart):
    """Nine lines with their names at the same speed, further and nearer than a label is high."""
    x = np.linspace(0.0, 6000.0, 5)
    figure = go.Figure()
    for k in range(9):
        own = {"text": [f"ND {k}: 1", "", "", "", ""], "textposition": "top right", "mode": "lines+markers+text"}
        figure.add_scatter(x=x, y=np.full(5, 500.0 + apart * k), name=f"ND {k}", **own)
    paper = draw(figure, "campbell", width=85 / 25.4)
    found = boxes(paper)
    assert len(found) == 9
    assert not any(a.overlaps(b) for i, a in enumerate(found) for b in found[:i])
    (axes,) = paper.axes
    inside = axes.get_window_extent()
    assert all(inside.x0 <= box.x0 and box.x1 <= inside.x1 for box in found)
    lines = [line.get_transform().transform(np.column_stack(line.get_data())) for line in axes.lines]
    crossed = sum(box.y0 < line[0, 1] < box.y1 for box in found for line in lines)
    assert crossed == 0 or apart < 400.0  # a label rather lies on a line than on another label


def test_texts_at_points_stand_where_the_page_puts_them_and_open_marks_are_drawn():
    figure = go.Figure()
    marks = {"symbol": ["square-open", "square-x-open"], "size": 8, "color": "#1c2530"}
    places = {"text": [" EO 1 ", " EO 2 "], "textposition": ["bottom right", "middle left"], "marker": marks}
    figure.add_scatter(x=[1.0, 2.0], y=[100.0, 200.0], mode="markers+text", **places)
    (axes,) = draw(figure, "safe", width=85 / 25.4).axes
    assert [(n.get_text(), n.get_ha(), n.get_va()) for n in axes.texts] == [
        ("EO 1", "left", "top"),
        ("EO 2", "right", "center"),
    ]
    assert all(one.get_linewidths()[0] > 0.5 for one in axes.collections)
