"""A run that the old sources began and that was killed goes on with the new ones, from its journal, to the same result."""

import os
import shutil
import signal
import sqlite3
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path

from evidence.baseline.differences import TERMINAL, Comparison, differing_folders, ran
from evidence.baseline.studies import Example, examples
from evidence.baseline.trees import Tree

NAME = "interrupted"
STUDY = "four_masses"
SETTINGS = {
    "vary.load.shaker.force_n": [1.0, 5.0],
    "forced_response.points": 20,
    "forced_response.peak_points": 4,
}
RUN = ("run", "study.toml")
JOBS, AT_WORK, SEALED = "results/jobs", ".part", ".job"
POLLED = 0.01  # s
MAX_TIME = 300.0  # s on the clock that a run may take


def goes_on(trees: tuple[Tree, Tree], folder: Path) -> Comparison:
    """Run a study with the old tree; again, killed when half is written; let the new tree go on, and compare."""
    (known,) = (one for one in examples() if one.name == STUDY)
    example = Example(STUDY, known.settings | SETTINGS)
    work, whole = folder / NAME, folder / f"{NAME}-whole"
    example.write(work)
    seconds = ran(trees[0], RUN, work, work / TERMINAL)
    enough = _written(work) / 2
    work.rename(whole)
    example.write(work)
    if not _killed(trees[0], work, enough):
        return Comparison(NAME, [f"{STUDY} ended before it was killed: nothing was tried"], 0, seconds)
    before = arrivals(work)
    seconds += ran(trees[1], RUN, work, work / TERMINAL)
    found = not_taken_over(before, arrivals(work))
    for place in (work, whole):  # both runs write into one log, and tell which jobs are left
        (place / TERMINAL).unlink()
        (place / "results" / "run.log").unlink()
    differences, count = differing_folders(whole, work)
    for place in (work, whole):
        shutil.rmtree(place)
    return Comparison(NAME, found + differences, count, seconds)


def not_taken_over(before: Mapping[str, Sequence[str]], after: Mapping[str, Sequence[str]]) -> list[str]:
    """Return a line for each job that does not begin with the records that it had; both tell when each was written."""
    lost = [name for name, stamps in before.items() if list(after.get(name, ()))[: len(stamps)] != list(stamps)]
    return [f"job {name[:12]}: {len(before[name])} records of the killed run were not taken over" for name in lost]


def _written(folder: Path) -> int:
    """Return how many bytes the journals of a run hold."""
    return sum(size for path in (folder / JOBS).glob(f"*{SEALED}") for size in [path.stat().st_size])


def _killed(tree: Tree, folder: Path, enough: float) -> bool:
    """Begin a run and kill it once its journals hold `enough` bytes while a job is at work; return whether that was so."""
    process = subprocess.Popen(
        tree.command(RUN),
        cwd=folder,
        env=tree.environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    end = time.monotonic() + MAX_TIME
    while process.poll() is None and time.monotonic() < end:
        sizes = {path: _size(path) for path in (folder / JOBS).glob("*") if path.suffix in (AT_WORK, SEALED)}
        if sum(sizes.values()) >= enough and any(path.suffix == AT_WORK for path in sizes):
            break
        time.sleep(POLLED)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return any((folder / JOBS).glob(f"*{AT_WORK}"))


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:  # it was sealed meanwhile
        return 0


def arrivals(folder: Path) -> dict[str, list[str]]:
    """Return when each record of each job was written, by the job's key."""
    found = {}
    for path in sorted((folder / JOBS).iterdir()):
        if path.suffix in (AT_WORK, SEALED):
            with closing(sqlite3.connect(path)) as database:
                found[path.name.split(".")[0]] = [
                    row[0] for row in database.execute("select arrived from record order by id")
                ]
    return found
