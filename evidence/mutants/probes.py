"""Marks at the heads of blocks: which statements of the package a test has run, told by a byte of a shared file for each line.

A block holds statements that all run or that raise. A mark costs 30 ns, in any version of Python, and processes that a
test forks or starts make it in the same file. Compiled functions have none, and neither have lines that run at import.
"""

import ast
import builtins
import hashlib
import importlib.util
import json
import marshal
import mmap
import os
import sys
from collections.abc import Iterator, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

WHERE = (
    "STICKSLIP_REACH"  # in the environment: the file of marks; beside it the first place of each file of the package
)
MARKS = "__reached__"  # the name by which blocks know it
COMPILERS = ("njit", "cfunc", "inner", "large", "compiled_step", "law_kernel")  # words of what compiles a function


def probe(tree: ast.Module, first: int = 0) -> dict[int, int]:
    """Put a mark at the head of each block of a module's functions, and return the line of the head for each line.

    Parameters
    ----------
    tree
        Module as it is parsed; it is changed.
    first
        Place of its line 0 among the marks.
    """
    heads: dict[int, int] = {}
    compiled = compiled_in(tree)
    for body in _outermost(tree, compiled):
        _probe_body(body, first, heads, compiled)
    return heads


def compiled_in(tree: ast.Module) -> set[str]:
    """Return the names of functions that numba compiles: by a decorator, or as ``njit(signature)(function)``."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            words = {w for d in node.decorator_list for w in _words(d)}
            if words & set(COMPILERS):
                found.add(node.name)
        elif isinstance(node, ast.Call) and _words(node.func) & set(COMPILERS):
            found |= {own.id for own in node.args if isinstance(own, ast.Name)}
    return found


def _words(node: ast.expr) -> set[str]:
    names = (getattr(n, "id", getattr(n, "attr", "")) for n in ast.walk(node))
    return {name for name in names if name}


def _outermost(node: ast.AST, compiled: set[str]) -> Iterator[list[ast.stmt]]:
    """Yield what functions do, but for those inside of others."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.FunctionDef):
            yield from _outermost(child, compiled)
        elif child.name not in compiled:
            yield child.body


def _probe_body(body: list[ast.stmt], first: int, heads: dict[int, int], compiled: set[str]) -> None:
    marked: list[ast.stmt] = []
    head = 0  # none: the next statement begins a block
    for i, node in enumerate(body):
        text = i == 0 and isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if not head and not text:
            head = node.lineno
            marked.append(_mark(first + head, node))
        marked.append(node)
        heads |= {line: head for line in range(*own_lines(node)) if head}
        inner = [node.body] if isinstance(node, ast.FunctionDef) and node.name not in compiled else _bodies(node)
        for own in inner:
            _probe_body(own, first, heads, compiled)
        if inner:
            head = 0
    body[:] = marked


def _bodies(node: ast.stmt) -> list[list[ast.stmt]]:
    """Return the lists of statements of one that runs them under its own condition."""
    if isinstance(node, ast.FunctionDef):
        return []
    if isinstance(node, ast.ClassDef):
        return list(_outermost(node, set()))
    parts = [node, *getattr(node, "handlers", ()), *getattr(node, "cases", ())]
    names = ("body", "orelse", "finalbody")
    return [own for part in parts for name in names if isinstance(own := getattr(part, name, None), list) and own]


def own_lines(node: ast.stmt) -> tuple[int, int]:
    """Return the first line of a statement and the one after its last, without the statements that it holds."""
    last = node.end_lineno or node.lineno
    body = getattr(node, "body", None)
    if body and isinstance(body, list):
        last = max(node.lineno, body[0].lineno - 1)
    return node.lineno, last + 1


def _mark(place: int, node: ast.stmt) -> ast.stmt:
    made = ast.parse(f"{MARKS}[{place}] = 1").body[0]
    for own in ast.walk(made):
        if isinstance(own, ast.stmt | ast.expr):
            ast.copy_location(own, node)
    return made


def sum_of(content: bytes) -> str:
    """Return what a text is known by."""
    return hashlib.sha256(content).hexdigest()


class _Loader(SourceFileLoader):
    """Loads a file of the package with its marks; the compiled text is kept beside the marks."""

    first = 0
    kept = Path()

    def get_code(self, _: str) -> CodeType:
        """Return the compiled text."""
        source = self.get_data(self.path)
        known = repr((source, self.path, self.first, sys.implementation.cache_tag, Path(__file__).read_bytes()))
        file = self.kept / sum_of(known.encode())
        if file.exists():
            code: CodeType = marshal.loads(file.read_bytes())
            return code
        tree = ast.parse(source)
        probe(tree, self.first)
        made: CodeType = compile(tree, self.path, "exec", dont_inherit=True)
        mine = file.with_name(f"{file.name}.{os.getpid()}")
        mine.write_bytes(marshal.dumps(made))
        mine.replace(file)
        return made


class _Finder(MetaPathFinder):
    """Finds the files of the package that marks are for."""

    def __init__(self, where: Path) -> None:
        self.kept = where.parent / "marked"
        self.kept.mkdir(exist_ok=True)
        self.first: dict[str, int] = json.loads(where.with_suffix(".first").read_text(encoding="utf-8"))

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return where a module is, with a loader that marks."""
        if name.partition(".")[0] != "stickslip":
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec and spec.origin in self.first:
            loader = _Loader(name, spec.origin)
            loader.first, loader.kept = self.first[spec.origin], self.kept
            return importlib.util.spec_from_file_location(
                name, spec.origin, loader=loader, submodule_search_locations=spec.submodule_search_locations
            )
        return spec


def begin() -> None:
    """Mark what this process runs, where the environment names a file for it."""
    if WHERE in os.environ:
        where = Path(os.environ[WHERE])
        with where.open("r+b") as file:
            marks: Any = mmap.mmap(file.fileno(), 0)
        setattr(builtins, MARKS, marks)
        sys.meta_path.insert(0, _Finder(where))
