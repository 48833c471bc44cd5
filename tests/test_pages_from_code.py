"""Pages that are made from the code: current, and complete."""

import importlib
import json
import re
import sys
from inspect import Parameter, signature
from pathlib import Path
from types import ModuleType
from typing import get_args

import pytest

import stickslip
from stickslip.study.file.tables import json_schema
from stickslip.study.questions import ANALYSES

DOCS = Path(__file__).parents[1] / "docs"
NO_TABLES = {"schema_version", "title", "vary"}  # at the top of the file


@pytest.fixture(scope="module")
def generate() -> ModuleType:
    """The module that writes them."""
    sys.path.insert(0, str(DOCS))
    try:
        return importlib.import_module("generate")
    finally:
        sys.path.remove(str(DOCS))


def test_pages_in_the_repository_are_what_the_code_says(generate: ModuleType) -> None:
    pages = generate.kept()
    there = {f"{p.parent.name}/{p.name}" for d in ("keys", "variables") for p in (DOCS / d).glob("*.md")}
    assert there | {"api.md"} == set(pages)
    old = [p for p, text in pages.items() if (DOCS / p).read_text(encoding="utf-8") != text]
    assert old == [], "run `python docs/generate.py`"


def test_the_typed_keys_of_methods_are_those_of_their_tables(generate: ModuleType) -> None:
    made = generate.typed_keys
    assert made.FILE.read_text(encoding="utf-8") == made.module(), "run `python docs/generate.py`"
    for name in ANALYSES:
        method = getattr(stickslip.Model, name)
        (typed,) = get_args(method.__annotations__["keys"])
        assert typed.__name__ == made.class_name(name)
        own = method.__code__.co_varnames[: method.__code__.co_argcount + method.__code__.co_kwonlyargcount]
        shown = {key for key, p in signature(method).parameters.items() if key not in own}
        assert typed.__annotations__.keys() == shown  # what `help` shows, and what is accepted
        assert typed.__required_keys__ == {
            key for key in shown if signature(method).parameters[key].default is Parameter.empty
        }


def test_every_table_of_a_study_has_its_keys_on_a_page(generate: ModuleType) -> None:
    told = [name for _, tables in generate.PAGES_OF_KEYS.values() for name in tables]
    assert len(told) == len(set(told))
    assert set(told) - {""} == set(json.loads(json_schema())["properties"]) - NO_TABLES


def test_every_public_name_serves_a_task(generate: ModuleType) -> None:
    tasks = generate.interface_by_task.by_task()
    assert all(tasks.values())
    assert sum(map(len, tasks.values())) == len(list(generate.interface_by_task.public_names()))


def test_files_and_modules_that_pages_name_exist() -> None:
    root = DOCS.parent
    files = {str(p.relative_to(root)) for p in root.rglob("*.py") if not {".venv", "build", "out"} & set(p.parts)}
    names = {f"/{name}" for name in files}
    pages = [*DOCS.rglob("*.md"), root / "README.md", root / "CONTRIBUTING.md"]
    found = [
        (page.name, word)
        for page in pages
        for word in re.findall(r"(?<![\w/.-])[a-z_][\w/.]*\.py\b", page.read_text(encoding="utf-8"))
        if "NAME" not in word and "/slip_onset/" not in word  # a folder that the page of extensions makes
    ]
    assert len(found) > 100
    assert [one for one in found if not any(name.endswith(f"/{one[1]}") for name in names)] == []
    modules = {
        (page.name, word)
        for page in pages
        for word in re.findall(r"(?:python -m )(evidence[\w.]*\w)", page.read_text(encoding="utf-8"))
    }
    assert modules
    folders = {str(Path(name).parent) for name in files}
    assert [m for m in modules if (w := m[1].replace(".", "/")) not in folders and f"{w}.py" not in files] == []
