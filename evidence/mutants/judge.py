"""Whether tests notice a mutant: they run in a copy of the tree, cheapest first, until one fails."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from evidence.mutants.points import Mutant

START_S = 60.0  # CPU of a start of Python and pytest, with compiling
SLOWER = 4.0  # than when it was recorded: a test that takes so many times as long does not end
WAITING = 15.0  # wall time over CPU on a machine that others use
OPTIONS = ["-x", "-q", "--tb=no", "-p", "no:cacheprovider", "-p", "no:cov", "-o", "faulthandler_timeout=0"]
LEFT_OUT = ("*.git", ".venv*", "__pycache__", "results", "out", "dist", "_build", ".*_cache")
# loaded once, before any mutant: what no mutant changes
LOADED = (
    "numpy",
    "scipy.sparse.linalg",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.integrate",
    "scipy.interpolate",
    "scipy.spatial",
    "numba",
    "xarray",
    "pandas",
    "pydantic",
    "h5netcdf",
    "jinja2",
    "plotly",
    "typer",
    "rich.console",
)
PASSED = 0  # code of pytest


@dataclass(frozen=True)
class Judged:
    """What became of a mutant.

    Attributes
    ----------
    mutant
        Which.
    by
        The test that noticed it, or what happened; empty: none did.
    ran, reach
        How many tests were to run, and how many reach it.
    """

    mutant: Mutant
    by: str
    ran: int
    reach: int


class Copy:
    """A copy of a tree that mutants are written into, outside of the checkout."""

    def __init__(self, root: Path, folder: Path, loaded: Sequence[str] = LOADED) -> None:
        self.root = folder
        _copy(root, folder)
        self.known: dict[str, bool] = {}
        self.package = folder / "src" / "stickslip"
        paths = os.pathsep.join([str(folder / "src"), str(folder)])
        self.environment = os.environ | {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
        self.server = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("server.py")), *loaded],
            cwd=folder,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=self.environment,
        )
        self.compiled = {file: (file.read_bytes(), file.stat()) for file in self.package.rglob("*.nb[ic]")}

    def judge(self, mutant: Mutant, tests: Sequence[str], cpu_s: float) -> str:
        """Run tests with a mutant in place, and return what `failing` does.

        Parameters
        ----------
        mutant
            Which.
        tests
            Their names, in the order in which they run.
        cpu_s
            What they took without it, s.
        """
        file = self.package / mutant.path
        source, stat = file.read_bytes(), file.stat()
        file.write_text(mutant.applied(source.decode()), encoding="utf-8")
        try:
            return self.failing(tests, cpu_s)
        finally:
            file.write_bytes(source)
            os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))
            self._restore_compiled()

    def failing(self, tests: Sequence[str], cpu_s: float) -> str:
        """Return the first test that fails, or what ended all of them; empty if none does."""
        if not tests:
            return ""
        limit = START_S + SLOWER * cpu_s
        listed, said = self.root / ".mutant_tests", self.root / ".mutant_said"
        listed.write_text("\n".join(tests), encoding="utf-8")
        asked = {
            "tests": str(listed),
            "said": str(said),
            "failed": str(self.root / ".mutant_failed"),
            "options": OPTIONS,
            "cpu_s": limit,
            "wall_s": WAITING * limit,
        }
        assert self.server.stdin is not None
        assert self.server.stdout is not None
        print(json.dumps(asked), file=self.server.stdin, flush=True)
        answer = json.loads(self.server.stdout.readline())
        text = said.read_text(encoding="utf-8", errors="replace")
        return _what_failed(answer["code"], answer["failed"], text)

    def collected(self) -> set[str]:
        """Return the tests that pytest finds without a mutant."""
        asked = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", "-p", "no:cov"]
        done = subprocess.run(asked, cwd=self.root, env=self.environment, capture_output=True, text=True, check=True)
        return {line for line in done.stdout.splitlines() if line.startswith("tests/") and "::" in line}

    def passes(self, test: str, cpu_s: float) -> bool:
        """Return whether a test passes here without a mutant; asked once of each."""
        if test not in self.known:
            self.known[test] = not self.failing([test], cpu_s)
        return self.known[test]

    def close(self) -> None:
        """End the process that runs tests."""
        self.server.communicate()

    def _restore_compiled(self) -> None:
        """Put back the compiled functions of the sources without a mutant."""
        for file in self.package.rglob("*.nb[ic]"):
            if file not in self.compiled:
                file.unlink()
        for file, (own, stat) in self.compiled.items():
            if not file.exists() or file.stat().st_mtime_ns != stat.st_mtime_ns:
                file.write_bytes(own)
                os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))


def _copy(root: Path, folder: Path) -> None:
    """Copy what git knows or might know, and the compiled functions."""
    shutil.copytree(root, folder, ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=True)
    for file in (root / "src").rglob("*.nb[ic]"):
        there = folder / file.relative_to(root)
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(file, there)


def _what_failed(code: int, failed: str, said: str) -> str:
    """Return the test that failed by the code of pytest, or what else ended it; empty where all passed."""
    if code == PASSED or failed:
        return failed
    last = " ".join(said.splitlines()[-2:])
    if code < 0:
        return f"no end, or a crash ({signal.Signals(-code).name})"
    return f"pytest cannot begin: {last}"
