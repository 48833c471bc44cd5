"""The commented example studies that ship with the package."""

from importlib.resources import files
from typing import Literal

Kind = Literal["blades", "sector", "file"]
FILES: dict[Kind, str] = {
    "blades": "example.toml",
    "sector": "example_sector.toml",
    "file": "example_file.toml",
}


def example_text(kind: Kind = "blades") -> str:
    """Return the example study of two blades and a damper, of a sector of a bladed disk, or of one from a file."""
    return files("stickslip.study").joinpath(FILES[kind]).read_text(encoding="utf-8")
