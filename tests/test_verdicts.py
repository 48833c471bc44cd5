"""Verdicts: each rule on a response that it must find, and on one that it must leave alone; the same words everywhere."""

import math
import re
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from small_v2 import write_four_masses
from test_cli import done

import stickslip as ss
from stickslip.analyses.forced_response.records.columns import (
    CaseNumbers,
    OtherMotions,
    PointFields,
    Points,
    TimeChecks,
    each,
    holds,
    read,
)
from stickslip.analyses.forced_response.verdicts.cases import said_once, verdicts, with_levels
from stickslip.analyses.forced_response.verdicts.curve import Curve, branch_length
from stickslip.report.frame import concluded
from stickslip.study.verdict import (
    LEVELS,
    POINT_LEVELS,
    Verdict,
    conclusion,
    doubt,
    from_json,
    in_lines,
    not_trusted,
    of_all_cases,
    of_tree,
    stored,
    to_json,
    together,
    worst,
    worst_first,
)

HZ = np.array([10.0, 11.0, 12.0, 13.0, 14.0, 15.0])
TOP = 3  # the point of the peak
NO_STABILITY = ", stability not examined"


def response(attrs: dict[str, object] | None = None, **changes: object) -> xr.Dataset:
    """A resonance of six points, each judged and good; a name with a case's value changes that."""
    n = len(changes.get("frequency_hz", HZ))
    kept = np.zeros((n, 6), dtype=int)
    kept[:, :2] = 1
    plain = {
        "point_case": np.zeros(n, dtype=int),
        "frequency_hz": HZ,
        "status": np.zeros(n, dtype=int),
        "refinement": np.zeros(n, dtype=int),
        "own_error_percent": np.full(n, 1.0),
    }
    amplitude = np.array([1.0, 1.3, 1.6, 1.9, 1.5, 1.2])
    case = {
        "peak_point": [TOP],
        "excitation_n": [1.0],
        "retention_peak_shift": [np.nan],
        "lowest_hz": [np.nan],
        "highest_hz": [np.nan],
    }
    rows = {"verify": "check", "stability": "examined"}
    found: dict[str, object] = {
        "harmonic_kept": (("point", "harmonic"), kept),
        "amplitude": (("point", "output"), np.reshape(changes.pop("amplitude", amplitude), (n, 1))),
        "dissipated_energy": (("point", "contact"), np.reshape(changes.pop("loss", amplitude), (n, 1))),
    }
    for name, value in (plain | case | changes).items():
        word = name.partition("_")[0]
        of_case = name in (*case, "known_verdicts") or word in ("modes", "points")
        dims = rows.get(word, "case" if of_case else "point")
        found[name] = ((dims, "harmonic") if name == "harmonic_kept" else dims, value)
    own = {"low_harmonics": [0, 1], "selection_threshold": 0.05, "error_limit_percent": 5.0}
    return xr.Dataset(found, {"output": ["tip.x"]}, own | (attrs or {}))


def judged(data: xr.Dataset) -> tuple[tuple[Verdict, ...], str, list[str]]:
    """Return the verdicts of its one case, the level of the case, and those of its points."""
    levels = {name: np.asarray(of[1]) for name, of in with_levels(data, [""]).items()}
    return (
        verdicts(data, [""]),
        LEVELS[int(levels["case_verdict"][0])],
        [POINT_LEVELS[int(k)] for k in levels["verdict"]],
    )


def values(at: int, value: float, rest: float = np.nan, n: int = 6) -> np.ndarray:
    found = np.full(n, rest)
    found[at] = value
    return found


def checked(**row: object) -> dict[str, list[object]]:
    own = {"case": 0, "frequency_hz": 13.0, "settled": 1, "difference_percent": 0.2, "sentence": "13.0 Hz: so."}
    return {f"verify_{name}": [value] for name, value in (own | row).items()}


def examined(verdict: str, hz: float = 13.0) -> dict[str, list[object]]:
    own = {
        "case": 0,
        "frequency_hz": hz,
        "verdict": verdict,
        "sentence": f"13.000 Hz: {verdict}: the multiplier is 1.2",
    }
    return {f"stability_{name}": [value] for name, value in own.items()}


def many(at: tuple[int, ...]) -> np.ndarray:
    kept = np.zeros((6, 6), dtype=int)
    kept[:, :2] = 1
    kept[list(at)] = 1
    return kept


