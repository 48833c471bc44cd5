"""Log lines about slow steps, so that the terminal is not silent for long.

A step logs its line after it has run for `AFTER_S`, but only inside `told_when_slow`: logs of runs then do not depend on the
speed of the machine. Every step is also recorded as the present stage of the work. The progress display repeats this stage
when nothing else is written.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from threading import Timer

LOG = logging.getLogger("stickslip")
AFTER_S = 1.0  # wall-clock time before the line is logged
MANY_DOFS = 20_000  # a larger step logs its line at once: a library that keeps the interpreter would block the timer
_CASE: ContextVar[str | None] = ContextVar("case", default=None)


@contextmanager
def told_when_slow(case: str = "") -> Iterator[None]:
    """Log the lines of slow steps while the block runs, each preceded by the label of a case."""
    token = _CASE.set(case)
    try:
        yield
    finally:
        _CASE.reset(token)


@contextmanager
def step(text: str, dofs: int = 0) -> Iterator[None]:
    """Name a step; its line is logged if the step is slow.

    Parameters
    ----------
    text
        Description of the step, with sizes.
    dofs
        Number of dofs of the step.
    """
    case = _CASE.get()
    LOG.info(text, extra={"fraction": None})
    if case is None:
        yield
        return
    text = f"{case}: {text}" if case else text
    if dofs > MANY_DOFS:
        LOG.info(text)
        yield
        return
    timer = Timer(AFTER_S, copy_context().run, (LOG.info, text))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
