"""Settings of the whole suite.

Property tests are repeatable and have no time limit per example.
"""

import gc
import sys
from collections.abc import Iterator

import pytest
from browser import Browser
from hypothesis import HealthCheck, settings

settings.register_profile(
    "repeatable", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """One browser for all pages; see `needs_browser`."""
    with Browser(tmp_path_factory.mktemp("profile")) as started:
        yield started


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Look for no garbage while tests are collected: what is made there stays, and to look through it takes a sixth of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_finish() -> None:
    """Look at each figure of the report that a test draws, where a test file that was collected draws any."""
    if "stickslip.report.plot" in sys.modules:
        from drawn import look_at_each_plot

        look_at_each_plot()