def test_records_of_a_result_have_the_rows_of_one_case_and_missing_values_for_what_it_lacks() -> None:
    two = np.array([0, 0, 0, 1, 1, 1])
    data = response(point_case=two, **{k: [*v, *v] for k, v in checked().items()})
    data = data.drop_vars(["verify_case", "own_error_percent", *(n for n, v in data.items() if v.dims == ("case",))])
    data = data.assign(verify_case=("check", [1, 0]), verify_settled=("check", [0, 1]), peak_point=("case", [1, -1]))
    own, last = (read(Points, data, case) for case in (0, 1))
    assert own.frequency_hz.tolist() == [10.0, 11.0, 12.0]
    assert np.shares_memory(last.frequency_hz, data["frequency_hz"].values)
    np.testing.assert_array_equal(own.own_error_percent, [np.nan] * 3)
    assert own.order.tolist() == [-1] * 3
    assert own.marched_sentence.tolist() == [""] * 3
    np.testing.assert_array_equal(own.audit_error_percent, [np.nan] * 3)
    assert read(PointFields, data, 1).amplitude.shape == (3, 1)
    assert [read(CaseNumbers, data, case).peak_point for case in (0, 1)] == [1, -1]
    assert math.isnan(read(CaseNumbers, data, 0).peak_amplitude)
    every: Any = read(CaseNumbers, data)
    assert every.peak_point.tolist() == [1, -1]
    assert every.peak_amplitude.shape == (2,)
    assert [int(said.verify_settled) for said in each(read(TimeChecks, data, 0))] == [1]
    assert [int(said.verify_settled) for said in each(read(TimeChecks, data))] == [0, 1]
    assert list(each(read(OtherMotions, data, 0))) == []
    assert (holds(TimeChecks, data), holds(OtherMotions, data)) == (True, False)
    apart = read(Points, data.assign(point_case=("point", [0, 1, 0, 1, 1, 0])), 0)
    assert apart.frequency_hz.tolist() == [10.0, 12.0, 15.0]


def test_verdicts_that_differ_in_the_case_alone_are_told_once() -> None:
    """As a designer sees them who varies the mass of a damper and its friction."""
    cannot = "damper in static equilibrium: left cannot slip to and fro, T/N reaches only {}"
    masses = ["5 g", "10 g", "20 g"]
    given = [
        Verdict("trusted", f"{mass}, mu {mu}", None, cannot.format(share), "See the angles.")
        for mass in masses
        for mu, share in ((0.3, "0.14 of 0.3"), (0.5, "0.37 of 0.5"))
    ]
    first, second = (f"NOTE: 5 g, 10 g, 20 g, each with mu {mu}: " for mu in (0.3, 0.5))
    texts = [cannot.format("0.14 of 0.3"), cannot.format("0.37 of 0.5")]
    assert in_lines(given, every=True) == [
        f"{first}{texts[0]}. See the angles.",
        f"{second}{texts[1]}. See the angles.",
    ]
    assert in_lines(given) == [f"{first}{texts[0]}. See the angles. Likewise: 5 g, 10 g, 20 g, each with mu 0.5."]
    assert concluded(given, "", bad=False).counts == "2 notes"
    # no product of values: each case by its name
    assert together(["5 g, mu 0.3", "10 g, mu 0.5"]) == "5 g, mu 0.3; 10 g, mu 0.5"
    # no product either: split by the part that gives the shortest text
    steps = ["k 2 N, f 1 N", "k 2 N, f 2 N", "k 5 N, f 1 N", "k 5 N, f 2 N", "k 5 N, f 3 N"]
    assert together(steps) == "f 1 N, 2 N, each with k 2 N; f 1 N, 2 N, 3 N, each with k 5 N"
    # trusted cases whose numbers differ, some of them equal: one line for all of them, again by their parts
    numbers = ("0.1 %", "0.2 %", "0.1 %", "0.3 %", "0.1 %")
    told = [Verdict("trusted", case, 10.0, f"peak, error {n}") for case, n in zip(steps, numbers, strict=True)]
    assert in_lines(told) == [f"TRUSTED: {together(steps)}."]
    assert together(["5 g, mu 0.3", "5 g, mu 0.5", "10 g, mu 0.3", "10 g, mu 0.5"]) == "5 g, 10 g with mu 0.3, 0.5"
    assert together(["5 g, 10 g, each with mu 0.3", "20 g, mu 0.5"]) == "5 g, 10 g, each with mu 0.3; 20 g, mu 0.5"


