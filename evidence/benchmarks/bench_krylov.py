"""Many contacts to the end: whole Newton solves by Krylov over LU, gross slip through a resonance, and thousands of contacts without reduction.

Each part runs alone: ``python -m evidence.benchmarks.bench_krylov newton_100`` (1 min), ``newton_300`` (2 min), ``gross_slip`` (8 min, two
cores), ``unreduced_slip``, ``both_300``, ``both_1000``, ``two_thousand``, ``five_thousand``. Ratios are of CPU times of one process on one thread; seconds are those of the clock.
"""

import json
import resource
import sys
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter, process_time
from typing import Any

import numpy as np

from evidence.benchmarks.bench_many_contacts import (
    GIGABYTE,
    INEXACT,
    OMEGA,
    ONE_THREAD,
    ORDER,
    SAMPLES,
    balance_of,
    child,
    difference,
    lu_step,
    record,
)
from evidence.models.many_contacts import Plates, two_plates, unreduced_plates
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.model.modes import normal_modes
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
TWO_CORES = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "2")

# SuperLU's calls are small: a second thread of the BLAS waits for the first one
CONTACTS_ON_TWO = {**ONE_THREAD, "NUMBA_NUM_THREADS": "2"}


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
        record(
            f"krylov/newton_over_lu_{points}_median",
            float(np.median(ratios)),
            median,
            note,
            np.median(ratios) >= median and same <= SAME,
        ),
        record(
            f"krylov/newton_over_lu_{points}_worst",
            min(ratios),
            worst,
            "slowest of the four states",
            min(ratios) >= worst,
        ),
    ]


def gross_slip_record(*, unreduced: bool) -> dict[str, Any]:
    """A thousand contacts through the resonance with gross slip, in a process of its own; unreduced, the time of the model counts."""
    what = "unreduced_slip_in_here" if unreduced else "gross_slip_in_here"
    found = child("bench_krylov", what, CONTACTS_ON_TWO if unreduced else TWO_CORES)
    minutes = found["minutes"] + (found["build"] / 60.0 if unreduced else 0.0)
    model = (
        f"in it {found['build']:.0f} s for the model"
        if unreduced
        else f"the model and its reduction took {found['build']:.0f} s more"
    )
    holds = (
        minutes <= 10.0 and found["gib"] <= 4.0 and found["converged"] == found["points"] and found["slipping"] >= GROSS
    )
    return record(
        "many/thousand_contacts_unreduced_minutes" if unreduced else "many/thousand_contacts_gross_slip_minutes",
        minutes,
        "<= 10 and 4 GiB",
        f"clock, two threads, 1000 contacts, H = {ORDER}, {found['points']} frequencies from 0.8 to 1.1 of the first stuck one, {found['converged']} converged; "
        f"{found['cpu']:.0f} s of CPU; {found['slipping']:.0%} of the contacts slip within the period where it is most, {found['opening']:.0%} open; {found['steps']} Newton steps, "
        f"{found['products']} products, {found['preconditioners']} factors; {found['gib']:.1f} GiB with the model; {model}",
        holds,
    )


def step_record(contacts: str, seconds: float, gib: float) -> dict[str, Any]:
    """One Newton step with new factors in micro-slip, nothing reduced; `contacts` in words."""
    found = child("bench_krylov", f"{contacts}_in_here", CONTACTS_ON_TWO)
    return record(
        f"many/{contacts}_contacts_step_seconds",
        found["seconds"],
        f"<= {seconds:.0f} and {gib:.0f} GiB",
        f"clock, two threads, {found['points']} contacts, H = {ORDER}, nothing reduced, from the bonded vibration with {found['slip']:.0%} slip: evaluation, "
        f"new factor, {found['products']} products, {found['cpu']:.0f} s of CPU; residual left {found['left']:.1e}; {found['unknowns']} unknowns; "
        f"{found['gib']:.1f} GiB with the model, whose assembly and bonded vibration took {found['build']:.0f} s more; at {LOW / (2 * np.pi):.0f} Hz from the bonded vibration to a residual of {found['residual']:.0e} in "
        f"{found['steps']} steps, {found['all_products']} products and {found['factors']} factors, {found['whole']:.0f} s ({found['whole_cpu']:.0f} s of CPU), "
        f"{found['whole_gib']:.1f} GiB",
        found["seconds"] <= seconds
        and found["whole_gib"] <= gib
        and found["left"] <= INEXACT
        and found["residual"] <= TOLERANCE,
    )


