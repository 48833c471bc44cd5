"""Contacts that rest, stuck or open all period: what a sweep gains as the arrays leave out what they do not couple.

The plates of `many_contacts` through ten frequencies below the first stuck one, and along the same range by arc length. All is done twice in one
process, in turns: as the package does it, and with the elimination said to cost more than the whole array, so that it is never chosen and the better
of LU and a Krylov method remains. LU of the whole array is one step of it, measured at the last frequency, times the steps.
"""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from time import process_time
from typing import Any
from unittest import mock

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from evidence.models.many_contacts import Plates, two_plates
from stickslip.arrays import FloatArray
from stickslip.harmonic import structured
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.stuck_contact_elimination import coupling
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.solve.krylov import Automatic, Krylov
from stickslip.solve.linear import Dense
from stickslip.solve.newton_method import Newton, newton

# load over the preload, by contacts and how many of them rest: all, nine tenths, half, few
STATES = {
    24: {"stick": 0.02, "micro-slip": 0.09, "slip": 0.18, "gross slip": 0.4},
    50: {"stick": 0.02, "micro-slip": 0.06, "slip": 0.13, "gross slip": 0.4},
    100: {"stick": 0.02, "micro-slip": 0.065, "slip": 0.12, "gross slip": 0.4},
}
ORDER = 5
RANGE, FREQUENCIES = (0.6, 0.9), 10  # of the first stuck frequency
TOLERANCE = 1e-10  # of the residual
ROUNDS = 3
LONG = 20.0  # s, beyond which nothing is measured again
FEW = 50  # contacts up to which most at rest are to be a gain
GAIN, LOSS = 1.5, 0.9  # goals: a gain, and no loss beyond what repeated runs differ by


@dataclass(frozen=True, eq=False)
class Swept:
    """Unknowns at each frequency, the work, and CPU seconds."""

    found: list[FloatArray]
    balance: HarmonicBalance
    steps: int
    products: int
    seconds: float


def whole_arrays() -> Any:
    """Return a context in which nothing is left out of an array."""
    return mock.patch.object(structured, "reduced_cost", return_value=np.inf)


def swept(plates: Plates, load: HarmonicLoad, omegas: FloatArray) -> Swept:
    """Go through the frequencies, each from the one before it."""
    krylov, steps, found = Krylov(), 0, []
    options = Newton(tolerance=TOLERANCE, max_iterations=60, linear=Automatic(krylov=krylov))
    start = process_time()
    system = plates.system
    condensed = condense(system.structure, system.retained, load)
    balance = harmonic_balance(condensed, system.interface, ORDER, 16 * ORDER)
    x = bonded_start(balance, omegas[0], system)
    for omega in omegas:
        solution = newton(lambda v, w=omega: balance.linearise(v, w), x, options)  # type: ignore[misc]
        assert solution.status.converged, (omega, solution.status)
        x = solution.x
        steps += solution.iterations
        found.append(x)
    return Swept(found, balance, steps, krylov.counts.products, process_time() - start)


def lu_seconds(run: Swept, omega: float) -> float:
    """Return the CPU seconds of one Newton step by the whole array at the last frequency."""
    whole, x, each = replace(run.balance, jacobian="dense"), run.found[-1], []
    for _ in range(2):
        start = process_time()
        at = whole.linearise(x, omega)
        Dense().solve(at.jac, at.residual)
        each.append(process_time() - start)
    return min(each)


def first_stuck(plates: Plates) -> float:
    """Return the lowest natural frequency of the plates with all contacts stuck, rad/s."""
    bonded = plates.system.stuck_structure()
    return float(
        np.sqrt(
            scipy.sparse.linalg.eigsh(
                scipy.sparse.csc_array(bonded.stiffness),
                1,
                scipy.sparse.csc_array(bonded.mass),
                sigma=0.0,
                return_eigenvectors=False,
            )[0]
        )
    )


