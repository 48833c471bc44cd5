"""All motions of a load: those that no sweep meets, searched for by deflation and from random states in time, and where starts end."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
