"""Which tests reach a line: recorded once, read for any later state of the sources.

Each block of the package tells by a mark that a test has run it (`probes`), in the test's own process or in one that it starts.
Test files that were not recorded as they are now are taken whole, where they name what is mutated or import its module.
Lines of compiled functions are reached by the tests that reach a line which names the function, and so are lines that run
at import: what they define is what is named. Tests of all pages and tables look at the latter, too, before others.
A line that is new since the recording is reached by the tests of its neighbours.
"""

import ast
import difflib
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

from evidence.mutants.points import Mutant, sources_of
from evidence.mutants.probes import WHERE, compiled_in, probe, sum_of

PIECE = 8  # test files a process
PER_PIECE_S = 3000.0  # of the clock
FILE_S = 10.0  # CPU that a test file takes of which nothing is known
WHOLE = (
    "tests/test_pages_from_code.py",
    "tests/test_study_tables.py::test_the_schema",
)  # beginnings of tests that read every table
# beginnings of tests that read the text of every module
TEXTS = ("tests/test_architecture.py::test_refusals_name",)
NAMED = 8  # letters of a name that says which function it is


def record(root: Path, cache: Path, workers: int = 1) -> None:
    """Record the test files that are new or have changed since they were recorded, some files a process.

    Parameters
    ----------
    root
        Of the checkout.
    cache
        Folder of what is recorded.
    workers
        Processes at a time.
    """
    (cache / "sources").mkdir(parents=True, exist_ok=True)
    known = {(file, sum_) for piece in _pieces(cache) for file, sum_ in piece["files"].items()}
    to_do = [
        file
        for file in sorted((root / "tests").glob("test_*.py"))
        if (f"tests/{file.name}", _digest(file)) not in known
    ]
    pieces = [to_do[start : start + PIECE] for start in range(0, len(to_do), PIECE)]
    with ThreadPoolExecutor(workers) as pool:
        for done in pool.map(lambda files: _record(root, cache, files), pieces):
            print(f"recorded {done}", flush=True)


def _record(root: Path, cache: Path, files: Sequence[Path]) -> str:
    """Record some test files, with the sources as they are, and return their names and how their tests ended."""
    sums = {f"tests/{file.name}": _digest(file) for file in files}
    where = cache / f"piece_{sum_of(repr(sums).encode())[:12]}"
    package = root / "src" / "stickslip"
    sources = sources_of(package)
    first, places = {}, 0
    for path, text in sources.items():
        first[path] = places
        places += text.count("\n") + 2
        (cache / "sources" / sum_of(text.encode())).write_text(text, encoding="utf-8")
    where.with_suffix(".marks").write_bytes(bytes(places))
    firsts = {str(package / path): own for path, own in first.items()}
    where.with_suffix(".first").write_text(json.dumps(firsts), encoding="utf-8")
    said = _run(root, where.with_suffix(".marks"), list(sums))
    own = {path: {"first": first[path], "sum": sum_of(text.encode())} for path, text in sources.items()}
    where.with_suffix(".json").write_text(json.dumps(said | {"files": sums, "sources": own}), encoding="utf-8")
    return f"{', '.join(sums)}: {said['ended']}"


def _run(root: Path, marks: Path, files: Sequence[str]) -> dict[str, Any]:
    plugins = ["-p", "no:cacheprovider", "-p", "no:cov", "-p", "evidence.mutants.recorder"]
    said = Path(f"{marks}.said")
    said.unlink(missing_ok=True)
    paths = os.pathsep.join([str(Path(__file__).with_name("start")), str(root / "src"), str(root)])
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *plugins, *files],
        cwd=root,
        check=False,
        capture_output=True,
        text=True,
        timeout=PER_PIECE_S,
        env=os.environ | {"PYTHONPATH": paths, WHERE: str(marks)},
    )
    if not said.exists():
        raise RuntimeError(f"pytest recorded nothing of {', '.join(files)}: {(done.stdout + done.stderr)[-2000:]}")
    found: dict[str, Any] = json.loads(said.read_text(encoding="utf-8"))
    for left in (marks, marks.with_suffix(".first"), said):
        left.unlink()
    return found | {"ended": done.stdout.splitlines()[-1]}


def _digest(file: Path) -> str:
    return sum_of(file.read_bytes())


