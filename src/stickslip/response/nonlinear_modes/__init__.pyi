"""Public names of `stickslip.response.nonlinear_modes`, written once."""

from .backbone import Backbone as Backbone
from .backbone import ModePoint as ModePoint
from .backbone import ModeSweep as ModeSweep
from .backbone import nonlinear_mode as nonlinear_mode
