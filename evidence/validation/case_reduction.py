"""A chain held by a spring at its kept end, reduced: the full model in closed form, errors, rates and their estimate.

The n masses of the chain move as ``sin(iθ)`` with ``ω² = 2 (k/m)(1 - cos θ)``; the last one gives an equation for θ. The modes that
Craig-Bampton leaves out contribute the tail of a sum over 1/d⁴, those of MacNeal-Rubin of 1/d⁶.
"""

from collections.abc import Callable

import numpy as np
from scipy import linalg, optimize

from evidence.validation.compare import Record, bound, record
from stickslip.model.matrices import chain
from stickslip.model.modes import with_springs
from stickslip.model.structure import Structure
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.free_interface import rubin
from stickslip.reduction.truncation import frequency_errors

CASE = "reduced chain"
N, MASS, STIFFNESS, SPRING = 300, 1.0 / 300, 300.0, 2.0  # a bar of unit length, mass and stiffness
MODE = 1  # the second frequency
CLOSED = "closed form"
COUNTS = {"Craig-Bampton": (16, 32), "MacNeal-Rubin": (6, 12)}
RATES = {"Craig-Bampton": -3.0, "MacNeal-Rubin": -5.0}


def exact_square() -> float:
    """Return the square of the second circular frequency."""

    def balance(theta: float) -> float:
        """Forces on the last mass."""
        square = 2 * STIFFNESS / MASS * (1 - np.cos(theta))
        own = (STIFFNESS + SPRING - MASS * square) * np.sin(N * theta)
        return float(own - STIFFNESS * np.sin((N - 1) * theta))

    grid = np.linspace(1e-4, 10.0 / N, 2000)
    values = np.array([balance(theta) for theta in grid])
    first = np.flatnonzero(values[:-1] * values[1:] < 0)[MODE]
    theta = optimize.brentq(balance, grid[first], grid[first + 1], xtol=1e-15)
    return float(2 * STIFFNESS / MASS * (1 - np.cos(theta)))


def held(structure: Structure, at: int) -> Structure:
    """Return the structure with the spring between a coordinate and the ground."""
    operator = np.zeros((1, structure.n))
    operator[0, at] = 1.0
    return with_springs(structure, operator, np.array([SPRING]))


def square(structure: Structure) -> float:
    """Return the square of its second circular frequency."""
    return float(linalg.eigvalsh(structure.stiffness, structure.mass)[MODE])


def run() -> list[Record]:
    """Compare errors and rates of both reductions, and the estimated errors."""
    bar = chain(N, mass=MASS, stiffness=STIFFNESS)
    exact = exact_square()
    full = square(held(bar, N - 1))
    records = [record(CASE, "second squared frequency, 300 masses", full, exact, 1e-10, CLOSED)]
    reductions: dict[str, Callable[..., Structure]] = {"Craig-Bampton": craig_bampton, "MacNeal-Rubin": rubin}
    for name, reduction in reductions.items():
        few, many = COUNTS[name]
        errors = [square(held(reduction(bar, np.array([N - 1]), count), 0)) / exact - 1 for count in (few, many)]
        slope = np.log(errors[1] / errors[0]) / np.log(many / few)
        records += [
            bound(CASE, f"{name}, {many} modes: relative error", errors[1], 1e-5, CLOSED),
            record(CASE, f"{name}: rate from {few} to {many} modes", slope, RATES[name], 0.05, CLOSED),
        ]
        reduced = held(reduction(bar, np.array([N - 1]), few), 0)
        stuck = held(bar, N - 1)
        limit = 1.01 * np.sqrt(exact) / (2 * np.pi)
        estimate = frequency_errors(stuck, reduced, float(limit)).relative[MODE]
        true = np.sqrt(1 + errors[0]) - 1
        quantity = f"{name}, {few} modes: estimated over true error of the frequency"
        records.append(record(CASE, quantity, estimate / true, 1.0, 0.01, CLOSED))
    return records
