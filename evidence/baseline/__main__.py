"""Run every example with the sources of a commit and with those of the working tree, and compare: ``make baseline REF=<commit>``.

    python -m evidence.baseline HEAD
    python -m evidence.baseline hub/main two_tones four_masses

Numbers must be equal to the last bit, texts but for times of the clock. Nothing is kept but the unpacked sources with
their compiled functions, in ``evidence/baseline/out``.
"""

import argparse
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from evidence.baseline import interrupted
from evidence.baseline.differences import Comparison, compared, ran
from evidence.baseline.studies import examples
from evidence.baseline.trees import Tree, oldest_trees, sources_at_work, sources_of_commit, unpacked

OUT = Path(__file__).parent / "out"


def main() -> int:
    """Compare, print, and return 0 if nothing differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit", help="whose sources are compared with those of the working tree")
    parser.add_argument("names", nargs="*", help=f"of examples, or {interrupted.NAME}; all where none is given")
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    chosen = named(asked.names)
    began = time.monotonic()
    trees = (
        unpacked(asked.commit, sources_of_commit(asked.commit), OUT),
        unpacked("here", sources_at_work(), OUT),
    )
    for path in oldest_trees(OUT):
        shutil.rmtree(path)
    if trees[0].folder == trees[1].folder:
        print(f"{asked.commit} and the working tree have the same sources: this shows that two runs agree")
    with (
        TemporaryDirectory(prefix="stickslip-baseline-") as name,
        ThreadPoolExecutor(asked.workers) as pool,
    ):
        folder = Path(name)
        if not asked.names:
            compiling = [
                pool.submit(ran, tree, ("compile",), folder, folder / f"compile-{i}") for i, tree in enumerate(trees)
            ]
            print(
                f"compiled in {sum(one.result() for one in compiling):.0f} s of the processor",
                flush=True,
            )
        tasks = [pool.submit(compare, trees, folder) for compare in chosen]
        comparisons = [told(one.result()) for one in as_completed(tasks)]
    differing = sorted(one.name for one in comparisons if one.differences)
    spent = f"{time.monotonic() - began:.0f} s, {sum(one.seconds for one in comparisons):.0f} s of the processor"
    print(
        f"{len(comparisons)} comparisons in {spent}: "
        + (f"DIFFERENT: {', '.join(differing)}" if differing else "nothing differs")
    )
    return 1 if differing else 0


def named(names: Sequence[str]) -> list[Callable[[tuple[Tree, Tree], Path], Comparison]]:
    """Return the comparisons of these names, or all, the longest first.

    Raises
    ------
    SystemExit
        If there is none of a name.
    """
    known = {one.name: partial(compared, one) for one in sorted(examples(), key=lambda one: -one.seconds)}
    known[interrupted.NAME] = interrupted.goes_on
    if unknown := [name for name in names if name not in known]:
        raise SystemExit(f"no example is called {', '.join(unknown)}; there are {', '.join(known)}")
    return [compare for name, compare in known.items() if name in names or not names]


def told(one: Comparison) -> Comparison:
    """Print what came of a study."""
    if not one.differences:
        print(
            f"{one.name}: {one.compared} variables identical, texts too ({one.seconds:.0f} s)",
            flush=True,
        )
        return one
    print(f"{one.name}: DIFFERENT", flush=True)
    for line in one.differences:
        print(f"  {line}", flush=True)
    return one


if __name__ == "__main__":
    sys.exit(main())
