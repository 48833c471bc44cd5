"""From a study to its results: every job of every analysis, each record safe on the disk. The only runner."""

import json
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from dataclasses import fields, replace
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from stickslip import __version__
from stickslip.errors import InputError, SingularError, StickslipError, did_you_mean, input_error
from stickslip.model.mesh.solid_mesh import SolidMesh, write_mesh
from stickslip.study.analyses import ANALYSES
from stickslip.study.analyses.analysis import Analysis, Case, Job, Solved, named
from stickslip.study.keep.folder import JOBS, LOG_FILE, PARTS, RESULT, empty_folder, locked_folder
from stickslip.study.keep.journal import AT_WORK, SEALED, JobJournal, read_sealed
from stickslip.study.keep.netcdf import write_tree
from stickslip.study.keep.progress import LOG, Interrupted, at_work, written_down
from stickslip.study.keep.provenance import Provenance, library_versions
from stickslip.study.keep.store import PartStore
from stickslip.study.keep.whole import whole_file
from stickslip.study.keep.workers import executor
from stickslip.study.models.study import Study
from stickslip.study.outcome import CHECKED, UNSOLVED, Book, Outcome, Task, checked

NO_SOLUTION = (SingularError, FloatingPointError, np.linalg.LinAlgError)


def run_study(
    study: Study,
    *,
    only: Sequence[str] = (),
    workers: int = 1,
    fresh: bool = False,
    checks: Sequence[str] = (),
) -> Outcome:
    """Answer the questions of a study, going on from what an interrupted run has finished.

    Parameters
    ----------
    study
        That has been read.
    only
        Names of the analyses to answer; all of the study if empty.
    workers
        Number of processes; the numbers do not depend on it.
    fresh
        Forget what the results folder holds.
    checks
        Checks beside the answers, by names of `Analysis.checks`.

    Raises
    ------
    InputError
        If the study, its files or its folder do not allow a run; before anything long is computed.
    Interrupted
        If the user stops it; the message says how to go on.
    """
    asked = asked_for(study, only)
    if workers < 1:
        raise input_error(
            "--workers", f"must be above zero, got {workers}", "Leave it out for one."
        )
    with locked_folder(study.folder), written_down(study.folder / LOG_FILE):
        LOG.info(f"stickslip {__version__}, study {study.path}")
        try:
            return _run(study, asked, workers, fresh, frozenset(checks))
        except KeyboardInterrupt:
            LOG.info("interrupted by the user")
            raise Interrupted(
                f"Interrupted. What is finished is kept in {study.folder}. The same command goes on from there."
            ) from None


def asked_for(study: Study, only: Sequence[str] = ()) -> list[Analysis]:
    """Return the analyses that a study asks for, in their order.

    Raises
    ------
    InputError
        If `only` names one that is not known or has no table, or the study asks for none.
    """
    for name in only:
        if name not in ANALYSES:
            raise input_error(
                f"--only {name}", "is no analysis", did_you_mean(name, list(ANALYSES))
            )
        if name not in study.asked:
            raise input_error(
                f"{study.path}: {name}", "is missing", f"Add the table [{name}] to the study."
            )
    wanted = [name for name in ANALYSES if name in (only or study.asked)]
    if not wanted:
        raise input_error(
            str(study.path),
            "asks for nothing",
            f"Add a table of an analysis: {', '.join(f'[{name}]' for name in ANALYSES)}.",
        )
    return [named(name) for name in wanted]


def answer(asked: Analysis, cases: Sequence[Case], title: str = "") -> Outcome:
    """Answer one question to models of Python; nothing is written."""
    book = Book(Provenance(title, "", library_versions()))
    found = []
    for case in cases:
        with JobJournal(Path(":memory:"), asked.record) as journal:
            job = Job(_label(asked, case), asked.inputs(case, case.build()))
            _solve(asked, job, journal, case.checks)
            found.append(Solved(case, journal.records(), journal.notes()))
    book.enter(asked, found)
    return book.outcome([asked])


def _run(
    study: Study, asked: Sequence[Analysis], workers: int, fresh: bool, checks: frozenset[str]
) -> Outcome:
    origin = Provenance(study.title, study.text, library_versions())
    book = Book(origin, measured=study.measured)
    store = PartStore(study.folder / PARTS, fresh=fresh)
    cases = [replace(c, build=cache(c.build), store=store.kept) for c in study.cases()]
    tasks = _tasks(study, asked, cases, checks, book.origin.versions)
    # tasks whose numbers depend on the same things share a job; those not asked for are shown where they are finished
    unfinished = {t.sealed: t for t in tasks if fresh or not t.finished()}
    to_do = [t for t in unfinished.values() if t.analysis in asked]
    LOG.info(f"jobs to do: {len(to_do)}, answers: {len(tasks)}")
    # all refusals come before any long computation, and before anything is given up
    jobs = [(t, _inputs(study, t)) for t in to_do]
    if not fresh:
        _check_files(to_do)
        book.read(tasks, unfinished)
    meshes = _meshes(t.case for t in to_do)
    if fresh:
        empty_folder(study.folder, [f"{name}.vtu" for name in meshes], store.written)
    for name, mesh in meshes.items():
        with whole_file(study.folder / f"{name}.vtu") as temporary:
            write_mesh(mesh, temporary)
    target = study.folder / RESULT
    with closing(_worked(jobs, workers)) as finished:
        for sealed in finished:
            del unfinished[sealed]
            book.read(tasks, unfinished)
            write_tree(book.tree(complete=False), target)
    book.read(tasks, unfinished)
    outcome = book.outcome(asked)
    write_tree(outcome.tree, target)
    meshed = [study.folder / f"{name}.vtu" for name in meshes]
    return replace(outcome, files=(target, *meshed, study.folder / LOG_FILE))


