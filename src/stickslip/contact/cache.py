"""Compilation by numba with the package's own cache.

Compiled functions have a checksum, and long compilations are announced. Modules that check a study file do not import
this one: numba takes a quarter of a second to load.
"""

import logging
from collections.abc import Callable
from functools import partial
from threading import Timer
from typing import Any

import numba
from numba.core import event
from numba.core.dispatcher import Dispatcher

from stickslip.contact.cache_files import CheckedCache, tell_uncached

LOG = logging.getLogger("stickslip")
QUIET_SECONDS = 3.0  # seconds after which a compilation is announced
LINE = "compiling contact laws or time steps; needed once after installing, a minute or two"


class _Compiling(event.Listener):
    """Listener to numba's compilations; compiling a called function is nested in compiling its caller."""

    def __init__(self) -> None:
        self.depth = 0
        self.soon = Timer(0.0, self.tell)
        self.told = False

    def tell(self) -> None:
        """Log the line, once per process."""
        if not self.told:
            self.told = True
            LOG.info(LINE)

    def on_start(self, _: Any) -> None:
        """Start the timer that logs the line."""
        self.depth += 1
        if self.depth == 1 and not self.told:
            self.soon = Timer(QUIET_SECONDS, self.tell)
            self.soon.daemon = True
            self.soon.start()

    def on_end(self, _: Any) -> None:
        """Stop the timer: short compilations are not logged."""
        self.depth -= 1
        if self.depth == 0:
            self.soon.cancel()


_LISTENER = _Compiling()


def say_what_is_compiled() -> None:
    """Log a line when a function takes seconds to compile."""
    event.register("numba:compile", _LISTENER)  # type: ignore[no-untyped-call]


def njit(*asked: Any, cache: bool = False, **options: Any) -> Any:
    """Compile like `numba.njit`; with ``cache``, store the code in the cache of this package.

    If numba finds no writable folder, functions with a cache are compiled at every start; numba itself would refuse to
    load them. A function is compiled again if its file, or a file that this one imports, has changed.

    Parameters
    ----------
    *asked
        The function, or signatures that are compiled at once, or nothing.
    cache
        Whether compiled code is stored for the next start.
    **options
        Options of numba.

    Returns
    -------
    Dispatcher
        The dispatcher of the function; without a function, a decorator.
    """
    if len(asked) == 1 and callable(asked[0]) and hasattr(asked[0], "__code__"):
        return _compiled(asked[0], (), cache, options)
    return partial(_compiled, signatures=asked, cache=cache, options=options)


def _compiled(function: Callable[..., Any], signatures: tuple[Any, ...], cache: bool, options: dict[str, Any]) -> Any:
    made: Any = numba.njit(**options)(function)
    if not isinstance(made, Dispatcher):  # NUMBA_DISABLE_JIT
        return made
    if cache:
        try:
            kept: Any = made
            kept._cache = CheckedCache(function)  # noqa: SLF001  as Dispatcher.enable_caching does
        except RuntimeError:  # neither beside the source nor in the home of the user
            tell_uncached()
    for signature in signatures:
        made.compile(signature)
    if signatures:
        made.disable_compile()
    return made


# before any function is compiled
say_what_is_compiled()
