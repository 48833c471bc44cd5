"""Objects in the user's modules that a study file names as ``my_module:Name``.

A file cannot run code by itself: the user allows it for each command. The module is searched beside the study file first, then among
installed modules. Results depend on the hashes of its files.
"""

import ast
import re
import sys
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from importlib import import_module, invalidate_caches
from pathlib import Path
from types import ModuleType
from typing import Any

from stickslip.errors import InputError, StickslipError, did_you_mean, input_error
from stickslip.study.questions import loaded

ADDRESS = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*:[A-Za-z_]\w*")
ALLOW = "If you trust it, add --allow-code to the command (in Python: Study.from_file(path, allow_code=True))."
CODE_FILE = "own_code.json"  # file in a results folder with the hashes at the last run
_USED: set[str] = set()  # files of user modules imported by this process


@dataclass(frozen=True, eq=False)
class OwnCode:
    """User's code that a study may use.

    Parameters
    ----------
    home
        Folder of the study file.
    allowed
        Whether the user allows it.
    remedy
        Remedy in the message if it is not allowed.
    files
        Name and SHA-256 of each file used so far; `at` adds to it.
    """

    home: Path = field(default_factory=Path)
    allowed: bool = False
    remedy: str = ALLOW
    files: dict[str, str] = field(default_factory=dict)

    def at(self, address: str, kind: str, members: Sequence[str], *, instance: bool = False) -> Any:
        """Return the object at an address ``my_module:Name``.

        Parameters
        ----------
        address
            The address, as in the file.
        kind
            Required kind of the object, for messages, such as ``strategy``.
        members
            Names of required attributes.
        instance
            Whether a class is replaced by its instance, made without arguments.

        Raises
        ------
        InputError
            If code is not allowed (nothing is imported then), the module cannot be imported, or the object is missing or lacks a member.
        """
        module, _, name = address.partition(":")
        if not ADDRESS.fullmatch(address):
            raise _refused(
                f"is no module path, got {address!r}", "Write my_module:Name, of my_module.py beside the study file."
            )
        if not self.allowed:
            raise _refused(
                f"names code of your own, which nothing runs unasked, got {address!r}",
                self.remedy,
            )
        loaded, files = _loaded(module, self.home)
        found = getattr(loaded, name, None)
        if found is None:
            known = [word for word in vars(loaded) if not word.startswith("_")]
            raise _refused(f"{module} has no {name!r}, got {address!r}", did_you_mean(name, known))
        found = made(found, address) if instance else found
        lacking = [word for word in members if word not in dir(found)]  # hasattr would compile kernels
        if lacking:
            raise _refused(
                f"{name} of {module} is no {kind}: it has no {lacking[0]!r}, got {address!r}",
                f"Give it {', '.join(lacking)}: docs/extending.md shows one.",
            )
        self.files.update(files)
        return found


@dataclass(frozen=True)
class Shipped:
    """User's code that a job needs, for import in another process.

    Parameters
    ----------
    home
        Folder of the study file.
    files
        Name and SHA-256 of each file.
    """

    home: Path
    files: Mapping[str, str]

    def importable(self) -> None:
        """Make the modules importable in this process.

        Raises
        ------
        StickslipError
            If a file beside the study has changed since the run began.
        """
        _first_on_path(self.home)
        now = {name: _hash(self.home / name) for name in self.files if (self.home / name).is_file()}
        other = [name for name, found in now.items() if found != self.files[name]]
        if other:
            raise StickslipError(
                f"{other[0]} has changed since the run began. The same command starts with the new one."
            )


def is_address(given: object) -> bool:
    """Whether a value of a study file is an address ``my_module:Name`` instead of a built-in name."""
    return isinstance(given, str) and ":" in given


def state_of(address: str) -> str:
    """Return a text that changes with the module's files, for an address that `OwnCode.at` has already accepted."""
    module = address.partition(":")[0]
    source = getattr(import_module(module.partition(".")[0]), "__file__", None)
    if source is None:
        return module
    inside = Path(source).name == "__init__.py"
    home = Path(source).parent.parent if inside else Path(source).parent
    return " ".join(f"{name} {found}" for name, found in sorted(_files(module, home).items()))


