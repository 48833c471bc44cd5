"""Lumped models of the literature and of other solvers' examples, and how they are solved here."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.dofs import Dofs
from stickslip.model.structure import Structure
from stickslip.response.equilibrium import bonded_start, preload
from stickslip.response.forced.response import ForcedPoint, Sweep, forced_response
from stickslip.response.system import System
from stickslip.response.time.transient import (
    RefinedResult,
    TimeStepping,
    TransientStart,
    integrate_refined,
    start_from_harmonics,
)
from stickslip.solve.newton_method import Newton, newton

COS30, SIN30 = np.cos(np.pi / 6), 0.5


def lumped(mass: FloatArray, damping: FloatArray, stiffness: FloatArray) -> Structure:
    """Return a structure of point masses, each with one coordinate."""
    n = len(mass)
    dofs = Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3)))
    return Structure(np.asarray(mass), np.asarray(damping), np.asarray(stiffness), dofs)


def system(structure: Structure, laws: Sequence[ContactLaw], gap: FloatArray) -> System:
    """Return a system whose every dof is an output."""
    names = tuple(f"contact{i + 1}" for i in range(len(laws)))
    return System(structure, Interface(names, tuple(laws), gap), np.arange(structure.n))


def jenkins(stiffness: float, limit: float) -> ElasticCoulomb:
    """Return a Jenkins element along t: a spring in series with a slider of constant limit."""
    return ElasticCoulomb(k_t=stiffness, k_w=0.0, k_n=0.0, mu=1.0, preload=limit)


def unilateral(stiffness: float, clearance: float) -> ElasticCoulomb:
    """Return a frictionless spring that acts beyond a clearance."""
    return ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=stiffness, mu=0.0, preload=-stiffness * clearance)


# ---- B3: one blade with a friction damper -----------------------------------------------------------------------------

B3_LOAD = HarmonicLoad(np.zeros(1), {1: np.array([0.1 + 0j])})


def blade_with_damper(limit: float) -> System:
    """B3: unit mass and spring, dashpot 0.02, friction damper of spring 0.5 and `limit`."""
    gap = np.zeros((3, 1))
    gap[0, 0] = 1.0
    return system(lumped(np.eye(1), 0.02 * np.eye(1), np.eye(1)), [jenkins(0.5, limit)], gap)


# ---- B6: blade, damper, blade -----------------------------------------------------------------------------------------

Y2 = 3  # dof of which the tables speak


def _spring(matrix: FloatArray, a: int, b: int, k: float) -> None:
    matrix[[a, b], [a, b]] += k
    matrix[[a, b], [b, a]] -= k


def blade_damper_blade(start: tuple[float, float] = (0.0, 0.0)) -> System:
    """B6: two planar blades and a wedge between them, dofs x1 y1 x2 y2 xD yD.

    `start` holds the tangential forces of the two contacts just before t = 0, as shares of their limits.
    """
    stiffness = np.diag([3e5, 3e5, 3e5, 3e5, 0.0, 0.0])
    for a, b, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
        _spring(stiffness, a, b, k)
    gap = np.zeros((6, 6))
    for contact, (blade, turn) in enumerate(((0, SIN30), (2, -SIN30))):
        local = np.array([[COS30, turn], [-turn, COS30]])
        # the source counts the normal displacement positive when pressed, we count the gap positive when open
        rows = np.array([[1.0], [-1.0]]) * local
        gap[[3 * contact, 3 * contact + 2], 4:] = rows
        gap[[3 * contact, 3 * contact + 2], blade : blade + 2] = -rows
    laws = [ElasticCoulomb(k_t=3e5, k_w=0.0, k_n=3e5, mu=0.5, residual_traction=m) for m in start]
    mass, damping = np.diag([1.0, 1, 1, 1, 0.1, 0.1]), np.diag([20.0, 20, 20, 20, 0, 0])
    dofs = Dofs(
        np.array([1, 1, 2, 2, 3, 3]),
        ("x", "y") * 3,
        np.zeros((6, 3)),
        ("blades",) * 4 + ("damper",) * 2,
    )
    interface = Interface(("1", "2"), tuple(laws), gap)
    structure = Structure(mass, damping, stiffness, dofs)
    return System(structure, interface, np.array([3, 0, 1, 2]), free=np.array([4, 5]))


def b6_load(factor: float = 1.0) -> HarmonicLoad:
    """B6: 120 N on the damper and factor (0, -20, 5, 0, 0, 0) sin(Wt) on the blades."""
    static = np.array([0, 0, 0, 0, 0, 120.0])
    return HarmonicLoad(static, {1: -1j * factor * np.array([0, -20.0, 5, 0, 0, 0])})


# ---- chain ------------------------------------------------------------------------------------------------------------


def chain_stiffness(n: int, k: float) -> FloatArray:
    """Return the stiffness of `n` masses in a row, the first one grounded and the last one free."""
    matrix = k * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    matrix[-1, -1] = k
    return matrix


def small_chain() -> System:
    """Twenty masses, Jenkins elements from the first six to ground; the output is the free end."""
    stiffness = chain_stiffness(20, 1e4)
    gap = np.zeros((18, 20))
    gap[3 * np.arange(6), np.arange(6)] = 1.0
    structure = lumped(np.eye(20), 2e-3 * stiffness, stiffness)
    made = system(structure, [jenkins(2e3, 10.0)] * 6, gap)
    return replace(made, outputs=np.array([19]))


def force_at(n: int, dof: int, size: float) -> HarmonicLoad:
    """Return a load ``size cos(ωt)`` on one of `n` dofs."""
    force = np.zeros(n, dtype=complex)
    force[dof] = size
    return HarmonicLoad(np.zeros(n), {1: force})


# ---- solving ----------------------------------------------------------------------------------------------------------


def balance_of(problem: System, load: HarmonicLoad, order: int, samples: int) -> HarmonicBalance:
    """Set up the harmonic balance of a system under a load."""
    linear = condense(problem.structure, problem.retained, load)
    return harmonic_balance(linear, problem.interface, order, samples)


def bonded(
    problem: System, balance: HarmonicBalance, load: HarmonicLoad, omega: float
) -> FloatArray:
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
    problem: System,
    load: HarmonicLoad,
    hertz: float,
    order: int,
    samples: int = 256,
    span: float = 0.5,
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


def integrated(
    problem: System, load: HarmonicLoad, omega: float, order: int, stepping: TimeStepping
) -> RefinedResult:
    """Integrate to the steady state with two step lengths.

    Order 0 starts from the static equilibrium without tangential forces. Any other order starts from the harmonic balance of that
    order, which shortens the transient and no more where the periodic motion is unique.
    """
    n, n_contacts = problem.structure.n, problem.interface.n_contacts
    if order == 0:
        start = TransientStart(
            preload(frictionless(problem), load.static), np.zeros(n), np.zeros((n_contacts, 2))
        )
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
