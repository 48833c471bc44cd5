"""Coordinates of datasets: what can be selected, grouped, drawn and written as a table."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from synthetic_result import KEY, synthetic_result, tree_of
from synthetic_wheel import campbell_result, modes_result, safe_result

import stickslip as ss
from stickslip.study.coordinates import as_stored, selectable, short_names, with_coordinates


def _varied(**keys: list[float] | list[str]) -> xr.Dataset:
    """Return two modes of each case."""
    n = len(next(iter(keys.values())))
    rows = np.array([list(map(str, row)) for row in zip(*keys.values(), strict=True)])
    numbers = all(isinstance(v, float) for own in keys.values() for v in own)
    return xr.Dataset(
        {
            "frequency_hz": (("case", "mode"), np.arange(2.0 * n).reshape(n, 2)),
            "case_label": ("case", [f"case {i}" for i in range(n)]),
            "vary_value": (("case", "vary"), rows.astype(float) if numbers else rows),
        },
        coords={"vary": [key.replace("__", ".") for key in keys]},
    )


@pytest.fixture(scope="module")
def response(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """A response at three load ratios, as an earlier version stored it, opened."""
    stored = ss.Result(tree_of(forced_response=synthetic_result(ratios=(20, 5, 2), n=24)))
    return ss.Result.from_file(stored.save(tmp_path_factory.mktemp("stored")))["forced_response"]


def test_a_case_is_taken_by_the_value_of_its_key(response: xr.Dataset) -> None:
    at = response["point_case"].values == 1
    curve = response.sel(ratio=5).amplitude
    np.testing.assert_array_equal(curve, response["amplitude"].values[at])
    np.testing.assert_array_equal(curve["frequency_hz"], response["frequency_hz"].values[at])
    assert curve["ratio"].item() == 5
    output = str(response["output"].values[1])
    assert response.amplitude.sel(ratio=5, output=output).dims == ("point",)
    assert response.sel(ratio=[20, 2]).sizes["point"] == np.sum(~at)
    assert set(response.sel(ratio=slice(3, None))["ratio"].values) == {20, 5}
    assert set(response.sel(ratio=slice(None, 5))["ratio"].values) == {5, 2}
    assert response.sel(ratio=4.1, method="nearest")["ratio"].item() == 5
    assert response.peak_amplitude.sel(case_ratio=5).item() == response["peak_amplitude"].values[1]
    assert response.peak_amplitude.sel(case=f"{KEY} = 5").item() == response["peak_amplitude"].values[1]
    with pytest.raises(KeyError, match="ratio has no value 4, but 20, 5, 2"):
        response.sel(ratio=4)


def test_two_cases_are_subtracted_point_by_point(response: xr.Dataset) -> None:
    first, second = (response.sel(ratio=r).amplitude.isel(point=slice(0, 9)) for r in (20, 2))
    np.testing.assert_array_equal(first - second, first.values - second.values)


def test_keys_group_and_stand_in_tables(response: xr.Dataset) -> None:
    for data in (
        response,
        with_coordinates(as_stored(response), "forced_response"),
    ):  # with an index of keys, and without
        largest = data.amplitude.groupby("ratio").max()
        own = [data["amplitude"].values[data["point_case"].values == case].max(axis=0) for case in (2, 1, 0)]
        np.testing.assert_array_equal(largest.sel(ratio=[2, 5, 20]), own)
        table = data.amplitude.to_dataframe().reset_index()
        np.testing.assert_array_equal(table["ratio"][table["point_case"] == 1], 5)
        assert {"point", "output", "frequency_hz", "amplitude"} <= set(table)


def test_a_selection_goes_through_what_xarray_does(response: xr.Dataset, tmp_path: Path) -> None:
    twice = xr.concat([response.amplitude, response.amplitude], "point").sel(ratio=5)
    assert twice.sizes["point"] == 2 * response.sel(ratio=5).sizes["point"]
    assert (
        response.rename(ratio="load").sel(load=5).amplitude.equals(response.sel(ratio=5).amplitude.rename(ratio="load"))
    )
    solved = response.isel(point=response["status"].values == 0)
    assert solved.sel(ratio=5)["frequency_hz"].equals(
        response.sel(ratio=5).where(lambda d: d.status == 0, drop=True)["frequency_hz"]
    )
    assert (response.amplitude - response.amplitude == 0).all()
    response.to_netcdf(tmp_path / "own.nc")
    assert "ratio" in xr.open_dataset(tmp_path / "own.nc").coords
    assert response.isel(point=3)["ratio"].item() == response["ratio"].values[3]


def test_keys_are_called_by_the_shortest_end_that_is_free() -> None:
    keys = ["contact.left.mu", "contact.right.mu", "load.a.force_n", "rotation.speed_rpm"]
    assert short_names(keys, {"speed_rpm"}) == ["left_mu", "right_mu", "force_n", "rotation_speed_rpm"]
    assert short_names(["load.a.ratio"], {"case_ratio"}) == ["a_ratio"]
    assert short_names(["mu"], {"mu"}) == ["vary_0"]


def test_no_key_takes_the_name_of_a_variable_that_a_result_may_have() -> None:
    data = with_coordinates(_varied(rotation__speed_rpm=[1.0, 2.0]), "campbell")
    assert "speed_rpm" not in data.coords
    assert data["rotation_speed_rpm"].values.tolist() == [1, 2]
    assert data["rotation_speed_rpm"].attrs == {
        "units": "rpm",
        "long_name": "rotation.speed_rpm",
        "varied_key": "rotation.speed_rpm",
    }


def test_several_keys_are_asked_for_together() -> None:
    data = selectable(with_coordinates(_varied(contact__mu=[0.1, 0.1, 0.3], load__a__force_n=[5.0, 6.0, 5.0]), "modes"))
    assert data.sel(mu=0.1, force_n=6.0)["frequency_hz"].values.tolist() == [2, 3]
    assert data.sel(mu=0.1)["force_n"].values.tolist() == [5, 6]
    assert data.sel(mu=0.1).sel(force_n=5).sizes["mode"] == 2
    assert data.sel(mu=0.1 + 1e-12, force_n=5)["case"].item() == "case 0"
    assert data["force_n"].attrs["units"] == "N"
    mixed = selectable(with_coordinates(_varied(harmonics__choice=["all", "alert"], contact__mu=[0.1, 0.3]), "modes"))
    assert mixed.sel(choice="alert")["mu"].item() == 0.3
    assert mixed["mu"].dtype.kind == "f"


def test_coordinates_are_made_once_and_taken_back(response: xr.Dataset) -> None:
    stored = synthetic_result(ratios=(20, 5, 2), n=24)
    data = with_coordinates(stored, "forced_response")
    assert with_coordinates(data, "forced_response") is data
    assert set(as_stored(data).data_vars) == set(stored.data_vars)
    alone = with_coordinates(synthetic_result(ratios=(5,), n=24).drop_vars(["vary", "vary_value"]), "forced_response")
    assert "case" not in alone.coords
    assert {"frequency_hz", "point_case"} <= set(alone.coords)


def test_outputs_get_their_names_where_all_cases_have_the_same() -> None:
    data = xr.Dataset(
        {"output_label": (("case", "output"), [["a", "b"], ["a", "b"]]), "amplitude": (("case", "output"), np.eye(2))}
    )
    assert with_coordinates(data, "run_up").amplitude.sel(output="b").values.tolist() == [0, 1]
    data["output_label"][1] = ["b", "a"]
    assert "output" not in with_coordinates(data, "run_up").coords


@pytest.mark.parametrize("cases", [1, 2])
def test_modes_are_taken_by_nodal_diameter_and_pairs_by_engine_order(cases: int) -> None:
    made = {"modes": modes_result(), "campbell": campbell_result(), "safe": safe_result()}
    each = {n: xr.concat([d] * cases, "case", data_vars="all") for n, d in made.items()}
    for name, data in each.items():
        found = selectable(with_coordinates(data, name))
        at = int(np.flatnonzero(data.nodal_diameter.values[0] == 3)[0])
        for one in (found.sel(nodal_diameter=3), found.sel(wave_number=[3])):
            np.testing.assert_array_equal(one.frequency_hz.values, data.frequency_hz.values[:, [at]])
        assert found.sel(wave_kind="forward").sizes["wave"] == np.sum(data.wave_kind.values[0] == "forward")
        with pytest.raises(KeyError, match="nodal_diameter has no value 77"):
            found.sel(nodal_diameter=77)
        # the file keeps its variables
        assert with_coordinates(data, name).reset_coords().nodal_diameter.identical(data.nodal_diameter)
    pairs = selectable(with_coordinates(each["safe"], "safe")).sel(pair_engine_order=5)
    assert set(pairs.pair_engine_order.values.ravel().tolist()) == {5}
    orders = selectable(with_coordinates(each["campbell"], "campbell")).sel(engine_orders=5)
    assert orders.sizes["order"] == 1


def test_labels_that_differ_between_cases_stay_with_their_cases() -> None:
    data = xr.concat([modes_result()] * 2, "case", data_vars="all").copy(deep=True)
    data["nodal_diameter"].values[1] += 1
    found = selectable(with_coordinates(data, "modes"))
    assert found.nodal_diameter.dims == ("case", "wave")
    assert found.wave_number.dims == ("wave",)
