"""The response over speed along engine orders, each speed with its own stiffness and preload."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.columns import of_answers
from stickslip.analyses.facts import NOTE
from stickslip.analyses.forced_response.estimate import estimate
from stickslip.analyses.run_up.problem import Along, Question, RunUpPoint, of_order, question_of, sweep_along
from stickslip.analyses.run_up.records import FOUND, FastRunUp, Line, RunUp, answer, fast_run_up, steady_run_up
from stickslip.analyses.run_up.table import RunUpTable
from stickslip.analyses.run_up.verdicts import case_verdicts, tables
from stickslip.arrays import ComplexArray
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import refuse_whole
from stickslip.errors import SingularError
from stickslip.response.forced.response import forced_response
from stickslip.response.rotating.envelope import EnvelopePoint, SweepInTime, envelope, neglected
from stickslip.study.analysis import Analysis, Case, Notes, Solved, of_tables
from stickslip.study.store.archive import flat, from_flat
from stickslip.study.store.progress import LOG, advance
from stickslip.units import HZ, RPM

MAX_FAST_HARMONIC = 7  # highest harmonic of a fast run-up, unless loads drive higher ones
NO_SOLUTION = (SingularError, FloatingPointError, np.linalg.LinAlgError)


def solve(inputs: Question, done: Sequence[RunUpPoint], notes: Notes) -> Iterator[RunUpPoint]:
    """Yield the missing points, one engine order after the other; store the record of the case."""
    if notes.get(FOUND) is not None:
        return
    every = list(done)
    for i, along in enumerate(inputs.lines):
        for point in _points_of(along, every, i / len(inputs.lines), len(inputs.lines)):
            every.append(point)
            yield point
    steady = steady_run_up(inputs, every)
    notes.put(NOTE, {name: inputs.facts[name] for name in ("sectors", "rotation")})
    notes.put(FOUND, flat(replace(steady, fast=_fast_run_ups(inputs, steady.lines, every, notes))))


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
    except NO_SOLUTION as error:  # points found before are kept
        LOG.info(f"engine order {along.order}: {error}")


def _fast_run_ups(
    question: Question, steady: Sequence[Line], points: Sequence[RunUpPoint], notes: Notes
) -> tuple[FastRunUp, ...]:
    """Return all fast run-ups; each is stored in the notes when it is finished."""
    found = list[FastRunUp]()
    jobs = [(*both, rate) for both in zip(question.lines, steady, strict=True) for rate in question.rates]
    for along, line, rate in jobs:
        name = f"fast.{along.order}.{rate!r}"
        known = notes.get(name)
        if known is None:
            known = flat(_fast_run_up(along, line, rate, _order(along, points)))
            notes.put(name, known)
        found.append(from_flat(known, FastRunUp))
        advance(0.95 + 0.05 * len(found) / len(jobs), f"engine order {along.order} at {rate:g} rpm/s")
    return tuple(found)


def _order(along: Along, points: Sequence[RunUpPoint]) -> int:
    """Return the highest harmonic of a fast run-up: of the steady points, within `MAX_FAST_HARMONIC`, or of the load."""
    own = [p.order for p in points if p.engine_order == along.order and p.converged]
    return max(min(max(own, default=1), MAX_FAST_HARMONIC), *along.problem.driven)


def _fast_run_up(along: Along, steady: Line, rate: float, order: int) -> FastRunUp:
    """Return a fast run-up; one without amplitudes if it could not begin."""
    try:
        return _swept(along, steady, rate, order)
    except NO_SOLUTION as error:  # the steady motions are kept
        LOG.info(f"engine order {along.order} at {rate:g} rpm/s: {error}")
        begin = np.array([along.sweep.ends[0] / along.order / RPM])
        return fast_run_up(steady, rate, begin, np.array([np.nan]), harmonic=order)


def _swept(along: Along, steady: Line, rate: float, order: int) -> FastRunUp:
    sweep = along.sweep
    how = SweepInTime(
        ends=sweep.ends,
        rate=along.order * RPM * rate,
        harmonics=order,
        samples=max(sweep.samples, 8 * order),
        evaluator=sweep.evaluator,
    )
    driven = list(along.problem.driven)
    outputs = along.model.system.outputs
    followed = list(_kept(envelope(along.model.system, along.model.load, how), driven, outputs))
    speed = np.array([omega for omega, _, _ in followed]) / along.order / RPM
    moving = np.array([amplitude for _, amplitude, _ in followed])
    amplitude = np.linalg.norm(moving, axis=1)
    finished = bool(followed[-1][2])
    if not finished:
        LOG.info(f"engine order {along.order} at {rate:g} rpm/s: ended at {speed[-1]:.1f} rpm")
    time = np.abs(speed - speed[0]) / rate
    share = neglected(time, moving[:, 0], driven[0] * along.order * RPM * speed)
    return fast_run_up(steady, rate, speed, amplitude, harmonic=order, finished=finished, neglected=share)


def _kept(
    points: Iterator[EnvelopePoint], driven: list[int], outputs: Any
) -> Iterator[tuple[float, ComplexArray, bool]]:
    """Yield frequency, driven harmonics (d,) of the first output, and whether a step was solved; drop all else of a step."""
    for point in points:
        yield point.omega, point.coefficients[driven][:, outputs[0]], point.converged


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
    shared=("harmonics", "solver", "limits", "operation"),
    answers=(RunUp,),
)
