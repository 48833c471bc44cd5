"""The runner: it executes the jobs of all analyses, or one of several shares of them, and writes each record to disk."""

import json
import re
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass, fields, replace
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from math import inf
from os.path import realpath
from pathlib import Path
from time import monotonic
from typing import Any

from stickslip import __version__
from stickslip.assembly.joints.surface_checks import TENFOLD
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.mesh.solid_mesh import SolidMesh, write_mesh
from stickslip.study.analysis import Analysis, Case, Job, Solved, named
from stickslip.study.jobs import Order, solve_job, worked
from stickslip.study.models.study import Study
from stickslip.study.outcome import Book, Outcome, Task
from stickslip.study.own_code import CODE_FILE, OwnCode, Shipped
from stickslip.study.questions import ANALYSES, loaded
from stickslip.study.store.archive import PartStore
from stickslip.study.store.atomic_write import whole_file, write_whole
from stickslip.study.store.folder import JOBS, LOG_FILE, PARTS, RESULT, empty_folder, locked_folder
from stickslip.study.store.journal import SEALED, JobJournal, file_at_work, new_owner, read_sealed
from stickslip.study.store.netcdf import attributes_there, write_tree
from stickslip.study.store.progress import LOG, Interrupted, stage, written_down
from stickslip.study.store.provenance import Provenance, as_text, library_versions
from stickslip.study.store.worker_process import Limits, check_memory_limit
from stickslip.study.store.workers import Hands, check_kind, executor
from stickslip.study.verdict import together


@dataclass(frozen=True)
class Shard:
    """One of several runs that share the jobs of a study.

    Parameters
    ----------
    number
        Number of this shard, from 1.
    count
        Number of shards.
    """

    number: int
    count: int

    @classmethod
    def read(cls, text: str) -> "Shard":
        """Parse a text such as ``3/8``.

        Raises
        ------
        InputError
            If the text is not of this form.
        """
        found = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
        shard = cls(*map(int, found.groups())) if found else cls(0, 0)
        if not 1 <= shard.number <= shard.count:
            raise input_error(
                f"--shard {text}",
                "is no share of the jobs",
                "Give its number and how many there are: --shard 1/4 up to --shard 4/4.",
            )
        return shard

    @property
    def log(self) -> str:
        """Name of its log file."""
        return f"run-{self.number}-of-{self.count}.log"

    def own(self, tasks: Sequence[Task]) -> Sequence[Task]:
        """Return the tasks of this shard; every shard sorts all tasks in the same order."""
        return tasks[self.number - 1 :: self.count]

    def outcome(self, book: Book, done: int, left: int, folder: Path) -> Outcome:
        """Return the outcome of a shard that ends while others still run."""
        text = (
            f"shard {self.number}/{self.count}: {done} jobs done, {left} of other shards are not. The last one to end puts the "
            "result together, as does the same command without --shard."
        )
        LOG.info(text)
        return Outcome(book.tree(complete=False), {}, 0, (folder / self.log,), text)


SHARE = 0.1  # largest fraction of a run's time for writing incomplete results


@dataclass(frozen=True, eq=False)
class Place:
    """Place at which a run executes its jobs.

    Parameters
    ----------
    workers
        Number of processes; numerical results do not depend on it.
    kind
        Kind of executor, see `executor`.
    shard
        Shard of this run; None: all jobs.
    """

    workers: int = 1
    kind: str | Executor = ""
    shard: Shard | None = None

    def log(self, folder: Path) -> Path:
        """Return the path of the log file."""
        return folder / (LOG_FILE if self.shard is None else self.shard.log)

    def check(self, *, fresh: bool) -> None:
        """Refuse impossible settings before any computation."""
        if self.workers < 1:
            raise input_error("--workers", f"must be above zero, got {self.workers}", "Leave it out for one.")
        if isinstance(self.kind, str):
            check_kind(self.kind)
        if self.shard is not None and fresh:
            raise input_error(
                "--fresh",
                "would remove what other shards have found",
                "Leave it out, or run once with --fresh and without --shard.",
            )


