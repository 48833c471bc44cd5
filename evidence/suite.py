"""Suites of evidence: modules of a folder whose names begin alike, each with a `run()` that returns a list of records."""

import argparse
import importlib
import json
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

Record = dict[str, Any]


@dataclass(frozen=True)
class Suite:
    """The modules ``PACKAGE.BEGIN*``.

    Attributes
    ----------
    package, begin
        As above.
    title
        Of the table that the terminal shows.
    columns
        Keys that every record has, with the headings of their columns.
    broken
        Makes a record of a module that breaks off, from its name and the reason; None: it ends the others too.
    """

    package: str
    begin: str
    title: str
    columns: dict[str, str]
    broken: Callable[[str, str], Record] | None = None

    @property
    def folder(self) -> Path:
        """Where its modules lie."""
        return Path(__file__).parent / self.package.rsplit(".", 1)[1]

    def names(self, word: str = "") -> list[str]:
        """Return the modules whose name contains `word`."""
        found = sorted(path.stem for path in self.folder.glob(f"{self.begin}*.py"))
        return [name for name in found if word in name]

    def collect(self, word: str) -> list[Record]:
        """Run the modules whose name contains `word` and return their records."""
        return [record for name in self.names(word) for record in self.records(name)]

    def records(self, name: str) -> list[Record]:
        """Run one module."""
        try:
            records: list[Record] = importlib.import_module(f"{self.package}.{name}").run()
        except Exception as error:
            if self.broken is None:
                raise
            traceback.print_exc()
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            return [self.broken(name, reason)]
        for record in records:
            if set(record) != set(self.columns):
                raise ValueError(f"{name}: a record has {sorted(record)}, not {[*self.columns]}")
        return records

    def main(self) -> list[Record]:
        """Run what the command line asks for, show the records, and write ``out/results.json`` if that is all."""
        word = self._word()
        records = self.collect(word)
        console().print(self.table(records))
        if not word:
            out = self.folder / "out" / "results.json"
            out.parent.mkdir(exist_ok=True)
            text = json.dumps(records, indent=1, default=lambda number: number.item())
            out.write_text(text + "\n", encoding="utf-8")
        return records

    def table(self, records: list[Record]) -> Table:
        """Lay records out for the terminal."""
        out = Table(*self.columns.values(), title=self.title)
        for record in records:
            out.add_row(*(_cell(record[key]) for key in self.columns))
        return out

    def _word(self) -> str:
        parser = argparse.ArgumentParser(
            prog=f"python -m {self.package}",
            description=f"Run all modules and write {self.folder.name}/out/results.json, or only some of them, and write nothing.",
            epilog="modules: " + ", ".join(self.names()),
        )
        text = "run only modules whose name contains the word"
        parser.add_argument("word", nargs="?", default="", help=text)
        word: str = parser.parse_args().word
        if not self.names(word):
            parser.error(f"no module's name contains {word!r}; there are {', '.join(self.names())}")
        return word


def _cell(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "[bold red]no[/]"
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def console() -> Console:
    """Return a console that does not fold every row where the output is redirected and has no width of its own."""
    return Console(width=None if sys.stdout.isatty() else 180)
