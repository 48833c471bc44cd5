"""Generic numerics for ``F(x, p) = 0``: Newton's method and continuation, without physics."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
