"""Jobs, worked off: in this process, in processes that are watched, on other machines. A job that cannot be done stops no other."""

import logging
import pickle
import socket
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import AbstractContextManager, closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from stickslip.errors import SingularError, StickslipError
from stickslip.study.analyses.analysis import Analysis, Job
from stickslip.study.keep.attempts import begin, clear, file_at_work, left_behind, new_owner
from stickslip.study.keep.cell import Cell, Ended, Limits, OutOfTime, Stopped, blas_threads
from stickslip.study.keep.folder import token_file
from stickslip.study.keep.journal import JobJournal
from stickslip.study.keep.progress import LOG, OF_RECORDS, at_work
from stickslip.study.keep.provenance import library_versions
from stickslip.study.keep.workers import Hands
from stickslip.study.outcome import ASIDE, CHECKED, UNSOLVED, checked

NO_SOLUTION = (SingularError, FloatingPointError, np.linalg.LinAlgError)
TWICE = 2  # deaths of a job's process at the same place, after which it is set aside
LOST = 3  # workers lost at the same place: they may be lost for reasons of their own
EARLY = 30  # and before they had begun, which is hardly the job's fault
LOOK = 5.0  # seconds between two looks whether anything may be going on
SILENCE = 60.0  # seconds that it may not
ON = 1.0  # seconds between two looks whether the run is still on
UNKNOWN = (ImportError, AttributeError, pickle.PicklingError)  # what is not installed there


@dataclass(frozen=True, eq=False)
class Order:
    """A job with all that doing it needs; picklable.

    Parameters
    ----------
    analysis, job, checks
        What to answer.
    sealed
        The file that it ends in.
    limits
        What it may take.
    owner
        Of its file at work; empty: the only process that may write it.
    """

    analysis: Analysis
    job: Job
    sealed: Path
    checks: frozenset[str] = frozenset()
    limits: Limits = field(default_factory=Limits)
    owner: str = ""

    @property
    def file(self) -> Path:
        """Where it is at work."""
        return file_at_work(self.sealed, self.owner)


@dataclass(frozen=True, eq=False)
class Answer:
    """What comes back from another machine: what the job said, and what it raised."""

    host: str
    lines: list[dict[str, Any]]
    error: Exception | None = None


@dataclass
class Loss:
    """Workers that were lost with a job since it last went on.

    Parameters
    ----------
    begun
        Those that had opened a file for it.
    early
        Those that had not.
    size, files
        Of what they have left.
    """

    begun: int = 0
    early: int = 0
    size: int = 0
    files: int = 0

    def count(self, left: Sequence[Path]) -> None:
        """Count one more."""
        size, files = max((p.stat().st_size for p in left), default=0), len(left)
        if size > self.size > 0:
            self.begun = self.early = 0
        if files > self.files:
            self.begun += 1
        else:
            self.early += 1
        self.size, self.files = size, files


def worked(orders: Sequence[Order], hands: Hands, folder: Path) -> Generator[Path]:
    """Work jobs off, in their order; give the file of each when it is sealed.

    Parameters
    ----------
    orders
        The jobs.
    hands
        What they are given to.
    folder
        Of the results.
    """
    left, running = deque(orders), dict[Future[Answer], Order]()
    lost: dict[Path, Loss] = {}
    silent = monotonic()
    with _sender(hands, folder) as send:
        try:
            while left or running:
                while left and len(running) < hands.room:
                    order = left.popleft()
                    running[send(order)] = order
                done = wait(running, timeout=LOOK, return_when=FIRST_COMPLETED).done
                silent = monotonic() if done or not hands.trouble() else silent
                if monotonic() - silent > SILENCE:
                    raise _gone(hands.trouble())
                for future in done:
                    order = running.pop(future)
                    if _ended(future, order, lost, far=hands.far):
                        yield order.sealed
                    else:
                        left.append(order)
        finally:
            hands.over.set()
            for future in running:
                future.cancel()


@contextmanager
def _sender(hands: Hands, folder: Path) -> Iterator[Callable[[Order], Future[Any]]]:
    """Give what submits a job."""
    if hands.cell is not None:
        near = (hands.cell, hands.over.is_set)
        yield lambda order: hands.pool.submit(_watched_here, order, *near)
    elif not hands.far:
        yield lambda order: hands.pool.submit(solve, order)
    else:
        versions, threads = library_versions(), blas_threads()
        with token_file(folder) as token:
            yield lambda order: _submitted(hands.pool, order, token, versions, threads)


def _submitted(pool: Executor, order: Order, *others: Any) -> Future[Answer]:
    try:
        return pool.submit(solve_far, order, *others)
    except Exception as error:  # whatever the library makes of its end
        raise _gone(str(error)) from error


def _gone(why: str) -> StickslipError:
    return StickslipError(
        f"the executor takes no more jobs: {why}. What is finished is kept: the same command goes on from there."
    )


