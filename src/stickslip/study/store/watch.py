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
from stickslip.study.store.attempts import clear, file_at_work, new_owner, until_sealed_elsewhere
from stickslip.study.store.journal import JobJournal
from stickslip.study.store.progress import LOG, OF_RECORDS
from stickslip.study.store.provenance import library_versions
from stickslip.study.store.worker_process import Cell, Ended, Limits, OutOfTime, Stopped

ASIDE = "set aside"  # the note of a job that was
TWICE = 2  # deaths of a job's process at the same place, after which it is set aside
ON = 1.0  # seconds between two looks whether the run is still on
UNKNOWN = (ImportError, AttributeError, pickle.PicklingError)  # what is not installed there


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
        Owner of the file at work; empty: no other process may write it.
    code
        Code of the user that the job needs; None for none.
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
        """File of the job at work."""
        return file_at_work(self.sealed, self.owner)


@dataclass(frozen=True, eq=False)
class Answer:
    """Reply of another machine: the log lines of the job, and the exception it raised."""

    host: str
    lines: list[dict[str, Any]]
    error: Exception | None = None


def watched(
    parcel: Parcel, cell: Cell, stopped: Callable[[], bool], hear: Callable[[logging.LogRecord], object]
) -> None:
    """Solve a job in a process of its own. Set it aside if it takes too long, or if its process dies twice at the same place."""
    with until_sealed_elsewhere(parcel.sealed, parcel.file):
        while True:
            try:
                cell.answer(unpacked, parcel, parcel.limits, stopped, hear)
            except Stopped:
                raise
            except OutOfTime as ended:
                return set_aside(parcel, str(ended))
            except Ended as ended:
                # kept in its file: the worker may be lost before it ends again
                with JobJournal(parcel.file) as journal:
                    deaths = journal.died()
                if deaths >= TWICE:
                    return set_aside(parcel, f"its process {ended}, twice at the same place")
                hear(_line(f"{parcel.label}: its process {ended}; it is started again"))
            else:
                return None


def unpacked(parcel: Parcel) -> None:
    """Unpack and solve a job; runs in the job's own process."""
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
    """Solve a job on another machine, in a file used by this attempt only; stop when the run has ended."""
    lines: list[dict[str, Any]] = []
    host = socket.gethostname()
    own = replace(parcel, owner=new_owner())
    try:
        _refuse_stranger(token, versions, host)
        with closing(Cell(threads)) as cell:
            watched(own, cell, _over(token), lambda record: _keep(record, lines))
    except Exception as error:  # noqa: BLE001  it is raised where the run is
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
    """Return a function that says whether the run has ended: its token is missing twice, since a shared folder may be slow."""
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
