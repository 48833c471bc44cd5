"""Studies of many cases on the page: families of cases, panels, a map of all peaks, parallel axes, an idle damper."""

import re
from itertools import product

import numpy as np
import pytest
import xarray as xr
from synthetic_result import synthetic_result, tree_of

import stickslip as ss
from stickslip.analyses.forced_response.page.at_peak.bodies import energy
from stickslip.analyses.forced_response.page.chapter import cards
from stickslip.analyses.forced_response.page.curves import frequency_response
from stickslip.analyses.forced_response.page.many_cases import FEW, MOST_IN_PANELS, extremes, panels
from stickslip.analyses.forced_response.page.optimisation import optimisation
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.verdicts import working_range
from stickslip.analyses.forced_response.verdicts.working_range import WorkingRange
from stickslip.report.cases import cases_of, families_of
from stickslip.report.paper.figure import draw
from stickslip.report.section import Words
from stickslip.study.coordinates import families
from stickslip.study.file.case_names import Naming, shortened, without_common_words

FORCE, MASS, MU = "load.shaker.force_n", "part.damper.mass_kg", "contact.flat.friction_coefficient"


def study(vary: dict[str, list[float]], labels: list[str]) -> xr.Dataset:
    """A response with these cases; the amplitudes of case k are those of a ratio of its own."""
    n = len(labels)
    ratios = np.geomspace(200, 2, n)
    data = synthetic_result(ratios=tuple(ratios), n=12, verify=False)
    rows = xr.Variable(("case", "vary"), np.array([[v[k] for v in vary.values()] for k in range(n)]))
    data = data.drop_vars(["vary", "vary_value"]).assign_coords(vary=list(vary))
    return data.assign(vary_value=rows, case_label=("case", labels))


def grid(forces: int, masses: int, frictions: int = 1) -> xr.Dataset:
    every = list(product(range(1, forces + 1), range(1, masses + 1), range(1, frictions + 1)))
    labels = [f"force {f} N, mass {m} kg" + f", mu 0.{u}" * (frictions > 1) for f, m, u in every]
    columns = dict(zip((FORCE, MASS, MU), (list(map(float, c)) for c in zip(*every, strict=True)), strict=True))
    columns[MU] = [u / 10 for u in columns[MU]]
    if frictions == 1:
        del columns[MU]
    return study(columns, labels)


def test_keys_that_run_together_make_one_curve_under_the_names_of_the_others() -> None:
    """A damper of four masses, each with its own pull, at two friction coefficients: the pull says nothing of its own."""
    every = list(product((5, 10, 20, 40), (0.3, 0.5)))
    vary = {
        MASS: [m / 1000 for m, _ in every],
        "load.pull.force_n": [34.6 * m for m, _ in every],
        "contact.left.friction_coefficient": [u for _, u in every],
        "contact.right.friction_coefficient": [u for _, u in every],
    }
    data = study(vary, [f"{m} g, mu {u}" for m, u in every])
    assert families(data, MASS) == {"mu 0.3": [0, 2, 4, 6], "mu 0.5": [1, 3, 5, 7]}
    plot = optimisation(Response(data))
    assert plot is not None
    assert [len(trace.x) for trace in plot.figure.data] == [4, 4, 4, 4]
    assert [trace.name for trace in plot.figure.data if trace.showlegend] == ["mu 0.3", "mu 0.5"]
    assert plot.figure.layout.xaxis2.title.text == "mass (g)"


def test_a_key_that_rises_and_falls_beside_another_does_not_run_with_it() -> None:
    data = study({FORCE: [1.0, 2.0, 3.0], MASS: [1.0, 5.0, 2.0]}, ["a", "b", "c"])
    assert families(data, FORCE) == {"a": [0], "b": [1], "c": [2]}
    data = study({FORCE: [1.0, 2.0, 3.0], MASS: [5.0, 2.0, 1.0]}, ["a", "b", "c"])
    assert families(data, FORCE) == {"": [0, 1, 2]}


def test_names_that_do_not_tell_families_apart_give_way_to_keys() -> None:
    every = list(product((1.0, 2.0), (3.0, 4.0)))
    data = study({FORCE: [f for f, _ in every], MASS: [m for _, m in every]}, ["one", "two", "three", "four"])
    assert families(data, FORCE) == {f"{MASS} = 3": [0, 2], f"{MASS} = 4": [1, 3]}


