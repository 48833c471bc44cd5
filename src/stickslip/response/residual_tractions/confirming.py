"""Confirmation of a bound: solved again by other means, and integrated in time."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.contact.initial_sliders import starts_of
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import one_structure
from stickslip.harmonic.peak import driven_by
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.parameter import Discretisation
from stickslip.response.residual_tractions.bounds import Bound
from stickslip.response.system import System
from stickslip.response.time.settling import SettlingStatus
from stickslip.response.time.start import start_from_harmonics
from stickslip.response.time.transient import TimeStepping, integrate
from stickslip.solve.newton_method import newton

SAMPLES = 1024  # of the march
ALIKE = 1e-3  # relative difference of the amplitudes by march and by events that sampling explains
MISSING_HARMONICS_SHARE = 0.05  # of the amplitude in time that the missing harmonics of a bound may account for


@dataclass(frozen=True)
class Confirmation:
    """Checks of a bound by other means.

    Attributes
    ----------
    resolved
        Amplitude by sampled contact forces from the same initial sliders, m; NaN without a solution.
    transient
        Amplitude by time integration from the bound's state and tractions, m; NaN where it diverged or was not run.
    status
        Status of the time integration; empty where it was not run.
    periods
        Number of integrated periods.
    agrees
        Whether both agree with the bound, apart from errors of sampling and of the neglected harmonics.
    """

    resolved: float
    transient: float
    status: SettlingStatus | None
    periods: int
    agrees: bool


@by_one_thread
def confirmed(
    system: System,
    load: HarmonicLoad,
    omega: float,
    bound: Bound,
    output: int = 0,
    discretisation: Discretisation | None = None,
    stepping: TimeStepping | None = None,
) -> Confirmation:
    """Solve a bound again and follow its motion in time, started with its displacements, velocities and tractions.

    Parameters
    ----------
    system, load, output, discretisation
        As of `traction_bounds`.
    omega
        Frequency of the bound, rad/s.
    bound
        Bound `least` or `most` of a `TractionBounds`.
    stepping
        Options of the time integration. One sector of a tuned wheel is not integrated in time.
    """
    how = discretisation or Discretisation()
    interface = starts_of(system.interface).started(bound.sliders)
    dof = system.outputs[[output]]
    linear = system.condensed(load, how.order, dof)
    balance = harmonic_balance(linear, interface, how.order, max(how.samples, SAMPLES), "march")
    start = balance.unknowns(bound.coefficients[:, linear.retained])
    # near an event a march has steps, between which no residual is as small as Newton's method asks for
    found = newton(
        lambda x: balance.linearise(x, omega), start, replace(how.newton, tolerance=max(how.newton.tolerance, 1e-8))
    )
    driven = list(driven_by(load)[0])
    motion = linear.recover(omega, balance.coefficients(found.x))
    resolved = float(np.linalg.norm(motion[driven, dof[0]])) if found.status.converged else np.nan
    same = bool(abs(resolved / bound.amplitude - 1.0) <= ALIKE)
    if system.structure.wheel is not None:
        return Confirmation(resolved, np.nan, None, 0, same)
    result = integrate(
        one_structure(system.structure, "confirmed"),
        interface.gap_operator,
        interface.laws,
        load,
        omega,
        dof,
        start_from_harmonics(bound.coefficients, omega, interface.gap_operator, interface.laws),
        stepping or TimeStepping(max_periods=600, harmonics=max(7, *driven)),
        weights=interface.weights,
    )
    known = result.harmonics if result.settled else result.averages
    transient = float(np.linalg.norm(known[driven, 0]))
    near = bool(abs(bound.amplitude / transient - 1.0) <= MISSING_HARMONICS_SHARE)
    return Confirmation(resolved, transient, result.status, result.periods, same and near)
