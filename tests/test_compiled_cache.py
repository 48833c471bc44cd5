"""The cache of compiled functions: what another version of the code left there does no harm."""

import importlib
import subprocess
import sys
import time

import numba
import pytest

import stickslip.contact
from stickslip.contact import cache, compiling

SOURCE = """
from typing import NamedTuple
import numba

class {name}(NamedTuple):
    a: float

@numba.njit(cache=True)
def double(pair):
    return 2.0 * pair.a
"""


def test_types_that_are_gone_are_compiled_again(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("Before", "After"):
        (tmp_path / "versioned.py").write_text(SOURCE.format(name=name))
        sys.modules.pop("versioned", None)
        importlib.invalidate_caches()
        module = importlib.import_module("versioned")
        assert module.double(getattr(module, name)(1.5)) == 3.0
    monkeypatch.delitem(sys.modules, "versioned")


USED = "FACTOR = {factor}\n"
USER = """
import numba
from stickslip.used import FACTOR

@numba.njit(cache=True)
def times(x):
    return FACTOR * x
"""


def test_a_function_is_compiled_again_when_a_file_that_it_imports_has_changed(
    tmp_path, monkeypatch
):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(cache, "_PACKAGE", tmp_path)
    # Python tells files of the same second and size apart by nothing, and would load the first one's bytecode
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    (tmp_path / "user.py").write_text(USER)
    for factor in (2.0, 3.0, 3.0):
        cache._contents.cache_clear()
        (tmp_path / "used.py").write_text(USED.format(factor=factor))
        for name in ("user", "stickslip.used"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        monkeypatch.setattr(stickslip, "__path__", [*stickslip.__path__, str(tmp_path)])
        times = importlib.import_module("user").times
        assert times(1.0) == factor
    assert sum(times.stats.cache_hits.values()) == 1, "nothing had changed, and yet it was compiled"
    for name in ("user", "stickslip.used"):
        monkeypatch.delitem(sys.modules, name)


@pytest.mark.parametrize("patience", [0.0, 1e3])
def test_what_takes_long_to_compile_is_said_once(patience, monkeypatch, caplog):
    monkeypatch.setattr(compiling, "PATIENCE", patience)
    monkeypatch.setattr(compiling._LISTENER, "told", False)
    with caplog.at_level("INFO", "stickslip"):
        for number in range(2):
            assert numba.njit(lambda x, n=number: (x + n) ** 2)(1.0) == (1 + number) ** 2
        time.sleep(0.05)
    said = [r for r in caplog.records if r.getMessage() == compiling.LINE]
    assert len(said) == (patience == 0.0)


ASKED = """
import numba
from stickslip.contact import event_integrals, events, interface, intervals, march, path, product
from stickslip.contact.planar import course, period, rows
from stickslip.response import ahead
from stickslip.response.time import start, time_step

for task in ahead.TASKS.values():
    task()
used = [
    event_integrals._integrate_events, events.contact_events, interface.add_contact_jacobian, interface.add_forces, interface.add_gaps,
    intervals.contact_period, product.contact_product, product.multiply_blocks, product.sweep, course.run, rows.follow_rows,
]
made = [march.period_march, path._walk, period._compiled, start._march, time_step.run_steps]
if numba.get_num_threads() > 1:
    used += [events.contact_events_threads, intervals.contact_period_threads]
    made += [period._threads]
print(*(f.py_func.__qualname__ for f in used if not f.overloads), *(f.__qualname__ for f in made if not f.cache_info().currsize))
"""


def test_every_function_that_is_called_from_python_is_compiled_ahead():
    missed = subprocess.run(
        [sys.executable, "-c", ASKED], capture_output=True, text=True, check=True
    )
    assert not missed.stdout.split(), missed.stdout
