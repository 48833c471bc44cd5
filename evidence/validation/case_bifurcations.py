"""Folds, Neimark-Sacker bifurcations and lost symmetry located on branches, against shooting with SciPy, which shares no code.

The absorber is the nonlinear tuned vibration absorber on a Duffing oscillator of G. Habib, T. Detroux, R. Viguié and G. Kerschen (arXiv
1604.03868), mass ratio 5 %, by their rule for its stiffness, damping and cubic coefficient. The bifurcations that they print were not at
hand: the reference is the flow of the equations by SciPy's DOP853 with its derivative, whose multipliers are 1 in modulus there. The oscillator with two wells, x'' + 0.3 x' - x +
x^3 = g cos 1.2 t, is the textbook's way to chaos (D. W. Jordan and P. Smith, Nonlinear Ordinary Differential Equations): period 1 at g =
0.20, 2 at 0.28, 4 at 0.29.
"""

from collections.abc import Callable

import numpy as np
import scipy.integrate
import scipy.optimize

import stickslip as ss
from evidence.validation.compare import Record, record
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.bifurcations import Bifurcation, bifurcations, side_branches

SOURCE = "shooting with SciPy, DOP853"
MASS_RATIO, FORCE = 0.05, 0.11
NEAR = 2e-4  # relative distance within which the root is looked for
SECTORS, COUPLING, DRIVE = 4, 0.03, 0.008
CLOSE = 1e-5  # of states, with the harmonics 1, 3 and 5
WELL_OMEGA, SETTLED = 1.2, 400  # rad/s; periods
SMALLEST = 2e-6  # relative error that shooting is good to


