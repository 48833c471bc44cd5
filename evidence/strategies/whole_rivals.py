"""``python -m evidence.strategies.whole_rivals [CASE ...]``: the rivals with harmonics of each coordinate, and repeated until these are those foretold.

Prints the tables of docs/theory/rivals.md: counts, no times.
"""

import sys

from evidence.strategies.cases import CASES
from evidence.strategies.compare import FEW, MANY, PUBLISHED, Entry, compared
from evidence.strategies.page import heading, table
from stickslip.harmonic.selection.grolet import Grolet
from stickslip.harmonic.selection.laxalde import Laxalde
from stickslip.harmonic.selection.maple import Maple
from stickslip.harmonic.selection.suess_jacobian import SuessJacobian
from stickslip.harmonic.selection.suess_spectral import SuessSpectral

ENTRIES = (
    Entry(FEW),
    Entry(MANY),
    Entry(PUBLISHED),
    Entry("maple"),
    Entry("maple", own=Maple(per_dof=True), keys="per dof"),
    Entry("grolet"),
    Entry("grolet", own=Grolet(per_dof=True), keys="per dof"),
    Entry("grolet", own=Grolet(repeats=True), keys="repeats"),
    Entry("grolet", own=Grolet(per_dof=True, repeats=True), keys="per dof, repeats"),
    Entry("laxalde", own=Laxalde(repeats=True), keys="repeats"),
    Entry("suess_spectral", own=SuessSpectral(repeats=True), keys="repeats"),
    Entry("suess_jacobian", own=SuessJacobian(repeats=True), keys="repeats"),
)


def without_time(lines: list[str]) -> list[str]:
    """Return the lines of a table without the column of CPU times."""
    at = lines[0].split("|").index(" CPU ")
    cells = [line.split("|") for line in lines]
    return ["|".join([*own[:at], *own[at + 1 :]]) for own in cells]


def main() -> None:
    """Compare on the cases that are named, all without names."""
    for name in sys.argv[1:] or CASES:
        found = compared(CASES[name](), ENTRIES)
        print("\n".join([*heading(found), *without_time(table(found)), ""]), flush=True)


if __name__ == "__main__":
    main()
