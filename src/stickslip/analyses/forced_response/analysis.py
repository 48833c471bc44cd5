"""The steady vibration under harmonic loads: branches, peaks, and the accuracy of the harmonics."""

import json
from collections.abc import Iterator, Sequence
from time import perf_counter

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.advice import advice, of_pressures
from stickslip.analyses.forced_response.more_harmonics import check_harmonics, of_doubt, of_jacobians
from stickslip.analyses.forced_response.physics.known import known
from stickslip.analyses.forced_response.physics.limits import PHYSICS, motion_at_peak, of_physics
from stickslip.analyses.forced_response.physics.model_change import model_changes, peak_shift, stiffness_changes
from stickslip.analyses.forced_response.problem import (
    HARMONICS,
    IN_TIME,
    STABLE,
    STRESS,
    Question,
    asked_beside,
    question_of,
    strength_of,
    with_comparisons,
)
from stickslip.analyses.forced_response.records.blades import of_blades
from stickslip.analyses.forced_response.records.columns import KINDS, KnownVerdicts, OperatingRange, stored
from stickslip.analyses.forced_response.records.dataset import put_together, with_measured
from stickslip.analyses.forced_response.records.values import (
    Values,
    of_checks,
    of_examined,
    of_model,
    of_response,
    of_shots,
)
from stickslip.analyses.forced_response.stability.bifurcating import (
    followed,
    located,
    of_bifurcations,
)
from stickslip.analyses.forced_response.stability.elsewhere import motions_elsewhere
from stickslip.analyses.forced_response.stability.examining import integrated, neighbours_of, with_stability
from stickslip.analyses.forced_response.stability.in_time import FLOPS, Check, chosen
from stickslip.analyses.forced_response.stability.not_periodic import (
    in_time_instead,
    of_answers,
    without_periodic,
)
from stickslip.analyses.forced_response.stability.stable import Examined, with_motion, without_raised
from stickslip.analyses.forced_response.stability.stable_words import peak_word, point_of, stability_log
from stickslip.analyses.forced_response.stress import of_stress, with_margin
from stickslip.analyses.forced_response.summary import tables
from stickslip.analyses.forced_response.table import ForcedResponse
from stickslip.analyses.forced_response.verdicts.cases import verdicts
from stickslip.analyses.forced_response.verdicts.working_range import with_regimes
from stickslip.analyses.operation import asked_of, of_frequencies
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import unreduced_line
from stickslip.errors import SingularError
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import named
from stickslip.harmonic.selection.strategy import always_kept, judged
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.by_shooting import shooting_response
from stickslip.response.forced.choices import Stage
from stickslip.response.forced.collected import Response, lost_point
from stickslip.response.forced.from_time import marched_of
from stickslip.response.forced.response import ForcedPoint, Sweep, forced_response
from stickslip.study.analysis import Analysis, Case, Notes, Solved, of_tables
from stickslip.study.models.measured import MeasuredPeaks
from stickslip.study.store.progress import LOG, advance, stage, sum_up
from stickslip.study.verdict import Verdict, to_json
from stickslip.units import HZ, millimetres

NO_SOLUTION = (SingularError, FloatingPointError, np.linalg.LinAlgError)
COMPILED = 5.0  # seconds of the first evaluation, below which the code was already compiled
BLADES = "blades"  # note of a mistuned wheel
BIFURCATIONS = "bifurcations"
JACOBIANS = "jacobians"
NOT_PERIODIC = "not_periodic"
NOTES = (
    "model",
    "response",
    BLADES,
    STABLE,
    BIFURCATIONS,
    IN_TIME,
    NOT_PERIODIC,
    HARMONICS,
    JACOBIANS,
    PHYSICS,
)  # notes that make up the dataset


def _inputs(case: Case, model: Model) -> Question:
    """Return the question of a case; refuse cases that cannot be computed."""
    for line in of_pressures(case, model):
        LOG.info(line)
    of_frequencies(asked_of(case), model.engine_order)  # refused before any computation
    return with_comparisons(question_of(case, model), case, model)


