"""What happens at a contact point: laws, their evaluation over a period, and where the points are."""

import lazy_loader

from stickslip.contact.cache import allow_no_cache
from stickslip.contact.compiling import say_what_is_compiled

# before any function is compiled
allow_no_cache()
say_what_is_compiled()

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