def test_lines_name_what_is_alike_once_and_all_of_them_on_request() -> None:
    """As a terminal has them."""
    fold = "stability undecided, modulus {}"
    given = [
        Verdict("trusted", "k = 1", 10.0, "peak with H = 1"),
        Verdict("doubtful", "k = 2", 11.0, fold.format(0.99), "Ask at 11 Hz."),
        Verdict("trusted", "k = 3", 12.0, "peak with H = 3"),
        Verdict("doubtful", "k = 4", 12.5, fold.format(1.01), "Ask at 12.5 Hz."),
        Verdict("doubtful", "k = 5", None, "3 points have no solution"),
        Verdict("doubtful", "k = 6", None, "4 audits failed"),
    ]
    assert in_lines(given) == [
        f"DOUBTFUL: k = 2: 11.00 Hz: {fold.format(0.99)}. Ask at 11 Hz. Likewise: k = 4 (12.5 Hz).",
        "DOUBTFUL: k = 5: 3 points have no solution.",
        "DOUBTFUL: k = 6: 4 audits failed.",
        "TRUSTED: k = 1, 3.",
    ]
    assert in_lines(given, every=True) == [str(v) for v in worst_first(given)]
    page = concluded(given, "", bad=True)
    assert [(t.verdict.case, t.likewise, [v.case for v in t.others]) for t in page.causes] == [
        ("k = 2", "Likewise: k = 4 (12.5 Hz).", ["k = 4"]),
        ("k = 5", "", []),
        ("k = 6", "", []),
    ]
    assert page.counts == "4 doubtful"
    assert [v.case for v in page.good] == ["k = 1", "k = 3"]
    assert page.kind == "bad"
    assert together(["a = 1, b = 2", "a = 1, b = 3"]) == "b = 2, 3, each with a = 1"
    assert together(["a = 1", "a = 2"]) == "a = 1, 2"
    assert together(["force 3 N", "force 5 N", "force 7 N"]) == "force 3 N, 5 N, 7 N"
    assert together(["10 g", "20 g"]) == "10 g, 20 g"
    assert together(["friction coefficient 0.4"]) == "friction coefficient 0.4"
    assert together(["a = 1", "b = 1"]) == "a = 1, b = 1"
    assert together(["a = 1", "a = 1, b = 3"]) == "a = 1; a = 1, b = 3"
    assert together(["a = 1"]) == "a = 1"


def test_what_a_worse_verdict_says_is_not_said_again_as_a_part_of_a_note() -> None:
    march = "multipliers lie outside the unit circle; in time its amplitude goes from 1 to 2 mm"
    doubtful = Verdict("doubtful", "", 11.0, march, "Give it more time.")
    note = Verdict("trusted", "", None, f"the largest motion is unstable; {march}", "See the points.")
    alone = Verdict("trusted", "", None, f"another is; {march}; and this", "See.")
    told = said_once([doubtful, note, alone, doubtful])
    assert told[0] == told[3] == doubtful
    assert told[1] == replace(note, why="the largest motion is unstable")
    assert told[2] == replace(alone, why="another is; and this")
    assert said_once([note]) == (note,)
    short = Verdict("doubtful", why="it folds")
    assert said_once([short, replace(note, why="a; it folds")])[1].why == "a; it folds"


def test_what_is_judged_and_good_is_trusted_and_says_what_was_not_examined() -> None:
    found, case, points = judged(response())
    assert case == "trusted"
    assert set(points) == {"trusted"}
    (only,) = found
    assert only == Verdict("trusted", "", 13.0, f"peak with H = 1{NO_STABILITY}, predicted error 1 %")
    assert not only.told


