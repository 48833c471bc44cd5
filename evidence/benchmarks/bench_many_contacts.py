"""Many contacts: a Krylov method with factors by harmonic against LU, where they cross, how time grows, a thousand contacts, threads.

CPU times of one process on one thread; what is compared takes turns. The plates of `many_contacts` at H = 5 are in four states: the bonded
vibration under loads that make all contacts stick, some slip, most slip, and many open.
"""

import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numba
import numpy as np
import scipy.sparse.linalg

from evidence.models.many_contacts import Plates, two_plates
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.intervals import contact_period, contact_period_threads, prefix_sums
from stickslip.contact.threads import thread_shares
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.costs import linear_costs, reduced_cost
from stickslip.harmonic.structured import SHARED, StructuredJacobian
from stickslip.harmonic.stuck_contact_elimination import Known
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.solve.krylov import Automatic, Krylov
from stickslip.solve.linear import Dense, LinearSolver, reduced_factors
from stickslip.solve.newton_method import Newton, Solution, newton

ORDER, SAMPLES = 5, 128
OMEGA = 2 * np.pi * 1600.0  # 10 % below the first resonance of the stuck plates
# pull, share of the preload: from the load that makes the state
STATES = {
    "stick": ("slide", 0.003),
    "micro-slip": ("slide", 0.4),
    "gross slip": ("slide", 4.0),
    "lift-off": ("lift", 8.0),
}
NEWTON = ("slide", 0.1)  # Newton finds the solution from the bonded start in a few steps
EXACT, INEXACT = 1e-8, 1e-2  # residual that a step leaves; the second is what Newton asks for
SAME = 1e-6  # relative difference of two answers
THOUSAND = 0.01  # share of the preload: at resonance the corner opens
# contacts and harmonics around the crossover, and far beyond it
CROSSING = ((8, 3), (12, 3), (8, 7), (12, 5), (24, 3), (8, 13), (24, 5), (12, 13), (50, 3), (24, 7), (12, 21))
CROSSING_STATES = {
    "stick": ("slide", 0.003),
    "micro-slip": ("slide", 0.1),
    "slip": ("slide", 0.4),
    "gross slip": ("slide", 2.0),
}
LONG = 1.0  # s, beyond which nothing is measured again
GIGABYTE = 2.0**30
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


def balance_of(
    plates: Plates, pull: str, share: float, order: int = ORDER, omega: float = OMEGA
) -> tuple[HarmonicBalance, np.ndarray]:
    """Return the problem under a load, its Jacobian known by products, and the bonded vibration."""
    system = plates.system
    linear = system.condensed(plates.load(share, pull), order)
    balance = harmonic_balance(linear, system.interface, order, max(SAMPLES, 8 * order), jacobian="structured")
    return balance, bonded_start(balance, omega, system)


def seconds(action: Callable[[], object]) -> float:
    """CPU seconds of one call."""
    start = process_time()
    action()
    return process_time() - start


def lu_step(balance: HarmonicBalance, x: np.ndarray, omega: float = OMEGA) -> np.ndarray | None:
    """One Newton step by the array and its factors."""
    at = replace(balance, jacobian="dense").linearise(x, omega)
    return Dense().solve(at.jac, -at.residual)


def krylov_step(balance: HarmonicBalance, x: np.ndarray, tolerance: float) -> np.ndarray | None:
    """One Newton step with new factors by harmonic."""
    at = balance.linearise(x, OMEGA)
    return Krylov(tolerance=tolerance).solve(at.jac, -at.residual)


def step_record(points: int, goal: float, checked: tuple[str, ...]) -> list[dict[str, Any]]:
    """Compare one Newton step from each state, and the steps within a Newton iteration.

    Parameters
    ----------
    points
        Contacts.
    goal
        How many times faster the Krylov method is to be.
    checked
        States whose LU step is computed; an LU step takes as long in every state.
    """
    plates = two_plates(points)
    exact, inexact, worst, notes, lu = [], [], 0.0, [], []
    for name, load in STATES.items():
        balance, x = balance_of(plates, *load)
        state = balance.contacts(x, OMEGA).state
        krylov_step(balance, x, INEXACT)  # compiled kernels and tables are there for all
        steps = {t: partial(krylov_step, balance, x, t) for t in (EXACT, INEXACT)}
        both = [min(seconds(step) for _ in range(3)) for step in steps.values()]
        if name in checked:
            start = process_time()
            by_lu = lu_step(balance, x)
            lu.append(process_time() - start)
            worst = max(worst, difference(steps[EXACT](), by_lu))
        exact.append(both[0])
        inexact.append(both[1])
        notes.append(
            f"{name} ({np.mean(state == 1):.0%} slip, {np.mean(state == 2):.0%} open): {1e3 * both[0]:.0f} and {1e3 * both[1]:.0f} ms"
        )
    dense = min(lu)
    tail = f"{points} contacts, {balance.size} unknowns, H = {ORDER}; LU {dense:.3g} s a step, assembly included; by state: {'; '.join(notes)}"
    return [
        record(
            f"many/krylov_step_over_lu_{points}",
            dense / max(inexact),
            goal,
            f"slowest state, new factors in every step and the residual of 1e-2 that Newton asks for; {tail}",
            dense / max(inexact) >= goal,
        ),
        record(
            f"many/krylov_exact_step_over_lu_{points}",
            dense / max(exact),
            goal,
            f"the same solved to 1e-8; largest difference from the LU step of {', '.join(checked)}: {worst:.1e}; times before 'and'",
            dense / max(exact) >= goal and worst <= SAME,
        ),
    ]


