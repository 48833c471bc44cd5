"""[limit_cycle] of a study: benchmark numbers, resuming, Python, the page; the wheel of examples/flutter_ring run small."""

import logging
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_v2 import EXAMPLES, changed
from study_texts import JENKINS, answered, study_of

import stickslip as ss
from stickslip.analyses.columns import record_of
from stickslip.analyses.limit_cycle.analysis import LIMIT_CYCLE, _without, compete
from stickslip.analyses.limit_cycle.page import Cycles, cycle_table
from stickslip.analyses.limit_cycle.records import LimitCycles
from stickslip.analyses.limit_cycle.verdicts import case_verdicts
from stickslip.analyses.page import plots
from stickslip.errors import InputError
from stickslip.study.store.journal import JobJournal
from stickslip.study.store.netcdf import one_case

B13 = (
    JENKINS.replace("0.02]]", "-0.1]]").replace("force_n = 0.1", "force_n = 1.0")
    + """
[limit_cycle]
harmonics = 1
most_harmonics = 1
points = 15
amplitude_mm = [150.0, 3000.0]
"""
)


def test_the_benchmark_from_a_study_and_its_words(tmp_path: Path) -> None:
    outcome = answered(B13, tmp_path)
    data = outcome.tree["limit_cycle"].to_dataset()
    case = one_case(data, 0)
    assert case["cycle_amplitude"].values == pytest.approx([0.2656867890, 0.9773932296], rel=1e-8)
    hertz = 2 * np.pi * case["cycle_frequency_hz"].values
    assert hertz == pytest.approx([1.1848086907, 1.0361251606], rel=1e-8)
    assert list(case["cycle_slope"].values > 0) == [True, False]
    assert case["mode_damping_ratio"].values == pytest.approx(-0.05 / np.sqrt(1.5), rel=1e-9)
    assert float(case["slip_amplitude"][0]) == pytest.approx(0.2, rel=0.02)
    # the load of the study is left out, and its place is what is reported
    assert case.attrs["output"] == "shaker.x"
    # one set of harmonics proves nothing
    told = " ".join(v.why for v in outcome.verdicts)
    assert "was solved with one set of harmonics alone" in told
    assert [t.title for t in outcome.summaries["limit_cycle"]][1] == "Limit cycles"
    assert "attracting" in str(outcome.summaries["limit_cycle"][1].rows)
    figures = plots(outcome.tree)
    assert {"limit_cycles", "limit_cycle_frequency"} <= set(figures)
    curve = figures["limit_cycles"].data[0]
    assert np.sign(curve.y[0]) == np.sign(curve.y[-1]) == -1
    assert max(curve.y) == pytest.approx(100 * float(case["largest_damping_ratio"][0]))
    # the line over the amplitude goes through the limit cycles
    along = figures["limit_cycle_frequency"]
    at = np.array(along.data[0].x) / along.layout.meta["factor"]
    for amplitude, hz in zip(case["cycle_amplitude"].values, case["cycle_frequency_hz"].values, strict=True):
        nearest = int(np.argmin(np.abs(at - amplitude)))
        assert (at[nearest], along.data[0].y[nearest]) == pytest.approx((amplitude, hz), rel=1e-12)
    assert "985" not in str(cycle_table(Cycles(case)))
    assert "977.39 mm" in str(cycle_table(Cycles(case)))


def test_harmonics_are_raised_and_time_confirms(tmp_path: Path) -> None:
    text = changed(B13, {"limit_cycle.most_harmonics": "41", "limit_cycle.periods": "60"})
    outcome = answered(text, tmp_path, frozenset({"verify"}))
    case = one_case(outcome.tree["limit_cycle"].to_dataset(), 0)
    assert case["cycle_enough"].values.tolist() == [1, 1]
    assert case["cycle_harmonics"].values.min() > 10
    assert case["cycle_stability"].values.tolist() == ["stable", "unstable"]
    assert np.all(case["cycle_along"].values < 1e-5)
    assert float(case["cycle_time_amplitude"][0]) == pytest.approx(float(case["cycle_amplitude"][0]), rel=1e-4)
    assert float(case["cycle_time_frequency_hz"][0]) == pytest.approx(float(case["cycle_frequency_hz"][0]), rel=1e-4)
    assert np.isnan(float(case["cycle_time_amplitude"][1]))
    assert not [v for v in outcome.verdicts if v.rank]


