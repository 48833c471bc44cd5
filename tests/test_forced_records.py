"""What a job puts down of a forced response: each number under its name, from stand-ins whose values are told apart."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import stickslip as ss
from stickslip.analyses.forced_response.physics import model_change
from stickslip.analyses.forced_response.records import dataset
from stickslip.analyses.forced_response.records.columns import COLUMNS, OWNERS
from stickslip.analyses.forced_response.records.values import of_checks
from stickslip.analyses.forced_response.stability import bifurcating, elsewhere
from stickslip.analyses.forced_response.stability.bifurcating import of_bifurcations
from stickslip.analyses.forced_response.stability.in_time import Check
from stickslip.analyses.forced_response.stability.not_periodic import Answer, of_answers
from stickslip.units import HZ

ONCE = (
    "peak_frequency_hz",
    "unstable_peak_frequency_hz",
    "neglected_frequency_hz",
)  # frequencies of a case, not of rows


def check(found: dict[str, Any], **expected: Any) -> None:
    """Assert that values are as expected, text for text and number for number."""
    for name, wanted in expected.items():
        if np.asarray(wanted).dtype.kind in "US":
            assert np.asarray(found[name]).tolist() == np.asarray(wanted).tolist(), name
        else:
            np.testing.assert_allclose(found[name], wanted, rtol=1e-13, err_msg=name)


def test_comparisons_with_time_integration() -> None:
    checks = [
        Check(
            frequency_hz=f,
            balance=2e-3 * f,
            transient=1e-3 * f,
            settled=f > 1,
            periods=int(40 * f),
            scatter=0.1 * f,
            refined=3e-3 * f,
            outputs_percent=7.0 * f,
            motion=m,
        )
        for f, m in ((1.0, "left"), (2.0, "attained"))
    ]
    check(
        of_checks(checks),
        verify_frequency_hz=[1.0, 2.0],
        verify_balance=[2e-3, 4e-3],
        verify_transient=[1e-3, 2e-3],
        verify_settled=[0, 1],
        verify_periods=[40, 80],
        verify_scatter=[0.1, 0.2],
        verify_refined=[3e-3, 6e-3],
        verify_outputs_percent=[7.0, 14.0],
        verify_motion=["left", "attained"],
        verify_sentence=[c.sentence for c in checks],
        verify_difference_percent=[c.difference_percent for c in checks],
    )


def test_motions_in_time_where_no_balance_stands_for_them() -> None:
    def answer(k: float) -> Answer:
        names = ("largest", "least", "mean", "rms", "extreme", "line_hz", "line_amplitude", "amplitudes")
        of_outputs = {name: np.array([k, k + 10.0 * i]) for i, name in enumerate(names)}
        return Answer(
            omega=k * HZ,
            why="",
            spread=0.1 * k,
            periods=int(100 * k),
            seconds=5.0 * k,
            settled=k > 1,
            periodic=k < 2,
            sentence=f"of {k:g}",
            **of_outputs,
        )

    def pairs(i: int) -> list[list[float]]:
        return [[1.0, 1.0 + 10.0 * i], [2.0, 2.0 + 10.0 * i]]

    check(
        of_answers([answer(1.0), answer(2.0)]),
        not_periodic_frequency_hz=[1.0, 2.0],
        not_periodic_largest=pairs(0),
        not_periodic_least=pairs(1),
        not_periodic_mean=pairs(2),
        not_periodic_rms=pairs(3),
        not_periodic_extreme=pairs(4),
        not_periodic_line_hz=pairs(5),
        not_periodic_line_amplitude=pairs(6),
        not_periodic_amplitudes=pairs(7),
        not_periodic_spread=[0.1, 0.2],
        not_periodic_periods=[100, 200],
        not_periodic_seconds=[5.0, 10.0],
        not_periodic_settled=[0, 1],
        not_periodic_repeats=[1, 0],
        not_periodic_sentence=["of 1", "of 2"],
    )


def test_bifurcations_and_the_branches_that_leave_there(monkeypatch: pytest.MonkeyPatch) -> None:
    def bifurcation(k: float, kind: str) -> Any:
        point = SimpleNamespace(coefficients=1e-3 * k)
        return SimpleNamespace(
            omega=k * HZ,
            omega_error=0.1 * k * HZ,
            point=point,
            kind=kind,
            multiplier=complex(k, -k),
            multiplier_error=0.01 * k,
            certain=k > 1,
            after=int(k),
            sentence=f"{kind} {k:g}",
        )

    def side(periods: int, *omegas: float) -> Any:
        return SimpleNamespace(
            periods=periods,
            sentence=f"{len(omegas)} points",
            points=[SimpleNamespace(omega=w * HZ) for w in omegas],
            amplitude=lambda p, output: p.omega / HZ + output,
            subharmonic=lambda p, output: 10 * p.omega / HZ + output,
            localisation=lambda p: 0.01 * p.omega / HZ,
        )

    monkeypatch.setattr(bifurcating, "limits", lambda *_: ("not beyond 9 Hz", "4 solutions"))
    own = [bifurcation(1.0, "fold"), bifurcation(2.0, "period doubling")]
    found: Any = SimpleNamespace(found=own, stabilities=[None])
    question: Any = SimpleNamespace(
        problem=SimpleNamespace(amplitude_of=lambda omega, c, output: c * omega / HZ + output)
    )
    response: Any = SimpleNamespace(output=3, accepted=[0, 0])
    sides: Any = [(own[1], side(2, 5.0, 6.0)), (own[0], side(1, 7.0))]
    check(
        of_bifurcations(question, response, found, sides),
        bifurcation_frequency_hz=[1.0, 2.0],
        bifurcation_frequency_error_hz=[0.1, 0.2],
        bifurcation_amplitude=[3.001, 3.004],
        bifurcation_kind=["fold", "period doubling"],
        bifurcation_multiplier=[[1.0, -1.0], [2.0, -2.0]],
        bifurcation_multiplier_error=[0.01, 0.02],
        bifurcation_certain=[0, 1],
        bifurcation_outside=[1, 2],
        bifurcation_sentence=["fold 1", "period doubling 2"],
        bifurcations_limits="not beyond 9 Hz; 4 solutions",
        side_branch_frequency_hz=[2.0, 1.0],
        side_branch_periods=[2, 1],
        side_branch_sentence=["from the period doubling at 2 Hz: 2 points", "from the fold at 1 Hz: 1 points"],
        side_point_frequency_hz=[10.0, 12.0, 7.0],
        side_point_branch=[0, 0, 1],
        side_point_amplitude=[8.0, 9.0, 10.0],
        side_point_subharmonic=[53.0, 63.0, 73.0],
        side_point_localisation=[0.05, 0.06, 0.07],
        motion_stability=[3, 3],
        motion_stability_basis=[0, 0],
    )


def test_other_motions_are_told_unless_they_are_unstable(monkeypatch: pytest.MonkeyPatch) -> None:
    def other(k: float) -> Any:
        return SimpleNamespace(
            point=SimpleNamespace(omega=k * HZ), amplitude=1e-3 * k, known=2e-3 * k, start=f"start {k:g}"
        )

    words = {1.0: "stable", 2.0: "unstable", 3.0: "undecided"}
    top = SimpleNamespace(point=SimpleNamespace(converged=True))
    monkeypatch.setattr(elsewhere, "other_motions", lambda *_: [other(k) for k in words])
    monkeypatch.setattr(elsewhere, "_stability", lambda _, o: words[o.point.omega / HZ])
    response: Any = SimpleNamespace(top=top, flanks=(), solved=(), output=0, accepted=())
    question: Any = SimpleNamespace(problem=None)
    check(
        elsewhere.motions_elsewhere(question, response),
        another_frequency_hz=[1.0, 3.0],
        another_amplitude=[1e-3, 3e-3],
        another_known=[2e-3, 6e-3],
        another_start=["start 1", "start 3"],
        another_stability=["stable", "undecided"],
    )


def test_motions_on_the_branch_itself_are_no_other_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Within 0.5 % of the frequency and 3 % of the amplitude of a point that was solved, such as beyond a fold."""

    def other(hertz: float, amplitude: float) -> Any:
        return SimpleNamespace(point=SimpleNamespace(omega=hertz * HZ), amplitude=amplitude, known=1.0, start="rest")

    def accepted(hertz: float, amplitude: float, fields: object = 0) -> Any:
        return SimpleNamespace(point=SimpleNamespace(omega=hertz * HZ), size=amplitude, fields=fields)

    beside = [(100.4, 2.05), (100.6, 2.0), (100.0, 2.07), (99.6, 1.95), (100.0, 1.93), (50.0, 1.0)]
    monkeypatch.setattr(elsewhere, "other_motions", lambda *_: [other(*each) for each in beside])
    monkeypatch.setattr(elsewhere, "_stability", lambda *_: "stable")
    response: Any = SimpleNamespace(
        top=SimpleNamespace(point=SimpleNamespace(converged=True)),
        flanks=(),
        solved=(),
        output=0,
        accepted=(accepted(100.0, 2.0), accepted(50.0, 1.0, None)),
        amplitude=lambda a: a.size,
    )
    check(
        elsewhere.motions_elsewhere(SimpleNamespace(problem=None), response),  # type: ignore[arg-type]
        another_frequency_hz=[100.6, 100.0, 100.0, 50.0],
        another_amplitude=[2.0, 2.07, 1.93, 1.0],
    )