def sweep_record(points: int, state: str) -> dict[str, Any]:
    """Compare the sweep with all unknowns in the arrays and without those that rest."""
    plates = two_plates(points)
    omegas = np.linspace(*RANGE, FREQUENCIES) * first_stuck(plates)
    load = plates.load(STATES[points][state], "slide")
    both = _in_turns(lambda: swept(plates, load, omegas))
    whole, less = (min(runs, key=lambda s: s.seconds) for runs in both)
    apart = max(float(np.abs(a - b).max() / np.abs(a).max()) for a, b in zip(whole.found, less.found, strict=True))
    resting, left = _at_rest(less, omegas)
    by_lu = less.steps * lu_seconds(less, float(omegas[-1]))
    note = (
        f"{resting:.0%} of the contacts rest, {left:.0%} of {less.balance.size} unknowns are left; all: {_told(whole)}; without: {_told(less)}; "
        f"LU of whole arrays {by_lu:.2f} s = {by_lu / less.seconds:.1f} times as long; answers differ by {apart:.1e}"
    )
    return _record(f"many/resting_{points}_{state}", whole.seconds / less.seconds, points, state, note)


def _at_rest(run: Swept, omegas: FloatArray) -> tuple[float, float]:
    """Return the share of contacts that couple nothing, and of unknowns that are left, means over the frequencies."""
    balance, still, left = run.balance, [], []
    for x, omega in zip(run.found, omegas, strict=True):
        found = coupling(balance.forces(x, omega).blocks, balance.rows, balance.linear.n)
        still.append(np.mean(~found.coupled.any(axis=(1, 2))))
        left.append((2 * found.counts.sum() - found.counts[0]) / balance.size)
    return float(np.mean(still)), float(np.mean(left))


def response_record(points: int, state: str) -> dict[str, Any]:
    """Compare the forced response as the package follows it by arc length, from the load on."""
    plates = two_plates(points)
    first = first_stuck(plates)
    load = plates.load(STATES[points][state], "slide")
    sweep = Sweep(
        omega_range=(RANGE[0] * first, RANGE[1] * first),
        selection="always_high",
        high=ORDER,
        samples=16 * ORDER,
        evaluator="intervals",
        peak_points=0,
        newton=Newton(tolerance=TOLERANCE, linear=Automatic()),
    )

    def followed() -> tuple[int, float]:
        start = process_time()
        points = list(forced_response(plates.system, load, sweep))
        assert all(p.converged for p in points)
        return len(points), process_time() - start

    whole, less = (min(runs, key=lambda r: r[1]) for runs in _in_turns(followed))
    note = f"forced_response by arc length: {whole[0]} points in {whole[1]:.3f} s with all, {less[0]} in {less[1]:.3f} s without what rests"
    return _record(f"many/resting_{points}_{state}_arc_length", whole[1] / less[1], points, state, note)


def _in_turns(action: Any) -> tuple[list[Any], list[Any]]:
    """Return what an action gives with whole arrays and without what rests, in turns; what comes first compiles what is not compiled yet."""
    action()
    whole, less, begun = [], [], process_time()
    for _ in range(ROUNDS):
        for runs, how in ((whole, whole_arrays()), (less, nullcontext())):
            with how:
                runs.append(action())
        if process_time() - begun > LONG:
            break
    return whole, less


def _told(s: Swept) -> str:
    return f"{s.steps} steps, {s.products} products, {s.seconds:.3f} s"


def _record(name: str, ratio: float, points: int, state: str, note: str) -> dict[str, Any]:
    goal = GAIN if points <= FEW and state in ("stick", "micro-slip") else LOSS
    return {"name": name.replace(" ", "_"), "value": ratio, "goal": f">= {goal}", "holds": ratio >= goal, "note": note}


def run() -> list[dict[str, Any]]:
    """Measure all; two minutes of CPU time."""
    out = []
    for points, states in STATES.items():
        out += [sweep_record(points, state) for state in states]
        out.append(response_record(points, "micro-slip"))
    return out
