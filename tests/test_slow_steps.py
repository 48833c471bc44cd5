"""Lines about slow steps: only where they are asked for, and only of steps that take long."""

import time

import pytest

from stickslip.model import slow_steps
from stickslip.model.slow_steps import LOG, MANY_DOFS, step, told_when_slow


@pytest.fixture(autouse=True)
def _soon(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    caplog.set_level("INFO", logger=LOG.name)
    monkeypatch.setattr(slow_steps, "AFTER_S", 0.02)


def lines(caplog: pytest.LogCaptureFixture) -> list[str]:
    """The lines, without what is for the display alone."""
    return [r.getMessage() for r in caplog.records if not hasattr(r, "fraction")]


def test_a_slow_step_says_its_line_while_it_runs(caplog: pytest.LogCaptureFixture) -> None:
    with told_when_slow("ratio = 2"), step("reducing 7 dofs"):
        for _ in range(1000):  # ten seconds: a loaded machine starts threads late
            if lines(caplog):
                break
            time.sleep(0.01)
        assert lines(caplog) == ["ratio = 2: reducing 7 dofs"]


def test_a_quick_step_and_one_that_nobody_asked_for_say_nothing(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    with step("asked for by nobody", MANY_DOFS + 1):
        time.sleep(0.1)
    monkeypatch.setattr(slow_steps, "AFTER_S", 1.0)  # no loaded machine takes so long for nothing
    with told_when_slow():
        for _ in range(3):
            with step("quick"):
                pass
    time.sleep(1.5)
    assert lines(caplog) == []


def test_a_step_on_many_dofs_says_its_line_at_once(caplog: pytest.LogCaptureFixture) -> None:
    with told_when_slow(), step("large", MANY_DOFS + 1):
        assert lines(caplog) == ["large"]