def unreduced_record(contacts: int) -> dict[str, Any]:
    """The same step with and without reduction, in one process."""
    found = child("bench_krylov", f"both_{contacts}_in_here", ONE_THREAD)
    sparse, dense = found["unreduced"], found["reduced"]
    return record(
        f"krylov/unreduced_over_reduced_{contacts}",
        sparse["cpu"] / dense["cpu"],
        "both steps end",
        f"one Newton step in micro-slip, new factors, CPU: {sparse['cpu']:.2f} s and {sparse['products']} products without reduction "
        f"({sparse['unknowns']} unknowns), {dense['cpu']:.2f} s and {dense['products']} products with it ({dense['unknowns']}); with the factor kept "
        f"{sparse['kept']:.2f} and {dense['kept']:.2f} s; assembly with bonded vibration, and reduction, {sparse['build']:.1f} and {dense['build']:.1f} s; "
        f"amplitudes of the corner after the step differ by {found['difference']:.1e}, by the modes that the reduction leaves out",
        sparse["left"] <= INEXACT and dense["left"] <= INEXACT,
    )


def run() -> list[dict[str, Any]]:
    """Measure all; about a quarter of an hour."""
    return [
        *newton_records(100, 8.0, 4.0, whole=True),
        *newton_records(300, 25.0, 10.0, whole=False),
        gross_slip_record(unreduced=False),
        gross_slip_record(unreduced=True),
        unreduced_record(300),
        unreduced_record(1000),
        step_record("two_thousand", 30.0, 12.0),
        step_record("five_thousand", 120.0, 16.0),
    ]


def _solved(balance: HarmonicBalance, x: np.ndarray, linear: Any) -> tuple[Solution, float]:
    options = Newton(tolerance=TOLERANCE, max_iterations=40, linear=linear)
    start = process_time()
    solution = newton(lambda v: balance.linearise(v, LOW), x, options)
    return solution, process_time() - start


# ---- in processes of their own ----------------------------------------------------------------------------------------------------


def gross_slip_in_here(contacts: int = 1000, made: Callable[[int], Plates] = two_plates) -> dict[str, Any]:
    """Forced response through the resonance under a load that makes nearly all contacts slip."""
    start = perf_counter()
    plates = made(contacts)
    build = perf_counter() - start
    first = np.sqrt(normal_modes(plates.system.stuck_structure(), 1).squares[0])
    krylov = Krylov()
    sweep = Sweep(
        omega_range=(0.8 * first, 1.1 * first),
        selection="always_high",
        high=ORDER,
        samples=SAMPLES,
        evaluator="intervals",
        frequencies=30,
        peak_points=0,
        newton=Newton(tolerance=TOLERANCE, linear=Automatic(krylov=krylov)),
    )
    start, cpu = perf_counter(), process_time()
    points = list(forced_response(plates.system, plates.load(GROSS_SLIP, "slide"), sweep))
    spent, cpu = perf_counter() - start, process_time() - cpu
    balance, _ = balance_of(plates, "slide", GROSS_SLIP, omega=first)
    states = [balance.contacts(balance.unknowns(p.coefficients), p.omega).state for p in points]
    return {
        "minutes": spent / 60.0,
        "cpu": cpu,
        "gib": _peak(),
        "points": len(points),
        "converged": sum(p.converged for p in points),
        "steps": sum(p.iterations for p in points),
        "products": krylov.counts.products,
        "preconditioners": krylov.counts.preconditioners,
        "build": build,
        "slipping": max(float(np.mean((s == 1).any(axis=(1, 2)))) for s in states),
        "opening": max(float(np.mean((s == 2).any(axis=(1, 2)))) for s in states),
    }


