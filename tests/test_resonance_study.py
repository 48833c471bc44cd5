"""[resonance] of a study: benchmark numbers, several peaks and overtaking, folds, resuming, Python, the page."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from study_texts import DETACHED, JENKINS, answered, study_of

from stickslip.analyses.columns import record_of
from stickslip.analyses.resonance.analysis import RESONANCE
from stickslip.analyses.resonance.page import Peaks, amplitudes, peak_table
from stickslip.analyses.resonance.records import Resonances
from stickslip.analyses.resonance.verdicts import case_verdicts
from stickslip.api.study import Study
from stickslip.assembly.model import Model as Assembly
from stickslip.errors import InputError
from stickslip.study.store.netcdf import one_case

B3 = (
    JENKINS.replace("slip_limit_n = 0.1", "slip_limit_n = 0.2")
    + """
[resonance]
frequency_hz = [0.127, 0.223]
parameter = "contact.damper.slip_limit_n"
values = [0.2, 0.12, 0.09]
harmonics = 1
"""
)


def test_the_optimum_of_the_benchmark_from_a_study(tmp_path: Path) -> None:
    outcome = answered(B3, tmp_path)
    case = one_case(outcome.tree["resonance"].to_dataset(), 0)
    # literature benchmark B3, to its printed digits
    assert case.attrs["smallest_value"] == pytest.approx(0.138956, abs=5e-7)
    assert case.attrs["smallest_amplitude"] == pytest.approx(0.5509002, abs=5e-8)
    assert case["value"].values.tolist() == [[0.2, 0.12, 0.09]]
    own = outcome.tree["resonance"].to_dataset().isel(case=0).variables
    (trusted,) = case_verdicts("", record_of(Resonances, own), {}, [0.2, 0.12, 0.09])
    assert trusted.why.endswith("followed from the first value, not held against sweeps at the others")


@pytest.mark.parametrize(("key", "slow"), [("contact.damper.slip_limit_n", 1), ("limit", 0)])
def test_the_check_says_where_a_span_is_slow(key: str, slow: int, tmp_path: Path) -> None:
    text = B3.replace("values = [0.2, 0.12, 0.09]", "span = [0.2, 0.1]")
    (case,) = study_of(text.replace("contact.damper.slip_limit_n", key), tmp_path).cases()
    (told,) = RESONANCE.check(case, case.build())
    assert told.count("takes minutes where a contact begins to slip") == slow


def test_only_cases_with_a_lowest_peak_tell_where_it_is(tmp_path: Path) -> None:
    """With several cases those without one have no number there."""
    data = answered(B3 + "[vary]\nload.shaker.force_n = [0.1, 0.3]\n", tmp_path).tree["resonance"]
    lowest = [one_case(data.to_dataset(), i).attrs["smallest_value"] for i in range(2)]
    assert np.isfinite(lowest).tolist() == [True, False]
    lines = [table.lines for table in RESONANCE.summary(data.to_dataset())]
    assert [len(own) for own in lines] == [1, 0]


TWO_IN_ONE = """
schema_version = 2
[part.pair]
shape = "lumped"
masses_kg = [1.0, 1.0]
springs_n_per_m = [["ground", 1, 4e4], ["ground", 2, 4e4], [1, 2, 100.0]]
dashpots_n_s_per_m = [["ground", 1, 3.0], ["ground", 2, 3.0]]
[contact.damper]
between = ["pair.m1", "pair.m2"]
law = "jenkins"
tangential_stiffness_n_per_m = 6e3
slip_limit_n = 100.0
[load.shaker]
on = "pair.m1"
force_n = 5.0
[resonance]
frequency_hz = [24.0, 48.0]
parameter = "contact.damper.slip_limit_n"
values = [8, 4, 2, 1]
peaks = 2
harmonics = 1
"""


def test_two_peaks_that_become_one_are_one_from_there_on(tmp_path: Path) -> None:
    for values, second in (("[8, 4, 2, 1]", [8.0, 4.0]), ("[1, 2, 4, 8]", [4.0, 8.0])):
        text = TWO_IN_ONE.replace("[8, 4, 2, 1]", values)
        outcome = answered(text, tmp_path / values[1])
        case = one_case(outcome.tree["resonance"].to_dataset(), 0)
        (note,) = (v for v in outcome.verdicts if "has become one with another peak" in v.why)
        assert note.word == "note"
        assert "ends after 4: at 2 it" in note.why
        first, other = (v[np.isfinite(v)].tolist() for v in case["value"].values)
        assert sorted(first) == [1.0, 2.0, 4.0, 8.0]
        assert other == second
        assert "overtaking_value" not in case


def test_the_example_of_two_peaks_tells_where_one_overtakes_the_other(tmp_path: Path) -> None:
    text = (Path(__file__).parent.parent / "examples" / "two_peaks" / "study.toml").read_text("utf-8")
    few = text[: text.index("values = ")] + "values = [70, 60, 40, 25, 24]\npeaks = 2\n"
    outcome = answered(few, tmp_path)
    data = outcome.tree["resonance"].to_dataset()
    case = one_case(data, 0)
    assert case["overtaking_after"].values.tolist() == [1, 0]
    assert case["overtaking_value"].values == pytest.approx([67.0, 24.85], rel=0.01)
    assert case.attrs["smallest_amplitude"] == pytest.approx(1.772e-3, rel=0.01)
    words = [v.why for v in outcome.verdicts]
    assert words[0].startswith("peak 2 overtakes peak 1 at 67")
    # a sweep of the forced response at one limit has the same two tops
    sweep = few[: few.index("[resonance]")].replace("slip_limit_n = 100.0", "slip_limit_n = 40.0")
    sweep += '[forced_response]\nfrequency_hz = [20.0, 60.0]\npoints = 60\nstability = "off"\n[harmonics]\nhigh = 5\nlow = 5\nselection = "always_low"\n'
    node = answered(sweep, tmp_path / "sweep").tree["forced_response"].to_dataset()
    amplitude = np.sort(node["amplitude"].values.ravel()[np.isfinite(node["amplitude"].values.ravel())])
    assert amplitude[-1] == pytest.approx(float(np.nanmax(case["amplitude"].values[:, 2])), rel=1e-5)
    view = Peaks(case)
    assert "Overtaken: peak 1 by peak 2 at 67" in amplitudes(view).caption
    assert "mm" in str(peak_table(view))


def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path: Path) -> None:
    text = B3.replace("slip_limit_n = 0.2", "slip_limit_n = 0.25")
    (case,) = study_of(text, tmp_path).cases()
    inputs = RESONANCE.inputs(case, case.build())
    whole = list(RESONANCE.solve(inputs, [], Kept()))
    rest = list(RESONANCE.solve(inputs, whole[:2], Kept()))
    assert [p.value for p in rest] == [p.value for p in whole[2:]]
    assert [p.amplitude for p in rest] == pytest.approx([p.amplitude for p in whole[2:]], rel=1e-10)


class Kept(dict[str, Any]):
    """Notes in memory."""

    def put(self, name: str, values: Mapping[str, Any]) -> None:
        self[name] = dict(values)

    def forget(self, name):
        self.pop(name, None)


def test_a_curve_by_arc_length_goes_round_its_fold(tmp_path: Path) -> None:
    # softening: in quadrature, with one harmonic, force = 2 ζ a √(1 - ¾ c a²), largest at a² = 2/(3 c)
    text = (
        B3[: B3.index("[contact.damper]")]
        + """
