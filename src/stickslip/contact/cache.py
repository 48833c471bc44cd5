"""numba as this package uses it: whoever takes `njit` from here has the cache of compiled functions looked after, and long compiling said.

Nothing that is needed to judge a study file imports this module: numba takes a quarter of a second to load.
"""

import hashlib
import logging
import os
import re
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import FunctionCache, _SourceFileBackedLocatorMixin
from numba.core.dispatcher import Dispatcher

from stickslip.contact.compiling import say_what_is_compiled

LOG = logging.getLogger("stickslip")
_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(r"^\s*from stickslip\.([\w.]+) import", re.MULTILINE)
_TOLD = "STICKSLIP_UNCACHED"  # in the environment: worker processes need not say it again


def _look_after_the_cache() -> None:
    """Let numba compile functions that ask for a cache also where it may write to no folder, at every start: it refuses to load them otherwise.

    What another version of this package has left in the cache, with types that are gone, is compiled again. So is a function whose file
    imports one that has changed: numba looks at the function's own file only, and would go on with the constants and functions of before.
    """
    keep: Any = Dispatcher.enable_caching
    read: Any = FunctionCache.load_overload
    save: Any = FunctionCache.save_overload
    stamp: Any = _SourceFileBackedLocatorMixin.get_source_stamp

    def stamp_with_imports(self: Any) -> Any:
        return stamp(self), _contents(Path(self._py_file))

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

    def load_if_known(self: Any, signature: Any, target_context: Any) -> Any:
        try:
            return read(self, signature, target_context)
        except (
            AttributeError,
            ImportError,
        ):  # while the list of what is kept is read, before its age is looked at
            self.flush()
            return None

    _SourceFileBackedLocatorMixin.get_source_stamp = stamp_with_imports  # type: ignore[method-assign]
    Dispatcher.enable_caching = enable  # type: ignore[method-assign]
    FunctionCache.load_overload = load_if_known  # type: ignore[method-assign]
    FunctionCache.save_overload = save_if_possible  # type: ignore[method-assign]


@cache
def _contents(file: Path) -> str:
    """Return the digest of all files of this package that a file imports, directly or through others."""
    found: set[Path] = set()
    to_do = [file]
    while to_do:
        for name in _IMPORT.findall(to_do.pop().read_text(encoding="utf-8")):
            path = _PACKAGE.joinpath(*name.split(".")).with_suffix(".py")
            if path not in found and path.is_file():
                found.add(path)
                to_do.append(path)
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(found))).hexdigest()


def _tell() -> None:
    if _TOLD not in os.environ:
        os.environ[_TOLD] = "yes"
        LOG.warning(
            "compiled functions cannot be kept for the next start, as neither this package's folder nor a home can be written: "
            "every start compiles them again, which takes a minute. Name a folder in NUMBA_CACHE_DIR."
        )


# before any function is compiled
_look_after_the_cache()
say_what_is_compiled()
njit = numba.njit
