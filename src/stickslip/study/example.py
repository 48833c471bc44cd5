"""The commented example studies that ship with the package."""

from importlib.resources import files
from typing import Literal

Kind = Literal["blades", "sector"]
FILES: dict[Kind, str] = {"blades": "example.toml", "sector": "example_sector.toml"}


def example_text(kind: Kind = "blades") -> str:
    """Return the example study of two blades and a damper, or of a sector of a bladed disk."""
    return files("stickslip.study").joinpath(FILES[kind]).read_text(encoding="utf-8")