# changes of a good response, the level of the case, those of the points that are not trusted, and words of its verdict
RULES: dict[str, tuple[dict[str, object], str, dict[int, str], str]] = {
    "not converged": ({"status": values(1, 1, 0)}, "doubtful", {1: "wrong"}, "one of these points may be larger"),
    "none converged": ({"status": np.ones(6, dtype=int), "peak_point": [-1]}, "wrong", {}, "there is no peak"),
    "own error at the peak": (
        {"own_error_percent": values(TOP, 7.0, 1.0)},
        "doubtful",
        {TOP: "doubtful"},
        "predicted to change it by 7 %",
    ),
    "own error beside the peak": (
        {"own_error_percent": values(0, 250.0, 1.0)},
        "trusted",
        {0: "doubtful"},
        "predicted to change it by over 100 %",
    ),
    "never judged": (
        {"own_error_percent": values(TOP, np.nan, 1.0)},
        "doubtful",
        {TOP: "doubtful"},
        "were not examined",
    ),
    "judged by an audit": (
        {"own_error_percent": values(TOP, np.nan, 1.0), "audit_error_percent": values(TOP, 0.3)},
        "trusted",
        {},
        "difference from more harmonics 0.3 %",
    ),
    "audit": ({"audit_error_percent": values(TOP, 8.0)}, "doubtful", {TOP: "doubtful"}, "it differs by 8 %"),
    "audit of an output": (
        {"audit_error_percent": values(TOP, 8.0), "audit_error_of": np.full(6, "damper.rx")},
        "doubtful",
        {TOP: "doubtful"},
        "it differs by 8 % in damper.rx",
    ),
    "no audit": ({"audit_error_percent": np.full(6, np.nan)}, "doubtful", {}, "by predictions alone"),
    "no audit of points beside the peak": (
        {"audit_error_percent": np.full(6, np.nan), "harmonic_kept": many((TOP,))},
        "trusted",
        {},
        "at 5 points by predictions alone",
    ),
    "no audit, as nothing acts on what is left out": (
        {"audit_error_percent": np.full(6, np.nan), "own_error_percent": np.zeros(6)},
        "trusted",
        {},
        f"peak with H = 1{NO_STABILITY}, exact, as no force acts on the harmonics left out",
    ),
    "no audit, where something acts beside the peak": (
        {"audit_error_percent": np.full(6, np.nan), "own_error_percent": values(0, 1.0, 0.0)},
        "trusted",
        {},
        "at 1 point by predictions alone",
    ),
    "no audit, but twice the harmonics": (
        {"audit_error_percent": np.full(6, np.nan), "reference_error_percent": np.ones(6)},
        "trusted",
        {},
        "peak with H = 1",
    ),
    "no audit, but integrated": (
        {"audit_error_percent": np.full(6, np.nan)} | checked(motion="attained"),
        "trusted",
        {},
        "attained in time",
    ),
    "twice the harmonics": (
        {"reference_error_percent": values(TOP, 9.0, 1.0)},
        "doubtful",
        {TOP: "doubtful"},
        "amplitude or phase, by 9 %",
    ),
    "amplitude jumps": (
        {"amplitude": [1.0, 1.3, 1.6, 3.9, 3.5, 3.2], "harmonic_kept": many((3, 4, 5)), "loss": np.ones(6)},
        "doubtful",
        {2: "doubtful", 3: "doubtful"},
        "between 12.00 and 13.00 Hz (amplitude 2.44 times)",
    ),
    "dissipation jumps": (
        {"loss": [1.0, 250.0, 260.0, 270.0, 260.0, 250.0]},
        "trusted",
        {0: "doubtful", 1: "doubtful"},
        "between 10.00 and 11.00 Hz (dissipation 250 times)",
    ),
    "fold beside the peak": (
        {"frequency_hz": np.array([10.0, 11.0, 10.5, 13.0, 14.0, 15.0])},
        "trusted",
        {},
        "folds between 10.50 and 11.00",
    ),
    "fold at the peak": (
        {"frequency_hz": np.array([10.0, 11.0, 14.0, 13.0, 12.0, 15.0])},
        "doubtful",
        {},
        "the peak stands among them",
    ),
    "peak beyond the range, round a fold": (
        {"frequency_hz": np.array([10.0, 11.0, 12.0, 13.0, 12.5, 12.0]), "lowest_hz": [10.0], "highest_hz": [12.0]},
        "doubtful",
        {},
        "stands at 13.00 Hz, beyond what was asked for (10.00 to 12.00 Hz)",
    ),
    "peak at the end of the range, a fold beyond it": (
        {"frequency_hz": np.array([10.0, 11.0, 12.0, 13.0, 13.5, 12.7]), "lowest_hz": [10.0], "highest_hz": [13.0]},
        "doubtful",
        {},
        "stands at the end of the sweep (13.00 Hz)",
    ),
    "peak at the end of the range, a smaller one inside": (
        {"amplitude": [1.0, 2.0, 1.8, 2.4, 2.3, 2.2], "lowest_hz": [10.0], "highest_hz": [13.0]},
        "doubtful",
        {},
        "inside the sweep the largest maximum is 2000 mm at 11.00 Hz",
    ),
    "peak within the range, a fold beyond it": (
        {"frequency_hz": np.array([10.0, 11.0, 12.0, 13.0, 14.2, 14.0]), "lowest_hz": [10.0], "highest_hz": [14.0]},
        "trusted",
        {},
        "folds between 14.00 and 14.20",
    ),
    "unstable": (
        examined("unstable"),
        "wrong",
        {TOP: "wrong"},
        "a machine does not stay there: unstable: the multiplier is 1.2",
    ),
    "undecided": (
        examined("undecided"),
        "doubtful",
        {TOP: "doubtful"},
        "stability undecided: the multiplier",
    ),
    "stable": (examined("stable"), "trusted", {}, "peak with H = 1, stable, predicted error 1 %"),
    "stability not examined": (examined("not examined"), "trusted", {}, f"{NO_STABILITY[2:]} (the multiplier is 1.2)"),
    "unstable beside the peak": (
        examined("unstable", 11.0),
        "trusted",
        {1: "unstable"},
        "a machine does not stay there",
    ),
    "left": (checked(motion="left"), "wrong", {TOP: "wrong"}, "leaves it for another motion"),
    "not periodic": (checked(motion="not periodic"), "wrong", {TOP: "wrong"}, "is not periodic"),
    "wanders a little": (
        checked(motion="not periodic", scatter=0.006),
        "doubtful",
        {TOP: "doubtful"},
        "it wanders by 0.6 %",
    ),
    "next to it": (
        checked(motion="next to it", difference_percent=-0.3),
        "doubtful",
        {TOP: "doubtful"},
        "ends on another motion -0.3 % away",
    ),
    "not settled": (checked(settled=0), "doubtful", {TOP: "doubtful"}, "did not settle"),
    "attained": (checked(motion="attained"), "trusted", {}, "attained in time integration"),
    "attained, though something rings": (
        checked(motion="attained", settled=0),
        "trusted",
        {},
        "attained in time integration",
    ),
    "attained elsewhere": (
        checked(motion="attained", difference_percent=-1.4),
        "doubtful",
        {TOP: "doubtful"},
        "differ by -1.4 %",
    ),
    "never judged, but integrated": (
        checked(difference_percent=3.0) | {"own_error_percent": values(TOP, np.nan, 1.0)},
        "doubtful",
        {TOP: "doubtful"},
        "differ by +3 %",
    ),
    "undecided but attained": (
        examined("undecided") | checked(motion="attained"),
        "trusted",
        {},
        "attained in time integration",
    ),
    "predicted to be wrong but attained": (
        checked(motion="attained") | {"own_error_percent": values(TOP, 70.0, 1.0)},
        "trusted",
        {},
        "attained",
    ),
    "peak at the end": (
        {"amplitude": [1.0, 1.1, 1.2, 1.3, 1.4, 1.5], "peak_point": [5]},
        "doubtful",
        {},
        "it is no resonance",
    ),
    "output that does not move": ({"amplitude": np.full(6, 1e-20)}, "doubtful", {}, "tip.x does not move"),
    "retention": ({"retention_peak_shift": [-0.2]}, "doubtful", {}, "the peak changes by -20 %"),
    "little retention": ({"retention_peak_shift": [0.005]}, "trusted", {}, "peak with H = 1"),
    "more modes": (
        {"modes_peak_change": [-0.2], "modes_frequency_change_hz": [1.5]},
        "doubtful",
        {},
        "the peak changes by -20 % and +1.5 Hz with half again as many modes in the reduction",
    ),
    "fewer points": (
        {"points_peak_change": [0.2], "points_frequency_change_hz": [-1.5], "points_left_out": [12]},
        "doubtful",
        {},
        "the peak changes by +20 % and -1.5 Hz with half the points of its contacts (12 left out)",
    ),
    "modes that are enough": (
        {"modes_peak_change": [0.005], "modes_frequency_change_hz": [0.1]},
        "trusted",
        {},
        "peak with H = 1",
    ),
    "known to the job": ({"known_verdicts": [to_json([doubt("It may drift.")])]}, "doubtful", {}, "It may drift"),
}


