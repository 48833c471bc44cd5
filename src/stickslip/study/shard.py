"""Shards, the shares of a run's jobs, for job arrays on a shared folder."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from stickslip.errors import input_error
from stickslip.study.outcome import Book, Outcome, Task
from stickslip.study.store.progress import LOG


@dataclass(frozen=True)
class Shard:
    """One of several runs that share the jobs of a study.

    Parameters
    ----------
    number
        Number of this shard, from 1.
    count
        Number of shards.
    """

    number: int
    count: int

    @classmethod
    def read(cls, text: str) -> "Shard":
        """Parse a text such as ``3/8``.

        Raises
        ------
        InputError
            If the text is not of this form.
        """
        found = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)
        shard = cls(*map(int, found.groups())) if found else cls(0, 0)
        if not 1 <= shard.number <= shard.count:
            raise input_error(
                f"--shard {text}",
                "is no share of the jobs",
                "Give its number and how many there are: --shard 1/4 up to --shard 4/4.",
            )
        return shard

    @property
    def log(self) -> str:
        """Name of its log file."""
        return f"run-{self.number}-of-{self.count}.log"

    def own(self, tasks: Sequence[Task]) -> Sequence[Task]:
        """Return the tasks of this shard; every shard sorts all tasks in the same order."""
        return tasks[self.number - 1 :: self.count]

    def outcome(self, book: Book, done: int, left: int, folder: Path) -> Outcome:
        """Return the outcome of a shard that ends while others still run."""
        text = (
            f"shard {self.number}/{self.count}: {done} jobs done, {left} of other shards are not. The last one to end puts the "
            "result together, as does the same command without --shard."
        )
        LOG.info(text)
        return Outcome(book.tree(complete=False), {}, 0, (folder / self.log,), text)
