"""One-point mutants of Python sources: where they can be made, and a draw of some of them."""

import ast
import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evidence.mutants.probes import own_lines

# what decides a number before anybody words it
CORE = ("contact", "harmonic", "solve", "reduction", "response", "model/fe")
COMPARED: Mapping[type[ast.cmpop], tuple[str, ...]] = {
    ast.Lt: ("<=", ">="),
    ast.LtE: ("<", ">"),
    ast.Gt: (">=", "<="),
    ast.GtE: (">", "<"),
    ast.Eq: ("!=",),
    ast.NotEq: ("==",),
    ast.Is: ("is not",),
    ast.IsNot: ("is",),
    ast.In: ("not in",),
    ast.NotIn: ("in",),
}
OTHER: Mapping[type[ast.operator], str] = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.FloorDiv: "*",
    ast.Mod: "*",
    ast.Pow: "*",
    ast.BitAnd: "|",
    ast.BitOr: "&",
}
SWAPPED = {
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "any": "all",
    "all": "any",
    "sin": "cos",
    "cos": "sin",
    "floor": "ceil",
    "ceil": "floor",
    "argmin": "argmax",
    "argmax": "argmin",
    "nanmin": "nanmax",
    "nanmax": "nanmin",
}

# whose arguments may stand in any order: a swap changes nothing
SYMMETRIC = {"min", "max", "minimum", "maximum", "gcd", "lcm", "hypot", "union1d", "intersect1d"}


@dataclass(frozen=True)
class Mutant:
    """One text of a file that stands for another.

    Attributes
    ----------
    path
        Below the folder of the package.
    line
        From 1: where the text begins.
    statement
        First and last line of the statement, without the statements that it holds.
    start, end
        Characters of the file from 0.
    before, after
        Text that is replaced, and what replaces it.
    kind
        What was done.
    where
        Function or class, with those around it; empty for the module.
    about
        First line of its docstring.
    """

    path: str
    line: int
    statement: tuple[int, int]
    start: int
    end: int
    before: str
    after: str
    kind: str
    where: str
    about: str

    @property
    def core(self) -> bool:
        """Whether it is one of core numerics."""
        return self.path.startswith(tuple(f"{name}/" for name in CORE))

    def applied(self, source: str) -> str:
        """Return the source with the mutant in it."""
        return source[: self.start] + self.after + source[self.end :]


@dataclass(frozen=True)
class _Place:
    where: str = ""
    about: str = ""
    statement: tuple[int, int] = (0, 0)


