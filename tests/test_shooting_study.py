"""``forced_response.method = "shooting"``: held against balances and a plain integration, its verdicts, page, resumption, refusals."""

import shutil
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.analyses.forced_response.analysis import FORCED_RESPONSE
from stickslip.analyses.forced_response.stability.stable import examine
from stickslip.analyses.forced_response.table import STEPS
from stickslip.analyses.page import plots, report_html
from stickslip.response.forced.by_shooting import shooting_response
from stickslip.response.forced.collected import collect
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study

pytestmark = pytest.mark.usefixtures("peak_alone")

EXAMPLES = Path(__file__).parents[1] / "examples"
OFF: dict[str, Any] = {"peak_points": 0, "not_periodic": "off"}
BALANCED: dict[str, Any] = {"selection": "always_high", "samples": 1024, "stability": "off"}


@cache
def model(name: str) -> ss.Model:
    """Return the model of an example, its first case, with changed lines."""
    text = (EXAMPLES / name / "study.toml").read_text().partition("[vary]")[0]
    for old, new in CHANGES[name]:
        assert old in text
        text = text.replace(old, new)
    with TemporaryDirectory() as folder:
        for file in (EXAMPLES / name).glob("*.npz"):
            shutil.copy(file, folder)
        path = Path(folder) / "study.toml"
        path.write_text(text)
        return ss.Study.from_file(path).model()


# loads under which every friction contact slips: one that sticks leaves a family of motions, and each method finds its own
CHANGES = {
    "four_masses": [("force_n = 5.0", "force_n = 8.0")],
    "impacting_mass": [],
    "own_matrices": [("force_n = 10.0", "force_n = 40.0")],
}


def motion(data: xr.Dataset, name: str = "output_displacement") -> Any:
    own = data[name].values
    return own[..., 0] + 1j * own[..., 1]


def held(model: ss.Model, hertz: list[float], orders: tuple[int, int], steps: int = STEPS) -> tuple[float, float]:
    """Compare with balances of two orders; return the largest difference over its bound, and the bound over the vibration.

    The bound is twice the error of the time step that shooting estimates (0.8 to 1.3 of the true one in its own tests), and what the
    upper half of the harmonics changes in the balance, which what is left out beyond does not exceed.
    """
    listed = {"frequencies_hz": hertz, **OFF}
    shot = model.forced_response(method="shooting", steps_per_period=steps, **listed)["forced_response"]
    few, many = (model.forced_response(high=h, **BALANCED, **listed)["forced_response"] for h in orders)
    assert shot.status.values.tolist() == many.status.values.tolist() == [0] * len(hertz)
    found, low, high = (motion(d)[:, :6] for d in (shot, few, many))
    sizes = np.maximum(
        np.abs(motion(shot)[:, 1:]).max(axis=(1, 2)),
        np.abs(motion(shot, "retained_displacement")[:, 1:]).max(axis=(1, 2)),
    )
    worst, wide = 0.0, 0.0
    for i, size in enumerate(sizes):
        step = 2 * shot.shot_step_error_percent.values[i] / 100 * size
        bound = step + np.abs(high[i] - low[i]).max()
        worst = max(worst, float(np.abs(found[i] - high[i]).max() / bound))
        wide = max(wide, float(bound / size))
    rubs = shot.contact_law.values != "unilateral_spring"
    elastic = np.abs(motion(shot, "gap")[:, 1:] * motion(shot, "contact_force")[:, 1:]).sum(axis=(1, 2, 3))
    assert np.all(shot.dissipated_energy.values[:, rubs] > 1e-3 * elastic[:, None])
    return worst, wide


def test_four_masses_vibrate_as_balances_of_many_harmonics_do() -> None:
    worst, wide = held(model("four_masses"), [11.2, 12.0, 13.0], (30, 60))
    assert worst <= 1.0
    assert wide < 2e-3


def test_a_chain_from_matrices_vibrates_so() -> None:
    worst, wide = held(model("own_matrices"), [7.5, 8.6], (20, 40))
    assert worst <= 1.0
    assert wide < 5e-3


