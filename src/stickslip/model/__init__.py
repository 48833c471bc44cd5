"""Structures: finite-element blades, rigid dampers, lumped masses, damping and modes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
