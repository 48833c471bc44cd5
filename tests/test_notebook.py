"""Progress in a notebook: one output, renewed in place."""

import logging

import pytest

from stickslip.api.screen import NotebookScreen, in_notebook, on_screen
from stickslip.study.store.progress import LOG, advance, at_work, tell


class Output:
    """What IPython gives for a display with an id."""

    def __init__(self) -> None:
        self.shown: list[dict[str, str]] = []

    def update(self, data: dict[str, str], *, raw: bool) -> None:
        assert raw
        self.shown.append(data)


def test_each_job_has_a_line_and_what_is_doubtful_stands_below() -> None:
    output = Output()
    with on_screen(NotebookScreen(output)):
        LOG.info("150.00 Hz", extra={"fraction": 0.5, "job": "case <1>"})
        with at_work("case <2>"):
            LOG.info("a line that nobody needs")
            tell("doubtful", "too few harmonics")
            advance(1.0, "case <2>")
    last = output.shown[-1]
    first, second, told = last["text/plain"].splitlines()
    assert first == f"case <1> {'█' * 12}{'░' * 12}  50 % 150.00 Hz"
    assert second == f"case <2> {'█' * 24} 100 % done"
    assert told == "DOUBTFUL: too few harmonics"
    assert "case &lt;1&gt;" in last["text/html"]


def test_a_notebook_is_known_by_its_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys
    from types import SimpleNamespace

    assert not in_notebook()
    shell = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))
    assert in_notebook()
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=object))
    assert not in_notebook()


def test_nothing_is_shown_where_nothing_is_told() -> None:
    output = Output()
    with on_screen(NotebookScreen(output)):
        logging.getLogger("stickslip").debug("not for users")
    assert output.shown == []
