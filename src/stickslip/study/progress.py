"""Where a run tells how far it is, how it is stopped, and with what it was made."""

import platform
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Protocol

from stickslip import __version__
from stickslip.errors import StickslipError

LIBRARIES = ("numpy", "scipy", "numba", "gmsh", "scikit-fem", "pydantic", "xarray", "h5netcdf")


class Interrupted(StickslipError):  # noqa: N818  stopping a run is no error
    """The user stopped a run; what is finished is kept."""


class Sink(Protocol):
    """Where a run tells how far it is."""

    def say(self, text: str) -> None:
        """Take a line of text."""
        ...

    def begin(self, title: str) -> None:
        """Take the title of a load case that starts."""
        ...

    def advance(self, fraction: float, text: str) -> None:
        """Take the share of the load case that is done, and its state in words."""
        ...


@dataclass(frozen=True, eq=False)
class Log:
    """Every line of the run on the disk, and on to the user's sink."""

    path: Path
    sink: Sink

    def say(self, text: str) -> None:
        """Take a line of text."""
        with self.path.open("a", encoding="utf-8") as stream:
            stream.write(f"{datetime.now(UTC).isoformat(timespec='seconds')} {text}\n")
        self.sink.say(text)


def library_versions() -> dict[str, str]:
    """Return the versions of this package, Python and the libraries that make numbers."""
    found = {"stickslip": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