# rows at the limits of rules, and beside them
OVER = float(np.nextafter(5.0, 6.0))
LIMITS: dict[str, tuple[dict[str, object], str, dict[int, str], str]] = {
    "own error at the limit": ({"own_error_percent": values(TOP, 5.0, 1.0)}, "trusted", {}, "predicted error 5 %"),
    "own error above it": (
        {"own_error_percent": values(TOP, OVER, 1.0)},
        "doubtful",
        {TOP: "doubtful"},
        "predicted to change it by 5 %",
    ),
    "audit at the limit": (
        {"audit_error_percent": values(TOP, 5.0)},
        "trusted",
        {},
        "difference from more harmonics 5 %",
    ),
    "audit above it": ({"audit_error_percent": values(TOP, OVER)}, "doubtful", {TOP: "doubtful"}, "it differs by 5 %"),
    "twice the harmonics at the limit": (
        {"reference_error_percent": values(TOP, 5.0, 1.0)},
        "trusted",
        {},
        "peak with H = 1",
    ),
    "twice the harmonics above it": (
        {"reference_error_percent": values(TOP, OVER, 1.0)},
        "doubtful",
        {TOP: "doubtful"},
        "amplitude or phase, by 5 %",
    ),
    "in time at the limit": (
        checked(motion="attained", difference_percent=-1.0),
        "trusted",
        {},
        "attained in time integration",
    ),
    "in time above it": (
        checked(motion="attained", difference_percent=-1.001),
        "doubtful",
        {TOP: "doubtful"},
        "differ by -1 %, more than 1 %",
    ),
    "wanders at the limit": (
        checked(motion="not periodic", scatter=0.01),
        "doubtful",
        {TOP: "doubtful"},
        "it wanders by 1 %",
    ),
    "wanders above it": (checked(motion="not periodic", scatter=0.0101), "wrong", {TOP: "wrong"}, "is not periodic"),
    "wanders little, elsewhere": (
        checked(motion="not periodic", scatter=0.005, difference_percent=1.1),
        "wrong",
        {TOP: "wrong"},
        "is not periodic",
    ),
    "retention at the limit": ({"retention_peak_shift": [-0.01]}, "trusted", {}, "peak with H = 1"),
    "retention above it": ({"retention_peak_shift": [0.0101]}, "doubtful", {}, "the peak changes by 1.01 %"),
    "output that hardly moves": ({"amplitude": np.full(6, 1e-18)}, "trusted", {}, "peak with H = 1"),
    "output just below it": ({"amplitude": np.full(6, 0.999e-18)}, "doubtful", {}, "tip.x does not move"),
    "peak at the first frequency": (
        {"amplitude": [1.5, 1.4, 1.3, 1.2, 1.1, 1.0], "peak_point": [0]},
        "doubtful",
        {},
        "at the end of the sweep (10.00 Hz)",
    ),
    "peak at the second frequency": (
        {"amplitude": [1.4, 1.5, 1.3, 1.2, 1.1, 1.0], "peak_point": [1]},
        "trusted",
        {},
        "peak with H = 1",
    ),
    "peak at the lower end of a fold": (
        {"frequency_hz": np.array([10.0, 11.0, 14.0, 13.0, 15.0, 16.0])},
        "doubtful",
        {},
        "and the peak stands among them",
    ),
    "peak below a fold": (
        {"frequency_hz": np.array([10.0, 11.0, 12.0, 12.9, 14.0, 13.0])},
        "trusted",
        {},
        "folds between 13.00 and 14.00",
    ),
}


