"""The example study of two blades and a damper, as the benchmarks solve it."""

from functools import lru_cache
from pathlib import Path

import numpy as np

from stickslip.response.forced.response import (
    ForcedPoint,
    ForcedProblem,
    Sweep,
    forced_problem,
    forced_response,
)
from stickslip.study.build import Case, case_of
from stickslip.study.schema import read_study

STUDY = Path(__file__).parents[2] / "examples" / "two_blades" / "study.toml"


@lru_cache(maxsize=1)
def two_blades() -> Case:
    """Mesh, reduce and join the study's blades and damper; once a process."""
    return case_of(read_study(STUDY), None, lambda _: None)


def peak_frequency(ratio: float) -> float:
    """Return where the first output peaks (Hz), from a forced response with the study's own sweep."""
    case = two_blades()
    load = case.load(ratio)
    points = list(forced_response(case.system, load, case.sweep))
    problem = forced_problem(case.system, load, case.sweep)
    best = max((p for p in points if p.converged), key=problem.amplitude)
    return float(best.omega / (2 * np.pi))


def twenty_steps(
    ratio: float, hertz: tuple[float, float], selection: str
) -> tuple[ForcedProblem, list[ForcedPoint]]:
    """Return the forced response at twenty equally spaced frequencies, without refinement of the peak."""
    case = two_blades()
    load = case.load(ratio)
    sweep = Sweep(
        omega_range=(2 * np.pi * hertz[0], 2 * np.pi * hertz[1]),
        low=1,
        high=5,
        samples=case.sweep.samples,
        threshold=case.sweep.threshold,
        selection=selection,  # type: ignore[arg-type]  # one of the three words, as text
        frequencies=20,
        peak_points=0,
    )
    return forced_problem(case.system, load, sweep), list(forced_response(case.system, load, sweep))
