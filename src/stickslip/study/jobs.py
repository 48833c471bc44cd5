"""Execution of jobs: in this process, in worker processes, on other machines. A failed job stops no other."""

import logging
import pickle
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from stickslip.errors import SingularError, StickslipError
from stickslip.study.analysis import Analysis, Job
from stickslip.study.outcome import CHECKED, UNSOLVED, checked
from stickslip.study.own_code import Shipped
from stickslip.study.store.folder import token_file
from stickslip.study.store.journal import (
    JobJournal,
    begin,
    clear,
    file_at_work,
    left_behind,
    new_owner,
    reached,
    until_sealed_elsewhere,
)
from stickslip.study.store.progress import LOG, at_work, stage
from stickslip.study.store.provenance import library_versions
from stickslip.study.store.watch import ASIDE, UNKNOWN, Answer, Parcel, set_aside, solve_far, unknown, watched
from stickslip.study.store.worker_process import Limits, blas_threads
from stickslip.study.store.workers import Hands

NO_SOLUTION = (SingularError, FloatingPointError, np.linalg.LinAlgError)
LOST = 3  # workers lost without progress, after which a job is set aside: single losses may have other causes
EARLY = 30  # the same for workers lost before they began, which is hardly the job's fault
LOOK = 5.0  # seconds between two checks of the executor
SILENCE = 60.0  # seconds of reported trouble without a finished job, after which the run ends


@dataclass(frozen=True, eq=False)
class Order:
    """A job with everything a worker needs; picklable.

    Parameters
    ----------
    analysis, job, checks
        The analysis, one of its jobs, and the requested checks.
    sealed
        File of the finished job.
    limits
        Limits on time and memory.
    owner
        Process that owns the file of the running job; empty: only one process writes it.
    code
        User's code that the job needs; None for none.
    """

    analysis: Analysis
    job: Job
    sealed: Path
    checks: frozenset[str] = frozenset()
    limits: Limits = field(default_factory=Limits)
    owner: str = ""
    code: Shipped | None = None

    @property
    def file(self) -> Path:
        """File of the running job."""
        return file_at_work(self.sealed, self.owner)

    def packed(self, owner: str = "") -> Parcel:
        """Return the job pickled for a worker."""
        question = self.analysis.name.replace("_", " ")
        told = (self.sealed, self.job.label, question, self.limits, owner or self.owner)
        return Parcel(pickle.dumps((solve, self)), *told, self.code)


@dataclass
class Loss:
    """Numbers of lost workers since a job last made progress.

    Parameters
    ----------
    begun
        Number of workers lost after they had opened a file for the job.
    early
        Number of workers lost before that.
    files
        Number of files left behind.
    furthest
        Progress of the furthest of these files.
    """

    begun: int = 0
    early: int = 0
    files: int = 0
    furthest: tuple[int, ...] = ()

    def count(self, left: Sequence[Path]) -> None:
        """Count a lost worker; `left` are the files left behind."""
        furthest = max(map(reached, left), default=())
        if furthest > self.furthest > ():
            self.begun = self.early = 0
        if len(left) > self.files:
            self.begun += 1
        else:
            self.early += 1
        self.furthest, self.files = furthest, len(left)


def worked(orders: Sequence[Order], hands: Hands, folder: Path) -> Generator[Path]:
    """Execute jobs in their order; yield the file of each job when it is sealed.

    Parameters
    ----------
    orders
        The jobs.
    hands
        The workers.
    folder
        Folder of the results.
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
    """Yield the function that submits a job."""
    if hands.cell is not None:
        yield lambda order: hands.pool.submit(_watched_here, order, hands)
    elif not hands.far:
        yield lambda order: hands.pool.submit(solve, order, order.file)
    else:
        versions, threads = library_versions(), blas_threads()
        with token_file(folder) as token:
            yield lambda order: _submitted(hands.pool, order, token, versions, threads)


def _submitted(pool: Executor, order: Order, *others: Any) -> Future[Answer]:
    parcel = order.packed()
    try:
        return pool.submit(solve_far, parcel, *others)
    except Exception as error:  # libraries raise different errors for an executor that has ended
        raise _gone(str(error)) from error


def _gone(why: str) -> StickslipError:
    return StickslipError(
        f"the executor takes no more jobs ({why}). Finished jobs are kept, and the same command continues."
    )


def _ended(future: Future[Any], order: Order, lost: dict[Path, Loss], *, far: bool) -> bool:
    """Log the lines of a job and raise its exception; return whether it has ended, False if only its worker was lost."""
    if not far:
        future.result()
        return True
    label = order.job.label
    try:
        answer: Answer = future.result()
    except UNKNOWN as error:
        raise unknown(label, error) from error
    except Exception as error:  # noqa: BLE001  each library has its own error for a lost worker
        loss = lost.setdefault(order.sealed, Loss())
        loss.count(left_behind(order.sealed))
        if loss.begun < LOST and loss.early < EARLY:
            LOG.info(f"{label}: its worker was lost ({type(error).__name__}); it is given to another")
            return False
        own = order.packed(new_owner())
        begin(own.sealed, own.file, order.analysis.record)
        set_aside(
            own,
            f"{loss.begun + loss.early} workers were lost with it at the same place ({type(error).__name__}: {error})",
        )
        return True
    for line in answer.lines:
        LOG.handle(logging.makeLogRecord(line))
    if answer.error is not None:
        raise answer.error
    LOG.info(f"{label}: done on {answer.host}")
    return True


def _watched_here(order: Order, hands: Hands) -> None:
    assert hands.cell is not None
    with hands.cell() as own:
        watched(order.packed(), own, hands.over.is_set, LOG.handle)


def solve(order: Order, file: Path) -> None:
    """Solve a job from the state in its file, and seal the file. It can run in any process."""
    begin(order.sealed, file, order.analysis.record)
    with until_sealed_elsewhere(order.sealed, file), JobJournal(file, order.analysis.record) as journal:
        journal.forget(ASIDE)
        solve_job(order.analysis, order.job, journal, order.checks)
        journal.seal()
    clear(order.sealed)


def solve_job(asked: Analysis, job: Job, journal: JobJournal, checks: frozenset[str]) -> None:
    """Append the missing records of a job to its journal."""
    done = journal.records()
    if done:
        LOG.info(f"{job.label} goes on after {len(done)} records of the earlier start")
    try:
        with at_work(job.label):
            if done:
                stage(f"going on after {len(done)} records")
            for record in asked.solve(job.inputs, done, journal):
                journal.add(record)
    except NO_SOLUTION as error:
        # a job without a solution must not stop the run
        words = asked.name.replace("_", " ")
        journal.put(UNSOLVED, {"text": f"{words} has no solution ({error})"})
    journal.put(CHECKED, {"names": sorted(checks | checked(journal.get(CHECKED)))})
