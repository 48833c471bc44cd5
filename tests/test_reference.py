"""Frequencies to compare with: of which speed they are."""

from pathlib import Path

import pytest

from stickslip.analyses.waves.modes import read_reference
from stickslip.errors import InputError

HEAD = "case,nodal_diameter,mode,frequency_hz"


def written(folder: Path, *lines: str) -> Path:
    path = folder / "known.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_the_name_of_a_case_tells_the_speed(tmp_path: Path) -> None:
    path = written(tmp_path, HEAD, "prestressed_8000rpm,0,1,497.2", "at rest,0,1,480.0")
    known = read_reference(path, "prestressed_8000rpm")
    assert known.speeds_rpm == (8000.0,)
    assert known.not_at(8500.0) == (8000.0,)
    assert known.not_at(8000.0) == ()
    assert read_reference(path, "at rest").not_at(8500.0) == ()


def test_a_column_tells_the_speed_and_goes_before_the_name(tmp_path: Path) -> None:
    path = written(tmp_path, HEAD + ",speed_rpm", "8000 rpm,0,1,497.2,7990", "8000 rpm,1,1,499.2,")
    known = read_reference(path, "8000 rpm")
    assert known.frequencies_hz == {(0, 1): 497.2, (1, 1): 499.2}
    assert known.not_at(0.0) == (7990.0,)
    bad = written(tmp_path, HEAD + ",speed_rpm", "a,0,1,497.2,fast")
    with pytest.raises(InputError, match="speed_rpm"):
        read_reference(bad, "a")
