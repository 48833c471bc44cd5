"""Run every comparison and write ``evidence/validation/out/results.json``.

A case is a module ``evidence/validation/case_*.py`` with a function ``run()`` that returns a list of records: the ``case``,
the ``quantity`` with its unit, the value that is ``ours``, the ``reference``, the ``tolerance`` (relative unless the quantity
says otherwise), whether it ``holds`` or was left out, and the ``source`` of the reference. A case that breaks off counts as one comparison
that does not hold, and does not end the others. The page ``docs/validation.md`` shows the list.

    python -m evidence.validation            # all
    python -m evidence.validation jenkins    # only modules whose name contains the word; nothing is written

The exit code is 1 when a comparison does not hold.
"""

import sys

from evidence.suite import Record, Suite, console
from evidence.validation import compare

KEYS = ("case", "quantity", "ours", "reference", "tolerance", "holds", "source")


def broken(name: str, reason: str) -> Record:
    """Return the comparison that a case which broke off stands for."""
    return compare.record(name, f"ran to its end ({reason})", 0.0, 1.0, 0.0, "the case itself")


SUITE = Suite("evidence.validation", "case_", "Validation", {key: key for key in KEYS}, broken)


def main() -> int:
    """Run, print, and end with counts and with what does not hold; 1 when there is any."""
    records = SUITE.main()
    failed = [record for record in records if record["holds"] is False]
    if failed:
        console().print(SUITE.table(failed), style="bold")
    holding = sum(record["holds"] is True for record in records)
    left_out = len(records) - holding - len(failed)
    more = f", {left_out} left out" if left_out else ""
    console().print(f"{holding} of {len(records)} comparisons hold{more}.")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
