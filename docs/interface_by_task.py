"""The public names of the package by what they are for: `docs/api.md`, and the full text of each."""

import ast
import importlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import stickslip

ROOT = Path(stickslip.__file__).parent

# task -> the modules whose public names serve it, the longest that fits; the order is that of the page
TASKS = {
    "Ask a question, look at the answer": ("api", "errors"),
    "Make a model": ("assembly", "model.part", "model.fe.solid", "model.readers.units"),
    "Blades, sectors and beams of given shape": ("model.mesh", "model.fe.beam", "model.matrices"),
    "Dampers and other rigid bodies": ("model.rigid",),
    "Damping": ("model.damping",),
    "Read and write files of other programs": ("model.readers", "model.deck", "model.structure_file"),
    "Contact laws": ("contact.laws", "contact.law", "contact.law_check"),
    "Fit a law to measured loops": ("contact.loop_fit", "model.readers.measured_columns"),
    "Pair surfaces": ("contact",),
    "Matrices, modes and rotation": ("model",),
    "Reduction": ("reduction",),
    "Wheels: sectors, waves, stages": (
        "reduction.cyclic",
        "reduction.full_wheel",
        "reduction.tuned",
        "reduction.waves",
        "reduction.whole_wheel",
        "reduction.coupled_stages",
        "reduction.aerodynamics",
    ),
    "Campbell, SAFE and nodal-diameter diagrams, flutter": ("response.rotating",),
    "Forced response": ("response",),
    "Harmonic balance": ("harmonic", "solve"),
    "Which harmonics are kept": ("harmonic.selection", "response.verification"),
    "Peaks over a design parameter": ("response.resonances", "response.parameter"),
    "Stability": ("response.stability", "response.free_motion"),
    "Bifurcations and other motions": ("response.bifurcations", "response.all_motions"),
    "Nonlinear modes": ("response.nonlinear_modes",),
    "Limit cycles": ("response.self_excited",),
    "Two frequencies": ("response.quasi_periodic",),
    "Residual tractions": ("response.residual_tractions",),
    "Time": ("response.time",),
    "Strength": ("model.strength",),
}

_INTRODUCTION = """\
This page lists the public names of Python by task; [researcher](start/researcher.md) is a first script. `ss` is `import stickslip as ss`. The names for most work stand at its top, the others in one package for each layer, such as `ss.harmonic`.
A module is loaded when one of its names is first used. `help(ss.Model)` shows parameters, units and errors, as does [the same list in full](api_in_full.md).
Written by `python docs/generate.py`."""


@dataclass(frozen=True)
class Name:
    """A public name.

    Parameters
    ----------
    path
        As it is imported: ``stickslip.model.lumped``.
    home
        The module that defines it, without the package: ``model.matrices``.
    """

    path: str
    home: str

    @property
    def about(self) -> str:
        """The first line of its docstring."""
        package, _, name = self.path.rpartition(".")
        text = getattr(importlib.import_module(package), name).__doc__ or ""
        return text.strip().split("\n")[0]

    @property
    def kind(self) -> str:
        """Which directive of autodoc tells all of it."""
        return "autoclass" if self.path.rpartition(".")[2][0].isupper() else "autofunction"


def public_names() -> Iterator[Name]:
    """Yield all names that the stubs of the packages list."""
    for stub in sorted(ROOT.rglob("__init__.pyi")):
        package = ".".join(["stickslip", *stub.parent.relative_to(ROOT).parts])
        for node in ast.parse(stub.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ImportFrom) and node.module:  # packages stand for themselves
                home = f"{package}.{node.module}".partition(".")[2]
                yield from (Name(f"{package}.{alias.name}", home) for alias in node.names)


def by_task() -> dict[str, list[Name]]:
    """Return the names of each task, those at the top of the package first."""
    found: dict[str, list[Name]] = {task: [] for task in TASKS}
    task_of = {module: task for task, modules in TASKS.items() for module in modules}
    for name in public_names():
        parts = name.home.split(".")
        prefixes = (".".join(parts[:n]) for n in range(len(parts), 0, -1))
        module = next(p for p in prefixes if p in task_of)
        found[task_of[module]].append(name)
    for names in found.values():
        names.sort(key=lambda n: (n.path.count(".") > 1, n.path.count("."), n.path.lower()))
    return found


def interface_page() -> str:
    """Return `docs/api.md`: a table a task, a line a name."""
    lines = ["# Python interface, by task", "", _INTRODUCTION, ""]
    for task, names in by_task().items():
        lines += [f"## {task}", "", "| name | what it is |", "|---|---|"]
        lines += [f"| `{n.path.replace('stickslip', 'ss', 1)}` | {_cell(n.about)} |" for n in names]
        lines.append("")
    return "\n".join(lines)


def _cell(text: str) -> str:
    return text.replace("``", "`").replace("|", "\\|")


def in_full() -> str:
    """Return the directives that tell all of every name, task by task."""
    lines = []
    for task, names in by_task().items():
        lines += [f"## {task}", ""]
        for name in names:
            lines += ["```{eval-rst}", f".. {name.kind}:: {name.path}", "```", ""]
    return "\n".join(lines)
