"""The page of a mistuned wheel: its peak is that of the largest blade of each case, as in the terminal."""

import numpy as np
import pytest
import xarray as xr
from synthetic_result import synthetic_result

from stickslip.analyses.forced_response.page.chapter import cards
from stickslip.analyses.forced_response.page.curves import frequency_response
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.page.wheel import blades, wheel_at_peak
from stickslip.analyses.forced_response.verdicts.curve import Curve, peak_output
from stickslip.assembly.sides.mistuned import listed, of_all

BLADES = [f"tip[{n}].x" for n in range(3)]


def wheel(report_output: str = BLADES[0], largest: tuple[int, int] = (0, 2)) -> xr.Dataset:
    """Two cases whose largest blade differs: of the others, one moves half as much and one a tenth."""
    data = synthetic_result(ratios=(20, 5), n=12)
    share = np.full((2, 3), 0.1)
    share[[0, 1], [0, 2]] = 1.0
    share[:, 1] = 0.5
    size = data["amplitude"].values[:, :1] * share[data["point_case"].values]
    data = data.assign_coords(output=BLADES)
    data["amplitude"] = ("point", "output"), size
    data["largest_blade"] = "case", list(largest)
    data["blade_peak_amplitude"] = ("case", "blade"), share
    data["amplification"] = "case", [1.25, 1.5]
    data["peak_amplitude"] = (
        "case",
        [
            size[int(p), BLADES.index(report_output) if report_output != BLADES[0] else (0, 2)[c]]
            for c, p in enumerate(data["peak_point"].values)
        ],
    )
    return data.assign_attrs(report_output=report_output)


def test_the_peak_is_of_the_largest_blade_of_each_case() -> None:
    data = wheel()
    view = Response(data)
    assert view.outputs.tolist() == [0, 2]
    for case in view.cases:
        peak = data["peak_amplitude"].values[case.index]
        assert view.peak_response(case) * case.excitation == pytest.approx(peak, rel=1e-12)
        curve = Curve(data, case.index)
        assert curve.amplitude[curve.peak] == peak
        assert curve.output == BLADES[(0, 2)[case.index]]
    plot = frequency_response(view)
    assert plot is not None
    drawn = [np.nanmax(plot.figure.data[k].y) for k in (0, 1)]
    peaks = [view.peak_response(c) * view.scale.factor for c in view.cases]
    assert drawn == pytest.approx(peaks, rel=1e-12)
    assert "tip.x of the blade that is largest at the peak of each case" in plot.caption
    assert "Hz (tip[2].x) with load.shaker.ratio = 5" in plot.caption


def test_a_tile_tells_amplification_and_largest_blade() -> None:
    shown = cards(Response(wheel()))
    (tile,) = (c for c in shown if "amplification" in c.label)
    assert tile.value == "1.5"
    assert tile.note.startswith("largest: blade 2 with load.shaker.ratio = 5; smallest of 2 cases 1.25, blade 0")
    (shift,) = (c for c in shown if "shift of the peak" in c.label)
    assert "Hz (tip[0].x) with" in shift.note
    assert "Hz (tip[2].x) with" in shift.note
    assert ". 1.5 times the wheel with all sectors alike. " in shown[0].note  # of the case with the smallest peak


def test_a_blade_that_is_named_stays_the_one_of_the_peak() -> None:
    data = wheel(BLADES[1])
    view = Response(data)
    assert [peak_output(data, k) for k in (0, 1)] == [1, 1]
    assert view.output_name == BLADES[1]
    assert not view.mistuned


def test_the_wheel_at_its_peak_is_drawn_at_the_instant_of_the_largest_blade_and_without_motion_as_nothing() -> None:
    """The second case does not move; three blades of the first move with the wave 1, and with the mean."""
    motion = np.zeros((2, 3), dtype=complex)
    motion[0] = 1e-4j * (1.0 + 3.0 * np.exp(2j * np.pi * np.arange(3) / 3))
    data = wheel()
    data["blade_motion"] = ("case", "blade", "part"), np.stack([motion.real, motion.imag], axis=-1)
    data["wave_amplitude"] = ("case", "wave"), np.abs(np.fft.fft(motion, axis=1)) / 3
    data["localisation"] = "case", [0.5, 0.0]
    plot = wheel_at_peak(Response(data))
    assert plot is not None
    sizes, instants = ([np.asarray(own.r, dtype=float) for own in plot.figure.data[k::3]] for k in (0, 1))
    closed = np.append(motion[0], motion[0, 0])
    assert sizes[0] / sizes[0][0] == pytest.approx(np.abs(closed) / 4e-4, rel=1e-6)
    assert instants[0] / sizes[0][0] == pytest.approx(np.abs(closed.imag) / 4e-4, abs=1e-6)  # blade 0 moves as i
    assert sizes[1].tolist() == instants[1].tolist() == [0.0] * 4
    assert plot.case_captions[0].startswith(
        "Wave 1 (1 nodal diameters) carries 90 % of the sum of squares; localisation factor 0.5 "
    )
    assert plot.case_captions[1].startswith(
        "Wave 0 (0 nodal diameters) carries 0 % of the sum of squares; localisation factor 0 "
    )


def test_labels_of_all_blades_are_told_by_the_first_and_the_last() -> None:
    both = of_all(("tip.x", "root.y"), 24)
    assert listed(both) == "tip[0].x to tip[23].x, root[0].y to root[23].y"
    assert listed(of_all(("tip",), 3)) == "tip[0] to tip[2]"
    for few in (("tip[0].x", "tip[1].x"), ("a[0].x", "a[2].x", "a[3].x"), ("tip1.x", "L1.2.w")):
        assert listed(few) == ", ".join(few)


@pytest.mark.parametrize("unknown", [0, 1])
def test_the_wheel_with_all_sectors_alike_is_drawn_at_the_speeds_of_its_frequencies(
    unknown: int,
) -> None:
    data = wheel()
    rpm = 20.0 * data["frequency_hz"].values  # engine order 3
    rpm[:unknown] = np.nan  # a point of which the speed is not known decides nothing
    hertz = [150.0, 160.0, 155.0]
    data["speed_rpm"], data["whitehead"] = ("point", rpm), ("case", [1.3, 1.3])
    data["tuned_case"] = "tuned_point", [0, 0, 1]
    data["tuned_frequency_hz"], data["tuned_amplitude"] = ("tuned_point", hertz), ("tuned_point", [1e-6, 2e-6, 3e-6])
    plot = blades(Response(data))
    assert plot is not None
    alike = [t for t in plot.figure.data if t.name == "all sectors alike"]
    assert [t.x.tolist() for t in alike] == [pytest.approx([3000.0, 3200.0]), pytest.approx([3100.0])]
    size = np.concatenate([t.y for t in alike])
    assert size / size[0] == pytest.approx([1.0, 2.0, 3.0])