def newton_record(points: int, goal: float) -> dict[str, Any]:
    """Compare whole Newton iterations from the bonded start to the same tolerance."""
    balance, x = balance_of(two_plates(points), *NEWTON)
    krylov, lu = _solved(balance, x, "structured"), _solved(balance, x, "dense")
    (one, one_seconds), (other, other_seconds) = krylov, lu
    apart = difference(one.x, other.x)
    share = float(np.mean(balance.contacts(one.x, OMEGA).state != 0))
    per_step = (other_seconds / other.iterations) / (one_seconds / one.iterations)
    return record(
        f"many/krylov_newton_over_lu_{points}",
        other_seconds / one_seconds,
        goal,
        f"whole Newton iteration to 1e-10 with {share:.0%} slipping or open: {one.iterations} steps by Krylov, {other.iterations} by LU, "
        f"{per_step:.3g}x a step; answers differ by {apart:.1e}",
        other_seconds / one_seconds >= goal and apart <= SAME and one.status.converged,
    )


def crossover_records() -> list[dict[str, Any]]:
    """Compare what `auto` takes with the better of LU and a Krylov method, over dofs, harmonics and contact states; and the model of costs with times."""
    ratios, spelled, sizes, products, off = [], [], [], [], []
    for points, order in CROSSING:
        plates = two_plates(points)
        for name, load in CROSSING_STATES.items():
            balance, x = balance_of(plates, *load, order)
            times = _in_turns(balance, x)
            best = min(times["dense"], times["structured"])
            ratios.append(times["auto"] / best)
            spelled.append(f"{balance.size} {name} {ratios[-1]:.2f}")
            if name == "micro-slip":
                sizes.append(balance.size)
                products.append(times["dense"] / times["structured"])
                off.append(_costs_off(balance, x))
    by_size = ", ".join(f"{s}: {r:.2f}" for s, r in zip(sizes, products, strict=True))
    median, worst = float(np.median(ratios)), max(ratios)
    named = {what: ", ".join(f"{s}: {o[what]:.2f}" for s, o in zip(sizes, off, strict=True)) for what in off[0]}
    most = max(max(value, 1.0 / value) for o in off for value in o.values())
    return [
        record(
            "krylov/crossover_auto_over_best",
            worst,
            "<= 1.3, median <= 1.1",
            f"time of a whole Newton iteration, jacobian = auto over the better of LU and Krylov, the worst of {len(ratios)}; median {median:.2f}; "
            f"by unknowns and state: {'; '.join(spelled)}; LU over Krylov in micro-slip, by unknowns: {by_size}",
            worst <= 1.3 and median <= 1.1,
        ),
        record(
            "krylov/crossover_model",
            most,
            "<= 2",
            "largest factor between a time and `harmonic.costs`; time over model, by unknowns: "
            + "; ".join(f"{what}: {values}" for what, values in named.items()),
            most <= 2.0,
        ),
    ]


def _in_turns(balance: HarmonicBalance, x: np.ndarray) -> dict[str, float]:
    """CPU seconds of a Newton iteration by each form, the best of a second in turns; an iteration that others end and one does not counts as it is."""
    best, begun = dict.fromkeys(("dense", "structured", "auto"), np.inf), process_time()
    while process_time() - begun < LONG:
        for form in best:
            # rows of its own: nothing is kept from the iteration before
            made = replace(balance, jacobian=form, rows=replace(balance.rows))  # type: ignore[arg-type]
            linear = Krylov() if form == "structured" else Automatic()
            best[form] = min(best[form], _newton(made, x, linear)[1])
    return best


