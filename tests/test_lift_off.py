"""Lift-off without a periodic motion: with ``rescue = "off"`` a sweep gives up soon; with ``"in_time"`` every frequency ends with a motion or a verdict."""

from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from newton_bounds import unknowns_bound
from transient_models import load_of, structure_of

import stickslip as ss
from evidence.models.many_contacts import two_plates
from stickslip.analyses.forced_response.stability.not_periodic import without_periodic
from stickslip.analyses.forced_response.verdicts.rules import unsolved
from stickslip.errors import InputError
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.from_time import found_in_time, marched_of
from stickslip.response.forced.response import Sweep, forced_problem, forced_response
from stickslip.response.time.settling import Repetition, repetition
from stickslip.response.time.stepping.marcher import ROUGH
from stickslip.solve.status import Rung, Status

OMEGA = 2.0 * np.pi * 1067.0


def test_without_a_rescue_a_frequency_is_given_up_after_the_correctors_own_starts() -> None:
    plates = two_plates(8)
    sweep = Sweep(
        omega_range=(OMEGA, 1.1 * OMEGA),
        at=(OMEGA, 1.1 * OMEGA),
        low=9,
        high=9,
        selection="always_high",
        peak_points=0,
        rescue="off",
    )
    points = list(forced_response(plates.system, plates.load(0.3), sweep))
    assert not any(p.converged for p in points)
    spent = Counter({p.index: 0 for p in points})
    for point in points:
        spent[point.index] += point.iterations
    assert 0 < max(spent.values()) <= 3 * sweep.newton.max_iterations
    with pytest.raises(InputError, match="rescue"):
        Sweep(omega_range=(1.0, 2.0), rescue="none")  # type: ignore[arg-type]


def repeated(share: float) -> Repetition:
    plates = two_plates(8)
    system = plates.system
    return repetition(system.structure, system.interface, plates.load(share), OMEGA, system.outputs, 9)


def test_the_march_tells_what_repeats_from_what_does_not() -> None:
    faint, strong = repeated(0.03), repeated(0.3)
    assert (faint.verdict, faint.every, faint.finer) == ("periodic", 1, None)
    assert not faint.growth > 1.0
    assert strong.verdict == "not periodic"
    assert strong.growth > 1.0
    assert strong.wander > 0.05
    finer = strong.finer
    assert finer is not None
    assert (finer.alone, finer.steps) == ("not periodic", 2 * strong.steps)
    assert finer.angle <= ROUGH
    for other in (replace(finer, growth=0.5), replace(finer, angle=2.0 * ROUGH)):
        assert replace(strong, finer=other).verdict == "not known"


@pytest.mark.parametrize(("omega", "every"), [(1.5, 1), (3.5, 2)])
def test_a_stop_is_hit_in_every_period_or_in_every_second(omega: float, every: int) -> None:
    # far above the resonance an impact oscillator goes on with half the frequency; disturbances decay by the damping alone
    gap = np.array([[0.0], [0.0], [1.0]])
    contacts = ss.Interface(("stop",), (ss.UnilateralSpring(k_n=20.0),), gap)
    found = repetition(
        structure_of(np.eye(1), 0.1 * np.eye(1), np.eye(1)), contacts, load_of(1, {1: [1.0]}), omega, np.array([0]), 5
    )
    assert found.every == every
    assert found.verdict == ("periodic" if every == 1 else "not periodic")
    if every > 1:
        assert found.growth == pytest.approx(np.exp(-0.05 * 2.0 * np.pi / omega), rel=0.05)


def test_a_frequency_is_found_from_the_motion_in_time() -> None:
    plates = two_plates(8)
    omegas = (OMEGA, 1.02 * OMEGA)
    sweep = Sweep(
        omega_range=omegas, at=omegas, low=5, high=5, selection="always_high", peak_points=0, rescue="in_time"
    )
    load = plates.load(0.03)
    known = list(forced_response(plates.system, load, sweep))
    problem = forced_problem(plates.system, load, sweep)
    lost = replace(known[0], status=Status.STALLED, coefficients=0.0 * known[0].coefficients)
    (found,) = found_in_time(problem, [lost, *known[1:]])
    assert (found.stage, found.rescue, found.converged) == ("in_time", Rung.IN_TIME, True)
    balance = problem.balance(found.support)
    ends = [balance.unknowns(point.coefficients) for point in (found, known[0])]
    bound = unknowns_bound(ends[0], *(balance.linearise(x, found.omega) for x in ends))
    assert np.abs(ends[0] - ends[1]).max() <= bound
    assert accepted_points([lost, *known[1:], found])[0] is found
    assert list(found_in_time(problem, [lost], [found])) == []
    told = marched_of(found)
    assert told is not None
    assert str(told).startswith("periodic in time")
    # what does not repeat itself says so, and keeps what showed it
    strong = forced_problem(plates.system, plates.load(0.3), sweep)
    (other,) = found_in_time(strong, [lost])
    assert other.status is Status.NOT_PERIODIC
    assert "half the step" in str(marched_of(other))
    assert str(marched_of(other)).count("small difference grows") == 2
    off = replace(problem, sweep=replace(sweep, rescue="off"))
    assert list(found_in_time(off, [lost])) == []


def test_a_verdict_tells_what_the_motion_in_time_did() -> None:
    lost = SimpleNamespace(
        points=SimpleNamespace(
            status=np.array([0, Status.NOT_PERIODIC, Status.STALLED]),
            marched_sentence=np.array(["periodic in time", "in time it wanders", ""]),
        ),
        converged=np.array([True, False, False]),
        hz=np.zeros(3),
        nearer="more points",
    )
    of_points = [finding for finding in unsolved(lost) if finding.points]  # type: ignore[arg-type]
    assert [f.points for f in of_points] == [(1,), (2,)]
    assert of_points[0].why.endswith("no balance stands for it; in time it wanders)")
    assert "not_periodic_points" in of_points[0].remedy
    assert of_points[1].why == f"did not converge ({Status.STALLED.advice})"


def test_as_many_points_are_marched_as_the_study_says() -> None:
    points = [SimpleNamespace(point=SimpleNamespace(omega=w, converged=w == 3.0)) for w in range(1, 7)]
    response = SimpleNamespace(accepted=points, top=points[2])
    for most, wanted in ((1, [2]), (3, [1, 2, 4]), (9, [1, 2, 4, 5, 6])):
        question = SimpleNamespace(not_periodic_points=most)
        found = without_periodic(question, response, [])  # type: ignore[arg-type]
        assert sorted(omega for omega, _, _ in found) == wanted


@pytest.mark.parametrize(("beside", "marched"), [("stable", []), ("unstable", [1.0, 2.0, 3.0]), ("undecided", [2.0])])
def test_an_unstable_motion_is_marched_unless_a_stable_one_stands_at_its_frequency(beside: str, marched: list) -> None:
    hertz = (1.0, 3.0, 2.0)  # the last one lies on the branch that folds back
    points = [SimpleNamespace(point=SimpleNamespace(omega=w, converged=True)) for w in hertz]
    response = SimpleNamespace(accepted=points, top=points[1], unstable_peak=None)
    examined = [
        SimpleNamespace(position=i, omega=w, verdict=verdict, multiplier=1.5, motion="left", error=0.0)
        for i, (w, verdict) in enumerate(zip(hertz, (beside, beside, "unstable"), strict=True))
    ]
    question = SimpleNamespace(not_periodic_points=9)
    found = without_periodic(question, response, examined)  # type: ignore[arg-type]
    assert sorted(omega for omega, _, _ in found) == marched
