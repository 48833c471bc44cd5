"""Reduction of linear structures to the coordinates that contacts, loads and outputs need."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