@pytest.mark.parametrize(
    ("names", "title", "short"),
    [
        (["force 1 N, mu 0.3", "force 2 N, mu 0.3"], "force", ["1 N, mu 0.3", "2 N, mu 0.3"]),
        (["slip limit 1 N, k 2 N", "slip limit 3 N, k 4 N"], "slip limit, k", ["1 N, 2 N", "3 N, 4 N"]),
        (["10 g, mu 0.3", "20 g, mu 0.5"], "mu", ["10 g, 0.3", "20 g, 0.5"]),
        (["light", "heavy"], "", ["light", "heavy"]),
        (["a, b", "c"], "", ["a, b", "c"]),
        (["force 1 N"], "", ["force 1 N"]),
        (["a.b = 1", "a.b = 2"], "", ["a.b = 1", "a.b = 2"]),
    ],
)
def test_what_names_have_in_common_becomes_the_title_of_their_axis(
    names: list[str], title: str, short: list[str]
) -> None:
    assert without_common_words(names) == (title, short)


def test_long_names_in_a_column_lose_what_they_have_in_common_and_short_ones_nothing() -> None:
    long = [f"tangential stiffness {k} N/mm, force {f} N" for k in (20, 50) for f in (2, 5)]
    assert shortened(long) == (
        "tangential stiffness, force",
        ["20 N/mm, 2 N", "20 N/mm, 5 N", "50 N/mm, 2 N", "50 N/mm, 5 N"],
    )
    assert shortened(["force 2 N", "force 5 N"]) == ("case", ["force 2 N", "force 5 N"])
    assert shortened([]) == ("case", [])


def test_every_case_stands_in_one_family_and_the_families_are_sorted_by_value() -> None:
    data = grid(4, 3, 2)
    found = families_of(data, FORCE, cases_of(data))
    assert sorted(c.index for own in found.values() for c in own) == list(range(24))
    assert all(np.all(np.diff([c.value for c in own]) > 0) for own in found.values())


@pytest.mark.parametrize(("forces", "masses"), [(3, 2), (5, 4), (20, 1), (2, 12)])
def test_panels_hold_each_case_once_and_no_more_than_a_legend_tells_apart(forces: int, masses: int) -> None:
    response = Response(grid(forces, masses))
    found = panels(response)
    assert sorted(c.index for p in found for c in p.cases) == list(range(forces * masses))
    assert max(len(p.cases) for p in found) <= FEW
    colours = {(name, c.colour) for p in found for c, name in zip(p.cases, p.names, strict=True)}
    assert len(colours) == len({name for name, _ in colours})  # one colour a name
    plot = frequency_response(response)
    assert plot is not None
    for p in found:  # the curve of each case, in the panel with its title
        for c, name in zip(p.cases, p.names, strict=True):
            own = response.accepted[response.points(c)] * response.scale.factor
            lines = [t for t in plot.figure.data if t.name == name and t.y is not None and len(t.y) == own.size]
            assert any(np.array_equal(t.y, own, equal_nan=True) for t in lines)
    assert len({t.xaxis or "x" for t in plot.figure.data}) == len(found)


def test_cases_without_a_common_value_share_panels_in_their_order() -> None:
    laws = [f"law {k}" for k in "abcdefghij"]
    data = synthetic_result(ratios=tuple(np.geomspace(200, 2, 10)), n=12, verify=False).drop_vars(
        ["vary", "vary_value"]
    )
    values = xr.Variable(("case", "vary"), np.array(laws, dtype=object)[:, None])
    data = data.assign_coords(vary=["contact.flat.law"]).assign(vary_value=values, case_label=("case", laws))
    found = panels(Response(data))
    assert [p.title for p in found] == ["law a to law e", "law f to law j"]
    assert [c.index for p in found for c in p.cases] == list(range(10))


def test_of_more_cases_three_are_named_and_all_are_drawn() -> None:
    response = Response(grid(4, 10))
    assert len(response.cases) > MOST_IN_PANELS
    assert panels(response) == ()
    chosen = extremes(response)
    peaks = [response.peak_response(c) for c in response.peaked]
    assert [response.peak_response(c) for c in chosen] == [min(peaks), sorted(peaks)[20], max(peaks)]
    plot = frequency_response(response)
    assert plot is not None
    assert "37 other cases" in [t.name for t in plot.figure.data]
    drawn = plot.figure.data[0]
    assert np.isnan(drawn.y).sum() - np.isnan(response.accepted).sum() >= 37  # a gap after each


def test_the_map_of_all_peaks_shows_them_in_their_rows_and_frames_the_smallest() -> None:
    data = grid(5, 4, 3)
    data["case_verdict"] = "case", [1, *[0] * 59]
    response = Response(data)
    plot = optimisation(response)
    assert plot is not None
    (cells,) = plot.figure.data
    rows, columns = list(cells.y), list(cells.x)
    assert len(rows) == 12
    assert columns == ["1", "2", "3", "4", "5"]
    assert plot.figure.layout.yaxis.title.text == "mass, mu"
    assert not cells.showscale  # the numbers stand in the cells
    for case in response.cases:
        force, mass, mu = case.label.split(", ")
        row = f"{mass.removeprefix('mass ')}, {mu.removeprefix('mu ')}"
        shown = cells.z[rows.index(row)][columns.index(force.split()[1])]
        assert 10.0**shown == pytest.approx(response.peak_response(case) * response.scale.factor, rel=1e-9)
    assert [text for row in cells.text for text in row if text.endswith("?")] == [cells.text[0][0]]
    (frame,) = plot.figure.layout.shapes
    best = np.unravel_index(np.argmin(np.asarray(cells.z)), (12, 5))
    assert (frame.y0 + 0.5, frame.x0 + 0.5) == best
    pytest.importorskip("matplotlib")
    draw(plot.figure, "optimisation")


