"""Contact laws, their evaluation over a period, and the geometry of contact points."""

import warnings
from importlib import import_module
from typing import Any

import lazy_loader

_public, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_DEPRECATED = ("neighbour_interface", "neighbour_gaps")  # public in 0.1, until 0.3


def __getattr__(name: str) -> Any:
    if name not in _DEPRECATED:
        return _public(name)
    remedy = "give a Model a Contact between a surface and next.PART.SURFACE"
    warnings.warn(f"stickslip.contact.{name} goes with 0.3: {remedy}", DeprecationWarning, stacklevel=2)
    return getattr(import_module("stickslip.contact.neighbours"), name)
