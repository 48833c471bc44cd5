"""Run every comparison and write ``evidence/validation/out/results.json``.

A case is a module ``evidence/validation/case_*.py`` with a function ``run()`` that returns a list of records with the keys of
`KEYS`: the ``case``, the ``quantity`` with its unit, the value that is ``ours``, the ``reference``, the ``tolerance``
(relative unless the quantity says otherwise), whether it ``holds``, and the ``source`` of the reference. The page
``docs/validation.md`` shows the list.

    python -m evidence.validation            # all
    python -m evidence.validation jenkins    # only modules whose name contains the word; nothing is written

The exit code is 1 when a comparison does not hold.
"""

import argparse
import importlib
import json
import sys
import traceback
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from evidence.validation import compare

HERE = Path(__file__).parent
KEYS = {"case", "quantity", "ours", "reference", "tolerance", "holds", "source"}


def collect(word: str = "") -> list[dict[str, Any]]:
    """Run the modules whose name contains `word` and return their records."""
    records = []
    for path in sorted(HERE.glob("case_*.py")):
        if word not in path.stem:
            continue
        for record in _run(path.stem):
            if set(record) != KEYS:
                raise ValueError(
                    f"{path.name}: a record has the keys {sorted(record)}, not {sorted(KEYS)}"
                )
            records.append(record)
    return records


def _run(name: str) -> list[compare.Record]:
    """Return the records of a case; one that breaks off counts as failed and does not end the others."""
    try:
        records: list[compare.Record] = importlib.import_module(f"evidence.validation.{name}").run()
    except Exception as error:  # noqa: BLE001  # whatever a case or a program it runs may raise
        traceback.print_exc()
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        return [
            compare.record(name, f"ran to its end ({reason})", 0.0, 1.0, 0.0, "the case itself")
        ]
    return records


def table(records: list[dict[str, Any]]) -> Table:
    """Lay the records out for the terminal."""
    out = Table(
        "case", "quantity", "ours", "reference", "tolerance", "holds", "source", title="Validation"
    )
    for record in records:
        numbers = [
            f"{record[key]:.9g}" if isinstance(record[key], float) else str(record[key])
            for key in ("ours", "reference", "tolerance")
        ]
        holds = "yes" if record["holds"] else "[bold red]no[/]"
        out.add_row(record["case"], record["quantity"], *numbers, holds, record["source"])
    return out


def word_of(arguments: list[str]) -> str:
    """Return the word asked for; end with a message where no module's name contains it."""
    names = sorted(path.stem for path in HERE.glob("case_*.py"))
    parser = argparse.ArgumentParser(
        prog="python -m evidence.validation",
        description="Run every comparison and write evidence/validation/out/results.json, or only some of them, and write nothing.",
        epilog="modules: " + ", ".join(names),
    )
    parser.add_argument(
        "word", nargs="?", default="", help="run only modules whose name contains the word"
    )
    word: str = parser.parse_args(arguments).word
    if not any(word in name for name in names):
        parser.error(f"no module's name contains {word!r}; there are {', '.join(names)}")
    return word


def main() -> int:
    """Run, print and write; 1 when a comparison does not hold."""
    word = word_of(sys.argv[1:])
    records = collect(word)
    # redirected output has no width of its own; 80 columns would fold every row
    console = Console(width=None if sys.stdout.isatty() else 180)
    console.print(table(records))
    failed = [record for record in records if not record["holds"]]
    console.print(f"{len(records) - len(failed)} of {len(records)} comparisons hold.")
    if not word:
        out = HERE / "out" / "results.json"
        out.parent.mkdir(exist_ok=True)
        out.write_text(json.dumps(records, indent=1, default=lambda number: number.item()) + "\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
