"""What Python users see: tables of pandas, and signatures with keys."""

from inspect import Parameter, signature

import numpy as np
import pytest
import xarray as xr
from synthetic_result import KEY, synthetic_result, tree_of

import stickslip as ss
from stickslip.analyses.forced_response.records.columns import flags
from stickslip.study.analysis import named
from stickslip.study.coordinates import with_coordinates


def test_a_response_is_a_row_a_point_and_output() -> None:
    data = synthetic_result(ratios=(50, 5), n=10)
    frame = ss.Result(tree_of(forced_response=data)).to_dataframe()
    assert len(frame) == data.sizes["point"] * data.sizes["output"]
    assert frame[KEY].dtype.kind == "f"
    named_alike = ss.Result(tree_of(forced_response=with_coordinates(data, "forced_response"))).to_dataframe()
    assert KEY not in named_alike  # the dataset's coordinate is called so, too
    np.testing.assert_array_equal(named_alike["ratio"], frame[KEY])
    one = frame[(frame[KEY] == 5) & (frame["output"] == str(data["output"].values[1]))]
    at = data["point_case"].values == 1
    np.testing.assert_array_equal(one["frequency_hz"], data["frequency_hz"].values[at])
    np.testing.assert_array_equal(one["amplitude"], data["amplitude"].values[at, 1])
    assert frame.attrs["units"]["amplitude"] == data["amplitude"].attrs["units"]
    data["verdict"] = ("point", np.arange(data.sizes["point"]) % 3, flags("verdict"))
    words = ss.Result(tree_of(forced_response=data)).to_dataframe()["verdict"]
    assert words[:: data.sizes["output"]].tolist()[:4] == ["trusted", "doubtful", "wrong", "trusted"]


def test_entries_that_are_not_there_are_left_out_and_any_variable_may_be_asked_for() -> None:
    height = np.array([[[1.0, 2.0], [3.0, np.nan]]])
    data = xr.Dataset(
        {
            "amplitude": (("case", "branch", "point"), height),
            "end": (("case", "branch"), [["gross slip", "lost"]]),
            "mass_kg": ("case", [1.2]),
        }
    )
    result = ss.Result(tree_of(nonlinear_mode=data))
    frame = result.to_dataframe("nonlinear_mode")
    assert frame["amplitude"].tolist() == [1.0, 2.0, 3.0]
    assert frame["end"].tolist() == ["gross slip", "gross slip", "lost"]
    assert "mass_kg" not in frame
    assert result.to_dataframe(of="mass_kg")["mass_kg"].tolist() == [1.2]
    with pytest.raises(ss.InputError, match=r"Did you mean 'amplitude'"):
        result.to_dataframe(of="amplitud")
    with pytest.raises(ss.InputError, match="is no analysis of this result"):
        result.to_dataframe("modes")


def test_facts_of_a_case_are_not_the_rows_of_an_analysis() -> None:
    data = xr.Dataset(
        {
            "output": ("case", ["tip.x"]),
            "largest": ("case", [3.0]),
            "contact_stiffness": (("case", "contact"), [[1.0, 3.0]]),
        }
    )
    frame = ss.Result(tree_of(stiffness=data)).to_dataframe()
    assert frame["contact_stiffness"].tolist() == [1.0, 3.0]


def test_a_result_is_walked_through_by_the_names_of_its_analyses() -> None:
    result = ss.Result(tree_of(modes=xr.Dataset(), forced_response=xr.Dataset()))
    assert list(result) == ["modes", "forced_response"]
    assert {name: result[name] for name in result}.keys() == {"modes", "forced_response"}
    assert "modes" in result
    assert "safe" not in result
    assert list(ss.Result(tree_of())) == []


def test_points_beyond_the_end_of_a_curve_are_no_rows_but_unsolved_points_are() -> None:
    data = xr.Dataset(
        {
            "amplitude": (("case", "branch", "point"), [[[1.0, np.nan, np.nan]]]),
            "frequency_hz": (("case", "branch", "point"), [[[5.0, 6.0, np.nan]]]),
            "status": (("case", "branch", "point"), [[[0, 1, -1]]]),
        }
    )
    frame = ss.Result(tree_of(nonlinear_mode=data)).to_dataframe()
    assert frame["frequency_hz"].tolist() == [5.0, 6.0]


def test_a_variable_may_be_called_as_its_dimension() -> None:
    data = xr.Dataset(
        {"amplitude": (("case", "level", "point"), np.ones((1, 2, 2))), "level": (("case", "level"), [[0.5, 3.0]])}
    )
    frame = ss.Result(tree_of(modal_synthesis=data)).to_dataframe()
    assert frame["level"].tolist() == [0.5, 0.5, 3.0, 3.0]


@pytest.mark.parametrize("name", ["forced_response", "nonlinear_mode", "safe"])
def test_the_signature_of_a_question_has_the_keys_of_its_tables(name: str) -> None:
    told = signature(getattr(ss.Model, name)).parameters
    assert all(p.kind is not Parameter.VAR_KEYWORD for p in told.values())
    for key, field in named(name).table.model_fields.items():
        assert told[key].kind is Parameter.KEYWORD_ONLY
        assert (told[key].default is Parameter.empty) == field.is_required()
