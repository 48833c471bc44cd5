"""Search for all motions under a load by deflation and by random starts in time, with their basins of attraction."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