def _solve(inputs: Question, done: Sequence[ForcedPoint], notes: Notes) -> Iterator[ForcedPoint]:
    """Yield the missing points, then store data for the dataset and the requested checks."""
    points = list(done)
    if points:
        advance(*progress(points[-1], inputs.sweep))
    failure: Exception | None = None
    try:
        for point in _points(inputs, done, notes):
            points.append(point)
            yield point
    except NO_SOLUTION as error:
        failure = error  # points found before are kept
        if not points:
            points.append(lost_point(inputs.problem, error))
            yield points[-1]
    response, examined = yield from with_stability(inputs, points, notes)
    _store_notes(inputs, response, examined, notes)
    if inputs.model.blades is not None and notes.get(BLADES) is None:
        stage("the blades of the wheel")
        notes.put(BLADES, of_blades(inputs, response))
    if failure is not None and response.top is None:
        raise failure
    told = _judge(inputs, response, examined, notes)
    if inputs.bifurcations != "off" and notes.get(BIFURCATIONS) is None:
        stage("bifurcations and side branches")
        notes.put(BIFURCATIONS, _bifurcations(inputs, response, told, notes))
    _check_harmonics(inputs, response, notes)
    _of_peak(inputs, response, notes)
    if failure is not None:
        raise failure


def _of_peak(question: Question, response: Response, notes: Notes) -> None:
    """Store what the peak owes to the model, and its stress, once."""
    if notes.get(PHYSICS) is None:
        stage("what the peak owes to the model: more modes, softer contacts")
        notes.put(PHYSICS, _of_physics(question, response))
    if question.stress is not None and notes.get(STRESS) is None:
        stage("stress at the peak")
        notes.put(STRESS, of_stress(question, response))


