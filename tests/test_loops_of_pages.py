"""Loops on the page: the six that dissipate most, the others folded away, means out of the picture."""

import numpy as np
import pytest
import xarray as xr
from synthetic_result import provenance, synthetic_result, tree_of

from stickslip.analyses.forced_response.page.chapter import peaks
from stickslip.analyses.forced_response.page.contacts import SHOWN_LOOPS, hysteresis_t
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.page import report_html


def of_ellipses(half_axes: list[float], mean: float = 0.0) -> xr.Dataset:
    """Return a result whose loops along t are ellipses of 1 µm and so many newtons, about a mean displacement in m."""
    data = synthetic_result(ratios=(20,), n=24)
    turn = 2 * np.pi * np.arange(data.sizes["sample"]) / data.sizes["sample"]
    gap, force = data["peak_gap"].values.copy(), data["peak_force"].values.copy()
    gap[:, :, 0], force[:, :, 0] = mean + 1e-6 * np.cos(turn), 0.0
    for k, size in enumerate(half_axes):
        force[:, k, 0] = size * np.sin(turn)
    dims = data["peak_gap"].dims
    return data.assign(peak_gap=(dims, gap), peak_force=(dims, force))


def test_the_six_widest_loops_are_shown_largest_first_and_the_others_folded() -> None:
    sizes = [3.0, 1.0, 8.0, 2.0, 7.0, 4.0, 6.0, 5.0]
    shown, others = hysteresis_t(Response(of_ellipses(sizes)))
    names = Response(of_ellipses(sizes)).labels("contact")
    titles = [a.text for a in shown.figure.layout.annotations]
    assert titles == [names[k] for k in (2, 4, 6, 7, 5, 0)]
    assert len(titles) == SHOWN_LOOPS
    assert [a.text for a in others.figure.layout.annotations][:2] == [names[3], names[1]]
    assert (shown.folded, others.key) == ("", "loops_t_others")
    html = report_html(tree_of(provenance(), forced_response=of_ellipses(sizes)))
    assert f"<details><summary>{others.folded}</summary>" in html


@pytest.mark.parametrize(("mean", "out"), [(0.0, False), (2e-6, False), (5e-6, True)])
def test_a_mean_that_leaves_nothing_of_a_loop_to_see_is_taken_out_and_told(mean: float, out: bool) -> None:
    (shown,) = hysteresis_t(Response(of_ellipses([1.0], mean)))
    assert ("about its mean" in shown.figure.layout.xaxis.title.text) is out
    assert ("mean is taken out" in shown.caption) is out
    x = np.asarray(shown.figure.data[0].x, dtype=float)[:-1]
    assert np.mean(x) == pytest.approx(0.0 if out else 1e6 * mean, abs=1e-6)  # single precision of 6 µm


def test_straight_lines_are_folded() -> None:
    data = of_ellipses([1.0])
    force = data["peak_force"].values.copy()
    force[:, 0, 0] = 1e6 * data["peak_gap"].values[:, 0, 0]
    (lines,) = hysteresis_t(Response(data.assign(peak_force=(data["peak_force"].dims, force))))
    assert lines.folded == "Hysteresis loops at the peak, direction t: straight lines"
    assert lines.key == "loops_t"


def test_a_response_over_speed_tells_its_peaks_in_rpm() -> None:
    data = synthetic_result(ratios=(20,), n=24)
    data = data.assign(speed_rpm=("point", 10.0 * data["frequency_hz"].values))
    view = Response(data)
    table, (case,) = peaks(view), view.cases
    at = list(table.head).index("at (rpm)")
    assert float(table.rows[0][at].replace("\u202f", "")) == pytest.approx(10 * view.peak_hz(case), abs=0.005)
