"""Draw mutants and print those that no test notices: ``python -m evidence.mutants --n 40 --seed 1``.

Which tests reach which line is recorded first, once for each test file that is new or has changed: all take about as long as `make test`.
The command fails if fewer than 95 of 100 mutants are noticed; those that `equivalent.txt` lists change nothing that can be seen, and are not counted.
"""

import argparse
import difflib
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from evidence.mutants.judge import Copy, Judged
from evidence.mutants.points import Mutant, drawn, sources_of
from evidence.mutants.reach import Reach, record

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
EQUIVALENT = HERE / "equivalent.txt"
GOAL = 0.95  # of those with an effect that are noticed
FEW = 20  # tests that run first
BUDGET_S = 120.0  # CPU of the tests of one mutant


def main(argv: Sequence[str] | None = None) -> int:
    """Draw, judge, print, and return 0 if enough are noticed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=40, help="how many mutants")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="*", default=(), help="beginnings of paths in src/stickslip")
    parser.add_argument("--cache", type=Path, default=HERE / "out", help="what is recorded")
    parser.add_argument("--budget", type=float, default=BUDGET_S, help="CPU of a mutant's tests, s")
    parser.add_argument("--workers", type=int, default=1, help="processes that record")
    parser.add_argument("--record", action=argparse.BooleanOptionalAction, default=True)
    asked = parser.parse_args(argv)
    if asked.record:
        record(ROOT, asked.cache, asked.workers)
    sources = sources_of(ROOT / "src" / "stickslip")
    texts = {f"tests/{f.name}": f.read_text(encoding="utf-8") for f in ROOT.glob("tests/test_*.py")}
    reach = Reach(asked.cache, sources, texts)
    with TemporaryDirectory(prefix="mutants-") as folder:
        copy = Copy(ROOT, Path(folder) / "tree")
        reach.failed |= reach.cpu_s.keys() - copy.collected()  # names that a test file has no longer
        found = []
        cheap = next(iter(reach.in_order(reach.cpu_s)), "")
        if cheap and not copy.passes(cheap, reach.cost_s(cheap)):
            raise RuntimeError(f"{cheap} fails without any mutant: no test can be run in the copy")
        for mutant in drawn(sources, asked.n, asked.seed, tuple(asked.only)):
            found.append(judged(copy, reach, mutant, asked.budget))
            print(told(found[-1], sources[mutant.path]), flush=True)
        copy.close()
    return summary(found)


def judged(copy: Copy, reach: Reach, mutant: Mutant, budget_s: float) -> Judged:
    """Run the tests that reach a mutant; one that fails without it, too, says nothing."""
    reached = reach.tests(mutant) - reach.failed
    while True:
        tests: list[str] = []
        cpu_s = 0.0
        for test in reach.in_order(reached):
            cpu_s += reach.cost_s(test)
            if tests and cpu_s > budget_s:
                break
            tests.append(test)
        # the cheapest alone first: to collect hundreds takes longer than to run those that most mutants end at
        for some in (tests[:FEW], tests[FEW:]):
            by = copy.judge(mutant, some, sum(map(reach.cost_s, some)))
            if by:
                break
        found = Judged(mutant, by, len(tests), len(reached))
        # what ends all tests, or keeps them from beginning, is the mutant's doing: without it those that are recorded were found
        if not found.by.startswith("tests/") or copy.passes(found.by, reach.cost_s(found.by)):
            return found
        reach.failed.add(found.by)
        reached -= {found.by, found.by.partition("::")[0]}


def told(one: Judged, source: str) -> str:
    """Return a line for what was noticed, and for what was not its change and what to judge."""
    m = one.mutant
    head = f"{'core ' if m.core else ''}{m.path}:{m.line} {m.kind}"
    if one.by:
        return f"noticed   {head}: {one.by}"
    known = " (listed as equivalent)" if key(m) in equivalent() else ""
    lines = [f"SURVIVED  {head}{known}"]
    new = m.applied(source)
    parts = difflib.unified_diff(source.splitlines(), new.splitlines(), n=2, lineterm="")
    lines += [f"    {text}" for text in list(parts)[2:]]
    said = f"{one.ran} of {one.reach} tests that reach it ran" if one.reach else "no test reaches it"
    lines.append(f"    Does anybody see it, or is it equivalent? {m.where or 'the module'}: {m.about} ({said})")
    lines.append(f"    {key(m)}")
    return "\n".join(lines)


def key(mutant: Mutant) -> str:
    """Return what a mutant is called, wherever its lines stand."""
    words = (mutant.path, mutant.where, mutant.before, mutant.after)
    return " | ".join(" ".join(word.split()) for word in words)


@cache
def equivalent() -> frozenset[str]:
    """Return the mutants that a person has judged to change nothing that can be seen."""
    lines = EQUIVALENT.read_text(encoding="utf-8").splitlines()
    return frozenset(line for line in lines if line and not line.startswith("#"))


def summary(found: Sequence[Judged]) -> int:
    """Print how many were noticed, and return 0 if they are enough."""
    counted = [one for one in found if one.by or key(one.mutant) not in equivalent()]
    for what, own in (("all", counted), ("core numerics", [o for o in counted if o.mutant.core])):
        noticed = sum(bool(o.by) for o in own)
        if own:
            print(f"{what}: {noticed} of {len(own)} noticed ({100 * noticed / len(own):.0f} %)")
    print(f"{len(found) - len(counted)} more that survived are listed as equivalent")
    noticed = sum(bool(o.by) for o in counted)
    return 0 if noticed >= GOAL * len(counted) else 1


if __name__ == "__main__":
    sys.exit(main())
