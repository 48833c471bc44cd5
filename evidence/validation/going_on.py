"""Cases of random motions that take an hour or more: each outcome is kept in a file of its seed, and a run goes on where the last one stopped."""

import argparse
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from time import process_time
from typing import Any, TypeVar

T = TypeVar("T")
FOLDER = Path(__file__).parent / "out"


def go_on(
    name: str, doc: str | None, kind: Callable[..., T], judge: Callable[[int, int], T], table: Callable[[list[T]], str]
) -> None:
    """Judge motions of a seed until there are so many, or the time is up; print the table.

    Parameters
    ----------
    name
        Of the case: outcomes are kept in ``out/name_seed.jsonl``.
    doc
        What the case is.
    kind
        Dataclass of an outcome, with the `number` of its motion and its `dofs`, 0 where there was no motion.
    judge
        Outcome by seed and number.
    table
        Lines of what came out.
    """
    parser = argparse.ArgumentParser(description=doc)
    parser.add_argument("--motions", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    path, began = FOLDER / f"{name}_{options.seed}.jsonl", process_time()
    found: list[Any] = kept(path, kind)
    path.parent.mkdir(exist_ok=True)
    number = max((o.number for o in found), default=-1) + 1
    while sum(o.dofs > 0 for o in found) < options.motions:
        if process_time() - began > 60.0 * options.minutes:
            break
        found.append(judge(options.seed, number))
        with path.open("a") as file:
            file.write(json.dumps(asdict(found[-1])) + "\n")
        number += 1
    print(table(found))


def kept(path: Path, kind: Callable[..., T]) -> list[T]:
    """Return the outcomes that a file holds."""
    if not path.exists():
        return []
    return [kind(**json.loads(line)) for line in path.read_text().splitlines()]