class _Finder:
    """Walks a file and collects its mutants."""

    def __init__(self, path: str, source: str) -> None:
        self.path, self.source = path, source
        starts = [0]
        for text in source.splitlines(keepends=True):
            starts.append(starts[-1] + len(text))
        self.starts = starts
        self.lines = source.splitlines(keepends=True)
        self.found: list[Mutant] = []

    def at(self, line: int, column: int) -> int:
        """Return the character of a place that ast gives in bytes."""
        text = self.lines[line - 1].encode()[:column].decode()
        return self.starts[line - 1] + len(text)

    def span(self, node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return (self.at(node.lineno, node.col_offset), self.at(node.end_lineno, node.end_col_offset))

    def text(self, node: ast.expr) -> str:
        start, end = self.span(node)
        return self.source[start:end]

    def add(self, place: _Place, node: ast.expr, after: str, kind: str) -> None:
        start, end = self.span(node)
        before = self.source[start:end]
        mutant = Mutant(
            self.path, node.lineno, place.statement, start, end, before, after, kind, place.where, place.about
        )
        self.found.append(mutant)

    def walk(self, node: ast.AST, place: _Place) -> None:
        """Collect the mutants of a node and of those inside it."""
        if isinstance(node, ast.stmt):
            first, end = own_lines(node)
            place = _Place(place.where, place.about, (first, end - 1))
        for after, kind, own in _changes(node, self.text):
            self.add(place, own, after, kind)
        for child, where in _inside(node, place):
            self.walk(child, where)


def _inside(node: ast.AST, place: _Place) -> Iterator[tuple[ast.AST, _Place]]:
    """Yield what stands inside a node, but for annotations and decorators, and what only type checkers read."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        name = f"{place.where}.{node.name}" if place.where else node.name
        about = (ast.get_docstring(node) or "").partition("\n")[0] or place.about
        if isinstance(node, ast.FunctionDef):
            defaults = [*node.args.defaults, *node.args.kw_defaults]
            yield from ((own, place) for own in defaults if own is not None)
        yield from ((own, _Place(name, about, place.statement)) for own in node.body)
    elif isinstance(node, ast.AnnAssign):
        yield from ((own, place) for own in [node.value] if own is not None)
    elif not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
        yield from ((own, place) for own in ast.iter_child_nodes(node))


def _changes(node: ast.AST, text: Any) -> Iterator[tuple[str, str, ast.expr]]:
    """Yield what can be done at a node: the new text, what it is, and the expression that it replaces."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        left, right = text(node.left), text(node.comparators[0])
        for sign in COMPARED[type(node.ops[0])]:
            yield f"{left} {sign} {right}", "comparison", node
    elif isinstance(node, ast.BinOp):
        yield from _of_operator(node, text)
    elif isinstance(node, ast.UnaryOp) and not isinstance(node.operand, ast.Constant):
        kinds = {ast.USub: "sign", ast.Not: "negation", ast.Invert: "negation"}
        yield f"({text(node.operand)})", kinds.get(type(node.op), "sign"), node
    elif isinstance(node, ast.BoolOp):
        yield from _of_conditions(node, text)
    elif isinstance(node, ast.Call):
        yield from _of_call(node, text)
    elif isinstance(node, ast.If | ast.While | ast.IfExp):
        yield from _negated([node.test], text)
    elif isinstance(node, ast.comprehension):
        yield from _negated(node.ifs, text)
    yield from _of_numbers(node)


def _of_conditions(node: ast.BoolOp, text: Any) -> Iterator[tuple[str, str, ast.expr]]:
    every = [f"({text(v)})" for v in node.values]
    own, other = (" and ", " or ") if isinstance(node.op, ast.And) else (" or ", " and ")
    yield f"({other.join(every)})", "and, or", node
    for left_out in range(len(every)):
        kept = own.join(every[:left_out] + every[left_out + 1 :])
        yield f"({kept})", "dropped condition", node


def _negated(conditions: Sequence[ast.expr], text: Any) -> Iterator[tuple[str, str, ast.expr]]:
    """Yield conditions turned round, but for those that are mutants of their own."""
    for own in conditions:
        alone = isinstance(own, ast.Compare) and len(own.ops) == 1
        if not alone and not isinstance(own, ast.UnaryOp):
            yield f"(not ({text(own)}))", "negated condition", own


def _of_operator(node: ast.BinOp, text: Any) -> Iterator[tuple[str, str, ast.expr]]:
    left, right = text(node.left), text(node.right)
    of_text = any(
        isinstance(side, ast.JoinedStr) or (isinstance(side, ast.Constant) and isinstance(side.value, str))
        for side in (node.left, node.right)
    )
    other = OTHER.get(type(node.op))
    if other and not of_text:
        yield f"(({left}) {other} ({right}))", "operator", node
    if isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div | ast.Pow):
        kind = "dropped term" if isinstance(node.op, ast.Add | ast.Sub) else "dropped factor"
        yield f"({left})", kind, node
        if isinstance(node.op, ast.Add | ast.Mult):
            yield f"({right})", kind, node


