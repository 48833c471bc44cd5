"""Contact laws, their evaluation over a period, and the geometry of contact points."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