def test_changes_of_the_peak_with_more_modes_and_fewer_points(monkeypatch: pytest.MonkeyPatch) -> None:
    def at(amplitude: float, hertz: float) -> Any:
        return SimpleNamespace(amplitude=lambda *_: amplitude), SimpleNamespace(omega=hertz * HZ)

    own: Any = SimpleNamespace(retained=np.arange(4))
    fewer: Any = SimpleNamespace(retained=np.array([0, 2]))
    model = SimpleNamespace(system=own, load=None)
    point = SimpleNamespace(converged=True, coefficients=np.zeros((2, 4)))
    monkeypatch.setattr(model_change, "replace", lambda p, **_: p)
    monkeypatch.setattr(model_change, "with_few_harmonics", lambda _, p: p)
    monkeypatch.setattr(model_change, "_richer", lambda _: ("richer", None))
    monkeypatch.setattr(model_change, "_coarser", lambda _: (fewer, 7))
    peaks = {id(own): at(2.0, 100.0), id("richer"): at(2.2, 101.0), id(fewer): at(1.9, 98.0)}
    monkeypatch.setattr(model_change, "peak_near", lambda system, *_: peaks[id(system)])
    response: Any = SimpleNamespace(top=SimpleNamespace(point=point), output=0)
    question: Any = SimpleNamespace(model=model, sweep=None)
    check(
        model_change.model_changes(question, response),
        modes_peak_change=0.1,
        modes_frequency_change_hz=1.0,
        points_peak_change=-0.05,
        points_frequency_change_hz=-2.0,
        points_left_out=7,
    )


