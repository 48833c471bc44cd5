"""Files of results that h5py writes alone: xarray reads the same tree from them, and so do we."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from synthetic_result import synthetic_result, tree_of

from stickslip.study.store.netcdf import attributes_there, of_file, read_tree, write_tree


def odd_tree() -> xr.DataTree:
    """Return what may stand in a tree: all kinds, sizes and names."""
    data = xr.Dataset(
        {
            "amplitude": (("case", "point"), [[1.0, np.nan], [3.0, 4.0]], {"units": "m"}),
            "level": (("case", "level"), np.arange(6.0).reshape(2, 3)),
            "point": (("point", "level"), np.arange(6).reshape(2, 3)),
            "status": ("point", np.array([0, -1]), {"flag_values": np.arange(3), "flag": [1.5]}),
            "said": (("case", "point"), [["", "Hölle"], ["a b", "c\nd"]]),
            "nothing_said": ("case", ["", ""]),
            "none": (("empty", "case"), np.zeros((0, 2))),
            "no_words": ("empty", np.zeros(0, dtype="U3")),
            "there": ("case", [True, False]),
            "mass_kg": ((), 2.5),
            "title": ((), "one"),
            "small": ("case", np.array([1, 2], dtype=np.int16)),
        },
        coords={"output": ["a", "b"], "label": ("output", ["first", "second"])},
        attrs={"failed": 0, "name": "x", "blank": "", "share": np.float64(0.1), "words": ["a", "b"]},
    )
    below = xr.Dataset({"x": (("output", "new"), np.ones((2, 1)))}, coords={"new": [0.5]})
    root = xr.Dataset({"time": ("output", [0.0, 1.0])}, coords={"output": ["a", "b"]})
    return xr.DataTree.from_dict({"/": root, "/one": data, "/one/below": below})


@pytest.mark.parametrize("make", [odd_tree, lambda: tree_of(forced_response=synthetic_result())])
def test_xarray_and_the_own_reader_find_what_was_written(make, tmp_path: Path) -> None:
    tree, path = make(), tmp_path / "result.nc"
    write_tree(tree, path)
    with xr.open_datatree(path, engine="h5netcdf", decode_times=False) as theirs:
        theirs.load()
    ours = of_file(path)
    assert ours is not None
    # what xarray itself makes of the tree, written and read
    tree.to_netcdf(tmp_path / "xarray.nc", engine="h5netcdf")
    with xr.open_datatree(tmp_path / "xarray.nc", engine="h5netcdf", decode_times=False) as other:
        other.load()
    for found in (theirs, ours):
        xr.testing.assert_identical(found, other)
        for node in other.subtree:
            mine = found[node.path]
            assert list(mine.attrs) == list(node.attrs)
            assert set(mine.coords) == set(node.coords)
            for name, variable in node.variables.items():
                assert mine.variables[name].dtype == variable.dtype, name
                told = {k: type(v) for k, v in variable.attrs.items()}
                assert {k: type(v) for k, v in mine.variables[name].attrs.items()} == told


def test_a_file_of_another_writer_is_read_too(tmp_path: Path) -> None:
    tree, path = odd_tree(), tmp_path / "result.nc"
    tree.to_netcdf(path, engine="h5netcdf")
    assert of_file(path) is None
    assert read_tree(path)["one"].attrs == tree["one"].attrs
    with h5py.File(path, "a") as file:
        file.attrs["study_file"] = "a.toml"
    assert attributes_there(path)["study_file"] == "a.toml"
    assert "_NCProperties" not in attributes_there(path)
