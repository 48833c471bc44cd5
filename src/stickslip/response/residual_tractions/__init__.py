"""How far the answer depends on the tractions that contacts which never slip have kept from before."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
