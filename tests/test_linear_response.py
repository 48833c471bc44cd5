"""Forced responses of models without contacts: closed forms, wheels, checks, and what needs a contact."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import stickslip as ss
from stickslip.cli import app
from stickslip.solve.newton_method import Newton

STIFFNESS = np.array([[2.0, -1.0], [-1.0, 2.0]])
DAMPING = 0.02
FORCES = {1: np.array([0.0, 0.3]), 3: np.array([0.1, 0.0])}


def two_masses() -> ss.Model:
    """Two masses on three springs; the load on b drives the first harmonic, the load on a the third."""
    body = ss.model.lumped(np.eye(2), STIFFNESS, DAMPING * np.eye(2), names=("a", "b"))
    return ss.Model(
        parts={"p": ss.Part(structure=body)},
        loads={"f": ss.Load(on="p.b", newton=0.3), "g": ss.Load(on="p.a", newton=0.1, harmonic=3)},
        outputs=(ss.Output(name="b", on="p.b"), ss.Output(name="a", on="p.a")),
    )


def amplitudes(hz: float) -> np.ndarray:
    """Return the norms of the driven harmonics of b and a from the dynamic stiffness."""
    found = []
    for h, force in FORCES.items():
        omega = 2.0 * np.pi * h * hz
        found.append(np.linalg.solve(STIFFNESS + (1j * omega * DAMPING - omega**2) * np.eye(2), force))
    norms: np.ndarray = np.linalg.norm(found, axis=0)[::-1]
    return norms


@pytest.mark.parametrize("keys", [{}, {"selection": "always_high", "high": 4}, {"high": 3, "low": 3}], ids=str)
def test_a_response_without_contacts_is_that_of_the_dynamic_stiffness(keys: dict[str, object]) -> None:
    found = two_masses().forced_response(hz=(0.1, 0.35), points=12, **keys)  # type: ignore[arg-type]
    data = found["forced_response"]
    assert found.conclusion == "Every answer is trusted."
    assert str(data.stability_verdict.values[0]) == "stable"
    hz, own = data.frequency_hz.values.ravel(), data.amplitude.values.reshape(-1, 2)
    true = np.array([amplitudes(f) for f in hz])
    condition = max(np.linalg.cond(STIFFNESS + (1j * w * DAMPING - w**2) * np.eye(2)) for w in 2 * np.pi * hz)
    # Newton's method ends at its tolerance of the residual
    assert np.max(np.abs(own - true) / true) < 10 * condition * Newton().tolerance
    assert float(data.peak_frequency_hz[0]) == pytest.approx(1.0 / (2.0 * np.pi), rel=1e-3)
    assert not data.sizes.get("contact", 0)


def test_time_integration_confirms_a_response_without_contacts() -> None:
    found = two_masses().forced_response(hz=(0.1, 0.35), points=8, verify=True)
    assert found.conclusion == "Every answer is trusted."
    assert np.max(np.abs(found["forced_response"].verify_difference_percent.values)) < 0.1


@pytest.mark.parametrize(
    ("analysis", "keys"),
    [("nonlinear_mode", {}), ("limit_cycle", {}), ("all_motions", {"frequency_hz": (0.1, 0.3)})],
    ids=lambda x: x if isinstance(x, str) else "",
)
def test_what_is_about_contacts_refuses_a_model_without_any(analysis: str, keys: dict[str, object]) -> None:
    with pytest.raises(ss.InputError, match=r"contact: there is none, and this analysis is about contacts\. Give"):
        getattr(two_masses(), analysis)(**keys)


def test_shooting_needs_a_contact() -> None:
    with pytest.raises(ss.InputError, match="is shooting, and the model has no contact"):
        two_masses().forced_response(hz=(0.1, 0.35), points=8, method="shooting")


def test_an_undamped_response_without_contacts_is_wrong_and_says_why() -> None:
    model = two_masses()
    bare = ss.Part(structure=ss.model.lumped(np.eye(2), STIFFNESS, np.zeros((2, 2)), names=("a", "b")))
    found = replace(model, parts={"p": bare}).forced_response(hz=(0.1, 0.2), points=6)
    assert "wrong" in found.conclusion
    (told,) = [v.why for v in found.verdicts if v.level == "wrong"]
    assert told.startswith("nothing damps the mode at 0.16 Hz: the peak has no finite value")
    assert [v.why for v in found.verdicts if v.level != "trusted"] == [
        told
    ]  # the jump to the resonance had been told as another motion
    assert not any("neutral" in v.why for v in found.verdicts)


def test_steps_as_wide_as_a_resonance_are_doubted() -> None:
    """Two light masses on equal springs, weakly coupled; the smaller of two narrow resonances is met, the larger is not."""
    stiffness = np.array([[1.0, -0.05], [-0.05, 1.0]]) * (2.0 * np.pi) ** 2
    damping = 2.0 * 5e-4 * 2.0 * np.pi * np.diag([1.0, 1.0])
    body = ss.model.lumped(np.eye(2), stiffness, damping, names=("a", "b"))
    model = ss.Model(
        parts={"p": ss.Part(structure=body)},
        loads={"f": ss.Load(on="p.a", newton=1.0), "g": ss.Load(on="p.b", newton=0.4)},
        outputs=(ss.Output(name="a", on="p.a"),),
    )
    low, high = np.sqrt(np.linalg.eigvalsh(stiffness)) / (2.0 * np.pi)
    span = (high - 0.11, high + 0.11)  # the larger peak, of the masses in phase, lies between two of 9 steps
    found = {n: model.forced_response(hz=span, frequencies=n, peak_points=6) for n in (9, 1001)}
    peaks = {n: float(one["forced_response"].peak_frequency_hz[0]) for n, one in found.items()}
    assert peaks[1001] == pytest.approx(low, abs=1e-3)
    assert "Every answer is trusted." in found[1001].conclusion
    assert "Not to be trusted" in found[9].conclusion
    (told,) = [v for v in found[9].verdicts if "wide at half power" in v.why]
    assert told.level == "doubtful"
    assert "a larger one may stand between them" in told.why


WHEEL = """schema_version = 2
[part.wheel]
shape = "lumped"
sectors = 6
names = ["disk", "tip"]
masses_kg = [1.2, 0.25]
springs_n_per_m = [["disk", "ground", 3e7], ["disk", "next.disk", 1.5e7], ["disk", "tip", 4.4e5]]
[part.wheel.damping]
modal_ratio = 1e-3
[load.gas]
on = "wheel.tip"
force_n = 1.0
engine_order = 2
{mistuning}
[forced_response]
frequency_hz = [205.0, 215.0]
points = 8
[output]
points = {{ tip = "wheel.tip" }}
"""
MISTUNING = """[mistuning.blades]
of = "wheel.tip"
distribution = "normal"
standard_deviation = 0.003
seed = 1
"""


def whole_wheel(hz: float, diameters: int = 2, sectors: int = 6) -> float:
    """Return the amplitude of a tip from the wave of the engine order, with modal damping."""
    m = np.array([1.2, 0.25])
    turn = 2.0 * (1.0 - np.cos(2.0 * np.pi * diameters / sectors))
    k = np.array([[3e7 + 1.5e7 * turn + 4.4e5, -4.4e5], [-4.4e5, 4.4e5]])
    values, modes = np.linalg.eigh(k / np.sqrt(np.outer(m, m)))
    own, omega = np.sqrt(values), 2.0 * np.pi * hz
    shapes = modes / np.sqrt(m)[:, None]
    return float(abs(np.sum(shapes[1] ** 2 / (own**2 - omega**2 + 2j * 1e-3 * own * omega))))


def test_the_commands_answer_for_wheels_without_contacts(tmp_path: Path) -> None:
    """A tuned wheel against its closed form; one whose blades scatter has a blade with more than that."""
    runner, peaks = CliRunner(), []
    for name, mistuning in (("tuned", ""), ("mistuned", MISTUNING)):
        study = tmp_path / name / "study.toml"
        study.parent.mkdir()
        study.write_text(WHEEL.format(mistuning=mistuning), encoding="utf-8")
        checked = runner.invoke(app, ["check", str(study)])
        assert checked.exit_code == 0, checked.output
        assert "0 contact points" in checked.output
        assert "natural frequencies:" in checked.output
        assert "contacts open" not in checked.output
        told = runner.invoke(app, ["run", str(study)])
        assert told.exit_code == 0, told.output
        assert "Every answer is trusted." in told.output
        data = ss.Result.from_file(study.parent / "results")["forced_response"]
        peaks.append(float(data.peak_amplitude[0]))
        if name == "tuned":
            own = [float(a) for a in data.amplitude.values.reshape(data.frequency_hz.size, -1)[:, 0]]
            true = [whole_wheel(float(f)) for f in data.frequency_hz.values.ravel()]
            assert own == pytest.approx(true, rel=1e-6)
        assert (study.parent / "results" / "report.html").stat().st_size > 1e5
    assert peaks[1] > peaks[0]
