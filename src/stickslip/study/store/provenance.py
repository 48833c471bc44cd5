"""Provenance of a result, as attributes of the tree's root."""

import json
import platform
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from time import perf_counter
from typing import Any

from stickslip import __version__

LIBRARIES = ("numpy", "scipy", "numba", "gmsh", "scikit-fem", "pydantic", "xarray", "h5netcdf")


@dataclass(frozen=True)
class Provenance:
    """Origin of a result.

    Parameters
    ----------
    title
        Title of the study.
    study_toml
        Text of the study file; empty for a Python model.
    versions
        Versions of the libraries that affect numbers.
    model_tables
        Tables of an equivalent study file as JSON, for a Python model; empty for a study.
    study_file
        Name of the study file; empty for a Python model.
    created
        Start of the run that wrote the result.
    began
        Start of the run on a monotonic clock, s.
    """

    title: str
    study_toml: str
    versions: dict[str, str]
    model_tables: str = ""
    study_file: str = ""
    created: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="seconds"))
    began: float = field(default_factory=perf_counter)

    def attributes(self, *, complete: bool) -> dict[str, Any]:
        """Return the attributes of the root: texts and numbers only."""
        own = {"model_tables": self.model_tables, "study_file": self.study_file}
        told = {name: text for name, text in own.items() if text}
        return told | {
            "title": self.title,
            "study_toml": self.study_toml,
            "stickslip_version": __version__,
            "versions": json.dumps(self.versions),
            "created": self.created,
            "wall_seconds": perf_counter() - self.began,
            "complete": int(complete),
        }


def as_text(name: str) -> str:
    """Return a file name with replacements for bytes that are not UTF-8, which results and pages cannot contain."""
    return name.encode("utf-8", "backslashreplace").decode()


def library_versions() -> dict[str, str]:
    """Return the versions of this package, Python and the libraries that affect numbers."""
    found = {"stickslip": __version__, "python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
