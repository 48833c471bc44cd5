"""Analyses as functions of a system and a load."""

import warnings
from importlib import import_module
from typing import Any

import lazy_loader

_public, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_BY_SWEEP = "forced_response solves rigid contacts, too, and signals returns their forces and states"
_BY_WAVE = "call campbell with the travelling_wave of each wave number"
# public in 0.1, until 0.3: the module and the replacement
_DEPRECATED = {
    "rigid_response": ("rigid", _BY_SWEEP),
    "RigidPoint": ("rigid", _BY_SWEEP),
    "cyclic_campbell": ("rotating.campbell", _BY_WAVE),
}


def __getattr__(name: str) -> Any:
    if name not in _DEPRECATED:
        return _public(name)
    module, remedy = _DEPRECATED[name]
    warnings.warn(f"stickslip.response.{name} goes with 0.3: {remedy}", DeprecationWarning, stacklevel=2)
    return getattr(import_module(f"stickslip.response.{module}"), name)
