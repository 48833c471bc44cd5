"""Numeric tests on every LAPACK kernel that this processor has, and with one and two threads.

    python -m evidence.kernels             # the numeric half of the suite on all of them (`make validate-kernels`)
    python -m evidence.kernels --marked    # tests marked `kernel`, on the processor's own kernel and on Haswell (`make test-kernels`)

OpenBLAS chooses its kernels by the processor, and ``OPENBLAS_CORETYPE`` chooses others. Their last digits differ. Names that stand for the
same kernel run once.
"""

import argparse
import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

from evidence.pytest_run import ROOT, counted

OWN = ""  # the one that OpenBLAS chooses
# with the word that /proc/cpuinfo has where a processor can run it
KERNELS = {OWN: "", "Haswell": "avx2", "Prescott": "pni", "Sandybridge": "avx", "Zen": "avx2", "SkylakeX": "avx512f"}  # fmt: skip
MARKED = (OWN, "Haswell")
THREADS = (1, 2)
OTHERS = re.compile(r"stickslip\.(cli|report)\b|\bsubprocess\b|\btest_cli\b|\bbrowser\b")
MARK = "mark.kernel"

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
    return subprocess.run(
        command, env=environment(kernel), capture_output=True, text=True, check=True
    ).stdout.strip()


def processor() -> set[str]:
    """Return what the processor can do, by the words of Linux; nothing on other systems."""
    path = Path("/proc/cpuinfo")
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    flags = re.search(r"^flags\s*:(.*)$", text, re.MULTILINE)
    return set(flags[1].split()) if flags else set()


def to_run(kernels: tuple[str, ...]) -> tuple[list[str], list[str]]:
    """Return the kernels that are to run, and a line for each that is not."""
    able, seen, chosen, told = processor(), {}, [], []
    for kernel in kernels:
        if KERNELS[kernel] and KERNELS[kernel] not in able:
            told.append(f"{kernel}: this processor lacks {KERNELS[kernel]}")
            continue
        name = loaded(kernel)
        if kernel and name in seen:
            told.append(f"{kernel}: {name or 'no OpenBLAS'}, as {seen[name] or 'without a choice'}")
            continue
        seen[name] = kernel
        chosen.append(kernel)
    return chosen, told


def numeric_files() -> list[Path]:
    """Return the test modules of numbers: those that import numpy and start no program, and all with a test marked `kernel`."""
    found = []
    for path in sorted((ROOT / "tests").glob("test_*.py")):
        text = path.read_text(encoding="utf-8")
        if MARK in text or ("import numpy" in text and not OTHERS.search(text)):
            found.append(path)
    return found


def run(workers: int, *, marked: bool = False) -> Counter[str]:
    """Run the tests on each kernel, those of the processor's own with two threads, too; return the counts of all runs."""
    kernels, told = to_run(MARKED if marked else tuple(KERNELS))
    print(*told, sep="\n", flush=True)
    files = (
        [path for path in numeric_files() if MARK in path.read_text(encoding="utf-8")]
        if marked
        else numeric_files()
    )
    mark = "kernel and not validation" if marked else "not validation"
    total: Counter[str] = Counter(left_out=len(told))
    for kernel in kernels:
        for threads in THREADS if kernel == OWN and not marked else THREADS[:1]:
            name = (
                f"{kernel or 'own kernel'} ({loaded(kernel)}), {threads} thread{'s'[: threads - 1]}"
            )
            print(f"--- {name}", flush=True)
            own = ["-q", "-n", max(1, workers // threads), "-m", mark, *files]
            found = counted(own, environment(kernel, threads))
            print(f"--- {name}: {found['passed']} passed, {found['failed']} failed", flush=True)
            total += found
    return total


def main() -> int:
    """Run what the command line asks for; 1 if a test fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--marked", action="store_true", help="tests marked `kernel` alone")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    return 1 if run(options.workers, marked=options.marked)["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
