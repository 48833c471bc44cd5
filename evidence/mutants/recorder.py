"""A pytest plugin that records which lines each test reaches, and what it costs: ``-p evidence.mutants.recorder``.

What an earlier test has left in the caches of functions of tests and evidence is forgotten at the start of each file,
so that the tests of a file reach what they need themselves.
"""

import functools
import gc
import json
import os
from collections.abc import Generator
from pathlib import Path
from typing import Any

import coverage
import pytest

WHERE = "STICKSLIP_REACH"  # in the environment: the file that is written


class Recorder:
    """Switches coverage from test to test."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.coverage = coverage.Coverage(data_file=where, source_pkgs=["stickslip"], config_file=False)
        self.file = ""
        self.cpu: dict[str, float] = {}
        self.failed: list[str] = []
        self.coverage.start()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: Any) -> Generator[None, Any, Any]:
        """Let lines be those of this test."""
        file = item.nodeid.partition("::")[0]
        if file != self.file:
            self.file = file
            _forget()
        self.coverage.switch_context(item.nodeid)
        before = _cpu()
        try:
            return (yield)
        finally:
            self.cpu[item.nodeid] = _cpu() - before
            self.coverage.switch_context("")

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Remember what fails without any mutant."""
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_unconfigure(self) -> None:
        """Write what was found."""
        self.coverage.stop()
        self.coverage.save()
        said = {"cpu_s": self.cpu, "failed": self.failed}
        Path(f"{self.where}.json").write_text(json.dumps(said), encoding="utf-8")


def pytest_configure(config: Any) -> None:
    """Begin."""
    config.pluginmanager.register(Recorder(os.environ[WHERE]))


def _cpu() -> float:
    """Return the CPU of this process and of those that it waited for, s."""
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


def _forget() -> None:
    """Empty the caches of functions of tests and evidence."""
    kept = type(functools.cache(len))
    for one in gc.get_objects():
        if isinstance(one, kept):
            module = str(getattr(one, "__module__", ""))
            if not module.startswith(("stickslip", "numba", "xarray")) and (
                module.startswith(("evidence", "test_")) or Path("tests", f"{module}.py").exists()
            ):
                one.cache_clear()
