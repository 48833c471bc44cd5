"""Motions of other branches: sweeps up and down a wider range, where laws allow several motions."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.laws.bouc_wen import BoucWen
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.dahl import Dahl
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.regularised_coulomb import RegularisedCoulomb
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.response.continuation.branch import Followed
from stickslip.response.continuation.starting_solutions import plain_sweep
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton, newton

WIDER = 1.3  # the sweeps begin and end at this multiple of the range and its inverse: a branch that bends leads far
POINTS = 15  # least number of points of a sweep around one frequency; two more for each further one
ONE = (Bonded, BoucWen, Dahl, Iwan, Jenkins)  # no stop, and friction under a constant normal load
NORMAL = (CoupledCoulomb, ElasticCoulomb, RegularisedCoulomb)  # the same where k_n is zero


def may_be_several(interface: Interface) -> bool:
    """Whether a law of an interface is more than friction under a constant normal load, which alone leaves one branch."""
    return not all(_leaves_one(law) for law in interface.laws)


def _leaves_one(law: ContactLaw) -> bool:
    return isinstance(law, ONE) or (isinstance(law, NORMAL) and law.k_n == 0.0)


def both_ways(
    system: System, balance: HarmonicBalance, omegas: Sequence[float], options: Newton
) -> list[list[Followed]]:
    """Return the branches from below the frequencies upward and from above them downward."""
    low, high = min(omegas) / WIDER, max(omegas) * WIDER
    points = POINTS + 2 * (len(omegas) - 1)
    return [plain_sweep(system, balance, way, points, options) for way in ((low, high), (high, low))]


def crossings(
    branches: Sequence[Sequence[Followed]], balance: HarmonicBalance, omega: float, options: Newton
) -> Iterator[FloatArray]:
    """Yield the unknowns of every motion in which a branch passes a frequency; the same one as often as it is met."""
    for branch in branches:
        for one, other in pairwise(branch):
            if not (one.converged and other.converged) or (one.p - omega) * (other.p - omega) > 0.0:
                continue
            share = (omega - one.p) / (other.p - one.p) if other.p != one.p else 0.0
            begin = np.asarray(one.point.x + share * (other.point.x - one.point.x))
            found = newton(lambda x: balance.linearise(x, omega), begin, options)
            if found.status.converged:
                yield found.x