def _of_call(node: ast.Call, text: Any) -> Iterator[tuple[str, str, ast.expr]]:
    method = node.func if isinstance(node.func, ast.Attribute) else None
    if method and method.attr in ("conj", "conjugate", "copy") and not node.args:
        yield text(method.value), f"dropped {method.attr}", node
        return
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if name in SWAPPED:
        whole = text(node.func)
        yield whole[: len(whole) - len(name)] + SWAPPED[name], "other function", node.func
    plain = [a for a in node.args if not isinstance(a, ast.Starred)]
    if len(plain) >= 2 and len(plain) == len(node.args) and name not in SYMMETRIC:
        words = [text(a) for a in plain]
        words[0], words[1] = words[1], words[0]
        words += [_keyword(k, text) for k in node.keywords]
        yield f"{text(node.func)}({', '.join(words)})", "swapped arguments", node
    for left_out in node.keywords:
        if left_out.arg is None:
            continue
        words = [text(a) for a in node.args]
        words += [_keyword(k, text) for k in node.keywords if k is not left_out]
        yield f"{text(node.func)}({', '.join(words)})", f"dropped keyword {left_out.arg}", node


def _keyword(own: ast.keyword, text: Any) -> str:
    return f"**{text(own.value)}" if own.arg is None else f"{own.arg}={text(own.value)}"


def _of_numbers(node: ast.AST) -> Iterator[tuple[str, str, ast.expr]]:
    """Yield whole numbers of sums, comparisons, places and ranges, one more and one less, and other truth values."""
    for own in _numbers(node):
        if not isinstance(own, ast.Constant):
            continue
        if isinstance(own.value, bool):
            yield str(not own.value), "other truth value", own
        elif isinstance(own.value, int):
            yield str(own.value + 1), "number", own
            if own.value > 0:
                yield str(own.value - 1), "number", own


def _numbers(node: ast.AST) -> Sequence[ast.AST | None]:
    """Return where a node may hold a number that counts."""
    of: Mapping[type[ast.AST], Sequence[str]] = {
        ast.BinOp: ("left", "right"),
        ast.Slice: ("lower", "upper"),
        ast.IfExp: ("body", "orelse"),
        ast.Return: ("value",),
        ast.keyword: ("value",),
    }
    if isinstance(node, ast.Compare):
        return [node.left, *node.comparators]
    if isinstance(node, ast.Subscript):
        return node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "range":
        return node.args
    return [getattr(node, name) for name in of.get(type(node), ())]


def mutants_of(path: str, source: str) -> list[Mutant]:
    """Return all mutants of a file, those among them that are no Python.

    Parameters
    ----------
    path
        Below the folder of the package.
    source
        Its text.
    """
    finder = _Finder(path, source)
    for node in ast.parse(source).body:
        finder.walk(node, _Place())
    return finder.found


def is_another(mutant: Mutant, source: str) -> bool:
    """Return whether a mutant is Python and says something else than its source.

    In texts with values Python before 3.12 may give other places than theirs: what is replaced must be an expression.
    """
    try:
        ast.parse(f"({mutant.before}\n)", mode="eval")
        new = ast.parse(mutant.applied(source))
    except SyntaxError:
        return False
    return ast.dump(new) != ast.dump(ast.parse(source))


def sources_of(package: Path) -> dict[str, str]:
    """Return the text of each Python file of a package by its path below the package's folder."""
    return {
        file.relative_to(package).as_posix(): file.read_text(encoding="utf-8") for file in sorted(package.rglob("*.py"))
    }


def drawn(sources: Mapping[str, str], n: int, seed: int, only: Sequence[str] = ()) -> list[Mutant]:
    """Return mutants on different lines: each line that has some is as likely as any other.

    Parameters
    ----------
    sources
        Text of each file by its path below the package's folder.
    n
        How many, fewer if there are not so many lines.
    seed
        The same seed draws the same from the same sources.
    only
        Beginnings of paths; without any all are taken.
    """
    lines: dict[tuple[str, int], list[Mutant]] = {}
    for path in sorted(sources):
        if not only or path.startswith(tuple(only)):
            for mutant in mutants_of(path, sources[path]):
                lines.setdefault((path, mutant.line), []).append(mutant)
    chance = random.Random(seed)
    places = sorted(lines)
    chance.shuffle(places)
    found: list[Mutant] = []
    for place in places:
        own = list(lines[place])
        chance.shuffle(own)
        one = next((m for m in own if is_another(m, sources[place[0]])), None)
        if one is not None:
            found.append(one)
        if len(found) == n:
            break
    return found
