"""Count how the package is built: ``python -m evidence.house`` prints each number beside what it is to be.

Code is what is neither empty, comment nor docstring. Shell is the code of analyses, of a page and of what their folders share; numerics is
the code of the packages of `response` that these name.
"""

import ast
import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "stickslip"
# implementations of `LinearSide`
SIDES = frozenset({"TunedWheel", "SpeedLine", "Unreduced", "Structure"})
BELOW_SIDES = ("model", "reduction", "harmonic")  # which make and know them
SHELL = ("analyses/",)
SMALL_MODULE = 60  # lines of code
# small modules that one other imports, and why they stand alone
REASONS = {
    "analyses.forced_response.stability.elsewhere": "other motions beside the peak: one rule",
    "api.reading": "read by the command line before anything that computes",
    "assembly.extent": "slip and strain against the size of the parts: one rule",
    "contact.steps.element": "one step a file, compiled when its law is first used",
    "model.fe.hourglass": "when bricks with one point are doubtful: needs modes, which the solid does not",
    "model.fe.free_solid": "rigid motions of a free solid, and the rank decision",
    "study.check": "the command check",
    "study.exchange.frd": "a file format",
    "study.file.example": "read by the command new alone",
    "study.models.beforehand": "the first line of check, before anything that computes is imported",
    "study.inspect_file": "the command inspect",
}


@dataclass(frozen=True)
class Count:
    """A number and what it is to be."""

    what: str
    found: str
    goal: str


@cache
def tree(path: Path) -> ast.Module:
    """Return the syntax tree of a module."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def modules() -> tuple[Path, ...]:
    """Return all modules of the package."""
    return tuple(sorted(SOURCE.rglob("*.py")))


def code_lines(path: Path) -> int:
    """Return the lines of code of a module."""
    documented: set[int] = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            documented |= set(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    lines = enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
    return sum(1 for i, line in lines if line.strip() and not line.strip().startswith("#") and i not in documented)


def type_questions(classes: frozenset[str], left_out: tuple[str, ...]) -> list[str]:
    """Return where ``isinstance`` asks for one of some classes, outside of some folders."""
    return [
        f"{_name(path)}:{node.lineno}"
        for path in modules()
        if not _name(path).startswith(left_out)
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance" and _asked(node) & classes
    ]


def _asked(call: ast.Call) -> set[str]:
    return {name.id for name in ast.walk(call.args[1]) if isinstance(name, ast.Name)}


def law_classes() -> frozenset[str]:
    """Return the names of the classes of contact laws."""
    laws = SOURCE / "contact" / "laws"
    found = (node.name for path in laws.glob("*.py") for node in tree(path).body if isinstance(node, ast.ClassDef))
    return frozenset(name for name in found if not name.startswith("_"))


@cache
def imports() -> dict[str, set[str]]:
    """Return what each module imports, in functions, too."""
    graph = grimp.build_graph("stickslip", exclude_type_checking_imports=True)
    return {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}


def circle() -> list[str]:
    """Return the modules of a circle of imports; none where there is none."""
    try:
        TopologicalSorter(imports()).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def imported_once() -> list[str]:
    """Return the small modules without a reason that one other imports and no stub makes public."""
    by: Counter[str] = Counter(other for own in imports().values() for other in own)
    public = {f"stickslip.{home}" for home in _public_homes()}
    return [
        module
        for module, count in by.items()
        if count == 1
        and module not in public
        and module.removeprefix("stickslip.") not in REASONS
        and (path := _path(module)).name != "__init__.py"
        and code_lines(path) < SMALL_MODULE
    ]


def _public_homes() -> Iterator[str]:
    for stub in SOURCE.rglob("__init__.pyi"):
        package = ".".join(stub.parent.relative_to(SOURCE).parts)
        for node in tree(stub).body:
            if isinstance(node, ast.ImportFrom) and node.module:
                yield f"{package}.{node.module}".strip(".")


def shell_and_numerics() -> tuple[int, int]:
    """Return the lines of code of the shell of all analyses, and of the packages of `response` that it imports."""
    shell = [path for path in modules() if _name(path).startswith(SHELL)]
    named = {
        ".".join(other.split(".")[:3])
        for path in shell
        for other in imports()[_module(path)]
        if other.startswith("stickslip.response.")
    }
    numerics = [p for p in modules() if ".".join(_module(p).split(".")[:3]) in named]
    return sum(map(code_lines, shell)), sum(map(code_lines, numerics))


def spellings() -> float:
    """Return in how many modules the name of a variable of a result is spelled, in the mean."""
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "variables").glob("*.md"))
    names = {name for name in re.findall(r"^\| `(\w+)`", text, re.MULTILINE) if "_" in name}
    where = defaultdict(set)
    for path in modules():
        for node in ast.walk(tree(path)):
            word = (
                node.value if isinstance(node, ast.Constant) else node.attr if isinstance(node, ast.Attribute) else ""
            )
            if isinstance(node, ast.Constant) and isinstance(word, str) and word in names:
                where[word].add(path)
    return sum(map(len, where.values())) / max(len(where), 1)


def largest_folder() -> tuple[int, str]:
    """Return the number of modules of the fullest folder of assembly, study, report and response, and its name."""
    folders = Counter(str(path.parent.relative_to(SOURCE)) for path in modules() if path.name != "__init__.py")
    name, count = max(
        ((n, c) for n, c in folders.items() if n.startswith(("assembly", "study", "analyses", "report", "response"))),
        key=lambda f: f[1],
    )
    return count, name


def _name(path: Path) -> str:
    return path.relative_to(SOURCE).as_posix()


def _module(path: Path) -> str:
    return ".".join(["stickslip", *path.relative_to(SOURCE).with_suffix("").parts]).removesuffix(".__init__")


def _path(module: str) -> Path:
    own = SOURCE.joinpath(*module.split(".")[1:])
    return own / "__init__.py" if own.is_dir() else own.with_suffix(".py")


def counts() -> list[Count]:
    """Return all numbers."""
    shell, numerics = shell_and_numerics()
    fullest, folder = largest_folder()
    statements = sum(isinstance(node, ast.stmt) for path in modules() for node in ast.walk(tree(path)))
    return [
        Count("modules in a circle of imports", str(len(set(circle()))), "0"),
        Count("type questions on linear sides above harmonic", str(len(type_questions(SIDES, BELOW_SIDES))), "0"),
        Count("type questions on laws outside contact", str(len(type_questions(law_classes(), ("contact",)))), "0"),
        Count("shell over numerics", f"{shell} / {numerics} = {shell / numerics:.2f}", "1.2"),
        Count("modules in which a variable's name is spelled", f"{spellings():.1f}", "2"),
        Count("modules", str(len(modules())), "520"),
        Count(f"modules below {SMALL_MODULE} lines for one other, no reason", str(len(imported_once())), "0"),
        Count("lines of code", str(sum(map(code_lines, modules()))), ""),
        Count("statements", str(statements), ""),
        Count(f"files in the fullest folder ({folder})", str(fullest), "15"),
    ]


def main() -> None:
    """Print the table."""
    for one in counts():
        print(f"{one.what:<62} {one.found:>22}  {one.goal}")


if __name__ == "__main__":
    main()