[contact.softening]
between = ["blade.m1", "ground"]
law = "cubic_spring"
cubic_tangential_n_per_m3 = -0.5
[load.shaker]
on = "blade.m1"
force_n = 0.01
[resonance]
frequency_hz = [0.12, 0.2]
parameter = "excitation"
span = [0.5, 2.0]
points = 12
harmonics = 1
by = "phase_quadrature"
"""
    )
    outcome = answered(text, tmp_path)
    case = one_case(outcome.tree["resonance"].to_dataset(), 0)
    level, amplitude = case["value"].values[0], case["amplitude"].values[0]
    known = level[np.isfinite(amplitude)], amplitude[np.isfinite(amplitude)]
    omega = np.sqrt(1.0 - 0.375 * known[1] ** 2)
    assert 0.02 * omega * known[1] == pytest.approx(0.01 * known[0], rel=1e-8)
    turned = np.argmax(known[0])
    assert 0 < turned < known[0].size - 1
    assert known[0][turned] == pytest.approx(2.0 * np.sqrt(4.0 / 3.0) / np.sqrt(2.0), rel=1e-3)
    assert known[1][-1] > known[1][turned]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ('damper.slip_limit_n"', 'damper.slip_limt_n"'),
            "parameter: contact.damper.slip_limt_n = 0.2 is refused: there is no key 'slip_limt_n'. Did you mean",
        ),
        (
            ('"contact.damper.slip_limit_n"', '"resonance.peaks"'),
            "resonance.parameter: is resonance.peaks, which is no key of the model",
        ),
        (("[0.2, 0.12", "[-0.3, 0.12"), "slip_limit_n = -0.3 is refused: must be greater than or equal to 0"),
        (("0.12, 0.09]", "-0.12, 0.09]"), "slip_limit_n = -0.12 is refused: must be greater than or equal to 0"),
        (
            ('"contact.damper.slip_limit_n"\nvalues = [0.2, 0.12', '"limit"\nvalues = [0.2, -0.12'),
            "resonance: parameter: limit = -0.12 is refused",
        ),
        (
            ('"contact.damper.slip_limit_n"', '"static_load"'),
            "resonance.parameter: is static_load, but no static load acts",
        ),
        (("values = [0.2, 0.12, 0.09]", ""), "resonance.values: values and span are both missing"),
        (("harmonics = 1", "harmonics = 1\nharmonic = 3"), "resonance.harmonic: is 3, above harmonics = 1"),
        (
            ('"contact.damper.slip_limit_n"\nvalues = [0.2, 0.12', '"excitation"\nvalues = [1.0, -1.0'),
            r"study\.toml: resonance\.values: holds -1, and excitation is a factor .* Give factors above zero",
        ),
    ],
)
def test_what_cannot_be_followed_is_refused_by_its_key(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        answered(B3.replace(*change), tmp_path)


def test_a_range_without_a_peak_is_told(tmp_path: Path) -> None:
    outcome = answered(B3.replace("[0.127, 0.223]", "[0.3, 0.4]"), tmp_path)
    (told,) = outcome.verdicts
    assert told.level == "wrong"
    assert told.remedy == "Widen resonance.frequency_hz."


def test_python_asks_the_same(tmp_path: Path) -> None:
    model = Study.from_file(study_of(B3, tmp_path).path).model()
    keys = {"frequency_hz": (0.127, 0.223), "values": [0.3, 0.2], "harmonics": 1}
    by_field = model.resonance(parameter="limit", **keys).data["resonance"]

    def of(limit: float) -> Assembly:
        contact = model.contacts["damper"]
        return replace(model, contacts={"damper": replace(contact, law=replace(contact.law, limit=limit))})

    by_function = model.resonance(of, **keys).data["resonance"]
    for name in ("amplitude", "frequency_hz", "energy"):
        assert by_function[name].values == pytest.approx(by_field[name].values, rel=1e-9)


def test_curves_by_arc_length_overtake_each_other_too(tmp_path: Path) -> None:
    text = (Path(__file__).parent.parent / "examples" / "two_peaks" / "study.toml").read_text("utf-8")
    few = text[: text.index("values = ")] + "span = [100, 62]\npoints = 4\npeaks = 2\nharmonics = 3\n"
    case = one_case(answered(few, tmp_path).tree["resonance"].to_dataset(), 0)
    assert case["overtaking_after"].values.tolist() == [1]
    assert case["overtaking_value"].values == pytest.approx([67.0], rel=0.03)
    assert case.attrs["smallest_amplitude"] == pytest.approx(2.837e-3, rel=1e-3)


def test_too_few_harmonics_are_told(tmp_path: Path) -> None:
    text = B3.replace('law = "jenkins"', 'law = "unilateral_spring"')
    text = text.replace("tangential_stiffness_n_per_m = 0.5\nslip_limit_n = 0.2\n", "normal_stiffness_n_per_m = 3.0\n")
    text = text.replace('"contact.damper.slip_limit_n"\nvalues = [0.2, 0.12, 0.09]', '"excitation"\nvalues = [1.0]')
    text = text.replace("[0.127, 0.223]", "[0.15, 0.3]")
    (told,) = answered(text, tmp_path / "few").verdicts
    assert "with 3 harmonics" in told.why
    assert told.remedy == "Raise resonance.harmonics."
    (trusted,) = answered(text.replace("harmonics = 1", "harmonics = 6"), tmp_path / "more").verdicts
    assert trusted.level == "trusted"


def test_a_peak_that_no_sweep_at_its_value_meets_is_doubtful(tmp_path: Path) -> None:
    # softening, then hardening: up to 1 the upper peak is that of a detached curve, at 2 a sweep goes over it
    text = (
        DETACHED
        + """
[resonance]
frequency_hz = [0.016, 0.3]
parameter = "excitation"
values = [0.95, 1.0, 2.0]
harmonics = 1
"""
    )
    outcome = answered(text, tmp_path)
    (told,) = (v for v in outcome.verdicts if "followed back" in v.why)
    assert told.level == "doubtful"
    assert (
        told.why
        == "peak 2 at 1, 0.95 was followed back from the last value: sweeps at these values were not seen to reach it"
    )
    assert "[all_motions]" in told.remedy


def test_a_key_that_the_cases_vary_too_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"resonance\.parameter: .* which \[vary\] varies too.*Drop it"):
        answered(f"{B3}[vary]\ncontact.damper.slip_limit_n = [0.2, 0.1]\n", tmp_path)
