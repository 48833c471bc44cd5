"""The small grounded chain with Jenkins elements: where the peaks of the free end lie, H = 5, 256 samples."""

import numpy as np

from evidence.models.lumped import force_at, small_chain
from evidence.validation.compare import Record, digits, record
from stickslip.response.forced.response import Sweep, accepted_points, forced_problem, forced_response

SOURCE = "chain README, case small"
PEAKS = ((1.0, "9.6", None), (3.0, "9.54", None), (12.0, "8.36", None), (24.0, "7.68", "0.60"))  # F, rad/s, amplitude


def curve(force: float) -> tuple[float, float, float]:
    """Return frequency and height of the peak of the free end, and the share of converged points."""
    problem, load = small_chain(), force_at(20, 19, force)
    sweep = Sweep(
        omega_range=(6.0, 12.0),
        low=5,
        high=5,
        selection="always_low",
        points=60,
        evaluator="intervals",  # on samples, as the other solver
    )
    points = accepted_points(list(forced_response(problem, load, sweep)))
    solved = [p for p in points if p.converged]
    made = forced_problem(problem, load, sweep)
    heights = [made.amplitude(p) for p in solved]
    top = int(np.argmax(heights))
    return solved[top].omega, heights[top], len(solved) / len(points)


def run() -> list[Record]:
    """Compare the peaks."""
    case = "chain of 20 masses"
    records = []
    for force, at, height in PEAKS:
        omega, amplitude, share = curve(force)
        records += [
            digits(case, f"peak frequency at F = {force:g}, rad/s", omega, at, SOURCE),
            record(case, f"share of converged points at F = {force:g}", share, 1.0, 0.0, SOURCE),
        ]
        if height is not None:
            records.append(digits(case, f"peak amplitude at F = {force:g}", amplitude, height, SOURCE))
    return records
