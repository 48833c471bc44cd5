"""The examples of the analyses that look beyond one response, made small: what their first lines tell is what they answer."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_v2 import EXAMPLES, changed
from study_texts import study_of

from stickslip.study.run import run_study


def first_case(name: str, analysis: str, folder: Path, changes: dict[str, str]) -> xr.Dataset:
    """Return what the first case of an example answers with keys changed."""
    text = (EXAMPLES / name / "study.toml").read_text(encoding="utf-8")
    outcome = run_study(study_of(changed(text, changes), folder), only=[analysis])
    return outcome.tree[analysis].to_dataset().isel(case=0)


def test_the_backbone_begins_stuck_and_is_damped_most_between_stuck_and_sliding(tmp_path):
    changes = {"nonlinear_mode.modes": "[1]", "nonlinear_mode.points": "15", "vary.load.shaker.force_n": "[1.0]"}
    mode = first_case("backbone", "nonlinear_mode", tmp_path, changes).isel(branch=0)
    known = mode["status"].values == 0
    hertz, ratio, size = (mode[name].values[known] for name in ("frequency_hz", "damping_ratio", "amplitude"))
    assert hertz[0] == pytest.approx(73.04, abs=0.01)
    assert np.all(hertz < hertz[0] + 1e-6)
    best = int(np.argmax(ratio))
    assert 0 < best < len(ratio) - 1
    assert ratio[best] == pytest.approx(0.11, abs=0.003)
    assert 1e-3 < size[best] < 1.6e-3


def test_the_damper_of_the_load_levels_works_best_in_between(tmp_path):
    changes = {"modal_synthesis.direct": "false", "modal_synthesis.passage_hz_per_s": "[]"}
    case = first_case("load_levels", "modal_synthesis", tmp_path, changes)
    per_load = case["peak_amplitude"].values / case["level"].values
    best = int(np.argmin(per_load))
    assert 0 < best < len(per_load) - 1
    assert case["level"].values[best] == 5


def test_kept_forces_move_the_blade_and_its_resonance(tmp_path):
    table = {"points": "3", "starts": "0", "harmonics": "3", "in_time": "false"}
    changes = {f"residual_tractions.{key}": value for key, value in table.items()}
    case = first_case("kept_forces", "residual_tractions", tmp_path, changes)
    least, own, most = (case[f"{name}_amplitude"].values for name in ("least", "reference", "most"))
    assert np.all(least <= own * (1 + 1e-9))
    assert np.all(own <= most * (1 + 1e-9))
    # as the study's first lines say, which has more harmonics and frequencies
    assert case["resonance_amplitude"].values[1:] == pytest.approx([0.174e-3, 0.187e-3], rel=0.01)
