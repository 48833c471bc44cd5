"""The response over speed along engine orders, each speed with its own stiffness and preload."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import xarray as xr

from stickslip.analyses.forced_response.estimate import estimate
from stickslip.analyses.run_up.fast import NO_SOLUTION, fast_run_ups
from stickslip.analyses.run_up.problem import Along, Question, RunUpPoint, of_order, question_of
from stickslip.analyses.run_up.sweeps import sweep_along
from stickslip.analyses.run_up.table import RunUpTable
from stickslip.analyses.run_up.values import dataset, values_of
from stickslip.analyses.run_up.verdicts import UNKNOWN, tables, verdicts_of
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.response.forced.response import forced_response
from stickslip.study.analysis import Analysis, Case, Notes, Solved, of_tables
from stickslip.study.store.progress import LOG, advance
from stickslip.study.verdict import ATTRIBUTE, Verdict, doubt, from_json, of_all_cases, to_json
from stickslip.units import HZ, RPM

MODEL, VALUES = "model", "values"


def _solve(inputs: Question, done: Sequence[RunUpPoint], notes: Notes) -> Iterator[RunUpPoint]:
    """Yield the points that are not done, one engine order after the other; put down what the dataset needs."""
    if notes.get(VALUES) is not None:
        return
    every = list(done)
    for i, along in enumerate(inputs.lines):
        for point in _points_of(along, every, i / len(inputs.lines), len(inputs.lines)):
            every.append(point)
            yield point
    fast_run_ups(inputs, every, notes)
    told = [doubt(text) for a in inputs.lines for text in a.model.warnings]
    notes.put(MODEL, {"verdicts": to_json(dict.fromkeys(told)), "limit": inputs.limit})
    notes.put(VALUES, values_of(inputs, every, notes))


def _points_of(along: Along, every: Sequence[RunUpPoint], before: float, count: int) -> Iterator[RunUpPoint]:
    own = [p for p in every if p.engine_order == along.order]
    system, load, sweep = along.model.system, along.model.load, along.sweep
    first, last = sweep.ends
    try:
        for point in forced_response(system, load, sweep, done=own):
            yield of_order(point, along.order)
            share = min(max((point.omega - first) / (last - first), 0.0), 1.0)
            state = "" if point.converged else f", {point.status.advice}"
            rpm = point.omega / along.order / RPM
            advance(
                before + 0.95 * share / count,
                f"engine order {along.order}: {rpm:.1f} rpm, {point.omega / HZ:.2f} Hz, H = {point.order}{state}",
            )
    except NO_SOLUTION as error:  # what was found before counts
        LOG.info(f"engine order {along.order}: {error}")


def _dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the run-ups of all cases, and what is to be thought of them."""
    known = [s for s in solved if VALUES in s.notes]
    data = dataset([s.notes[VALUES] for s in known])
    found: list[Verdict] = []
    for k, one in enumerate(known):
        note, label = one.notes[MODEL], one.case.label
        found += [replace(v, case=label) for v in (*from_json(note["verdicts"]), UNKNOWN)]
        found += verdicts_of(data.isel(case=k), label, float(note["limit"]))
    failed = int(data["failed"].values[data["failed"].values > 0].sum()) if known else 0
    labels = [s.case.label for s in known]
    told = of_all_cases(found, labels)
    return data.assign_attrs({ATTRIBUTE: to_json(told), "failed": failed})


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return the estimated cost."""
    refuse_whole("run_up", model)
    table: RunUpTable = case.settings.run_up
    count = len(table.engine_orders or [0])
    return (f"run-up: {count} engine orders, each {estimate(model, sweep_along(case.settings, 1))}",)


RUN_UP = Analysis(
    name="run_up",
    table=RunUpTable,
    record=RunUpPoint,
    key=of_tables("run_up", "harmonics", "solver"),
    inputs=question_of,
    solve=_solve,
    dataset=_dataset,
    check=_check,
    summary=tables,
    shared=("harmonics", "solver", "limits"),
)
