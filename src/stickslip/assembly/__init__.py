"""Parts, contacts and loads put together: a model, and what it is to a solver."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
