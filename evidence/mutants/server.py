"""Runs tests in forks of one process that has loaded what a mutant cannot change: a line of JSON in, a line of JSON out.

A script, so that nothing of this repository is loaded before a fork: ``python server.py MODULES``, in the folder
of the tests.
"""

import contextlib
import importlib
import json
import os
import resource
import signal
import sys
import time
import traceback
from pathlib import Path
from typing import Any

import pytest

MEMORY = 8 << 30  # bytes that a mutant may ask for
FAULT = 3  # code of pytest for a fault of its own
STEP_S = 0.05  # between looks at a process


def main() -> None:
    """Serve until standard input ends."""
    for name in sys.argv[1:]:
        try:
            importlib.import_module(name)
        except ImportError:  # it is optional
            continue
    for text in sys.stdin:
        asked = json.loads(text)
        failed = Path(asked["failed"])
        failed.write_text("", encoding="utf-8")
        print(json.dumps({"code": _forked(asked), "failed": failed.read_text()}), flush=True)


def _forked(asked: dict[str, Any]) -> int:
    """Return how pytest ended: its code, or minus the signal that ended it."""
    child = os.fork()
    if child == 0:
        _run(asked)
    end = time.monotonic() + asked["wall_s"]
    while True:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            _kill_group(child)  # what it has left running
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > end:
            _kill_group(child)
        time.sleep(STEP_S)


def _kill_group(child: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)


class _First:
    """Writes down the first test that fails."""

    def __init__(self, where: str) -> None:
        self.where = Path(where)

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.where.write_text(report.nodeid, encoding="utf-8")


def _run(asked: dict[str, Any]) -> None:
    """Run pytest and end."""
    os.setsid()
    limit = int(asked["cpu_s"])
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    said = os.open(asked["said"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.dup2(said, 1)
    os.dup2(said, 2)
    code = FAULT
    try:
        tests = Path(asked["tests"]).read_text(encoding="utf-8").split("\n")
        code = int(pytest.main([*asked["options"], *tests], plugins=[_First(asked["failed"])]))
        sys.stdout.flush()
    except BaseException:  # noqa: BLE001  what a mutant raises is told
        os.write(2, traceback.format_exc().encode())
    finally:
        os._exit(code)


if __name__ == "__main__":
    main()
