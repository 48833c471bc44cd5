"""Starts for a corrector from a time integration, which needs no neighbour: a motion that lifts off comes about by itself."""

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.sparse

from stickslip.arrays import FloatArray
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.response.preload import bonded_start
from stickslip.response.system import System
from stickslip.response.transient import TimeStepping, integrate, start_from_harmonics

PERIODS = (5, 10, 20, 40, 75)  # before each start, counted from the last one
STEPS = 256  # in a period: a start, not a judge
SETTLED = 1e-4  # change of the first harmonic still to come, relative, from which on it is useless


def integrated_starts(
    balance: HarmonicBalance,
    system: System,
    omega: float,
    static: FloatArray,
    periods: Sequence[int] = PERIODS,
) -> Iterator[FloatArray]:
    """Yield starts for a corrector: harmonics of the last period of an integration that begins on the bonded vibration about rest.

    Those after one that converged need not be asked for: the integration goes on only when the next start is wanted. It ends early where
    the motion has settled, and yields nothing where it overflows or cannot be done (see `can_integrate`). It comes near stable motions; where
    none has the period of the excitation, its last period may still lie near a periodic motion, which is then an unstable one.

    Parameters
    ----------
    balance
        Harmonic balance at the contacts of the system, with the load.
    system
        The same structure and contacts.
    omega
        Frequency, rad/s.
    static
        (n_retained,) static equilibrium, m.
    periods
        Periods of the excitation to integrate before each start, counted from the one before.

    Yields
    ------
    ndarray
        (size,) scaled unknowns.
    """
    if not can_integrate(system):
        return
    coefficients = balance.coefficients(bonded_start(balance, omega, system))
    coefficients[0] = static
    traction = balance.contacts(balance.unknowns(coefficients), omega).force[:, :2, 0]
    state = start_from_harmonics(balance.linear.recover(omega, coefficients), omega, traction)
    contacts = system.interface
    steps = max(STEPS, 4 * balance.order)
    for count in periods:
        stepping = TimeStepping(
            steps_per_period=steps, max_periods=count, tolerance=SETTLED, harmonics=balance.order
        )
        found = integrate(
            system.structure, contacts.gap_operator, contacts.laws, balance.linear.load, omega,
            balance.linear.retained, state, stepping,
        )  # fmt: skip
        if found.status == "diverged":
            return
        yield balance.unknowns(found.harmonics)
        if found.settled:
            return
        state = found.final


def can_integrate(system: System) -> bool:
    """Whether the time integration knows all contacts of a system, each counted once, and its mass matrix is regular."""
    interface = system.interface
    if not all(isinstance(law, ElasticCoulomb) for law in interface.laws):
        return False
    if interface.weights is not None and np.any(interface.weights != 1.0):
        return False
    mass = system.structure.mass
    array = mass.toarray() if scipy.sparse.issparse(mass) else np.asarray(mass)
    try:
        np.linalg.cholesky(array)
    except np.linalg.LinAlgError:
        return False
    return True
