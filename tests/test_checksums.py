"""What is stored ends with a checksum: parts of models, structures in files, results; one flipped bit or a cut is seen."""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from stickslip.errors import InputError
from stickslip.model.checksum import LENGTH, MIN_MARK_BYTES, Cut, add_checksum, checked, with_checksum
from stickslip.model.structure import Dofs, Structure
from stickslip.model.structure_file import load_structure, save_structure
from stickslip.study.store.archive import PartStore
from stickslip.study.store.netcdf import attributes_there, read_tree, write_tree

MATRIX = np.array([[2.0, -1.0], [-1.0, 2.0]])


def flipped(content: bytes, bit: int) -> bytes:
    """Return content with one other bit."""
    out = bytearray(content)
    out[bit // 8] ^= 1 << bit % 8
    return bytes(out)


def bits(content: bytes, count: int) -> list[int]:
    """Return so many places of bits, the same each time."""
    return np.random.default_rng(5).integers(8 * len(content), size=count).tolist()


def test_the_checksum_of_a_file_is_that_of_its_content(tmp_path: Path) -> None:
    for content in (b"", b"abc", bytes(3_000_000)):
        (tmp_path / "a").write_bytes(content)
        add_checksum(tmp_path / "a")
        assert (tmp_path / "a").read_bytes() == with_checksum(content)
        assert checked(with_checksum(content)) == content


def test_content_of_other_programs_is_read_unless_a_checksum_has_to_be_there() -> None:
    assert checked(b"abc\n", required=False) == b"abc\n"
    with pytest.raises(ValueError, match="has no checksum"):
        checked(b"abc\n")


@pytest.mark.parametrize("content", [b"", b"abc", bytes(3 * LENGTH)])
def test_a_cut_within_the_checksum_is_told_at_every_byte(content: bytes) -> None:
    whole = with_checksum(content)
    for cut in range(1, LENGTH - MIN_MARK_BYTES + 1):
        for required in (True, False):
            with pytest.raises(Cut, match="cut off within the checksum"):
                checked(whole[:-cut], required=required)
    # what is left of the mark may belong to the content
    for cut in range(LENGTH - MIN_MARK_BYTES + 1, LENGTH + 1):
        assert checked(whole[:-cut], required=False) == whole[:-cut]


def test_a_damaged_part_is_made_anew_with_one_line(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    made: list[int] = []

    def make() -> Mapping[str, Any]:
        made.append(1)
        return {"a": np.arange(3.0), "name": "x", "loss": None}

    caplog.set_level(logging.INFO, logger="stickslip")
    PartStore(tmp_path).kept("content", make)
    (path,) = tmp_path.iterdir()
    whole = path.read_bytes()
    for count, bit in enumerate(bits(whole, 200), 1):
        path.write_bytes(flipped(whole, bit))
        found = PartStore(tmp_path).kept("content", make)
        assert (sorted(found), len(made)) == (["a", "name"], 1 + count)
        assert path.read_bytes() == whole
    told = [r.getMessage() for r in caplog.records if "damaged and made anew" in r.getMessage()]
    assert len(told) == 200
    PartStore(tmp_path).kept("content", make)
    assert len(made) == 201


def test_a_flipped_bit_of_a_structure_takes_nothing_from_it(tmp_path: Path) -> None:
    """Fields that may be left out (loss, basis) were lost with the name in zip's directory."""
    dofs = Dofs(np.array([1, 2]), ("x", "x"), np.zeros((2, 3)), ("", ""))
    structure = Structure(MATRIX, 0 * MATRIX, MATRIX, dofs, {"tip": np.array([1])}, np.eye(2), 0.1 * MATRIX)
    path = tmp_path / "a.npz"
    save_structure(structure, path)
    whole = path.read_bytes()
    places = []
    for bit in bits(whole, 300):
        path.write_bytes(flipped(whole, bit))
        try:
            back = load_structure(path)
        except InputError as error:
            places.append(error.place)
        else:  # the mark of the checksum was hit
            assert back.basis is not None
            np.testing.assert_array_equal(back.loss, structure.loss)
    assert len(places) > 290
    assert {place.partition(": array")[0] for place in places} == {str(path)}


def test_a_result_whose_checksum_was_cut_is_refused_and_not_replaced_by_another(tmp_path: Path) -> None:
    path = tmp_path / "result.nc"
    tree = xr.DataTree(xr.Dataset({"a": ("x", np.arange(3.0))}, attrs={"study_file": "b.toml"}))
    write_tree(tree, path)
    whole = path.read_bytes()
    for cut in (1, 64, LENGTH - 8):
        path.write_bytes(whole[:-cut])
        with pytest.raises(InputError, match=r"cut off within the checksum .*run the study again"):
            read_tree(path)
        assert attributes_there(path)["study_file"] == "b.toml"
    path.write_bytes(whole[:-LENGTH])  # as of another program: what is left is whole
    assert read_tree(path).a.sum() == 3.0
    assert attributes_there(path)["study_file"] == "b.toml"
    path.write_bytes(whole[: -LENGTH - 1])
    with pytest.raises(InputError, match=r"no netCDF-4 file, or a damaged one .*run the study"):
        read_tree(path)
    assert attributes_there(path) == {}
