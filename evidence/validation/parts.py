"""The parts of ``make validate``, each of which ends within half an hour on two quiet cores (mutants once which tests reach what is recorded).

    python -m evidence.validation.parts                    # all
    python -m evidence.validation.parts faults kernels     # some
    python -m evidence.validation.parts tests --fresh      # what has run on these sources, too

A part is made of pieces: a module of comparisons, a file of tests, a kernel. Each piece that ends writes
``evidence/validation/out/parts/PART/PIECE.json``: when it ran, on which commit, and its counts; then the page
``docs/validation_run.md`` is made anew. A part that was stopped goes on with the pieces that are left: one that has failed, or has run
on other files than those of the last commit, runs again. What has run nowhere in this folder keeps its line on the page.
"""

import argparse
import json
import multiprocessing
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from time import monotonic

from evidence import kernels
from evidence.pytest_run import ROOT, counted
from evidence.suite import Record, console
from evidence.validation.__main__ import SUITE

OUT = Path(__file__).parent / "out"
PAGE = ROOT / "docs" / "validation_run.md"
# comparisons with time integration and with many more harmonics, which take the longest
IN_TIME = (
    "case_b3_blade_with_damper",
    "case_b6_blade_damper_blade",
    "case_few_harmonics",
    "case_laws_in_time",
    "case_shipped_example",
    "case_shooting",
    "case_stability",
    "case_three_ways",
    "case_two_blades",
)


MUTANTS = 20  # drawn, of the day's seed
NOTICED = re.compile(r"^all: (\d+) of (\d+) noticed", re.MULTILINE)


FAULTS = ("kills", "disk", "memory", "test_damaged_files", "test_damaged_results")
MARK = "mark.validation"
HEADINGS = "| part | what it compares | pieces | date | commit | hold | fail | left out | minutes |"


@dataclass(frozen=True)
class Piece:
    """Some comparisons that run together.

    Attributes
    ----------
    name
        Unique in its part; a name of a file.
    run
        Runs them with a number of workers and returns their counts.
    files
        Beside ``src``: a change of one of them makes it run again.
    """

    name: str
    run: Callable[[int], Counter[str]]
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class Part:
    """Some of the comparisons.

    Attributes
    ----------
    about
        What they are of.
    pieces
        Returns their pieces.
    whole
        Whether a piece uses all workers; else each takes one.
    notes
        Returns what the page says of the machine.
    """

    about: str
    pieces: Callable[[], list[Piece]]
    whole: bool = False
    notes: Callable[[], list[str]] = list


@dataclass(frozen=True)
class Ran:
    """A piece that has run: when, on which commit and files, for how long, and how many of its comparisons hold."""

    name: str
    date: str
    commit: str
    files: str
    minutes: float
    passed: int
    failed: int
    left_out: int


def _slow_tests() -> list[Piece]:
    found = []
    for path in sorted((ROOT / "tests").glob("test_*.py")):
        if path.name != "test_faults.py" and MARK in path.read_text(encoding="utf-8"):
            file = f"tests/{path.name}"
            found.append(Piece(path.stem, partial(_tests, file, ""), (file,)))
    return found


def _faults() -> list[Piece]:
    files = ("tests/test_faults.py", "tests/fault_readers.py", "tests/fault_commands.py")
    return [Piece(word, partial(_tests, files[0], word), files) for word in FAULTS]


def _tests(file: str, word: str, _workers: int) -> Counter[str]:
    # 200 kills and 20,000 damaged files last longer than the ten minutes after which the gate takes a test for hanging
    limit = ("-o", "faulthandler_timeout=3600")
    return counted(["-m", "validation", *limit, *(("-k", word) if word else ()), file])


def _comparisons(names: Iterable[str]) -> list[Piece]:
    return [Piece(name, partial(_compared, name), (f"evidence/validation/{name}.py",)) for name in names]


def _compared(name: str, _workers: int) -> Counter[str]:
    """Run a module of comparisons in a process of its own, and keep its records for the page of all."""
    folder = OUT / "records"
    folder.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        found = pool.submit(SUITE.records, name).result()
    text = json.dumps(found, indent=1, default=lambda number: number.item())
    (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    console().print(SUITE.table(found))
    every = [record for name in SUITE.names() for record in _kept(folder / f"{name}.json")]
    (OUT / "results.json").write_text(json.dumps(every, indent=1) + "\n", encoding="utf-8")
    words = {True: "passed", False: "failed"}
    return Counter(words.get(record["holds"], "left_out") for record in found)


def _kept(path: Path) -> list[Record]:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def _literature() -> list[Piece]:
    return _comparisons(name for name in SUITE.names() if name not in IN_TIME)


def _in_time() -> list[Piece]:
    return _comparisons(IN_TIME)


def _kernels() -> list[Piece]:
    return [Piece(name, run, ("tests",)) for name, run in kernels.pieces()]


def _mutants() -> list[Piece]:
    return [Piece("drawn", _drawn, ("tests", "evidence/mutants"))]


def _drawn(workers: int) -> Counter[str]:
    """Draw mutants; where enough are noticed, those that survive count as left out for a person to judge, else as failures."""
    command = [
        sys.executable,
        "-m",
        "evidence.mutants",
        "--n",
        str(MUTANTS),
        "--seed",
        f"{datetime.now(UTC):%Y%m%d}",
        "--workers",
        str(workers),
    ]
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
    "kernels": Part(
        "numeric tests on every LAPACK kernel, one and two threads", _kernels, whole=True, notes=kernels.told
    ),
    "literature": Part("closed forms, other programs, the literature", _literature),
    "in-time": Part("time integration and many harmonics", _in_time),
    "mutants": Part("one-point changes of the library that a test has to notice", _mutants, whole=True),
}


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def commit() -> str:
    """Return the commit at work, with a plus where files differ from it."""
    page = f":!{PAGE.relative_to(ROOT)}"
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", page)
    return _git("rev-parse", "--short=8", "HEAD") + "+" * bool(changed)


