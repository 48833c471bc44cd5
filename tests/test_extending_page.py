"""The page for those who extend the package: its code runs as it stands, and its analysis agrees with closed forms."""

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

import stickslip as ss
from stickslip.analyses import page
from stickslip.study.file.tables import study_tables
from stickslip.study.questions import ANALYSES, Home
from stickslip.units import HZ

STUDY = """
schema_version = 2

[part.bar]
shape = "lumped"
masses_kg = [1.0, 1.0]
springs_n_per_m = [["ground", 1, 1e4], [1, 2, 1e4]]
dashpots_n_s_per_m = [["ground", 1, 2.0], ["ground", 2, 2.0]]

[contact]
brake = { between = ["bar.m2", "ground"], law = "jenkins", tangential_stiffness_n_per_m = 5e3, slip_limit_n = 1.0 }

[output]
points = { tip = "bar.m2" }
peak = "tip.x"

[slip_onset]
modes = 2
wanted_mm = 0.1
"""
PAGE = Path(__file__).parents[1] / "docs" / "extending.md"


@pytest.fixture(scope="module")
def names() -> Iterator[dict[str, Any]]:
    """The names that all blocks of the page define, run in their order."""
    code = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    module = sys.modules["extending"] = ModuleType("extending")  # jobs pickle what it defines
    exec(compile("\n".join(code), "extending.md", "exec"), module.__dict__)  # our own page
    yield module.__dict__
    del sys.modules["extending"]


def test_modes_and_the_onset_of_slip(names: dict[str, Any]) -> None:
    own = names["record_of"](names["Onsets"], names["outcome"].tree["slip_onset"].to_dataset().isel(case=0))
    stuck = names["bar"].stiffness + np.diag([0.0, 5e3])
    assert [one.omega / HZ for one in own.modes] == pytest.approx(np.sqrt(eigh(stuck, names["bar"].mass)[0]) / HZ)
    # friction limit over stiffness, found to a percent from above
    assert [one.amplitude for one in own.modes] == pytest.approx([2e-4, 2e-4], rel=0.01)
    assert own.wanted == 1e-4


def test_each_late_mode_is_doubted(names: dict[str, Any]) -> None:
    verdicts = names["outcome"].verdicts
    assert [v.level for v in verdicts] == ["doubtful", "doubtful"]
    assert "slip begins only at 0.2" in verdicts[0].why
    assert names["outcome"].summaries["slip_onset"][0].rows[0][:2] == ("1", "13.497")


def test_an_interrupted_job_goes_on_with_the_next_mode(names: dict[str, Any]) -> None:
    class Kept(dict[str, Any]):
        put = dict.__setitem__

    question = names["question_of"](names["case"], names["model"])
    first, second = names["solve"](question, [], Kept())
    (again,) = names["solve"](question, [first], Kept())
    assert (again.number, again.amplitude) == (second.number, second.amplitude)


@pytest.fixture
def registered(names: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The analysis, made a part of the package by one entry."""
    home = Home("extending:SLIP_ONSET", "extending:SlipOnsetTable", "extending:SECTION")
    monkeypatch.setitem(ANALYSES, "slip_onset", home)
    study_tables.cache_clear()
    yield
    study_tables.cache_clear()


@pytest.mark.usefixtures("registered")
def test_its_section_is_drawn(names: dict[str, Any]) -> None:
    html = page.report_html(names["outcome"].tree)
    assert "frequency with contacts stuck (Hz)" in html
    assert list(page.plots(names["outcome"].tree)) == ["slip_onset"]


@pytest.mark.usefixtures("registered")
def test_a_study_file_asks_for_it_after_one_entry(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(STUDY, encoding="utf-8")
    result = ss.Study.from_file(path).run()
    assert result["slip_onset"].mode_amplitude.values[0] == pytest.approx([2e-4, 2e-4], rel=0.01)
    assert "slip begins only at 0.2" in page.report_html(result.data)
