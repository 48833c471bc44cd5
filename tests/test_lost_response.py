"""A forced response of which no point converges has a result, a page and a verdict, and takes no other case with it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from small_v2 import write_four_masses
from typer.testing import CliRunner

from stickslip.analyses.forced_response import analysis
from stickslip.api.result import Result
from stickslip.cli import app
from stickslip.errors import SingularError
from stickslip.harmonic.balance import HarmonicBalance

FEW = {
    "forced_response.points": "4",
    "forced_response.peak_points": "0",
    "forced_response.stability": '"off"',
    "forced_response.not_periodic": '"off"',
    "solver.rescue": '"off"',
}


def run(study: Path) -> tuple[int, str, Result]:
    ended = CliRunner().invoke(app, ["run", str(study)])
    assert (study.parent / "results" / "report.html").is_file(), ended.output
    return ended.exit_code, " ".join(ended.output.split()), Result.from_file(study.parent / "results")


@pytest.mark.parametrize(("error", "high"), [(SingularError, '"auto"'), (FloatingPointError, "5")])
def test_a_response_that_cannot_begin_has_a_result_a_page_and_a_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: type[Exception], high: str
) -> None:
    def fails(*_words: object, **_named: object) -> Iterator[object]:
        raise error("nothing holds it")
        yield

    monkeypatch.setattr(analysis, "forced_response", fails)
    study = write_four_masses(tmp_path, FEW | {"vary.load.shaker.force_n": "[1.0]", "harmonics.high": high})
    for _ in range(2):  # the second time from the files
        code, told, result = run(study)
        data = result["forced_response"]
        assert code == 1
        assert "has no solution (nothing holds it)" in told
        assert "no point converged: there is no peak" in told
        assert "1 of the points: marked in the result" in told
        assert data["point_case"].values.tolist() == [0]
        assert data["status"].values.tolist() == [4 if error is FloatingPointError else 3]
        assert np.all(np.isnan(data["amplitude"].values))
        assert data["case_verdict"].values.tolist() == [2]


def test_a_response_without_a_converged_point_has_a_result_a_page_and_a_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    linearise = HarmonicBalance.linearise

    def lost(self: HarmonicBalance, *words: object, **named: object) -> object:
        found = linearise(self, *words, **named)  # type: ignore[arg-type]
        found.residual[:] = np.nan
        return found

    monkeypatch.setattr(HarmonicBalance, "linearise", lost)
    code, told, result = run(write_four_masses(tmp_path, FEW | {"vary.load.shaker.force_n": "[1.0]"}))
    assert code == 1
    assert "no point converged: there is no peak" in told
    assert np.all(result["forced_response"]["status"].values != 0)
