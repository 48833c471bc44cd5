"""What keeps the package readable, checked: imports, sizes, docstrings, names, and what the README promises."""

import ast
import dataclasses
import importlib.util
import inspect
import re
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import grimp
import pytest

import stickslip
from evidence import house

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "stickslip"
MODULES = sorted(SOURCE.rglob("*.py"))
STUBS = sorted(SOURCE.rglob("__init__.pyi"))
MOST_NAMES = 45
# lines of code without the docstring, at the 90th percentile; ruff limits the statements of each function
USUAL_FUNCTION = 25


def package_of(stub: Path) -> str:
    """Return the dotted name of the package that a stub describes."""
    return ".".join(stub.parent.relative_to(SOURCE.parent).parts)


def names_in(stub: Path) -> dict[str, str]:
    """Return the public names of a stub, each with the module that it comes from."""
    package = package_of(stub)
    return {
        alias.name: f"{package}.{node.module}"
        for node in ast.parse(stub.read_text()).body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


PUBLIC = [(name, package_of(stub), home) for stub in STUBS for name, home in names_in(stub).items()]


def functions(path: Path) -> list[ast.FunctionDef]:
    """Return every function and method of a module."""
    return [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef)]


def body_lines(node: ast.FunctionDef) -> int:
    """Count the lines from the first statement that is not the docstring."""
    body = node.body[1:] if ast.get_docstring(node) else node.body
    return node.end_lineno - body[0].lineno + 1 if body else 0


def literal(node: ast.expr) -> str:
    """Return the text of a string, with braces for its values; empty of anything else."""
    if isinstance(node, ast.JoinedStr):
        return "".join(literal(own) if isinstance(own, ast.Constant) else "{}" for own in node.values)
    return str(node.value) if isinstance(node, ast.Constant) else ""


class Written(NamedTuple):
    """What the tests below ask of a module; the tree of its text would take too much memory to keep."""

    functions: list[int]  # their lines of code, methods too
    constants: list[str]  # names assigned at the top
    refusals: list[tuple[str, int, str, str]]  # file, line, place and what is wrong with it
    fields: list[tuple[str, int, str]]  # file, line and field of refused geometry