def run_study(
    study: Study,
    *,
    only: Sequence[str] = (),
    workers: int = 1,
    kind: str | Executor = "",
    shard: Shard | None = None,
    fresh: bool = False,
    checks: Sequence[str] = (),
) -> Outcome:
    """Run the analyses of a study. An interrupted run continues with the unfinished jobs.

    Parameters
    ----------
    study
        A study from `read_study`.
    only
        Names of the analyses to run; empty: all analyses of the study.
    workers, kind, shard
        Where jobs are executed; see `Place`.
    fresh
        Delete earlier results and start again.
    checks
        Additional checks, by the names in `Analysis.checks`.

    Raises
    ------
    InputError
        If the study, its files or its folder do not allow a run. It is raised before any long computation.
    Interrupted
        If the user stops the run; the message says how to continue.
    """
    asked, place = asked_for(study, only), Place(workers, kind, shard)
    place.check(fresh=fresh)
    log = study.folder / (LOG_FILE if shard is None else shard.log)
    with locked_folder(study.folder, shared=shard is not None):
        if not fresh:
            _refuse_result_of_another(study)
        with written_down(log):
            LOG.info(f"stickslip {__version__}, study {study.path}")
            for line in not_used(study, asked):
                LOG.info(line)
            try:
                return _run(study, asked, place, fresh, frozenset(checks))
            except KeyboardInterrupt:
                LOG.info("interrupted by the user")
                raise Interrupted(
                    f"Interrupted. What is finished is kept in {study.folder}. The same command goes on from there."
                ) from None


def asked_for(study: Study, only: Sequence[str] = ()) -> list[Analysis]:
    """Return the analyses of a study in their order.

    Raises
    ------
    InputError
        If `only` names an analysis that is unknown or has no table, or the study has no analysis.
    """
    for name in only:
        if name not in ANALYSES and name not in study.asked:
            known = list(dict.fromkeys([*ANALYSES, *study.asked]))
            raise input_error(f"--only {name}", "is no analysis", did_you_mean(name, known))
        if name not in study.asked:
            raise input_error(f"{study.path}: {name}", "is missing", f"Add the table [{name}] to the study.")
    wanted = [name for name in study.asked if name in (only or study.asked)]
    if not wanted:
        raise input_error(
            str(study.path),
            "asks for nothing",
            f"Add a table of an analysis: {', '.join(f'[{name}]' for name in ANALYSES)}.",
        )
    return [named(name) if name in ANALYSES else loaded(getattr(study.tables, name).analysis) for name in wanted]


def not_used(study: Study, asked: Sequence[Analysis]) -> list[str]:
    """Return a sentence on each shared table, operating range or stress, that no asked analysis uses."""
    told = []
    for table in ("operation", "stress"):
        if not getattr(study.tables, table).model_fields_set or any(table in one.shared for one in asked):
            continue
        using = " or ".join(f"[{name}]" for name in ANALYSES if table in named(name).shared)
        names = " and ".join(f"[{one.name}]" for one in asked)
        told.append(f"[{table}] changes nothing: {names} does not use it. Ask for {using}, or remove it.")
    return told


def answer(asked: Analysis, cases: Sequence[Case], title: str = "", given: Mapping[str, Any] | None = None) -> Outcome:
    """Run one analysis on Python models without writing files; `given`: tables of an equivalent study file, for the page."""
    book = Book(Provenance(title, "", library_versions(), json.dumps(given or {}, default=str)))
    found = []
    for case in cases:
        with JobJournal(Path(":memory:"), asked.record) as journal:
            job = Job(_label(asked, case), asked.inputs(case, case.build()))
            solve_job(asked, job, journal, case.checks)
            found.append(Solved(case, journal.records(), journal.notes()))
    book.enter(asked, found)
    return book.outcome([asked])


