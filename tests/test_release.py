"""What is handed out: one version everywhere, notes of a release, and a conda recipe with the dependencies of pyproject.toml."""

import ast
import importlib.util
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def script(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / ".ci" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_version_is_the_same_everywhere(tmp_path, monkeypatch):
    notes = script("release_notes")
    assert notes.version() == PROJECT["version"]
    for place in ("pyproject.toml", *notes.PLACES):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).write_text((ROOT / place).read_text(encoding="utf-8"))
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changed = re.sub(r"^version: .*", "version: 9.9", cited, flags=re.MULTILINE)
    (tmp_path / "CITATION.cff").write_text(changed)
    monkeypatch.setattr(notes, "ROOT", tmp_path)
    with pytest.raises(SystemExit, match=r"CITATION\.cff says version 9\.9"):
        notes.version()


def test_notes_are_those_of_the_version_or_of_what_is_not_released_yet():
    notes = script("release_notes").notes
    text = "# Changes\n\n## Unreleased\n\n### Added\n- b\n\n## 0.2.0 (2026-12-01)\n\n- a\n"
    assert notes(text, "0.2.0") == "- a"
    assert notes(text, "0.3.0") == "### Added\n- b"
    assert notes("# Changes\n", "0.3.0") == ""
    assert notes((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), PROJECT["version"])


def test_the_recipe_has_the_dependencies_of_the_package():
    recipe = (ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8")
    run = re.findall(r"^    - (\S+) (>=\S+)$", recipe.partition("\n  run:")[2], re.MULTILINE)
    extras = PROJECT["optional-dependencies"]
    stated = [*PROJECT["dependencies"], *extras["fe"]]
    wanted = {tuple(re.split("(?=>=)", one)) for one in stated}
    renamed = {("python-gmsh" if name == "gmsh" else name, least) for name, least in wanted}
    assert set(run) == renamed | {("python", PROJECT["requires-python"])}


def test_a_python_that_is_not_there_is_left_out():
    find = script("wheel_journey").interpreter
    assert find("3.99") is None
    assert find("/no/such/python") is None
    assert find(sys.executable) == sys.executable


def test_peaks_of_another_python_are_compared():
    compare = script("wheel_journey").compare
    peaks = {"peak_frequency_hz": [14.0, 12.0], "peak_amplitude": [1e-3, 2e-3]}
    assert compare(peaks, peaks) == ""
    other = peaks | {"peak_amplitude": [1e-3, 2.00001e-3]}
    assert compare(other, peaks) == "peak_amplitude: 0.00200001 instead of 0.002"


def test_the_journey_takes_only_a_refusal_that_names_the_extra():
    wrong = script("wheel_journey").not_refused
    refusal = "gmsh is not installed. Use pip install 'stickslip[fe]'"
    assert wrong(1, refusal, "gmsh") == ""
    assert "ended with 0" in wrong(0, refusal, "gmsh")
    assert wrong(1, refusal, "scikit-fem")
    assert wrong(1, f"{refusal}\nThis is a fault of stickslip.", "gmsh")


def test_what_is_imported_is_of_the_core_or_named_with_its_extra():
    """Packages that the wheel does not bring are imported inside functions, where a message names the extra."""
    brought = {re.split("[<>=]", one)[0].lower() for one in PROJECT["dependencies"]}
    brought |= {"pydantic_core", "stickslip"}  # the first comes with pydantic
    lacking, inside = set(), set()
    for path in (ROOT / "src").rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in tree.body:
            lacking |= {(path.name, name) for name in imported(node) - brought}
        inside |= {
            name
            for node in ast.walk(tree)
            if isinstance(node, ast.Import | ast.ImportFrom)
            for name in imported(node) - brought
        }
    assert not lacking
    # IPython shows progress in its own notebooks, psutil serves where there is no /proc: both are asked for before
    asked_for = {
        "gmsh",
        "skfem",
        "meshio",
        "feral",
        "pyuff",
        "executorlib",
        "IPython",
        "matplotlib",
        "psutil",
        "pylife",
    }
    assert inside <= asked_for


def imported(node: ast.AST) -> set[str]:
    """Return the packages that a statement imports, without those of Python itself."""
    if isinstance(node, ast.Import):
        names = {alias.name for alias in node.names}
    elif isinstance(node, ast.ImportFrom):
        names = {str(node.module)}
    else:
        return set()
    return {name.partition(".")[0] for name in names} - set(sys.stdlib_module_names)


def test_the_extra_of_earlier_versions_is_still_there():
    assert PROJECT["optional-dependencies"]["report"] == []


def test_classifiers_name_the_pythons_that_are_tried():
    versions = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    tried = re.findall(r"3\.\d+", (ROOT / ".ci" / "run").read_text(encoding="utf-8"))
    assert versions[0] == PROJECT["requires-python"].removeprefix(">=")
    assert set(versions[1:]) <= set(tried)
