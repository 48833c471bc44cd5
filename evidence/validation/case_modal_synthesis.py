"""Peaks of random chains with one slider from one nonlinear mode, against the tracked peaks of the same chains, and when a mode is alone.

    python -m evidence.validation.case_modal_synthesis --systems 80

Trusted peaks must be right to 2 %; how often refused ones were is told.
"""

import argparse
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from evidence.validation.compare import Record, bound, record
from stickslip.analyses.modal_synthesis.analysis import DOUBTFUL, TRUSTED
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.response.nonlinear_modes.backbone import ModeSweep, nonlinear_mode
from stickslip.response.nonlinear_modes.more_points import refined
from stickslip.response.nonlinear_modes.passage import Swept, passage_through_resonance
from stickslip.response.nonlinear_modes.sdof_oscillator import modal_oscillator
from stickslip.response.nonlinear_modes.single_mode_validity import isolation, other_modes, peak_with_others
from stickslip.response.nonlinear_modes.synthesis import resonances, synthesise
from stickslip.response.parameter import Discretisation
from stickslip.response.resonances.tracking import track_peak
from stickslip.response.self_excited.modes import StuckMode, stuck_modes
from stickslip.response.system import System

CASE = "Nonlinear modal synthesis"
SOURCE = "peaks tracked with the same harmonics"
HOW = Discretisation(order=5)
LEVELS = np.array([0.7, 1.3, 2.0, 4.0, 8.0, 16.0])  # times that at which slip begins
SAME = 0.03  # relative distance of frequencies beyond which the tracked peak is another one
SYSTEMS, SEED = 16, 1
WITHIN = 0.02
ENDS = (0.9, 1.15)  # rad/s


@dataclass(frozen=True)
class Compared:
    """One peak: what the check foretells of its relative error, the error, and whether nothing slips."""

    foreign: float
    error: float
    linear: bool


def chain(rng: np.random.Generator) -> tuple[System, HarmonicLoad, StuckMode]:
    """Return two to four masses in a row, a slider to the ground or between two of them, and the mode that is looked at."""
    n = int(rng.integers(2, 5))
    coupling = rng.uniform(0.02, 1.0)
    stiffness = np.diag(rng.uniform(0.8, 1.3, n) + 2 * coupling)
    stiffness -= coupling * (np.eye(n, k=1) + np.eye(n, k=-1))
    damping = rng.uniform(0.002, 0.01) * stiffness
    gap, at = np.zeros((3, n)), int(rng.integers(n))
    gap[0, at] = 1.0
    if n > 2 and rng.random() < 0.5:
        gap[0, (at + 1) % n] = -1.0
    contacts = Interface(("c",), (Jenkins(k_t=rng.uniform(0.05, 0.8), limit=0.1),), gap)
    force = rng.standard_normal(n) + 0j
    structure = lumped(np.eye(n), stiffness, damping)
    modes = stuck_modes(System(structure, contacts, np.arange(n)), n)
    mode = modes[int(rng.integers(n))]
    outputs = np.array([int(np.argmax(np.abs(mode.shape)))])
    return System(structure, contacts, outputs), HarmonicLoad(np.zeros(n), {1: force}), mode


def compared(rng: np.random.Generator) -> list[Compared]:
    """Return the peaks of a chain at all levels at which both were found."""
    system, load, mode = chain(rng)
    dof = int(system.outputs[0])
    try:
        followed = nonlinear_mode(system, HarmonicLoad(load.static), mode, dof, HOW, ModeSweep(points=40))
        own = modal_oscillator(refined(followed, load, HOW), load)
        levels = 2.0 * LEVELS * float(own.needed(np.array([own.begins]))[0])
        tops = [next((r for r in resonances(own, level) if r.top), None) for level in levels]
        low = 0.93 * min(r.omega for r in tops if r is not None)
        direct = list(track_peak(system, load, "excitation", levels, (low, 1.05 * mode.omega), discretisation=HOW))
    except InputError:  # nothing slips in this mode, or the range of the sweep holds no peak
        return []
    others, found = other_modes(own), []
    for top, solved in zip(tops, direct, strict=True):
        if top is None or not (solved.converged and solved.is_maximum):
            continue
        if abs(top.omega / solved.omega - 1.0) > SAME:
            continue
        peak, _ = peak_with_others(others, synthesise(own, top.level), top, dof)
        alone = isolation(others, top, dof)
        found.append(Compared(alone.foreign, float(peak / solved.amplitude - 1.0), alone.linear))
    return found