def test_rows_of_cases_follow_each_other_and_say_whose_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dataset, "with_levels", lambda *_: {})
    told = {"points": 2, "peak_point": 1, "attributes": "{}", "choice_sentence": "at 5 Hz", "points_failed": 1}
    one = told | {name: np.array([1.0, 2.0]) for name in COLUMNS if name.endswith("frequency_hz") and name not in ONCE}
    rows = np.array([[0, 1, 2], [1, 2, 3]])  # of what has no frequency
    one |= dict.fromkeys(("stress_triangle", "drawn_triangle", "drawn_load_point", "drawn_support"), rows)
    data = dataset.put_together([one, one | {"peak_point": -1}], ["first", "second"])
    owners = {owner: data[owner].values for owner in OWNERS.values()}
    each = [0, 0, 1, 1]
    check(owners, point_case=each, another_case=each, attempt_case=each, alert_case=each, bifurcation_case=each)
    check(owners, verify_case=each, stability_case=each, not_periodic_case=each, tuned_case=each)
    check(owners, side_branch_case=each, side_point_case=each, stress_face_case=each, drawn_face_case=each)
    check(owners, drawn_load_case=each, drawn_support_case=each)
    check({name: data[name].values for name in told if name in data}, peak_point=[1, -1], points=[2, 2])
    assert data["choice_sentence"].values.tolist() == ["at 5 Hz", "at 5 Hz"]
    assert data.attrs["failed"] == 2
    assert data.attrs["alert_explanation"] == "first: at 5 Hz second: at 5 Hz"


