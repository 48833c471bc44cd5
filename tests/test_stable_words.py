"""What is told of stability: runs of many points, sentences for few, moduli beside 1, motions that could not be judged."""

import numpy as np
import plotly.graph_objects as go
import pytest
import xarray as xr

from stickslip.analyses.forced_response.stability.stable_words import (
    FEW,
    MOST_SENTENCES,
    Point,
    counts_line,
    stability_lines,
)
from stickslip.analyses.residual_tractions.page import SECTION, Tractions, band, resonances
from stickslip.response.bifurcations.found import Bifurcations
from stickslip.response.stability.found import Floquet, Stability, modulus_text


def points(words: str) -> list[Point]:
    named = {"s": "stable", "u": "undecided", "x": "unstable"}
    return [
        Point(100.0 + i, named[w], 0.99 if w == "s" else 1.01, 0.02, f"{100 + i} Hz: {named[w]}")
        for i, w in enumerate(words)
    ]


def test_few_points_are_told_one_by_one_and_many_in_runs() -> None:
    few = points("s" * FEW)
    assert stability_lines(few, 100.0) == tuple(p.sentence for p in few)
    head, *rest = stability_lines(points("sssssuusxsss"), 101.0)
    assert head == (
        "12 points: stable 100.000 to 104.000 Hz; undecided 105.000 to 106.000 Hz (largest multiplier 1.01 ± 0.02 at 105.000 Hz); "
        "stable 107.000 Hz; unstable 108.000 Hz (largest multiplier 1.01 ± 0.02); stable 109.000 to 111.000 Hz"
    )
    assert rest == ["101 Hz: stable", "105 Hz: undecided", "106 Hz: undecided", "108 Hz: unstable"]


def test_sentences_are_at_most_ten_with_the_peak_and_what_is_unstable() -> None:
    _, *rest = stability_lines(points("s" + "u" * 40 + "x"), 100.0)
    assert len(rest) == MOST_SENTENCES + 1
    assert rest[0] == "100 Hz: stable"
    assert rest[-2] == "141 Hz: unstable"
    assert rest[-1].startswith("32 more points")


@pytest.mark.parametrize(
    ("size", "error", "said"),
    [
        (1 - 2.1e-5, 3.2e-6, "1 - 2.1e-05 ± 3.2e-06"),
        (1 + 3e-4, 0.0, "1 + 0.0003"),
        (1.0, 1e-5, "1 ± 1e-05"),
        (0.8495, 0.0046, "0.8495 ± 0.0046"),
    ],
)
def test_a_modulus_beside_one_says_by_how_much(size: float, error: float, said: str) -> None:
    assert modulus_text(size, error) == said


def test_motions_that_could_not_be_judged_are_counted() -> None:
    sizes = np.array([0.9, 0.5], dtype=complex)
    good, bad = (Stability(Floquet(sizes), np.array([e, 0.0]), 0, 0, 0) for e in (0.0, 0.3))
    said = Bifurcations((), (), 3, (good, bad, None, good)).sentences[0]
    assert said == "no bifurcation was met on the branch, but 1 of 3 motions could not be judged"
    assert Bifurcations((), (), 1, (good,)).none_met == ("no bifurcation was met on the branch",)


def tractions(width: float) -> Tractions:
    own = np.array([1.0, 2.0])
    names = {"reference": own, "least": own, "most": own * (1 + width)}
    found = {f"{name}_amplitude": ("frequency", value) for name, value in names.items()}
    found["frequency_hz"] = ("frequency", np.array([10.0, 11.0]))
    found["resonance_amplitude"] = ("end", np.array([2.0, 2.0, 2.0 * (1 + width)]))
    found["resonance_hz"] = ("end", np.array([11.0, 11.0, 11.0]))
    return Tractions(xr.Dataset(found, attrs={"output": "tip.x", "harmonics": 1}))


def test_bounds_that_are_equal_are_no_band_and_no_tile() -> None:
    equal, apart = (band(tractions(width)) for width in (0.0, 0.1))
    assert equal is not None
    assert apart is not None
    assert isinstance(equal.figure, go.Figure)
    assert [t.name for t in equal.figure.data] == ["amplitude"]
    assert "bounds are equal" in equal.caption
    assert {"smallest", "largest"} <= {t.name for t in apart.figure.data}
    assert SECTION.cards(tractions(0.0)) == []
    assert len(SECTION.cards(tractions(0.1))) == 1
    assert "The bounds are equal." in str(resonances(tractions(0.0)))
    assert "The bounds are equal." not in str(resonances(tractions(0.1)))


@pytest.mark.parametrize(
    ("basis", "said"),
    [
        ([1, 0, 2, 2, 3, 1], "Of 6 points 2 examined, 2 carried, 1 by sign; 1 not examined"),
        ([2, 1, 1], "Of 3 points 2 examined, 1 carried"),
        ([0, 0], "Of 2 points none examined; 2 not examined"),
        ([1, 1, 1], ""),
        ([-1, -1], ""),
    ],
)
def test_points_are_counted_by_what_their_stability_rests_on(basis: list[int], said: str) -> None:
    own = [*basis, 1]  # and a point of another case
    case = [0] * len(basis) + [1]
    data = xr.Dataset({"motion_stability_basis": ("point", own), "point_case": ("point", case)})
    assert counts_line(data, 0) == said
