"""The example study, two blades and a damper: harmonic balance against time integration over the whole range of ratios.

At the accepted peak of every ratio and at one frequency on either flank, the first harmonic of the report output, as a run gives
it (the alert choosing between H = 1 and H = 5), is compared with the time integration of the same reduced model. So is the balance
with many more harmonics, which tells which of the two is wrong where they differ. The mesh is that of the example with its
element sizes doubled, so that the comparison takes minutes: it is a comparison on one reduced model, not of meshes.

A row that does not hold is left as it is, with what is known of the reason.
"""

import re
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from evidence.validation.compare import Record, record
from stickslip.response.forced.response import (
    ForcedPoint,
    ForcedProblem,
    forced_problem,
    forced_response,
)
from stickslip.study.build import Case, case_of
from stickslip.study.collect import HZ, Accepted, CaseResult, collect
from stickslip.study.example import example_text
from stickslip.study.schema import read_study
from stickslip.study.verify import integrated, listed, peak_and_flanks, refined

CASE = "Two blades and a damper"
SIZES = ("airfoil_size_m", "platform_size_m", "foot_size_m")
COARSER = 2.0  # times the element sizes of the example
TOLERANCE = 0.01  # issue of the first release: first-harmonic amplitude at H = 5
PERIODS = 300  # a blade damped by 0.3 % forgets its start: 2 % of what was off is left where the average begins
ORDERS = (
    15,
    25,
    41,
)  # of the balance that tells which side is wrong, raised until its amplitude no longer changes
UNCHANGED = 3e-3  # relative


def coarse_example() -> str:
    """Return the example study with larger elements."""

    def larger(match: re.Match[str]) -> str:
        return f"{match[1]}{COARSER * float(match[2]):g}"

    return re.sub(rf"(?m)^((?:{'|'.join(SIZES)}) = )([0-9.e-]+)", larger, example_text())


def example_case() -> Case:
    """Mesh and reduce the coarse example."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(coarse_example(), encoding="utf-8")
        return case_of(read_study(path), None, lambda _: None)


def load_case(case: Case, ratio: float) -> tuple[ForcedProblem, CaseResult]:
    """Compute the response for one ratio as a run does."""
    load = case.load(ratio)
    problem = forced_problem(case.system, load, case.sweep)
    points = list(forced_response(case.system, load, case.sweep))
    excitation = case.centrifugal / ratio
    result = collect(problem, points, ratio=ratio, excitation=excitation, report_output=0)
    return problem, result


def converged(
    case: Case, problem: ForcedProblem, ratio: float, point: ForcedPoint
) -> ForcedPoint | None:
    """Raise the harmonics until the amplitude no longer changes; the last solution, or None if there is none."""
    found = None
    for order in ORDERS:
        more = refined(case, ratio, found or point, order)
        if more is None:
            break
        change = abs(problem.amplitude(more) / problem.amplitude(found or point) - 1)
        found = more
        if change < UNCHANGED:
            break
    return found


def compare(
    case: Case, problem: ForcedProblem, ratio: float, accepted: Accepted, where: str
) -> list[Record]:
    """Compare what a run accepts, and the balance with many harmonics, with the integration."""
    point, output = accepted.point, case.report_output
    many = converged(case, problem, ratio, point)
    # several periodic motions may exist beside each other: begin at the one that is compared
    found = integrated(problem, many or point, case.load(ratio), PERIODS)
    first = found.harmonics[1] if found.settled else found.average
    reference = float(np.abs(first[output]))
    motion = (
        f"periodic after {found.periods} periods"
        if found.settled
        else f"not periodic after {found.periods} periods, average of the last third, scatter {100 * found.scatter:.1g} %"
    )
    drifts = f"; drifting: {listed(found.drifting)}" if found.drifting else ""
    lost = "" if many else f"; the balance with {ORDERS[0]} harmonics finds no solution from there"
    source = f"time integration, 1024 steps a period, {motion}{drifts}{lost}"
    at = f"F_CL/F_HE = {ratio:g}, {where}, {point.omega / HZ:.2f} Hz: first harmonic"
    rows = [(f"{at}, as accepted, H = {point.order}, m", problem.amplitude(point, output))]
    if many:
        rows.append((f"{at}, H = {many.order}, m", problem.amplitude(many, output)))
    return [record(CASE, name, own, reference, TOLERANCE, source) for name, own in rows]


def run() -> list[Record]:
    """Compare at the peak and on both flanks for every ratio of the example."""
    case = example_case()
    records = []
    for ratio in case.ratios:
        problem, result = load_case(case, ratio)
        for where, accepted in peak_and_flanks(result):
            records += compare(case, problem, ratio, accepted, where)
    return records