@pytest.mark.parametrize("name", [*RULES, *LIMITS])
def test_rule(name: str) -> None:
    changes, case, of_points, words = (RULES | LIMITS)[name]
    found, level, points = judged(response(**changes))
    assert level == case
    if case != "wrong" or "status" not in changes:
        assert {i: p for i, p in enumerate(points) if p != "trusted"} == of_points
    assert any(words in v.why for v in found), found
    assert all(v.why and (v.remedy or not v.rank or "drift" in v.why) for v in found)


def test_a_jump_is_none_where_slip_begins_or_frequencies_are_given() -> None:
    grows = [1e-9, 1.0, 12.0, 30.0, 18.0, 1e-9]  # slip begins after the first point and ends before the last
    assert set(judged(response(loss=grows))[2]) == {"trusted"}
    faint = [1e-9, 1e-6, 1e-6, 270.0, 250.0, 240.0]  # a jump of what does not count, then one that does
    assert judged(response(loss=faint))[2][:4] == ["trusted", "trusted", "doubtful", "doubtful"]
    rounding = response(loss=[1e-22, 3e-20, 3e-20, 3e-20, 2e-20, 1e-20])
    shape = (6, 6, 1, 3, 2)
    for name in ("gap", "contact_force"):
        dims = ("point", "harmonic", "contact", "direction", "part")
        rounding[name] = dims, np.full(shape, 1e-4)
    assert set(judged(rounding)[2]) == {"trusted"}
    jump = {"loss": [1.0, 250.0, 260.0, 270.0, 260.0, 250.0]}
    assert set(judged(response({"stepped": 1}, **jump))[2]) == {"trusted"}


def test_a_sweep_downwards_does_not_fold() -> None:
    down = {"frequency_hz": HZ[::-1].copy(), "peak_point": [2]}
    assert not any("folds" in v.why for v in verdicts(response({"direction": "down"}, **down), [""]))
    assert any("folds" in v.why for v in verdicts(response(**down), [""]))


def test_points_of_a_rule_are_told_in_one_sentence_with_the_peak_first() -> None:
    errors = np.array([30.0, 1.0, 6.0, 7.0, 8.0, 1.0])
    (found,) = (v for v in verdicts(response(own_error_percent=errors), [""]) if v.rank)
    assert found.frequency_hz == 13.0
    assert "by 7 %; this concerns 4 of 6 points, 10.00 to 14.00 Hz, the most at 10.00 Hz (30 %)" in found.why
    (found,) = (v for v in verdicts(response(own_error_percent=values(0, 30.0, 1.0)), [""]) if v.rank)
    assert found.frequency_hz == 10.0
    assert "the like" not in found.why


def test_remedies_name_the_frequency_of_a_point_that_is_not_the_peak() -> None:
    for hz, said in (
        (13.0, "Run with --verify, which integrates in time at the peak, and"),
        (11.0, "Run forced_response.frequencies_hz = [11.00] alone with --verify, which integrates in time there, and"),
    ):
        found = [v for v in judged(response(**examined("undecided", hz)))[0] if v.rank]
        assert said in found[0].remedy


@pytest.mark.parametrize(
    ("cap", "said"),
    [
        (41, "Give more forced_response.points, or a narrower range. The search"),
        (5, "Raise limits.work_s or limits.memory_gb"),
        (None, 'Give harmonics.high = "auto"'),
    ],
)
def test_remedies_name_what_kept_a_point_from_more_harmonics(cap: int | None, said: str) -> None:
    auto = {} if cap is None else {"passages": "auto", "high_order": cap}
    data = response(auto, own_error_percent=values(TOP, 9.0, 1.0), harmonic_kept=many((TOP,)))
    (found,) = (v for v in judged(data)[0] if v.rank)
    assert said in found.remedy
    quiet = response(auto, harmonic_kept=many((TOP,)), **checked(difference_percent=3.0))
    (found,) = (v for v in judged(quiet)[0] if v.rank)
    assert ("Lower harmonics.alert_threshold_percent" in found.remedy) is (cap is not None)