@pytest.mark.validation
def test_a_mass_that_meets_a_stop_vibrates_so() -> None:
    """The contact opens in every period: the error of the step is of first order there, and harmonics decay slowly."""
    worst, wide = held(model("impacting_mass"), [26.0, 30.0], (30, 60), steps=4096)
    assert worst <= 1.0
    assert wide < 1e-2


def four_masses_in_time(hertz: float, force: float, rtol: float, periods: int) -> Any:
    """Integrate the four masses of the example from rest by scipy, written down here; return the first harmonic of the last mass in the last two periods."""
    omega = 2 * np.pi * hertz
    chain = np.diag([2.0, 2.0, 2.0, 1.0]) - np.eye(4, k=1) - np.eye(4, k=-1)
    sliders = ((2e4, 2.0, np.array([0.0, 1, 0, 0])), (1e4, 1.0, np.array([0.0, 0, 1, -1])))

    def rate(t: float, y: Any) -> Any:
        q, v, z = y[:4], y[4:8], y[8:]
        push = -4e4 * chain @ q - 6.0 * chain @ v
        push[0] += force * np.cos(omega * t)
        push[3] -= 5e3 * max(q[3] - 1e-3, 0.0)
        moved = []
        for (k, limit, row), stretch in zip(sliders, z, strict=True):
            push -= np.clip(k * stretch, -limit, limit) * row
            speed = float(row @ v)
            slides = abs(k * stretch) >= limit and speed * stretch > 0.0
            moved.append(0.0 if slides else speed)
        return np.concatenate([v, push, moved])

    period, samples = 1.0 / hertz, 512
    last = np.linspace((periods - 2) * period, periods * period, 2 * samples + 1)[:-1]
    out = solve_ivp(
        rate, (0.0, periods * period), np.zeros(10), t_eval=last, rtol=rtol, atol=1e-12, max_step=period / 256
    )
    turn = np.exp(-1j * omega * last)
    return [2 * np.mean((out.y[3] * turn)[part]) for part in (slice(samples), slice(samples, None))]


@pytest.mark.validation
def test_one_frequency_is_that_of_a_plain_integration_by_scipy() -> None:
    """No code is shared: the equations are written down in this test. The stop is not met, both sliders move."""
    data = model("four_masses").forced_response(method="shooting", frequencies_hz=[13.0], **OFF)["forced_response"]
    name = [str(x) for x in data.output.values].index("last.x")
    found = motion(data)[0, 1, name]
    before, after = four_masses_in_time(13.0, 8.0, 1e-8, 60)
    coarse = four_masses_in_time(13.0, 8.0, 1e-6, 60)[1]
    settling, error = abs(after - before), abs(after - coarse)
    size = np.abs(motion(data, "retained_displacement")[0, 1:]).max()
    bound = 10 * (settling + error) + 2 * data.shot_step_error_percent.values[0] / 100 * size
    assert abs(found - after) <= bound
    assert bound < 1e-3 * abs(found)


@pytest.fixture(scope="module")
def result() -> ss.Result:
    return model("four_masses").forced_response((12.0, 15.0), method="shooting", points=7, peak_points=2)


def test_residual_error_and_multipliers_are_stored_and_judged(result: ss.Result) -> None:
    data = result["forced_response"]
    assert data.sizes["shot"] == data.sizes["point"]
    assert np.all(data.shot_case.values == 0)
    np.testing.assert_array_equal(data.shot_frequency_hz.values, data.frequency_hz.values)
    assert np.all(data.shot_residual.values <= 1e-9)  # the tolerance of shooting
    np.testing.assert_array_equal(data.own_error_percent.values, data.shot_step_error_percent.values)
    assert np.all(data.shot_steps.values == STEPS)
    assert np.all(data.shot_periods.values > data.shot_corrections.values)
    assert np.all(data.shot_corrections.values >= 1)
    np.testing.assert_array_equal(data.newton_iterations.values, data.shot_corrections.values)
    assert np.all(data.motion_stability.values == 0)  # every motion is examined, and stable
    assert np.all(data.motion_stability_basis.values == 1)
    assert data.stability_multiplier.values.max() < 1.0