def test_python_gives_the_same_and_a_sealed_mode_is_not_solved_again(tmp_path: Path) -> None:
    (case,) = study_of(B13, tmp_path).cases()
    model = case.build()
    front = ss.Model(**{f: getattr(model, f) for f in ("parts", "contacts", "loads", "outputs")})
    result = front.limit_cycle(harmonics=1, most_harmonics=1, points=15, amplitude_mm=[150.0, 3000.0])
    own = one_case(result.data["limit_cycle"].to_dataset(), 0)
    question = LIMIT_CYCLE.inputs(case, model)
    with JobJournal(tmp_path / "a.part", LIMIT_CYCLE.record) as journal:
        records = list(LIMIT_CYCLE.solve(question, (), journal))
        assert [c.amplitude for c in records[0].cycles] == pytest.approx(own["cycle_amplitude"].values, rel=1e-12)
        assert list(LIMIT_CYCLE.solve(question, records, journal)) == []


def flutter_ring(folder: Path, **keys: str) -> str:
    """The example with few amplitudes and harmonics."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(EXAMPLES / "flutter_ring" / "coefficients.csv", folder)
    text = (EXAMPLES / "flutter_ring" / "study.toml").read_text(encoding="utf-8")
    few = {"points": "8", "harmonics": "3", "most_harmonics": "7", "in_time": "false"}
    few |= {"amplitude_mm": "[0.004, 0.3]"} | keys
    return changed(text, {f"limit_cycle.{key}": value for key, value in few.items()})


def test_the_ring_holds_two_waves_and_one_is_left(tmp_path: Path) -> None:
    outcome = answered(flutter_ring(tmp_path), tmp_path)
    case = one_case(outcome.tree["limit_cycle"].to_dataset(), 0)
    ratios = case["linear_damping_ratio"].values
    assert ratios.shape[0] == 12
    assert sorted(case["linear_wave"].values[np.any(ratios < 0, axis=1)]) == [1, 2]
    assert case["wave_number"].values.tolist() == [1, 2]
    assert case["nodal_diameter"].values.tolist() == [1, 2]
    assert case["cycle_branch"].values.tolist() == [0, 0, 1, 1]
    assert list(case["cycle_slope"].values > 0) == [True, False, True, False]
    words = case["cycle_stability"].values.tolist()
    assert words[0] == "stable"
    assert words[1] == words[3] == "unstable"
    assert case["cycle_growing_wave"].values[[1, 3]].tolist() == [1, 2]
    assert "cycle_time_amplitude" not in case
    assert "competing_waves" not in plots(outcome.tree)


@pytest.mark.validation
def test_waves_compete_in_time_and_what_has_no_flutter_says_so(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "stickslip")
    keys = {"in_time": "true", "periods": "64", "most_harmonics": "3", "points": "5"}
    outcome = answered(flutter_ring(tmp_path / "a", **keys), tmp_path / "a")
    case = one_case(outcome.tree["limit_cycle"].to_dataset(), 0)
    assert case["wave_amplitude"].shape == (4, 12)
    first = case["wave_amplitude"].values[0]
    assert sorted(np.argsort(first)[-2:]) == [1, 2]
    assert "competing_waves" in plots(outcome.tree)
    # so few periods leave no cycle and settle nothing: neither reads as an answer
    assert "; that confirms nothing: the cycle is unstable" in caplog.text
    assert "% off; unstable, no confirmation)" in str(cycle_table(Cycles(case)))
    (leaves,) = (v for v in outcome.verdicts if "amplitude, but wave 1 at 619." in v.why)
    assert "from a mixed start of all unstable waves, in time: not settled yet" in leaves.remedy
    (mixed,) = (v for v in outcome.verdicts if "mixed start" in v.why)
    assert mixed.rank
    assert "the motion still grows, wave 1 most (wave 1 has 0.00" in mixed.why
    assert mixed.remedy == "limit_cycle.periods were too few to settle: raise it."
    own = case.assign(cycle_growing_wave=("cycle", [2, 1, 2, 2]))
    told = [v.why for v in case_verdicts("", record_of(LimitCycles, own))]
    assert any("but a modulation of it, by wave 2 itself at 619." in why for why in told)
    words = ("cycle", ["stable", "unstable", "unstable", "unstable"])
    stable = case.assign(cycle_stability=words, outcome=case.attrs["outcome"])
    told = [v.why for v in case_verdicts("", record_of(LimitCycles, stable)) if "mixed start" in v.why]
    assert "; its stable limit cycle 0.0231 mm)" in told[0]
    # that a mode was left out which grows is told
    assert not any("not followed" in v.why for v in case_verdicts("", record_of(LimitCycles, case)))
    first = case.isel(branch=[0]).drop_dims("cycle")
    assert "1 of 2 modes that grow" in case_verdicts("", record_of(LimitCycles, first))[0].why
    # with the ratio of the structure alone twice as large nothing grows
    text = changed(flutter_ring(tmp_path / "b"), {"part.blisk.damping.modal_ratio": "5e-3"})
    still = answered(text, tmp_path / "b")
    none = one_case(still.tree["limit_cycle"].to_dataset(), 0)
    assert "wave_number" not in none
    assert none["linear_damping_ratio"].values.min() > 0
    assert any("no mode computed grows" in v.why for v in still.verdicts)
    assert plots(still.tree) == {}


def test_waves_without_a_found_cycle_compete_from_where_they_slip(tmp_path: Path) -> None:
    (case,) = study_of(flutter_ring(tmp_path, periods="64"), tmp_path).cases()
    question = LIMIT_CYCLE.inputs(case, case.build())
    found = [(w, m) for w in (1, 2) for m in question.followed(question.modes(w))]
    lost = [_without(wave, mode, "") for wave, mode in found]
    assert "slips" in compete(question, lost)["left_out"]
    slip = {1: 1e-7, 2: 3e-7}
    told = compete(question, [replace(b, slip_amplitude=slip[b.wave_number]) for b in lost])
    assert told["left_out"] == ""
    grown = told["amplitude"][0, [1, 2]] / [1e-7, 3e-7]
    # so small everything sticks: in the middle of the first window, eight periods on, each has grown by its damping
    wanted = [np.exp(-m.ratio * m.omega * told["time"][0]) for _, m in found]
    np.testing.assert_allclose(grown, wanted, rtol=0.02)
    assert np.all(np.delete(told["amplitude"][0], [1, 2]) < 0.01 * told["amplitude"][0, 2])


def test_what_friction_cannot_bound_is_told(tmp_path: Path) -> None:
    outcome = answered(changed(B13, {"part.blade.dashpots_n_s_per_m": '[["ground", 1, -0.2]]'}), tmp_path)
    case = one_case(outcome.tree["limit_cycle"].to_dataset(), 0)
    assert "cycle_amplitude" not in case
    assert any("friction cannot bound it" in v.why for v in outcome.verdicts)
    assert "Friction cannot bound" in str(cycle_table(Cycles(case)))
    assert case_verdicts("", record_of(LimitCycles, case))


def test_what_cannot_be_asked_is_refused(tmp_path: Path) -> None:
    (case,) = study_of(changed(B13, {"limit_cycle.wave_numbers": "[1]"}), tmp_path).cases()
    with pytest.raises(InputError, match="are those of a tuned wheel"):
        LIMIT_CYCLE.inputs(case, case.build())
    text = flutter_ring(tmp_path / "ring", wave_numbers="[12]")
    (wheel,) = study_of(text, tmp_path / "ring").cases()
    with pytest.raises(InputError, match="12 sectors have the waves 0 to 11"):
        LIMIT_CYCLE.inputs(wheel, wheel.build())
    rigid = B13.replace('law = "jenkins"', 'law = "rigid_coulomb"').replace(
        "tangential_stiffness_n_per_m = 0.5\nslip_limit_n = 0.1", "friction_coefficient = 0.3\npreload_n = 1.0"
    )
    (stiff,) = study_of(rigid, tmp_path).cases()
    with pytest.raises(InputError, match="a contact is rigid"):
        LIMIT_CYCLE.inputs(stiff, stiff.build())


SHROUDS = """
schema_version = 2
[part.wheel]
shape = "lumped"
sectors = 5
masses_kg = [1.2, 0.33]
names = ["disk", "blade"]
springs_n_per_m = [["disk", "ground", 6.5e5], ["disk", "next.disk", 2.2e5], ["disk", "blade", 7.9e4]]
dashpots_n_s_per_m = [["disk", "ground", 4.5], ["disk", "blade", 0.9]]
[contact.shroud]
between = ["wheel.blade", "next.wheel.blade"]
law = "jenkins"
tangential_stiffness_n_per_m = 7.5e3
slip_limit_n = 1.9
[output]
points = { tip = "wheel.blade" }
[aero]
file = "c.csv"
reference_hz = 80
points = { tip = { on = "wheel.blade", direction = "x" } }
[limit_cycle]
harmonics = 3
most_harmonics = 3
points = 6
amplitude_mm = [0.05, 2.0]
in_time = true
periods = 60
"""


def flow(folder: Path) -> dict[int, complex]:
    """Write coefficients by neighbour that feed wave 4 of the wheel."""
    fluid = {-1: 250 - 500j, 0: -150 + 100j, 1: -250 + 500j}
    rows = [f"{j},tip,tip,{c.real},{c.imag}" for j, c in fluid.items()]
    head = "neighbour,force_point,motion_point,real_n_per_m,imag_n_per_m"
    (folder / "c.csv").write_text("\n".join([head, *rows]), encoding="utf-8")
    return fluid


@pytest.mark.validation
def test_blades_that_hardly_differ_come_to_the_cycle_of_the_tuned_wheel(tmp_path: Path) -> None:
    """Undamped modes of such a wheel stand still and are fed from one side as much as they lose on the other."""
    flow(tmp_path)
    text = SHROUDS.replace("in_time = true\nperiods = 60\n", "")
    blades = "[mistuning.blades]\nof = 'wheel.blade'\ndeviations = [1e-6, -2e-6, 0.5e-6, 1e-6, -1e-6]\n"
    tuned, mistuned = (
        one_case(answered(written, tmp_path).tree["limit_cycle"].to_dataset(), 0) for written in (text, text + blades)
    )
    for name, off in (("mode_damping_ratio", 1e-4), ("cycle_amplitude", 1e-4), ("cycle_frequency_hz", 2e-6)):
        np.testing.assert_allclose(mistuned[name].values, tuned[name].values, rtol=off)


def test_what_grows_is_judged_with_coefficients_of_its_own_frequency(tmp_path: Path) -> None:
    """Each eigenvalue makes the matrix of its wave singular, the coefficients taken at its own frequency, far from reference_hz."""
    own = {60.0: {0: -200 + 100j, 1: -250 + 100j}, 200.0: {0: 600 - 900j, 1: 350 + 1200j}}
    rows = [f"{hz},{j},tip,tip,{c.real},{c.imag}" for hz, at in own.items() for j, c in at.items()]
    head = "frequency_hz,neighbour,force_point,motion_point,real_n_per_m,imag_n_per_m"
    (tmp_path / "c.csv").write_text("\n".join([head, *rows]), encoding="utf-8")
    text = SHROUDS.replace("reference_hz = 80", "reference_hz = 150\nbeyond = 'nearest'")
    (case,) = study_of(text, tmp_path).cases()
    question = LIMIT_CYCLE.inputs(case, case.build())
    M = np.diag([1.2, 0.33])
    for k in range(5):
        turn = np.exp(2j * np.pi * k / 5)
        ring, shroud = abs(turn - 1) ** 2 * np.array([2.2e5, 7.5e3])
        K = np.array([[6.5e5 + ring + 7.9e4, -7.9e4], [-7.9e4, 7.9e4 + shroud]])
        C = np.array([[5.4, -0.9], [-0.9, 0.9]])
        modes = question.modes(k)
        assert len(modes) == 2
        for mode in modes:
            value = mode.omega * complex(-mode.ratio, np.sqrt(1 - mode.ratio**2))
            share = np.clip((value.imag / (2 * np.pi) - 60) / 140, 0, 1)
            low, high = (at[0] + at[1] * turn for at in own.values())
            left = value**2 * M + value * C + K + 0j
            left[1, 1] -= (1 - share) * low + share * high
            assert np.linalg.svd(left)[1][-1] < 1e-9 * abs(value**2)


def test_shrouds_between_neighbours_bound_a_wave(tmp_path: Path) -> None:
    """Contacts know a blade as a sector's own and as its neighbour's: the copy has no mass and is no motion of its own."""
    fluid = flow(tmp_path)
    case = one_case(answered(SHROUDS, tmp_path).tree["limit_cycle"].to_dataset(), 0)
    # all sectors at once, without waves
    n, M, blades = 5, np.tile([1.2, 0.33], 5), 2 * np.arange(5) + 1
    K, C, G = np.zeros((3, 2 * n, 2 * n), dtype=complex)
    for s in range(n):
        disk, blade, next_disk, next_blade = (np.eye(2 * n)[i % (2 * n)] for i in 2 * s + np.arange(4))
        for k, c, row in (
            (6.5e5, 4.5, disk),
            (2.2e5, 0, disk - next_disk),
            (7.9e4, 0.9, disk - blade),
            (7.5e3, 0, blade - next_blade),
        ):
            K += k * np.outer(row, row)
            C += c * np.outer(row, row)
        for j, own in fluid.items():
            G[2 * s + 1, (2 * (s + j) + 1) % (2 * n)] += own
    C, K = C - G.imag / (2 * np.pi * 80), K - G.real
    states = np.block([[0 * K, np.eye(2 * n)], [-K / M[:, None], -C / M[:, None]]])
    values, vectors = np.linalg.eig(states)
    for name, own in (("frequency_hz", np.abs(values) / (2 * np.pi)), ("damping_ratio", -values.real / np.abs(values))):
        there = case[f"linear_{name}"].values.ravel()
        np.testing.assert_allclose(np.sort(there), np.sort(own[values.imag > 0]), rtol=1e-8)
    grows = np.flatnonzero((values.real > 0) & (values.imag > 0))
    waves = [int(np.abs(np.fft.fft(vectors[blades, i])).argmax()) for i in grows]
    assert case["wave_number"].values.tolist() == waves
    ratio = -values[grows].real / np.abs(values[grows])
    np.testing.assert_allclose(case["mode_damping_ratio"].values, ratio, rtol=1e-8)
    assert case["cycle_time_amplitude"].values[0] == pytest.approx(case["cycle_amplitude"].values[0], rel=1e-3)
