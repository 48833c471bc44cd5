"""A pytest plugin that records which marks (see `probes`) each test makes, and what it costs: ``-p evidence.mutants.recorder``.

What a cached function or a fixture of several tests has reached when it was computed counts for each test that uses it.
"""

import builtins
import functools
import json
import os
import re
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from evidence.mutants.probes import MARKS, WHERE

OWN = ("stickslip", "evidence", "test_")  # beginnings of modules whose cached functions outlive a test
MARKED = re.compile(b"\1")


class Marks:
    """The marks of this process and of those that it starts."""

    def __init__(self) -> None:
        self.made = getattr(builtins, MARKS)
        self.none = bytes(len(self.made))
        self.added: dict[int, list[int]] = {}

    def begin(self) -> None:
        """Forget all."""
        self.made[:] = self.none
        self.added.clear()

    def places(self) -> list[int]:
        """Return where marks were made."""
        return [found.start() for found in MARKED.finditer(bytes(self.made))]

    def add(self, places: list[int]) -> None:
        """Make marks, once in a test."""
        if id(places) not in self.added:
            self.added[id(places)] = places
            for place in places:
                self.made[place] = 1

    @contextmanager
    def apart(self) -> Iterator[list[int]]:
        """Collect the marks of what is done inside; they count for those around it, too."""
        before, added = bytes(self.made), dict(self.added)
        self.begin()
        found: list[int] = []
        try:
            yield found
        finally:
            found.extend(self.places())
            self.made[:] = before
            self.added = added
            self.add(found)


class Recorder:
    """Reads the marks after each test."""

    def __init__(self, where: str, marks: Marks) -> None:
        self.where, self.marks = where, marks
        self.cpu: dict[str, float] = {}
        self.reached: dict[str, list[int]] = {}
        self.of_fixtures: dict[Any, list[int]] = {}

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: Any) -> Generator[None, Any, Any]:
        """Let marks be those of this test."""
        self.marks.begin()
        before = _cpu()
        try:
            return (yield)
        finally:
            self.cpu[item.nodeid] = _cpu() - before
            self.reached[item.nodeid] = self.marks.places()

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Generator[None, Any, Any]:
        """Collect what a fixture reaches."""
        with self.marks.apart() as found:
            self.of_fixtures[fixturedef] = found
            return (yield)

    def pytest_runtest_call(self, item: Any) -> None:
        """Add what the fixtures of a test have reached when they were made."""
        for fixture in item._request._fixture_defs.values():  # noqa: SLF001  nothing public tells them
            if fixture in self.of_fixtures:
                self.marks.add(self.of_fixtures[fixture])

    def pytest_unconfigure(self) -> None:
        """Write what was found: for each place the tests as the bits of a number."""
        tests = list(self.cpu)
        bits: dict[int, int] = {}
        for k, test in enumerate(tests):
            for place in self.reached[test]:
                bits[place] = bits.get(place, 0) | 1 << k
        said = {"cpu_s": self.cpu, "tests": tests, "places": {place: hex(own) for place, own in bits.items()}}
        Path(f"{self.where}.said").write_text(json.dumps(said), encoding="utf-8")


def pytest_configure(config: Any) -> None:
    """Begin, before a module with cached functions is imported."""
    marks = Marks()
    plain, plain_lru = functools.cache, functools.lru_cache
    functools.cache = lambda function: _remembering(function, plain, marks)

    def lru_cache(maxsize: Any = 128, typed: bool = False) -> Any:
        if callable(maxsize):
            return _remembering(maxsize, plain_lru, marks)
        return lambda function: _remembering(function, plain_lru(maxsize, typed), marks)

    functools.lru_cache = lru_cache
    config.pluginmanager.register(Recorder(os.environ[WHERE], marks))


def _remembering(function: Any, plain: Any, marks: Marks) -> Any:
    """Return a cached function that makes its marks again where it gives what it has computed."""
    module = str(getattr(function, "__module__", ""))
    helper = not module.startswith(OWN) and not Path("tests", f"{module}.py").exists()
    if helper or "<locals>" in getattr(function, "__qualname__", "<locals>"):
        return plain(function)

    def computed(*args: Any, **named: Any) -> tuple[Any, list[int]]:
        with marks.apart() as found:
            return function(*args, **named), found

    kept = plain(computed)

    @functools.wraps(function)
    def remembering(*args: Any, **named: Any) -> Any:
        value, found = kept(*args, **named)
        marks.add(found)
        return value

    made: Any = remembering
    made.cache_clear, made.cache_info = kept.cache_clear, kept.cache_info
    return made


def _cpu() -> float:
    """Return the CPU of this process and of those that it waited for, s."""
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system
