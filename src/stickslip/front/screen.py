"""What a user sees while something is computed: a bar on a terminal, plain lines elsewhere."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from stickslip.errors import printable
from stickslip.front.notebook import NotebookScreen, in_notebook
from stickslip.study.keep.progress import head

LOG = logging.getLogger("stickslip")
STEPS = 10  # plain lines that a job writes on its way


class Screen(logging.Handler):
    """Draws records of progress as bars, or writes some of them as lines; writes all others as lines.

    Parameters
    ----------
    console
        Where to write.
    bars
        Most bars at a time: one a worker.
    warnings
        Whether to write warnings and verdicts: not where they are listed at the end.
    """

    def __init__(self, console: Console, bars: int = 1, *, warnings: bool = True) -> None:
        super().__init__()
        self._console, self._bars, self._warnings = console, bars, warnings
        self._progress: Progress | None = None
        self._tasks: dict[str, TaskID] = {}
        self._steps: dict[str, int] = {}

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
        text, fraction = record.getMessage(), getattr(record, "fraction", None)
        if fraction is not None:
            self._advance(str(getattr(record, "job", "")), float(fraction), text)
        elif self._warnings or not head(record):
            self._line(f"{head(record)}{text}")

    def _line(self, text: str) -> None:
        self._console.print(printable(text), markup=False, highlight=False, soft_wrap=True)

    def _advance(self, job: str, fraction: float, text: str) -> None:
        if self._progress is None:
            step = int(STEPS * fraction)
            if step > self._steps.get(job, -1):
                self._steps[job] = step
                self._line(text if step == 0 else f"  {job} {100 * fraction:.0f} %: {text}")
            return
        if job not in self._tasks:
            # the oldest is done: a worker does one job after the other
            while len(self._tasks) >= self._bars:
                self._progress.remove_task(self._tasks.pop(next(iter(self._tasks))))
            self._tasks[job] = self._progress.add_task(job or "model", total=1.0, state="")
        state = "" if text == job else text
        self._progress.update(self._tasks[job], completed=fraction, state=state)


@contextmanager
def on_screen(screen: Screen | NotebookScreen) -> Iterator[None]:
    """Send what the package says to a screen while the block runs."""
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
    """Show progress on stderr, or in the output of a notebook, unless the user has said where it goes: a handler of the root or of this package's logger."""
    if logging.getLogger().handlers or LOG.handlers:
        yield
        return
    screen = NotebookScreen() if in_notebook() else Screen(Console(stderr=True), workers)
    with on_screen(screen):
        yield
