"""The follower with harmonics that change along the branch: closed forms, folds, audits, and runs that are taken up again."""

from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
import pytest
from models import lifting, table

from evidence.models.lumped import blades_and_damper, griffin
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.response.continuation.adaptive_continuation import AUDITED, follow
from stickslip.response.continuation.branch import OneLevel, Route, branch_of, steps_through
from stickslip.response.forced.along import ForcedCurve
from stickslip.response.forced.response import Sweep, accepted_points, forced_problem, forced_response
from stickslip.response.system import System
from stickslip.solve.branch import Following
from stickslip.solve.newton_method import Newton, newton

HZ = 2 * np.pi
FORCE, CUBIC, DASHPOT = 0.1, 0.1, 0.04


def oscillator(law, row, *, damping=DASHPOT, force=FORCE):
    """One mass on its spring and on a contact: m = k = 1."""
    one = np.ones((1, 1))
    gap = np.zeros((3, 1))
    gap[row] = 1.0
    structure = Structure(one, damping * one, one.copy(), table(("x",)))
    system = System(structure, Interface(("c",), (law,), gap), np.array([0]))
    return system, HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})


def pressed(ratio):
    """A linear oscillator: its contact of stiffness 0.21 never opens; it resonates at 1.1 rad/s."""
    law = ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=0.21, mu=0.0, preload=1e6)
    return oscillator(law, 2, damping=2.0 * ratio, force=1.0)


def cubic():
    """Duffing's oscillator, which folds: ``x'' + 0.04 x' + x + 0.1 x³ = 0.1 cos ωt``."""
    return oscillator(CubicSpring(cubic_t=CUBIC), 0)


def followed(case, sweep):
    return forced_problem(*case, sweep), list(forced_response(*case, sweep))


def branch(points):
    return [p for p in accepted_points(points) if p.stage != "peak"]


# ---- closed forms -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("points", [5, 10, 40])
@pytest.mark.parametrize("ratio", [1e-2, 1e-3, 1e-4])
def test_a_linear_resonance_however_sharp_is_passed_in_one_stretch(ratio, points, direction):
    sweep = Sweep(omega_range=(0.9, 1.3), points=points, peak_points=0, direction=direction)
    problem, solved = followed(pressed(ratio), sweep)
    assert {p.stage for p in solved} == {"point"}, "nothing acts on harmonics left out"
    assert all(p.converged and p.order == 1 and p.predicted_error == 0.0 for p in solved)
    omega = np.array([p.omega for p in solved])
    assert (omega[0], omega[-1]) == sweep.ends
    assert np.all(sweep.forward * np.diff(omega) > 0.0)
    heights = np.array([problem.amplitude(p) for p in solved])
    exact = 1.0 / np.abs(1.21 - omega**2 + 2j * ratio * omega)
    assert heights == pytest.approx(exact, rel=1e-8)
    # steps of a quarter of the vibration cannot pass the peak unseen
    assert heights.max() > 0.95 / (2.0 * ratio * 1.1)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_fold_is_passed_and_all_its_points_are_kept_in_the_order_of_the_branch(direction):
    # one harmonic alone has a closed form
    sweep = Sweep(omega_range=(0.8, 1.8), cap=1, points=40, peak_points=0, samples=64, direction=direction)
    problem, solved = followed(cubic(), sweep)
    points = branch(solved)
    assert all(p.converged and p.order == 1 for p in points)
    assert [p.index for p in points] == list(range(len(points)))
    omega = np.array([p.omega for p in points])
    assert (omega[0], omega[-1]) == sweep.ends
    for p in points:
        a = problem.amplitude(p)
        elastic = (1.0 - p.omega**2) * a + 0.75 * CUBIC * a**3
        assert np.hypot(elastic, DASHPOT * p.omega * a) == pytest.approx(FORCE, rel=1e-6)
    # to one fold, back to the other, and on: the tangents say the same as the frequencies
    turns = np.flatnonzero(np.diff(np.sign(np.diff(omega)))) + 1
    assert turns.size == 2
    assert sweep.forward * (omega[turns[0]] - omega[turns[1]]) > 0.0
    onward = np.sign([p.tangent[-1] for p in points])
    assert np.all(onward[: turns[0]] == sweep.forward)
    assert np.all(onward[turns[0] + 1 : turns[1]] == -sweep.forward)
    assert np.all(onward[turns[1] + 1 :] == sweep.forward)


def test_a_folded_branch_with_as_many_harmonics_as_it_needs_is_the_same_from_both_sides():
    sweep = Sweep(omega_range=(0.8, 1.8), points=60, peak_points=6)
    tops = []
    for direction in ("up", "down"):
        problem, points = followed(cubic(), replace(sweep, direction=direction))
        assert all(p.converged for p in accepted_points(points))
        omega = np.array([p.omega for p in branch(points)])
        assert np.flatnonzero(np.diff(np.sign(np.diff(omega)))).size == 2
        tops.append(max(map(problem.amplitude, accepted_points(points))))
    assert tops[0] == pytest.approx(tops[1], rel=1e-3)


