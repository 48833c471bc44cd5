"""Stiff contacts that open: the step that is chosen, and what it says of itself, against an integrator with exact events."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from transient_models import load_of, structure_of

import stickslip as ss
from stickslip.response.quasi_periodic.in_time import course
from stickslip.response.time.start import rest
from stickslip.response.time.stepping.marcher import FINE, MOST_STEPS, Marcher, prepared, with_enough_steps
from stickslip.response.time.transient import TimeStepping, TransientResult, integrate

PRELOAD, OMEGA, ORDER = 0.3, 1.26, 5
SAMPLES = 256


def chain(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mass, damping and stiffness of masses in a row."""
    stiffness = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    mass = np.eye(n)
    return mass, 0.04 * stiffness + 0.02 * mass, stiffness


def judged(n: int, k: float, periods: int) -> np.ndarray:
    """Return the harmonics (ORDER + 1, n) of the last period: linear between the times at which the stop on the last mass opens or closes."""
    mass, damping, stiffness = chain(n)
    inverse, force = np.linalg.inv(mass), np.eye(n)[0]

    def moves(t: float, y: np.ndarray, shut: float) -> np.ndarray:
        u, v = y[:n], y[n:]
        pressed = shut * np.eye(n)[-1] * (PRELOAD - k * u[-1])
        return np.concatenate([v, inverse @ (force * np.cos(OMEGA * t) - damping @ v - stiffness @ u + pressed)])

    def meets(t: float, y: np.ndarray, shut: float) -> float:
        return PRELOAD - k * y[n - 1]

    meets.terminal = True  # type: ignore[attr-defined]
    period, y, t = 2.0 * np.pi / OMEGA, np.zeros(2 * n), 0.0
    for turn in range(periods):
        times, seen = period * (turn + np.arange(1, SAMPLES + 1) / SAMPLES), []
        while t < times[-1] - 1e-12:
            gap = meets(t, y, 0.0)
            shut = float((gap if abs(gap) > 1e-8 else -y[2 * n - 1]) > 0.0)
            meets.direction = -1.0 if shut else 1.0  # type: ignore[attr-defined]
            part = solve_ivp(
                moves,
                (t, times[-1]),
                y,
                "DOP853",
                rtol=1e-9,
                atol=1e-11,
                events=meets,
                args=(shut,),
                dense_output=turn == periods - 1,
            )
            if part.sol:
                seen.append(part.sol(times[(times > t) & (times <= part.t[-1])])[:n].T)
            t, y = part.t[-1], part.y[:, -1]
    motion = np.fft.rfft(np.roll(np.vstack(seen), 1, axis=0), axis=0)[: ORDER + 1] * 2.0 / SAMPLES
    return np.asarray(motion)


def stop(n: int, k: float, steps: int) -> tuple[tuple, TimeStepping]:
    gap = np.zeros((3, n))
    gap[2, -1] = 1.0
    law = ss.UnilateralSpring(k_n=k, preload=PRELOAD)
    where = (structure_of(*chain(n)), gap, [law], load_of(n, {1: [*np.eye(n)[0]]}), OMEGA)
    return where, TimeStepping(steps, max_periods=70, harmonics=ORDER, tolerance=1e-7)


def marched(n: int, k: float, steps: int) -> TransientResult:
    where, stepping = stop(n, k, steps)
    return integrate(*where, np.arange(n), stepping=stepping)


@pytest.mark.parametrize(("n", "k"), [(1, 100.0), (2, 100.0), (3, 200.0)])
def test_a_step_that_follows_the_impacts_has_the_motion_of_exact_events(n: int, k: float) -> None:
    exact = judged(n, k, 70)
    where, _ = stop(n, k, 32)

    def made(steps: int) -> Marcher:
        return prepared(*where, steps)

    marcher = with_enough_steps(made, rest(n, where[2]), 32)
    size = np.abs(exact[1:]).max()
    errors = {}
    for steps in (64, marcher.steps):
        found = marched(n, k, steps)
        errors[steps] = float(np.abs(found.harmonics[1:] - exact[1:]).max() / size)
        angle = np.sqrt(k) * 2.0 * np.pi / (OMEGA * steps)
        assert found.step_angle == pytest.approx(angle, rel=1e-12)
        assert found.coarse == (angle > FINE)
    assert errors[marcher.steps] < 1e-2
    assert errors[64] > 2e-2  # and was said to be coarse


def test_what_stays_shut_or_is_too_stiff_for_any_step() -> None:
    where, _ = stop(1, 100.0, 32)
    structure, gap, _, load, omega = where
    pressed = [ss.UnilateralSpring(k_n=1e6, preload=100.0)]
    held = load_of(1, {1: [1.0]}, [-100.0])
    shut = with_enough_steps(lambda s: prepared(structure, gap, pressed, held, omega, s), rest(1, pressed), 64)
    assert shut.steps == 64  # never opens, so no step is too long for it
    hard = [ss.UnilateralSpring(k_n=1e9, preload=PRELOAD)]
    most = with_enough_steps(lambda s: prepared(structure, gap, hard, load, omega, s), rest(1, hard), 64)
    assert most.steps == MOST_STEPS
    contacts = ss.Interface(("stop",), tuple(hard), gap)
    found = course(structure, contacts, load, omega, np.array([0]), rest(1, hard), steps=4096, least=4, most=4)
    assert (found.steps, found.coarse) == (MOST_STEPS, True)
