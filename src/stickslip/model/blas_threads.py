"""Number of BLAS threads: one for small matrices, all for a large factorisation.

The matrices of a response have a few hundred rows. Several threads wait for each other there: with two, a response point
that needs 9 ms of work takes 220 ms of processor time. With one thread, sums have the same order in every run, so results
in Python equal those of the command line bit by bit.
"""

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from importlib.util import find_spec
from inspect import isgeneratorfunction
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar, cast

BLAS_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
SAID = any(name in os.environ for name in BLAS_THREADS)  # set by the user; later values come from this package
# folders of OpenBLAS in the wheels of NumPy and SciPy, and the names of its functions there
FOLDERS = ("{0}.libs", "{0}/.dylibs")
NAMES = ("scipy_openblas_{0}_num_threads64_", "scipy_openblas_{0}_num_threads")
MIN_THREADED_ROWS = 1500  # rows of a dense matrix above which several threads factorise it faster

Counts = list[tuple[Callable[[], int], Callable[[int], Any]]]
F = TypeVar("F", bound=Callable[..., Any])


@cache
def loaded() -> Counts:
    """Return the functions that get and set the number of threads, for each OpenBLAS bundled with NumPy or SciPy."""
    found: Counts = []
    for package in ("numpy", "scipy"):
        spec = find_spec(package)
        site = Path(str(spec.origin)).parents[1] if spec is not None else Path()
        files = [f for folder in FOLDERS for f in site.glob(f"{folder.format(package)}/*openblas*")]
        for library in map(ctypes.CDLL, map(str, files)):
            pairs = [(name.format("get"), name.format("set")) for name in NAMES]
            found += [
                (getattr(library, get), getattr(library, put))
                for get, put in pairs
                if hasattr(library, get) and hasattr(library, put)
            ]
    return found


class _Blocks:
    """Active blocks that limit BLAS to one thread, counted over all Python threads, which share this limit."""

    def __init__(self) -> None:
        self.lock, self.count, self.strict = Lock(), 0, 0
        self.before: list[tuple[Callable[[int], Any], int]] = []

    def begin(self, *, strict: bool) -> None:
        with self.lock:
            if not self.count:
                self.before = [(put, get()) for get, put in loaded()]
                self.put(1)
            self.count += 1
            self.strict += strict

    def end(self, *, strict: bool) -> None:
        with self.lock:
            self.count -= 1
            self.strict -= strict
            if not self.count:
                self.put()

    def put(self, most: int | None = None) -> None:
        for put, count in self.before:
            put(count if most is None else most)


_BLOCKS = _Blocks()


@contextmanager
def one_loaded_blas_thread(*, strict: bool = True) -> Iterator[None]:
    """Limit the OpenBLAS of NumPy and SciPy to one thread within the block, unless the user set a number.

    Other BLAS libraries are not affected.

    Parameters
    ----------
    strict
        Whether large matrices also have one thread: the results of a study then do not depend on the number of threads.
    """
    if SAID:
        yield
        return
    _BLOCKS.begin(strict=strict)
    try:
        yield
    finally:
        _BLOCKS.end(strict=strict)


@contextmanager
def threads_for(rows: int) -> Iterator[None]:
    """Give BLAS all threads within the block if a dense matrix of `rows` rows is large, even inside `by_one_thread`."""
    if rows < MIN_THREADED_ROWS or not _BLOCKS.count or _BLOCKS.strict:
        yield
        return
    _BLOCKS.put()
    try:
        yield
    finally:
        _BLOCKS.put(1)


def by_one_thread(function: F) -> F:
    """Decorate a function or generator: BLAS has one thread while it runs, but not between the steps of a generator."""
    if isgeneratorfunction(function):

        @wraps(function)
        def steps(*words: Any, **named: Any) -> Any:
            made = function(*words, **named)
            try:
                while True:
                    with one_loaded_blas_thread(strict=False):
                        try:
                            step = next(made)
                        except StopIteration as end:
                            return end.value
                    yield step
            finally:
                made.close()

        return cast("F", steps)

    @wraps(function)
    def whole(*words: Any, **named: Any) -> Any:
        with one_loaded_blas_thread(strict=False):
            return function(*words, **named)

    return cast("F", whole)


def one_blas_thread() -> None:
    """Set BLAS to one thread before NumPy is loaded, unless the user has set a number.

    The matrices of a run have a few hundred rows. Several threads wait for each other, and take ten times as long if other programs
    use the cores.
    """
    if not any(name in os.environ for name in BLAS_THREADS):
        for name in BLAS_THREADS[1:]:
            os.environ[name] = "1"
