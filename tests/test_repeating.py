"""Whether a motion in time repeats itself: what dies slowly, what a long step makes of impacts, and what comes back after several periods."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from transient_models import load_of, structure_of

import stickslip as ss
from stickslip.response.time import settling
from stickslip.response.time.settling import Repetition, repetition

NORMAL, ALONG = np.array([[0.0], [0.0], [-1.0]]), np.array([[1.0], [0.0], [0.0]])


@pytest.mark.parametrize(("damping", "ratio"), [(0.01, 4.0), (0.003, 2.0), (0.0005, 2.0)])
def test_what_dies_slowly_is_not_told_to_last(damping: float, ratio: float) -> None:
    """The contact never slips: a linear motion, which ends in one of the load's period, in hundreds of periods; at twice the resonance it dies in every second one."""
    stuck = ss.Interface(("1",), (ss.Jenkins(k_t=0.5, limit=1e9),), ALONG)
    structure = structure_of(np.eye(1), np.array([[2.0 * damping]]), np.array([[0.5]]))
    found = repetition(structure, stuck, load_of(1, {1: [1.0]}), ratio, np.array([0]), 5)
    assert found.change[-1] > 1e-3, "it has died already: nothing was shown"
    assert (found.verdict, found.every) == ("not known", 0)


STIFF, SPRING, DASHPOT, FORCE, OMEGA = 3e4, 1.685, 0.26, -1.757, 2.131


def from_period_to_period(periods: int) -> float:
    """Return how far a mass that rests on a stop is from where it was a period before, of its size: steps end where it lands or lifts."""

    def moves(t: float, y: np.ndarray, shut: float) -> list[float]:
        return [y[1], FORCE * np.cos(OMEGA * t) - SPRING * y[0] - DASHPOT * y[1] - shut * STIFF * y[0]]

    def meets(_: float, y: np.ndarray, __: float) -> float:
        return float(y[0])

    meets.terminal = True  # type: ignore[attr-defined]
    period, y, t, ends = 2.0 * np.pi / OMEGA, np.zeros(2), 0.0, []
    for turn in range(periods):
        end = (turn + 1) * period
        while t < end - 1e-12:
            shut = float((y[0] if abs(y[0]) > 1e-10 else y[1]) > 0.0)
            meets.direction = -1.0 if shut else 1.0  # type: ignore[attr-defined]
            part = solve_ivp(moves, (t, end), y, "DOP853", rtol=1e-9, atol=1e-12, events=meets, args=(shut,))
            t, y = part.t[-1], part.y[:, -1]
        ends.append(y)
    return float(np.abs(ends[-1] - ends[-2]).max() / np.abs(ends).max())


def test_an_impact_that_a_step_is_too_long_for_is_looked_at_with_shorter_ones() -> None:
    """With 512 and 1024 steps the motion never repeats itself, and small differences grow tenfold in a period: both are of the step."""
    assert from_period_to_period(40) < 1e-6
    contacts = ss.Interface(("1",), (ss.UnilateralSpring(k_n=STIFF),), NORMAL)
    structure = structure_of(np.eye(1), np.array([[DASHPOT]]), np.array([[SPRING]]))
    found = repetition(structure, contacts, load_of(1, {1: [FORCE]}), OMEGA, np.array([0]), 9)
    assert found.verdict == "periodic"
    assert found.steps > 2048


def seen(change: float, **other: object) -> Repetition:
    changes = np.full(2 * settling.PERIODS - 1, change)
    return Repetition(
        np.zeros((2, 1)),
        changes,
        0,
        change,
        **{"growth": 0.9, "opened": 0.1, "steps": 512, "angle": 0.1, "kept": 0.9} | other,
    )  # type: ignore[arg-type]


def told(coarse: Repetition, finer: Repetition) -> str:
    return Repetition(**coarse.__dict__ | {"finer": finer}).verdict


def test_what_lasts_without_growth_is_told_where_the_structure_would_have_come_to_rest() -> None:
    assert told(seen(0.05), seen(0.05)) == "not periodic"
    for kept in (0.999, 1.0, np.nan):
        assert told(seen(0.05, kept=kept), seen(0.05, kept=kept)) == "not known"
    assert told(seen(0.05, kept=1.0, growth=2.0), seen(0.05, growth=3.0)) == "not periodic"
    assert told(seen(0.05, kept=1.0, growth=1.03), seen(0.05, kept=1.0, growth=1.03)) == "not known"
    dying = Repetition(**seen(0.05).__dict__ | {"change": 0.05 * 0.99 ** np.arange(95)})
    assert told(dying, dying) == "not known"


def test_changes_that_half_the_step_makes_smaller_are_of_the_step() -> None:
    assert told(seen(0.05), seen(0.03)) == "not periodic"
    assert told(seen(0.05), seen(0.02)) == "not known"
