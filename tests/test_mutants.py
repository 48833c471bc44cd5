"""The mutants of `evidence.mutants` on a package of ten lines: what a test sees is noticed, what nothing can see survives, a seed draws the same."""

import ast
import subprocess
from pathlib import Path
from typing import Any

import pytest

from evidence.mutants.__main__ import judged, key, told
from evidence.mutants.judge import Copy, Judged
from evidence.mutants.points import Mutant, drawn, is_another, mutants_of
from evidence.mutants.probes import MARKS, probe
from evidence.mutants.reach import Reach, names_of, record

SOURCE = '''"""A package."""

LIMIT = 1 + 2


def njit(cache):
    return lambda function: function


@njit(cache=False)
def _step(x):
    return x * 2


def clipped(values, sign=-1):
    """Return values that are small."""
    kept = [v for v in values if v < LIMIT]
    if len(kept) > 0 and kept[0] > 0:
        return min(kept) + 0 * len(kept)
    return sign


def twice(x):
    """Return a number twice."""
    return _step(x) + 0 * len(FIRST)


FIRST = ("a", "b", "c")[7 % 3]
'''
TESTS = """import subprocess
import sys
from functools import cache

import pytest
from stickslip.small import clipped, twice


@cache
def least():
    return clipped([1, 2, 3])


@pytest.fixture(scope="module")
def doubled():
    return twice(3)


def test_clipped():
    assert least() == 1


def test_cached():
    assert least() == 1


def test_twice(doubled):
    assert doubled == 6


def test_shared(doubled):
    assert doubled == 6


def test_started():
    subprocess.run([sys.executable, "-c", "from stickslip.small import twice; assert twice(3) == 6"], check=True)
"""


def kinds(source: str) -> set[tuple[str, str, str]]:
    return {(m.before, m.after, m.kind) for m in mutants_of("a.py", source) if is_another(m, source)}


def test_each_kind_of_mutant_is_made() -> None:
    assert kinds("y = a < b") == {("a < b", "a <= b", "comparison"), ("a < b", "a >= b", "comparison")}
    assert ("a + b", "(a)", "dropped term") in kinds("y = a + b")
    assert ("a + b", "((a) - (b))", "operator") in kinds("y = a + b")
    assert ("-x", "(x)", "sign") in kinds("y = -x")
    assert ("a and b", "((a) or (b))", "and, or") in kinds("y = a and b")
    assert ("a and b", "((a))", "dropped condition") in kinds("y = a and b")
    assert ("ok", "(not (ok))", "negated condition") in kinds("if ok:\n    pass")
    assert ("0", "1", "number") in kinds("y = x[0]")
    assert ("f(a, b)", "f(b, a)", "swapped arguments") in kinds("y = f(a, b)")
    assert not any(kind == "swapped arguments" for *_, kind in kinds("y = max(a, b)"))
    assert ("f(a, k=1)", "f(a)", "dropped keyword k") in kinds("y = f(a, k=1)")
    assert ("np.min", "np.max", "other function") in kinds("y = np.min(a)")
    assert ("q.conj()", "q", "dropped conj") in kinds("y = q.conj()")
    # annotations, docstrings and texts are not touched
    assert kinds('def f(x: "a | b" = "c") -> int:\n    """1 + 1"""\n    return x') == set()
    # signs in other scripts stand before what is replaced
    source = 'y = "ω²", a - b'
    assert {m.applied(source) for m in mutants_of("a.py", source)} >= {'y = "ω²", ((a) + (b))'}


def test_a_seed_draws_the_same_and_another_others() -> None:
    sources = {f"{k}.py": f"y{k} = {k} + 1\nif y{k} > 3:\n    y{k} -= f(1, y{k})\n" for k in range(20)}
    first = drawn(sources, 10, 7)
    assert first == drawn(dict(reversed(sources.items())), 10, 7)
    assert first != drawn(sources, 10, 8)
    assert len({(m.path, m.line) for m in first}) == 10
    assert {m.path for m in drawn(sources, 99, 7, ("3.", "4."))} == {"3.py", "4.py"}
    assert [m.core for m in drawn({"contact/a.py": "y = a + b", "cli.py": "y = a + b"}, 2, 1)].count(True) == 1


