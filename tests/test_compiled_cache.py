"""The cache of compiled functions: what another version of the code left there does no harm."""

import importlib
import subprocess
import sys
import time

import numba
import numpy as np
import pytest

import stickslip.contact
from stickslip.contact import cache as compiled_cache

SOURCE = """
from typing import NamedTuple
from stickslip.contact.cache import njit

class {name}(NamedTuple):
    a: float

@njit(cache=True)
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


SEVERAL = """
from stickslip.contact.cache import njit

@njit(cache=True)
def inner(x):
    return 3.0 * x

@njit(cache=True)
def outer(x):
    return inner(x) + 1.0
"""


def damaged(content, rng):
    """Return a file's bytes after a power cut, a bad disk, or another program: cut, empty, zeros, noise, flipped bits, doubled."""
    at = int(rng.integers(1, len(content)))
    flipped = np.frombuffer(content, np.uint8).copy()
    places = rng.integers(0, len(content), 1 + int(rng.integers(3)))
    np.bitwise_xor.at(flipped, places, 1 << rng.integers(0, 8, places.size).astype(np.uint8))
    kinds = (
        b"",
        content[:at],
        content[:at] + bytes(len(content) - at),
        rng.bytes(len(content)),
        content + content[:at],
        content[at:],
        b"\x80" + content[1:],
        flipped.tobytes(),
        flipped.tobytes(),
    )
    return kinds[rng.integers(len(kinds))]


@pytest.mark.parametrize(("seed", "rounds"), [(1, 6), pytest.param(2, 40, marks=pytest.mark.validation)])
def test_damaged_files_of_compiled_functions_are_made_anew(tmp_path, monkeypatch, caplog, seed, rounds):
    """Each is told by one line, or, where it looks like one of an earlier version, by none; what comes out is the same."""
    rng = np.random.default_rng(seed)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "several.py").write_text(SEVERAL)
    called(monkeypatch, "several")
    files = sorted(path for path in tmp_path.rglob("*.nb[ic]"))
    assert len(files) == 4
    for number in range(rounds):
        path = files[number % 4]
        whole = path.read_bytes()
        spoilt = damaged(whole, rng)
        path.write_bytes(spoilt)
        caplog.clear()
        module = called(monkeypatch, "several")
        said = [r.getMessage() for r in caplog.records if "is damaged" in r.getMessage()]
        looks_old = spoilt[:1] == b"\x80"
        assert said == ([] if looks_old or spoilt == whole else [f"{path} {SAID}"])
        hits = [sum(f.stats.cache_hits.values()) for f in (module.inner, module.outer)]
        assert sum(hits) < 2
        assert path.read_bytes() != spoilt, "the damaged file was left"
        module = called(monkeypatch, "several")
        assert sum(module.outer.stats.cache_hits.values()) == 1, "what was made anew was not kept"


SAID = "is damaged: the function is compiled again"


def called(monkeypatch, name):
    """Import a module anew, use it, and return it."""
    sys.modules.pop(name, None)
    importlib.invalidate_caches()
    module = importlib.import_module(name)
    monkeypatch.delitem(sys.modules, name)
    assert (module.inner(2.0), module.outer(2.0)) == (6.0, 7.0)
    return module


def test_a_file_of_another_function_or_age_is_not_taken(tmp_path, monkeypatch):
    """As a program that is killed between index and data leaves it: the index is of today, the code of before."""
    monkeypatch.syspath_prepend(tmp_path)
    for factor in ("3.0", "4.0"):
        (tmp_path / "several.py").write_text(SEVERAL.replace("3.0 * x", f"{factor} * x"))
        sys.modules.pop("several", None)
        importlib.invalidate_caches()
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        module = importlib.import_module("several")
        assert module.inner(1.0) == float(factor)
        (data,) = tmp_path.rglob("several.inner*.nbc")
        if factor == "3.0":
            before = data.read_bytes()
    data.write_bytes(before)
    sys.modules.pop("several")
    module = importlib.import_module("several")
    assert module.inner(1.0) == 4.0
    assert sum(module.inner.stats.cache_hits.values()) == 0
    monkeypatch.delitem(sys.modules, "several")


