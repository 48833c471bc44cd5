"""Folds, Neimark-Sacker bifurcations and period doublings located on branches, against shooting with SciPy, which shares no code.

The absorber is the nonlinear tuned vibration absorber on a Duffing oscillator of G. Habib, T. Detroux, R. Viguié and G. Kerschen (arXiv
1604.03868), mass ratio 5 %, by their rule for its stiffness, damping and cubic coefficient. The bifurcations that they print were not at
hand: the reference is the flow of the equations by SciPy's DOP853 with its derivative, whose multipliers are 1 in modulus there.
"""

from collections.abc import Callable

import numpy as np
import scipy.integrate
import scipy.optimize

import stickslip as ss
from evidence.validation.compare import Record, record
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.response.bifurcations import Bifurcation, bifurcations

SOURCE = "shooting with SciPy, DOP853"
MASS_RATIO, FORCE = 0.05, 0.11
NEAR = 2e-4  # relative distance within which the root is looked for
SMALLEST = 2e-6  # relative error that shooting is good to


def absorber() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return masses, damping and stiffness matrices, and the cubic coefficients of ground and absorber."""
    e = MASS_RATIO
    root = np.sqrt(4 + 3 * e)
    k = 8 * e * (16 + 23 * e + 9 * e**2 + 2 * (2 + e) * root) / (3 * (1 + e) ** 2 * (64 + 80 * e + 27 * e**2))  # fmt: skip
    c = 0.5 * np.sqrt(k * e * (8 + 9 * e - 4 * root) / (1 + e))
    mass = np.array([1.0, e])
    damping = np.array([[0.002 + c, -c], [-c, c]])
    stiffness = np.array([[1.0 + k, -k], [-k, k]])
    return mass, damping, stiffness, np.array([1.0, 2 * e**2 / (1 + 4 * e)])


def located() -> tuple[Bifurcation, ...]:
    """Return the bifurcations of the absorber's response."""
    mass, damping, stiffness, cubic = absorber()
    structure = ss.model.lumped(mass, stiffness, damping=damping, names=("primary", "absorber"))
    gaps = np.zeros((6, 2))
    gaps[0], gaps[3] = (1.0, 0.0), (1.0, -1.0)
    springs = tuple(ss.CubicSpring(cubic_t=float(value)) for value in cubic)
    system = ss.System(structure, ss.Interface(("ground", "absorber"), springs, gaps), structure.sets["primary"])  # fmt: skip
    load = ss.HarmonicLoad(np.zeros(2), {1: np.array([FORCE, 0.0j])})
    sweep = ss.Sweep(omega_range=(0.9, 1.4), low=7, high=7, selection="always_high", points=30)
    problem = ss.response.forced_problem(system, load, sweep)
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    return bifurcations(problem, points).found


def flow(omega: float, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the state of the absorber's equations after a period and its derivative."""
    mass, damping, stiffness, cubic = absorber()

    def rate(t: float, y: FloatArray) -> FloatArray:
        x, v, apart = y[:2], y[2:4], y[0] - y[1]
        force = np.array([cubic[0] * x[0] ** 3 + cubic[1] * apart**3, -cubic[1] * apart**3])
        load = np.array([FORCE * np.cos(omega * t), 0.0])
        slope = 3 * cubic[1] * apart**2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
        slope[0, 0] += 3 * cubic[0] * x[0] ** 2
        matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-(stiffness + slope) / mass[:, None], -damping / mass[:, None]]])  # fmt: skip
        motion = np.append(v, (load - damping @ v - stiffness @ x - force) / mass)
        return np.append(motion, matrix @ y[4:].reshape(4, 4))

    y = np.append(state, np.eye(4))
    end = scipy.integrate.solve_ivp(rate, (0.0, 2 * np.pi / omega), y, "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]  # fmt: skip
    return end[:4], end[4:].reshape(4, 4)


def state_of(coefficients: ComplexArray, omega: float) -> FloatArray:
    """Return displacements and velocities at t = 0."""
    h = np.arange(len(coefficients))[:, None]
    return np.concatenate([coefficients.real.sum(axis=0), (1j * h * omega * coefficients).real.sum(axis=0)])  # fmt: skip


def shot(omega: float, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the periodic motion near a state, by Newton's method, and its monodromy."""
    for _ in range(20):
        after, matrix = flow(omega, state)
        change = np.linalg.solve(matrix - np.eye(4), state - after)
        state = state + change
        if np.abs(change).max() < 1e-10:
            break
    return state, matrix


def torus(found: Bifurcation) -> float:
    """Return the frequency near a Neimark-Sacker bifurcation at which the pair of multipliers has the modulus 1."""
    state = state_of(found.point.coefficients, found.omega)

    def above(omega: float) -> float:
        values = np.linalg.eigvals(shot(omega, state)[1])
        return float(np.abs(values[np.argmax(np.abs(values.imag))]) - 1.0)

    ends = (1 - NEAR) * found.omega, (1 + NEAR) * found.omega
    return float(scipy.optimize.brentq(above, *ends, xtol=1e-9))


def fold(found: Bifurcation) -> float:
    """Return the frequency of a periodic motion with a multiplier 1."""

    def residual(y: FloatArray) -> FloatArray:
        after, matrix = flow(float(y[4]), y[:4])
        return np.append(after - y[:4], np.linalg.det(matrix - np.eye(4)))

    start = np.append(state_of(found.point.coefficients, found.omega), found.omega)
    return float(scipy.optimize.fsolve(residual, start, xtol=1e-12)[4])


def run() -> list[Record]:
    """Compare the frequency of each bifurcation, within the error that is told of it."""
    case = f"absorber on a Duffing oscillator, {FORCE} N"
    judges: dict[str, Callable[[Bifurcation], float]] = {"Neimark-Sacker": torus, "fold": fold}
    records = []
    for one in located():
        told = max(one.omega_error / one.omega, SMALLEST)
        name = f"{one.kind} near {one.omega:.4f}, frequency in rad/s"
        records.append(record(case, name, one.omega, judges[one.kind](one), told, SOURCE))
    return records