def test_a_frequency_alone_is_no_end_of_a_sweep() -> None:
    alone = response().isel(point=[TOP]).assign(peak_point=("case", [0]))
    assert judged(alone)[1] == "trusted"


def test_remedies_fit_rigid_contacts() -> None:
    data = response(own_error_percent=np.full(6, np.nan))
    assert "with --verify-harmonics, which predicts" in verdicts(data, [""])[0].remedy
    data["contact_law"] = "contact", ["rigid_coulomb"]
    assert "no error is predicted for rigid contacts" in verdicts(data, [""])[0].remedy


def test_verdicts_are_ordered_and_go_to_json_and_back() -> None:
    good, bad = Verdict("trusted", "a", 1.0, "x"), Verdict("wrong", "a", None, "y", "Do.")
    middle = doubt("z. And more.", "b")
    assert max(good, bad, middle) is bad
    assert sorted([bad, good, middle]) == [good, middle, bad]
    assert from_json(to_json([good, bad, middle])) == (good, bad, middle)
    assert worst([]) == "trusted"
    assert worst(["doubtful", "wrong", "trusted"]) == "wrong"
    assert str(bad) == "WRONG: a: y. Do."
    assert str(middle) == "DOUBTFUL: b: z. And more."
    assert str(Verdict("trusted", "", 1.5, "folds", "Look.")) == "NOTE: 1.50 Hz: folds. Look."
    assert stored({"warnings": '["z. And more."]'}) == (doubt("z. And more."),)


def test_what_holds_for_every_case_is_said_once() -> None:
    each = [Verdict("doubtful", label, None, "units") for label in ("a", "b")]
    own = Verdict("doubtful", "a", 3.0, "here")
    assert of_all_cases([*each, own], ["a", "b"]) == (Verdict("doubtful", "", None, "units"), own)
    assert of_all_cases(each, ["a", "b", "c"]) == tuple(each)


def test_the_last_line_names_the_cases_that_are_not_trusted() -> None:
    data = xr.Dataset({"case_verdict": ("case", [0, 1, 2]), "case_label": ("case", ["a", "b", "c"])})
    waves = xr.Dataset(attrs={"verdicts": to_json([doubt("rough")])})
    tree = xr.DataTree.from_dict({"forced_response": data, "modes": waves})
    assert not_trusted(tree) == (
        "Not to be trusted as it stands: forced response: 1 of 3 cases wrong (c), 1 of 3 cases doubtful (b); modes: doubtful. "
        "See the verdicts."
    )
    first = data.isel(case=[0]).assign(verdict=("point", [0, 1, 2, 1]))
    off = data.isel(case=[0, 1]).assign_attrs(verdicts=to_json([Verdict("wrong", "b", 3.0, "it leaves")]))
    assert not_trusted(xr.DataTree.from_dict({"forced_response": off})) == (
        "Not to be trusted as it stands: forced response: wrong at single points of b, 1 of 2 cases doubtful (b). See the verdicts."
    )
    good = xr.DataTree.from_dict({"forced_response": first})
    assert not_trusted(good) == ""
    assert conclusion(good) == (
        "Every case is trusted; of 4 points 1 wrong, 2 doubtful, none of them the peak of its case."
    )
    good.attrs["complete"] = 0
    assert conclusion(good) == "Not to be trusted as it stands: the run is not complete. See the verdicts."
    one = xr.DataTree.from_dict({"forced_response": data.isel(case=[2])})
    assert "forced response: wrong. See" in not_trusted(one)
    assert of_tree(tree) == (doubt("rough"),)
    left = Verdict(
        "doubtful", "", None, "EO 18 rises", "Raise campbell.modes, now 4.", not_judged="EO 18 above 9368 rpm"
    )
    assert from_json(to_json([left])) == (left,)
    waves = xr.Dataset(attrs={"verdicts": to_json([left])})
    assert not_trusted(xr.DataTree.from_dict({"campbell": waves})) == ""
    told = "EO 18 above 9368 rpm not judged (raise campbell.modes, now 4). The rest is trusted."
    assert conclusion(xr.DataTree.from_dict({"campbell": waves})) == told
    # what was judged and is doubtful goes first
    both = xr.DataTree.from_dict(
        {"campbell": waves, "modes": xr.Dataset(attrs={"verdicts": to_json([doubt("rough")])})}
    )
    assert conclusion(both) == "Not to be trusted as it stands: modes: doubtful. See the verdicts."


