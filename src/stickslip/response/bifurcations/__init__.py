"""Bifurcations of a forced response: location on a branch, and branches that emanate there."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
