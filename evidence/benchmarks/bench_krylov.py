"""Many contacts to the end: whole Newton solves by Krylov over LU, gross slip through a resonance, and thousands of contacts.

Each part runs alone: ``python -m evidence.benchmarks.bench_krylov newton_100`` (1 min), ``newton_300`` (2 min), ``gross_slip`` (8 min, two
cores), ``two_thousand`` (3 min, two cores). Ratios are of CPU times of one process on one thread; seconds are those of the clock.
"""

import json
import resource
import sys
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter, process_time
from typing import Any

import numpy as np
import scipy.sparse.linalg

from evidence.benchmarks.bench_many_contacts import (
    GIGABYTE,
    OMEGA,
    ORDER,
    SAMPLES,
    balance_of,
    child,
    difference,
    lu_step,
    record,
)
from evidence.models.many_contacts import two_plates
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.solve.krylov import Automatic, Krylov
from stickslip.solve.linear import Dense
from stickslip.solve.newton_method import Newton, Solution, newton

LOW = 2 * np.pi * 200.0  # far below the resonances: lift-off converges from the bonded vibration
LOADS = {
    "stick": ("slide", 0.003),
    "micro-slip": ("slide", 0.4),
    "gross slip": ("slide", 2.0),
    "lift-off": ("lift", 0.2),
}
TOLERANCE, SAME = 1e-8, 1e-6  # residual of a solution; relative difference of two answers
GROSS_SLIP = 0.2  # share of the preload: nearly all contacts slip in the resonance
MICRO_SLIP = 0.4
GROSS = 0.9  # share of contacts that slip at some time of the period
TWO_CORES = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "2"
)


def newton_records(points: int, median: float, worst: float, whole: bool) -> list[dict[str, Any]]:
    """Compare whole Newton solves from the bonded vibration in four states.

    Parameters
    ----------
    points
        Contacts.
    median, worst
        How many times faster the Krylov method is to be, over the states.
    whole
        Whether LU goes all the way; else the time of one of its steps counts for each of those that exact solutions take.
    """
    plates = two_plates(points)
    ratios, notes, same, lu_one = [], [], 0.0, 0.0
    for name, load in LOADS.items():
        balance, x = balance_of(plates, *load, omega=LOW)
        _solved(balance, x, Automatic())  # compiled kernels and tables are there for all
        runs = [_solved(balance, x, Automatic()) for _ in range(3)]
        found, fast = runs[0][0], min(spent for _, spent in runs)
        if whole:
            dense = replace(balance, jacobian="dense")
            other, slow = _solved(dense, x, Dense())
        else:
            other = _solved(balance, x, Automatic(krylov=Krylov(tolerance=1e-10)))[0]
            if lu_one == 0.0:
                start = process_time()
                lu_step(balance, x, LOW)
                lu_one = process_time() - start
            slow = lu_one * other.iterations
        if not (found.status.converged and other.status.converged):
            raise RuntimeError(f"{points} contacts in {name} did not converge")
        same = max(same, difference(found.x, other.x))
        ratios.append(slow / fast)
        state = balance.contacts(found.x, LOW).state
        notes.append(
            f"{name} ({np.mean(state == 1):.0%} slip, {np.mean(state == 2):.0%} open): {slow / fast:.0f}x, {found.iterations} and "
            f"{other.iterations} steps, {fast:.2f} and {slow:.1f} s"
        )
    how = "" if whole else f"; LU: {lu_one:.1f} s a step times the steps that exact solutions take"
    note = f"{points} contacts, H = {ORDER}, from the bonded vibration to {TOLERANCE:g}: {'; '.join(notes)}{how}; answers differ by {same:.1e}"
    return [
        record(f"krylov/newton_over_lu_{points}_median", float(np.median(ratios)), median, note, np.median(ratios) >= median and same <= SAME),
        record(f"krylov/newton_over_lu_{points}_worst", min(ratios), worst, "slowest of the four states", min(ratios) >= worst),
    ]  # fmt: skip


def gross_slip_record() -> dict[str, Any]:
    """A thousand contacts through the resonance with gross slip, in a process of its own."""
    found = child("bench_krylov", "gross_slip_in_here", TWO_CORES)
    holds = found["minutes"] <= 10.0 and found["gib"] <= 4.0 and found["converged"] == found["points"] and found["slipping"] >= GROSS  # fmt: skip
    return record(
        "many/thousand_contacts_gross_slip_minutes",
        found["minutes"],
        "<= 10 and 4 GiB",
        f"clock, two threads, 1000 contacts, H = {ORDER}, {found['points']} frequencies from 0.8 to 1.1 of the first stuck one, {found['converged']} converged; "
        f"{found['slipping']:.0%} of the contacts slip within the period where it is most, {found['opening']:.0%} open; {found['steps']} Newton steps, "
        f"{found['products']} products, {found['preconditioners']} factors; {found['gib']:.1f} GiB with the model, whose building took {found['build']:.0f} s more",
        holds,
    )


