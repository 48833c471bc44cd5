"""Public names of `stickslip.solve`, written once."""

from .newton_method import Newton as Newton
from .newton_method import newton as newton
from .status import Status as Status
