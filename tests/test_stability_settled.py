"""Stability settled by more harmonics: closed forms of one mass, what is neutral, the list of transitions, and the sign of the determinant."""

from dataclasses import replace

import numpy as np
import plotly.graph_objects as go
import pytest

import stickslip as ss
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure, numbered_dofs
from stickslip.response.forced.problem import forced_problem
from stickslip.response.forced.response import accepted_pairs, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.stability import multipliers, settled_stability, stability
from stickslip.response.stability.course import course_of, cycle_of, has_transitions, sign_of
from stickslip.response.stability.found import NEUTRAL, Floquet, Stability, changes, may_leave
from stickslip.response.system import System

DAMPING = 0.04


def stopped(sweep: Sweep):
    """Return a mass that meets a stop twenty times as stiff as its spring, and the points of its response."""
    structure = Structure(np.eye(1), DAMPING * np.eye(1), np.eye(1), numbered_dofs(1))
    stop = ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=20.0, mu=0.0, preload=-20.0)
    contact = Interface(("stop",), (stop,), np.array([[0.0], [0.0], [-1.0]]))
    system, load = (System(structure, contact, np.array([0])), HarmonicLoad(np.zeros(1), {1: np.array([0.15 + 0j])}))
    problem = forced_problem(system, load, sweep)
    points = [p for p, _ in accepted_pairs(list(forced_response(system, load, sweep)))]
    return problem, points


def test_a_pair_of_one_damped_mass_has_the_modulus_of_its_damping_whatever_its_contact_does():
    """Liouville: the product of both multipliers is exp(-c T), and a pair that is not real shares it."""
    problem, points = stopped(Sweep(omega_range=(0.85, 1.35), points=12, peak_points=0))
    moved = 0
    for point in points:
        found = stability(problem, point)
        pair = found.floquet.multipliers[:2]
        exact = np.exp(-np.pi * DAMPING / point.omega)
        assert abs(pair[0] * pair[1]) == pytest.approx(exact**2, rel=1e-9)
        assert found.verdict == "stable"
        if abs(pair[0].imag) > 0.01:
            assert abs(found.multiplier - exact) <= found.multiplier_error + 1e-9
        moved += found.transitions > 0
    assert moved > 3


def test_no_motion_is_solved_without_need(monkeypatch):
    """Each motion that is solved with more harmonics has its multipliers taken: none is solved when the verdict is known."""
    problem, points = stopped(Sweep(omega_range=(0.85, 1.35), points=12, peak_points=0, low=1, high=3))
    solved, taken = [], []
    more_harmonics, of_point = multipliers.more_harmonics, multipliers.of_point

    def solving(*given):
        for more in more_harmonics(*given):
            solved.append(more.point)
            yield more

    def taking(problem, point):
        taken.append(point)
        return of_point(problem, point)

    monkeypatch.setattr(multipliers, "more_harmonics", solving)
    monkeypatch.setattr(multipliers, "of_point", taking)
    by_one_step = 0
    for point in points:
        before = len(solved), len(taken)
        stability(problem, point)
        by_one_step += (len(solved), len(taken)) == (before[0], before[1] + 2)
    assert solved
    assert by_one_step, "a Newton step with more harmonics is enough for some"
    assert {id(p) for p in solved} <= {id(p) for p in taken}


def test_what_nothing_damps_is_neutral_and_not_integrated_for_long():
    body = ss.model.lumped(np.eye(1), np.eye(1), names=("x",))
    spring = ss.Contact(between=("p.x", "ground"), law=ss.CubicSpring(cubic_t=1.0), acts="tangential")
    model = ss.Model(
        parts={"p": ss.Part(structure=body)},
        contacts={"s": spring},
        loads={"f": ss.Load(on="p.x", newton=0.1)},
        outputs=(ss.Output(name="o", on="p.x"),),
    )
    result = model.forced_response(hz=(0.19, 0.2546), points=8, high=7)
    data = result["forced_response"]
    meanings = dict(zip(data.motion_stability.flag_meanings.split(), data.motion_stability.flag_values, strict=True))
    assert set(data.motion_stability.values.tolist()) == {meanings["neutral"]}
    assert "verify_motion" not in data
    assert not any(v.level == "wrong" for v in result.verdicts)
    assert any("neutral" in v.why for v in result.verdicts)
    assert "unstable" not in " ".join(v.why for v in result.verdicts)