def test_a_stuck_motion_has_the_multipliers_of_the_linear_structure() -> None:
    """At 100 Hz nothing slips: the decay of the least damped mode from matrices written down here, neutral multipliers of resting sliders left out.

    The open stop is integrated as a mass k h²/12 too little (docs/theory/shooting.md), the rest of the step without error.
    """
    data = model("four_masses").forced_response(method="shooting", frequencies_hz=[100.0], **OFF)["forced_response"]
    assert np.all(data.dissipated_energy.values < 1e-12)
    chain = np.diag([2.0, 2.0, 2.0, 1.0]) - np.eye(4, k=1) - np.eye(4, k=-1)
    stiff = 4e4 * chain + 2e4 * np.diag([0.0, 1, 0, 0])
    stiff[2:, 2:] += 1e4 * np.array([[1.0, -1], [-1, 1]])
    mass = np.array([1.0, 1, 1, 1 - 5e3 * (0.01 / STEPS) ** 2 / 12])[:, None]
    first = np.block([[np.zeros((4, 4)), np.eye(4)], [-stiff / mass, -6.0 * chain / mass]])
    largest = np.exp(np.linalg.eigvals(first).real.max() / 100.0)
    assert float(data.stability_multiplier[0]) == pytest.approx(largest, rel=1e-8)


def test_coarse_steps_are_doubted_with_the_key_that_helps() -> None:
    keys = OFF | {"method": "shooting", "frequencies_hz": [13.0], "alert_threshold_percent": 0.01, "high": 15}
    coarse, fine = (
        model("four_masses").forced_response(**keys, steps_per_period=steps)["forced_response"] for steps in (64, 4096)
    )
    assert float(coarse.shot_step_error_percent[0]) > 0.01 > float(fine.shot_step_error_percent[0])
    told = [str(d.verdict_reason.values[0]) for d in (coarse, fine)]
    assert "shorter time steps than 64 a period are expected to change it by" in told[0]
    assert "time steps" not in told[1]


def test_a_resumed_response_takes_over_points_and_goes_on_to_the_bit(tmp_path: Path) -> None:
    text = (EXAMPLES / "four_masses" / "study.toml").read_text().partition("[vary]")[0]
    path = tmp_path / "study.toml"
    path.write_text(text.replace("[8.0, 16.0]", '[12.5, 15.0]\nmethod = "shooting"\npoints = 5\npeak_points = 1'))
    case = read_study(path).cases()[0]
    question = FORCED_RESPONSE.inputs(case, case.build())
    assert question.stepping is not None
    arguments = (question.model.system, question.model.load, question.sweep, question.stepping)
    whole = list(shooting_response(*arguments))
    rest = list(shooting_response(*arguments, done=whole[:2]))
    assert len(rest) == len(whole) - 2
    for one, other in zip(whole[2:], rest, strict=True):
        np.testing.assert_array_equal(one.coefficients, other.coefficients)
        np.testing.assert_array_equal(one.shot[0].multipliers, other.shot[0].multipliers)
    response = collect(question.problem, whole, 0)
    assert examine(question, response.accepted[0]).verdict == "stable"
    assert run_study(read_study(path)).failed == 0  # records come back from the journal
    again = run_study(read_study(path)).tree["forced_response"].to_dataset()
    np.testing.assert_array_equal(motion(again, "retained_displacement"), [p.coefficients for p in whole])


def test_page_and_terminal_name_the_method(result: ss.Result) -> None:
    html = report_html(result.data)
    assert f"Each motion was found in time by shooting, {STEPS} steps a period." in html
    assert "largest residual" in html
    assert "low_order" not in plots(result.data)
    assert {"response", "states"} <= set(plots(result.data))


