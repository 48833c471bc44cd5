"""The periodic problem: condensed dynamic stiffness, contact forces in the frequency domain, residual and Jacobian."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
