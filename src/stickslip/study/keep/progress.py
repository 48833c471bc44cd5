"""What a run says, by the standard logging: lines, warnings, and how much of a job is done.

Records of progress carry ``fraction`` (0 to 1) and ``job`` (what is being computed); all others are lines.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from stickslip.errors import StickslipError

LOG = logging.getLogger("stickslip")
_JOB = ContextVar("job", default="")


class Interrupted(StickslipError):  # noqa: N818  stopping a run is no error
    """The user stopped a run; what is finished is kept."""


def advance(fraction: float, text: str) -> None:
    """Tell how much of the job at work is done, and its state in words."""
    LOG.info(text, extra={"fraction": fraction, "job": _JOB.get()})


@contextmanager
def at_work(job: str) -> Iterator[None]:
    """Name the job whose progress is told."""
    token = _JOB.set(job)
    advance(0.0, job)
    try:
        yield
    finally:
        _JOB.reset(token)
