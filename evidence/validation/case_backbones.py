"""Backbones of 200 random systems, from where nothing slips to gross slip or to where lift-off ends them; how each ended is said.

120 of `random_machines` and 80 of `fresh_machines`, the mode that the load of each excites most. A backbone has reached its end where every contact
that can slip has slipped or opened, where contacts that open leave no periodic motion beyond, or where none sticks any more since those that
do not slip stay open. Everything else is a failure.

    python -m evidence.validation.case_backbones 0 50      # systems 0 to 49 alone, a line each
"""

import sys
from time import process_time

import numpy as np

from evidence.models.fresh_machines import FAMILIES, draw_fresh
from evidence.models.random_machines import Drawn, draw
from evidence.validation.compare import Record, record
from stickslip.errors import StickslipError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.equilibrium import holding
from stickslip.response.nonlinear_modes.backbone import Backbone, ModeSweep, nonlinear_mode
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import stuck_modes

SOURCE = "goal of the issue on nonlinear modes"
SEED, KNOWN, FRESH = 1717, 120, 80
GOAL = 0.995
MODES = 8  # among which the excited one is looked for
ENDS = ("gross slip", "lift-off ends it", "amplitude reached, no contact sticks")


def system(number: int) -> Drawn:
    """Return one of the 200."""
    if number < KNOWN:
        return draw(SEED, number)
    family = sorted(FAMILIES)[number % len(FAMILIES)]
    return draw_fresh(family, SEED, number)


def backbone(drawn: Drawn) -> Backbone:
    """Follow the mode that the load excites most, the largest output its coordinate."""
    force = drawn.load.harmonics[min(drawn.load.harmonics)]
    holds = holding(drawn.system, drawn.load.static)
    modes = stuck_modes(drawn.system, MODES, holds)
    mode = max(modes, key=lambda m: abs(np.vdot(m.shape, force)) / m.omega**2)
    outputs = drawn.system.outputs
    dof = int(outputs[int(np.argmax(np.abs(mode.shape[outputs])))])
    still = HarmonicLoad(drawn.load.static)
    return nonlinear_mode(drawn.system, still, mode, dof, Discretisation(order=5), ModeSweep(to_gross_slip=True))


def ended(number: int) -> tuple[str, str]:
    """Return how the backbone of a system ended, as one of `ENDS` or empty, and a line about it."""
    drawn, start = system(number), process_time()
    try:
        found = backbone(drawn)
    except StickslipError as error:
        return "", f"{number} {drawn.family}: {error}"
    solved = found.solutions
    word = next((e for e in ENDS if found.end.startswith(e)), "")
    lost = sum(not p.converged for p in found.points[: len(found.points) - 1])
    line = f"{number} {drawn.family}: {found.end}; {len(solved)} points, {lost} lost on the way, {process_time() - start:.1f} s"
    return word, line


def run() -> list[Record]:
    """Follow all of them; half an hour."""
    found = [ended(i) for i in range(KNOWN + FRESH)]
    counts = {end: sum(word == end for word, _ in found) for end in ENDS}
    share = sum(counts.values()) / len(found)
    told = ", ".join(f"{n} {end}" for end, n in counts.items())
    failures = "; ".join(line for word, line in found if not word)
    what = f"share of {len(found)} random systems followed to the end: {told}{'. ' + failures if failures else ''}"
    return [record("backbones", what, max(share, GOAL) - share, 0.0, 0.0, SOURCE)]


if __name__ == "__main__":
    for at in range(int(sys.argv[1]), int(sys.argv[2])):
        print(*ended(at), sep=" | ", flush=True)