def test_neutral_is_what_neither_grows_nor_dies_within_its_error():
    def of(size: float, error: float) -> str:
        pair = size * np.exp(np.array([1j, -1j]))
        return Stability(Floquet(pair), np.full(2, error), 0, 0, 0).verdict

    assert of(1.0, 0.0) == "neutral"
    assert of(1.0 - 3e-5, 1e-4) == "neutral"
    assert of(1.0 - 3e-5, 1e-6) == "stable"
    assert of(1.0, 2.0 * NEUTRAL) == "undecided"
    assert of(1.0 + 0.5 * NEUTRAL, 0.4 * NEUTRAL) == "unstable"
    # a family of motions, as residual tractions make it, is not judged
    alone = Stability(Floquet(np.array([1.0 + 0j, 0.5])), np.zeros(2), 0, 0, 0)
    assert alone.verdict == "stable"


def test_a_modulus_counts_less_along_the_circle_until_the_pair_may_meet():
    old = 0.9 * np.exp(np.array([1.2j, -1.2j]))
    new = 0.9 * np.exp(np.array([1.0j, -1.0j]))
    distance, modulus = changes(new, old)
    assert distance == pytest.approx(np.full(2, 2 * 0.9 * np.sin(0.1)))
    assert modulus == pytest.approx(0.1 * distance)
    near = 0.9 * np.exp(np.array([0.1j, -0.1j]))
    assert changes(near, new)[1] == pytest.approx(changes(near, new)[0])
    assert changes(new, np.zeros(0, dtype=complex))[0] == pytest.approx(np.full(2, 0.9))


def test_two_pairs_that_meet_may_leave_the_circle_away_from_the_real_axis():
    """The error of their modulus is then their whole change."""

    def pairs(first: float, second: float, size: float = 0.98) -> np.ndarray:
        angles = np.array([first, -first, second, -second])
        return size * np.exp(1j * angles)

    apart, moduli = changes(pairs(1.0, 2.0), pairs(1.02, 2.02))
    assert moduli == pytest.approx(0.1 * apart)
    apart, moduli = changes(pairs(1.0, 1.05), pairs(0.98, 1.07))
    assert moduli == pytest.approx(apart)
    # by 20 times its change a pair may reach another one, 0.6 rad away, but not one 1.6 rad away
    assert may_leave(pairs(1.0, 1.6), pairs(0.98, 1.62))
    assert not may_leave(pairs(0.8, 2.4), pairs(0.79, 2.41))
    # strong damping keeps them inside, and pairs that did not move stay
    assert not may_leave(pairs(1.0, 1.6, 0.3), pairs(0.98, 1.62, 0.3))
    assert not may_leave(pairs(1.0, 1.6), pairs(1.0, 1.6))


def test_the_list_of_transitions_does_not_depend_on_where_the_cycle_begins():
    problem, points = stopped(Sweep(omega_range=(0.85, 1.35), points=12, peak_points=0))
    free, hit = points[0], points[-1]
    lists = [cycle_of(problem, p) for p in (free, hit)]
    assert lists[0] != lists[1]
    assert [has_transitions(c) for c in lists if c is not None] == [False, True]
    turned = replace(hit, coefficients=hit.coefficients * np.exp(1j * np.arange(hit.order + 1))[:, None])
    assert cycle_of(problem, turned) == lists[1]


def test_the_sign_of_the_determinant_follows_from_the_tangent():
    problem, points = stopped(Sweep(omega_range=(0.85, 1.35), points=12, peak_points=0))
    for point in points:
        alone = replace(point, tangent=np.zeros(0), orientation=0.0)
        assert sign_of(problem, point) == sign_of(problem, alone)
    course = course_of(problem, points, len(points), [])
    assert not course.turns.any()
    assert course.order == tuple(range(len(points)))


def two_folds() -> ss.Result:
    """The response of one mass with a stop that folds twice and runs backwards between."""
    body = ss.model.lumped(np.eye(1), 1e4 * np.eye(1), np.eye(1), names=("m",))
    stop = ss.Contact(between=("b.m", "ground"), law=ss.UnilateralSpring(k_n=5e3, initial_gap=1e-3), acts="normal")
    model = ss.Model(
        parts={"b": ss.Part(structure=body)},
        contacts={"stop": stop},
        loads={"f": ss.Load(on="b.m", newton=2.0)},
        outputs=(ss.Output(name="m", on="b.m"),),
    )
    return model.forced_response(hz=(16.5, 18.5))


