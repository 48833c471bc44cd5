"""The check inside a run: which points it takes, and what it says of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_study import write_small_study

from stickslip.response.forced.response import forced_problem, forced_response
from stickslip.study.build import Case, case_of
from stickslip.study.collect import CaseResult, collect
from stickslip.study.journal import Journal
from stickslip.study.schema import read_study
from stickslip.study.verify import Check, chosen, peak_and_flanks, refined, verify

CHECK = Check(
    load_case=1,
    ratio=20.0,
    frequency_hz=180.0,
    balance=1.02e-3,
    transient=1.0e-3,
    settled=True,
    periods=90,
    order=5,
)


@pytest.fixture(scope="module")
def stuck(tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, CaseResult]:
    path = write_small_study(tmp_path_factory.mktemp("verify"))
    case = case_of(read_study(path), None, lambda _: None)
    load = case.load(case.ratios[0])
    points = list(forced_response(case.system, load, case.sweep))
    problem = forced_problem(case.system, load, case.sweep)
    excitation = case.centrifugal / case.ratios[0]
    return case, collect(
        problem, points, ratio=case.ratios[0], excitation=excitation, report_output=0
    )


def like(result: CaseResult, ratio: float, *, slips: bool, excitation: float) -> CaseResult:
    """Return a result that stands for another load case."""
    assert result.signals is not None
    state = np.full_like(result.signals.state, int(slips))
    signals = replace(result.signals, state=state)
    return replace(result, ratio=ratio, excitation=excitation, signals=signals)


def test_one_load_case_gives_its_peak_and_both_flanks(stuck: tuple[Case, CaseResult]) -> None:
    _, result = stuck
    points = [a.point.omega for _, a in chosen([result])]
    assert points == sorted(a.point.omega for _, a in peak_and_flanks(result))
    assert len(points) == 3
    assert points[1] == result.accepted[result.peak].point.omega


def test_three_load_cases_are_first_slip_optimum_and_most_nonlinear(
    stuck: tuple[Case, CaseResult],
) -> None:
    _, result = stuck
    # the same amplitude throughout: the largest excitation is the optimum
    results = [
        like(result, 100.0, slips=False, excitation=1.0),
        like(result, 50.0, slips=True, excitation=2.0),
        like(result, 20.0, slips=True, excitation=9.0),
        like(result, 10.0, slips=True, excitation=3.0),
        like(result, 5.0, slips=True, excitation=4.0),
    ]
    found = chosen(results)
    assert [i for i, _ in found] == [1, 2, 4]
    assert all(a is results[i].accepted[results[i].peak] for i, a in found)


def test_a_run_without_a_peak_has_nothing_to_check(stuck: tuple[Case, CaseResult]) -> None:
    assert chosen([replace(stuck[1], peak=-1)]) == []


def test_stuck_contacts_agree_and_nothing_is_integrated_twice(
    stuck: tuple[Case, CaseResult], tmp_path: Path
) -> None:
    case, result = stuck
    lines: list[str] = []
    with Journal(tmp_path / "journal.sqlite", "any", type(result.solved[0])) as journal:
        checks = verify(case, [result], journal, lines.append)
        # a model that cannot be integrated: the second time everything comes from the journal
        again = verify(
            replace(case, ratios=()), [replace(result, ratio=0.0)], journal, lines.append
        )
    assert [c.sentence for c in again] == [c.sentence for c in checks]
    for check in checks:
        # a linear motion: exact but for the start from few harmonics, tolerance of settling 1e-5
        assert abs(check.difference_percent) < 1e-2
        assert check.settled
        assert check.refined_order == 0
    assert len(lines) == 6
    assert "periodic after" in lines[0]


def test_more_harmonics_leave_a_linear_response_as_it_is(stuck: tuple[Case, CaseResult]) -> None:
    case, result = stuck
    accepted = result.accepted[result.peak]
    many = refined(case, result.ratio, accepted.point, 9)
    assert many is not None
    assert many.order == 9
    problem = forced_problem(case.system, case.load(result.ratio), case.sweep)
    assert problem.amplitude(many) == pytest.approx(problem.amplitude(accepted.point), rel=1e-8)


def test_sentence_tells_what_happened() -> None:
    assert "balance 1.02000e-03 m (H = 5)" in CHECK.sentence
    assert CHECK.sentence.endswith("difference +2.00 %; periodic after 90 periods")
    unsettled = replace(CHECK, settled=False, scatter=0.012, drifting="damper.y")
    assert unsettled.sentence.endswith(
        "not periodic after 90 periods: average over the last third, scatter 1.2 %, "
        "and these coordinates drift: damper.y"
    )
    lost = replace(CHECK, settled=False, transient=float("nan"))
    assert "overflowed after 90 periods" in lost.sentence


def test_sentence_tells_which_side_is_wrong() -> None:
    better = replace(CHECK, refined_order=15, refined=1.001e-3)
    assert better.sentence.endswith("the balance with 15 harmonics gives 1.00100e-03 m (+0.10 %)")
    assert replace(CHECK, refined_order=15).sentence.endswith("15 harmonics does not converge")
