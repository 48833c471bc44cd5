"""The parts of ``make validate``, each of which ends within half an hour on two quiet cores (mutants once which tests reach what is recorded).

    python -m evidence.validation.parts                    # all
    python -m evidence.validation.parts faults kernels     # some

A part writes ``evidence/validation/out/parts/NAME.json``: when it ran, on which commit, and its counts. After each the page
``docs/validation_run.md`` is made anew of what all parts have written.
"""

import argparse
import json
import multiprocessing
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic

from evidence import kernels
from evidence.pytest_run import ROOT, counted
from evidence.suite import Record, console
from evidence.validation.__main__ import SUITE

OUT = Path(__file__).parent / "out"
PAGE = ROOT / "docs" / "validation_run.md"
FAULTS = sorted(ROOT.glob("tests/test_fault*.py"))
# comparisons with time integration and with many more harmonics, which take the longest
IN_TIME = (
    "case_b3_blade_with_damper", "case_b6_blade_damper_blade", "case_few_harmonics", "case_laws_in_time", "case_shipped_example",
    "case_shooting", "case_stability", "case_three_ways", "case_two_blades",
)  # fmt: skip


MUTANTS = 20  # drawn, of the day's seed
NOTICED = re.compile(r"^all: (\d+) of (\d+) noticed", re.MULTILINE)


@dataclass(frozen=True)
class Part:
    """Some of the comparisons: what they are of, and what runs them with a number of workers and returns their counts."""

    about: str
    run: Callable[[int], Counter[str]]


@dataclass(frozen=True)
class Ran:
    """A part that has run: when, on which commit, for how long, and how many of its comparisons hold."""

    name: str
    date: str
    commit: str
    minutes: float
    passed: int
    failed: int
    left_out: int


def _slow_tests(workers: int) -> Counter[str]:
    ignored = (f"--ignore={path}" for path in FAULTS)
    return counted(["-n", workers, "-m", "validation", *ignored])


def _faults(workers: int) -> Counter[str]:
    return counted(["-n", workers, "-m", "validation", *FAULTS])


def _comparisons(names: Sequence[str], workers: int) -> Counter[str]:
    """Run modules of comparisons, a process each, and keep their records for the page of all."""
    folder = OUT / "records"
    folder.mkdir(parents=True, exist_ok=True)
    found: list[Record] = []
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, max_tasks_per_child=1) as pool:
        for name, records in zip(names, pool.map(SUITE.records, names), strict=True):
            text = json.dumps(records, indent=1, default=lambda number: number.item())
            (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")
            found += records
            console().print(SUITE.table(records))
    failed = [record for record in found if record["holds"] is False]
    if failed:
        console().print(SUITE.table(failed), style="bold")
    every = [record for name in SUITE.names() for record in _kept(folder / f"{name}.json")]
    (OUT / "results.json").write_text(json.dumps(every, indent=1) + "\n", encoding="utf-8")
    holding = sum(record["holds"] is True for record in found)
    left_out = len(found) - holding - len(failed)
    return Counter(passed=holding, failed=len(failed), left_out=left_out)


def _kept(path: Path) -> list[Record]:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def _literature(workers: int) -> Counter[str]:
    return _comparisons([name for name in SUITE.names() if name not in IN_TIME], workers)


def _in_time(workers: int) -> Counter[str]:
    return _comparisons(IN_TIME, workers)


def _mutants(workers: int) -> Counter[str]:
    """Draw mutants; where enough are noticed, those that survive count as left out for a person to judge, else as failures."""
    command = [sys.executable, "-m", "evidence.mutants", "--n", str(MUTANTS), "--seed", f"{datetime.now(UTC):%Y%m%d}", "--workers", str(workers)]  # fmt: skip
    ended = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    print(ended.stdout, flush=True)
    said = NOTICED.search(ended.stdout)
    if said is None:
        return Counter(failed=1)
    noticed, drawn = map(int, said.groups())
    lost = "failed" if ended.returncode else "left_out"
    return Counter({"passed": noticed, lost: drawn - noticed})


PARTS = {
    "tests": Part("slow tests, faults apart", _slow_tests),
    "faults": Part("damaged files, kills, full disks, little memory", _faults),
    "kernels": Part("numeric tests on every LAPACK kernel, one and two threads", kernels.run),
    "literature": Part("closed forms, other programs, the literature", _literature),
    "in-time": Part("time integration and many harmonics", _in_time),
    "mutants": Part("one-point changes of the library that a test has to notice", _mutants),
}


def commit() -> str:
    """Return the commit at work, with a plus where files differ from it."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()  # fmt: skip

    changed = git(
        "status", "--porcelain", "--untracked-files=no", "--", ".", f":!{PAGE.relative_to(ROOT)}"
    )
    return git("rev-parse", "--short=8", "HEAD") + "+" * bool(changed)


def ran(name: str, workers: int) -> Ran:
    """Run a part, and write down how it went."""
    began, date, at = monotonic(), f"{datetime.now(UTC):%Y-%m-%d}", commit()
    found = PARTS[name].run(workers)
    minutes = round((monotonic() - began) / 60.0, 1)
    one = Ran(name, date, at, minutes, found["passed"], found["failed"], found["left_out"])
    path = OUT / "parts" / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(asdict(one)) + "\n", encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")
    return one


def page() -> str:
    """Return the page of the last run of each part, of what they have written."""
    lines = [
        "# Last run of the validation",
        "",
        "`make validate` writes this page; a part alone, such as `make validate-faults`, renews its own row. A plus behind a commit says that",
        "files differed from it. What every comparison gave is the table of {doc}`validation`.",
        "",
        "| part | what it compares | date | commit | hold | fail | left out | minutes |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, part in PARTS.items():
        path, cells = OUT / "parts" / f"{name}.json", ["has not run", *[""] * 5]
        if path.exists():
            one = Ran(**json.loads(path.read_text(encoding="utf-8")))
            cells = [one.date, f"`{one.commit}`", *map(str, (one.passed, one.failed, one.left_out, one.minutes))]  # fmt: skip
        lines.append(f"| `{name}` | {part.about} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Run what the command line asks for, and end with a line for each part; 1 if anything fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)  # fmt: skip
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    unknown = set(options.parts) - PARTS.keys()
    if unknown:
        parser.error(f"no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    every = [ran(name, options.workers) for name in PARTS if name in (options.parts or PARTS)]
    for one in every:
        print(
            f"{one.name}: {one.passed} hold, {one.failed} fail, {one.left_out} left out ({one.minutes} min)"
        )
    return 1 if any(one.failed for one in every) else 0


if __name__ == "__main__":
    sys.exit(main())
