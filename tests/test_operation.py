"""The operating range of a machine: inside, margins by hand, amplitudes there, and what is refused."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from small_v2 import write_four_masses
from synthetic_result import synthetic_result

import stickslip as ss
from stickslip.analyses.forced_response.page.chapter import cards
from stickslip.analyses.forced_response.page.curves import frequency_response
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.rules import operation
from stickslip.analyses.operation import InOperation, Met, Operating, answered, ends_of, of_frequencies
from stickslip.analyses.page import one_a_question
from stickslip.analyses.waves.verdicts import in_operation, safe_in_operation
from stickslip.errors import InputError
from stickslip.report.section import Card
from stickslip.study.file.model.loads import Operation
from stickslip.study.models.study import read_study
from stickslip.study.run import asked_for, not_used
from stickslip.units import HZ, millimetres


@pytest.mark.parametrize(
    ("value", "margin", "told"),
    [
        (90.0, -0.1, "10 % below"),
        (100.0, 0.0, "inside"),
        (120.0, 0.0, "inside"),
        (126.0, 0.05, "5 % above"),
    ],
)
def test_a_margin_is_over_the_nearer_end(value: float, margin: float, told: str) -> None:
    own = Operating(100.0, 120.0, "Hz")
    assert own.margin(value) == pytest.approx(margin, abs=1e-15)
    assert own.where(value) == told


@pytest.mark.parametrize(
    ("swept", "told"),
    [
        ((100.0, 120.0), ""),
        ((105.0, 130.0), "100 to 105 Hz"),
        ((90.0, 110.0), "110 to 120 Hz"),
        ((105.0, 110.0), "100 to 105 and 110 to 120 Hz"),
        ((130.0, 140.0), "all"),
        ((80.0, 90.0), "all"),
    ],
)
def test_what_a_sweep_leaves_out_lies_in_the_range(swept: tuple[float, float], told: str) -> None:
    assert Operating(100.0, 120.0, "Hz").beyond(*swept) == told


def test_speeds_become_frequencies_by_the_engine_order_or_are_refused() -> None:
    asked = Operation(operating_rpm=[3000.0, 3600.0])
    assert of_frequencies(asked, 4) == pytest.approx((200.0, 240.0))
    assert InOperation(**ends_of(asked)).operating == Operating(3000.0, 3600.0, "rpm")
    with pytest.raises(InputError, match=r"operation.operating_rpm: gives speeds .* Give operating_hz"):
        of_frequencies(asked, None)
    assert of_frequencies(Operation(operating_hz=[10.0, 20.0]), None) == (10.0, 20.0)
    assert InOperation(**ends_of(Operation(operating_hz=[10.0, 20.0]))).operating == Operating(10.0, 20.0, "Hz")
    assert not InOperation(**ends_of(Operation())).operating.known
    assert np.isnan(of_frequencies(Operation(), 4)).all()
    for given, said in (
        ({"operating_hz": [20.0, 10.0]}, "operating_hz"),
        ({"operating_hz": [10.0, 20.0], "operating_rpm": [1.0, 2.0]}, "cannot stand beside operating_hz"),
    ):
        with pytest.raises(ValueError, match=said):
            Operation(**given)


def ranged(low: float, high: float, *, rpm_per_hz: float = np.nan) -> tuple[xr.Dataset, Curve]:
    """One case with an operating range in Hz, or in rpm."""
    data = synthetic_result(ratios=(20,), n=24, verify=False)
    values = {"lowest_hz": low, "highest_hz": high, "lowest_rpm": low * rpm_per_hz, "highest_rpm": high * rpm_per_hz}
    swept = {
        f"{end}_hz": ("case", [float(of(data["frequency_hz"]))])
        for end, of in (("lowest", np.min), ("highest", np.max))
    }
    data = data.assign(swept).assign({f"operating_{name}": ("case", [value]) for name, value in values.items()})
    return data, Curve(data, 0)


def test_the_peak_is_told_with_its_place_and_the_largest_amplitude_in_the_range() -> None:
    peak = ranged(1.0, 2.0)[1].peak_hz
    (inside,) = operation(ranged(0.99 * peak, 1.01 * peak)[1])
    assert (inside.level, inside.points) == ("trusted", ())
    assert inside.why.startswith("the peak lies inside the operating range, ")
    # the range begins between two points above the peak: the amplitude there is on the straight line between them
    _, case = ranged(1.0, 2.0)
    order = np.argsort(case.hz)
    k = int(np.flatnonzero(case.hz[order] > peak)[1])
    (a, b), (y, z) = case.hz[order][k : k + 2], case.amplitude[order][k : k + 2]
    start = 0.75 * a + 0.25 * b
    data, case = ranged(start, float(case.hz.max()))
    assert case.largest_in_operation == pytest.approx((0.75 * y + 0.25 * z, start))
    (outside,) = operation(case)
    assert f"{peak:.5g} Hz is {100 * (1 - peak / start):.2g} % below it" in outside.why
    assert f"at {start:.5g} Hz" in outside.why
    response = Response(data)
    card = next(c for c in cards(response) if c.label == "margin of the peak to the operating range")
    assert card.value == f"{100 * (1 - peak / start):.2g} % below"
    figure = frequency_response(response)
    assert figure is not None
    (band,) = figure.figure.layout.shapes
    assert (band.x0, band.x1) == pytest.approx((start, case.hz.max()))
    assert "Shaded: the operating range." in figure.caption


@pytest.mark.parametrize("place", ["below", "above", "around the lower", "around both"])
def test_of_several_cases_the_peak_nearest_to_the_range_is_told(place: str) -> None:
    data = synthetic_result(ratios=(20, 5), n=24, verify=False)
    hz = data["frequency_hz"].values
    view = Response(data)
    peaks = [view.peak_hz(case) for case in view.cases]
    first, last = np.argsort(peaks)
    low, high = {
        "below": (0.8 * peaks[first], 0.9 * peaks[first]),
        "above": (1.1 * peaks[last], 1.2 * peaks[last]),
        "around the lower": (0.99 * peaks[first], 0.5 * (peaks[first] + peaks[last])),
        "around both": (0.9 * peaks[first], 1.1 * peaks[last]),
    }[place]
    ends = {"lowest_hz": hz.min(), "highest_hz": hz.max(), "operating_lowest_hz": low, "operating_highest_hz": high}
    ends |= {"operating_lowest_rpm": np.nan, "operating_highest_rpm": np.nan}
    response = Response(data.assign({name: ("case", [value] * 2) for name, value in ends.items()}))
    (card,) = (c for c in cards(response) if "operating range" in c.label)
    if place.startswith("around"):
        assert card.value == "Inside"
        assert card.label == f"{2 if place == 'around both' else 1} of 2 peaks in the operating range"
        return
    near, off = (first, peaks[first] / high - 1) if place == "below" else (last, 1 - peaks[last] / low)
    assert card.value == f"{100 * off:.2g} % {'above' if place == 'below' else 'below'}"
    assert card.label == "margin of the peak to the operating range"
    assert response.cases[near].where in card.note
    assert response.cases[1 - near].where not in card.note


def test_a_range_in_speeds_is_told_in_speeds_and_what_is_not_swept_is_doubted() -> None:
    _, plain = ranged(1.0, 2.0)
    low, high = plain.numbers.lowest_hz, plain.numbers.highest_hz
    left, found = operation(ranged(0.9 * low, high, rpm_per_hz=15.0)[1])
    assert left.level == "doubtful"
    assert left.why.startswith(
        f"the sweep leaves out {0.9 * low * 15:.5g} to {low * 15:.5g} rpm of the operating range"
    )
    assert found.why.endswith(f"{15 * plain.peak_hz:.5g} rpm")
    assert [f.level for f in operation(ranged(low, high)[1])] == ["trusted"]
    assert list(operation(Curve(synthetic_result(ratios=(20,), n=24, verify=False), 0))) == []


def test_crossings_are_held_against_the_operating_range() -> None:
    def diagram(low: float, high: float, unit: str = "rpm") -> Any:
        met = [Met(f"EO {m} with ND 6", m, v) for m, v in ((6, 5920.9), (8, 5038.3))]
        return SimpleNamespace(
            operating=Operating(low, high, unit), speeds_rpm=np.array([0.0, 6000.0]), met=met, speed_rpm=6000.0
        )

    (outside,) = in_operation(diagram(5200.0, 5900.0))
    assert "the nearest is 0.35 % above them, EO 6" in outside.why
    (inside,) = in_operation(diagram(5000.0, 5950.0))
    assert inside.why.startswith("2 crossings inside the operating speeds, 5000 to 5950 rpm: EO")
    beyond, _ = in_operation(diagram(5000.0, 6100.0))
    assert (beyond.level, beyond.remedy) == ("doubtful", "Widen campbell.speeds_rpm.")
    assert list(in_operation(diagram(np.nan, np.nan))) == []
    # EO 6 at 5920.9 rpm excites at 592.09 Hz, EO 8 at 5038.3 rpm at 671.77 Hz
    (hertz,) = in_operation(diagram(500.0, 590.0, "Hz"))
    assert (
        "lies in the operating range, 500 to 590 Hz; the nearest is 0.35 % above it, EO 6 with ND 6 at 592.09 Hz"
        in hertz.why
    )
    assert list(safe_in_operation(diagram(np.nan, np.nan))) == []
    # the interference diagram says the same of its resonances, and doubts that it is drawn elsewhere
    elsewhere, found = safe_in_operation(diagram(5000.0, 5300.0))
    assert (elsewhere.level, elsewhere.why.split(":")[0]) == (
        "doubtful",
        "the diagram is drawn at 6000 rpm, 13 % above the operating speeds, 5000 to 5300 rpm",
    )
    assert found.why.startswith(
        "1 resonance inside the operating speeds, 5000 to 5300 rpm: EO 8 with ND 6 at 5038.3 rpm"
    )
    (card,) = answered(Operating(5000.0, 5300.0, "rpm"), diagram(0.0, 1.0).met, "resonance")
    told = (card.value, card.label, card.note)
    assert told == ("1", "resonance inside the operating speeds, 5000 to 5300 rpm", "EO 8 with ND 6")


def test_two_diagrams_answer_one_question_once_by_the_worse_answer() -> None:
    speeds = Operating(5000.0, 5300.0, "rpm")
    met = [Met("EO 6 with ND 6", 6, 5920.9), Met("EO 8 with ND 6", 8, 5038.3)]
    (margin,), (inside,) = answered(speeds, met[:1], "resonance"), answered(speeds, met, "crossing")
    other = Card("590 Hz", "lowest natural frequency", "")
    assert one_a_question([margin, other, inside]) == [inside, other]
    assert one_a_question([inside, other, margin]) == [inside, other]
    (near,) = answered(Operating(5000.0, 5030.0, "rpm"), met, "crossing")
    (far,) = answered(Operating(5000.0, 5030.0, "rpm"), met[:1], "resonance")
    assert one_a_question([far, near]) == [near]


def test_a_range_that_no_analysis_uses_is_told(tmp_path: Path) -> None:
    path = write_four_masses(tmp_path)
    before, _, rest = path.read_text().partition("[forced_response]")
    text = before + "[nonlinear_mode]\nmodes = [1]\n\n" + rest[rest.index("\n[") :]
    limit = "[stress]\nfatigue_limit_pa = 3e8\nultimate_pa = 9e8\n"
    for extra, found in (("[operation]\noperating_hz = [10.0, 12.0]\n", 1), (limit, 1), ("", 0)):
        path.write_text(text + extra)
        study = read_study(path)
        told = not_used(study, asked_for(study))
        assert len(told) == found
        assert all("[nonlinear_mode] does not use it. Ask for [forced_response]" in t for t in told)


def test_the_amplitude_at_the_end_of_the_range_is_that_of_the_oscillator() -> None:
    """One mass with 2 % damping, driven by 1 N: resonance at 15.9 Hz below the range, the largest amplitude there at its lower end."""
    body = ss.model.lumped(np.eye(1), 1e4 * np.eye(1), np.eye(1) * 4.0, names=("m",))
    model = ss.Model(
        parts={"one": ss.Part(structure=body)},
        loads={"f": ss.Load(on="one.m", newton=1.0)},
        outputs=(ss.Output(name="m", on="one.m"),),
    )
    found = model.forced_response(frequency_hz=[12.0, 22.0], points=200, operating_hz=[18.0, 21.0], stability="off")
    data = found["forced_response"]
    assert data.operating_lowest_hz.values.tolist() == [18.0]
    assert data.operating_highest_hz.values.tolist() == [21.0]
    assert np.isnan([*data.operating_lowest_rpm.values, *data.operating_highest_rpm.values]).all()
    size, hz = Curve(data, 0).largest_in_operation
    omega = 18.0 * HZ
    assert hz == 18.0
    assert size == pytest.approx(1.0 / abs(1e4 - omega**2 + 4j * omega), rel=2e-3)  # straight between points
    told = next(str(v) for v in found.verdicts if "operating range" in str(v))
    margin = 100 * (1 - data.peak_frequency_hz.item() / 18.0)
    assert f"{margin:.2g} % below it, and the largest amplitude in it is {millimetres(size)} at 18 Hz" in told
