"""The response over speed along engine orders, each speed with its own stiffness and preload."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from stickslip.analyses.collected import of_answers
from stickslip.analyses.forced_response.estimate import estimate
from stickslip.analyses.run_up.problem import RunUpPoint, question_of, sweep_along
from stickslip.analyses.run_up.records import RunUp, answer
from stickslip.analyses.run_up.solve import solve
from stickslip.analyses.run_up.table import RunUpTable
from stickslip.analyses.run_up.verdicts import case_verdicts, tables
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.study.analysis import Analysis, Case, Solved, of_tables


def _dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the dataset of the run-ups of all cases, with verdicts."""
    data = of_answers(solved, answer, case_verdicts, _lost)
    return data.assign_coords(mode=np.arange(1, data.sizes.get("mode", 0) + 1))


def _lost(found: RunUp) -> int:
    """Return the number of points without a solution."""
    return sum(line.failed for line in found.lines)


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return the estimated cost."""
    refuse_whole("run_up", model)
    table: RunUpTable = case.settings.run_up
    count = len(table.engine_orders or [0])
    return (f"run-up: {count} engine orders, each as follows", *estimate(model, sweep_along(case.settings, 1)).lines)


RUN_UP = Analysis(
    name="run_up",
    table=RunUpTable,
    record=RunUpPoint,
    key=of_tables("run_up", "harmonics", "solver"),
    inputs=question_of,
    solve=solve,
    dataset=_dataset,
    check=_check,
    summary=tables,
    shared=("harmonics", "solver", "limits"),
    answers=(RunUp,),
)