@pytest.fixture(scope="module")
def slipping() -> Any:
    """Two masses, the second one on a slider: the response, solved with one harmonic and again with five where the alert says so."""
    part = ss.Part(
        structure=ss.Structure(
            mass=np.eye(2),
            damping=0.02 * np.array([[2.0, -1.0], [-1.0, 2.0]]),
            stiffness=np.array([[2.0, -1.0], [-1.0, 2.0]]),
            dofs=ss.model.Dofs(np.array([0, 1]), ("x", "x"), np.zeros((2, 3))),
            sets={"one": np.array([0]), "two": np.array([1])},
        )
    )
    model = ss.Model(
        parts={"pair": part},
        contacts={
            "brake": ss.Contact(between=("pair.two", "ground"), law=ss.Jenkins(k_t=1.0, limit=0.3), acts="tangential")
        },
        loads={"shaker": ss.Load(on="pair.one", newton=0.5)},
        outputs=(ss.Output(name="tip", on="pair.two"),),
    )
    result = model.forced_response(
        hz=(0.12, 0.3),
        low=1,
        high=5,
        points=12,
        peak_points=2,
        passages="double",
        alert_threshold_percent=0.05,
        stability="off",
    )
    return result.data["forced_response"].to_dataset().isel(case=0)


def test_frequencies_of_the_model_are_those_of_its_matrices(slipping: Any) -> None:
    opened, stuck = (np.sqrt([1.0, 3.0]) / HZ, np.sqrt(np.linalg.eigvalsh([[2.0, -1.0], [-1.0, 3.0]])) / HZ)
    check(slipping, frequency_full_hz=opened, frequency_reduced_hz=opened)
    check(slipping, frequency_stuck_full_hz=stuck, frequency_stuck_reduced_hz=stuck)


def test_attempts_are_all_solutions_and_alerts_the_first_ones(slipping: Any) -> None:
    kept, repeated = slipping["attempt_kept"].values, slipping["attempt_repeated"].values
    assert int(slipping["points_low"]) + int(slipping["points_high"]) == int(slipping["points"])
    assert set(slipping["attempt_status"].values.tolist()) == {0}
    assert len(slipping["attempt_frequency_hz"]) > int(slipping["points"])
    assert int(slipping["attempt_newton_iterations"].sum()) <= int(slipping["newton_steps"])
    stages = slipping["attempt_stage"].attrs["flag_meanings"].split()
    first = slipping["attempt_stage"].values == stages.index("low")
    assert first.any()
    assert np.all(kept[first].sum(axis=1) == 2)  # the mean and the first harmonic
    asked = np.isfinite(slipping["attempt_indicator"].values) & first
    np.testing.assert_array_equal(
        slipping["alert_error_percent"].values, 100 * slipping["attempt_indicator"].values[asked]
    )
    np.testing.assert_array_equal(slipping["alert_repeated"].values, repeated[asked])
    assert repeated.any()


def test_amplitudes_of_first_solutions_are_those_of_points_with_their_harmonics(slipping: Any) -> None:
    low, own = slipping["amplitude_low"].values[:, 0], slipping["amplitude"].values[:, 0]
    single = (slipping["harmonic_kept"].values.sum(axis=1) == 2) & np.isfinite(low)
    assert single.any()
    np.testing.assert_array_equal(low[single], own[single])
    assert np.any(np.isfinite(low) & (low != own))


def test_the_period_at_the_peak_is_that_of_its_frequency(slipping: Any) -> None:
    time = slipping["peak_time"].values
    step = np.diff(time)
    np.testing.assert_allclose(step, step[0], rtol=1e-9)
    assert time[-1] + step[0] == pytest.approx(1.0 / float(slipping["peak_frequency_hz"]), rel=1e-9)


def test_what_is_not_there_is_told_as_nothing(slipping: Any) -> None:
    check(slipping, unstable_peak_amplitude=np.nan, unstable_peak_frequency_hz=np.nan, peak_slip_facets=np.nan)
    check(slipping, retention_frequency_shift_hz=np.nan)
    assert [v["why"].partition(" the mode")[0] for v in json.loads(slipping["physics_verdicts"].item())] == [
        "friction damps"
    ]
    assert "surface_point" not in slipping
    assert "surface_triangle" not in slipping