def step_in_here(contacts: int, made: Callable[[int], Plates]) -> tuple[dict[str, Any], float]:
    """One step in micro-slip, again with its factor, and the amplitude of the corner after it, m."""
    start = perf_counter()
    plates = made(contacts)
    balance, x = balance_of(plates, "slide", MICRO_SLIP)
    build = perf_counter() - start
    krylov = Krylov()
    start, cpu = perf_counter(), process_time()
    at = balance.linearise(x, OMEGA)
    step = krylov.solve(at.jac, -at.residual)
    spent, cpu = perf_counter() - start, process_time() - cpu
    if step is None:
        raise RuntimeError(f"no step with {contacts} contacts")
    products, again = krylov.counts.products, process_time()
    krylov.solve(at.jac, -at.residual)
    left = np.linalg.norm(at.jac.matvec(step) + at.residual) / np.linalg.norm(at.residual)
    state = balance.contacts(x, OMEGA).state
    corner = balance.linear.recover(OMEGA, balance.coefficients(x + step))[1, plates.system.outputs]
    found = {
        "points": contacts,
        "seconds": spent,
        "cpu": cpu,
        "kept": process_time() - again,
        "build": build,
        "gib": _peak(),
        "unknowns": balance.size,
        "products": products,
        "left": float(left),
        "slip": float(np.mean(state == 1)),
    }
    return found, float(np.linalg.norm(corner))


def unreduced_in_here(contacts: int) -> dict[str, Any]:
    """The step without reduction, and the whole solve from the same start; a small one first compiles the kernels."""
    step_in_here(24, unreduced_plates)
    start = perf_counter()
    plates = unreduced_plates(contacts)
    build = perf_counter() - start
    found, _ = step_in_here(contacts, lambda _: plates)
    balance, x = balance_of(plates, "slide", MICRO_SLIP, omega=LOW)
    krylov = Krylov()
    options = Newton(tolerance=TOLERANCE, max_iterations=40, linear=Automatic(krylov=krylov))
    start, cpu = perf_counter(), process_time()
    solution = newton(lambda v: balance.linearise(v, LOW), x, options)
    return found | {
        "build": build + found["build"],
        "whole": perf_counter() - start,
        "whole_cpu": process_time() - cpu,
        "steps": solution.iterations,
        "residual": solution.residual_norm,
        "all_products": krylov.counts.products,
        "factors": krylov.counts.preconditioners,
        "whole_gib": _peak(),
    }


def both_in_here(contacts: int) -> dict[str, Any]:
    """The same step without and with reduction; a small one first compiles the kernels."""
    step_in_here(24, unreduced_plates)
    sparse, one = step_in_here(contacts, unreduced_plates)
    dense, other = step_in_here(contacts, two_plates)
    return {"unreduced": sparse, "reduced": dense, "difference": abs(one - other) / other}


def _peak() -> float:
    """Largest memory of this process so far, GiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIGABYTE


if __name__ == "__main__":
    PARTS: dict[str, Callable[[], Any]] = {
        "newton_100": lambda: newton_records(100, 8.0, 4.0, whole=True),
        "newton_300": lambda: newton_records(300, 25.0, 10.0, whole=False),
        "gross_slip": lambda: gross_slip_record(unreduced=False),
        "unreduced_slip": lambda: gross_slip_record(unreduced=True),
        "both_300": lambda: unreduced_record(300),
        "both_1000": lambda: unreduced_record(1000),
        "two_thousand": lambda: step_record("two_thousand", 30.0, 12.0),
        "five_thousand": lambda: step_record("five_thousand", 120.0, 16.0),
        "gross_slip_in_here": gross_slip_in_here,
        "unreduced_slip_in_here": lambda: gross_slip_in_here(made=unreduced_plates),
        "both_300_in_here": lambda: both_in_here(300),
        "both_1000_in_here": lambda: both_in_here(1000),
        "two_thousand_in_here": lambda: unreduced_in_here(2000),
        "five_thousand_in_here": lambda: unreduced_in_here(5000),
    }
    print(json.dumps(PARTS[sys.argv[1]]()))