def _costs_off(balance: HarmonicBalance, x: np.ndarray) -> dict[str, float]:
    """Times of a product, new factors, an array and one without what rests over what the model says."""
    at = balance.linearise(x, OMEGA)
    assert isinstance(at.jac, StructuredJacobian)
    jac, krylov = at.jac, Krylov(tolerance=1e-6)
    n, counts = jac.linear.n, jac.coupling.counts
    costs = linear_costs(n, len(counts), jac.blocks.size, shared=n >= SHARED)
    krylov.solve(jac, -at.residual)
    before = krylov.counts.products
    krylov.solve(jac, -at.residual)
    products = krylov.counts.products - before

    def without_resting() -> None:
        own = replace(jac)  # whose contacts are looked at anew
        made = Known(jac.linear).without_resting(own.coupling, jac.rows, jac.scale)
        found = reduced_factors(made)
        assert found is not None
        found(at.residual)

    actions: dict[str, tuple[Callable[[], object], float]] = {
        "product": (lambda: krylov.solve(jac, -at.residual), products * costs.product),
        "factors": (jac.preconditioner, costs.factors),
        "array": (lambda: Dense().solve(jac, -at.residual), costs.array),
        "without what rests": (without_resting, reduced_cost(n, counts, known=False)),
    }
    return {
        name: min(seconds(lambda a=action: [a() for _ in range(10)]) for _ in range(7)) / (10 * expected)  # type: ignore[misc]
        for name, (action, expected) in actions.items()
    }


def growth_records() -> list[dict[str, Any]]:
    """Fit the exponents with which a Newton step's time grows with harmonics and with contacts."""
    plates = two_plates(100)
    orders, counts = (3, 5, 10, 20), (24, 50, 100, 200, 300)
    by_order = [_step_seconds(plates, order) for order in orders]
    by_count = [_step_seconds(two_plates(points), ORDER) for points in counts]
    harmonics = float(np.polyfit(np.log(orders), np.log(by_order), 1)[0])
    contacts = float(np.polyfit(np.log(counts), np.log(by_count), 1)[0])
    spelled = [
        ", ".join(f"{k}: {1e3 * t:.1f} ms" for k, t in zip(keys, times, strict=True))
        for keys, times in ((orders, by_order), (counts, by_count))
    ]
    return [
        record(
            "many/growth_with_harmonics",
            harmonics,
            "< 1.3",
            f"exponent of a Newton step's time at 100 contacts in micro-slip, by H: {spelled[0]}",
            harmonics < 1.3,
        ),
        record(
            "many/growth_with_contacts",
            contacts,
            "< 1.3",
            f"exponent of a Newton step's time at H = {ORDER} in micro-slip, by contacts: {spelled[1]}; factors of full matrices grow with "
            "the cube, so that this one cannot hold for ever",
            contacts < 1.3,
        ),
    ]


def thousand_record() -> dict[str, Any]:
    """Run a forced response with a thousand contacts in a process of its own and read its peak of memory."""
    found = child("bench_many_contacts", "thousand", ONE_THREAD)
    holds = found["gib"] <= 8.0 and found["converged"] == found["points"] and found["rises"]
    return record(
        "many/thousand_contacts_gib",
        found["gib"],
        "<= 8",
        f"peak memory, model included; {found['unknowns']} unknowns, {found['points']} frequencies over a resonance, {found['converged']} "
        f"converged, {found['steps']} Newton steps in {found['seconds']:.0f} s of one core = {found['per_step']:.1f} s a step; "
        f"{found['products']} products, {found['preconditioners']} times new factors; up to {found['open']:.1%} open, {found['slip']:.1%} "
        f"slip; building and reducing the model took {found['build']:.0f} s more",
        bool(holds),
    )


def threads_record() -> dict[str, Any]:
    """Compare the kernel of a thousand contacts on two threads and on one, on the clock."""
    found = child("bench_many_contacts", "threads", {**ONE_THREAD, "NUMBA_NUM_THREADS": "2"})
    ratio = found["one"] / found["two"]
    return record(
        "many/two_threads_over_one",
        ratio,
        ">= 1.7",
        f"clock time of 1000 contacts' forces and derivatives, H = {ORDER}, {SAMPLES} samples: best of {found['rounds']} in turns, "
        f"{1e3 * found['one']:.2f} and {1e3 * found['two']:.2f} ms; with the transforms {found['whole_one'] / found['whole_two']:.2f}x; "
        f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}: it needs a machine with nothing else to do",
        ratio >= 1.7,
    )


def run() -> list[dict[str, Any]]:
    """Measure all; about six minutes."""
    return [
        *step_record(100, 10.0, tuple(STATES)),
        newton_record(100, 10.0),
        *step_record(300, 20.0, ("gross slip",)),
        *crossover_records(),
        *growth_records(),
        threads_record(),
        thousand_record(),
    ]


def _solved(balance: HarmonicBalance, x: np.ndarray, form: str) -> tuple[Solution, float]:
    made = replace(balance, jacobian=form)  # type: ignore[arg-type]
    return _newton(made, x, Automatic())


