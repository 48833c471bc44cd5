"""A study from its file to its results, every finished point safe on the disk."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from time import perf_counter

import numpy as np

from stickslip import __version__
from stickslip.errors import SingularError
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.response import (
    ForcedPoint,
    ForcedProblem,
    Sweep,
    forced_problem,
    forced_response,
)
from stickslip.response.free_motion import drift
from stickslip.study.build import Case, case_of, check_before_meshing
from stickslip.study.chooser import Chooser, chooser_of, cost_sentence
from stickslip.study.collect import HZ, CaseResult, collect
from stickslip.study.error_places import mixed_places
from stickslip.study.folder import JOURNAL, LOG, MESHES, RESULT, prepare_folder
from stickslip.study.harmonics_table import named
from stickslip.study.journal import Journal
from stickslip.study.netcdf import write_dataset
from stickslip.study.progress import Interrupted, Log, Sink, library_versions
from stickslip.study.reference_check import ReferenceDoubt, check_reference
from stickslip.study.retention import peak_shift
from stickslip.study.schema import Study, read_study
from stickslip.study.store import Provenance, dataset
from stickslip.study.summary import RunSummary, choice_sentence, more_name, row
from stickslip.study.verify import Check, require_integrable, verify

NO_SOLUTION = (SingularError, FloatingPointError, np.linalg.LinAlgError)
COMPILED = 5.0  # seconds of the first evaluation: below, it was found compiled


def run_study(
    path: Path,
    *,
    verify_in_time: bool = False,
    verify_harmonics: bool = False,
    fresh: bool = False,
    sink: Sink,
) -> RunSummary:
    """Run a study, going on from what an interrupted run has finished.

    Parameters
    ----------
    path
        The study file.
    verify_in_time
        Integrate in time at three frequencies and compare.
    verify_harmonics
        Predict at every frequency what twice as many harmonics would change.
    fresh
        Forget what the results folder holds.
    sink
        Where progress is told.

    Raises
    ------
    InputError
        If the study, its folder or its estimated cost do not allow a run.
    Interrupted
        If the user stops it; the message says how to go on.
    """
    study = read_study(path)
    if verify_in_time:
        require_integrable(study)
    # what is there is not given up for a study that cannot be run
    check_before_meshing(study)
    prepare_folder(study.folder, fresh=fresh)
    versions = library_versions()
    with Journal(study.folder / JOURNAL, fingerprint(study, versions), ForcedPoint) as journal:
        log = Log(study.folder / LOG, sink)
        try:
            return _run(_Run(study, versions, journal, log), verify_in_time, verify_harmonics)
        except KeyboardInterrupt:
            log.say("interrupted by the user")
            raise Interrupted(
                f"Interrupted. What is finished is kept in {study.folder}. The same command goes on from there."
            ) from None


def check_study(path: Path, sink: Sink) -> list[str]:
    """Do everything but the solve; return warnings.

    Nothing is written: neither results nor what the model's building could be spared of later.
    """
    study = read_study(path)
    sink.say(f"{path}: read, {len(study.tables.loads.ratios)} load cases")
    case = case_of(study, None, sink.say)
    normal = -case.static_force[:, 2]
    sink.say(f"static equilibrium: normal forces {normal.min():.3g} to {normal.max():.3g} N")
    table = study.tables.harmonics
    for line in chooser_of(table, case.error_labels).lines(table.passages):
        sink.say(f"harmonics: {line}")
    return [*case.blades.frequencies.warnings(), *mixed_places(case.error_labels)]


def fingerprint(study: Study, versions: dict[str, str]) -> str:
    """Return a hash of all that the numbers of a run depend on."""
    return sha256(json.dumps([study.content_hash, versions], sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True, eq=False)
class Checks:
    """What was checked beyond the run itself: by time integration, and with more harmonics."""

    in_time: Sequence[Check] = ()
    of_harmonics: Sequence[ReferenceDoubt] = ()


@dataclass(frozen=True, eq=False)
class _Run:
    """What every step of a run needs."""

    study: Study
    versions: dict[str, str]
    journal: Journal
    log: Log
    began: float = field(default_factory=perf_counter)
    created: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    warnings: list[str] = field(default_factory=list)

    def warn(self, text: str) -> None:
        self.warnings.append(text)
        self.log.say(f"WARNING: {text}")


def _run(run: _Run, verify_in_time: bool, verify_harmonics: bool) -> RunSummary:
    run.log.say(f"stickslip {__version__}, study {run.study.path}")
    kept = run.journal.count
    if kept:
        run.log.say(f"{kept} points are taken from the earlier start")
    case = case_of(run.study, run.journal, run.log.say)
    for text in (*case.blades.frequencies.warnings(), *mixed_places(case.error_labels)):
        run.warn(text)
    table = run.study.tables.harmonics
    chooser = chooser_of(table, case.error_labels)
    for line in chooser.lines(table.passages):
        run.log.say(f"harmonics: {line}")
    _compile(run, case)
    results: list[CaseResult] = []
    for i in range(len(case.ratios)):
        results.append(_load_case(run, case, i))
        _write(run, case, results, chooser, Checks(), complete=False)
    doubts = _doubts(run, case, results) if verify_harmonics else []
    checks = verify(case, results, run.journal, run.log.say) if verify_in_time else []
    _write(run, case, results, chooser, Checks(checks, doubts), complete=True)
    target = run.study.folder / RESULT
    files = [target, *(run.study.folder / name for name in (*MESHES, LOG))]
    return RunSummary(
        rows=tuple(row(r) for r in results),
        chooser=chooser,
        more=more_name(results, chooser),
        choices=_choices(case, results, chooser),
        checks=tuple(checks),
        doubts=tuple(d.sentence for d in doubts),
        warnings=tuple(run.warnings),
        result=target,
        files=tuple(f for f in files if f.exists()),
    )


def _compile(run: _Run, case: Case) -> None:
    """Evaluate contacts and strategy once, or the first load case would count their compilation as work."""
    problem = forced_problem(case.system, case.load(case.ratios[0]), case.sweep)
    omega = case.sweep.omega_range[0]
    start = perf_counter()
    try:
        x = bonded_start(problem.low, omega, case.system)
        problem.low.linearise(x, omega)
        problem.strategy.judge(problem.step(problem.low, x, omega))
    except NO_SOLUTION:
        return  # the load case says what is wrong
    seconds = perf_counter() - start
    if seconds > COMPILED:
        run.log.say(f"compiled the contact laws in {seconds:.0f} s, once an installation")


def _choices(case: Case, results: Sequence[CaseResult], chooser: Chooser) -> tuple[str, ...]:
    """Say where more harmonics were asked for, and what choosing cost."""
    if not chooser.decides:
        return ()
    solved, points = sum(r.unknowns for r in results), sum(len(r.accepted) for r in results)
    each = case.system.retained.size * (2 * len(chooser.high) - 1)
    told = [choice_sentence(r, chooser) for r in results]
    if points:
        told.append(cost_sentence(solved, points, each, named(chooser.high)))
    return tuple(told)


def _load_case(run: _Run, case: Case, i: int) -> CaseResult:
    ratio = case.ratios[i]
    problem = forced_problem(case.system, case.load(ratio), case.sweep)
    run.log.sink.begin(f"load case {i + 1} of {len(case.ratios)}: F_CL/F_HE = {ratio:g}")
    points = _points(run, case, i)
    result = collect(
        problem,
        points,
        ratio=ratio,
        excitation=case.centrifugal / ratio,
        report_output=case.report_output,
    )
    if result.failed:
        run.warn(
            f"F_CL/F_HE = {result.ratio:g}: {result.failed} points did not converge; the peak is the largest of the others, "
            "and a larger one may stand among them"
        )
    on_a_grid = case.sweep.single or case.sweep.frequencies > 0
    # between given frequencies any growth is possible: only steps of a branch are short enough to tell a jump
    if result.jumps_hz and not on_a_grid:
        places = ", ".join(f"{f:.2f}" for f in result.jumps_hz)
        run.warn(
            f"F_CL/F_HE = {result.ratio:g}: the response jumps at {places} Hz, where solutions with few and with many "
            "harmonics meet: more than one periodic motion exists near there, and which one a machine takes depends on "
            "its history."
        )
    if result.folded_hz is not None:
        run.warn(
            f"F_CL/F_HE = {result.ratio:g}: the response folds between {result.folded_hz[0]:.2f} and {result.folded_hz[1]:.2f} Hz: "
            "more than one periodic motion was found there, as a rule one of them unstable. Points outside the asked range belong to the fold."
        )
    _warn_drift(run, problem, result)
    if result.peak_at_end:
        run.warn(
            f"F_CL/F_HE = {ratio:g}: the largest amplitude stands at the end of the sweep ({result.peak_frequency_hz:.2f} Hz); "
            "it is no resonance. Widen sweep.frequency_hz."
        )
    result = replace(result, retention_shift=peak_shift(case, result, i, run.journal))
    if case.retention > 0.0 and result.peak >= 0 and math.isnan(result.retention_shift[0]):
        run.warn(
            f"F_CL/F_HE = {ratio:g}: no periodic motion was found at the peak with a tenth of the retention stiffness; "
            "the peak rests on the damper being held, so do not rely on it"
        )
    run.log.say(
        f"F_CL/F_HE = {ratio:g}: peak {result.peak_amplitude:.4e} m at {result.peak_frequency_hz:.3f} Hz, "
        f"{len(result.accepted)} points, {result.failed} not converged, {result.newton_steps} Newton steps"
    )
    return result


def _points(run: _Run, case: Case, i: int) -> list[ForcedPoint]:
    """Return all points of a load case, each journalled as it comes."""
    load = case.load(case.ratios[i])
    done: list[ForcedPoint] = run.journal.points(i)
    finished = f"finished.{i}"
    if run.journal.get(finished) is not None:
        return done
    if done:
        run.log.say(f"load case {i + 1} goes on after {len(done)} points of the earlier start")
    points = list(done)
    try:
        for point in forced_response(case.system, load, case.sweep, done=done):
            run.journal.add(i, point)
            points.append(point)
            run.log.sink.advance(*progress(point, case.sweep))
    except NO_SOLUTION as error:
        # a load case without an equilibrium must not take the finished ones with it
        run.warn(f"F_CL/F_HE = {case.ratios[i]:g}: no solution ({error})")
    run.journal.put(finished, {"points": len(points)})
    return points


def progress(point: ForcedPoint, sweep: Sweep) -> tuple[float, str]:
    """Return how much of a load case is done, and a line that says so."""
    first, last = sweep.omega_range
    along = min(max((point.omega - first) / (last - first), 0.0), 1.0)
    shares = {"low": (0.0, 0.4), "high": (0.4, 0.35), "branch": (0.75, 0.2), "peak": (0.95, 0.05)}
    if sweep.single:  # repeats come in between
        shares |= {"low": (0.0, 0.95), "high": (0.0, 0.95)}
    begin, width = shares[point.stage]
    state = "" if point.converged else f", {point.status.advice}"
    return (
        begin + width * along,
        f"{point.stage} {point.index + 1}: {point.omega / HZ:.2f} Hz, H = {named(point.harmonics)}{state}",
    )


def _warn_drift(run: _Run, problem: ForcedProblem, result: CaseResult) -> None:
    """Warn where friction leaves the mean position of the damper free."""
    chosen = [a.point for a in result.accepted if not a.point.converged]
    if result.peak >= 0:
        chosen = [result.accepted[result.peak].point, *chosen]
    for point in chosen:
        found = drift(problem, point)
        if found.undetermined:
            run.warn(
                f"F_CL/F_HE = {result.ratio:g}, {point.omega / HZ:.2f} Hz: every contact slips or opens in each cycle, the "
                f"mean position of {found.coordinate} is undetermined and the damper may drift. Give [retention] a small "
                "stiffness_n_per_m (1e-6 of the contact stiffness); the result then says how far it moves the peak."
            )
            return


def _doubts(run: _Run, case: Case, results: Sequence[CaseResult]) -> list[ReferenceDoubt]:
    limit = run.study.tables.harmonics.alert_threshold_percent / 100
    doubts = check_reference(case, results, limit)
    for doubt in doubts:
        run.log.say(f"more harmonics: {doubt.sentence}")
        if doubt.warning:
            run.warn(doubt.warning)
    return doubts


def _write(
    run: _Run,
    case: Case,
    results: Sequence[CaseResult],
    chooser: Chooser,
    checks: Checks,
    *,
    complete: bool,
) -> None:
    provenance = Provenance(
        title=run.study.tables.title,
        study_toml=run.study.text,
        stickslip_version=__version__,
        versions=run.versions,
        created=run.created,
        wall_seconds=perf_counter() - run.began,
        selection=chooser,
        samples=case.sweep.samples,
        evaluator=case.sweep.evaluator,
        alert_explanation=" ".join(choice_sentence(r, chooser) for r in results if chooser.decides),
        warnings=run.warnings,
        complete=complete,
    )
    made = dataset(case, results, provenance, checks.in_time, checks.of_harmonics)
    write_dataset(made, run.study.folder / RESULT)
