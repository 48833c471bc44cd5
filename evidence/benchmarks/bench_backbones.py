"""A backbone against a frequency response: the 33 contact coordinates of the two blades with their damper, H = 5 everywhere.

CPU seconds of one process on one thread for 30 points asked of each, by turns; the ratios are medians over the turns. The backbone goes from half
of the amplitude of first slip to gross slip, the frequency response over the range of the study. Both take more points where the motion changes
fast, so that the time per point stands in the note. Models and modes are made beforehand; the search for the onset of slip is part of the backbone.
"""

from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np

from evidence.models.two_blades import COARSER, two_blades
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.equilibrium import holding
from stickslip.response.forced.response import forced_response
from stickslip.response.nonlinear_modes.backbone import ModeSweep, nonlinear_mode
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import stuck_modes

POINTS, ORDER, REPEATS = 30, 5, 5
RATIOS = (50.0, 10.0, 4.0)  # F_CL / F_HE: from slip near resonance to slip everywhere
GOAL = 0.5


def run() -> list[dict[str, Any]]:
    """Measure; a minute."""
    blades = two_blades(COARSER)
    system, load = blades.system, blades.load(RATIOS[0])
    still = HarmonicLoad(load.static)
    modes = stuck_modes(system, 6, holding(system, load.static))
    mode = max(modes, key=lambda m: abs(np.vdot(m.shape, load.harmonics[1])) / m.omega**2)
    how = Discretisation(order=ORDER, samples=blades.sweep.samples)
    along = ModeSweep(points=POINTS, to_gross_slip=True)
    swept = replace(blades.sweep, low=ORDER, high=ORDER, selection="always_high", points=POINTS, peak_points=0)
    own, found, others = list[float](), None, {ratio: list[float]() for ratio in RATIOS}
    counts = dict[float, int]()
    for _ in range(REPEATS):
        start = process_time()
        found = nonlinear_mode(system, still, mode, int(system.outputs[0]), how, along)
        own.append(process_time() - start)
        for ratio, seconds in others.items():
            start = process_time()
            counts[ratio] = len(list(forced_response(system, blades.load(ratio), swept)))
            seconds.append(process_time() - start)
    assert found is not None
    records = []
    for ratio, seconds in others.items():
        value = float(np.median(np.array(own) / np.array(seconds)))
        count, points = counts[ratio], len(found.points)
        mine, sweep = float(np.median(own)), float(np.median(seconds))
        records.append(
            {
                "name": f"backbone/over_forced_response_{ratio:g}",
                "value": value,
                "goal": f"<= {GOAL:g}",
                "holds": bool(value <= GOAL),
                "note": f"{POINTS} points asked of each, {system.retained.size} retained dofs, H = {ORDER}, medians of {REPEATS} turns: backbone of {points} points to "
                f"{found.end} in {mine:.3g} s ({1e3 * mine / points:.3g} ms a point), frequency response at F_CL/F_HE = {ratio:g} of {count} points in "
                f"{sweep:.3g} s ({1e3 * sweep / count:.3g} ms a point); NLvib is no Python package and tmdsimpy is in no registry: no rival in the same run",
            }
        )
    return records
