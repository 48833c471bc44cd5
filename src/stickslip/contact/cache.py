"""Compilation by numba with the package's own cache, whose files have a checksum and the dates of all sources.

Long compilations are announced. numba offers its caches as classes, and the dispatcher of a function has one as an attribute: thus
nothing in numba is replaced, and functions of other programs keep numba's own cache. Modules that check a study file do not import
this one: numba takes a quarter of a second to load.
"""

import hashlib
import io
import logging
import os
import pickle
import re
from collections.abc import Callable
from functools import cache, partial
from inspect import getfile
from pathlib import Path
from threading import Timer
from typing import Any

import numba
from numba.core import event
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.dispatcher import Dispatcher

LOG = logging.getLogger("stickslip")
MARK = b"stickslip: compiled, SHA-256, pickle\n"  # at the beginning of each file
NUMBAS_OWN = b"\x80"  # first byte of numba's own files, which earlier versions of this package used
_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(r"^\s*from stickslip\.([\w.]+) import", re.MULTILINE)
_TOLD = "STICKSLIP_UNCACHED"  # environment variable with which worker processes know that the warning was logged


class CheckedFiles(IndexDataCacheFile):
    """Index and data of one function.

    A file that fails its checksum is deleted with one line in the log; an outdated file is ignored. A file consists of
    `MARK`, the SHA-256 of the rest, and two pickles: the state of its sources, and its content. The index key is stored
    with the data, so that a file with the same name from another or a killed process is not mistaken for this
    function's file.
    """

    def load(self, key: Any) -> Any:
        """Return the data saved under a key; None if missing, damaged or outdated."""
        name = self._load_index().get(key)
        kept = None if name is None else self._read(self._path(name))
        return None if kept is None or kept[0] != key else kept[1]

    def save(self, key: Any, data: Any) -> None:
        """Save data under a key."""
        super().save(key, (key, data))  # type: ignore[no-untyped-call]

    def _load_index(self) -> dict[Any, str]:
        try:
            return self._read(self._index_path) or {}
        except OSError:
            raise
        except Exception:  # noqa: BLE001  a pickle of types that are gone fails in any way
            return {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, overloads)

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._path(name), data)

    def _path(self, name: str) -> str:
        return str(self._data_path(name))  # type: ignore[no-untyped-call]

    def _age(self) -> Any:
        return self._version, self._source_stamp

    def _write(self, path: str, content: Any) -> None:
        kept: bytes = self._dump(content)  # type: ignore[no-untyped-call]
        both = pickle.dumps(self._age()) + kept
        with self._open_for_write(path) as stream:
            stream.write(MARK + hashlib.sha256(both).digest() + both)

    def _read(self, path: str) -> Any:
        """Return the content of a file; None if there is no usable one."""
        file = Path(path)
        if not file.exists():
            return None
        content = file.read_bytes() if file.is_file() else b""
        head = len(MARK) + hashlib.sha256().digest_size
        both = content[head:]
        if content[:head] != MARK + hashlib.sha256(both).digest():
            if content[:1] != NUMBAS_OWN:
                LOG.warning("%s is damaged: the function is compiled again", path)
            file.unlink()
            return None
        stream = io.BytesIO(both)
        return pickle.load(stream) if pickle.load(stream) == self._age() else None


class CheckedCache(FunctionCache):
    """numba's cache of one function, with `CheckedFiles`.

    A file that cannot be read or written costs a compilation, but never stops the program.

    Parameters
    ----------
    py_func
        The function.

    Raises
    ------
    RuntimeError
        If numba finds no writable folder.
    """

    def __init__(self, py_func: Any) -> None:
        super().__init__(py_func)  # type: ignore[no-untyped-call]
        stamp = self._impl.locator.get_source_stamp(), _contents(Path(getfile(py_func)))
        self._cache_file = CheckedFiles(
            cache_path=self._cache_path, filename_base=self._impl.filename_base, source_stamp=stamp
        )  # type: ignore[no-untyped-call]

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function of a signature; None if it must be compiled."""
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:  # noqa: BLE001  as above, of the compiled code; or nothing can be read
            self._forget()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save the compiled function of a signature, if a file can be written."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except OSError:  # a disk that is full since
            tell_uncached()

    def _forget(self) -> None:
        try:
            self.flush()  # type: ignore[no-untyped-call]
        except OSError:
            tell_uncached()


@cache
def _contents(file: Path) -> str:
    """Return the digest of all files of this package that a file imports, directly or indirectly.

    numba checks only the function's own file, and would otherwise use old constants and functions.
    """
    found: set[Path] = set()
    to_do = [file] if file.is_file() else []
    while to_do:
        for name in _IMPORT.findall(to_do.pop().read_text(encoding="utf-8")):
            path = _PACKAGE.joinpath(*name.split(".")).with_suffix(".py")
            if path not in found and path.is_file():
                found.add(path)
                to_do.append(path)
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(found))).hexdigest()


def tell_uncached() -> None:
    """Log, once in all processes, that compiled functions cannot be stored."""
    if _TOLD not in os.environ:
        os.environ[_TOLD] = "yes"
        LOG.warning(
            "compiled functions cannot be kept for the next start, as neither this package's folder nor a home can be written: "
            "every start compiles them again, which takes a minute. Name a folder in NUMBA_CACHE_DIR."
        )


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
