"""The page for those who extend the package: its code runs as it stands, and its analysis agrees with closed forms."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

from stickslip.analyses import page
from stickslip.units import HZ

PAGE = Path(__file__).parents[1] / "docs" / "extending.md"


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """The names that all blocks of the page define, run in their order."""
    code = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    found: dict[str, Any] = {"__name__": "extending"}
    exec(compile("\n".join(code), "extending.md", "exec"), found)  # our own page
    return found


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


def test_its_section_is_drawn(names: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "SECTIONS", (names["SECTION"],))
    html = page.report_html(names["outcome"].tree)
    assert "frequency with contacts stuck (Hz)" in html
    assert list(page.plots(names["outcome"].tree)) == ["slip_onset"]
