"""Parts, contacts and loads assembled into a model, and the model as solvers see it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
