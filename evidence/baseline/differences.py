"""One example run with two trees, and what differs in the files that it writes and in what it prints."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from evidence.baseline.results import differing_results, read_nodes
from evidence.baseline.studies import Example
from evidence.baseline.texts import differing_lines, page_lines, terminal_lines
from evidence.baseline.trees import Tree

TERMINAL = "terminal.txt"
MAX_SHOWN = 30  # variables of a study that are printed
TEXTS = {".html": page_lines, ".txt": terminal_lines, ".log": terminal_lines}
# of a results folder: journals and parts hold times, and the next run of the other tree reads them
INNER = ("jobs", "parts")
LOCK = "run.lock"


@dataclass(frozen=True)
class Comparison:
    """What came of a study.

    Parameters
    ----------
    name
        Of the study.
    differences
        Lines; none where all is the same.
    compared
        Number of variables.
    seconds
        Of the processor, with both trees.
    """

    name: str
    differences: list[str]
    compared: int
    seconds: float


def compared(example: Example, trees: tuple[Tree, Tree], folder: Path) -> Comparison:
    """Run an example with both trees, one after the other, and compare."""
    places, seconds = [folder / f"{example.name}-{side}" for side in ("old", "new")], 0.0
    for tree, place in zip(trees, places, strict=True):
        # what a run prints has the path of its folder: the same for both
        work = folder / example.name
        example.write(work)
        for arguments in example.commands:
            seconds += ran(tree, arguments, work, work / TERMINAL)
        work.rename(place)
    differences, count = differing_folders(*places)
    for place in places:
        shutil.rmtree(place)
    return Comparison(example.name, differences, count, seconds)


def ran(tree: Tree, arguments: tuple[str, ...], folder: Path, terminal: Path) -> float:
    """Run a command, add what it prints and its exit code to a file, and return seconds of the processor."""
    with terminal.open("a", encoding="utf-8") as file:
        print(f"$ stickslip {' '.join(arguments)}", file=file, flush=True)
        process = subprocess.Popen(
            tree.command(arguments),
            cwd=folder,
            env=tree.environment(),
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        print(f"exit code {process.returncode}", file=file)
    return usage.ru_utime + usage.ru_stime


def differing_folders(old: Path, new: Path) -> tuple[list[str], int]:
    """Return what differs in the files of two folders, and the number of variables of the old results."""
    found, count = [], 0
    for file in sorted({path.relative_to(one) for one in (old, new) for path in one.rglob("*") if path.is_file()}):
        if file.name == LOCK or any(part in INNER for part in file.parts):
            continue
        alone = [side for side, one in (("new", old), ("old", new)) if not (one / file).exists()]
        if alone:
            found.append(f"{file}: written by the {alone[0]} tree alone")
        elif file.suffix == ".nc":
            before, after = read_nodes(old / file), read_nodes(new / file)
            count += sum(len(node.variables) for node in before.values())
            lines = differing_results(before, after)
            found += lines[:MAX_SHOWN] + ([f"... and {len(lines) - MAX_SHOWN} more"] if len(lines) > MAX_SHOWN else [])
        elif file.suffix in TEXTS:
            texts = [(one / file).read_text(encoding="utf-8", errors="backslashreplace") for one in (old, new)]
            found += differing_lines(str(file), *map(TEXTS[file.suffix], texts))
        elif (old / file).read_bytes() != (new / file).read_bytes():
            found.append(f"{file}: differs")
    return found, count