def called(address: str, place: str, *given: Any, **named: Any) -> Any:
    """Call the function at an accepted address and return its result.

    Raises
    ------
    InputError
        If the function raises an exception: its own `InputError`, or else an error at `place` with the line of the exception.
    """
    function = loaded(address)
    try:
        return function(*given, **named)
    except InputError:
        raise
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise input_error(
            place,
            f"{address} raises {type(error).__name__}: {error}",
            f"See {Path(last.filename).name}, line {last.lineno}.",
        ) from error


def line_of(error: BaseException) -> str | None:
    """Return file and line of the user's code in which an error was raised; None if no user code was involved."""
    homes = {Path(source).parent for source in _USED}
    frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).parent in homes]
    return f"{Path(frames[-1].filename).name}, line {frames[-1].lineno}" if frames else None


def made(found: Any, address: str) -> Any:
    """Return an instance of a class, made without arguments; return other objects unchanged.

    Raises
    ------
    InputError
        If the class needs arguments.
    """
    if not isinstance(found, type):
        return found
    try:
        return found()
    except Exception as error:
        name = address.partition(":")[2]
        raise _refused(
            f"{name}() raises {type(error).__name__}: {error}, got {address!r}",
            f"Give every parameter a default, or name an object of the module: {name.upper()} = {name}(...).",
        ) from error


def _refused(problem: str, remedy: str) -> InputError:
    return input_error("code of your own", problem, remedy)


def _loaded(module: str, home: Path) -> tuple[ModuleType, Mapping[str, str]]:
    """Return a module and the hashes of its files at the time of its import."""
    beside = _file_beside(module, home)
    if beside is not None:
        known = getattr(sys.modules.get(module), "__file__", None)
        if module in sys.modules and (known is None or Path(known).resolve() != beside.resolve()):
            raise _refused(
                f"{module}.py stands beside the study file, and Python has loaded another {module} ({known or 'built in'})",
                "Rename your module; in Python, read studies of two folders in two processes.",
            )
        _first_on_path(home)
    loaded, files = _imported(module, home)
    for name, then in files.items():
        if (home / name).is_file() and _hash(home / name) != then:
            raise _refused(f"{name} has changed since this Python imported it", "Start Python again.")
    return loaded, files


@cache
def _imported(module: str, home: Path) -> tuple[ModuleType, Mapping[str, str]]:
    files = _files(module, home)
    try:
        loaded = import_module(module)
    except (Exception, SystemExit) as error:
        raise _not_imported(module, home, error) from error
    source = getattr(loaded, "__file__", None)
    _USED.update([source] if source else [])
    if not files:
        files = {f"{module}.py": _hash(Path(source)) if source else "built in"}
    return loaded, files


def _not_imported(module: str, home: Path, error: BaseException) -> InputError:
    if isinstance(error, ModuleNotFoundError) and error.name in (module, module.partition(".")[0]):
        here = [path.stem for path in sorted(home.glob("*.py"))]
        remedy = did_you_mean(module, here) if here else f"Put {module}.py there."
        return _refused(f"there is no module {module}, neither beside the study file nor installed", remedy)
    frames = [f for f in traceback.extract_tb(error.__traceback__) if Path(f.filename).parent == home]
    line = error.lineno if isinstance(error, SyntaxError) else frames[-1].lineno if frames else None
    place = f"{module}.py, line {line}" if line else module
    return _refused(f"importing {module} raises {type(error).__name__}: {error}", f"Correct {place}.")


def _first_on_path(home: Path) -> None:
    if str(home) not in sys.path:
        sys.path.insert(0, str(home))
        invalidate_caches()


def _file_beside(module: str, home: Path) -> Path | None:
    """Return the file of a module beside the study; None if it is elsewhere."""
    stem = home.joinpath(*module.split("."))
    found = (path for path in (stem.with_suffix(".py"), stem / "__init__.py") if path.is_file())
    return next(found, None)


def _files(module: str, home: Path) -> dict[str, str]:
    """Return names and hashes of a module's file beside the study, and of all files beside the study that it imports."""
    found: dict[str, str] = {}
    left = [module]
    while left:
        path = _file_beside(left.pop(), home)
        name = "" if path is None else path.relative_to(home).as_posix()
        if path is not None and name not in found:
            found[name] = _hash(path)
            left += _imports(path)
    return found


def _imports(path: Path) -> list[str]:
    """Return the names of the modules that a file imports; an empty list if it is not valid Python."""
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):
        return []
    names: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names += [node.module, *(f"{node.module}.{one.name}" for one in node.names)]
    return names


def _hash(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
