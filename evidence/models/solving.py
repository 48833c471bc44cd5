"""Solutions of small systems: harmonic balance from a bonded start, and the judge's time integration with two step lengths."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from evidence.integrator import transient, verlet
from evidence.integrator.transient import (
    PeriodicLoad,
    TimeStepping,
    TransientResult,
    TransientStart,
    start_from_harmonics,
)
from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.law import ContactLaw
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.response.equilibrium import bonded_start, preload
from stickslip.response.forced.problem import ForcedPoint
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton, newton


@dataclass(frozen=True, eq=False)
class RefinedResult:
    """The same periodic motion at a step and at half the step.

    Parameters
    ----------
    first_harmonic
        (n_outputs,) complex, m; extrapolated to a vanishing step as for an error of second order; the finer average
        where the motion has not settled.
    error
        Estimated error of `first_harmonic`, relative to its largest amplitude, with the scatter of such averages.
    coarse, fine
        Results of the two integrations.
    """

    first_harmonic: ComplexArray
    error: float
    coarse: TransientResult
    fine: TransientResult


def integrate(
    structure: Structure,
    gap_operator: Matrix,
    laws: Sequence[ContactLaw],
    load: PeriodicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart | None = None,
    stepping: TimeStepping | None = None,
) -> TransientResult:
    """Integrate by the judge's scheme for elastic Coulomb contacts, or by that for any others."""
    elastic = all(type(law).__name__ == "ElasticCoulomb" for law in laws)
    scheme = transient.integrate if elastic else verlet.integrate
    return scheme(structure, gap_operator, laws, load, omega, outputs, start, stepping)


def integrate_refined(
    structure: Structure,
    gap_operator: Matrix,
    laws: Sequence[ContactLaw],
    load: PeriodicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart | None = None,
    stepping: TimeStepping | None = None,
) -> RefinedResult:
    """Integrate as `integrate` does, go on from there with half the step, and estimate the error of the step.

    The switching instants fall anywhere within a step, so that the factor between the two errors is four only on
    average: the whole difference of the two results is reported as the error, not the third that theory would allow.
    """
    stepping = stepping or TimeStepping()
    coarse = integrate(structure, gap_operator, laws, load, omega, outputs, start, stepping)
    halved = replace(stepping, steps_per_period=2 * stepping.steps_per_period)
    begin = start if coarse.status == "diverged" else coarse.final
    fine = integrate(structure, gap_operator, laws, load, omega, outputs, begin, halved)
    first, finer = (r.harmonics[1] if r.settled else r.average for r in (coarse, fine))
    difference, largest = finer - first, np.max(np.abs(finer))
    scatter = sum(0.0 if r.settled else r.scatter for r in (coarse, fine))
    error = float(np.max(np.abs(difference)) / largest) if largest != 0.0 else 0.0
    share = 1.0 / 3.0 if coarse.settled and fine.settled else 0.0  # noise must not be extrapolated
    return RefinedResult(finer + share * difference, error + scatter, coarse, fine)


def balance_of(problem: System, load: HarmonicLoad, order: int, samples: int) -> HarmonicBalance:
    """Set up the harmonic balance of a system under a load."""
    linear = condense(problem.structure, problem.retained, load)
    return harmonic_balance(linear, problem.interface, order, samples)


def bonded(problem: System, balance: HarmonicBalance, load: HarmonicLoad, omega: float) -> FloatArray:
    """Return the scaled start that the library uses: the static equilibrium plus the vibration with bonded contacts."""
    guess = balance.coefficients(bonded_start(balance, omega, problem))
    guess[0] = preload(problem, load.static)
    return balance.unknowns(guess)


def solve(balance: HarmonicBalance, omega: float, start: FloatArray) -> FloatArray:
    """Solve at one frequency from a scaled start.

    Raises
    ------
    RuntimeError
        If Newton does not converge.
    """
    options = Newton(tolerance=1e-12, max_iterations=60)
    solution = newton(lambda v: balance.linearise(v, omega), start, options)
    if not solution.status.converged:
        raise RuntimeError(f"omega = {omega}: {solution.status.advice}")
    return solution.x


def motion(balance: HarmonicBalance, omega: float, x: FloatArray) -> ComplexArray:
    """Return the (H+1, n) coefficients of all dofs at the scaled solution `x`."""
    return balance.linear.recover(omega, balance.coefficients(x))


def at_frequency(
    problem: System, load: HarmonicLoad, hertz: float, order: int, samples: int = 256, span: float = 0.5
) -> ForcedPoint:
    """Solve at one frequency in hertz with the public forced response, coming from `span` below in four steps."""
    sweep = Sweep(
        omega_range=(2 * np.pi * (hertz - span), 2 * np.pi * hertz),
        low=order,
        high=order,
        samples=samples,
        selection="always_low",
        frequencies=5,
        peak_points=0,
        evaluator="intervals",  # on samples, as the published numbers
    )
    point = list(forced_response(problem, load, sweep))[-1]
    if not point.converged:
        raise RuntimeError(f"{hertz} Hz: {point.status.advice}")
    return point


def frictionless(problem: System) -> System:
    """Return the system without its tangential contact springs."""
    laws = tuple(replace(law, k_t=0.0, k_w=0.0) for law in problem.interface.laws)
    return replace(problem, interface=replace(problem.interface, laws=laws))


def integrated(problem: System, load: HarmonicLoad, omega: float, order: int, stepping: TimeStepping) -> RefinedResult:
    """Integrate to the steady state with two step lengths.

    Order 0 starts from the static equilibrium without tangential forces. Any other order starts from the harmonic balance of that
    order, which shortens the transient and no more where the periodic motion is unique.
    """
    n, n_contacts = problem.structure.n, problem.interface.n_contacts
    if order == 0:
        start = TransientStart(preload(frictionless(problem), load.static), np.zeros(n), np.zeros((n_contacts, 2)))
    else:
        balance = balance_of(problem, load, order, 1024)
        x = solve(balance, omega, bonded(problem, balance, load, omega))
        traction = balance.contacts(x, omega).force[:, :2, 0]
        start = start_from_harmonics(motion(balance, omega, x), omega, traction)
    return integrate_refined(
        problem.structure,
        problem.interface.gap_operator,
        problem.interface.laws,
        load,
        omega,
        problem.outputs,
        start,
        stepping,
    )