def _run(study: Study, asked: Sequence[Analysis], place: Place, fresh: bool, checks: frozenset[str]) -> Outcome:
    code = study.code
    versions = library_versions() | code.files
    origin = Provenance(study.title, study.text, versions, study_file=as_text(study.path.name))
    book = Book(origin, measured=study.measured)
    store, target = PartStore(study.folder / PARTS, fresh=fresh), study.folder / RESULT
    cases = [replace(c, build=cache(c.build), store=store.kept) for c in study.cases()]
    tasks = _tasks(study, asked, cases, checks, book.origin.versions)
    # tasks with the same input share a job; finished tasks of analyses that were not requested are shown, too
    unfinished = {t.sealed: t for t in tasks if fresh or not t.finished()}
    to_do = _longest_first([t for t in unfinished.values() if t.analysis in asked])
    if place.shard is not None:
        own = place.shard.own(_longest_first({t.sealed: t for t in tasks if t.analysis in asked}.values()))
        to_do = [t for t in to_do if t.sealed in {o.sealed for o in own}]
    LOG.info(f"jobs to do: {len(to_do)}, answers: {sum(t.analysis in asked for t in tasks)}")
    files: list[Path] = []
    with _hands(to_do, place) as hands:
        # all refusals come before any long computation, and before earlier results are deleted
        jobs = list(_orders(study, to_do, place, _labels(tasks)))
        if not fresh:
            _check_files(to_do)
            if place.shard is None:
                book.read(tasks, unfinished)
        meshes = _meshes(t.case for t in to_do)
        if fresh:
            empty_folder(study.folder, [f"{name}.vtu" for name in meshes], store.written)
        _tell_of_code(code, study.folder / CODE_FILE)
        for name, mesh in meshes.items():
            files.append(study.folder / f"{name}.vtu")
            with whole_file(files[-1]) as temporary:
                write_mesh(mesh, temporary)
        show = _now_and_then(lambda: write_tree(book.tree(complete=False), target))
        with closing(_told(worked(jobs, hands, study.folder), len(jobs), hands)) as finished:
            for done, sealed in enumerate(finished, 1):
                del unfinished[sealed]
                if place.shard is None:
                    book.read(tasks, unfinished)
                    show(len(jobs) - done)
    if place.shard is not None:
        left = {t.sealed for t in tasks if t.analysis in asked and not t.ended()}
        if left:
            return place.shard.outcome(book, len(to_do), len(left), study.folder)
        unfinished = {t.sealed: t for t in tasks if not t.ended()}
        files = []
    stage("putting the result together")
    book.read(tasks, unfinished)
    outcome = book.outcome(asked)
    write_tree(outcome.tree, target)
    return replace(outcome, files=(target, *files, place.log(study.folder)))


def _tell_of_code(code: OwnCode, kept: Path) -> None:
    """Log the user's code that runs, and its changes since the last run in the folder."""
    try:
        before = dict(json.loads(kept.read_bytes()))
    except (OSError, ValueError, TypeError):  # the file is missing or damaged
        before = {}
    if not code.files and not before:
        return
    for name, now in code.files.items():
        LOG.info(f"own code: {name}, SHA-256 {now}")
        if before.get(name, now) != now:
            LOG.info(f"{name} has changed since the last run here: nothing of that run is used")
    write_whole(kept, json.dumps(code.files).encode())


def _refuse_result_of_another(study: Study) -> None:
    """Refuse to overwrite the result of another study file, unless that file was renamed or removed."""
    target, home, name = (study.folder / RESULT, study.path.resolve().parent, as_text(study.path.name))
    other = str(attributes_there(target).get("study_file", name))
    if other == name:
        return
    of_home, before = Path(realpath(target)).is_relative_to(home), home / other
    if of_home and (not before.exists() or before.samefile(study.path)):
        return
    own = f"{study.folder.name}_{study.path.stem}"
    raise input_error(
        str(study.path),
        f"its results would replace those of {other} in {target}",
        f'Write [output] folder = "{own}" into {name}, give --results {own}, or put {name} into a folder of its own.',
    )


def _now_and_then(write: Callable[[], object]) -> Callable[[int], None]:
    """Return a function that writes while jobs are left, in at most a tenth of the time: results of many cases take long."""
    due = 0.0

    def wrote(left: int) -> None:
        nonlocal due
        began = monotonic()
        if left and began >= due:
            write()
            due = monotonic() + (1 / SHARE - 1) * (monotonic() - began)

    return wrote


def _longest_first(tasks: Iterable[Task]) -> list[Task]:
    """Return tasks with the longest first: nonlinear before linear, then in order of decreasing excitation."""
    return sorted(tasks, key=lambda t: (t.analysis.linear, -t.case.drive))


def _limits(task: Task) -> Limits:
    own = getattr(task.case.settings, "limits", None)
    return Limits(*(getattr(own, name, None) or inf for name in ("job_s", "job_memory_gb")))


def _orders(study: Study, tasks: Sequence[Task], place: Place, labels: Mapping[Path, str]) -> Iterator[Order]:
    for number, task in enumerate(tasks, 1):
        stage(f"building {labels[task.sealed]}, {number} of {len(tasks)}")
        yield _order(study, task, place, labels[task.sealed])


