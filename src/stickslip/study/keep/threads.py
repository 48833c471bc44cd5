"""How many threads BLAS takes: said before NumPy is loaded, or to the libraries that NumPy and SciPy have loaded."""

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

BLAS_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
SAID = any(name in os.environ for name in BLAS_THREADS)  # by the user: what comes later is ours
# where the wheels of NumPy and SciPy keep OpenBLAS, and what they call its functions
FOLDERS = ("{0}.libs", "{0}/.dylibs")
NAMES = ("scipy_openblas_{0}_num_threads64_", "scipy_openblas_{0}_num_threads")


def one_blas_thread() -> None:
    """Give BLAS one thread, before NumPy is loaded, unless the user said how many.

    The matrices of a run have a few hundred rows: more threads wait for each other, and where other programs want the cores they
    take ten times as long.
    """
    if not any(name in os.environ for name in BLAS_THREADS):
        for name in BLAS_THREADS[1:]:
            os.environ[name] = "1"


@contextmanager
def one_loaded_blas_thread() -> Iterator[None]:
    """Give the loaded OpenBLAS of NumPy and SciPy one thread while the block runs, unless the user said how many.

    Sums then have the order, and so the bits, of a run of the command. Other BLAS libraries are left alone.
    """
    with ExitStack() as after:
        for get, put in [] if SAID else _loaded():
            after.callback(put, get())
            put(1)
        yield


def _loaded() -> list[tuple[Callable[[], int], Callable[[int], Any]]]:
    """Return the functions that get and set the number of threads of each OpenBLAS in a wheel of NumPy or SciPy."""
    found = []
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
