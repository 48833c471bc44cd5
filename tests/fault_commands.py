"""Stops commands in every way, in a process of its own that forks them: ``python fault_commands.py HOW FOLDER SEED COUNT``.

``kills`` kills them at random moments; ``disk`` lets no file grow beyond a size; ``memory`` allows little of it. Whatever
happens, files are whole, what is said is one line or more without a traceback, and the same command later gives the same bits.
A line a failure goes to the output.
"""

import os
import resource
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from small_v2 import write_four_masses
from test_readers_matrices import DATA

from stickslip import cli
from stickslip.api.result import Result
from stickslip.api.study import Study
from stickslip.errors import InputError
from stickslip.study.file.example import example_text
from stickslip.study.store import folder as keep

FORCES = (5.0, 8.0)  # N, of the cases
CHANGES = {
    "modes.number": "2",
    "forced_response.points": "4",
    "forced_response.peak_points": "0",
    "harmonics.high": "3",
    "harmonics.samples": "64",
}
AT_WORK = "another run is at work"
PATIENCE = 60.0  # s, for one command
LATEST = 1.3  # of the time that a command takes, at which it is killed
LEAST_SHARE = 20  # kills, between which at least one run ends by itself and is compared


@dataclass(frozen=True)
class Ended:
    """A command that has ended: exit code, None where it was killed; what it said; seconds."""

    code: int | None
    said: str
    seconds: float


def command(
    words: list[str], *, after: float = PATIENCE, group: bool = True, limit: Callable[[], None] | None = None
) -> Ended:
    """Run a command in a fork of this process, which has loaded everything; kill it after some seconds."""
    began = time.perf_counter()
    ours, theirs = os.pipe()  # a file would have the limits of the command; 64 kB are more than any says
    pid = os.fork()
    if pid == 0:
        _be(words, theirs, limit)
    os.close(theirs)
    code = None
    while code is None and time.perf_counter() - began < after:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            code = os.waitstatus_to_exitcode(status)
        else:
            time.sleep(0.002)
    if code is None:
        with suppress(ProcessLookupError):  # has not left our group yet
            os.killpg(pid, signal.SIGKILL) if group else None
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    os.set_blocking(ours, False)
    with os.fdopen(ours, "rb") as stream:
        said = stream.read() or b""
    return Ended(code, said.decode(errors="replace"), time.perf_counter() - began)


def _be(words: list[str], out: int, limit: Callable[[], None] | None) -> None:
    """Be the command; does not return."""
    code = 70
    try:
        os.setsid()
        os.dup2(out, 1)
        os.dup2(out, 2)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w", errors="backslashreplace")
        sys.argv = ["stickslip", *words]
        if limit is not None:
            limit()
        cli.main()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 0
    except BaseException:  # noqa: BLE001  told as a failure
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


