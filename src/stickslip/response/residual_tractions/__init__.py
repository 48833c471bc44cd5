"""Bounds of the response over residual tractions, the arbitrary tangential preloads in contacts that never slip."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
