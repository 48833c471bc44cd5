"""Where compiled functions are kept for the next start; without any place they are compiled at every start."""

import logging
import os
from functools import cache
from typing import Any

from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher

LOG = logging.getLogger("stickslip")
_TOLD = "STICKSLIP_UNCACHED"  # in the environment: worker processes need not say it again


@cache
def allow_no_cache() -> None:
    """Let numba compile functions that ask for a cache also where it may write to no folder: it refuses to load them otherwise."""
    keep: Any = Dispatcher.enable_caching
    save: Any = FunctionCache.save_overload

    def enable(self: Any) -> None:
        try:
            keep(self)
        except RuntimeError:  # neither beside the source nor in the home of the user
            _tell()

    def save_if_possible(self: Any, signature: Any, data: Any) -> None:
        try:
            save(self, signature, data)
        except OSError:  # a disk that is full since
            _tell()

    Dispatcher.enable_caching = enable  # type: ignore[method-assign]
    FunctionCache.save_overload = save_if_possible  # type: ignore[method-assign]


def _tell() -> None:
    if _TOLD not in os.environ:
        os.environ[_TOLD] = "yes"
        LOG.warning(
            "compiled functions cannot be kept for the next start, as neither this package's folder nor a home can be written: "
            "every start compiles them again, which takes a minute. Name a folder in NUMBA_CACHE_DIR."
        )
