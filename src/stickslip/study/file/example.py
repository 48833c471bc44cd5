"""The commented example studies that ship with the package."""

from importlib.resources import files
from typing import Literal

Kind = Literal["blades", "sector", "wheel", "file", "masses"]


def example_text(kind: Kind = "blades") -> str:
    """Return a commented example study: two blades and a damper, a meshed sector, a wheel of lumped masses, a model from a file, or four masses."""
    folder = files("stickslip.study.file").joinpath("examples")
    return folder.joinpath(f"{kind}.toml").read_text(encoding="utf-8")
