"""What happens at a contact point: laws, their evaluation over a period, and where the points are."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
