"""Public names of `stickslip.response.residual_tractions`, written once."""

from .bounds import Bound as Bound
from .bounds import Confirmation as Confirmation
from .bounds import TractionBounds as TractionBounds
from .bounds import confirmed as confirmed
from .bounds import resonance_bounds as resonance_bounds
from .bounds import traction_bounds as traction_bounds
from .search import TractionSearch as TractionSearch
