"""Settings of the whole suite.

Property tests are repeatable and have no time limit per example.
"""

import gc
import sys
from collections.abc import Iterator
from typing import Any

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


@pytest.fixture(scope="module")
def peak_alone() -> Iterator[None]:
    """Leave out the solutions beside the peak: more modes, fewer points, softer contacts, other motions, less retention.

    They take a quarter of a small forced response. A module asks for this fixture if none of its tests looks at them;
    `test_peak_trust`, `test_forced_records`, `test_contact_stiffness` and `test_verdicts` test them.
    """
    from stickslip.analyses.forced_response import analysis, problem
    from stickslip.analyses.forced_response.physics.model_change import NO_SHIFT

    with pytest.MonkeyPatch.context() as here:
        here.setattr(analysis, "peak_shift", lambda *_: NO_SHIFT)
        for name in ("model_changes", "stiffness_changes", "motions_elsewhere"):
            here.setattr(analysis, name, lambda *_: {})
        here.setattr(problem, "more_modes", lambda *_: None)
        yield


@pytest.fixture(scope="module")
def parts_once() -> Iterator[None]:
    """Make each part of the studies of a module once, as the cases of one study do: by the digest of all that it depends on."""
    from stickslip.study.models.parts import Workshop, digest

    part, made = Workshop.part, dict[str, Any]()

    def found(self: Workshop, name: str) -> Any:
        key = digest(self.tables, name, self.home)
        if key in made:
            self.memo.setdefault(key, made[key])
        made[key] = part(self, name)
        return made[key]

    with pytest.MonkeyPatch.context() as here:
        here.setattr(Workshop, "part", found)
        yield


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