def _pieces(cache: Path) -> list[dict[str, Any]]:
    """Return what was recorded, oldest first."""
    files = sorted(cache.glob("piece_*.json"), key=lambda f: f.stat().st_mtime)
    return [json.loads(file.read_text(encoding="utf-8")) | {"data": file} for file in files]


@dataclass(frozen=True)
class Names:
    """Where names stand in the sources.

    Attributes
    ----------
    lines
        By name: path, line, and the function around it as (path, name, whether it is compiled), empty at import.
    """

    lines: Mapping[str, Sequence[tuple[str, int, tuple[str, str, bool] | None]]]
    defined: Mapping[tuple[str, int], str]  # what a line that runs at import defines
    compiled: Mapping[tuple[str, int], str]  # name of the compiled function around a line


class _Reader(ast.NodeVisitor):
    def __init__(self, path: str, compiled_names: set[str]) -> None:
        self.path = path
        self.compiled_names = compiled_names
        self.inside: tuple[str, str, bool] | None = None
        self.lines: list[tuple[str, int, tuple[str, str, bool] | None]] = []
        self.defined: dict[tuple[str, int], str] = {}
        self.compiled: dict[tuple[str, int], str] = {}

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        outer = self.inside
        compiled = node.name in self.compiled_names
        if outer is None or compiled:
            self.inside = (self.path, node.name, compiled)
        if compiled:
            for line in range(node.lineno, (node.end_lineno or node.lineno) + 1):
                self.compiled[self.path, line] = node.name
        self.generic_visit(node)
        self.inside = outer

    def visit_Assign(self, node: ast.Assign) -> None:
        self._defines(node, node.targets)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        self._defines(node, [node.target])

    def _defines(self, node: ast.stmt, targets: Sequence[ast.expr]) -> None:
        if self.inside is None:
            names = [n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name)]
            for line in range(node.lineno, (node.end_lineno or node.lineno) + 1):
                if names:
                    self.defined[self.path, line] = names[0]
        self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> None:
        if isinstance(node.ctx, ast.Load):
            self.lines.append((node.id, node.lineno, self.inside))

    def visit_Attribute(self, node: ast.Attribute) -> None:
        self.lines.append((node.attr, node.end_lineno or node.lineno, self.inside))
        self.generic_visit(node)

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg:
            self.lines.append((node.arg, node.value.lineno, self.inside))
        self.generic_visit(node)


def names_of(sources: Mapping[str, str]) -> Names:
    """Return where the names of sources stand."""
    lines: dict[str, list[tuple[str, int, tuple[str, str, bool] | None]]] = {}
    defined: dict[tuple[str, int], str] = {}
    compiled: dict[tuple[str, int], str] = {}
    for path, source in sources.items():
        tree = ast.parse(source)
        reader = _Reader(path, compiled_in(tree))
        reader.visit(tree)
        for name, line, inside in reader.lines:
            lines.setdefault(name, []).append((path, line, inside))
        defined |= reader.defined
        compiled |= reader.compiled
    return Names(lines, defined, compiled)


