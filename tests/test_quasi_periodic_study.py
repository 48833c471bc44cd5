"""[quasi_periodic] of a study: two loads, a tone that nothing drives, a wheel, resuming, the page, and what is refused."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small_v2 import EXAMPLES, changed
from study_texts import answered, study_of
from test_limit_cycle_study import SHROUDS, flow

import stickslip as ss
from stickslip.analyses.page import plots
from stickslip.analyses.quasi_periodic import analysis
from stickslip.analyses.quasi_periodic.analysis import QUASI_PERIODIC, at_frequency
from stickslip.errors import InputError
from stickslip.response.quasi_periodic import tone
from stickslip.response.self_excited.in_time import march_periods, wave_history
from stickslip.response.time.sectors import all_sectors
from stickslip.response.time.start import start_from_harmonics

TWO_TONES = (EXAMPLES / "two_tones" / "study.toml").read_text(encoding="utf-8")


def test_two_loads_from_a_study_are_what_time_integration_comes_to(tmp_path: Path) -> None:
    few = changed(TWO_TONES, {"quasi_periodic.frequency_hz": "[24.0, 25.0]", "quasi_periodic.points": "2"})
    outcome = answered(few, tmp_path)
    data = outcome.tree["quasi_periodic"].to_dataset()
    assert list(data["kind"].values[0]) == ["two loads"] * 2
    assert data["second_hz"].values[0] == pytest.approx(1.3152 * data["first_hz"].values[0])
    assert np.all(data["time_off"].values < 0.01)
    assert data["time_largest"].values == pytest.approx(data["largest"].values, rel=0.02)
    assert np.all(data["left_out"].values < 0.01)
    assert np.all(data["least"].values < 0.9 * data["largest"].values)
    assert {v.level for v in outcome.verdicts} == {"trusted"}
    assert {"two_frequencies", "two_frequencies_phase", "two_frequencies_lines"} <= set(plots(outcome.tree))
    again = answered(few, tmp_path)  # nothing is solved twice
    assert again.tree["quasi_periodic"].to_dataset().identical(data)


def rubbing(fed: float) -> ss.Model:
    """Two masses that rub; a dashpot of so many N s/m feeds the second one."""
    damping = np.diag([4.0, -fed])
    pair = ss.model.lumped(np.eye(2), np.array([[3e4, -1e4], [-1e4, 4e4]]), damping, names=("m1", "m2"))
    return ss.Model(
        parts={"pair": ss.Part(structure=pair)},
        contacts={
            "joint": ss.Contact(between=("pair.m1", "pair.m2"), acts="tangential", law=ss.Jenkins(k_t=1e4, limit=5.0))
        },
        loads={"wake": ss.Load(on="pair.m1", newton=6.0)},
        outputs=(ss.Output(name="second", on="pair.m2"),),
    )


@pytest.mark.validation
def test_a_motion_that_is_weakly_unstable_is_not_told_as_another_one() -> None:
    shapes = np.linalg.eigh(np.array([[4e4, -2e4], [-2e4, 5e4]]))[1]
    damping = shapes @ np.diag([3.0, -0.3]) @ shapes.T  # a multiplier of 1.007
    pair = ss.model.lumped(np.eye(2), np.array([[3e4, -1e4], [-1e4, 4e4]]), damping, names=("m1", "m2"))
    model = replace(rubbing(3.0), parts={"pair": ss.Part(structure=pair)})
    hz = [21.4, 21.5]
    short, long = (model.forced_response(hz, not_periodic_s=s)["forced_response"] for s in (0.05, 30.0))
    assert "has not left the motion that it started on" in str(short["not_periodic_sentence"].values.flat[0])
    for data in (short, long):
        for text, periods in zip(
            data["not_periodic_sentence"].values, data["not_periodic_periods"].values, strict=True
        ):
            (told,) = re.findall(r"over (\d+) periods after (\d+)", str(text))
            assert sum(map(int, told)) == periods
    assert not short["not_periodic_settled"].values.any()
    assert not short["not_periodic_repeats"].values.any()
    assert long["not_periodic_settled"].values.any()
    assert np.any(long["not_periodic_largest"].values > 1.1 * long["not_periodic_least"].values)


def test_a_tone_that_nothing_drives_from_python() -> None:
    data = rubbing(3.0).quasi_periodic(frequencies_hz=[21.5], in_time=True)["quasi_periodic"]
    assert data["kind"].values.item() == "second tone"
    assert 35.0 < data["second_hz"].values.item() < 41.0
    assert data["time_largest"].values == pytest.approx(data["largest"].values, rel=0.02)
    assert data["time_least"].values == pytest.approx(data["least"].values, rel=0.02)
    still = rubbing(-3.0).quasi_periodic(frequencies_hz=[21.5])["quasi_periodic"]
    assert still["kind"].values.item() == "no second tone"
    assert still["unknown"].values.item() == ""
    assert still["largest"].values == pytest.approx(still["least"].values, rel=1e-6)


def test_what_was_not_examined_is_doubtful(monkeypatch: pytest.MonkeyPatch) -> None:
    second = ss.Load(on="pair.m2", newton=4.0, omega_ratio=1.3)
    model = rubbing(-3.0)
    both = replace(model, loads={**model.loads, "own": second})
    unlooked = both.quasi_periodic(frequencies_hz=[21.5], in_time=False)
    assert any("stability was not examined" in str(v) for v in unlooked.verdicts)
    assert {v.level for v in unlooked.verdicts} == {"doubtful"}

    def fails(*_: object) -> None:
        raise FloatingPointError("no multipliers today")

    monkeypatch.setattr(tone, "stability", fails)
    unknown = model.quasi_periodic(frequencies_hz=[21.5])
    assert any("no multipliers today" in str(v) for v in unknown.verdicts)
    assert {v.level for v in unknown.verdicts} == {"doubtful"}


WAKE = """
[load.wake]
on = "wheel.blade"
force_n = 2.0
engine_order = 1
[quasi_periodic]
frequencies_hz = [88.0]
accuracy_percent = 0.3
"""


@pytest.mark.validation
def test_a_flutter_wave_beside_a_forced_wave_is_that_of_all_sectors_in_time(tmp_path: Path) -> None:
    """Blades that touch their neighbours: the wake drives wave 1, a fluid feeds wave 4."""
    flow(tmp_path)
    text = SHROUDS.split("[limit_cycle]")[0] + WAKE
    (case,) = study_of(text, tmp_path).cases()
    question = QUASI_PERIODIC.inputs(case, case.build())
    assert question.waves == (1, 4)
    found = at_frequency(question, 2 * np.pi * 88.0, None)
    assert found.kind == "second tone"
    index = [tuple(row) for row in found.indices]
    waves = [float(found.amplitude[index.index(i), 0]) for i in ((1, 0), (0, 1))]
    # all sectors in time, from the motion of the balance as it is in each of them
    whole = all_sectors(question.model.system, question.first, every=True)
    own, omega = whole.structure.n // 5, found.first
    kept = found.unknowns[..., 0] + 1j * found.unknowns[..., 1]
    side = question.problem().balance.side
    wide = side.recover(tuple(map(tuple, found.indices)), (omega, found.second), kept)[:, :own]
    place, speed = (np.zeros((5, own), dtype=complex) for _ in range(2))
    for (j, k), row in zip(found.indices, wide, strict=True):
        turned = np.exp(2j * np.pi * (j + 4 * k) * np.arange(5) / 5)[:, None] * row
        place += turned
        speed += 1j * (j * omega + k * found.second) * turned
    still = np.zeros((2, whole.structure.n), dtype=complex)
    start = start_from_harmonics(still, omega, whole.contacts.gap_operator, whole.contacts.laws)
    start = replace(start, displacement=place.real.ravel(), velocity=speed.real.ravel())
    tips = question.model.system.outputs[0] + own * np.arange(5)
    history = wave_history(march_periods(whole.structure, whole.contacts, whole.load, omega, tips, start, 320, 256))
    assert history.amplitude[-1, [1, 4]] == pytest.approx(waves, rel=3e-3)
    assert np.delete(history.amplitude[-1], [1, 4]).max() < 0.03 * min(waves)


def test_what_cannot_be_answered_is_refused(tmp_path: Path) -> None:
    model = rubbing(3.0)
    second = ss.Load(on="pair.m2", newton=1.0, omega=200.0)
    both = replace(model, loads={**model.loads, "own": second})
    with pytest.raises(InputError, match=r"load\.own.*has a frequency of its own"):
        both.forced_response((20.0, 25.0))
    other = replace(second, omega=300.0)
    with pytest.raises(InputError, match=r"load\.more: has another frequency of its own than load\.own"):
        replace(both, loads={**both.loads, "more": other}).quasi_periodic(frequencies_hz=[21.0])
    with pytest.raises(InputError, match="quasi_periodic: no load acts with the first frequency"):
        replace(model, loads={"own": second}).quasi_periodic(frequencies_hz=[21.0])
    with pytest.raises(InputError, match=r"Load\.omega"):
        ss.Load(on="pair.m1", newton=1.0, omega=1.0, omega_ratio=2.0)
    same = replace(model, loads={**model.loads, "own": replace(second, omega=None, omega_ratio=1.0)})
    with pytest.raises(InputError, match=r"load\.own\.frequency_ratio.*is the first frequency"):
        same.quasi_periodic(frequencies_hz=[21.0])
    far = replace(model, loads={**model.loads, "own": replace(second, omega=1e8)})
    with pytest.raises(InputError, match=r"load\.own\.frequency_hz.*times the first frequency"):
        far.quasi_periodic(frequencies_hz=[21.0])
    with pytest.raises(InputError, match=r"second_hz.*of a tone that nothing drives"):
        both.quasi_periodic(frequencies_hz=[21.0], second_hz=30.0)
    wrong = changed(TWO_TONES, {"load.other_rotor.frequency_hz": "30.0"})
    with pytest.raises(InputError, match=r"load\.other_rotor\.frequency_ratio.*cannot stand beside"):
        answered(wrong, tmp_path)


def test_an_accuracy_that_is_missed_is_doubtful() -> None:
    """What fifteen sums of harmonics leave out is enough for 1 %, not for 0.01 %."""
    second = ss.Load(on="pair.m2", newton=8.0, omega_ratio=1.3152)
    wake = ss.Load(on="pair.m1", newton=10.0)
    model = replace(rubbing(-3.0), loads={"wake": wake, "own": second})
    hz = [140.0 / (2 * np.pi)]
    rough, fine = (model.quasi_periodic(frequencies_hz=hz, accuracy_percent=a, in_time=True) for a in (1.0, 0.01))
    assert {v.level for v in rough.verdicts} == {"trusted"}
    data = fine["quasi_periodic"]
    assert data["accuracy"].values.item() == pytest.approx(1e-4)
    assert 1e-4 < data["left_out"].values.item() < 0.02
    assert any("more than the 0.01 % that is asked for" in str(v) for v in fine.verdicts)
    assert {v.level for v in fine.verdicts} == {"doubtful"}


def test_a_tone_that_does_not_converge_is_told_with_where_it_was_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = SimpleNamespace(motion=None, forced=SimpleNamespace(converged=True, indices=()), ratio=np.nan)
    monkeypatch.setattr(analysis, "tone_beside", lambda *_: nothing)
    monkeypatch.setattr(analysis, "swept", lambda *_: [])
    question = SimpleNamespace(asked=SimpleNamespace(second_hz=21.5), waves=None, first=None)
    problem = SimpleNamespace(with_indices=lambda _: None)
    _, motion, kind, why, _ = analysis._of_tone(question, problem, 1.0, None)  # type: ignore[arg-type]
    assert (motion, kind) == (None, "second tone")
    assert re.fullmatch(r"no second tone converged near 21\.50* Hz", why)
