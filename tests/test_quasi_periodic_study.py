"""[quasi_periodic] of a study: two loads, a tone that nothing drives, resuming, the page, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flutter_wheel import MODE, MOVED, ONE_UNSTABLE, flutter_wheel
from small_v2 import EXAMPLES, changed

import stickslip as ss
from stickslip.errors import InputError
from stickslip.report.page import plots
from stickslip.response.quasi_periodic.problem import two_tones, with_enough
from stickslip.response.quasi_periodic.tone import (
    beginnings,
    forced_motion,
    over_amplitude,
    second_tone,
    solve_free,
)
from stickslip.response.self_excited.in_time import march_periods, wave_history
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.time.sectors import all_sectors
from stickslip.response.time.start import start_from_harmonics
from stickslip.study.models.study import read_study
from stickslip.study.outcome import Outcome
from stickslip.study.run import run_study

TWO_TONES = (EXAMPLES / "two_tones" / "study.toml").read_text(encoding="utf-8")


def answered(text: str, folder: Path) -> Outcome:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return run_study(read_study(path))


def test_two_loads_from_a_study_are_what_time_integration_comes_to(tmp_path: Path) -> None:
    few = changed(TWO_TONES, {"quasi_periodic.frequency_hz": "[24.0, 25.0]", "quasi_periodic.points": "2"})  # fmt: skip
    outcome = answered(few, tmp_path)
    data = outcome.tree["quasi_periodic"].to_dataset()
    assert list(data["kind"].values[0]) == ["two loads"] * 2
    assert data["second_hz"].values[0] == pytest.approx(1.3152 * data["first_hz"].values[0])
    assert np.all(data["time_off"].values < 0.01)
    assert data["time_largest"].values == pytest.approx(data["largest"].values, rel=0.02)
    assert np.all(data["left_out"].values < 0.01)
    assert np.all(data["least"].values < 0.9 * data["largest"].values)
    assert {v.level for v in outcome.verdicts} == {"trusted"}
    assert {"two_frequencies", "two_frequencies_phase", "two_frequencies_lines"} <= set(plots(outcome.tree))  # fmt: skip
    again = answered(few, tmp_path)  # nothing is solved twice
    assert again.tree["quasi_periodic"].to_dataset().identical(data)


def rubbing(fed: float) -> ss.Model:
    """Two masses that rub; a dashpot of so many N s/m feeds the second one."""
    damping = np.diag([4.0, -fed])
    pair = ss.model.lumped(np.eye(2), np.array([[3e4, -1e4], [-1e4, 4e4]]), damping, names=("m1", "m2"))  # fmt: skip
    return ss.Model(
        parts={"pair": ss.Part(structure=pair)},
        contacts={
            "joint": ss.Contact(
                between=("pair.m1", "pair.m2"),
                acts="tangential",
                law=ss.Jenkins(k_t=1e4, limit=5.0),
            )
        },
        loads={"wake": ss.Load(on="pair.m1", newton=6.0)},
        outputs=(ss.Output(name="second", on="pair.m2"),),
    )


def test_a_tone_that_nothing_drives_from_python() -> None:
    data = rubbing(3.0).quasi_periodic(frequencies_hz=[21.5], in_time=True)["quasi_periodic"]  # fmt: skip
    assert data["kind"].values.item() == "second tone"
    assert 35.0 < data["second_hz"].values.item() < 41.0
    assert data["time_largest"].values == pytest.approx(data["largest"].values, rel=0.02)
    assert data["time_least"].values == pytest.approx(data["least"].values, rel=0.02)
    still = rubbing(-3.0).quasi_periodic(frequencies_hz=[21.5])["quasi_periodic"]
    assert still["kind"].values.item() == "no second tone"
    assert still["largest"].values == pytest.approx(still["least"].values, rel=1e-6)


def test_a_flutter_wave_beside_a_forced_wave_is_that_of_all_sectors_in_time() -> None:
    system, load = flutter_wheel(1, 9, ONE_UNSTABLE, 0.3)
    omega = 2 * np.pi * 619.5
    none = ss.HarmonicLoad(np.zeros(system.structure.n))
    problem = two_tones(system, load, none, 3, waves=(1, 2), more=np.array([MOVED]))
    forced = forced_motion(problem, omega)
    mode = stuck_modes(replace(system, structure=system.structure.travelling_as(2)), MODE)[-1]
    begin = beginnings(problem, forced, [mode.omega])[0]
    # small, it grows as the mode does, but for the frequency at which damping is counted
    assert next(over_amplitude(begin)).ratio == pytest.approx(mode.ratio, rel=1e-4)
    motion = second_tone(begin)
    assert motion is not None

    def solve(wider, x, _path):  # type: ignore[no-untyped-def]
        return solve_free(wider, x, motion.omegas)

    motion = with_enough(problem, motion, 15, 0.01, solve)[1]
    sizes = np.abs(motion.coefficients[:, MOVED])
    waves = [sizes[motion.indices.index(index)] for index in ((1, 0), (0, 1))]
    # the march begins near it: the forced motion disturbed grows into it in thousands of periods. What is left out counts more than its
    # size, since the flutter wave is neither fed nor damped by much: 3 % of its amplitude here, 0.04 % with 25 harmonics and 0.04 % left out
    whole = all_sectors(system, load, every=True)
    still = np.zeros((2, system.structure.n), dtype=complex)
    still[1] = motion.coefficients[motion.indices.index((1, 0))]
    start = start_from_harmonics(whole.spread(still), omega, whole.contacts.gap_operator, whole.contacts.laws)  # fmt: skip
    turn = np.exp(2j * np.pi * 2 * np.arange(6) / 6)
    beside = np.kron(turn, motion.coefficients[motion.indices.index((0, 1))][:4])
    start = replace(start, displacement=start.displacement + beside.real, velocity=start.velocity + (1j * motion.omegas[1] * beside).real)  # fmt: skip
    tips = MOVED + 4 * np.arange(6)
    history = wave_history(march_periods(whole.structure, whole.contacts, whole.load, omega, tips, start, 480, 128))  # fmt: skip
    assert set(history.waves[:2]) == {1, 2}
    assert history.amplitude[-1, 1] == pytest.approx(waves[0], rel=5e-3)
    assert history.amplitude[-1, 2] == pytest.approx(waves[1], rel=0.04)
    assert np.delete(history.amplitude[-1], [1, 2]).max() < 0.05 * min(waves)


def test_what_cannot_be_answered_is_refused(tmp_path: Path) -> None:
    model = rubbing(3.0)
    second = ss.Load(on="pair.m2", newton=1.0, omega=200.0)
    both = replace(model, loads={**model.loads, "own": second})
    with pytest.raises(InputError, match=r"load\.own.*has a frequency of its own"):
        both.forced_response((20.0, 25.0))
    other = replace(second, omega=300.0)
    with pytest.raises(InputError, match="another frequency of its own"):
        replace(both, loads={**both.loads, "more": other}).quasi_periodic(frequencies_hz=[21.0])
    with pytest.raises(InputError, match="no load acts with the first frequency"):
        replace(model, loads={"own": second}).quasi_periodic(frequencies_hz=[21.0])
    with pytest.raises(InputError, match=r"Load\.omega"):
        ss.Load(on="pair.m1", newton=1.0, omega=1.0, omega_ratio=2.0)
    wrong = changed(TWO_TONES, {"load.other_rotor.frequency_hz": "30.0"})
    with pytest.raises(
        InputError, match=r"load\.other_rotor\.frequency_ratio.*cannot stand beside"
    ):
        answered(wrong, tmp_path)
