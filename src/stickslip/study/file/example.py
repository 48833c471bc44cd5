"""The commented example studies that ship with the package."""

import gzip
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Literal

Kind = Literal["blades", "damper", "own_blades", "sector", "wheel", "mistuned", "file", "masses"]
DECKS = {"own_blades": {"blade.inp": "own_blades.blade.inp.gz"}}  # kind -> name beside the study -> file of the package


def example_text(kind: Kind = "blades") -> str:
    """Return a commented example study.

    Parameters
    ----------
    kind
        ``blades``: two blades and a damper. ``damper``: the same with other dampers to choose. ``own_blades``: blades from a deck.
        ``sector``: a meshed sector. ``wheel``, ``mistuned``: wheels of lumped masses. ``file``: a sector from a file. ``masses``: four masses.
    """
    return _folder().joinpath(f"{kind}.toml").read_text(encoding="utf-8")


def example_decks(kind: Kind) -> dict[str, bytes]:
    """Return the decks that an example study reads: name beside the study -> content."""
    return {name: gzip.decompress(_folder().joinpath(own).read_bytes()) for name, own in DECKS.get(kind, {}).items()}


def _folder() -> Traversable:
    return files("stickslip.study.file").joinpath("examples")
