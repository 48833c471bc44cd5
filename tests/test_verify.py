"""The check inside a run: which points it takes, and what it says of them."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_v2 import changed, write_four_masses, write_shrouded_sector, write_two_blades

from stickslip.analyses.forced_response.analysis import FORCED_RESPONSE
from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.stability import examining, in_time
from stickslip.analyses.forced_response.stability.in_time import STEPS, Check, check_in_time, chosen, refined
from stickslip.errors import InputError
from stickslip.response.forced.collected import Response, collect
from stickslip.response.forced.response import forced_response
from stickslip.response.time.transient import TransientResult
from stickslip.study.models.study import read_study
from stickslip.study.store.journal import JobJournal

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

CHECK = Check(frequency_hz=180.0, balance=1.02e-3, transient=1.0e-3, settled=True, periods=90, order=5)


def test_a_motion_in_time_that_stands_still_is_off_by_no_finite_amount() -> None:
    """A slider so far away that rounding swallows its motion: some BLAS kernels put a body there that nothing else holds."""
    still = replace(CHECK, transient=0.0, refined_order=9, refined=1e-3, motion="left")
    assert still.difference_percent == np.inf
    assert replace(still, balance=0.0).difference_percent == 0.0
    assert "(H = 5), time integration 0.00000e+00 m; periodic after" in still.sentence
    assert "the balance with 9 harmonics gives 1.00000e-03 m; left:" in still.sentence


@pytest.fixture(scope="module")
def stuck(tmp_path_factory: pytest.TempPathFactory) -> tuple[Question, Response]:
    (case,) = read_study(write_two_blades(tmp_path_factory.mktemp("verify"))).cases()
    asked = FORCED_RESPONSE.inputs(case, case.build())
    points = list(forced_response(asked.model.system, asked.model.load, asked.sweep))
    return replace(asked, label=""), collect(asked.problem, points, 0)


def test_one_case_alone_gives_its_peak_and_both_flanks(stuck: tuple[Question, Response]) -> None:
    asked, response = stuck
    points = [a.point.omega for a in chosen(asked, response)]
    assert response.top is not None
    assert points == sorted(a.point.omega for a in (response.top, *response.flanks))
    assert len(points) == 3
    assert points[1] == response.top.point.omega


def test_each_of_several_cases_gives_its_peak(stuck: tuple[Question, Response]) -> None:
    asked, response = stuck
    assert chosen(replace(asked, label="load.shaker.ratio = 20"), response) == [response.top]


def test_a_run_without_a_peak_has_nothing_to_check(stuck: tuple[Question, Response]) -> None:
    asked, response = stuck
    assert chosen(asked, replace(response, peak=-1)) == []


def test_stuck_contacts_agree_and_nothing_is_integrated_twice(
    stuck: tuple[Question, Response], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    asked, response = stuck
    asked = replace(asked, checks=frozenset({"verify"}))

    def solve(journal: JobJournal, points: Sequence[object]) -> dict[str, object]:
        assert list(FORCED_RESPONSE.solve(asked, points, journal)) == []
        return journal.get("verify") or {}

    with JobJournal(Path(":memory:"), FORCED_RESPONSE.record) as journal, caplog.at_level("INFO"):
        journal.put("finished", {"points": len(response.solved)})
        found = solve(journal, response.solved)
        # a model that cannot be integrated: the second time everything comes from the journal
        monkeypatch.setattr(examining, "check_in_time", None)
        again = solve(journal, response.solved)
    assert list(again["verify_sentence"]) == list(found["verify_sentence"])
    # a linear motion: exact but for the start from few harmonics, tolerance of settling 1e-5
    assert max(abs(found["verify_difference_percent"])) < 1e-2
    assert all(found["verify_settled"])
    assert caplog.text.count("periodic after") == 6


@pytest.mark.validation
@pytest.mark.parametrize("law", ["jenkins", "dahl", "iwan"])
def test_other_laws_are_integrated_and_agree(law: str, tmp_path: Path) -> None:
    """Two friction elements of a law and a stop with clearance: the balance with five harmonics is within 1 % at its peak."""
    path = write_four_masses(tmp_path)
    text = path.read_text(encoding="utf-8").replace('law = "jenkins"', f'law = "{law}"')
    path.write_text(text, encoding="utf-8")
    case = next(iter(read_study(path).cases()))
    asked = FORCED_RESPONSE.inputs(replace(case, checks=frozenset({"verify"})), case.build())
    points = list(forced_response(asked.model.system, asked.model.load, asked.sweep))
    response = collect(asked.problem, points, 0)
    assert response.top is not None
    found, _ = check_in_time(asked, response, response.top)
    assert found.settled
    assert abs(found.difference_percent) < 1.0


def test_a_wheel_of_too_many_coordinates_is_refused(tmp_path: Path) -> None:
    path = write_shrouded_sector(tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(changed(text, {"load.gas.engine_order": "1"}), encoding="utf-8")
    (case,) = read_study(path).cases()
    asked = replace(case, checks=frozenset({"verify"}))
    said = r"part\.blade\.sectors: --verify integrates all sectors that may do different things, \d+ coordinates, more than 600"
    with pytest.raises(InputError, match=said):
        FORCED_RESPONSE.inputs(asked, asked.build())


def test_more_harmonics_leave_a_linear_response_as_it_is(stuck: tuple[Question, Response]) -> None:
    asked, response = stuck
    assert response.top is not None
    many = refined(asked, response.top.point, 9)
    assert many is not None
    assert many.order == 9
    before = asked.problem.amplitude(response.top.point)
    assert asked.problem.amplitude(many) == pytest.approx(before, rel=1e-8)


def test_sentence_tells_what_happened() -> None:
    assert "balance 1.02000e-03 m (H = 5)" in CHECK.sentence
    assert CHECK.sentence.endswith("difference +2 %; periodic after 90 periods")
    unsettled = replace(CHECK, settled=False, scatter=0.012, drifting="damper.y")
    assert unsettled.sentence.endswith(
        "not periodic after 90 periods: average over the last third, scatter 1.2 %, "
        "and these coordinates drift: damper.y"
    )
    stays = replace(CHECK, settled=False, scatter=3e-7, motion="attained")
    assert (
        "periodic but for the scatter after 90 periods: average over the last third, scatter 3e-05 %" in stays.sentence
    )
    lost = replace(CHECK, settled=False, transient=float("nan"))
    assert "overflowed after 90 periods" in lost.sentence


def test_sentence_tells_which_side_is_wrong() -> None:
    better = replace(CHECK, refined_order=15, refined=1.001e-3)
    assert better.sentence.endswith("the balance with 15 harmonics gives 1.00100e-03 m (+0.10 %)")
    assert replace(CHECK, refined_order=15).sentence.endswith("15 harmonics does not converge")


def test_sentence_tells_of_the_step() -> None:
    finer = replace(CHECK, steps=4096, step_percent=0.2)
    assert finer.sentence.endswith("with 4096 steps a period (half of them: -0.2 %)")
    never = replace(CHECK, steps=8192, step_percent=7.0)
    assert "8192 steps a period are still too few for it" in never.sentence


def test_a_difference_is_not_believed_before_twice_the_steps_confirm_it(
    stuck: tuple[Question, Response], monkeypatch: pytest.MonkeyPatch
) -> None:
    # steps that make the amplitude by 3, then by 0.75 and 0.19 % too large, as an error of second order of a coarse step does
    asked, response = stuck
    assert response.top is not None
    asked_for = []
    real = in_time.integrated

    def coarse(*arguments: Any, steps: int = STEPS, **more: Any) -> TransientResult:
        asked_for.append(steps)
        found = real(*arguments, **more)
        wrong = 1.0 + 0.03 * (STEPS / steps) ** 2
        return replace(found, harmonics=wrong * found.harmonics)

    monkeypatch.setattr(in_time, "integrated", coarse)
    check, _ = check_in_time(asked, response, response.top)
    assert asked_for == [1024, 2048, 4096]
    assert check.steps == 4096
    assert check.step_percent == pytest.approx(-0.56, abs=0.02)
    assert check.refined_order == 0
    assert abs(check.difference_percent) < 0.3
