"""Nonlinear modes: unforced periodic motions of a structure with contacts, over their amplitude."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
