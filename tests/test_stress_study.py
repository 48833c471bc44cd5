"""Stress and margin of a study: a cantilever against beam theory, verdicts and page, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from solid_models import box
from typer.testing import CliRunner

import stickslip as ss
from stickslip.analyses.forced_response import stress
from stickslip.analyses.forced_response.page.chapter import cards
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.page.stress import haigh, stress_cycle, stress_surface, worst_places
from stickslip.analyses.forced_response.records.columns import STRESS_AT
from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.model.deck import write_deck
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.study.exchange.motion import expanded
from stickslip.study.models.study import read_study

LENGTH, SIDE, FORCE, WEIGHT = 0.2, 0.02, 100.0, 50.0
STUDY = """
schema_version = 2
[part.beam]
file = "beam.inp"
units = "SI"
[reduction]
fixed_interface_modes = 6
[damping]
ratio = 0.01
between_hz = [300, 3000]
[contact.side]
between = ["beam.middle", "ground"]
law = "elastic_coulomb"
normal_stiffness_n_per_m = 1.0
tangential_stiffness_n_per_m = 1.0
axial_stiffness_n_per_m = 1.0
friction_coefficient = 0.5
preload_n = 1.0
normal = "y"
[load.weight]
on = "beam.tip"
force_n = 50.0
direction = "z"
harmonic = 0
[load.shaker]
on = "beam.tip"
force_n = 100.0
direction = "z"
[forced_response]
frequencies_hz = [1.0, 2.0]
[harmonics]
high = 1
selection = "always_low"
[output]
points = { tip = "beam.tip" }
peak = "tip.z"
[stress]
fatigue_limit_pa = 30e6
ultimate_pa = 100e6
yield_pa = 80e6
"""


def written(folder: Path, text: str = STUDY) -> Path:
    """A clamped beam of second-order bricks along x."""
    mesh = box(20, (LENGTH, SIDE, SIDE), (10, 2, 2))
    x, y, z = mesh.points.T
    sets = {
        **mesh.node_sets,
        "tip": np.flatnonzero(
            np.isclose(x, LENGTH) & np.isclose(np.abs(y - y.mean()), 0) & np.isclose(np.abs(z - z.mean()), 0)
        ),
        "middle": np.flatnonzero(np.isclose(x, 0.5 * LENGTH) & np.isclose(y, y.max())),
    }
    write_deck(SolidMesh(mesh.points, mesh.cells, sets), Material(), folder / "beam.inp")
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return folder / "study.toml"


@pytest.fixture(scope="module")
def cantilever(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("stress")
    return ss.Study.from_file(written(folder)).run()


def test_stress_and_margin_are_those_of_beam_theory(cantilever: Any) -> None:
    data = cantilever["forced_response"].isel(case=0)
    x, _, z = data.stress_point.values.T
    beside = np.isclose(np.abs(z - z.mean()), SIDE / 2) & (x > 0.05) & (x < 0.15) & (data.stress_at.values == 0)
    bending = 6 * (LENGTH - x[beside]) / SIDE**3
    assert beside.sum() == 18
    assert data.alternating_stress.values[beside] == pytest.approx(FORCE * bending, rel=0.02)
    assert np.abs(data.mean_stress.values[beside]) == pytest.approx(WEIGHT * bending, rel=0.02)
    above = beside & (z > z.mean())
    assert len(set(np.sign(data.mean_stress.values[above]))) == 1  # tension on one side, compression on the other
    # the worst place stands one element from the clamp, in tension: Goodman's line by hand
    place = int(data.worst_place.values[0])
    amplitude, mean = data.alternating_stress.values[place], data.mean_stress.values[place]
    assert mean > 0
    assert data.utilisation.values[place] == pytest.approx(amplitude / (30e6 * (1 - mean / 100e6)), rel=1e-12)
    assert x[place] <= 0.041
    assert data.allowed_stress.values[place] == pytest.approx(30e6 * (1 - mean / 100e6), rel=1e-12)
    assert data.stress_node.values[place] > 0
    assert data.stress_part.values[place] == "beam"
    assert data.stress_triangle.values.max() == data.sizes["stress_place"] - 1
    assert float(data.fatigue_limit) == 30e6
    assert str(data.stress_doubt.values) == ""
    assert np.interp(50e6, data.haigh_mean.values, data.haigh_amplitude.values) == pytest.approx(15e6, rel=1e-12)
    assert np.interp(-50e6, data.haigh_mean.values, data.haigh_amplitude.values) == pytest.approx(30e6, rel=1e-12)
    assert 0 < data.stress_mesh_error.values[place] < 0.1
    assert 0 < data.stress_correction.values[place] < 0.01
    kinds = {STRESS_AT[k] for k in data.stress_at.values}
    assert kinds == {"free", "contact", "support", "load"}
    assert np.all(x[data.stress_at.values == STRESS_AT.index("support")] <= 0.0201)
    # a cycle of one harmonic: twice the frequency in the equivalent stress, static and alternating parts in proportion
    static, moving = data.worst_stress.values[0, 0, :, 0], data.worst_stress.values[1, 0, :, 0]
    assert np.abs(moving) == pytest.approx(np.abs(static) * FORCE / WEIGHT, rel=1e-2, abs=2e4)


def test_page_and_verdicts_lead_with_the_margin(cantilever: Any) -> None:
    data = cantilever["forced_response"]
    told = [v for v in cantilever.verdicts if "utilisation" in v.why]
    assert len(told) == 1
    assert "alternating 1" in told[0].why
    view = Response(data)
    card = next(c for c in cards(view) if "utilisation" in c.label)
    assert float(card.value) == pytest.approx(
        float(data.utilisation.values[0, int(data.worst_place.values[0, 0])]), rel=5e-3
    )
    assert not card.danger
    for figure in (stress_surface, haigh, stress_cycle):
        plot = figure(view)
        assert plot is not None
        assert len(plot.figure.data) >= 2
    table = worst_places(view)
    assert table is not None
    assert len(table.rows) == 10


def test_a_static_stress_above_yield_voids_the_margin(tmp_path: Path) -> None:
    study = written(tmp_path, STUDY.replace("force_n = 50.0", "force_n = 900.0"))
    out = CliRunner().invoke(app, ["run", str(study)])
    assert out.exit_code == 0, out.output
    assert "above yield" in out.output
    assert "above_yield" in out.output
    shaken = written(tmp_path, STUDY.replace("force_n = 50.0", "force_n = 900.0") + 'above_yield = "shakedown"\n')
    result = ss.Study.from_file(shaken).run()
    data = result["forced_response"].isel(case=0)
    place = int(data.worst_place.values[0])
    amplitude, mean = data.alternating_stress.values[place], data.mean_stress.values[place]
    assert int(data.stress_shakedown) == 1
    assert mean == pytest.approx(80e6 - amplitude, rel=1e-9)
    assert data.utilisation.values[place] == pytest.approx(amplitude / (30e6 * (1 - mean / 100e6)), rel=1e-9)


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ("fatigue_limit_pa = 1e6\nultimate_pa = 2e6\n", "is beyond the static limit: no amplitude is endured"),
        (
            'fatigue_limit_pa = 1e6\nultimate_pa = 8e6\nyield_pa = 7e6\nabove_yield = "shakedown"\n',
            "the material does not shake down",
        ),
        ("fatigue_limit_pa = 30e6\nultimate_pa = 100e6\n", "whether the static stress is above yield is not known"),
        (
            "fatigue_limit_pa = 30e6\nultimate_pa = 100e6\napart_m = 10.0\n",
            "no place of a surface is away from contacts",
        ),
    ],
    ids=["beyond", "no shakedown", "no yield", "nothing free"],
)
def test_what_leaves_no_margin_is_told_as_it_is(tmp_path: Path, keys: str, says: str) -> None:
    text = STUDY.partition("[stress]")[0] + "[stress]\n" + keys
    result = ss.Study.from_file(written(tmp_path, text)).run()
    assert any(says in v.why for v in result.verdicts)
    assert not any("above yield: there is no margin there" in v.why for v in result.verdicts)


def test_a_case_without_stress_keeps_its_motion_and_the_stress_of_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(told: Any, model: Any) -> Any:
        if "100" in told.label:
            raise InputError("export", "the outputs differ", "Run it again.")
        return expanded(told, model)

    monkeypatch.setattr(stress, "expanded", refused)
    study = written(tmp_path, STUDY + "[vary]\nload.shaker.force_n = [100.0, 50.0]\n")
    out = CliRunner().invoke(app, ["run", str(study), "--workers", "1"])
    assert out.exit_code == 0, out.output
    told = " ".join(out.output.split())
    assert "the stress at the peak was not computed: the outputs differ" in told.replace("The stress", "the stress")
    data = ss.Result.from_file(tmp_path / "results")["forced_response"]
    assert set(data.stress_face_case.values) == {1}
    assert np.isfinite(data.peak_amplitude.values).all()
    assert not np.isfinite(data.utilisation.values[0]).any()
    assert np.isfinite(data.utilisation.values[1]).any()
    assert (data.worst_place.values[0] < 0).all()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("fatigue_limit_pa = 30e6\n", "", r"stress.fatigue_limit_pa: is missing"),
        ("ultimate_pa = 100e6\n", "", r"stress.ultimate_pa: is missing, and Goodman's line needs it"),
        ("fatigue_limit_pa = 30e6", "fatigue_limit_pa = 30.0", r"stress.fatigue_limit_pa: must lie in .*, got 30"),
        ("yield_pa = 80e6", 'above_yield = "shakedown"', r"stress.yield_pa: is missing"),
        (
            "yield_pa = 80e6",
            'credit_in_compression = true\nmean_stress = "gerber"',
            r"stress.credit_in_compression: is true",
        ),
        ("yield_pa = 80e6", "yield_pa = 200e6", r"stress.yield_pa: must be at most ultimate_pa"),
    ],
)
def test_a_card_that_does_not_fit_is_refused_by_key(tmp_path: Path, old: str, new: str, says: str) -> None:
    study = written(tmp_path, STUDY.replace(old, new))
    with pytest.raises(InputError, match=says):
        read_study(study)


def test_stress_of_matrices_is_refused_with_the_remedy(tmp_path: Path) -> None:
    from small_v2 import write_four_masses

    study = write_four_masses(tmp_path)
    study.write_text(study.read_text() + "\n[stress]\nfatigue_limit_pa = 30e6\nultimate_pa = 100e6\n")
    with pytest.raises(
        InputError, match=r"stress.fatigue_limit_pa: asks for stress, and no part has elements .* Give the deck"
    ):
        ss.Study.from_file(study).run()