def test_a_journey_says_the_same_on_the_screen_on_the_page_in_the_file_and_in_python(tmp_path: Path) -> None:
    # few harmonics everywhere: exact where all sticks, and off by more than a hundredth of a per mille where the brake slips
    changes = {
        "vary.load.shaker.force_n": "[0.01, 8.0]",
        "harmonics.selection": '"always_low"',
        "harmonics.alert_threshold_percent": "0.001",
    }
    said = done("run", str(write_four_masses(tmp_path, changes)))
    result = ss.Result.from_file(tmp_path / "results")
    data = result["forced_response"]
    assert data.case_verdict.values.tolist() == [0, 1]
    assert data.case_verdict.attrs["flag_meanings"] == "trusted doubtful wrong"
    assert stored(data.attrs) == result.verdicts
    page = unescape(re.sub(r"<[^>]*>", "", (tmp_path / "results/report.html").read_text("utf-8")))
    for v in result.verdicts:
        assert str(v) in said
        assert str(v) in page
        assert (str(v) in repr(result)) is v.told
    assert said.rstrip().splitlines()[-1] == result.not_trusted == result.conclusion
    assert result.conclusion in page
    assert result.conclusion in repr(result)
    assert "1 of 2 cases doubtful (force 8 N)" in said
    assert result.peaks["verdict"].tolist() == ["trusted", "doubtful"]
    assert math.isclose(result.verdicts[0].frequency_hz or 0.0, float(data.peak_frequency_hz[0]))
    good = result.verdicts[0]
    assert (good.level, good.case) == ("trusted", "force 0.01 N")
    assert str(good).startswith("TRUSTED: force 0.01 N: ")


def test_an_integration_examines_the_harmonics_of_its_point() -> None:
    data = response(own_error_percent=values(TOP, np.nan, 1.0), **checked(difference_percent=3.0))
    assert [v.why for v in verdicts(data, [""]) if "not examined" in v.why] == []


def test_points_of_the_peak_that_took_the_place_of_others_stand_along_the_branch() -> None:
    assert branch_length(np.array([0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0])) == 5
    assert branch_length(np.array([0.0, np.nan])) == 2
    assert branch_length(np.array([1.0, 1.0])) == 0
    amplitude = [1.0, 1.3, 1.6, 1.9, 1.5, 1.2]
    own = Curve(response(refinement=np.array([0, 0, 1, 1, 0, 1]), amplitude=amplitude), 0)
    assert own.branch.tolist() == [0, 1, 2, 3, 4]


def test_time_integration_speaks_for_all_outputs() -> None:
    """An amplitude that agrees does not settle a prediction where another output, or a phase, is off."""
    doubted = {"own_error_percent": values(TOP, 9.0, 1.0)}
    near = response(**doubted, **checked(outputs_percent=3.0))
    assert judged(near)[1] == "trusted"
    off = response(**doubted, **checked(outputs_percent=11.0))
    found, level, _ = judged(off)
    assert level == "doubtful"
    assert any("differ by 11 % in an output, phase included" in v.why for v in found)
    assert any("predicted to change it by 9 %" in v.why for v in found)


@pytest.mark.parametrize(("third", "word"), [(0.3, "note"), (0.01, "")])
def test_harmonic_that_the_amplitude_leaves_out_is_told(third: float, word: str) -> None:
    motion = np.zeros((6, 6, 1, 2))
    motion[:, 1, 0, 0], motion[:, 3, 0, 0] = 1.9, -1.9 * third
    data = response({"driven_harmonics": [1]})
    data["output_displacement"] = (("point", "harmonic", "output", "part"), motion)
    told = [v for v in verdicts(data, [""]) if "half of peak to peak" in v.why]
    assert [v.word for v in told] == [word] * bool(word)
    if told:
        # (1 + third) of the first harmonic at its crest is no crest here: cos x - 0.3 cos 3x has its own
        angle = np.linspace(0.0, 2 * np.pi, 100_001)
        whole = 1.9 * np.ptp(np.cos(angle) - third * np.cos(3 * angle)) / 2
        assert f"half of peak to peak is {1e3 * whole:.4g} mm" in told[0].why
        assert "harmonic 3" in told[0].why


def test_points_that_share_a_frequency_keep_their_own_stability() -> None:
    """A row belongs to the point of its own frequency, and among equal ones to that which has its word: not to the peak for being near."""
    hz = np.array([10.0, 11.0, 13.0 * (1 - 1e-11), 13.0, 13.0, 15.0])
    word = {"stable": 0, "unstable": 1, "neutral": 4}
    said = ["neutral", "stable", "unstable"]
    data = response(
        frequency_hz=hz,
        motion_stability=np.array([0, 0, word["neutral"], word["stable"], word["unstable"], 0]),
        stability_case=[0, 0, 0],
        stability_frequency_hz=hz[[2, 3, 4]],
        stability_verdict=said,
        stability_sentence=said,
    )
    own = Curve(data, 0)
    found = {point: str(row.stability_verdict) for point, row in own.examined}
    assert found == {2: "neutral", 3: "stable", 4: "unstable"}
    assert own.peak == TOP == 3
    assert own.peak_stability == "stable"
    assert judged(data)[1] == "trusted"
