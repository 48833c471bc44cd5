"""The toy analysis with records that take their time, so that a process may be lost while one is computed."""

import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import toy_analysis
from toy_analysis import Term

from stickslip.study.analysis import Notes

SECONDS = float(os.environ.get("SLOW_TOY_SECONDS", "0.8"))  # of a record


def solve(inputs: Any, done: Sequence[Term], notes: Notes) -> Iterator[Term]:
    for record in toy_analysis.solve(inputs, done, notes):
        time.sleep(SECONDS)
        yield record


TOY = replace(toy_analysis.TOY, solve=solve)