@cache
def written(path: Path) -> Written:
    """Read a module, once for all tests."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    assigned = [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign)]
    calls = [n for n in nodes if isinstance(n, ast.Call) and getattr(n.func, "id", "") in ("input_error", "_bad")]
    return Written(
        [body_lines(node) for node in nodes if isinstance(node, ast.FunctionDef)],
        [n.id for a in assigned for n in ast.walk(a) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)],
        [(path.name, node.lineno, *map(literal, node.args[-3:-1])) for node in calls],
        [(path.name, n.lineno, literal(n.args[-3])) for n in calls if getattr(n.func, "id", "") == "_bad"],
    )


def tracked_files() -> list[Path]:
    """Return what git tracks; skips where there is no repository, as in an unpacked archive."""
    try:
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


def in_fresh_python(code: str) -> str:
    """Return what `code` prints in a new interpreter."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_imports_point_one_way():
    done = subprocess.run(
        [Path(sys.executable).parent / "lint-imports", "--no-cache"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_modules_import_each_other_in_no_circle():
    graph = grimp.build_graph("stickslip", exclude_type_checking_imports=True)
    imported = {m: graph.find_modules_directly_imported_by(m) for m in graph.modules}
    assert len(imported) == len(MODULES)
    TopologicalSorter(imported).prepare()  # an error names the modules of a circle


def test_nobody_asks_for_the_class_of_a_law_or_of_a_linear_side():
    assert house.type_questions(house.SIDES, house.BELOW_SIDES) == []
    assert house.type_questions(house.law_classes(), ("contact",)) == []


def test_small_modules_of_one_importer_have_a_reason():
    small = house.imported_once()
    assert small == [], "merge it into what imports it, or give the reason in evidence/house.py"
    assert [name for name in house.REASONS if f"stickslip.{name}" not in house.imports()] == []


def test_type_checking_imports_do_not_hide_from_the_contracts():
    # import-linter leaves such imports out; the command line is on top of all layers, and `reading` names its own layer alone
    hidden = {str(path.relative_to(SOURCE)) for path in MODULES if "TYPE_CHECKING" in path.read_text()}
    assert hidden <= {"cli.py", "api/reading.py"}


def test_of_an_analysis_its_page_alone_draws():
    pages = ("page", "compared", "pictures")
    drawing = [
        str(path.relative_to(SOURCE))
        for path in (SOURCE / "analyses").rglob("*.py")
        if "import plotly" in path.read_text(encoding="utf-8") or "from plotly" in path.read_text(encoding="utf-8")
    ]
    assert len(drawing) > 10
    assert [name for name in drawing if not set(name.removesuffix(".py").split("/")) & set(pages)] == []


def test_functions_are_short():
    lengths = sorted(lines for path in MODULES for lines in written(path).functions)
    assert lengths[int(0.9 * len(lengths))] <= USUAL_FUNCTION


def test_constants_name_their_quantity():
    empty = {"MOST", "FEWEST", "NEAR", "CLOSE", "SAME", "MUCH"}
    found = [
        f"{path.relative_to(SOURCE)}: {name}"
        for path in MODULES
        for name in written(path).constants
        if name.strip("_") in empty
    ]
    assert not found


def test_no_module_for_leftovers():
    assert not [path for path in MODULES if path.stem in {"utils", "util", "common", "core", "helpers", "misc"}]


@pytest.mark.parametrize("module", ["stickslip", "stickslip.cli"])
def test_import_loads_nothing_heavy(module):
    heavy = ["numpy", "scipy", "numba", "pydantic", "xarray", "plotly", "gmsh", "skfem", "meshio"]
    code = f"import sys, {module}; print([name for name in {heavy} if name in sys.modules])"
    assert in_fresh_python(code) == "[]"


def test_public_names_are_few_at_the_top():
    assert len(stickslip.__all__) <= MOST_NAMES


@pytest.mark.parametrize("stub", STUBS, ids=lambda path: path.parent.name)
def test_public_names_resolve_to_where_they_are_declared(stub):
    package = importlib.import_module(package_of(stub))
    declared = names_in(stub)
    found = {name: getattr(package, name).__module__ for name in declared}
    assert found == declared
    assert set(declared) <= set(dir(package))


def test_a_public_name_has_one_home():
    things = [(name, home) for name, _, home in PUBLIC]
    assert sorted(things) == sorted(set(things))


def test_no_module_bears_the_name_of_a_public_name_beside_it():
    # else the module, once imported, hides the function
    clashes = [f"{package}.{name}" for name, package, _ in PUBLIC if importlib.util.find_spec(f"{package}.{name}")]
    assert clashes == []


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="No stickslip attribute elastic_coulomb"):
        stickslip.elastic_coulomb  # noqa: B018  # the access is the test


def public_things():
    """Return every public name and what it names."""
    return [(name, getattr(importlib.import_module(home), name)) for name, _, home in PUBLIC]


# what follows the place in a refusal; a place itself is a key, a name or a file
VERBS = re.compile(
    r"(?:^|\s)(?:is|are|has|have|was|were|must|can|cannot|needs?|does|do|not|no|follows?|lacks?|gives?|lies|stands?|reach|reaches|names?|wants?) (?!= )"
)


def test_refusals_name_the_place_before_they_say_what_is_wrong_with_it():
    found = [refusal for path in MODULES for refusal in written(path).refusals]
    assert sum(bool(VERBS.search(what)) for *_, what in found) > len(found) / 2
    assert [one for one in found if VERBS.search(one[2])] == []
    fields = [field for path in MODULES for field in written(path).fields]
    assert len(fields) > 15
    assert [one for one in fields if not re.fullmatch(r"[a-z_.{}]+", one[2])] == []


def test_public_names_have_docstrings():
    texts = {name: inspect.getdoc(thing) for name, thing in public_things()}
    assert texts
    assert [name for name, text in texts.items() if not text] == []
    made_up = [name for name, text in texts.items() if text.startswith(f"{name}(")]
    assert made_up == [], "their docstrings are those that dataclasses make up"


def nomenclature_names() -> set[str]:
    """Return the code names in the tables of the nomenclature."""
    page = (ROOT / "docs" / "nomenclature.md").read_text()
    rows = [line for line in page.splitlines() if line.startswith("|")]
    return {word for row in rows for word in re.findall(r"`([A-Za-z_]\w*)`", row)}


def test_parameters_stand_in_the_nomenclature():
    told = nomenclature_names()
    missing = {
        name: sorted(set(inspect.signature(thing).parameters) - told)
        for name, thing in public_things()
        # errors and enumerations have no parameters of their own
        if not inspect.isclass(thing) or dataclasses.is_dataclass(thing)
    }
    assert missing
    lacking = {name: parameters for name, parameters in missing.items() if parameters}
    assert lacking == {}, "docs/nomenclature.md lacks parameters"


def test_nomenclature_gives_one_row_to_each_name():
    page = (ROOT / "docs" / "nomenclature.md").read_text()
    rows = page.split("## Parameters in the code")[1].splitlines()
    names = [word for row in rows if row.startswith("| `") for word in re.findall(r"`(\w+)`", row.split("|")[1])]
    assert names
    assert len(names) == len(set(names)), sorted({name for name in names if names.count(name) > 1})


@pytest.mark.parametrize("pattern", ["evidence/benchmarks/bench_*.py", "evidence/validation/case_*.py"])
def test_modules_found_by_name_can_be_run(pattern):
    for path in ROOT.glob(pattern):
        run = next((node for node in functions(path) if node.name == "run"), None)
        assert run is not None, f"{path.name} has no run()"
        needed = len(run.args.args) - len(run.args.defaults)
        assert needed == 0, f"{path.name}: run() is called without arguments"


def test_readme_commands_are_make_targets():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    for page in ("README.md", "CONTRIBUTING.md", "docs/install.md"):
        used = set(re.findall(r"(?:`|\$ )make ([a-z-]+)", (ROOT / page).read_text()))
        assert used <= targets, page
        assert used, page


def test_an_installation_that_was_stopped_goes_on(tmp_path):
    asked = ["make", "-n", "install", f"VENV={tmp_path}", f"PYTHON={sys.executable}"]
    told = subprocess.run(asked, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    assert f"-m venv --clear {tmp_path}" in told
    (tmp_path / f".made-{sys.version_info[0]}.{sys.version_info[1]}").touch()
    told = subprocess.run(asked, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    assert "-m venv" in told
    assert "--clear" not in told


def test_the_readme_reads_alone_and_names_files_that_exist():
    """Where a package index shows it, relative links lead nowhere: it names files, and its only relative address is the picture's."""
    page = (ROOT / "README.md").read_text()
    relative = [link for link in re.findall(r"\]\(([^)]+)\)", page) if "://" not in link]
    assert relative == ["docs/images/forced_response.png"]
    named = [*relative, *re.findall(r"`((?:docs|examples|evidence)(?:/[\w./-]*)?)`", page)]
    assert len(named) > 20
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_no_tracked_file_knows_this_machine():
    suspicious = re.compile(
        r"(?<![\w.$}/-])/(?:work|opt|home|root|Users|tmp)/\w|file:///|--(?:extra-)?index-url|--find-links"
    )
    found = []
    for path in tracked_files():
        if path.suffix in {".png", ".nc", ".gz"} or path == Path(__file__):
            continue
        text = path.read_text(encoding="utf-8", errors="replace")
        found += [f"{path.relative_to(ROOT)}: {hit.group()}" for hit in suspicious.finditer(text)]
    assert found == []


def test_locked_requirements_have_hashes():
    for name in (
        "requirements.lock",
        "docs/requirements.lock",
        "optional-requirements.lock",
        "evidence/benchmarks/requirements.lock",
    ):
        text = (ROOT / name).read_text()
        line = r"^[\w.-]+==[^\s;]+(?: ; [^\n\\]+)? \\\n    --hash=sha256:"
        pinned = re.findall(line, text, flags=re.MULTILINE)
        stated = re.findall(r"^[\w.-]+", text, flags=re.MULTILINE)
        assert len(pinned) == len(stated) > 0