@dataclass
class Reach:
    """Tests by the lines that they reach.

    Attributes
    ----------
    cache
        Folder of what was recorded.
    sources
        Sources as they are now, by path below the package's folder.
    tests_as_they_are
        Text of each test file as it is now, by its path below the root.
    failed
        Tests that are known to fail without any mutant.
    """

    cache: Path
    sources: Mapping[str, str]
    tests_as_they_are: Mapping[str, str]
    failed: set[str] = field(default_factory=set)
    _known: dict[str, dict[int, set[str]]] = field(default_factory=dict)

    @cached_property
    def cpu_s(self) -> dict[str, float]:
        """CPU of each test, s."""
        return {
            t: s
            for piece in self.pieces
            for t, s in piece["cpu_s"].items()
            if self._valid.get(t.partition("::")[0]) == piece["data"]
        }

    @cached_property
    def pieces(self) -> list[dict[str, Any]]:
        """What was recorded."""
        return _pieces(self.cache)

    @cached_property
    def names(self) -> Names:
        """Names of the sources."""
        return names_of(self.sources)

    @cached_property
    def _valid(self) -> dict[str, Path]:
        """For each test file the last piece that holds it as it is now."""
        now = {file: sum_of(text.encode()) for file, text in self.tests_as_they_are.items()}
        return {
            file: piece["data"] for piece in self.pieces for file, own in piece["files"].items() if now.get(file) == own
        }

    def lines(self, path: str) -> dict[int, set[str]]:
        """Return the tests that reach each line of a file as it is now."""
        if path not in self._known:
            found: dict[int, set[str]] = {}
            for piece in self.pieces:
                own = self._of_piece(piece, path)
                for line, tests in own.items():
                    found.setdefault(line, set()).update(tests)
            self._known[path] = found
        return self._known[path]

    def _of_piece(self, piece: Mapping[str, Any], path: str) -> dict[int, set[str]]:
        own = piece["sources"].get(path)
        if own is None:
            return {}
        now = self.sources[path]
        before = now
        if own["sum"] != sum_of(now.encode()):
            before = (self.cache / "sources" / own["sum"]).read_text(encoding="utf-8")
        valid = {k: t for k, t in enumerate(piece["tests"]) if self._valid.get(t.partition("::")[0]) == piece["data"]}
        found = {}
        for line, head in _heads(before).items():
            bits = int(piece["places"].get(str(own["first"] + head), "0"), 16)
            found[line] = {t for k, t in valid.items() if bits >> k & 1}
        return found if before == now else _moved(found, before, now)

    def tests(self, mutant: Mutant) -> set[str]:
        """Return the tests that reach a mutant; of files that are not recorded as they are now, whole files that may."""
        of_texts = {t for t in self.cpu_s if t.startswith(TEXTS)}
        return self._recorded(mutant) | self._unrecorded(mutant) | of_texts

    def _unrecorded(self, mutant: Mutant) -> set[str]:
        module = "stickslip." + mutant.path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        named = {name for name in mutant.where.split(".") if len(name) >= NAMED and not name.startswith("_")}
        words = [re.escape(module), *map(re.escape, named)]
        return {
            file
            for file, text in self.tests_as_they_are.items()
            if file not in self._valid and re.search(rf"\b({'|'.join(words)})\b", text)
        }

    def _recorded(self, mutant: Mutant) -> set[str]:
        path = mutant.path
        compiled = self.names.compiled.get((path, mutant.line))
        if compiled:
            return self._naming(compiled, path, set())
        first, last = mutant.statement
        here: set[str] = set().union(*(self.lines(path).get(i, ()) for i in range(first, last + 1)))
        if here:
            return here
        at_import = self.names.defined.get((path, mutant.line))
        defined = at_import or mutant.where.rpartition(".")[2]
        found = self._naming(defined, path, set()) if defined else set()
        return found | {t for t in self.cpu_s if t.startswith(WHOLE)} if at_import else found

    def _naming(self, name: str, path: str, seen: set[str]) -> set[str]:
        """Return the tests that reach a line which names something: in its own file, where its name is private."""
        if name in seen:
            return set()
        seen.add(name)
        found: set[str] = set()
        for where, line, inside in self.names.lines.get(name, ()):
            if name.startswith("_") and where != path:
                continue
            if inside is None:
                defined = self.names.defined.get((where, line))
                found |= self._naming(defined, where, seen) if defined else set()
            elif inside[2]:
                found |= self._naming(inside[1], where, seen)
            else:
                found |= self.lines(where).get(line, set())
        return found

    def cost_s(self, test: str) -> float:
        """Return the CPU of a test, or of a file that is not recorded, s."""
        return self.cpu_s.get(test, FILE_S if "::" not in test else 0.0)

    def in_order(self, tests: Iterable[str]) -> list[str]:
        """Return tests: those that read every table, then the cheapest first."""
        return sorted(tests, key=lambda t: (not t.startswith(WHOLE), self.cost_s(t), t))


@cache
def _heads(source: str) -> dict[int, int]:
    return probe(ast.parse(source))


def _moved(found: Mapping[int, set[str]], old: str, new: str) -> dict[int, set[str]]:
    """Return what is known of old lines for new ones; a line that is new has the tests of the lines around it."""
    moved: dict[int, set[str]] = {}
    matcher = difflib.SequenceMatcher(None, old.splitlines(), new.splitlines(), autojunk=False)
    for tag, i1, i2, j1, j2 in matcher.get_opcodes():
        if tag == "equal":
            for i, j in zip(range(i1, i2), range(j1, j2), strict=True):
                if i + 1 in found:
                    moved[j + 1] = found[i + 1]
        else:
            near: set[str] = set().union(*(found.get(i, ()) for i in range(i1, i2 + 2)))
            moved |= {j + 1: near for j in range(j1, j2)}
    return moved
