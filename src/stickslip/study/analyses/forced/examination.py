"""What an examination of the stability costs: all sectors of a wheel count, each of which may do something else."""

from stickslip.reduction.tuned import TunedWheel
from stickslip.response.system import System
from stickslip.response.time.sectors import different_sectors

INTERVALS = 12  # between transitions, for each contact: 2 to 18 at the peaks of the two blades
PRODUCTS = 20  # of matrices for each of these
FLOPS = 2e10  # a second, of such products on one core
MOST_WORK = 60 * FLOPS  # of one examination
MOST_WHEEL = (
    4 * FLOPS
)  # the same of all sectors of a wheel, whose other waves are reduced for nothing else


def examination_work(system: System) -> float:
    """Return the operations of one examination, which looks at two motions; of a wheel at those of all its sectors.

    A travelling motion repeats itself in other sectors, so that a share of the period is enough.
    """
    side, sectors, shares = system.structure, 1, 1
    if isinstance(side, TunedWheel):
        sectors, shares = side.sectors, different_sectors(side)[0]
    rows = 2 * sectors * side.n
    intervals = INTERVALS * sectors * system.interface.n_contacts / shares
    return 2.0 * intervals * PRODUCTS * 2.0 * rows**3


def examines_every_wave(system: System) -> bool:
    """Whether a tuned wheel is so small that the stability of its motions is examined against every wave."""
    return isinstance(system.structure, TunedWheel) and examination_work(system) <= MOST_WHEEL