def test_names_lead_from_compiled_functions_and_constants_to_lines_that_run() -> None:
    names = names_of({"small.py": SOURCE})
    assert names.compiled["small.py", 12] == "_step"
    assert names.defined["small.py", 3] == "LIMIT"
    assert [line for _, line, _ in names.lines["_step"]] == [25]
    assert [line for _, line, _ in names.lines["LIMIT"]] == [17]


def test_each_line_that_runs_belongs_to_the_head_of_its_block() -> None:
    source = """X = 1 + 2


def f(a):
    \"\"\"Say.\"\"\"
    b = (
        a
    )
    if b > 0:
        b += 1
    elif b:
        return 0
    for _ in range(2):
        b += 1
        b += 1
    return b


@njit
def g(a):
    return a
"""
    tree = ast.parse(source)
    assert probe(tree, 100) == {6: 6, 7: 6, 8: 6, 9: 6, 10: 10, 11: 11, 12: 12, 13: 13, 14: 14, 15: 14, 16: 16}
    marks: dict[int, int] = {}
    known: dict[str, Any] = {MARKS: marks, "njit": lambda function: function}
    exec(compile(tree, "f", "exec"), known)
    assert not marks
    assert known["f"](1) == 6
    assert known["f"].__doc__ == "Say."
    assert sorted(marks) == [106, 110, 113, 114, 116]
    assert known["g"](3) == 3
    assert sorted(marks) == [106, 110, 113, 114, 116]


def mutant_of(source: str, before: str, after: str) -> Mutant:
    (one,) = [m for m in mutants_of("small.py", source) if (m.before, m.after) == (before, after)]
    return one


def test_what_a_test_sees_is_noticed_and_what_nothing_can_see_survives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path / "root"
    package = root / "src" / "stickslip"
    package.mkdir(parents=True)
    (root / "tests").mkdir()
    (root / "evidence").symlink_to(Path(__file__).parents[1] / "evidence")
    (package / "__init__.py").write_text("")
    (package / "small.py").write_text(SOURCE)
    (root / "tests" / "test_small.py").write_text(TESTS)
    record(root, tmp_path / "cache")
    # recorded once: with nothing new no test runs
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("it was recorded"))
    record(root, tmp_path / "cache")
    # a line more above all others: what was recorded is known still
    source = SOURCE.replace("LIMIT = 1", "# a comment\nLIMIT = 1")
    (package / "small.py").write_text(source)
    sources = {"__init__.py": "", "small.py": source}
    reach = Reach(tmp_path / "cache", sources, {"tests/test_small.py": TESTS})
    one, cached, other, shared, started = (
        "tests/test_small.py::test_" + n for n in ("clipped", "cached", "twice", "shared", "started")
    )
    wanted = {
        ("len(kept) > 0", "len(kept) >= 0"): (one, ""),  # no test has an empty list
        ("v < LIMIT", "v >= LIMIT"): (one, one),
        ("min(kept) + 0 * len(kept)", "((min(kept)) - (0 * len(kept)))"): (one, ""),
        ("x * 2", "((x) / (2))"): (other, other),
        ("1 + 2", "((1) - (2))"): (one, one),
    }
    copy = Copy(root, tmp_path / "copy", loaded=())
    try:
        for (before, after), (reached, by) in wanted.items():
            mutant = mutant_of(source, before, after)
            # what a cached function, a fixture of several tests or a process has run counts for each test that uses it
            assert reach.tests(mutant) == ({one, cached} if reached == one else {other, shared, started}), before
            assert copy.judge(mutant, [reached], 1.0) == by, before
            assert (copy.package / "small.py").read_text() == source
            text = told(Judged(mutant, by, 1, 1), source)
            assert ("SURVIVED" in text) == (not by)
            assert by or (f"+        {after}" in text.replace("return ", "") or key(mutant) in text)
        assert copy.passes(one, 1.0)
        monkeypatch.undo()
        assert copy.collected() == {one, cached, other, shared, started}
        # a mutant with which the module cannot be imported is noticed, though no test of it has failed
        broken = judged(copy, reach, mutant_of(source, "7 % 3", "((7) * (3))"), 10.0)
        assert broken.by.startswith("pytest cannot begin")
    finally:
        copy.close()
    # a test file that has changed is not known, and is taken whole where it imports the module
    changed = Reach(tmp_path / "cache", sources, {"tests/test_small.py": TESTS + "\n"})
    assert changed.tests(mutant) == {"tests/test_small.py"}