def many(systems: int, seed: int) -> list[Compared]:
    """Return the peaks of so many chains."""
    rng = np.random.default_rng(seed)
    return [one for _ in range(systems) for one in compared(rng)]


def swept() -> list[Record]:
    """Compare passages of two coupled masses through their first resonance with small steps in time, which know no harmonics and no modes."""
    gap = np.zeros((3, 2))
    gap[0, 0] = 1.0
    contacts = Interface(("c",), (Jenkins(k_t=0.2, limit=0.1),), gap)
    structure = lumped(np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]]), 0.01 * np.eye(2))
    system = System(structure, contacts, np.array([1]))
    load = HarmonicLoad(np.zeros(2), {1: np.array([0.0, 0.02 + 0j])})
    followed = nonlinear_mode(
        system, HarmonicLoad(load.static), stuck_modes(system, 1)[0], 1, HOW, ModeSweep(points=30)
    )
    own = modal_oscillator(refined(followed, load, HOW), load)
    turn = np.exp(1j * np.outer(np.arange(HOW.order + 1), np.linspace(0.0, 2 * np.pi, 65)))
    found = []
    for level in (1.0, 3.0, 8.0):
        for seconds in (500.0, 2000.0):
            passed = passage_through_resonance(own, level, Swept(ends=ENDS, rate=(ENDS[1] - ENDS[0]) / seconds))
            motion = own.displacement(passed.place)[:, :, 1] @ turn
            in_time = _in_small_steps(0.02 * level, seconds)
            found.append(
                record(
                    CASE,
                    f"largest displacement, m, level {level:g} in {seconds:g} s",
                    np.abs(motion.real).max(),
                    in_time,
                    WITHIN,
                    "small steps in time",
                )
            )
    return found


def _in_small_steps(force: float, seconds: float) -> float:
    """Return the largest displacement of the second mass under a chirp."""
    steps = int(seconds * max(ENDS) / (2 * np.pi) * 400)
    dt = seconds / steps
    time = np.arange(steps) * dt
    pushes = force * np.cos(ENDS[0] * time + (ENDS[1] - ENDS[0]) / seconds * time**2 / 2)
    first = second = first_speed = second_speed = friction = largest = 0.0
    for push in pushes.tolist():
        pull = first - 2.0 * second - 0.01 * second_speed + push
        first_speed += dt * (second - 2.0 * first - 0.01 * first_speed - friction)
        second_speed += dt * pull
        first += dt * first_speed
        second += dt * second_speed
        friction = min(max(friction + 0.2 * dt * first_speed, -0.1), 0.1)
        largest = max(largest, abs(second))
    return largest


def run() -> list[Record]:
    """Compare some chains."""
    found = many(SYSTEMS, SEED)
    trusted = [abs(c.error) for c in found if c.foreign <= TRUSTED]
    refused = [abs(c.error) for c in found if c.foreign > DOUBTFUL]
    return [
        bound(CASE, f"largest error of {len(trusted)} trusted peaks", max(trusted), WITHIN, SOURCE),
        bound(CASE, "the same where nothing slips", max(abs(c.error) for c in found if c.linear), 1e-3, SOURCE),
        record(
            CASE,
            "refused peaks that are off by more than 2 %",
            sum(e > WITHIN for e in refused),
            len(refused),
            0.4,
            SOURCE,
        ),
        *swept(),
    ]


def main() -> None:
    """Print a table of what the check foretells and what the error was."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--systems", type=int, default=80)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    found = many(options.systems, options.seed)
    edges = (0.0, 0.005, 0.01, TRUSTED, DOUBTFUL, 0.1, np.inf)
    print(f"{len(found)} peaks, {sum(c.linear for c in found)} of them where nothing slips")
    for low, high in pairwise(edges):
        own = [abs(c.error) for c in found if low <= c.foreign < high and not c.linear]
        if own:
            print(
                f"foretold {low:g} to {high:g}: {len(own)} peaks, {sum(e > WITHIN for e in own)} off by more than 2 %, median {np.median(own):.1e}, largest {max(own):.1e}"
            )


if __name__ == "__main__":
    main()