def absorber() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return masses, damping and stiffness matrices, and the cubic coefficients of ground and absorber."""
    e = MASS_RATIO
    root = np.sqrt(4 + 3 * e)
    k = 8 * e * (16 + 23 * e + 9 * e**2 + 2 * (2 + e) * root) / (3 * (1 + e) ** 2 * (64 + 80 * e + 27 * e**2))
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
    system = ss.System(structure, ss.Interface(("ground", "absorber"), springs, gaps), structure.sets["primary"])
    load = ss.HarmonicLoad(np.zeros(2), {1: np.array([FORCE, 0.0j])})
    sweep = ss.Sweep(omega_range=(0.9, 1.4), low=7, high=7, selection="always_high", points=30)
    problem = ss.response.forced_problem(system, load, sweep)
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    return bifurcations(problem, points).found


Equations = tuple[FloatArray, FloatArray, FloatArray, Callable[[FloatArray], tuple[FloatArray, FloatArray]], FloatArray]


def absorber_equations() -> Equations:
    """Return masses, damping, stiffness, the cubic forces with their derivative, and the load."""
    mass, damping, stiffness, cubic = absorber()

    def force(x: FloatArray) -> tuple[FloatArray, FloatArray]:
        apart = x[0] - x[1]
        slope = 3 * cubic[1] * apart**2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
        slope[0, 0] += 3 * cubic[0] * x[0] ** 2
        return np.array([cubic[0] * x[0] ** 3 + cubic[1] * apart**3, -cubic[1] * apart**3]), slope

    return mass, damping, stiffness, force, np.array([FORCE, 0.0])


def ring_equations() -> Equations:
    """Return the same of four masses in a ring with cubic springs to the ground, neighbours driven against each other."""
    turn = np.roll(np.eye(SECTORS), 1, axis=0)
    stiffness = np.eye(SECTORS) + COUPLING * (2 * np.eye(SECTORS) - turn - turn.T)
    load = DRIVE * (-1.0) ** np.arange(SECTORS)
    return np.ones(SECTORS), 0.02 * np.eye(SECTORS), stiffness, lambda x: (x**3, np.diag(3 * x**2)), load


def flow(equations: Equations, omega: float, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the state after a period and its derivative."""
    mass, damping, stiffness, force, load = equations
    n = mass.size

    def rate(t: float, y: FloatArray) -> FloatArray:
        x, v = y[:n], y[n : 2 * n]
        own, slope = force(x)
        matrix = np.block(
            [[np.zeros((n, n)), np.eye(n)], [-(stiffness + slope) / mass[:, None], -damping / mass[:, None]]]
        )
        motion = np.append(v, (load * np.cos(omega * t) - damping @ v - stiffness @ x - own) / mass)
        return np.append(motion, matrix @ y[2 * n :].reshape(2 * n, 2 * n))

    y = np.append(state, np.eye(2 * n))
    end = scipy.integrate.solve_ivp(rate, (0.0, 2 * np.pi / omega), y, "DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    return end[: 2 * n], end[2 * n :].reshape(2 * n, 2 * n)


def state_of(coefficients: ComplexArray, omega: float) -> FloatArray:
    """Return displacements and velocities at t = 0."""
    h = np.arange(len(coefficients))[:, None]
    return np.concatenate([coefficients.real.sum(axis=0), (1j * h * omega * coefficients).real.sum(axis=0)])


def shot(equations: Equations, omega: float, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the periodic motion near a state, by Newton's method, and its monodromy."""
    for _ in range(20):
        after, matrix = flow(equations, omega, state)
        change = np.linalg.solve(matrix - np.eye(state.size), state - after)
        state = state + change
        if np.abs(change).max() < 1e-9:
            break
    return state, matrix


def crossing(equations: Equations, omega: float, state: FloatArray) -> float:
    """Return the frequency near a given one at which the largest multiplier has the modulus 1."""

    def above(omega: float) -> float:
        return float(np.abs(np.linalg.eigvals(shot(equations, omega, state)[1])).max() - 1.0)

    return float(scipy.optimize.brentq(above, (1 - NEAR) * omega, (1 + NEAR) * omega, xtol=1e-8))


def fold(equations: Equations, omega: float, state: FloatArray) -> float:
    """Return the frequency of a periodic motion with a multiplier 1."""

    def residual(y: FloatArray) -> FloatArray:
        after, matrix = flow(equations, float(y[-1]), y[:-1])
        return np.append(after - y[:-1], np.linalg.det(matrix - np.eye(len(matrix))))

    return float(scipy.optimize.fsolve(residual, np.append(state, omega), xtol=1e-12)[-1])


def ring() -> tuple[ss.response.ForcedProblem, Bifurcation]:
    """Return the response of that ring as a tuned wheel, and where it loses its symmetry first."""

    def of_wave(k: int) -> ss.Structure:
        stiffness = 1.0 + 2 * COUPLING * (1 - np.cos(2 * np.pi * k / SECTORS))
        return ss.model.lumped(np.ones(1), np.array([[stiffness]]), np.array([[0.02]]), ("mass",))

    wheel = TunedWheel({k: of_wave(k) for k in range(SECTORS)}, SECTORS, SECTORS // 2, 12)
    gaps = np.array([[1.0], [0.0], [0.0]])
    springs = ss.Interface(("ground",), (ss.CubicSpring(cubic_t=1.0),), gaps)
    system = ss.System(wheel, springs, np.array([0]))
    load = ss.HarmonicLoad(np.zeros(1), {1: np.array([DRIVE + 0j])})
    odd = [1, 3, 5]
    sweep = ss.Sweep(omega_range=(1.0, 1.06), low=odd, high=odd, selection="always_high", points=8)
    problem = ss.response.forced_problem(system, load, sweep)
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    found = bifurcations(problem, points).found
    return problem, next(b for b in found if b.kind == "branch point")


def of_ring() -> list[Record]:
    """Compare where the ring loses its symmetry, and a motion of the branch on which one sector takes most of the vibration."""
    case = f"ring of {SECTORS} cubic masses, {DRIVE} N"
    equations = ring_equations()
    problem, lost = ring()
    against = (-1.0) ** np.arange(SECTORS)
    alike = lost.point.coefficients * against[None, :] ** np.arange(len(lost.point.coefficients))[:, None]
    root = crossing(equations, lost.omega, state_of(alike, lost.omega))
    records = [
        record(
            case,
            "symmetry lost, frequency in rad/s",
            lost.omega,
            root,
            max(lost.omega_error / lost.omega, SMALLEST),
            SOURCE,
        )
    ]
    for branch in side_branches(problem, lost, points=30):
        point = max(branch.points, key=branch.localisation)
        start = state_of(point.coefficients, point.omega)
        state, _ = shot(equations, point.omega, start)
        share = f"{100 * branch.localisation(point):.0f} % in one sector"
        off = float(np.abs(state - start).max() / np.abs(state).max())
        records.append(
            record(case, f"state at t = 0 of a localised motion, {share}, relative", 1.0 + off, 1.0, CLOSE, SOURCE)
        )
    return records


def doublings(force: float) -> list[float]:
    """Return the frequencies of the load at which the motion in one well doubles its period, and then again."""
    structure = ss.model.lumped(np.ones(1), np.ones((1, 1)), np.array([[0.3]]), ("mass",))
    well = ss.PolynomialSpring(along_t=(1.0, 3.0, 1.0))  # with the structure's spring: -x + x^3 about x = 1
    spring = ss.Interface(("well",), (well,), np.array([[1.0], [0.0], [0.0]]))
    system = ss.System(structure, spring, np.array([0]))
    load = ss.HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})
    sweep = ss.Sweep(omega_range=(1.1, 1.5), low=8, high=8, selection="always_high", points=12, direction="down")
    problem = ss.response.forced_problem(system, load, sweep)
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    found: list[float] = []
    for once in bifurcations(problem, points).found:
        (branch,) = side_branches(problem, once)
        again = bifurcations(branch.problem, branch.points).found
        found += [once.omega, *(branch.periods * b.omega for b in again)]
    return found


def periods_in_time(force: float) -> int:
    """Return after how many periods of the load the motion in a well repeats itself, by integration."""

    def rate(t: float, y: FloatArray) -> FloatArray:
        x, v = y
        return np.array([v, force * np.cos(WELL_OMEGA * t) - 0.3 * v + x - x**3])

    at = 2 * np.pi / WELL_OMEGA * np.arange(SETTLED + 17)
    course = scipy.integrate.solve_ivp(rate, (0.0, at[-1]), [1.0, 0.0], "DOP853", rtol=1e-9, atol=1e-11, t_eval=at).y[
        0, SETTLED:
    ]
    return next(p for p in (1, 2, 4, 8, 0) if p == 0 or np.abs(course[p:] - course[:-p]).max() < 1e-4)


def of_wells() -> list[Record]:
    """Compare after how many periods a motion in one well repeats itself."""
    case = f"oscillator with two wells, {WELL_OMEGA} rad/s"
    records = []
    for force, printed in ((0.20, 1), (0.28, 2), (0.29, 4)):
        passed = sum(omega > WELL_OMEGA for omega in doublings(force))
        for reference, source in ((printed, "Jordan and Smith"), (periods_in_time(force), "SciPy")):
            name = f"periods at {force} N, by the doublings located"
            records.append(record(case, name, 2.0**passed, reference, 0.0, source))
    return records


def run() -> list[Record]:
    """Compare the frequency of each bifurcation, within the error that is told of it; and localised motions of a ring."""
    case = f"absorber on a Duffing oscillator, {FORCE} N"
    equations = absorber_equations()
    judges = {"Neimark-Sacker": crossing, "fold": fold}
    records = []
    for one in located():
        told = max(one.omega_error / one.omega, SMALLEST)
        name = f"{one.kind} near {one.omega:.4f}, frequency in rad/s"
        state = state_of(one.point.coefficients, one.omega)
        root = judges[one.kind](equations, one.omega, state)
        records.append(record(case, name, one.omega, root, told, SOURCE))
    return records + of_ring() + of_wells()