def _tasks(
    study: Study,
    asked: Sequence[Analysis],
    cases: Sequence[Case],
    checks: frozenset[str],
    versions: Mapping[str, str],
) -> list[Task]:
    """Return every case of every analysis of the study; only those asked for are to have the checks."""
    found = []
    for own in asked_for(study):
        wanted = checks & frozenset(own.checks) if own in asked else frozenset()
        found += [_task(own, replace(c, checks=wanted), study.folder, versions) for c in cases]
    return found


def _task(asked: Analysis, case: Case, folder: Path, versions: Mapping[str, str]) -> Task:
    """Name the file of a job by all that its numbers depend on."""
    layout = [f.name for f in fields(asked.record)]
    model = case.digest_at_rest if asked.linear else case.digest
    parts = [asked.name, asked.key(case), model, versions, layout]
    key = sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
    return Task(asked, case, folder / JOBS / f"{key}{SEALED}")


@contextmanager
def of_task(study: Study, case: Case) -> Iterator[None]:
    """Let a refusal name the study's file, and the case where there are several."""
    try:
        yield
    except InputError as error:
        place = f"{study.path} ({case.label})" if case.label else str(study.path)
        raise error.called({"outside": "", "reach": "tolerance_m"}).inside(place) from None


def _inputs(study: Study, task: Task) -> Any:
    model = task.case.build()
    with of_task(study, task.case):
        return task.analysis.inputs(task.case, model)


def _check_files(tasks: Iterable[Task]) -> None:
    """Refuse damaged files of jobs that are to go on, before anything else is computed."""
    for task in tasks:
        at_work_file = task.sealed.with_suffix(AT_WORK)
        if task.sealed.exists():
            read_sealed(task.sealed, task.analysis.record)
        elif at_work_file.exists():
            with JobJournal(at_work_file, task.analysis.record) as journal:
                journal.records()
                journal.notes()


def _label(asked: Analysis, case: Case) -> str:
    words = asked.name.replace("_", " ")
    return f"{words}: {case.label}" if case.label else words


def _meshes(cases: Iterable[Case]) -> dict[str, SolidMesh]:
    """Return the meshes of the parts of the first case that is built, for pictures; none where nothing can write them."""
    if find_spec("meshio") is None:
        return {}
    for case in cases:
        parts = case.build().parts.items()
        return {name: part.mesh for name, part in parts if part.mesh is not None}
    return {}


def _worked(plan: Sequence[tuple[Task, Any]], workers: int) -> Generator[Path]:
    """Work the jobs off; give the file of each when it is sealed."""
    left = list(reversed(plan))
    running: dict[Future[None], Path] = {}
    with executor(workers) as pool:
        while left or running:
            while left and len(running) < workers:
                task, inputs = left.pop()
                job = Job(_label(task.analysis, task.case), inputs)
                running[pool.submit(_work, task.analysis, job, task.sealed, task.case.checks)] = (
                    task.sealed
                )
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                _require(future)
                yield running.pop(future)


def _require(future: Future[None]) -> None:
    """Raise what a job raised; a process that was killed by others is told in words."""
    try:
        future.result()
    except BrokenProcessPool:
        raise StickslipError(
            "a worker process was ended from outside, as a rule for lack of memory. What is finished is kept: run the same "
            "command with fewer --workers."
        ) from None


def _work(asked: Analysis, job: Job, sealed: Path, checks: frozenset[str]) -> None:
    """Solve a job, going on from what its file holds, and seal the file; runs in any process."""
    at_work_file = sealed.with_suffix(AT_WORK)
    if sealed.exists():  # all is there but checks
        sealed.replace(at_work_file)
    with JobJournal(at_work_file, asked.record) as journal:
        _solve(asked, job, journal, checks)
        journal.seal()


def _solve(asked: Analysis, job: Job, journal: JobJournal, checks: frozenset[str]) -> None:
    """Add the records to the journal that are not in it."""
    done = journal.records()
    if done:
        LOG.info(f"{job.label} goes on after {len(done)} records of the earlier start")
    try:
        with at_work(job.label):
            for record in asked.solve(job.inputs, done, journal):
                journal.add(record)
    except NO_SOLUTION as error:
        # a job without a solution must not take the finished ones with it
        words = asked.name.replace("_", " ")
        journal.put(UNSOLVED, {"text": f"{words} has no solution ({error})"})
    journal.put(CHECKED, {"names": sorted(checks | checked(journal.get(CHECKED)))})