def _newton(balance: HarmonicBalance, x: np.ndarray, linear: LinearSolver) -> tuple[Solution, float]:
    """Solve from a start; return the solution and CPU seconds."""
    start = process_time()
    solution = newton(lambda v: balance.linearise(v, OMEGA), x, Newton(linear=linear))
    return solution, process_time() - start


def _step_seconds(plates: Plates, order: int) -> float:
    balance, x = balance_of(plates, *STATES["micro-slip"], order)
    step = partial(krylov_step, balance, x, INEXACT)
    step()
    return min(seconds(step) for _ in range(5))


def difference(a: np.ndarray | None, b: np.ndarray | None) -> float:
    if a is None or b is None:
        return float("inf")
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


def record(name: str, value: float, goal: float | str, note: str, holds: bool) -> dict[str, Any]:
    text = goal if isinstance(goal, str) else f">= {goal:g}"
    return {"name": name, "value": value, "goal": text, "holds": bool(holds), "note": note}


# ---- in processes of their own ----------------------------------------------------------------------------------------------------


def child(module: str, what: str, environment: dict[str, str]) -> dict[str, Any]:
    """Run a function of a benchmark in a new process and return what it prints."""
    out = subprocess.run(
        [sys.executable, "-m", f"evidence.benchmarks.{module}", what],
        cwd=Path(__file__).parents[2],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, Any] = json.loads(out.stdout.splitlines()[-1])
    return found


def thousand() -> dict[str, Any]:
    """Forced response of a thousand contacts, stepped through frequencies on both sides of a resonance."""
    start = process_time()
    plates = two_plates(1000)
    build = process_time() - start
    stuck = plates.system.stuck_structure()
    first = np.sqrt(scipy.sparse.linalg.eigsh(stuck.stiffness, 1, stuck.mass, sigma=0.0, return_eigenvectors=False)[0])
    krylov = Krylov()
    sweep = Sweep(
        omega_range=(0.94 * first, 1.04 * first),
        selection="always_high",
        high=ORDER,
        samples=SAMPLES,
        evaluator="intervals",
        frequencies=4,
        peak_points=0,
        newton=Newton(tolerance=1e-8, linear=Automatic(krylov=krylov)),
    )
    start = process_time()
    points = list(forced_response(plates.system, plates.load(THOUSAND), sweep))
    spent = process_time() - start
    steps = sum(p.iterations for p in points)
    balance, _ = balance_of(plates, "lift", THOUSAND)
    states = [balance.contacts(balance.unknowns(p.coefficients), p.omega).state for p in points]
    size = [float(np.max(np.abs(p.coefficients[1]))) for p in points]
    return {
        "gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIGABYTE,
        "unknowns": balance.size,
        "points": len(points),
        "converged": sum(p.converged for p in points),
        "steps": steps,
        "seconds": spent,
        "per_step": spent / max(steps, 1),
        "build": build,
        "products": krylov.counts.products,
        "preconditioners": krylov.counts.preconditioners,
        "rises": 0 < int(np.argmax(size)) < len(size) - 1,
        "slip": max(float(np.mean(s == 1)) for s in states),
        "open": max(float(np.mean(s == 2)) for s in states),
    }


def threads() -> dict[str, Any]:
    """Time the contacts of a period on one and on two threads in turns."""
    contacts = 1000
    laws = two_plates(24).system.interface.laws
    compiled = compile_contacts(tuple(laws[i % 24] for i in range(contacts)))
    m = 2 * ORDER + 1
    coefficients = 1e-7 * np.random.default_rng(0).standard_normal((m, 3 * contacts))
    basis, cos, sin = prefix_sums(ORDER, SAMPLES)
    gap = np.ascontiguousarray((basis @ coefficients).T).reshape(contacts, 3, SAMPLES)
    arrays = (
        gap,
        compiled.elements,
        compiled.first,
        basis,
        cos,
        sin,
        np.empty_like(gap),
        np.empty((contacts, 2, SAMPLES), dtype=np.int64),
        np.empty((contacts, compiled.pairs, m, m)),
    )
    actions: dict[str, tuple[int, Callable[[], object]]] = {
        "one": (1, lambda: contact_period(*arrays)),
        "two": (2, lambda: contact_period_threads(thread_shares(contacts), *arrays)),
        "whole_one": (1, lambda: contact_forces(coefficients, compiled, SAMPLES)),
        "whole_two": (2, lambda: contact_forces(coefficients, compiled, SAMPLES)),
    }
    best = dict.fromkeys(actions, np.inf)
    rounds = 100
    for _ in range(rounds):
        for name, (count, action) in actions.items():
            numba.set_num_threads(count)
            start = perf_counter()
            action()
            best[name] = min(best[name], perf_counter() - start)
    return {**best, "rounds": rounds}


if __name__ == "__main__":
    print(json.dumps({"thousand": thousand, "threads": threads}[sys.argv[1]]()))
