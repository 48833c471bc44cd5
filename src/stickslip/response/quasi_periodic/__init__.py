"""Quasi-periodic motions with two frequencies, and motions without a period."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