class Trial:
    """A study, its right result, and what was found wrong."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.rng = folder, np.random.default_rng(seed)
        self.study = _study(folder / "study", FORCES)
        self.results = self.study.parent / "results"
        self.wrong: list[str] = []
        # everything is loaded and compiled before the first fork; a verification settles doubts, and so there are two right answers
        self.right: dict[tuple[str, ...], tuple[xr.DataTree, xr.DataTree]] = {}
        for forces in ((FORCES[0],), (FORCES[1],), FORCES):
            right = Study.from_file(_study(folder / "right" / str(len(self.right)), forces))
            plain, verified = right.run().data, right.run(verify_harmonics=True).data
            self.right[_labels(verified["forced_response"])] = plain, verified
        self.every = _labels(verified["forced_response"])
        Result(verified).report(folder / "right.html")

    def fail(self, what: str) -> None:
        self.wrong.append(what)
        print(what, flush=True)

    def same(self, what: str, asked: tuple[str, ...] = ("forced_response", "modes")) -> None:
        """Compare the result, which must be complete, with the right one, to the last bit.

        It has all cases of the analyses that were `asked` for, and of the others those that earlier commands finished.
        """
        found = Result.from_file(self.results).data
        if found.attrs["complete"] != 1:
            self.fail(f"{what}: the result is not complete")
        for name in {*asked, *found.children}:
            if name not in found.children:
                self.fail(f"{what}: {name} is missing")
                continue
            labels = _labels(found[name])
            if name in asked and labels != self.every:
                self.fail(f"{what}: {name} has the cases {labels} of {self.every}")
            plain, verified = self.right[labels]
            for key in found[name].data_vars:
                right = (plain, verified) if "verdict" in str(key) else (verified,)
                if not any(same_bits(found[name][key], one[name][key]) for one in right):
                    self.fail(f"{what}: {name}.{key} differs")

    def whole(self, what: str) -> None:
        """Look whether every file that is there is whole."""
        if (self.results / "result.nc").exists():
            try:
                Result.from_file(self.results)
            except InputError as error:
                self.fail(f"{what}: {error}")
        page = self.results / "report.html"
        if page.exists() and not page.read_text().rstrip().endswith("</html>"):
            self.fail(f"{what}: the page is not whole")

    def spoken(self, what: str, ended: Ended) -> None:
        """Look whether a command that ended by itself ended well, or said why not."""
        if ended.code not in (None, 0, 1, 2):
            self.fail(f"{what}: exit code {ended.code}: {ended.said[-300:]}")
        for word in ("Traceback", "This is a fault of stickslip", "Exception ignored"):
            if word in ended.said:
                self.fail(f"{what}: {ended.said[-1500:]}")
        if ended.code and not ended.said.strip():
            self.fail(f"{what}: ended with {ended.code} and no word")


def _study(folder: Path, forces: tuple[float, ...]) -> Path:
    """Write the study with a case for each force of the shaker, N."""
    return write_four_masses(folder, {**CHANGES, "vary.load.shaker.force_n": str(list(forces))})


def _labels(node: xr.DataTree) -> tuple[str, ...]:
    return tuple(map(str, node["case_label"].values))


def same_bits(a: xr.DataArray, b: xr.DataArray) -> bool:
    if "seconds" in str(a.name):
        return True
    return np.array_equal(a.values, b.values, equal_nan=a.dtype.kind in "fc")


def kills(trial: Trial, count: int) -> None:
    """Kill commands until `count` have been killed; a run that ends by itself must have the right bits."""
    study, results = str(trial.study), str(trial.results)
    deck = str(DATA / "brick_matrix.inp")
    runs = [[], ["--fresh"], ["--verify-harmonics"], ["--only", "modes"], ["--workers", "2"]]
    rest = [["report", results], ["check", study], ["inspect", deck, "--units", "mm-t-s"], ["new"]]
    long: dict[str, float] = {}
    counted: Counter[str] = Counter()
    ended_well, turn = 0, 0
    while counted.total() < count:
        turn += 1
        # a run goes on until it is whole; each time another one is stopped
        words = ["run", study, *runs[turn % len(runs)]] if trial.rng.random() < 0.75 else rest[turn % len(rest)]
        if "--workers" in words and trial.rng.random() < 0.5:
            words = [*words, "--fresh"]
        fresh = words == ["new"]
        if fresh:
            words = ["new", str(trial.folder / f"new{turn}"), "--kind", "masses"]
        name = " ".join(w for w in words if "/" not in w)
        # the first of each kind goes to its end and tells how long this machine takes
        after = float(trial.rng.uniform(0, LATEST * long[name])) if name in long else PATIENCE
        ended = command(words, after=after, group=bool(trial.rng.random() < 0.7))
        if ended.code is None:
            counted[name] += 1
        elif ended.code == 0:
            long[name] = max(long.get(name, 0.0), ended.seconds)
        trial.spoken(name, ended)
        trial.whole(name)
        made = trial.folder / f"new{turn}" / "study.toml"
        if made.exists() and made.read_text() != example_text("masses"):
            trial.fail("new: the study is not whole")
        if words[0] == "run" and ended.code == 0:
            ended_well += 1
            only = "--only" in words
            trial.same(name, ("modes",) if only else ("forced_response", "modes"))
        elif words[0] == "run" and ended.code and AT_WORK not in ended.said:
            trial.fail(f"{name}: {ended.said[-500:]}")
    last = _patient(trial, ["run", study])
    trial.spoken("the last run", last)
    trial.same("the last run")
    if ended_well < count // LEAST_SHARE:
        trial.fail(f"{ended_well} runs ended between {count} kills: too few were compared")
    print(dict(counted), f"runs that ended between: {ended_well}")


def _patient(trial: Trial, words: list[str]) -> Ended:
    """Run a command, waiting for workers that outlive the run that was killed."""
    for _ in range(20):
        ended = command(words)
        if AT_WORK not in ended.said:
            break
        time.sleep(1.0)
    return ended


def limited(trial: Trial, count: int, what: int, sizes: list[int]) -> None:
    """Run commands with less and less of something; then the same without a limit."""
    study, results = str(trial.study), str(trial.results)
    counted: Counter[int | None] = Counter()
    for k in range(count):
        size = sizes[k % len(sizes)]
        size = int(size * trial.rng.uniform(0.5, 2.0))

        def limit(size: int = size) -> None:
            base = _loaded() if what == resource.RLIMIT_AS else 0
            resource.setrlimit(what, (base + size, base + size))
            keep.NEEDED_BYTES = 0

        words = [["run", study, "--fresh"], ["run", study], ["report", results], ["check", study]][k % 4]
        ended = command(words, limit=limit)
        counted[ended.code] += 1
        name = f"{words[0]} with {size} bytes"
        trial.spoken(name, ended)
        trial.whole(name)
        if words[0] == "run" and k % 2 == 0:
            again = _patient(trial, ["run", study])
            trial.spoken(f"after {name}", again)
            trial.same(f"after {name}")
    print(f"exit codes: {dict(counted)}")


def _loaded() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def main(how: str, folder: Path, seed: int, count: int) -> None:
    trial = Trial(folder, seed)
    if how == "kills":
        kills(trial, count)
    elif how == "disk":
        limited(trial, count, resource.RLIMIT_FSIZE, [0, 500, 5000, 20_000, 100_000, 400_000, 2_000_000])
    else:
        limited(trial, count, resource.RLIMIT_AS, [0, 10**6, 10**7, 3 * 10**7, 10**8])
    print(f"{count} {how}, {len(trial.wrong)} failures", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]))
