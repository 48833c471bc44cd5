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


@pytest.fixture
def of_ones_own(tmp_path: Path) -> Iterator[Path]:
    """A study file that names the page's analysis, in a module beside it."""
    code = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    own = [block for block in code if block.startswith("# analyses/slip_onset")]
    imports = ["import numpy as np", "import stickslip as ss"]
    (tmp_path / "own_onset.py").write_text("\n".join([*imports, *own]), encoding="utf-8")
    path = tmp_path / "study.toml"
    path.write_text(STUDY.replace("[slip_onset]", '[slip_onset]\nanalysis = "own_onset:SLIP_ONSET"'), encoding="utf-8")
    yield path
    sys.modules.pop("own_onset", None)
    sys.path[:] = [entry for entry in sys.path if entry != str(tmp_path)]


def test_a_study_file_names_an_analysis_of_ones_own(of_ones_own: Path) -> None:
    with pytest.raises(ss.InputError, match=r"slip_onset\.analysis: names code of your own.*--allow-code"):
        ss.Study.from_file(of_ones_own)
    assert "own_onset" not in sys.modules
    result = ss.Study.from_file(of_ones_own, allow_code=True).run()
    assert result["slip_onset"].mode_amplitude.values[0] == pytest.approx([2e-4, 2e-4], rel=0.01)
    html = page.report_html(result.data)
    assert "slip begins only at 0.2" in html
    assert list(page.plots(result.data)) == ["slip_onset"]
    del sys.modules["own_onset"]  # a result alone runs no code: its numbers are shown as tables
    assert list(page.plots(result.data)) == []
    assert "amplitude of the output at which slip begins" in page.report_html(result.data)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ('analysis = "own_onset:MISSING"', "own_onset has no 'MISSING'"),
        ('analysis = "own_onset:Question"', "is no analysis: it has no"),
        ('analysis = "own_onset:SLIP_ONSET"\nmode = 2', r"slip_onset\.mode: unknown key.*modes"),
        ("analysis = 3", "is no module path, got '3'"),
    ],
)
def test_what_is_no_analysis_is_refused(of_ones_own: Path, given: str, told: str) -> None:
    text = of_ones_own.read_text(encoding="utf-8")
    of_ones_own.write_text(text.replace('analysis = "own_onset:SLIP_ONSET"', given), encoding="utf-8")
    with pytest.raises(ss.InputError, match=told):
        ss.Study.from_file(of_ones_own, allow_code=True)


def test_the_table_has_the_name_of_its_analysis(of_ones_own: Path) -> None:
    text = of_ones_own.read_text(encoding="utf-8")
    of_ones_own.write_text(text.replace("[slip_onset]", "[onset]"), encoding="utf-8")
    with pytest.raises(ss.InputError, match=r"onset\.analysis: is the analysis 'slip_onset'.*\[slip_onset\]"):
        ss.Study.from_file(of_ones_own, allow_code=True)