def _dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the responses of all cases."""
    cases = [_with_stress(s, _values(s) | _operating(s)) for s in solved]
    labels = [s.case.label for s in solved]
    return put_together(cases, labels)


def _with_stress(solved: Solved, values: Values) -> Values:
    """Return the values with stress and margin, if the case asks for them; a changed card takes the stored stress."""
    table, note = strength_of(solved.case), solved.notes.get(STRESS)
    if not table.asked or note is None:
        return values
    slips = bool(np.any(np.asarray(values.get("peak_state", 0)) > 0))
    return values | with_margin(table, note, float(values["peak_amplitude"]), slips=slips)


def _operating(solved: Solved) -> Values:
    """Return the operating range of a case; nothing if the study has none."""
    asked = asked_of(solved.case)
    lowest_rpm, highest_rpm = asked.operating_rpm or (np.nan, np.nan)
    order = json.loads(str(solved.notes.get("model", {}).get("attributes", "{}"))).get("engine_order")
    low, high = of_frequencies(asked, order)
    if not np.isfinite(low):
        return {}
    return stored(
        OperatingRange(
            operating_lowest_hz=low,
            operating_highest_hz=high,
            operating_lowest_rpm=lowest_rpm,
            operating_highest_rpm=highest_rpm,
        )
    )


def _verdicts(data: xr.Dataset) -> tuple[Verdict, ...]:
    """Return the verdicts on each case and its points."""
    return verdicts(data, [str(x) for x in data["case_label"].values])


def _completed(data: xr.Dataset, measured: MeasuredPeaks | None) -> xr.Dataset:
    """Return the dataset with measured peaks, and with the effect of friction at the peak of each case."""
    return with_regimes(with_measured(data, measured))


def _points(question: Question, done: Sequence[ForcedPoint], notes: Notes) -> Iterator[ForcedPoint]:
    """Yield the missing points."""
    if notes.get("finished") is not None:
        return
    stage("compiling the contact laws")
    _compile(question)
    model = question.model
    stage("natural frequencies")
    lines = (*unreduced_line(model), *model.frequencies.lines()) if question.first else ()
    for line in lines:
        LOG.info(line)
    stage("static equilibrium and the first motion")
    for point in _solved(question, done):
        yield point
        advance(*progress(point, question.sweep))


def _solved(question: Question, done: Sequence[ForcedPoint]) -> Iterator[ForcedPoint]:
    """Return the missing points, by balance or by shooting."""
    model, stepping = question.model, question.stepping
    if stepping is None:
        return forced_response(model.system, model.load, question.sweep, done=done)
    return shooting_response(model.system, model.load, question.sweep, stepping, done)


def _of_physics(question: Question, response: Response) -> Values:
    """Return the properties of the modes of a case and, for harmonic balance, the sensitivity of its peak."""
    told = of_physics(question, response) | motion_at_peak(question, response)
    if question.stepping is not None:
        return told
    return (
        told
        | model_changes(question, response)
        | stiffness_changes(question, response)
        | motions_elsewhere(question, response)
    )


def _store_notes(question: Question, response: Response, examined: Sequence[Examined], notes: Notes) -> None:
    """Store all data for the dataset, once."""
    if notes.get("response") is not None:
        return
    stage("what more harmonics change at the peak")
    shift = peak_shift(question, response)
    notes.put("model", of_model(question, response.output))
    told = stored(KnownVerdicts(known_verdicts=to_json(known(question, response, shift))))
    notes.put("response", of_response(question, response, shift) | of_shots(response) | told)
    size = f"peak {millimetres(response.peak_amplitude)} at {response.peak_hz:.3f} Hz"
    peak = f"{size}, {peak_word(response, examined)}, {len(response.accepted)} points"
    if response.top is None:
        peak = f"no peak, {len(response.accepted)} points"
    lost = f"{response.failed} not converged"
    line = question.said(f"{peak}, {lost}, {response.newton_steps} Newton steps")
    sum_up(f"{peak}, {lost}" if response.failed else peak, line)


def _judge(question: Question, response: Response, examined: list[Examined], notes: Notes) -> list[Examined]:
    """Run the requested time integrations, and return the stability with their outcome."""
    chosen_points = chosen(question, response) if IN_TIME in question.checks else []
    checks = {a.point.omega: integrated(question, response, a, examined, notes)[0] for a in chosen_points}
    told = [with_motion(one, checks.get(one.omega)) for one in examined]
    for accepted in response.accepted:
        known = notes.get(f"{IN_TIME}.{accepted.point.omega!r}")
        if known:
            checks.setdefault(accepted.point.omega, Check(**without_raised(known)))
    if checks:
        notes.put(IN_TIME, of_checks([checks[omega] for omega in sorted(checks)]))
    attained = [omega for omega, check in checks.items() if check.motion == "attained"]
    told = neighbours_of(question, response, told, attained)
    for line in stability_log([p for p in map(point_of, told) if p.basis == "examined"]):
        LOG.info(f"stability: {question.said(line)}")
    notes.put(STABLE, of_examined(told, len(response.accepted)))
    if question.not_periodic_s > 0.0:
        _answer_in_time(question, response, told, notes)
    return told


def _answer_in_time(question: Question, response: Response, examined: Sequence[Examined], notes: Notes) -> None:
    """Integrate in time at points without a valid periodic motion, once."""
    if notes.get(NOT_PERIODIC) is not None:
        return
    stage("points without a periodic motion, in time")
    answers = [
        in_time_instead(question, response, omega, why, question.not_periodic_s * FLOPS, multiplier)
        for omega, why, multiplier in without_periodic(question, response, examined)
    ]
    for one in answers:
        LOG.info(f"not periodic: {question.said(one.sentence)}")
    if answers:
        notes.put(NOT_PERIODIC, of_answers(answers))


def _bifurcations(question: Question, response: Response, examined: Sequence[Examined], notes: Notes) -> Values:
    """Locate the bifurcations of the response, and follow side branches."""
    found = located(question, response, notes)
    for line in found.sentences:
        LOG.info(f"bifurcations: {question.said(line)}")
    sides = followed(question, found)
    for begin, side in sides:
        LOG.info(f"from {begin.omega / HZ:.6g} Hz: {question.said(side.sentence)}")
    return of_bifurcations(question, response, found, sides, examined)


def _check_harmonics(question: Question, response: Response, notes: Notes) -> None:
    """Predict the change by more harmonics, and compare Jacobians, if requested."""
    if HARMONICS in question.checks:
        stage("what more harmonics change at every point")
        doubt = check_harmonics(question, response)
        LOG.info(f"more harmonics: {question.said(doubt.sentence)}")
        notes.put(HARMONICS, of_doubt(doubt))
    if question.similarity and notes.get(JACOBIANS) is None:
        stage("Jacobians with few and many harmonics")
        notes.put(JACOBIANS, of_jacobians(question, response))


def _compile(question: Question) -> None:
    """Evaluate contacts and strategy once, so that compilation does not count as work of the first case; skipped for large problems."""
    problem, system, omega = question.problem, question.model.system, question.sweep.ends[0]
    if isinstance(problem.low, HarmonicBalance) and problem.low.large:
        return
    start = perf_counter()
    try:
        x = bonded_start(problem.low, omega, system)
        problem.low.linearise(x, omega)
        if always_kept(problem.strategy) is None:
            judged(problem.strategy, problem.step(problem.low, x, omega))
    except NO_SOLUTION:
        return  # the solution will report the error
    seconds = perf_counter() - start
    if seconds > COMPILED:
        LOG.info(f"compiled the contact laws in {seconds:.0f} s; needed once after installing")


def progress(point: ForcedPoint, sweep: Sweep) -> tuple[float, str]:
    """Return the finished fraction of a case, and a line that states it."""
    first, last = sweep.ends
    along = min(max((point.omega - first) / (last - first), 0.0), 1.0)
    shares = {"low": (0.0, 0.4), "high": (0.4, 0.35), "branch": (0.75, 0.2), "peak": (0.95, 0.05)}
    if sweep.single or point.shot:  # such a sweep has repeats between its points, or none
        shares |= {"low": (0.0, 0.95), "high": (0.0, 0.95)}
    shares["check"] = shares["peak"]
    begin, width = shares.get(point.stage, (0.0, 0.95))
    lost = ", no solution" if point.stage in REPEATED else f", {point.status.advice}"
    state = "" if point.converged else lost
    marched = marched_of(point)
    state += "" if marched is None else f", {marched}"
    return (
        begin + width * along,
        f"{IN_WORDS[point.stage]}, point {point.index + 1}: {point.omega / HZ:.2f} Hz, H = {named(point.harmonics)}{state}",
    )


def _values(solved: Solved) -> Values:
    """Return all stored variables of a job."""
    return {name: v for note in NOTES for name, v in solved.notes.get(note, {}).items()}


# solutions of points that stand without them
REPEATED: tuple[Stage, ...] = ("audit", "trial", "check", "settled", "compared")
IN_WORDS: dict[Stage, str] = {
    "low": "low harmonics",
    "high": "more harmonics",
    "branch": "branch of more harmonics",
    "peak": "peak",
    "point": "harmonics of each point",
    "audit": "audit of the harmonics",
    "trial": "trial of more harmonics",
    "found": "passage",
    "check": "harmonics of the peak",
    "in_time": "start in time",
    "settled": "more harmonics for a doubted point",
    "compared": "a doubted point compared with more harmonics",
}

FORCED_RESPONSE = Analysis(
    name="forced_response",
    table=ForcedResponse,
    record=ForcedPoint,
    key=of_tables("forced_response", "harmonics", "solver"),
    inputs=_inputs,
    solve=_solve,
    dataset=_dataset,
    check=advice,
    summary=tables,
    shared=("harmonics", "solver", "limits", "operation", "stress"),
    answers=KINDS,
    checks=(IN_TIME, HARMONICS),
    asks=asked_beside,
    verdicts=_verdicts,
    completed=_completed,
)
