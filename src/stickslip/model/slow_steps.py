"""Lines about steps that take long, so that nobody waits in front of a silent terminal.

A step logs its line when it has run for `AFTER_S`, and only inside `told_when_slow`: logs of runs then do not depend on the speed of the machine.
Everywhere it reports itself as the stage of the work, a record of progress, which the display repeats when nothing else is written.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from threading import Timer

LOG = logging.getLogger("stickslip")
AFTER_S = 1.0  # wall-clock time before the line
MANY_DOFS = 20_000  # a step on more says its line at once: a library may not let the timer speak
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
        What is being done, with sizes.
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
