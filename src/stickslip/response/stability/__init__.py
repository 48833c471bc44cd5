"""Whether an accepted periodic motion is stable: the multipliers of small disturbances of it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
