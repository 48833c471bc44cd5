"""Twenty levels of the two blades from one nonlinear mode, against a forced response for each of them.

CPU times of one process on one thread, after a first use of both. The direct solution has the harmonics of the nonlinear mode: a sweep a level,
of at least as many points as make a curve. Levels run from where the damper sticks to where it slips so much that the other mode of the two
blades takes part: there the synthesis has to refuse.
"""

from time import process_time
from typing import Any

import numpy as np

from evidence.models.two_blades import two_blades
from stickslip.analyses.modal_synthesis.analysis import DOUBTFUL, TRUSTED
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.continuation.starting_solutions import plain_sweep
from stickslip.response.nonlinear_modes.backbone import ModeSweep, nonlinear_mode
from stickslip.response.nonlinear_modes.more_points import refined
from stickslip.response.nonlinear_modes.sdof_oscillator import ModalOscillator, modal_oscillator
from stickslip.response.nonlinear_modes.single_mode_validity import (
    isolation,
    other_modes,
    peak_with_others,
    with_others,
)
from stickslip.response.nonlinear_modes.synthesis import synthesise
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import stuck_modes

COARSER = 2.0
RATIOS = np.geomspace(250.0, 20.0, 20)  # pull over excitation
ORDER, POINTS = 5, 40
AROUND = (2 * np.pi * 176.0, 2 * np.pi * 182.0)  # rad/s
SPAN = (1e-5, 1e-3)  # m
GOAL, WITHIN = 50.0, 0.02


def synthesised(own: ModalOscillator, dof: int) -> list[tuple[float, float]]:
    """Return peak and relative error that the other modes may make, of each level; all curves are made, too."""
    found = []
    others, outputs = other_modes(own), np.array([dof])
    for ratio in RATIOS:
        level = float(RATIOS[0] / ratio)
        curve = synthesise(own, level)
        (top,) = curve.peaks
        alone = isolation(others, top, dof)
        with_others(others, curve, outputs)
        found.append((peak_with_others(others, curve, top, dof)[0], alone.foreign))
    return found


def run() -> list[dict[str, Any]]:
    """Measure; some minutes."""
    model = two_blades(COARSER)
    system, load = model.system, model.load(float(RATIOS[0]))
    dof, how = int(system.outputs[0]), Discretisation(order=ORDER)
    rest, mode = HarmonicLoad(load.static), stuck_modes(system, 1)[0]
    began = process_time()
    backbone = nonlinear_mode(system, rest, mode, dof, how, ModeSweep(span=SPAN, points=30))
    backbone = refined(backbone, load, how)
    followed = process_time() - began
    own = modal_oscillator(backbone, load)
    synthesised(own, dof)  # once without the clock
    began = process_time()
    found = synthesised(modal_oscillator(backbone, load), dof)
    quick = process_time() - began
    peaks, slow = [], 0.0
    for ratio in RATIOS:
        balance = how.balance(system, model.load(float(ratio)), np.array([dof]))
        began = process_time()
        points = [p for p in plain_sweep(system, balance, AROUND, POINTS, how.newton) if p.converged]
        slow += process_time() - began
        motions = [balance.linear.recover(p.p, balance.coefficients(p.point.x)) for p in points]
        peaks.append(_top([abs(m[1, dof]) for m in motions]))
    error = np.array([s / p - 1.0 for (s, _), p in zip(found, peaks, strict=True)])
    foreign = np.array([f for _, f in found])
    kept, shown = foreign <= TRUSTED, foreign <= DOUBTFUL
    faster, whole = slow / quick, slow / (quick + followed)
    told = f"{np.count_nonzero(kept)} of {RATIOS.size} levels trusted, {np.count_nonzero(shown & ~kept)} doubtful, {np.count_nonzero(~shown)} refused"
    off = [100 * float(np.max(np.abs(error[w]), initial=0.0)) for w in (kept, shown & ~kept, ~shown)]
    return [
        {
            "name": "synthesis/two_blades_20_levels",
            "value": faster,
            "goal": f">= {GOAL:g}",
            "holds": bool(faster >= GOAL and off[0] <= 100 * WITHIN and np.any(kept)),
            "note": f"ratios {RATIOS[0]:g} to {RATIOS[-1]:g}, {system.retained.size} dofs, H = {ORDER}: {1e3 * quick / RATIOS.size:.3g} ms a level, direct sweeps "
            f"{slow / RATIOS.size:.3g} s; {told}, peaks off by up to {off[0]:.2g}, {off[1]:.2g} and {off[2]:.2g} %",
        },
        {
            "name": "synthesis/two_blades_20_levels_with_the_mode",
            "value": whole,
            "goal": ">= 1",
            "holds": bool(whole >= 1.0),
            "note": f"the same with the nonlinear mode counted: {len(backbone.points)} points in {followed:.3g} s",
        },
    ]


def _top(amplitudes: list[float]) -> float:
    """Return the largest amplitude, by the parabola through the largest three in a row."""
    a = np.array(amplitudes)
    i = int(np.clip(np.argmax(a), 1, a.size - 2))
    left, here, right = a[i - 1 : i + 2]
    bend = left - 2.0 * here + right
    return float(here - (right - left) ** 2 / (8.0 * bend)) if bend < 0.0 else float(here)
