"""Designs held against each other, in Python, by the command line, and against a CSV file."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_v2 import write_four_masses
from synthetic_result import KEY, synthetic_result, tree_of
from typer.testing import CliRunner

import stickslip as ss
from stickslip.analyses.compared.side_by_side import cards
from stickslip.api.comparison import Comparison
from stickslip.cli import app
from stickslip.report.quantities import column

STUDY = 'schema_version = 2\n[contact.flat]\nfriction_coefficient = {mu}\n[study]\ntitle = "{title}"\n'


def design(ratios: tuple[int, ...], factor: float, mu: float, title: str = "same") -> ss.Result:
    """Return a synthetic result whose amplitudes are scaled, and its study file."""
    data = synthetic_result(ratios=ratios, n=24)
    data["amplitude"] = factor * data["amplitude"]
    tree = tree_of(forced_response=data)
    tree.attrs["study_toml"] = STUDY.format(mu=mu, title=title)
    return ss.Result(tree)


@pytest.fixture(scope="module")
def pair() -> Comparison:
    return ss.compare(design((50, 5), 1.0, 0.6), design((50, 20), 1.2, 0.4), names=("a", "b"))


def test_peaks_are_held_against_the_first_design_case_by_case(pair: Comparison) -> None:
    cases = list(zip(pair.peaks["case"], pair.peaks["design"], strict=True))
    assert cases == [(f"{KEY} = 50", "a"), (f"{KEY} = 50", "b"), (f"{KEY} = 5", "a"), (f"{KEY} = 20", "b")]
    nan = np.nan
    np.testing.assert_allclose(pair.peaks["against the first (%)"], [nan, 20.0, nan, nan])
    np.testing.assert_allclose(pair.peaks["shift (Hz)"], [nan, 0.0, nan, nan])


def test_a_design_with_one_case_is_held_against_the_case_whose_values_its_study_has() -> None:
    one, varied = design((20,), 1.5, 0.6), design((50, 20), 1.0, 0.6)
    data = one.data["forced_response"].to_dataset().drop_vars(["vary", "vary_value"])
    data["case_label"] = ("case", [""])
    single = ss.Result(tree_of(forced_response=data))
    single.data.attrs["study_toml"] = "[load.shaker]\nratio = 20\n"
    found = ss.compare(varied, single, names=("varied", "one")).peaks
    assert found["case"].tolist() == [f"{KEY} = 50", f"{KEY} = 20", ""]
    np.testing.assert_allclose(found["against the first (%)"], [np.nan, np.nan, 50.0])
    single.data.attrs["study_toml"] = "[load.shaker]\nratio = 30\n"
    found = ss.compare(varied, single, names=("varied", "one")).peaks
    assert np.isnan(found["against the first (%)"]).all()
    found = ss.compare(single, varied, names=("one", "varied")).peaks
    # at ratio 50 the load is another one
    assert np.isfinite(found["against the first (%)"]).tolist() == [False, False, True]


def test_nonlinear_modes_are_drawn_over_each_other_and_told_in_one_table(tmp_path: Path) -> None:
    def mode(hz: float) -> ss.Result:
        along = ("case", "branch", "point")
        data = xr.Dataset(
            {
                "amplitude": (along, [[[1e-6, 1e-5, np.nan]]]),
                "frequency_hz": (along, [[[hz, 0.9 * hz, np.nan]]]),
                "damping_ratio": (along, [[[0.01, 0.05, np.nan]]]),
                "status": (along, [[[0, 0, -1]]]),
                "harmonics": (along, [[[3, 5, -1]]]),
                **{
                    name: (("case", "branch"), [[v]])
                    for name, v in {
                        "wave_number": -1,
                        "mode": 1,
                        "mode_frequency_hz": hz,
                        "mode_damping_ratio": 0.01,
                        "largest_damping_ratio": 0.05,
                        "largest_damping_amplitude": 1e-5,
                        "gross_slip_amplitude": np.nan,
                        "problem": "",
                        "end": "reached",
                    }.items()
                },
                "output": ("case", ["tip.x"]),
                "case_label": ("case", [""]),
            }
        )
        return ss.Result(tree_of(nonlinear_mode=data))

    found = ss.compare(mode(100.0), mode(80.0), names=("a", "b"))
    drawn = {t.name: np.asarray(t.y) for t in found.plot("compared_nonlinear_modes").data if t.showlegend}
    assert drawn["b, mode 1"].tolist() == [80.0, 72.0]
    percent = [t.y for t in found.plot("compared_nonlinear_modes").data if not t.showlegend]
    assert np.array(percent) == pytest.approx(np.full((2, 2), [1.0, 5.0]), rel=1e-14)
    page = found.report(tmp_path / "c.html").read_text(encoding="utf-8")
    assert page.count("reached") == 2


def test_numbers_that_are_written_otherwise_are_no_difference() -> None:
    studies = [design((5,), 1.0, 0.6) for _ in range(2)]
    for own, text in zip(studies, ("a = 2\nb = [1, 2.0]", "a = 2.0\nb = [1.0, 2]"), strict=True):
        own.data.attrs["study_toml"] = text
    assert len(ss.compare(*studies, names=("a", "b")).inputs) == 0


def test_rotations_have_their_unit_and_stand_against_no_displacements() -> None:
    own = design((5,), 1.0, 0.6)
    turned = ss.Result(own.data.copy(deep=True))
    data = turned.data["forced_response"].to_dataset()
    names = [str(n).replace(".x", ".rx") for n in data["output"].values]
    turned = ss.Result(tree_of(forced_response=data.assign_coords(output=names).assign_attrs(report_output=names[0])))
    assert "amplitude (rad/N)" in ss.compare(turned, turned, names=("a", "b")).peaks
    with pytest.raises(ss.InputError, match="are displacements and rotations"):
        ss.compare(own, turned, names=("a", "b"))


def test_only_what_differs_in_the_study_files_is_told(pair: Comparison) -> None:
    assert pair.inputs["key"].tolist() == ["contact.flat.friction_coefficient"]
    assert pair.inputs["a"].tolist() == ["0.6"]
    assert pair.inputs["b"].tolist() == ["0.4"]


def test_each_case_is_drawn_for_the_designs_that_have_it(pair: Comparison) -> None:
    figure = pair.plot("compared_responses")
    drawn = [(t.meta, t.name) for t in figure.data]
    assert drawn == [(0, "a"), (1, "a"), (2, "a"), (0, "b"), (1, "b"), (3, "b")]
    # the page opens on the case that both have
    assert [t.visible for t in figure.data] == [False, True, False, False, True, False]
    own, other = (np.asarray(figure.data[k].y, dtype=float) for k in (1, 4))
    np.testing.assert_allclose(other, 1.2 * own)
    assert "compared_optimisation" in pair.plots
    with pytest.raises(ss.InputError, match="is no figure of this comparison"):
        pair.plot("compared_response")


def test_many_curves_are_a_map_whose_colours_have_zero_in_their_middle() -> None:
    """Nine laws at two loads each: peaks against the first design, in percent, on a scale that is as long above as below."""
    keys = ["load.shaker.ratio", "contact.flat.law"]
    rows = [(ratio, f"law {k}") for k in range(9) for ratio in (20.0, 5.0)]

    def varied(factors: list[float]) -> ss.Result:
        data = synthetic_result(ratios=[ratio for ratio, _ in rows], n=12).drop_vars(["vary", "vary_value"])
        size = np.array(factors)
        data["amplitude"] = data["amplitude"] * size[data["point_case"].values][:, None]
        values = np.array(rows, dtype=object)
        labels = [f"{keys[0]} = {r:g}, {keys[1]} = {law}" for r, law in rows]
        data = data.assign(vary_value=(("case", "vary"), values), case_label=("case", labels))
        return ss.Result(tree_of(forced_response=data.assign_coords(vary=keys)))

    factors = [1.0, 0.9, 1.2, *[1.0] * 14, 0.7]
    found = ss.compare(varied([1.0] * 18), varied(factors), names=("a", "b"))
    (cells,) = found.plot("compared_optimisation").data
    assert (list(cells.x), list(cells.y)) == (["5", "20"], [f"{keys[1]} = law {k}" for k in range(9)])
    np.testing.assert_allclose(cells.z, 100.0 * (np.reshape(factors, (9, 2))[:, ::-1] - 1.0), atol=1e-9)
    assert (cells.zmin, cells.zmax) == pytest.approx((-30.0, 30.0))


def test_the_head_holds_best_against_best_and_names_each_case(pair: Comparison) -> None:
    head = cards(pair.designs, divided=True)
    labels = [card.label for card in head]
    assert labels == ["best peak of a", "best peak of b", f"peak of a at {KEY} = 50", f"peak of b at {KEY} = 50"]
    assert f"with {KEY} = 5;" in head[0].note
    assert f"with {KEY} = 20;" in head[1].note
    assert head[1].note.endswith("; loaded by 20 N, best peak of a by 80 N: not compared")
    assert head[3].note.endswith(f"; 20 % more than peak of a at {KEY} = 50")
    alike = ss.compare(design((50, 5), 1.0, 0.6), design((50, 5), 1.2, 0.4), names=("a", "b"))
    assert [card.label for card in cards(alike.designs, divided=True)] == labels[:2]


def test_peaks_under_different_loads_are_not_set_against_each_other(pair: Comparison) -> None:
    alike = cards(pair.designs, divided=True)[2:]
    assert "20 % more than" in alike[1].note
    designs = [design((50,), 1.0, 0.6), design((50,), 1.2, 0.6)]
    for own, load in zip(designs, (100.0, 5.0), strict=True):
        data = own.data["forced_response"].to_dataset()
        own.data["forced_response"] = data.assign(excitation_n=data["excitation_n"] * 0 + load)
    _, second = cards(ss.compare(*designs, names=("a", "b")).designs, divided=True)
    assert "than" not in second.note
    assert second.note.endswith("; loaded by 5 N, peak of a by 100 N: not compared")
    assert np.isnan(ss.compare(*designs, names=("a", "b")).peaks["against the first (%)"]).all()


def test_the_head_has_the_cost_where_harmonics_are_chosen_differently() -> None:
    designs = [design((50,), 1.0, 0.6), design((50,), 1.0, 0.6)]
    for own, selection, unknowns in zip(designs, ("always_high", "guarded_alert"), (900, 450), strict=True):
        data = own.data["forced_response"].to_dataset()
        data.attrs["selection"] = selection
        own.data["forced_response"] = data.assign(unknowns_solved=("case", [unknowns]))
    told = [card.note for card in cards(ss.compare(*designs, names=("a", "b")).designs, divided=True)]
    assert [note.rpartition("; ")[2] for note in told] == ["900 unknowns solved", "450 unknowns solved"]
    same = [card.note for card in cards(ss.compare(designs[0], designs[0], names=("a", "b")).designs, divided=True)]
    assert not any("unknowns" in note for note in same)
    assert not any("along the curve" in note for note in same)


def test_the_head_has_the_largest_difference_beside_the_cost() -> None:
    """A strategy that is right at the peak may be wrong elsewhere: the first design is what the others are held against."""
    designs = [design((50,), 1.0, 0.6), design((50,), 1.1, 0.6)]
    for own, selection in zip(designs, ("always_high", "guarded_alert"), strict=True):
        own.data["forced_response"] = own.data["forced_response"].to_dataset().assign_attrs(selection=selection)
    first, second = (card.note for card in cards(ss.compare(*designs, names=("a", "b")).designs, divided=True))
    assert "along the curve" not in first
    found = re.search(r"; along the curve up to ([\d.]+) % at ([\d.]+) Hz of its peak", second)
    assert found
    assert float(found[1]) == pytest.approx(10.0, abs=0.5)


def test_cases_are_paired_by_what_is_varied_whatever_their_names_are() -> None:
    one, other = design((50, 5), 1.0, 0.6), design((50, 5), 1.2, 0.6)
    data = other.data["forced_response"].to_dataset()
    data["case_label"] = "case", ["hard", "soft"]  # as another version, or [vary], names them
    other = ss.Result(tree_of(forced_response=data))
    found = ss.compare(one, other, names=("a", "b")).peaks
    np.testing.assert_allclose(found["against the first (%)"], [np.nan, 20.0, np.nan, 20.0])
    assert set(found["case"]) == {f"{KEY} = 50", f"{KEY} = 5"}


def test_unstable_points_have_a_mark_of_their_own() -> None:
    own = design((50, 10), 1.0, 0.4)
    data = own.data["forced_response"].to_dataset()
    levels = np.zeros(data.sizes["point"], dtype=np.int64)
    at = np.flatnonzero(data["point_case"].values == 1)[:3]
    levels[at] = 1, 2, 3
    judged = ss.Result(tree_of(forced_response=data.assign(verdict=("point", levels))))
    every = ss.compare(judged, own, names=("a", "b")).plot("compared_responses").data
    drawn = {symbol for trace in every if trace.name == "a" for symbol in trace.marker.symbol}
    assert drawn == {"circle", "circle-open", "x", "circle-open-dot"}


def test_a_curve_from_a_file_is_held_against_the_best_case(tmp_path: Path) -> None:
    one = design((50,), 1.0, 0.6)
    figure = ss.compare(one, one, names=("a", "b")).plot("compared_responses")
    hz = np.asarray(figure.data[0].x, dtype=float)
    response = one["forced_response"]
    force = float(response["excitation_n"][0])
    whole = np.asarray(response["amplitude"].isel(output=0).values)[np.argsort(response["frequency_hz"].values)]
    file = tmp_path / "rig.csv"
    lines = [f"{f},{1.1e6 * a / force}" for f, a in zip(np.sort(hz), whole, strict=True)]
    file.write_text("frequency_hz,amplitude_um_per_n\n" + "\n".join(lines))
    found = ss.compare(one, file, names=("a", "rig"))
    html = found.report(tmp_path / "c.html").read_text(encoding="utf-8")
    assert "Against other curves" in html
    assert f"<td>{100 / 1.1 - 100:.2f}".replace("-", "−") in html


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("frequency_hz,amplitude_um\n1,2\n2,-3\n", r"line 3: amplitude_um: is no amplitude"),
        ("hz,amplitude_um\n1,2\n", r"has no column frequency_hz"),
        ("frequency_hz,height\n1,2\n", r"has no column amplitude_m"),
        ("frequency_hz,amplitude_um\n1,0\n", r"amplitude_um: is zero everywhere"),
    ],
)
def test_a_bad_curve_is_refused_by_its_line(tmp_path: Path, text: str, match: str) -> None:
    file = tmp_path / "rig.csv"
    file.write_text(text)
    with pytest.raises(ss.InputError, match=match):
        ss.compare(design((5,), 1.0, 0.6), file)


def test_what_cannot_be_compared_is_refused(tmp_path: Path) -> None:
    one, file = design((5,), 1.0, 0.6), tmp_path / "rig.csv"
    file.write_text("frequency_hz,amplitude_um\n1,2\n")
    with pytest.raises(ss.InputError, match=r"has 0 results and 1 curves\. Give two results"):
        ss.compare(file)
    with pytest.raises(ss.InputError, match=r"are no 2 names that differ"):
        ss.compare(one, one, names=("a", "a"))
    with pytest.raises(ss.InputError, match="none: does not exist"):
        ss.compare(one, tmp_path / "none")
    with pytest.raises(ss.InputError, match="has no forced response to be held against"):
        ss.compare(ss.Result(tree_of(modes=synthetic_result(ratios=(5,), n=8))), file)
    other = tmp_path / "per.csv"
    other.write_text("frequency_hz,amplitude_um_per_n\n1,2\n")
    with pytest.raises(ss.InputError, match=r"are amplitudes and amplitudes per newton"):
        ss.compare(one, file, other)


def test_from_the_command_line(tmp_path: Path) -> None:
    for name, mu in (("first", 0.6), ("second", 0.4)):
        folder = tmp_path / name / "results"
        folder.mkdir(parents=True)
        design((50, 5), mu, mu).save(folder)
    page = tmp_path / "c.html"
    asked = ["compare", str(tmp_path / "first"), str(tmp_path / "second"), "--page", str(page)]
    told = CliRunner().invoke(app, asked)
    assert told.exit_code == 0, told.output
    assert "contact.flat.friction_coefficient" in told.output
    assert "first and second compared" in page.read_text(encoding="utf-8")
    assert "peak (µm/N)" in told.output  # in the unit of the page
    assert "designs are the same" not in told.output
    wrong = CliRunner().invoke(app, ["compare", str(tmp_path / "first"), str(tmp_path)])
    assert wrong.exit_code == 2
    assert "no such file" in wrong.output
    asked = [str(tmp_path / "first"), str(tmp_path / "first" / "results" / "result.nc"), "--page", str(page)]
    told = CliRunner().invoke(app, ["compare", *asked])
    assert "The designs are the same: nothing differs in their inputs, nor in their peaks." in told.output
    assert "equal to the best peak of" in page.read_text(encoding="utf-8")


def test_all_that_cannot_be_compared_is_named_with_what_to_do(tmp_path: Path) -> None:
    begun = write_four_masses(tmp_path / "begun")
    (tmp_path / "begun" / "results" / "jobs").mkdir(parents=True)
    new = write_four_masses(tmp_path / "new")
    told = CliRunner().invoke(app, ["compare", *(str(tmp_path / name) for name in ("begun", "new", "missing"))])
    assert told.exit_code == 2
    assert told.output.splitlines() == [
        f"{begun}: has no result, its run has not ended yet. Run it first: stickslip run {begun}.",
        f"{new}: has no result, it was not run. Run it first: stickslip run {new}.",
        f"{tmp_path / 'missing'}: does not exist. Give a result, the folder of a study that was run, or a CSV file.",
    ]


@pytest.mark.parametrize(
    ("values", "unit", "cells"),
    [
        ([44.35e-6, 16.9e-6, 5.39e-6], "µm", ["44.35", "16.90", "5.39"]),
        ([1.0, 0.0, math.nan], "m", ["1.000", "0.000", "–"]),
        ([], "m", []),
    ],
)
def test_numbers_of_a_column_have_the_same_decimals(values: list[float], unit: str, cells: list[str]) -> None:
    assert column(np.array(values), "m") == (unit, cells)