# ---- harmonics ----------------------------------------------------------------------------------------------------------

WIDE = Sweep(omega_range=(0.8, 1.8), samples=256, points=30, peak_points=4)


def test_harmonics_are_raised_where_a_contact_lifts_off_and_lowered_after():
    _, points = followed(lifting(), WIDE)
    kept = branch(points)
    orders = [p.order for p in kept]
    assert orders[0] == orders[-1] == 1
    assert max(orders) > 1
    assert orders[int(np.argmax([abs(p.coefficients[1, 0]) for p in kept]))] > 1
    assert {p.order for p in points} <= {1, 5, 9, 15, 25, 41}
    assert {"point", "audit", "trial"} <= {p.stage for p in points}
    # quiet wherever there was something more to take
    assert all(p.predicted_error <= WIDE.threshold for p in kept if p.order < WIDE.cap)


def test_few_harmonics_are_audited_at_the_ends_of_their_runs_and_one_point_in_ten():
    _, points = followed(griffin(0.1), Sweep(omega_range=(0.8, 1.4), points=40, peak_points=0))
    kept = branch(points)
    compared = {(p.index, p.order) for p in points if p.stage == "audit" and p.converged}
    bare = [p.index for p in kept if p.predicted_error > 0.0]
    assert len(bare) > 2 * AUDITED, "nothing acts on the harmonics left out: nothing was shown"
    sure = {i for i, order in compared if order > kept[i].order} | {
        p.index for p in points if p.stage == "trial" and p.order < kept[p.index].order
    }
    sure |= {p.index for p in kept if p.predicted_error == 0.0}
    for first in range(len(kept) - AUDITED):
        assert sure & set(range(first, first + AUDITED)), f"none from point {first} on"
    assert kept[-1].index in sure


@pytest.mark.parametrize("place", [9, 14])
def test_an_audit_that_fails_throws_the_branch_back(monkeypatch, place):
    """The first audit with five harmonics at or after a place is said to differ."""
    lied = []
    agree = ForcedCurve.agree

    def disagree_once(self, fewer, more):
        if not lied and more.kind == "audit" and more.level == 1 and more.index >= place:
            lied.append(more.index)
            return False
        return agree(self, fewer, more)

    monkeypatch.setattr(ForcedCurve, "agree", disagree_once)
    _, points = followed(griffin(0.1), Sweep(omega_range=(0.8, 1.4), points=40, peak_points=0))
    assert lied, "no audit was made: nothing was shown"
    failed = next(k for k, p in enumerate(points) if p.stage == "audit" and p.index == lied[0] and p.order == 5)
    again = next(p for p in points[failed + 1 :] if p.stage == "point")
    assert again.index <= lied[0], "the branch goes on from before"
    assert again.order == 5
    kept = branch(points)
    assert [p.index for p in kept] == list(range(len(kept)))
    assert all(p.converged for p in kept)
    # all from there to the failed audit is solved anew, with more
    assert all(p.order >= 5 for p in kept[again.index : lied[0] + 1])
    last = {p.index: p for p in points if p.stage == "point"}
    assert all(p is last[p.index] for p in kept)


CASES = {
    "lifts off": (lifting, WIDE),
    "slips": (lambda: griffin(0.1), Sweep(omega_range=(0.8, 1.4), points=30, peak_points=4)),
    "third resonates": (lambda: griffin(0.03), Sweep(omega_range=(0.25, 0.5), points=30, peak_points=4)),
    "two blades": (blades_and_damper, Sweep(omega_range=(150 * HZ, 170 * HZ), points=20, peak_points=4)),
}


def exact_errors(case, sweep, points, order=25):
    """Errors against `order` harmonics at each point's own frequency, from its own motion."""
    problem = forced_problem(*case, sweep)
    most = problem.balance(tuple(range(order + 1)))
    found = []
    for p in points:
        at = newton(
            lambda x, omega=p.omega: most.linearise(x, omega), most.unknowns(p.coefficients), Newton(max_iterations=60)
        )
        assert at.status.converged
        reference = replace(p, coefficients=most.coefficients(at.x))
        found.append(problem.real_error(p, reference))
    return np.array(found)


@pytest.mark.validation
@pytest.mark.parametrize("name", CASES)
def test_what_is_accepted_differs_from_25_harmonics_by_less_than_the_threshold(name):
    make, sweep = CASES[name]
    case = make()
    points = accepted_points(list(forced_response(*case, sweep)))
    assert all(p.converged for p in points)
    assert any(p.predicted_error > 0.0 for p in points), "linear: nothing was shown"
    assert exact_errors(case, sweep, points).max() < sweep.threshold


