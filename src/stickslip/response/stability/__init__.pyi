"""Public names of `stickslip.response.stability`, written once."""

from .multipliers import Stability as Stability
from .multipliers import motion_stability as motion_stability
from .multipliers import stability as stability
