"""A new frequency of the condensed stiffness: sums over modes or state-space poles against solving the interior at each harmonic.

The other side is the plain Schur complement with its derivative, in the structure's own coordinates. The decomposition is paid once; the
note says after how many frequencies it is paid back.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from time import process_time
from typing import Any

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.dynamic_stiffness import CondensedStiffness, condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.model.structure import Structure

RETAINED = 33  # as the two blades and their damper
HARMONICS = 5
OMEGA = 200.0  # rad/s, among the lowest interior frequencies
GOAL = 100.0
AGREEMENT = 1e-9
STRIDE = 37  # dofs that a second spring spans: not a mere chain


@dataclass(frozen=True, eq=False)
class Case:
    """A structure, what is retained of it, and its load."""

    structure: Structure
    retained: IntArray
    load: HarmonicLoad


def random_structure(interior: int, proportional: bool) -> Case:
    """Return a chain with springs across, of unequal masses and springs; damping by its stiffness, or with unequal dashpots as well."""
    rng = np.random.default_rng(0)
    n = interior + RETAINED
    springs = 1e6 * np.exp(rng.standard_normal(n))
    stiffness = np.diag(springs + np.append(springs[1:], 1e5))
    stiffness -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
    near, far = np.arange(n - STRIDE), np.arange(STRIDE, n)
    for rows, columns, value in ((near, near, 2e5), (far, far, 2e5), (near, far, -2e5), (far, near, -2e5)):
        stiffness[rows, columns] += value
    damping = 1e-5 * stiffness
    if not proportional:
        damping += np.diag(rng.uniform(0.0, 20.0, n))
    mass = np.diag(np.exp(0.3 * rng.standard_normal(n)))
    load = HarmonicLoad(rng.standard_normal(n), {1: rng.standard_normal(n) + 0j})
    retained = np.sort(rng.choice(n, RETAINED, replace=False))
    return Case(lumped(mass, stiffness, damping), retained, load)


def schur(case: Case, omega: float, harmonic: int) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
    """Return Z, F and their ω-derivatives of one harmonic by one factorisation of the interior."""
    structure, kept = case.structure, case.retained
    inner = np.setdiff1d(np.arange(structure.n), kept)
    p = 1j * harmonic * omega

    def block(rows: IntArray, columns: IntArray) -> tuple[ComplexArray, ComplexArray]:
        parts: list[FloatArray] = [
            np.asarray(a)[np.ix_(rows, columns)] for a in (structure.stiffness, structure.damping, structure.mass)
        ]
        k, c, m = parts
        return k + p * c + p * p * m, c + 2.0 * p * m

    (d_nn, s_nn), (d_nl, s_nl), (d_ll, s_ll) = block(kept, kept), block(kept, inner), block(inner, inner)
    f = case.load.coefficients(HARMONICS)[harmonic]
    moved = np.linalg.solve(d_ll, np.column_stack([d_nl.T, f[inner]]))
    x, load = moved[:, :-1], moved[:, -1]
    turned = x.T @ s_ll - s_nl
    slope = s_nn - x.T @ s_nl.T + turned @ x
    by_omega = 1j * harmonic
    return (d_nn - d_nl @ x, f[kept] - d_nl @ load, by_omega * slope, by_omega * (turned @ load))


def timed(action: Callable[[], object], times: int = 1) -> float:
    """Return the CPU time of an action, the mean of some `times`: one alone may be too short for the clock."""
    start = process_time()
    for _ in range(times):
        action()
    return (process_time() - start) / times


def check(linear: CondensedStiffness, case: Case, omega: float) -> None:
    """Raise if the two ways differ."""
    found = linear.condensed(omega, HARMONICS)
    direct = [schur(case, omega, h) for h in range(HARMONICS + 1)]
    for k, name in enumerate(("stiffness", "load", "derivative", "load_derivative")):
        theirs = np.array([row[k] for row in direct])
        if np.max(np.abs(getattr(found, name) - theirs)) > AGREEMENT * np.max(np.abs(theirs)):
            raise RuntimeError(f"condensed {name} differs from the Schur complement")


def measured(interior: int, proportional: bool, rounds: int) -> dict[str, Any]:
    """Return the record of one structure."""
    case = random_structure(interior, proportional)
    start = process_time()
    linear = condense(case.structure, case.retained, case.load)
    linear.condensed(OMEGA, HARMONICS)
    once = process_time() - start
    check(linear, case, OMEGA)
    slow, fast = [], []
    for omega in OMEGA * (1.0 + 0.01 * np.arange(1, rounds + 1)):
        factorise, add_up = partial(schur, case, omega), partial(linear.condensed, omega, HARMONICS)
        slow.append(sum(timed(partial(factorise, h)) for h in range(HARMONICS + 1)))
        fast += [timed(add_up, 10) for _ in range(3)]
    ratio = float(np.median(slow) / np.median(fast))
    kind = "modes, proportional damping" if proportional else "state-space poles, any damping"
    return {
        "name": f"condensation/{'modes' if proportional else 'poles'}_{interior}",
        "value": ratio,
        "goal": f">= {GOAL:g}",
        "holds": ratio >= GOAL,
        "note": (
            f"factorisation over sum of {kind}, per new frequency with harmonics 0..{HARMONICS} and derivatives, {interior} interior and "
            f"{RETAINED} retained dofs, equal to {AGREEMENT:g}; {1e3 * np.median(slow):.0f} ms and {1e3 * np.median(fast):.2f} ms; set up in "
            f"{once:.2g} s, as {once / np.median(slow):.1f} frequencies"
        ),
    }


def run() -> list[dict[str, Any]]:
    """Measure both sums, interleaved with the factorisation, in one process on one thread."""
    return [
        measured(500, proportional=True, rounds=5),
        measured(500, proportional=False, rounds=5),
        measured(2000, proportional=True, rounds=1),
    ]