def test_a_comparison_pairs_balance_with_shooting(result: ss.Result) -> None:
    balance = model("four_masses").forced_response((12.0, 15.0), points=7, peak_points=2)
    peaks = ss.compare(balance, result, names=("balance", "shooting")).peaks
    assert peaks["design"].tolist() == ["balance", "shooting"]
    assert abs(float(peaks["against the first (%)"].iloc[1])) < 5.0


def test_both_methods_stand_in_one_study(tmp_path: Path) -> None:
    text = (EXAMPLES / "four_masses" / "study.toml").read_text().partition("[vary]")[0]
    few = "[13.0, 15.0]\npoints = 4\npeak_points = 0"
    path = tmp_path / "study.toml"
    path.write_text(text.replace("[8.0, 16.0]", few) + '\n[vary]\nforced_response.method = ["balance", "shooting"]\n')
    data = run_study(read_study(path)).tree["forced_response"].to_dataset()
    assert np.all(data.shot_case.values == 1)
    assert data.sizes["shot"] == 4
    assert float(data.peak_amplitude[0]) == pytest.approx(
        float(data.peak_amplitude[1]), rel=0.05
    )  # the alert's threshold


REFUSED = (
    ({"steps_per_period": 512}, "is for method = 'shooting', and method is 'balance', got 512"),
    (
        {"method": "shooting", "bifurcations": "all"},
        "bifurcations: is 'all', and method = 'shooting' follows no branch",
    ),
    ({"method": "shooting", "selection": "always_high"}, "harmonics.selection: is 'always_high', and"),
    ({"method": "shooting", "similarity": True}, "harmonics.similarity: is True, and"),
    (
        {"method": "shooting", "high": [1, 3]},
        r"harmonics.high: is the list \[1, 3\], and shooting leaves no harmonics out",
    ),
    ({"method": "shooting", "globalisation": "dogleg"}, "solver.globalisation: is 'dogleg', and"),
    (
        {"method": "shooting", "high": 32, "steps_per_period": 64},
        "steps_per_period: must be more than twice the highest harmonic, 32",
    ),
    ({"method": "shooting", "verify": True}, "method: is shooting, and --verify checks a balance"),
)


@pytest.mark.parametrize(("keys", "said"), REFUSED)
def test_keys_without_a_use_are_refused(keys: dict[str, Any], said: str) -> None:
    with pytest.raises(ss.InputError, match=said):
        model("four_masses").forced_response((12.0, 15.0), **keys)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'law = "unilateral_spring", normal_stiffness_n_per_m = 5e3, gap_m = 1e-3',
            'law = "rigid_coulomb", friction_coefficient = 0.1, gap_m = 1e-3',
            r"contact\.stop\.law: is rigid_coulomb, whose force is no function of the gap",
        ),
        (
            'dashpots_n_s_per_m = [["ground", 1, 6.0], [1, 2, 6.0], [2, 3, 6.0], [3, 4, 6.0]]',
            "damping = { loss_factor = 0.01 }",
            r"part\.chain\.damping\.loss_factor: is structural damping",
        ),
    ],
)
def test_models_without_a_form_in_time_are_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = (EXAMPLES / "four_masses" / "study.toml").read_text().partition("[vary]")[0]
    assert old in text
    path = tmp_path / "study.toml"
    path.write_text(text.replace(old, new).replace("[8.0, 16.0]", '[8.0, 16.0]\nmethod = "shooting"'))
    case = read_study(path).cases()[0]
    with pytest.raises(ss.InputError, match=said):
        FORCED_RESPONSE.inputs(case, case.build())


def test_wheels_are_refused(tmp_path: Path) -> None:
    text = (EXAMPLES / "friction_ring" / "study.toml").read_text()
    path = tmp_path / "study.toml"
    path.write_text(text.replace("[forced_response]", '[forced_response]\nmethod = "shooting"'))
    case = read_study(path).cases()[0]
    with pytest.raises(ss.InputError, match=r"part\.blisk\.sectors: is 24, and shooting integrates no wheels"):
        FORCED_RESPONSE.inputs(case, case.build())
