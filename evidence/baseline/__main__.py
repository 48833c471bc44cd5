"""Run every example with the sources of a commit and with those of the working tree, and compare: ``make baseline REF=<commit>``.

    python -m evidence.baseline HEAD
    python -m evidence.baseline hub/main two_tones four_masses

Numbers must be equal to the last bit, texts but for times of the clock. Nothing is kept but the unpacked sources with
their compiled functions, in ``evidence/baseline/out``.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from evidence.baseline.results import differing_results, read_nodes
from evidence.baseline.studies import Example, examples
from evidence.baseline.texts import differing_lines, page_lines, terminal_lines
from evidence.baseline.trees import Tree, oldest_trees, sources_at_work, sources_of_commit, unpacked

OUT = Path(__file__).parent / "out"
TERMINAL = "terminal.txt"
MAX_SHOWN = 30  # variables of a study that are printed


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


def main() -> int:
    """Compare, print, and return 0 if nothing differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit", help="whose sources are compared with those of the working tree")
    parser.add_argument("names", nargs="*", help="of examples; all of them where none is given")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    chosen = named(asked.names)
    began = time.monotonic()
    trees = (
        unpacked(asked.commit, sources_of_commit(asked.commit), OUT),
        unpacked("working tree", sources_at_work(), OUT),
    )
    for path in oldest_trees(OUT):
        shutil.rmtree(path)
    if trees[0].folder == trees[1].folder:
        print(f"{asked.commit} and the working tree have the same sources: this shows that two runs agree")
    with TemporaryDirectory(prefix="stickslip-baseline-") as folder, ThreadPoolExecutor(asked.workers) as pool:
        if not asked.names:
            for ended in [
                pool.submit(ran, tree, ("compile",), Path(folder), Path(folder) / f"compile-{i}")
                for i, tree in enumerate(trees)
            ]:
                ended.result()
        found = [pool.submit(compared, example, trees, Path(folder)) for example in chosen]
        comparisons = [told(one.result()) for one in as_completed(found)]
    differing = sorted(one.name for one in comparisons if one.differences)
    spent = f"{time.monotonic() - began:.0f} s, {sum(one.seconds for one in comparisons):.0f} s of the processor"
    print(
        f"{len(comparisons)} examples in {spent}: "
        + (f"DIFFERENT: {', '.join(differing)}" if differing else "nothing differs")
    )
    return 1 if differing else 0


def named(names: Sequence[str]) -> list[Example]:
    """Return the examples of these names, or all, the longest first.

    Raises
    ------
    SystemExit
        If there is no example of a name.
    """
    known = {one.name: one for one in examples()}
    if unknown := [name for name in names if name not in known]:
        raise SystemExit(f"no example is called {', '.join(unknown)}; there are {', '.join(known)}")
    return sorted([known[name] for name in names or known], key=lambda one: -one.seconds)


def told(one: Comparison) -> Comparison:
    """Print what came of a study."""
    if not one.differences:
        print(f"{one.name}: {one.compared} variables identical, texts too ({one.seconds:.0f} s)", flush=True)
        return one
    print(f"{one.name}: DIFFERENT", flush=True)
    for line in one.differences:
        print(f"  {line}", flush=True)
    return one


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
    """Return what differs in the results and texts of two folders, and the number of variables."""
    found, count = [], 0
    files = sorted({path.relative_to(one) for one in (old, new) for path in one.rglob("*") if path.is_file()})
    for file in files:
        a, b = old / file, new / file
        if file.suffix == ".nc" and a.exists() and b.exists():
            before, after = read_nodes(a), read_nodes(b)
            count += sum(len(node.variables) for node in before.values())
            lines = differing_results(before, after)
            found += lines[:MAX_SHOWN] + ([f"... and {len(lines) - MAX_SHOWN} more"] if len(lines) > MAX_SHOWN else [])
        elif file.suffix in TEXTS and a.exists() and b.exists():
            before_text, after_text = (path.read_text(encoding="utf-8", errors="backslashreplace") for path in (a, b))
            found += differing_lines(str(file), TEXTS[file.suffix](before_text), TEXTS[file.suffix](after_text))
        elif file.suffix in (".nc", *TEXTS):
            found.append(f"{file}: written by {'the old' if a.exists() else 'the new'} tree alone")
    return found, count


TEXTS = {".html": page_lines, ".txt": terminal_lines, ".log": terminal_lines}


if __name__ == "__main__":
    sys.exit(main())
