"""Numeric tests on every LAPACK kernel that this processor has, and with one and two threads.

    python -m evidence.kernels             # the numeric half of the suite on all of them (`make validate-kernels`)
    python -m evidence.kernels --marked    # tests marked `kernel`, on Haswell (`make test-kernels`)

OpenBLAS chooses its kernels by the processor, and ``OPENBLAS_CORETYPE`` chooses others. Their last digits differ. Names that stand for the
same kernel run once; the processor's own with one thread is what `make test` runs. Tests that stop a run and go on compare a kernel with
itself, bit for bit, and are left out.
"""

import argparse
import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path

from evidence.pytest_run import ROOT, counted

OWN = ""  # the one that OpenBLAS chooses
# with the word that /proc/cpuinfo has where a processor can run it
KERNELS = {OWN: "", "Haswell": "avx2", "Prescott": "pni", "Sandybridge": "avx", "Zen": "avx2", "SkylakeX": "avx512f"}
MARKED = "Haswell"
OTHERS = re.compile(r"stickslip\.(cli|report)\b|\bsubprocess\b|\btest_cli\b|\bbrowser\b")
MARK = "mark.kernel"
SHARES = 5  # of the files of the numeric half, some minutes each
STOPPED = "interrupted or resum or goes_on"  # tests that go on after a stop

LOADED = """
import ctypes, pathlib, numpy, scipy.linalg
found = []
for package in (numpy, scipy):
    libraries = pathlib.Path(package.__file__).parent.parent / f"{package.__name__}.libs"
    for path in sorted(libraries.glob("*openblas*")):
        library = ctypes.CDLL(str(path))
        for name in ("scipy_openblas_get_corename64_", "scipy_openblas_get_corename"):
            if hasattr(library, name):
                asked = getattr(library, name)
                asked.restype = ctypes.c_char_p
                found.append(asked().decode())
print(*found)
"""


def environment(kernel: str, threads: int = 1) -> dict[str, str]:
    """Return the variables of a process that is to use a kernel."""
    others = {k: v for k, v in os.environ.items() if k != "OPENBLAS_CORETYPE"}
    number = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), str(threads))
    return {**others, **number, **({"OPENBLAS_CORETYPE": kernel} if kernel else {})}


def loaded(kernel: str) -> str:
    """Return the names of the kernels that numpy and scipy load; empty where they have another BLAS."""
    command = [sys.executable, "-c", LOADED]
    return subprocess.run(command, env=environment(kernel), capture_output=True, text=True, check=True).stdout.strip()


def processor() -> set[str]:
    """Return what the processor can do, by the words of Linux; nothing on other systems."""
    path = Path("/proc/cpuinfo")
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    flags = re.search(r"^flags\s*:(.*)$", text, re.MULTILINE)
    return set(flags[1].split()) if flags else set()


@cache
def to_run(kernels: tuple[str, ...]) -> tuple[list[str], list[str]]:
    """Return the kernels that are to run, and a line for each that is not."""
    able = processor()
    seen: dict[str, str] = {}
    chosen: list[str] = []
    left: list[str] = []
    for kernel in kernels:
        if KERNELS[kernel] and KERNELS[kernel] not in able:
            left.append(f"{kernel}: this processor lacks {KERNELS[kernel]}")
            continue
        name = loaded(kernel)
        if kernel and name in seen:
            left.append(f"{kernel}: {name or 'no OpenBLAS'}, as {seen[name] or 'without a choice'}")
            continue
        seen[name] = kernel
        chosen.append(kernel)
    return chosen, left


def numeric_files() -> list[Path]:
    """Return the test modules of numbers: those that import numpy and start no program, and all with a test marked `kernel`."""
    found = []
    for path in sorted((ROOT / "tests").glob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        if MARK in text or ("import numpy" in text and not OTHERS.search(text)):
            found.append(path)
    return found


def pieces() -> list[tuple[str, Callable[[int], Counter[str]]]]:
    """Return what runs the numeric half, some files each, with a name of each: on each other kernel, and on the processor's own with two threads."""
    kernels, _ = to_run(tuple(KERNELS))
    found = [(kernel, 1) for kernel in kernels if kernel != OWN]
    return [
        (
            f"{kernel or 'own kernel'}, threads {threads}, files {share + 1} of {SHARES}",
            partial(_numeric, kernel, threads, share),
        )
        for kernel, threads in [*found, (OWN, 2)]
        for share in range(SHARES)
    ]


def told() -> list[str]:
    """Return what this processor's own kernel is, and a line for each kernel that does not run."""
    return [f"the processor's own kernel is {loaded(OWN)}", *to_run(tuple(KERNELS))[1]]


def _numeric(kernel: str, threads: int, share: int, workers: int) -> Counter[str]:
    files = numeric_files()[share::SHARES]
    return _counted(kernel, threads, workers, ["-m", "not validation", "-k", f"not ({STOPPED})", *files])


def marked(workers: int) -> Counter[str]:
    """Run the tests marked `kernel` on Haswell, unless the processor's own kernel, which `make test` runs, is that; return the counts."""
    kernels, same = to_run((OWN, MARKED))
    print(*same, sep="\n", flush=True)
    files = [path for path in numeric_files() if MARK in path.read_text(encoding="utf-8")]
    words = ["-m", "kernel and not validation", *files]
    total: Counter[str] = Counter(left_out=len(same))
    for kernel in kernels[1:]:
        total += _counted(kernel, 1, workers, words)
    return total


def _counted(kernel: str, threads: int, workers: int, words: Sequence[object]) -> Counter[str]:
    name = f"{kernel or 'own kernel'} ({loaded(kernel)}), {threads} thread{'s'[: threads - 1]}"
    print(f"--- {name}", flush=True)
    found = counted(["-q", "-n", workers, *words], environment(kernel, threads))
    print(f"--- {name}: {found['passed']} passed, {found['failed']} failed", flush=True)
    return found


def main() -> int:
    """Run what the command line asks for; 1 if a test fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--marked", action="store_true", help="tests marked `kernel` alone")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    print(*told(), sep="\n", flush=True)
    runs = [marked] if options.marked else [run for _, run in pieces()]
    return 1 if sum(run(options.workers)["failed"] for run in runs) else 0


if __name__ == "__main__":
    sys.exit(main())