def two_thousand_record() -> dict[str, Any]:
    """One Newton step with new factors, two thousand contacts in micro-slip."""
    found = child("bench_krylov", "two_thousand_in_here", TWO_CORES)
    return record(
        "many/two_thousand_contacts_step_seconds",
        found["seconds"],
        "<= 30 and 12 GiB",
        f"clock, two threads, from the bonded vibration with {found['slip']:.0%} slip: evaluation, new factor, {found['products']} products; residual left "
        f"{found['left']:.1e}; {found['unknowns']} unknowns; {found['gib']:.1f} GiB with the model, whose building and reduction took {found['build']:.0f} s more",
        found["seconds"] <= 30.0 and found["gib"] <= 12.0 and found["left"] <= 1e-2,
    )


def run() -> list[dict[str, Any]]:
    """Measure all; about a quarter of an hour."""
    return [
        *newton_records(100, 8.0, 4.0, whole=True),
        *newton_records(300, 25.0, 10.0, whole=False),
        gross_slip_record(),
        two_thousand_record(),
    ]


def _solved(balance: HarmonicBalance, x: np.ndarray, linear: Any) -> tuple[Solution, float]:
    options = Newton(tolerance=TOLERANCE, max_iterations=40, linear=linear)
    start = process_time()
    solution = newton(lambda v: balance.linearise(v, LOW), x, options)
    return solution, process_time() - start


# ---- in processes of their own ----------------------------------------------------------------------------------------------------


def gross_slip_in_here(contacts: int = 1000) -> dict[str, Any]:
    """Forced response through the resonance under a load that makes nearly all contacts slip."""
    start = perf_counter()
    plates = two_plates(contacts)
    build = perf_counter() - start
    stuck = plates.system.stuck_structure()
    first = np.sqrt(
        scipy.sparse.linalg.eigsh(
            stuck.stiffness, 1, stuck.mass, sigma=0.0, return_eigenvectors=False
        )[0]
    )
    del stuck
    krylov = Krylov()
    sweep = Sweep(
        omega_range=(0.8 * first, 1.1 * first), selection="always_high", high=ORDER, samples=SAMPLES,
        evaluator="intervals", frequencies=30, peak_points=0,
        newton=Newton(tolerance=TOLERANCE, linear=Automatic(krylov=krylov)),
    )  # fmt: skip
    start = perf_counter()
    points = list(forced_response(plates.system, plates.load(GROSS_SLIP, "slide"), sweep))
    spent = perf_counter() - start
    balance, _ = balance_of(plates, "slide", GROSS_SLIP, omega=first)
    states = [balance.contacts(balance.unknowns(p.coefficients), p.omega).state for p in points]
    return {
        "minutes": spent / 60.0, "gib": _peak(), "points": len(points), "converged": sum(p.converged for p in points),
        "steps": sum(p.iterations for p in points), "products": krylov.counts.products,
        "preconditioners": krylov.counts.preconditioners, "build": build,
        "slipping": max(float(np.mean((s == 1).any(axis=(1, 2)))) for s in states),
        "opening": max(float(np.mean((s == 2).any(axis=(1, 2)))) for s in states),
    }  # fmt: skip


def two_thousand_in_here(contacts: int = 2000) -> dict[str, Any]:
    """One step in micro-slip."""
    start = perf_counter()
    balance, x = balance_of(two_plates(contacts), "slide", MICRO_SLIP)
    build = perf_counter() - start
    krylov = Krylov()
    start = perf_counter()
    at = balance.linearise(x, OMEGA)
    step = krylov.solve(at.jac, -at.residual)
    spent = perf_counter() - start
    left = np.inf
    if step is not None:
        left = np.linalg.norm(at.jac.matvec(step) + at.residual) / np.linalg.norm(at.residual)
    state = balance.contacts(x, OMEGA).state
    return {
        "seconds": spent, "build": build, "gib": _peak(), "unknowns": balance.size, "products": krylov.counts.products,
        "left": float(left), "slip": float(np.mean(state == 1)),
    }  # fmt: skip


def _peak() -> float:
    """Largest memory of this process so far, GiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIGABYTE


if __name__ == "__main__":
    PARTS: dict[str, Callable[[], Any]] = {
        "newton_100": lambda: newton_records(100, 8.0, 4.0, whole=True),
        "newton_300": lambda: newton_records(300, 25.0, 10.0, whole=False),
        "gross_slip": gross_slip_record,
        "two_thousand": two_thousand_record,
        "gross_slip_in_here": gross_slip_in_here,
        "two_thousand_in_here": two_thousand_in_here,
    }
    print(json.dumps(PARTS[sys.argv[1]]()))
