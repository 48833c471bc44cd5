"""Public names of `stickslip.response.all_motions`, written once."""

from .basins import Basins as Basins
from .basins import share_interval as share_interval
from .deflation import deflated_newton as deflated_newton
from .found import AllMotions as AllMotions
from .found import MotionBranch as MotionBranch
from .found import MotionSearch as MotionSearch
from .search import all_motions as all_motions
