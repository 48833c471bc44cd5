"""Loops on the page: the six that dissipate most, the others folded away, means out of the picture; speeds and stability in its curves."""

import itertools
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr
from synthetic_result import provenance, synthetic_result, tree_of

from stickslip.analyses.forced_response.page.at_peak.contacts import SHOWN_LOOPS, hysteresis_t
from stickslip.analyses.forced_response.page.chapter import peaks
from stickslip.analyses.forced_response.page.curves import COMPARED, frequency_response, most
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import MOTION
from stickslip.analyses.page import report_html


class Case(NamedTuple):
    index: int


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


@pytest.mark.parametrize(
    "largest", [[0.1, 5.0, 1.0, 3.0, 2.0, 4.0, 0.5, 6.0], [np.nan, 5.0, np.nan, 1.0, 1.0, 1.0, 2.0, 0.0]]
)
def test_the_cases_with_the_largest_value_are_compared_in_their_order(largest: list[float]) -> None:
    """The value of a case is that of its largest point; a case with none has no place."""
    cases = [Case(k) for k in range(len(largest))]
    owner = np.repeat(np.arange(len(largest)), 3)
    size = (np.array(largest)[:, None] - [0.0, 0.05, 20.0]).ravel()
    size[::3], size[2::3] = size[2::3].copy(), size[::3].copy()
    found = most(SimpleNamespace(cases=cases, point_case=owner), size)
    known = sorted((k for k, value in enumerate(largest) if np.isfinite(value)), key=lambda k: largest[k])
    assert [case.index for case in found] == sorted(known[-COMPARED:])
    assert 0 < len(found) < len(largest)


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


@pytest.mark.parametrize(
    ("words", "kinds"),
    [
        (["stable"], []),
        (["stable", "unstable"], ["stable", "unstable"]),
        (["stable", "neutral", "not examined"], ["stable", "stability not known"]),
        (["undecided"], ["stability not known"]),
        (["stable", "unstable", "undecided"], ["stable", "unstable", "stability not known"]),
    ],
)
def test_curves_are_solid_dashed_or_thin_by_stability(words: list[str], kinds: list[str]) -> None:
    data = synthetic_result(ratios=(20,), n=24)
    count = data.sizes["point"]
    numbers = [MOTION[words[k * len(words) // count]] for k in range(count)]
    plot = frequency_response(Response(data.assign(motion_stability=("point", numbers))))
    assert plot is not None
    looks = {"stable": (1.8, "solid"), "unstable": (1.8, "dash"), "stability not known": (0.7, "solid")}
    keys = [t for t in plot.figure.data if t.name in looks]
    assert [t.name for t in keys] == kinds
    assert [(t.line.width, t.line.dash) for t in keys] == [looks[kind] for kind in kinds]
    drawn = [t for t in plot.figure.data if t.mode == "lines" and t.legendgroup == "cases"]
    assert [(t.line.width, t.line.dash) for t in drawn] == [looks[kind] for kind in kinds]
    n = numbers.count(MOTION["unstable"])
    assert (f" Dashed: {n} points whose motion is unstable" in plot.caption) == ("Dashed" in plot.caption) == bool(n)
    assert (" whose stability was not examined or not decided" in plot.caption) == ("stability not known" in kinds)
    (curve,) = [t for t in plot.figure.data if t.name == "response"]
    assert curve.mode == ("markers" if kinds else "lines+markers")
    # each step of the curve is drawn once
    order = np.argsort(data["frequency_hz"].values)
    steps = [(a, b) for t in drawn for a, b in zip(t.x[::3], t.x[1::3], strict=True)]
    at = data["frequency_hz"].values[order]
    assert sorted(steps) == (list(itertools.pairwise(at)) if kinds else [])
