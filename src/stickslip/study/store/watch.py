"""Supervision of job processes, on this machine or another."""

import logging
import pickle
import socket
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic
from typing import Any

from stickslip.errors import StickslipError
from stickslip.study.own_code import Shipped
from stickslip.study.store.journal import JobJournal, clear, file_at_work, new_owner, until_sealed_elsewhere
from stickslip.study.store.progress import LOG, OF_RECORDS
from stickslip.study.store.provenance import library_versions
from stickslip.study.store.worker_process import Cell, Ended, Limits, OutOfTime, Stopped

ASIDE = "set aside"  # name of the note in a job that was set aside
TWICE = 2  # abnormal ends of a job's process without progress, after which the job is set aside
ON = 1.0  # seconds between two checks whether the run continues
UNKNOWN = (ImportError, AttributeError, pickle.PicklingError)  # errors if the worker lacks a module of the job


@dataclass(frozen=True, eq=False)
class Parcel:
    """A pickled job; only the process that solves it unpacks it.

    Parameters
    ----------
    content
        The job and the function that solves it; pickled.
    sealed
        File of the finished job.
    label
        Name of the job in the log.
    question
        Name of its analysis in words.
    limits
        Limits on time and memory.
    owner
        Process that owns the file of the running job; empty: only one process writes it.
    code
        User's code that the job needs; None for none.
    """

    content: bytes
    sealed: Path
    label: str
    question: str
    limits: Limits
    owner: str = ""
    code: Shipped | None = None

    @property
    def file(self) -> Path:
        """File of the running job."""
        return file_at_work(self.sealed, self.owner)


@dataclass(frozen=True, eq=False)
class Answer:
    """Reply of another machine: log lines of the job, and its exception."""

    host: str
    lines: list[dict[str, Any]]
    error: Exception | None = None


def watched(
    parcel: Parcel, cell: Cell, stopped: Callable[[], bool], hear: Callable[[logging.LogRecord], object]
) -> None:
    """Solve a job in its own process. Set it aside if it takes too long, or if its process dies twice without progress."""
    with until_sealed_elsewhere(parcel.sealed, parcel.file):
        while True:
            try:
                cell.answer(unpacked, parcel, parcel.limits, stopped, hear)
            except Stopped:
                raise
            except OutOfTime as ended:
                return set_aside(parcel, str(ended))
            except Ended as ended:
                # the count is kept in the file, since this worker may be lost, too
                with JobJournal(parcel.file) as journal:
                    deaths = journal.died()
                if deaths >= TWICE:
                    return set_aside(parcel, f"its process {ended}, twice at the same place")
                hear(_line(f"{parcel.label}: its process {ended}; it is started again"))
            else:
                return None


def unpacked(parcel: Parcel) -> None:
    """Unpack and solve a job, in the job's own process."""
    if parcel.code is not None:
        parcel.code.importable()
    try:
        solve, order = pickle.loads(parcel.content)
    except UNKNOWN as error:
        raise unknown(parcel.label, error) from None
    solve(order, parcel.file)


def unknown(label: str, error: Exception) -> StickslipError:
    """Return the error for a job that a worker cannot unpack."""
    return StickslipError(
        f"a worker cannot take {label}: {error}. The same versions of stickslip and of modules of your own have to be "
        "installed where workers run."
    )


def set_aside(parcel: Parcel, why: str) -> None:
    """Seal an unfinished job with the reason; the next run continues it."""
    with until_sealed_elsewhere(parcel.sealed, parcel.file), JobJournal(parcel.file) as journal:
        journal.put(ASIDE, {"text": f"the {parcel.question} job was set aside: {why}"})
        journal.seal()
    clear(parcel.sealed)


def solve_far(parcel: Parcel, token: Path, versions: dict[str, str], threads: dict[str, str]) -> Answer:
    """Solve a job on another machine, in a file of this attempt only; stop when the run has ended."""
    lines: list[dict[str, Any]] = []
    host = socket.gethostname()
    own = replace(parcel, owner=new_owner())
    try:
        _refuse_stranger(token, versions, host)
        with closing(Cell(threads)) as cell:
            watched(own, cell, _over(token), lambda record: _keep(record, lines))
    except Exception as error:  # noqa: BLE001  it is raised on the machine of the run
        error.__traceback__ = None
        return Answer(host, lines, error)
    return Answer(host, lines)


def _refuse_stranger(token: Path, versions: dict[str, str], host: str) -> None:
    """Refuse a machine with other library versions, or without access to the folder."""
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
    """Return a function that tells whether the run has ended: its token is missing twice, since a shared folder may be slow."""
    looked, missed = [monotonic()], [0]

    def over() -> bool:
        if monotonic() - looked[0] >= ON:
            looked[0] = monotonic()
            missed[0] = 0 if token.exists() else missed[0] + 1
        return missed[0] > 1

    return over


def _keep(record: logging.LogRecord, lines: list[dict[str, Any]]) -> None:
    """Store a log line for the reply; progress records are dropped."""
    if not hasattr(record, "fraction"):
        more = {key: vars(record)[key] for key in OF_RECORDS if key in vars(record)}
        own = {"name": record.name, "levelno": record.levelno, "levelname": record.levelname}
        lines.append({**own, **more, "msg": record.getMessage()})


def _line(text: str) -> logging.LogRecord:
    return logging.LogRecord(LOG.name, logging.INFO, "", 0, text, None, None)
