"""Progress display: bars on a terminal, plain lines without one, and one output with a line a job in a notebook."""

import logging
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from html import escape
from time import monotonic, process_time
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from stickslip.errors import printable
from stickslip.study.store.progress import DONE, head

LOG = logging.getLogger("stickslip")
STEPS = 10  # plain lines of the progress of a job
QUIET = 30.0  # seconds without a line, after which the progress of running jobs is printed
FULL = "━" * 10  # the bar of a finished job
LONG = 20.0  # seconds of a job from which its CPU time is told where it is less than ...
BUSY = 0.7  # ... this share of them; below the other share the job ran in another process
WATCHING = 0.02
_BETWEEN = 0.2  # seconds between two drawings
_WIDTH = 24  # characters of a bar


def in_notebook() -> bool:
    """Whether the code runs in Jupyter; false for IPython on a terminal."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")


class NotebookScreen(logging.Handler):
    """Log handler that draws progress records as bars in one output, with warnings below; ignores all other lines.

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
            self._state(record, float(fraction), text)
        elif hasattr(record, "fraction"):
            self._state(record, 0.0, text)
        elif head(record):
            self._told.append(f"{head(record)}{text}")
        if time.monotonic() - self._drawn > _BETWEEN:
            self._draw()

    def _state(self, record: logging.LogRecord, fraction: float, text: str) -> None:
        job = str(getattr(record, "job", "")) or "model"
        self._jobs[job] = max(fraction, self._jobs.get(job, (0.0, ""))[0]), text

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


@dataclass
class At:
    """Progress of a job.

    Parameters
    ----------
    begun
        Time of its first record.
    fraction
        Finished fraction.
    text
        Stage and point, in words.
    task
        Its bar; None without a terminal.
    spent
        CPU time of this process at its first record.
    """

    begun: float
    fraction: float = 0.0
    text: str = ""
    task: TaskID | None = None
    spent: float = 0.0


class Screen(logging.Handler):
    """Log handler that draws a bar for each running job, and prints a line for each finished job and lines of no job.

    Without a terminal it prints the progress of each running job after `QUIET` seconds without a line.

    Parameters
    ----------
    console
        Console for the output. Without a terminal, lines replace bars.
    bars
        Largest number of bars, one a worker.
    warnings
        Whether to print warnings and verdicts; false if they are listed at the end.
    verbose
        Whether to print the messages of running jobs too, as the log file does.
    quiet
        Seconds without a line, after which the progress of running jobs is printed.
    """

    def __init__(
        self,
        console: Console,
        bars: int = 1,
        *,
        warnings: bool = True,
        verbose: bool = False,
        quiet: float = QUIET,
    ) -> None:
        super().__init__()
        self._console, self._bars, self._quiet = console, bars, quiet
        self._warnings, self._verbose = warnings, verbose
        self._progress: Progress | None = None
        self._at: dict[str, At] = {}
        self._steps: dict[str, int] = {}
        self._sums: dict[str, str] = {}
        self._wrote = self._begun = monotonic()

    @contextmanager
    def shown(self) -> Iterator[None]:
        """Draw while the block runs."""
        if not self._console.is_terminal:
            over = threading.Event()
            thread = threading.Thread(target=self._watch, args=(over,), daemon=True)
            thread.start()
            try:
                yield
            finally:
                over.set()
                thread.join()
            return
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[state]}", markup=False),
        )
        with Progress(*columns, console=self._console, transient=True) as self._progress:
            yield
        self._progress = None

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record."""
        text, job = record.getMessage(), str(getattr(record, "job", ""))
        if hasattr(record, "fraction"):
            self._advance(job, record.fraction, text)
            return
        if hasattr(record, "sums_up"):
            self._sums[job] = str(record.sums_up)
        if head(record):
            if self._warnings:
                self._line(f"{head(record)}{text}")
        elif self._verbose or not job:
            self._line(text)

    def _watch(self, over: threading.Event) -> None:
        """Print the progress of the running jobs whenever nothing has been written for a while."""
        while not over.wait(max(self._wrote + self._quiet - monotonic(), 0.01)):
            with self.lock or nullcontext(), suppress(OSError):  # a closed pipe; the next line reports it
                if monotonic() - self._wrote >= self._quiet:
                    self._wrote = monotonic()
                    for job, at in self._at.items():
                        self._line(f"  {_where(job, at)}, {lasting(monotonic() - at.begun)}")

    def _line(self, text: str) -> None:
        self._wrote = monotonic()
        self._console.print(printable(text), markup=False, highlight=False, soft_wrap=True)

    def _advance(self, job: str, fraction: float | None, text: str) -> None:
        if text == DONE:
            self._done(job)
            return
        if job and job not in self._at:  # the model is complete
            self._forget("")
        at = self._at.setdefault(job, At(monotonic() if job else self._begun, spent=process_time()))
        at.fraction, at.text = max(at.fraction, fraction or 0.0), "" if text == job else text
        if self._progress is not None:
            self._draw(job, at)
        elif self._verbose and fraction is not None:
            self._step(job, at.fraction, text)

    def _draw(self, job: str, at: At) -> None:
        """Move the bar of a job."""
        assert self._progress is not None
        if at.task is None:
            while (
                sum(one.task is not None for one in self._at.values()) >= self._bars
            ):  # remove the bars of lost workers
                self._forget(next(name for name, one in self._at.items() if one.task is not None))
            # without a job the fraction is unknown: the bar runs to and fro
            at.task = self._progress.add_task(job or "model", total=1.0 if job else None, state="")
        self._progress.update(at.task, completed=at.fraction, state=printable(at.text))

    def _forget(self, job: str) -> None:
        at = self._at.pop(job, None)
        if at is not None and at.task is not None and self._progress is not None:
            self._progress.remove_task(at.task)

    def _step(self, job: str, fraction: float, text: str) -> None:
        """Print the state of a job at every tenth."""
        step = int(STEPS * fraction)
        if step > self._steps.get(job, -1):
            self._steps[job] = step
            self._line(text if step == 0 else f"  {job} {100 * fraction:.0f} %: {text}")

    def _done(self, job: str) -> None:
        """Print the line of a finished job."""
        at = self._at.get(job, At(monotonic(), spent=process_time()))
        took, computed = monotonic() - at.begun, process_time() - at.spent
        beside = took > LONG and WATCHING * took < computed < BUSY * took
        cpu = f", {computed:.0f} s of CPU" * beside  # what `check` estimates, on a machine that does other work, too
        told = f"{job}: {self._sums.get(job, DONE)} ({took:.0f} s{cpu})"
        bar = f"{FULL} " * (at.task is not None)
        self._forget(job)
        self._line(f"{bar}{told}")


def lasting(seconds: float) -> str:
    """Return a time in minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def _where(job: str, at: At) -> str:
    if not job:
        return at.text
    state = f": {at.text}" if at.text else ""
    return f"{job} {100 * at.fraction:.0f} %{state}"


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
