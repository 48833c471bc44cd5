"""Messages during compilation, so that a first run does not look as if it hung."""

import logging
from threading import Timer
from typing import Any

from numba.core import event

LOG = logging.getLogger("stickslip")
PATIENCE = 3.0  # seconds after which compiling is worth a line
LINE = "compiling contact laws or their time steps, once an installation; this may take a minute or two"


class _Compiling(event.Listener):
    """Listens to numba; functions that one calls are compiled within its time."""

    def __init__(self) -> None:
        self.depth = 0
        self.soon = Timer(0.0, self.tell)
        self.told = False

    def tell(self) -> None:
        """Say it, once a process."""
        if not self.told:
            self.told = True
            LOG.info(LINE)

    def on_start(self, _: Any) -> None:
        """Wait, and say it if it lasts."""
        self.depth += 1
        if self.depth == 1 and not self.told:
            self.soon = Timer(PATIENCE, self.tell)
            self.soon.daemon = True
            self.soon.start()

    def on_end(self, _: Any) -> None:
        """Be quiet about what was short."""
        self.depth -= 1
        if self.depth == 0:
            self.soon.cancel()


_LISTENER = _Compiling()


def say_what_is_compiled() -> None:
    """Log a line where a function takes seconds to compile."""
    event.register("numba:compile", _LISTENER)  # type: ignore[no-untyped-call]