def _told(finished: Generator[Path], count: int, hands: Hands) -> Generator[Path]:
    """Yield the files of finished jobs, and report their number if the jobs run on other machines, which report no progress."""
    with closing(finished):
        if hands.far:
            stage(f"{count} jobs are with the workers")
        for done, sealed in enumerate(finished, 1):
            yield sealed
            if hands.far:
                stage(f"{done} of {count} jobs done by the workers")


def _order(study: Study, task: Task, place: Place, label: str) -> Order:
    """Return the job of a task for a worker."""
    job = Job(label, _inputs(study, task))
    owner = "" if place.shard is None else new_owner()
    own = study.code
    code = Shipped(own.home, own.files) if own.files else None
    return Order(task.analysis, job, task.sealed, task.case.checks, _limits(task), owner, code)


def _hands(tasks: Sequence[Task], place: Place) -> AbstractContextManager[Hands]:
    """Return the executor of the jobs; jobs with limits, and jobs of a shard, run in their own process even one at a time."""
    limits = [_limits(task) for task in tasks]
    for one in limits:
        check_memory_limit(one)
    if not tasks:
        return executor("", 1)
    workers = min(place.workers, len(tasks)) if not place.kind else place.workers
    apart = place.workers > 1 or place.shard is not None or any(limits)
    return executor(place.kind, workers, apart=apart)


def _tasks(
    study: Study, asked: Sequence[Analysis], cases: Sequence[Case], checks: frozenset[str], versions: Mapping[str, str]
) -> list[Task]:
    """Return a task for every case of every analysis of the study; only requested analyses get the checks."""
    found = []
    for own in asked_for(study):
        wanted = checks & frozenset(own.checks)
        found += [
            _task(own, replace(c, checks=wanted | own.asks(c) if own in asked else frozenset()), study.folder, versions)
            for c in cases
        ]
    return found


def _task(asked: Analysis, case: Case, folder: Path, versions: Mapping[str, str]) -> Task:
    """Return a task; the name of its file is the hash of everything that its results depend on."""
    layout = [f.name for f in fields(asked.record)]
    model = case.digest_at_rest if asked.linear else case.digest
    parts = [asked.name, asked.key(case), model, versions, layout]
    key = sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
    return Task(asked, case, folder / JOBS / f"{key}{SEALED}")


@contextmanager
def of_task(study: Study, case: Case) -> Iterator[None]:
    """Add the path of the study file, and the label of the case, to input errors raised in the block."""
    try:
        yield
    except InputError as error:
        place = f"{study.path} ({case.label})" if case.label else str(study.path)
        words = {"outside": "", "reach": "tolerance_m", "rim": f"tolerance_m = {TENFOLD}"}
        named = error.called(words)
        # errors of the model already name the file
        raise named.under(str(study.path), place) from None


def _inputs(study: Study, task: Task) -> Any:
    model = task.case.build()
    with of_task(study, task.case):
        return task.analysis.inputs(task.case, model)


def _check_files(tasks: Iterable[Task]) -> None:
    """Refuse damaged files of unfinished jobs before any computation."""
    for task in tasks:
        at_work_file = file_at_work(task.sealed)
        if task.sealed.exists():
            read_sealed(task.sealed, task.analysis.record)
        if at_work_file.exists():
            with JobJournal(at_work_file, task.analysis.record) as journal:
                journal.check()


def _label(asked: Analysis, case: Case) -> str:
    words = asked.name.replace("_", " ")
    return f"{words}: {case.label}" if case.label else words


def _labels(tasks: Sequence[Task]) -> dict[Path, str]:
    """Return the label of each job: its analysis and its cases; a job for all cases names no case."""
    cases: dict[Path, list[Task]] = {}
    for task in tasks:
        cases.setdefault(task.sealed, []).append(task)
    every = {name: sum(t.analysis.name == name for t in tasks) for name in {t.analysis.name for t in tasks}}
    found = {}
    for sealed, own in cases.items():
        first = own[0]
        words = first.analysis.name.replace("_", " ")
        label = together([t.case.label for t in own]) if len(own) < every[first.analysis.name] else ""
        found[sealed] = f"{words}: {label}" if label else words if len(own) > 1 else _label(first.analysis, first.case)
    return found


def _meshes(cases: Iterable[Case]) -> dict[str, SolidMesh]:
    """Return the meshes of the parts of the first case, for ParaView; empty if meshio is missing."""
    if find_spec("meshio") is None:
        return {}
    for case in cases:
        parts = case.build().parts.items()
        return {name: part.mesh for name, part in parts if part.mesh is not None}
    return {}
