"""Vibration that nothing drives: limit cycles of unstable waves that friction bounds, and what becomes of disturbances of them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