def test_what_is_not_quiet_at_the_cap_keeps_its_bound_above_the_threshold():
    # a superharmonic resonance: what lies above the fifth harmonic matters to a hundredth of a per cent
    case = griffin(0.03)
    sweep = Sweep(omega_range=(0.33, 0.42), cap=5, threshold=1e-4, points=20, peak_points=0)
    points = accepted_points(list(forced_response(*case, sweep)))
    assert all(p.converged and p.order <= sweep.cap for p in points)
    bounds = np.array([p.predicted_error for p in points])
    loud = bounds > sweep.threshold
    assert np.any(loud)
    assert all(p.order == sweep.cap for p, over in zip(points, loud, strict=True) if over)
    errors = exact_errors(case, sweep, points)
    assert np.all(errors[~loud] <= sweep.threshold)
    assert np.any(errors[loud] > sweep.threshold)


# ---- runs that are taken up again ---------------------------------------------------------------------------------------

SAME = ("stage", "index", "omega", "status", "iterations", "step", "orientation", "rescue")
ARRAYS = ("coefficients", "tangent", "harmonics", "asked", "start")
WAYS = {
    "arc length": {},
    "down": {"direction": "down"},
    "spaced": {"frequencies": 8},
    "listed, down": {
        "at": (1.0, 1.1, 1.15, 1.2, 1.22, 1.4, 1.6),
        "direction": "down",
        "points": 12,
        "omega_range": (1.0, 1.6),
    },
    "cap": {"cap": 5, "threshold": 1e-3},
}


@pytest.mark.parametrize("way", WAYS)
def test_an_interrupted_run_goes_on_to_the_same_points_bit_for_bit(way):
    system, load = lifting()
    few = {"samples": 64, "points": 6, "omega_range": (1.2, 1.5)}
    sweep = replace(WIDE, **(few | WAYS[way]))
    points = list(forced_response(system, load, sweep))
    assert {"point", "audit", "peak"} <= {p.stage for p in points}
    for known in range(len(points) + 1):
        # the second and third point come of the first: to its end goes the run that stopped in the middle
        last = None if known == len(points) // 2 else known + 3
        again = forced_response(system, load, sweep, done=points[:known])
        rest, expected = list(again if last is None else islice(again, 3)), points[known:last]
        assert len(rest) == len(expected), f"after {known} points"
        for new, old in zip(rest, expected, strict=True):
            assert [getattr(new, n) for n in SAME] == [getattr(old, n) for n in SAME]
            for name in ARRAYS:
                assert np.array_equal(getattr(new, name), getattr(old, name)), (known, name)
            assert np.array_equal(new.predicted_error, old.predicted_error, equal_nan=True)


# ---- one level ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Parted:
    """``x² = (p - 1) (p - 2)``: two branches, and nothing between p = 1 and p = 2."""

    residual: np.ndarray
    jac: np.ndarray
    jac_p: np.ndarray
    seconds_contact: float = 0.0


class Parabolas:
    """See `Parted`; the second unknown is 1 and gives the first a size to be measured by."""

    def linearise(self, x, p):
        return Parted(
            np.array([x[0] ** 2 - (p - 1.0) * (p - 2.0), x[1] - 1.0]),
            np.array([[2.0 * x[0], 0.0], [0.0, 1.0]], order="F"),
            np.array([3.0 - 2.0 * p, 0.0]),
        )


@pytest.mark.parametrize("leaves", [True, False])
def test_a_branch_that_leads_back_is_left_and_taken_up_where_the_next_one_is(leaves):
    exact = Newton(tolerance=1e-12)

    def begin(p, near, most):
        return newton(lambda x: Parabolas().linearise(x, p), [*near, np.ones(2)][0], exact)

    way = Following(newton=exact, control=steps_through(3.0, 30), weights=np.ones(2))
    curve = OneLevel(Parabolas(), way, begin)
    found = branch_of(follow(curve, Route(first=0.0, last=3.0, points=30, leaves=leaves)))
    lost = [f.p for f in found if not f.converged]
    kept = [f for f in found if f.converged]
    assert [f.index for f in found] == list(range(len(found)))
    assert found[-1].p == 3.0
    assert found[-1].converged
    assert max(abs(f.point.x[0] ** 2 - (f.p - 1.0) * (f.p - 2.0)) for f in kept) < 1e-10
    assert not any(1.0 < f.p < 2.0 for f in kept)
    if leaves:  # back beyond its start by a tenth of the range, then on by a step of the range each time
        assert -0.6 < min(f.p for f in kept) < -0.3
        assert all(1.0 < p < 2.0 for p in lost)
        assert len(lost) >= 9
    else:  # the second sheet leads away for good, and only the end is looked for
        assert lost == []
        assert min(f.p for f in kept) < -10.0
