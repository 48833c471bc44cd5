"""Several attempts at one job: each process has its own journal, and the one with most progress counts.

No lock is needed, so this works on shared folders with unreliable locks. Two processes get exactly the same results for a job, so
either may seal it.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from stickslip.errors import InputError
from stickslip.study.store.journal import AT_WORK, BESIDE, JobJournal, read_place
from stickslip.study.store.progress import LOG


def file_at_work(sealed: Path, owner: str = "") -> Path:
    """Return the name of the file of a running job: ``KEY.part``, or ``KEY.OWNER.part``."""
    return sealed.with_suffix(f".{owner}{AT_WORK}" if owner else AT_WORK)


def new_owner() -> str:
    """Return a unique name for this process."""
    return uuid4().hex[:12]


def left_behind(sealed: Path) -> list[Path]:
    """Return all files of a running job, the one with most progress first."""
    found = [p for p in sealed.parent.glob(f"{sealed.stem}.*") if p.suffix == AT_WORK]
    return sorted(found, key=reached, reverse=True)


def reached(path: Path) -> tuple[int, int, int]:
    """Return the progress of a file: its size, its number of records (small records may not change the size), and deaths."""
    return (_size(path), *read_place(path))


def begin(sealed: Path, own: Path, record: type) -> None:
    """Create the file of a running job as a copy of the existing one with most progress, of any process."""
    for path in sorted([*left_behind(sealed), sealed], key=reached, reverse=True):
        if path == own or reached(path) <= reached(own):
            return
        if _copied(path, own, record):
            return


@contextmanager
def until_sealed_elsewhere(sealed: Path, own: Path) -> Iterator[None]:
    """End an attempt without an error when another process seals the job first and removes this attempt's file."""
    try:
        yield
    except InputError:
        if own.exists() or not sealed.exists():
            raise
        LOG.info(f"{sealed.stem[:12]}: another process has finished this job")
        clear(sealed)


def clear(sealed: Path) -> None:
    """Remove all files left by the attempts at a sealed job; files already removed by another process are ignored."""
    for end in (AT_WORK, f"{AT_WORK}{BESIDE}"):
        for file in sealed.parent.glob(f"{sealed.stem}.*{end.removeprefix('.')}"):
            with suppress(OSError):  # the next run in the folder removes it
                file.unlink(missing_ok=True)


def _copied(path: Path, own: Path, record: type) -> bool:
    """Copy a file to which another process may be writing; return whether the copy is valid."""
    copy = file_at_work(own.with_name(own.name.partition(".")[0]), new_owner())
    try:
        # with the rollback journal, SQLite undoes incomplete writes in the copy
        with suppress(FileNotFoundError):
            shutil.copyfile(f"{path}{BESIDE}", f"{copy}{BESIDE}")
        shutil.copyfile(path, copy)
        with JobJournal(copy, record) as journal:
            journal.check()
        copy.replace(own)
    except (OSError, InputError) as error:
        LOG.info(f"{path} is passed over ({error})")
        for file in (copy, Path(f"{copy}{BESIDE}")):
            file.unlink(missing_ok=True)
        return False
    return True


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return -1
