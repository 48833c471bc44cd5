"""stickslip: vibration of bladed disks coupled by friction joints.

The stub beside this file lists the names that can be imported from here; a module is loaded when a name is first used, so that
``import stickslip`` loads neither numba nor a mesher, and ``stickslip --help`` answers at once.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