def test_cases_without_common_values_stand_on_parallel_axes() -> None:
    random = np.random.default_rng(3)
    vary = {FORCE: random.uniform(1, 5, 40).tolist(), MASS: random.uniform(1, 5, 40).tolist()}
    response = Response(study(vary, [f"case {k}" for k in range(40)]))
    plot = optimisation(response)
    assert plot is not None
    (lines,) = plot.figure.data
    assert [axis.label for axis in lines.dimensions] == ["force (N)", "mass (kg)", "peak (µm/N)", "at (Hz)"]
    assert np.allclose(lines.dimensions[3].values, [response.peak_hz(c) for c in response.cases])


def test_designs_of_many_curves_are_compared_by_a_map_of_differences() -> None:
    first, second = grid(3, 10), grid(3, 10)
    factor = np.linspace(0.9, 1.2, 30)[first["point_case"].values]
    second["amplitude"] = second["amplitude"] * xr.DataArray(factor, dims="point")
    found = ss.compare(*(ss.Result(tree_of(forced_response=d)) for d in (first, second)), names=("a", "b"))
    (cells,) = found.plot("compared_optimisation").data
    off = np.array([[cells.z[m][f] for m in range(10)] for f in range(3)]).ravel()  # in the order of the study
    np.testing.assert_allclose(off, 100 * (np.linspace(0.9, 1.2, 30) - 1), atol=1e-9)


def test_the_answer_has_the_value_that_is_best_in_the_worst_of_all_curves() -> None:
    data = grid(5, 3)
    response = Response(data)
    peaks = np.array([response.peak_response(c) for c in response.cases]).reshape(5, 3)
    worst = peaks.max(axis=1)
    best, over = int(worst.argmin()), 100 * (worst.min() / peaks.min() - 1)
    note = cards(response)[0].note
    told = re.search(r"In the worst of 3 curves force (\d) N is best: [^,]+(?:, [a-z ]+)?, ([\d.]+) % above", note)
    assert told is not None
    assert int(told[1]) == best + 1
    assert float(told[2]) == pytest.approx(over, rel=0.01)
    assert "In the worst of" not in cards(Response(grid(5, 1)))[0].note


def test_the_answer_says_where_friction_does_nothing_and_where_no_case_differs() -> None:
    data = grid(3, 1)
    assert "dissipates nothing" not in cards(Response(data))[0].note
    still = data.assign(dissipated_energy=data["dissipated_energy"] * 0, amplitude=data["amplitude"] * 0 + 1e-6)
    told = cards(Response(still))[0]
    assert "Friction dissipates nothing at any peak" in told.note
    assert "Next: raise load.NAME.force_n, or press the contacts less" in told.note
    assert isinstance(energy(Response(still)), Words)  # no empty axes


def test_the_keys_of_a_single_curve_stand_in_one_row_and_name_no_curve() -> None:
    """Groups of keys stand one below the other, so that the figure ended below the first 900 px of a narrow screen."""
    alone = frequency_response(Response(synthetic_result(ratios=(5,), n=12, verify=False)))
    assert alone is not None
    keys = [trace for trace in alone.figure.data if trace.showlegend is not False]
    assert "response" not in [trace.name for trace in keys]
    assert "H = 1" in [trace.name for trace in keys]
    assert not any(trace.legendgroup or trace.legendgrouptitle.text for trace in keys)
    assert alone.figure.layout.legend.traceorder == "normal"
    several = frequency_response(Response(synthetic_result(ratios=(20, 5), n=12, verify=False)))
    assert several is not None
    assert {trace.legendgroup for trace in several.figure.data} >= {"cases", "key"}


def test_curves_of_which_the_same_is_told_share_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"limit {limit} N, gap {gap} mm" for limit in (1, 2) for gap in (3, 4)]
    curves = tuple(
        WorkingRange((), (), Naming("force" if "limit 1" in name else "mass", ""), others=name) for name in names
    )
    monkeypatch.setattr(working_range, "working_ranges", lambda _: curves)
    lines = working_range.range_lines(xr.Dataset())
    assert lines == (
        "gap 3 mm, 4 mm, each with limit 1 N: cannot be told from these values of force",
        "gap 3 mm, 4 mm, each with limit 2 N: cannot be told from these values of mass",
    )
