"""Run every benchmark and write ``evidence/benchmarks/out/results.json``.

A benchmark is a module ``evidence/benchmarks/bench_*.py`` with a function ``run()`` that returns a list of records with
the keys of `KEYS`: ``name`` like ``forced/newton_over_lapack``, the ``value`` measured, the ``goal`` as a text with
its unit (``"<= 2"``), whether it ``holds``, and a ``note`` on what was measured how. A goal that is missed stays in the list.

    python -m evidence.benchmarks            # all
    python -m evidence.benchmarks forced     # only modules whose name contains the word; nothing is written
"""

import argparse
import importlib
import json
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

HERE = Path(__file__).parent
KEYS = {"name", "value", "goal", "holds", "note"}


def collect(word: str = "") -> list[dict[str, Any]]:
    """Run the modules whose name contains `word` and return their records."""
    records = []
    for path in sorted(HERE.glob("bench_*.py")):
        if word not in path.stem:
            continue
        for record in importlib.import_module(f"evidence.benchmarks.{path.stem}").run():
            if set(record) != KEYS:
                raise ValueError(
                    f"{path.name}: a record has the keys {sorted(record)}, not {sorted(KEYS)}"
                )
            records.append(record)
    return records


def table(records: list[dict[str, Any]]) -> Table:
    """Lay the records out for the terminal."""
    out = Table("benchmark", "value", "goal", "holds", "note", title="Benchmarks")
    for record in records:
        holds = "yes" if record["holds"] else "[bold red]no[/]"
        value = record["value"]
        shown = f"{value:.4g}" if isinstance(value, float) else str(value)
        out.add_row(record["name"], shown, str(record["goal"]), holds, record["note"])
    return out


def word_of(arguments: list[str]) -> str:
    """Return the word asked for; end with a message where no module's name contains it."""
    names = sorted(path.stem for path in HERE.glob("bench_*.py"))
    parser = argparse.ArgumentParser(
        prog="python -m evidence.benchmarks",
        description="Run every benchmark and write evidence/benchmarks/out/results.json, or only some of them, and write nothing.",
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
    """Run, print and write; a missed goal is a result, not a failure."""
    word = word_of(sys.argv[1:])
    records = collect(word)
    # redirected output has no width of its own; 80 columns would fold every row
    console = Console(width=None if sys.stdout.isatty() else 180)
    console.print(table(records))
    if not word:
        out = HERE / "out" / "results.json"
        out.parent.mkdir(exist_ok=True)
        out.write_text(json.dumps(records, indent=1, default=lambda number: number.item()) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
