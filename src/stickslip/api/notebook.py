"""Progress in a notebook: one output, one line for each job."""

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

from stickslip.study.store.progress import head

_BETWEEN = 0.2  # seconds between two drawings
_WIDTH = 24  # characters of a bar


def in_notebook() -> bool:
    """Whether a kernel with a display of its own runs this: Jupyter, not IPython on a terminal."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")


class NotebookScreen(logging.Handler):
    """Draws records of progress as bars in one output, with warnings below; all other lines are passed over.

    Parameters
    ----------
    handle
        Of IPython, with ``update``; a test gives its own.
    """

    def __init__(self, handle: Any = None) -> None:
        super().__init__()
        self._handle, self._drawn = handle, 0.0
        self._jobs: dict[str, tuple[float, str]] = {}
        self._told: list[str] = []

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Draw while the block runs, and the last state after it."""
        yield
        self._draw()

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record."""
        text, fraction = record.getMessage(), getattr(record, "fraction", None)
        if fraction is not None:
            self._jobs[str(getattr(record, "job", "")) or "model"] = float(fraction), text
        elif head(record):
            self._told.append(f"{head(record)}{text}")
        if time.monotonic() - self._drawn > _BETWEEN:
            self._draw()

    def _draw(self) -> None:
        if self._jobs or self._told:
            self._drawn = time.monotonic()
            self._shown().update({"text/html": self._html(), "text/plain": self._text()}, raw=True)

    def _shown(self) -> Any:
        if self._handle is None:
            from IPython.display import display

            self._handle = display({"text/plain": ""}, raw=True, display_id=True)
        return self._handle

    def _text(self) -> str:
        widest = max(map(len, self._jobs), default=0)
        lines = []
        for job, (fraction, text) in self._jobs.items():
            full = round(_WIDTH * fraction)
            state = "" if text == job else text
            lines.append(
                f"{job:<{widest}} {'█' * full}{'░' * (_WIDTH - full)} {100 * fraction:3.0f} % {state}".rstrip()
            )
        return "\n".join([*lines, *self._told])

    def _html(self) -> str:
        return f"<pre>{escape(self._text())}</pre>"
