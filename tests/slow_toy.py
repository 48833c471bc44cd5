"""The toy analysis with records that take their time, so that a process may be lost while one is computed."""

import os
import time
from collections.abc import Iterator, Sequence
from typing import Any

from toy_analysis import Term, Toy

from stickslip.study.analysis import Notes

SECONDS = float(os.environ.get("SLOW_TOY_SECONDS", "0.8"))  # of a record


class SlowToy(Toy):
    def solve(self, inputs: Any, done: Sequence[Term], notes: Notes) -> Iterator[Term]:
        for record in super().solve(inputs, done, notes):
            time.sleep(SECONDS)
            yield record


TOY = SlowToy()
