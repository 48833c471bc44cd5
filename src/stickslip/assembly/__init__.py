"""Assembly of parts, contacts and loads to a model, and the input of the solvers."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
