"""Public names of `stickslip.response.bifurcations`, written once."""

from .found import Bifurcation as Bifurcation
from .found import Bifurcations as Bifurcations
from .locate import bifurcations as bifurcations
from .period_multiplied import EverySector as EverySector
from .period_multiplied import every_sector as every_sector
from .period_multiplied import over_periods as over_periods
from .side_branch import SideBranch as SideBranch
from .side_branch import side_branches as side_branches
from .side_branch import subharmonic_branch as subharmonic_branch
