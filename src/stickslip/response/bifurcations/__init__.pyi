"""Public names of `stickslip.response.bifurcations`, written once."""

from .found import Bifurcation as Bifurcation
from .found import Bifurcations as Bifurcations
from .locate import bifurcations as bifurcations