def _ended(future: Future[Any], order: Order, lost: dict[Path, Loss], *, far: bool) -> bool:
    """Raise what a job raised, and hand on what it said; say whether it has ended, which one whose worker was lost has not."""
    if not far:
        future.result()
        return True
    label = order.job.label
    try:
        answer: Answer = future.result()
    except UNKNOWN as error:
        raise StickslipError(
            f"a worker cannot take {label}: {error}. The same versions of stickslip and of modules of your own have to be "
            "installed where workers run."
        ) from error
    except Exception as error:  # noqa: BLE001  each library has its own for a worker that is lost
        loss = lost.setdefault(order.sealed, Loss())
        loss.count(left_behind(order.sealed))
        if loss.begun < LOST and loss.early < EARLY:
            LOG.info(
                f"{label}: its worker was lost ({type(error).__name__}); it is given to another"
            )
            return False
        own = replace(order, owner=new_owner())
        begin(own.sealed, own.file, own.analysis.record)
        set_aside(own, f"{loss.begun + loss.early} workers were lost with it at the same place ({type(error).__name__}: {error})")  # fmt: skip
        return True
    for line in answer.lines:
        LOG.handle(logging.makeLogRecord(line))
    if answer.error is not None:
        raise answer.error
    LOG.info(f"{label}: done on {answer.host}")
    return True


def solve(order: Order) -> None:
    """Solve a job, going on from what its file holds, and seal the file; runs in any process."""
    begin(order.sealed, order.file, order.analysis.record)
    with JobJournal(order.file, order.analysis.record) as journal:
        journal.forget(ASIDE)
        solve_job(order.analysis, order.job, journal, order.checks)
        journal.seal()
    clear(order.sealed)


def solve_job(asked: Analysis, job: Job, journal: JobJournal, checks: frozenset[str]) -> None:
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


def _watched_here(
    order: Order, cell: Callable[[], AbstractContextManager[Cell]], stopped: Callable[[], bool]
) -> None:
    with cell() as own:
        watched(order, own, stopped, LOG.handle)


def watched(
    order: Order,
    cell: Cell,
    stopped: Callable[[], bool],
    hear: Callable[[logging.LogRecord], object],
) -> None:
    """Solve a job in a process of its own; set it aside where that takes too long, or ends twice at the same place."""
    last, deaths = (-1, -1), 0
    while True:
        try:
            cell.answer(solve, order, order.limits, stopped, hear)
        except Stopped:
            raise
        except OutOfTime as ended:
            return set_aside(order, str(ended))
        except Ended as ended:
            place = _progress(order)
            deaths = deaths + 1 if place == last else 1
            if deaths == TWICE:
                return set_aside(order, f"its process {ended}, twice at the same place")
            last = place
            hear(_line(f"{order.job.label}: its process {ended}; it is started again"))
        else:
            return None


def set_aside(order: Order, why: str) -> None:
    """Seal a job as it is, with the reason; the next run goes on with it."""
    with JobJournal(order.file, order.analysis.record) as journal:
        words = order.analysis.name.replace("_", " ")
        journal.put(ASIDE, {"text": f"{words} was set aside: {why}"})
        journal.seal()
    clear(order.sealed)


def solve_far(
    order: Order, token: Path, versions: dict[str, str], threads: dict[str, str]
) -> Answer:
    """Solve a job on another machine, in a file of this attempt alone; end when the run has ended."""
    lines: list[dict[str, Any]] = []
    host = socket.gethostname()
    own = replace(order, owner=new_owner())
    try:
        _refuse_stranger(token, versions, host)
        with closing(Cell(threads)) as cell:
            watched(own, cell, _over(token), lambda record: _keep(record, lines))
    except Exception as error:  # noqa: BLE001  it is raised where the run is
        error.__traceback__ = None
        return Answer(host, lines, error)
    return Answer(host, lines)


def _refuse_stranger(token: Path, versions: dict[str, str], host: str) -> None:
    """Refuse a machine that would give other numbers, or does not see the folder."""
    if not token.exists():
        raise StickslipError(
            f"the worker on {host} does not see {token.parent}. Put the study into a folder that all machines share, under the "
            "same name."
        )
    own = library_versions()
    unlike = [f"{k} {own[k]} for {v}" for k, v in versions.items() if own[k] != v]
    if unlike:
        raise StickslipError(
            f"the worker on {host} has other versions, whose numbers may differ: {', '.join(unlike)}. Install the same."
        )


def _over(token: Path) -> Callable[[], bool]:
    """Return what says whether the run has ended: its token is gone, twice, as a shared folder may be slow."""
    looked, missed = [monotonic()], [0]

    def over() -> bool:
        if monotonic() - looked[0] >= ON:
            looked[0] = monotonic()
            missed[0] = 0 if token.exists() else missed[0] + 1
        return missed[0] > 1

    return over


def _keep(record: logging.LogRecord, lines: list[dict[str, Any]]) -> None:
    """Keep a line for the way back; progress is of no use then."""
    if not hasattr(record, "fraction"):
        more = {key: vars(record)[key] for key in OF_RECORDS if key in vars(record)}
        own = {"name": record.name, "levelno": record.levelno, "levelname": record.levelname}
        lines.append({**own, **more, "msg": record.getMessage()})


def _line(text: str) -> logging.LogRecord:
    return logging.LogRecord(LOG.name, logging.INFO, "", 0, text, None, None)


def _progress(order: Order) -> tuple[int, int]:
    """Return how many records and notes the file of a job at work holds."""
    with JobJournal(order.file, order.analysis.record) as journal:
        return len(journal.records()), len(journal.notes())
