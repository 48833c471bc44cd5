"""Self-excited vibration: limit cycles of unstable waves bounded by friction, and their stability."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