def test_an_unstable_stretch_is_an_answer_and_marks_no_case(tmp_path):
    result = two_folds()
    data = result["forced_response"]
    branch = data.isel(point=np.flatnonzero(data.refinement.values == 0))
    back = np.flatnonzero(np.diff(branch.frequency_hz.values) < 0)
    inner = back[1:]  # the first step backwards goes around the fold
    assert inner.size > 3
    assert set(branch.motion_stability.values[inner].tolist()) == {1}
    assert set(branch.verdict.values[inner].tolist()) == {3}
    assert set(branch.motion_stability.values[: back[0]].tolist()) == {0}
    assert int(data.case_verdict.values[0]) == 0
    assert int(data.motion_stability.values[int(data.peak_point.values[0])]) == 0
    first = next(v for v in result.verdicts if v.level == "trusted" and v.why.startswith("peak with"))
    assert ", stable" in first.why
    assert not any(v.level == "wrong" for v in result.verdicts)
    drawn = result.plot("response")
    dashes = [t.line.dash for t in drawn.data if isinstance(t, go.Scatter) and t.line.dash]
    assert "dash" in dashes


def with_another_verdict(monkeypatch, order: int, size: float) -> None:
    """Let motions with harmonics up to `order` have a multiplier of modulus `size`, and those with more one of 0.9."""

    def told(_, point):
        pair = np.full(2, size if point.order <= order else 0.9, dtype=complex)
        return Stability(Floquet(pair), np.zeros(2), 0, 0, 4)

    monkeypatch.setattr("stickslip.response.stability.multipliers.of_point", told)


@pytest.mark.parametrize(("size", "away", "another"), [(1.2, 0.004, True), (0.95, 0.02, True), (0.95, 0.004, False)])
def test_a_motion_comes_with_its_verdict_on_the_other_side_of_the_circle_and_where_it_is_another(
    monkeypatch, size, away, another
):
    problem, points = stopped(Sweep(omega_range=(0.95, 1.1), points=4, peak_points=0))
    point = points[-1]
    with_another_verdict(monkeypatch, point.order, size)
    monkeypatch.setattr(type(problem), "real_error", lambda *_: away)
    found = settled_stability(problem, point)
    assert found.stability.verdict == "stable"
    assert (found.motion is not None) == another
    if found.motion is not None:
        assert found.motion.order > point.order
        # nothing is known of a point from a motion that is farther away than the threshold
        monkeypatch.setattr(type(problem), "real_error", lambda *_: 0.06)
        far = settled_stability(problem, point)
        assert far.motion is None
        assert far.stability.verdict == "undecided"


@pytest.mark.parametrize("fixed", [False, True])
def test_a_point_is_told_by_the_motion_whose_stability_is_told(monkeypatch, fixed):
    """With ``high = "auto"`` that motion takes its place; where a study fixes fewer harmonics the multipliers leave it undecided."""
    body = ss.model.lumped(np.eye(1), np.eye(1), DAMPING * np.eye(1), names=("x",))
    stop = ss.Contact(between=("body.x", "ground"), law=ss.UnilateralSpring(k_n=20.0, initial_gap=1.0), acts="normal")
    model = ss.Model(
        parts={"body": ss.Part(structure=body)},
        contacts={"stop": stop},
        loads={"shaker": ss.Load(on="body.x", newton=0.15)},
    )
    keys = {"hz": [h / (2 * np.pi) for h in (0.95, 1.0, 1.05)]} | ({"high": 3} if fixed else {})
    before = model.forced_response(**keys)["forced_response"]
    most = int(before.order.values.max())
    with_another_verdict(monkeypatch, most, 1.2)
    after = model.forced_response(**keys)["forced_response"]
    assert after.sizes["point"] == before.sizes["point"]
    said = [str(t) for t in after.stability_sentence.values]
    if fixed:
        assert np.array_equal(after.order.values, before.order.values)
        assert any("the harmonics asked for are too few for its stability" in t for t in said)
    else:
        own = before.order.values == most
        assert np.all(after.order.values[own] > most)
        assert set(after.motion_stability.values[own]) == {0}
    assert after.amplitude.values == pytest.approx(before.amplitude.values, rel=0.05)
