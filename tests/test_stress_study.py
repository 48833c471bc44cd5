"""Stress and margin of a study: a cantilever against beam theory, verdicts and page, and what is refused."""

import csv
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from solid_models import box
from typer.testing import CliRunner

import stickslip as ss
from stickslip.analyses.forced_response import analysis, stress
from stickslip.analyses.forced_response.page.chapter import cards
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.page.stress import haigh, stress_cycle, stress_surface, worst_places
from stickslip.analyses.forced_response.records.columns import STRESS_AT, Drawn, SurfaceStress, read
from stickslip.analyses.forced_response.stress import with_margin
from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.deck import write_deck
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.frd import read_frd
from stickslip.model.readers.units import Units
from stickslip.model.strength import StrengthCard, cycle
from stickslip.model.strength.cycle import CRITERIA, worst_utilisation
from stickslip.study.exchange.motion import expanded
from stickslip.study.exchange.stress import SurfaceFields
from stickslip.study.file.model.strength import Stress
from stickslip.study.models.study import read_study
from stickslip.study.store.journal import read_note

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
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the study and of its results."""
    place = tmp_path_factory.mktemp("stress")
    ss.Study.from_file(written(place)).run()
    return place


@pytest.fixture(scope="module")
def cantilever(folder: Path) -> Any:
    return ss.Result.from_file(folder / "results")


def test_stress_and_margin_are_those_of_beam_theory(cantilever: Any) -> None:
    data = cantilever["forced_response"].isel(case=0)
    x, _, z = data.stress_point.values.T
    beside = np.isclose(np.abs(z - z.mean()), SIDE / 2) & (x > 0.05) & (x < 0.15) & (data.stress_at.values == 0)
    bending = 6 * (LENGTH - x[beside]) / SIDE**3
    assert beside.sum() == 18
    assert data.alternating_stress.values[beside] == pytest.approx(FORCE * bending, rel=0.02)
    assert np.abs(data.mean_stress.values[beside]) == pytest.approx(WEIGHT * bending, rel=0.02)
    assert np.abs(data.static_stress.values[beside, 0]) == pytest.approx(WEIGHT * bending, rel=0.02)
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


def test_a_changed_card_takes_the_stored_stress(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def solves(question: Any, done: Any) -> Any:
        raise AssertionError("the response is computed anew")

    def run(text: str) -> tuple[str, Any]:
        out = CliRunner().invoke(app, ["run", str(written(tmp_path, text)), "--workers", "1"])
        assert out.exit_code == 0, out.output
        log = (tmp_path / "results" / "run.log").read_text(encoding="utf-8")
        return log.rpartition("jobs to do: ")[2], ss.Result.from_file(tmp_path / "results")["forced_response"]

    _, before = run(STUDY.partition("[stress]")[0])
    assert "utilisation" not in before
    monkeypatch.setattr(analysis, "_solved", solves)
    told, first = run(STUDY)  # the stress is computed from the stored motion
    assert told.startswith("1,")
    told, second = run(STUDY.replace("30e6", "60e6") + 'mean_stress = "gerber"\napart_m = 0.041\n')
    assert told.startswith("0,")
    place, here = int(first.worst_place.values[0, 0]), int(second.worst_place.values[0, 0])
    amplitude, mean = second.alternating_stress.values[0, here], second.mean_stress.values[0, here]
    assert second.utilisation.values[0, here] == pytest.approx(
        amplitude / (60e6 * (1 - (mean / 100e6) ** 2)), rel=1e-12
    )
    assert second.stress_point.values[0, here, 0] > 0.041 >= first.stress_point.values[0, place, 0]
    told, varied = run(STUDY + "[vary]\nstress.fatigue_limit_pa = [30e6, 60e6]\n")
    assert told.startswith("0,")
    assert varied.utilisation.values[0] == pytest.approx(first.utilisation.values[0], nan_ok=True, rel=1e-12)
    assert varied.utilisation.values[1] == pytest.approx(0.5 * first.utilisation.values[0], nan_ok=True, rel=1e-12)
    _, gone = run(STUDY.partition("[stress]")[0])
    assert "utilisation" not in gone


@pytest.fixture(scope="module")
def stored_stress(folder: Path, cantilever: Any) -> Any:
    """A function that judges the note of the run by a table [stress]."""
    (job,) = (folder / "results" / "jobs").glob("*.job")
    note, peak = read_note(job, "stress"), float(cantilever["forced_response"].peak_amplitude[0])

    def judge(factor: float = 1.0, still: float = 1.0, **keys: Any) -> Any:
        waves = note["waves"].astype(complex)
        waves[0], waves[1:] = still * waves[0], factor * waves[1:]
        own = {**note, "waves": waves, "alternating": factor * note["alternating"], "mean": still * note["mean"]}
        table = Stress(**{"fatigue_limit_pa": 30e6, "ultimate_pa": 100e6, "yield_pa": 80e6, **keys})
        return SimpleNamespace(**with_margin(table, own, peak, slips=False), peak=peak)

    return judge


def tensor(stress: Any) -> Any:
    return np.asarray(stress)[..., [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]


@pytest.mark.parametrize("name", ["crossland", "sines", "dang_van", "findley"])
def test_criteria_of_a_study_agree_with_a_cycle_drawn_out(stored_stress: Any, name: str) -> None:
    """Own formulas on a dense cycle: in bending the path of the stress is a line, and balls and circles are half ranges."""
    f, t, r0 = 30e6, 18e6, 26e6
    own = stored_stress(torsion_limit_pa=t, fatigue_limit_r0_pa=r0, criterion=name)
    assert own.stress_rule == name
    waves = own.worst_stress[..., 0] + 1j * own.worst_stress[..., 1]
    static = waves[0, 0].real
    cycle = (waves[1, 0] * np.exp(1j * np.linspace(0, 2 * np.pi, 721))[:, None]).real
    pressure = np.maximum((static + cycle)[:, :3].sum(axis=1) / 3, 0)
    moving, still = tensor(cycle), tensor(static)
    if name in ("crossland", "sines"):
        deviator = moving - np.trace(moving, axis1=1, axis2=2)[:, None, None] * np.eye(3) / 3
        radius = np.sqrt(0.5 * (deviator**2).sum(axis=(1, 2))).max()
        kappa, limit, press = 3 * t / f - np.sqrt(3), t, pressure.max()
        if name == "sines":
            kappa, limit, press = np.sqrt(3) * (f / r0 - 1), f / np.sqrt(3), max(static[:3].sum() / 3, 0)
        wanted = (radius + kappa * press) / limit
    elif name == "dang_van":
        principal = np.linalg.eigvalsh(moving)
        wanted = ((principal[:, 2] - principal[:, 0]) / 2 + 3 * (t / f - 0.5) * pressure).max() / t
    else:
        kappa = (2 * t / f - 1) / np.sqrt(1 - (2 * t / f - 1) ** 2)
        polar, around = np.meshgrid(np.radians(np.arange(0, 180, 0.5)), np.radians(np.arange(0, 180, 7.5)))
        normals = np.stack(
            [np.cos(polar), np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around)], axis=-1
        ).reshape(-1, 3)
        traction = np.einsum("tij,nj->tni", moving[::10], normals)
        normal = np.einsum("tni,ni->tn", traction, normals)
        shear = np.linalg.norm(traction - normal[..., None] * normals, axis=2).max(axis=0)
        tension = np.einsum("ni,ij,nj->n", normals, still, normals) + normal.max(axis=0)
        wanted = (shear + kappa * np.maximum(tension, 0)).max() / (t * np.sqrt(1 + kappa**2))
    place = int(own.worst_place[0])
    assert own.utilisation[place] == pytest.approx(wanted, rel=3e-4)
    assert np.isnan(own.allowed_stress).all()
    assert np.nanargmax(np.where(own.stress_at == 0, own.utilisation, 0)) == place


@pytest.mark.parametrize(
    ("still", "keys"),
    [
        (1.0, {}),
        (-1.0, {"mean_stress": "gerber"}),
        (14.0, {"above_yield": "shakedown"}),
        (1.0, {"torsion_limit_pa": 18e6, "criterion": "crossland"}),
        (1.0, {"fatigue_limit_r0_pa": 26e6, "criterion": "dang_van"}),
    ],
    ids=["goodman", "compression", "shakedown", "crossland", "dang van"],
)
def test_a_vibration_scaled_to_the_allowed_amplitude_reaches_the_limit(
    stored_stress: Any, still: float, keys: dict[str, Any]
) -> None:
    first = stored_stress(still=still, **keys)
    factor = first.allowed_amplitude / first.peak
    assert 0.5 < factor < 5
    again = stored_stress(factor, still=still, **keys)
    assert np.nanmax(again.utilisation[again.stress_at == 0]) == pytest.approx(1.0, rel=1e-5)
    assert again.allowed_amplitude == pytest.approx(again.peak, rel=1e-5)


def test_a_load_scaled_to_the_allowed_amplitude_reaches_the_limit(cantilever: Any, tmp_path: Path) -> None:
    first = cantilever["forced_response"].isel(case=0)
    assert int(first.stress_slips) == 0
    factor = float(first.allowed_amplitude / first.peak_amplitude)
    again = STUDY.replace("force_n = 100.0", f"force_n = {100 * factor!r}")
    second = ss.Study.from_file(written(tmp_path, again)).run()["forced_response"].isel(case=0)
    assert float(second.utilisation[int(second.worst_place[0])]) == pytest.approx(1.0, rel=1e-4)


@pytest.mark.parametrize(
    ("keys", "root", "blade"),
    [
        ({"fatigue_limit_r0_pa": 150e6, "criterion": "sines"}, (300e6, 5e6), (10e6, 90e6)),
        ({"torsion_limit_pa": 120e6, "criterion": "findley"}, (300e6, 5e6), (10e6, 90e6)),
        (
            {"fatigue_limit_pa": 300e6, "ultimate_pa": 1e9, "yield_pa": 800e6, "above_yield": "shakedown"},
            (900e6, 20e6),
            (0.0, 85e6),
        ),
    ],
    ids=["sines", "findley", "shakedown"],
)
def test_no_place_exceeds_its_limit_at_the_amplitude_at_the_limit(
    keys: dict[str, Any], root: tuple[float, float], blade: tuple[float, float]
) -> None:
    """Twelve places of high static stress lead now; at larger amplitudes those of high vibration do."""
    table = Stress(**{"fatigue_limit_pa": 200e6} | keys)
    waves = np.zeros((2, 30, 6), dtype=complex)
    waves[:, :, 0] = np.where(np.arange(30) < 12, np.array(root)[:, None], np.array(blade)[:, None])

    def told(by: float) -> dict[str, Any]:
        now = waves * np.array([1.0, by])[:, None, None]
        alternating, mean = cycle.alternating_and_mean(now)
        note = stress._nothing("") | {
            "point": np.zeros((30, 3)),
            "node": np.arange(30),
            "part": np.array(["blade"] * 30),
            "near": np.zeros((4, 30), dtype=bool),
            "distance": np.full((4, 30), np.inf),
            "temperature": np.full(30, np.nan),
            "alternating": alternating,
            "mean": mean,
            "uncorrected": alternating,
            "error": np.zeros(30),
            "orders": np.arange(2),
            "waves": now,
            "linear": True,
        }
        return with_margin(table, note, 1.0, slips=False)

    now = told(1.0)
    assert now["utilisation"][0] > now["utilisation"][-1]
    then = told(float(now["allowed_amplitude"]))["utilisation"]
    assert then.max() == pytest.approx(1.0, rel=1e-4)
    assert then[-1] == then.max()


def test_scaling_is_exact_with_linear_contacts_alone(folder: Path, cantilever: Any) -> None:
    (job,) = (folder / "results" / "jobs").glob("*.job")
    note = read_note(job, "stress")
    assert note["linear"]
    table = Stress(fatigue_limit_pa=300e6, ultimate_pa=1e9)
    for linear, slips, estimate in ((True, False, 0), (True, True, 1), (False, False, 1)):
        told = with_margin(table, {**note, "linear": linear}, 1.0, slips=slips)
        assert told["stress_slips"] == estimate


def test_no_amplitude_is_endured_beyond_the_static_limit_and_none_is_told_above_yield(stored_stress: Any) -> None:
    assert (
        stored_stress(
            still=20.0, torsion_limit_pa=29e6, yield_pa=None, ultimate_pa=None, criterion="crossland"
        ).allowed_amplitude
        == 0.0
    )
    assert np.isnan(stored_stress(still=20.0).allowed_amplitude)


def test_beyond_the_thousand_worst_places_a_criterion_has_an_upper_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(36)
    waves = 20e6 * (rng.normal(size=(4, 60, 6)) + 1j * rng.normal(size=(4, 60, 6)))
    waves[0] = 3 * waves[0].real
    limits = np.linspace(90e6, 200e6, 60)
    card = StrengthCard(fatigue_limit_pa=limits, torsion_limit_pa=0.62 * limits)
    counted = np.arange(60) % 3 > 0
    for name, function in CRITERIA.items():
        if name == "sines":
            continue
        every = function(waves, card)
        monkeypatch.setattr(cycle, "WORST_PLACES", 20)
        monkeypatch.setattr(cycle, "BATCH", 20)
        monkeypatch.setattr(cycle, "CERTAIN", 3)
        found = worst_utilisation(name, waves, card, counted)
        exact = np.isclose(found, every, rtol=1e-6)
        assert 20 <= exact.sum() < 60
        assert np.all(found >= every * (1 - 1e-6))
        assert exact[np.argsort(-np.where(counted, every, -1))[:3]].all()


def test_cards_of_parts_and_over_temperature(stored_stress: Any, tmp_path: Path) -> None:
    plain = stored_stress()
    own = {"fatigue_limit_pa": 60e6, "ultimate_pa": 100e6, "yield_pa": 80e6}
    of_part = stored_stress(card={"beam": own}, fatigue_limit_pa=10e6)
    assert of_part.utilisation == pytest.approx(0.5 * plain.utilisation, nan_ok=True, rel=1e-12)
    assert of_part.fatigue_limit == 60e6
    rows = [{"temperature_c": t, "fatigue_limit_pa": f} for t, f in ((20.0, 30e6), (420.0, 10e6))]
    told = stored_stress(fatigue_limit_pa=None, over_temperature=rows)
    assert "needs temperatures of the part 'beam'" in told.stress_doubt
    study = STUDY.replace(
        "fatigue_limit_pa = 30e6",
        "over_temperature = [{ temperature_c = 20, fatigue_limit_pa = 3e7 }, { temperature_c = 420, fatigue_limit_pa = 1e7 }]",
    )
    with pytest.raises(InputError, match=r"stress.over_temperature: needs temperatures of the part 'beam'"):
        ss.Study.from_file(written(tmp_path, study)).run()
    hot = (
        study
        + "[material]\nyoung_modulus_pa = 2e11\npoisson_ratio = 0.3\ndensity_kg_per_m3 = 7800\nexpansion_per_k = 1e-5\n[temperature]\nstress_free_c = 220\nuniform_c = 220\n"
    )
    data = ss.Study.from_file(written(tmp_path, hot)).run()["forced_response"].isel(case=0)
    place = int(data.worst_place[0])
    amplitude, mean = float(data.alternating_stress[place]), float(data.mean_stress[place])
    assert float(data.utilisation[place]) == pytest.approx(amplitude / (20e6 * (1 - mean / 100e6)), rel=1e-9)
    assert float(data.fatigue_limit) == pytest.approx(20e6)
    with pytest.raises(InputError, match=r"stress.over_temperature: end at 420, and the material has up to 430"):
        ss.Study.from_file(written(tmp_path, hot.replace("uniform_c = 220", "uniform_c = 430"))).run()


def test_limits_without_effect_and_doubtful_ones_are_told(tmp_path: Path, stored_stress: Any) -> None:
    own = stored_stress(walker_exponent=0.5, torsion_limit_pa=18e6)
    assert own.stress_idle == "walker_exponent and torsion_limit_pa of [stress] have no effect with goodman"
    assert stored_stress(walker_exponent=0.5, mean_stress="walker").stress_idle == ""
    brittle = 'torsion_limit_pa = 26e6\nwalker_exponent = 0.5\ncriterion = "crossland"\n'
    out = CliRunner().invoke(app, ["run", str(written(tmp_path, STUDY + brittle))])
    told = " ".join(out.output.split())
    assert "crossland is doubtful above 0.8" in told
    assert "alker_exponent of [stress] has no effect with crossland" in told


def test_decks_of_different_meshes_have_their_own_pictures(tmp_path: Path) -> None:
    written(tmp_path)
    mesh = box(20, (LENGTH, SIDE, SIDE), (8, 2, 2))
    x, y, z = mesh.points.T
    tip = np.isclose(x, LENGTH) & np.isclose(y, y.mean()) & np.isclose(z, z.mean())
    sets = {
        **mesh.node_sets,
        "tip": np.flatnonzero(tip),
        "middle": np.flatnonzero(np.isclose(x, 0.5 * LENGTH) & np.isclose(y, y.max())),
    }
    write_deck(SolidMesh(mesh.points, mesh.cells, sets), Material(), tmp_path / "other.inp")
    (tmp_path / "study.toml").write_text(
        STUDY + '[vary]\npart.beam.file = ["beam.inp", "other.inp"]\n', encoding="utf-8"
    )
    result = ss.Study.from_file(tmp_path / "study.toml").run()
    data = result["forced_response"]
    assert set(data.drawn_face_case.values) == set(data.drawn_load_case.values) == {0, 1}
    assert np.bincount(data.drawn_support_case.values).min() > 0
    for case in (0, 1):
        own = read(Drawn, data, case)
        assert own.drawn_triangle is not None
        assert own.drawn_kind is not None
        points = np.isfinite(own.drawn_point).all(axis=1)
        assert own.drawn_triangle.max() == points.sum() - 1
        assert set(own.drawn_kind[points]) == {"mesh"}
        stress = read(SurfaceStress, data, case)
        assert stress.stress_triangle is not None
        assert stress.stress_triangle.max() == np.isfinite(stress.utilisation).sum() - 1
    assert (result.report(tmp_path / "page.html")).stat().st_size > 1e5


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
    assert "the stress at the peak was not computed: export: the outputs differ. Run it again" in told.replace(
        "The", "the"
    )
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
        ("yield_pa = 80e6", 'criterion = "sines"', r"stress.fatigue_limit_r0_pa: is missing, and Sines needs it"),
        ("yield_pa = 80e6", 'criterion = "crossland"', r"stress.torsion_limit_pa: is missing, and Crossland needs it"),
        (
            "yield_pa = 80e6",
            'criterion = "crossland"\ntorsion_limit_pa = 15e6',
            r"stress.torsion_limit_pa: over fatigue_limit_pa = 0.5",
        ),
        (
            "yield_pa = 80e6",
            'criterion = "findley"\ntorsion_limit_pa = 18e6\nmean_stress = "goodman"',
            r"stress.mean_stress: is given, and findley has its own",
        ),
        (
            "yield_pa = 80e6",
            'criterion = "findley"\ntorsion_limit_pa = 18e6\nyield_pa = 80e6\nabove_yield = "shakedown"',
            r"stress.above_yield: is given, and findley voids",
        ),
        ("fatigue_limit_pa = 30e6\n", "[stress.card.beam]\nfatigue_limit_pa = 30e6\n", ""),
        (
            "fatigue_limit_pa = 30e6\n",
            "[stress.card.disk]\nfatigue_limit_pa = 30e6\n",
            r"stress.card.disk: .*no part .*Did you mean|stress.card.disk: is no part",
        ),
        (
            "fatigue_limit_pa = 30e6\n",
            "fatigue_limit_pa = 30e6\n[stress.card.beam]\nfatigue_limit_pa = 30e6\n",
            r"stress.ultimate_pa: is missing",
        ),
        (
            "fatigue_limit_pa = 30e6\n",
            "over_temperature = [{ temperature_c = 400, fatigue_limit_pa = 2e7 }, { temperature_c = 20, fatigue_limit_pa = 3e7 }]\n",
            r"stress.over_temperature: has temperatures \[400.0, 20.0\]",
        ),
        (
            "fatigue_limit_pa = 30e6\n",
            "over_temperature = [{ temperature_c = 20, fatigue_limit_pa = 2e7 }, { temperature_c = 400, fracture_pa = 3e8 }]\n",
            r"stress.over_temperature: lacks fatigue_limit_pa at 400",
        ),
    ],
)
def test_a_card_that_does_not_fit_is_refused_by_key(tmp_path: Path, old: str, new: str, says: str) -> None:
    study = written(tmp_path, STUDY.replace(old, new))
    if not says:
        assert read_study(study).cases()[0].settings.stress.asked
        return
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


def test_stress_is_exported_for_paraview_calculix_and_as_a_table(folder: Path, cantilever: Any) -> None:
    import meshio

    data = cantilever["forced_response"].isel(case=0)
    files = cantilever.export("vtu", folder / "vtu", steps=1)
    mesh = meshio.read(next(file for file in files if file.name == "stress.vtu"))
    assert mesh.points == pytest.approx(data.stress_point.values)
    assert mesh.cells_dict["triangle"].tolist() == data.stress_triangle.values.tolist()
    for name, own in {
        "static_stress_pa": data.static_stress,
        "utilisation": data.utilisation,
        "alternating_pa": data.alternating_stress,
    }.items():
        assert mesh.point_data[name] == pytest.approx(own.values, nan_ok=True)
    assert (mesh.point_data["singular"] == (data.stress_at.values > 0)).all()

    out = CliRunner().invoke(app, ["export", str(folder / "results"), "--to", "csv", "--out", str(folder / "csv")])
    assert out.exit_code == 0, out.output
    rows = list(csv.DictReader((folder / "csv" / "stress.csv").read_text(encoding="utf-8").splitlines()))
    assert len(rows) == data.sizes["stress_place"]
    place = int(data.worst_place.values[0])
    row = next(row for row in rows if int(row["node"]) == data.stress_node.values[place])
    assert float(row["utilisation"]) == data.utilisation.values[place]
    assert float(row["static_xy_pa"]) == data.static_stress.values[place, 3]
    assert (row["part"], row["singular_at"], row["sector"]) == ("beam", "free", "0")

    (file,) = cantilever.export("frd", folder / "frd", units="mm-t-s")
    read_back = read_frd(file, units=Units.named("mm-t-s"))
    tensor_of, margins = read_back.field("STRESS", 1), read_back.field("MARGIN", 1)
    assert tensor_of.components == ("SXX", "SYY", "SZZ", "SXY", "SYZ", "SZX")
    order = np.argsort(data.stress_node.values)
    assert tensor_of.nodes.tolist() == data.stress_node.values[order].tolist()
    assert tensor_of.values == pytest.approx(data.static_stress.values[order], rel=1e-5, abs=1e-3)
    assert margins.components == ("ALTERN", "MEAN", "ALLOWED", "UTILIS")
    assert margins.values[:, 3] == pytest.approx(np.nan_to_num(data.utilisation.values[order], nan=-1.0), rel=1e-5)
    assert margins.values[:, 0] * 1e6 == pytest.approx(data.alternating_stress.values[order], rel=1e-5)
    assert len(read_back.field("DISP", 1).nodes) > len(order)  # inner nodes and mid-side nodes have a motion alone


def test_stress_away_from_the_peak_and_of_other_motions_is_not_written(
    folder: Path, cantilever: Any, caplog: Any
) -> None:
    files = cantilever.export("vtu", folder / "off", hz=1.0, steps=1)
    assert not any(file.name == "stress.vtu" for file in files)
    with pytest.raises(
        InputError, match=r"export: to: is csv, and this motion has no stress. Add the table \[stress\]"
    ):
        cantilever.export("csv", folder / "none", hz=1.0)


def test_exported_stress_turns_with_the_sectors_of_a_wheel() -> None:
    """Radial tension stays radial."""
    radial = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    one = SurfaceFields(
        ["disk"],
        ["free"],
        np.zeros(1, int),
        np.ones(1, int),
        np.array([[2.0, 0.0, 1.0]]),
        np.zeros((0, 3), int),
        radial[None],
        {"utilisation": np.ones(1)},
    )
    wheel = one.turned(Axis(), 2 * np.pi / 8, 8)
    assert wheel.sector.tolist() == list(range(8))
    outward = wheel.points[:, :2] / 2
    assert np.linalg.norm(outward, axis=1) == pytest.approx(1)
    for way, own in zip(outward, wheel.static, strict=True):
        normal = np.array([*way, 0.0])
        assert tensor(own) @ normal == pytest.approx(normal)
        assert np.trace(tensor(own)) == pytest.approx(1)


def test_a_comparison_shows_the_utilisation(tmp_path: Path, folder: Path, cantilever: Any) -> None:
    other = ss.Study.from_file(written(tmp_path, STUDY.replace("force_n = 100.0", "force_n = 150.0"))).run()
    found = ss.compare(folder / "results", other, names=["light", "heavy"])
    data = cantilever["forced_response"].isel(case=0)
    used = found.peaks["utilisation"].to_numpy()
    assert used == pytest.approx(data.utilisation.values[int(data.worst_place[0])] * np.array([1.0, 1.5]), rel=1e-3)
    head, rows = found.peaks_in_words()
    assert head[-1] == "utilisation"
    assert rows[0][-1] == f"{used[0]:.3f}"
