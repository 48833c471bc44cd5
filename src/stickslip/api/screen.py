"""Progress display: bars on a terminal, plain lines without one, and one output with a line a job in a notebook."""

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from time import monotonic
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from stickslip.errors import printable
from stickslip.study.store.progress import DONE, head

LOG = logging.getLogger("stickslip")
STEPS = 10  # plain lines that a job writes on its way
BETWEEN = 60.0  # seconds between plain lines of a job, where points are not asked for
FULL = "━" * 10  # the bar of a job that is done
_BETWEEN = 0.2  # seconds between two drawings
_WIDTH = 24  # characters of a bar


def in_notebook() -> bool:
    """Whether the code runs in Jupyter; false for IPython on a terminal."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")


class NotebookScreen(logging.Handler):
    """Draws progress records as bars in one output, with warnings below; ignores all other lines.

    Parameters
    ----------
    handle
        Display handle of IPython, with ``update``; tests pass their own.
    """

    def __init__(self, handle: Any = None) -> None:
        super().__init__()
        self._handle, self._drawn = handle, 0.0
        self._jobs: dict[str, tuple[float, str]] = {}
        self._told: list[str] = []

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Draw while the block runs, and once more at its end."""
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


class Screen(logging.Handler):
    """Draws a bar for each running job and one line for each finished job; prints lines that belong to no job.

    Parameters
    ----------
    console
        Where to write. If it is no terminal, lines replace bars.
    bars
        Largest number of bars, one a worker.
    warnings
        Whether to print warnings and verdicts; false if they are listed at the end.
    verbose
        Whether to print the messages of running jobs too, as the log file does.
    """

    def __init__(self, console: Console, bars: int = 1, *, warnings: bool = True, verbose: bool = False) -> None:
        super().__init__()
        self._console, self._bars = console, bars
        self._warnings, self._verbose = warnings, verbose
        self._progress: Progress | None = None
        self._tasks: dict[str, TaskID] = {}
        self._steps: dict[str, int] = {}
        self._begun: dict[str, float] = {}
        self._told: dict[str, float] = {}
        self._sums: dict[str, str] = {}

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Draw while the block runs."""
        if not self._console.is_terminal:
            yield
            return
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[state]}"),
        )
        with Progress(*columns, console=self._console, transient=True) as self._progress:
            yield
        self._progress = None

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record."""
        text, job = record.getMessage(), str(getattr(record, "job", ""))
        fraction = getattr(record, "fraction", None)
        if job and job not in self._begun:
            self._begun[job] = self._told[job] = monotonic()
        if fraction is not None:
            self._advance(job, float(fraction), text)
            return
        if hasattr(record, "sums_up"):
            self._sums[job] = str(record.sums_up)
        if head(record):
            if self._warnings:
                self._line(f"{head(record)}{text}")
        elif self._verbose or not job:
            self._line(text)

    def _line(self, text: str) -> None:
        self._console.print(printable(text), markup=False, highlight=False, soft_wrap=True)

    def _advance(self, job: str, fraction: float, text: str) -> None:
        if text == DONE:
            self._done(job)
        elif self._progress is None:
            self._plain(job, fraction, text)
        else:
            if job not in self._tasks:
                while len(self._tasks) >= self._bars:  # of workers that were lost
                    self._progress.remove_task(self._tasks.pop(next(iter(self._tasks))))
                self._tasks[job] = self._progress.add_task(job or "model", total=1.0, state="")
            state = "" if text == job or not self._verbose else text
            self._progress.update(self._tasks[job], completed=fraction, state=state)

    def _plain(self, job: str, fraction: float, text: str) -> None:
        """Print some of the states of a job, without `verbose` at most one a minute."""
        if not self._verbose:
            if monotonic() - self._told.get(job, monotonic()) > BETWEEN:
                self._told[job] = monotonic()
                self._line(f"  {job} {100 * fraction:.0f} %")
            return
        step = int(STEPS * fraction)
        if step > self._steps.get(job, -1):
            self._steps[job] = step
            self._line(text if step == 0 else f"  {job} {100 * fraction:.0f} %: {text}")

    def _done(self, job: str) -> None:
        """Print the line of a finished job."""
        seconds = monotonic() - self._begun.get(job, monotonic())
        told = f"{job}: {self._sums.get(job, DONE)} ({seconds:.0f} s)"
        if self._progress is not None and job in self._tasks:
            self._progress.remove_task(self._tasks.pop(job))
            told = f"{FULL} {told}"
        self._line(told)


@contextmanager
def on_screen(screen: Screen | NotebookScreen) -> Iterator[None]:
    """Show the log messages of the package on a screen while the block runs."""
    level = LOG.level
    LOG.addHandler(screen)
    if level == logging.NOTSET:
        LOG.setLevel(logging.INFO)
    screen.setLevel(LOG.level)
    try:
        with screen.shown():
            yield
    finally:
        LOG.removeHandler(screen)
        LOG.setLevel(level)


@contextmanager
def by_default(workers: int = 1) -> Iterator[None]:
    """Show progress on stderr or in the notebook, unless the user has given a log handler to the root or to this package."""
    if logging.getLogger().handlers or LOG.handlers:
        yield
        return
    screen = NotebookScreen() if in_notebook() else Screen(Console(stderr=True), workers)
    with on_screen(screen):
        yield