def _files(piece: Piece) -> str:
    """Return what stands for the content of a piece's files at the last commit."""
    ids = _git("rev-parse", *(f"HEAD:{name}" for name in ("src", *piece.files))).split()
    return "-".join(word[:8] for word in ids)


def _path(part: str, piece: str) -> Path:
    return OUT / "parts" / part / f"{piece}.json"


def _ran(part: str, piece: str) -> Ran | None:
    path = _path(part, piece)
    return Ran(**json.loads(path.read_text(encoding="utf-8"))) if path.exists() else None


def _done(part: str, piece: Piece) -> bool:
    """Whether a piece has run on the files of the last commit, and all of it holds."""
    one = _ran(part, piece.name)
    return one is not None and not one.failed and one.commit[-1] != "+" and one.files == _files(piece)


def _run(part: str, workers: int, piece: Piece) -> None:
    """Run a piece, and write down how it went."""
    began, date, at, files = monotonic(), f"{datetime.now(UTC):%Y-%m-%d}", commit(), _files(piece)
    found = piece.run(workers)
    minutes = round((monotonic() - began) / 60.0, 2)
    one = Ran(piece.name, date, at, files, minutes, found["passed"], found["failed"], found["left_out"])
    path = _path(part, piece.name)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(asdict(one)) + "\n", encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")


def run(name: str, workers: int, *, fresh: bool = False) -> list[Ran]:
    """Run what is left of a part and return its pieces; all of it if `fresh`."""
    part = PARTS[name]
    pieces = part.pieces()
    left = [piece for piece in pieces if fresh or not _done(name, piece)]
    print(f"--- {name}: {len(left)} of {len(pieces)} pieces are left", flush=True)
    at_once, each = (1, workers) if part.whole else (workers, 1)
    with ThreadPoolExecutor(at_once) as pool:
        list(pool.map(partial(_run, name, each), left))
    return _pieces(name)


def _pieces(name: str) -> list[Ran]:
    found = (_ran(name, piece.name) for piece in PARTS[name].pieces())
    return [one for one in found if one is not None]


def page() -> str:
    """Return the page of the last run of each part, of what its pieces have written; a part without any keeps its line."""
    before = PAGE.read_text(encoding="utf-8").splitlines() if PAGE.exists() else []
    lines = [
        "# Last run of the validation",
        "",
        "`make validate` writes this page; a part alone, such as `make validate-faults`, renews its own row. A part is made of pieces, and one",
        "that is stopped goes on with those that are left. A plus behind a commit says that files differed from it; minutes are those of",
        "all pieces, one after the other. What every comparison gave is the table of {doc}`validation`.",
        "",
        HEADINGS,
        "|---" * HEADINGS.count(" | ") + "|---|",
    ]
    notes = []
    for name, part in PARTS.items():
        found = _pieces(name)
        own = [f"- `{name}`: {text}." for text in part.notes()] if found else []
        notes += own or [line for line in before if line.startswith(f"- `{name}`: ")]
        old = [line for line in before if line.startswith(f"| `{name}` |")]
        lines.append(_row(part, name, found) if found else (old or [_empty(name, part)])[0])
    return "\n".join([*lines, *([""] if notes else []), *notes]) + "\n"


def _row(part: Part, name: str, found: Sequence[Ran]) -> str:
    dates, commits = ([getattr(one, key) for one in found] for key in ("date", "commit"))
    counts = (sum(getattr(one, key) for one in found) for key in ("passed", "failed", "left_out"))
    cells = [
        f"{len(found)} of {len(part.pieces())}",
        " to ".join(sorted({min(dates), max(dates)})),
        ", ".join(f"`{at}`" for at in dict.fromkeys(commits)),
        *map(str, counts),
        f"{sum(one.minutes for one in found):.1f}",
    ]
    return f"| `{name}` | {part.about} | " + " | ".join(cells) + " |"


def _empty(name: str, part: Part) -> str:
    return f"| `{name}` | {part.about} | has not run |" + " |" * (HEADINGS.count(" | ") - 2)


def main() -> int:
    """Run what the command line asks for, and end with a line for each part; 1 if anything fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--fresh", action="store_true", help="run pieces that have run, too")
    options = parser.parse_args()
    unknown = set(options.parts) - PARTS.keys()
    if unknown:
        parser.error(f"no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    names = [name for name in PARTS if name in (options.parts or PARTS)]
    failed = 0
    for name, pieces in [(name, run(name, options.workers, fresh=options.fresh)) for name in names]:
        for one in pieces:
            if one.failed:
                print(f"{name}, {one.name}: {one.failed} fail")
        failed += sum(one.failed for one in pieces)
        print(f"{name}: {sum(one.passed for one in pieces)} hold, {sum(one.failed for one in pieces)} fail")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
