"""Bodies tied on faces whose meshes do not match: the frequencies that CalculiX finds with its own tie of the same faces."""

from pathlib import Path

import numpy as np
import pytest

from stickslip import Study

DATA = Path(__file__).parent / "data" / "calculix"
DIGITS = 5e-7  # CalculiX prints seven, of which the last may be off by half
ONE_DECK = """
schema_version = 2
title = "Two bars end to end"

[part.bars]
file = "bars.inp"
units = "mm-t-s"

[join.middle]
between = ["bars.{0}", "bars.{1}"]

[modes]
number = 10
"""


@pytest.mark.parametrize(("follows", "leads", "column"), [("FACE_A", "FACE_B", 1), ("FACE_B", "FACE_A", 2)])
def test_faces_that_do_not_match_are_tied_as_calculix_ties_them(
    tmp_path: Path, follows: str, leads: str, column: int
) -> None:
    (tmp_path / "bars.inp").write_text((DATA / "tied_bars.inp").read_text())
    study = tmp_path / "study.toml"
    study.write_text(ONE_DECK.format(follows, leads))
    found = Study.from_file(study).run().data["modes"].frequency_hz.values.ravel()
    expected = np.loadtxt(DATA / "tied_bars.csv", delimiter=",", skiprows=1)[:, column]
    np.testing.assert_allclose(found, expected, rtol=DIGITS)