@pytest.mark.parametrize("other", ["folder", "nothing"])
def test_what_is_no_file_costs_a_compilation(tmp_path, monkeypatch, other):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv(compiled_cache._TOLD, "yes")
    (tmp_path / "several.py").write_text(SEVERAL)
    called(monkeypatch, "several")
    for path in tmp_path.rglob("*.nbi"):
        path.unlink()
        if other == "folder":
            path.mkdir()
    called(monkeypatch, "several")


UNCHANGED = """
import hashlib, inspect, pickle
import numba
from numba.core import caching, compiler, dispatcher, decorators, serialize, typeinfer

def attributes():
    found = {}
    for module in (caching, compiler, dispatcher, decorators, serialize, typeinfer, numba):
        for name, item in vars(module).items():
            found[module.__name__, name] = id(item)
            if inspect.isclass(item) and item.__module__.startswith("numba"):
                found |= {(module.__name__, name, own): id(value) for own, value in vars(item).items() if callable(value)}
    return found

before = attributes()
import stickslip, stickslip.contact.march, stickslip.contact.events, stickslip.response.time.stepping.time_step
after = attributes()
print(*(key for key in before if before[key] != after.get(key)))

@numba.njit(cache=True)
def plain(x):
    return x
assert type(plain._cache) is caching.FunctionCache, type(plain._cache)
"""


def test_nothing_of_numba_is_replaced(tmp_path):
    """A program that imports a solver keeps numba's own caches for its own functions."""
    script = tmp_path / "program.py"
    script.write_text(UNCHANGED)
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout.strip()) == (0, ""), ended.stdout + ended.stderr


USED = "FACTOR = {factor}\n"
USER = """
from stickslip.contact.cache import njit
from stickslip.used import FACTOR

@njit(cache=True)
def times(x):
    return FACTOR * x
"""


def test_a_function_is_compiled_again_when_a_file_that_it_imports_has_changed(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(compiled_cache, "_PACKAGE", tmp_path)
    # Python tells files of the same second and size apart by nothing, and would load the first one's bytecode
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    (tmp_path / "user.py").write_text(USER)
    for factor in (2.0, 3.0, 3.0):
        compiled_cache._contents.cache_clear()
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
    monkeypatch.setattr(compiled_cache, "QUIET_SECONDS", patience)
    monkeypatch.setattr(compiled_cache._LISTENER, "told", False)
    with caplog.at_level("INFO", "stickslip"):
        for number in range(2):
            assert numba.njit(lambda x, n=number: (x + n) ** 2)(1.0) == (1 + number) ** 2
        time.sleep(0.05)
    said = [r for r in caplog.records if r.getMessage() == compiled_cache.LINE]
    assert len(said) == (patience == 0.0)


ASKED = """
import numba
from stickslip.contact import event_integrals, events, interface, intervals, law_steps, march, product
from stickslip.contact.planar import period, sensitivities, trajectory
from stickslip.response import precompile
from stickslip.response.time.stepping import time_step
from stickslip.response.time import start

for task in precompile.TASKS.values():
    task()
used = [
    event_integrals._integrate_events, events.contact_events, interface.add_contact_jacobian, interface.add_forces, interface.add_gaps,
    intervals.contact_period, product.contact_product, product.multiply_blocks, product.sweep, trajectory.run, sensitivities.follow_rows,
]
made = [march.period_march, law_steps._walk, period._compiled, start._march, time_step.run_steps]
if numba.get_num_threads() > 1:
    used += [events.contact_events_threads, intervals.contact_period_threads]
    made += [period._threads]
print(*(f.py_func.__qualname__ for f in used if not f.overloads), *(f.__qualname__ for f in made if not f.cache_info().currsize))
"""


def test_every_function_that_is_called_from_python_is_compiled_ahead():
    missed = subprocess.run([sys.executable, "-c", ASKED], capture_output=True, text=True, check=True)
    assert not missed.stdout.split(), missed.stdout
