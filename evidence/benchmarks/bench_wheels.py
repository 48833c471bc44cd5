"""Wheels: what the number of sectors costs, a hundred contacts under ten engine orders, one sector against two blades, a mistuned wheel.

CPU seconds of one thread unless said otherwise; rivals take turns in the same run. The sectors are those of `wheel_sector`, whose upper
sides rub on the neighbours' at points of different preload.

    python -m evidence.benchmarks.bench_wheels orders 1 5      # what `orders_record` starts, one process a core
"""

import json
import os
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from evidence.models.mistuned_wheel import mistuned_wheel
from evidence.models.wheel_sector import Rubbing, rubbing_pair, rubbing_wheel
from stickslip.assembly.assembling import assemble
from stickslip.model.modes import normal_modes, with_springs
from stickslip.reduction.aerodynamics import Feedback, InfluenceCoefficients
from stickslip.reduction.waves import excited_wave
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.rotating.flutter import flutter_of_wave
from stickslip.solve.linear import Dense
from stickslip.solve.newton_method import newton

H, SAMPLES, FREQUENCIES, ORDERS = 3, 128, 30, 10
AROUND = 0.93, 1.05  # of the first resonance with all contacts stuck
SECTORS = 36
GIBIBYTE = 2.0**30
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


def first_stuck(rubbing: Rubbing, number: int | None = None) -> float:
    """Return the first natural frequency with all contacts stuck, rad/s; of a wave of a wheel."""
    side = rubbing.system.structure
    structure = side.of_harmonic(1) if number is None else side.waves[number]
    stuck = with_springs(structure, rubbing.system.interface.gap_operator, rubbing.system.springs.stuck_stiffness())
    return float(np.sqrt(normal_modes(stuck, 1).squares[0]))


def swept(rubbing: Rubbing, middle: float, frequencies: int = FREQUENCIES) -> dict[str, Any]:
    """Sweep around a frequency with all harmonics and return CPU seconds, Newton steps and how much slips at most."""
    sweep = Sweep(
        omega_range=(AROUND[0] * middle, AROUND[1] * middle),
        selection="always_high",
        low=H,
        high=H,
        frequencies=frequencies,
        peak_points=0,
        samples=SAMPLES,
    )
    start = process_time()
    points = list(forced_response(rubbing.system, rubbing.load, sweep))
    seconds = process_time() - start
    kept = accepted_points(points)
    return {
        "seconds": seconds,
        "frequencies": len(kept),
        "steps": sum(p.iterations for p in points),
        "converged": all(p.converged for p in kept),
    }


def sectors_record() -> dict[str, Any]:
    """Compare the same sweep on wheels of 24 and of 120 sectors, building and reducing included."""
    wheels: dict[int, list[float]] = {24: [], 120: []}
    told: dict[int, str] = {}
    swept(rubbing_pair(5, 5), 2 * np.pi * 2300.0, 3)  # compiled kernels are there for both
    for _ in range(3):
        for sectors, seconds in wheels.items():
            start = process_time()
            wheel = rubbing_wheel(sectors, 3, H)
            middle = first_stuck(wheel, excited_wave(3, sectors))
            found = swept(wheel, middle)
            seconds.append(process_time() - start)
            told[sectors] = f"{sectors}: {found['steps']} Newton steps, {found['seconds']:.1f} s of {min(seconds):.1f}"
    few, many = (min(seconds) for seconds in wheels.values())
    ratio = many / few
    return _record(
        "wheels/120_over_24_sectors",
        ratio,
        "1.0 ± 0.1",
        f"engine order 3, H = {H}, 100 contacts, {FREQUENCIES} frequencies, waves and reduction included, best of three in turns; {'; '.join(told.values())}",
        abs(ratio - 1.0) <= 0.1,
    )


def orders(first: int, last: int) -> dict[str, Any]:
    """Sweep some engine orders of a wheel of 24 sectors one after the other."""
    start, cpu = perf_counter(), process_time()
    points = steps = 0
    good = True
    for order in range(first, last + 1):
        wheel = rubbing_wheel(24, order, H)
        found = swept(wheel, first_stuck(wheel, excited_wave(order, 24)))
        points, steps, good = (points + found["frequencies"], steps + found["steps"], good and found["converged"])
    return {
        "wall": perf_counter() - start,
        "cpu": process_time() - cpu,
        "points": points,
        "steps": steps,
        "converged": good,
        "gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIBIBYTE,
    }


def orders_record() -> list[dict[str, Any]]:
    """Share ten engine orders between two processes of one thread each."""
    halves = [(1, ORDERS // 2), (ORDERS // 2 + 1, ORDERS)]
    start = perf_counter()
    started = [_start("orders", *map(str, half)) for half in halves]
    found = [_ended(process) for process in started]
    wall = perf_counter() - start
    memory, cpu = (sum(one[key] for one in found) for key in ("gib", "cpu"))
    points, steps = (sum(one[key] for one in found) for key in ("points", "steps"))
    good = all(one["converged"] for one in found)
    note = (
        f"24 sectors, 100 contacts of three directions at one interface, H = {H}, engine orders 1 to {ORDERS}, {points} frequencies, all "
        f"converged: {good}; {steps} Newton steps, {cpu:.0f} CPU s in two processes, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )
    return [
        _record("wheels/ten_orders_seconds", wall, "<= 300 s", note, wall <= 300 and good),
        _record("wheels/ten_orders_gib", memory, "<= 4", "both processes together, interpreter included", memory <= 4),
    ]


def pair_record() -> dict[str, Any]:
    """Compare a frequency of the wheel with one of two blades that have the same interface."""
    wheel, pair = rubbing_wheel(24, 3, H), rubbing_pair()
    middles = first_stuck(wheel, 3), first_stuck(pair)
    best, told = [np.inf, np.inf], ["", ""]
    for _ in range(3):
        for i, (name, rubbing) in enumerate((("wheel", wheel), ("two blades", pair))):
            found = swept(rubbing, middles[i])
            best[i] = min(best[i], found["seconds"] / found["frequencies"])
            told[i] = f"{name} {1e3 * best[i]:.0f} ms with {found['steps']} Newton steps"
    ratio = best[0] / best[1]
    return _record(
        "wheels/frequency_over_two_blades",
        ratio,
        "<= 2",
        f"{FREQUENCIES} frequencies around the first stuck resonance, best of three in turns: {'; '.join(told)}",
        ratio <= 2,
    )


def mistuned_record() -> dict[str, Any]:
    """Compare a frequency of a mistuned wheel as it is solved by default with the same by LU factors of the whole Jacobian.

    Ten of sixty frequencies around the first stuck resonance, where contacts slip; LU solves the second of them from the first.
    """
    found = assemble(mistuned_wheel(SECTORS, newton=2.0), H)
    assert found.frequencies is not None
    first = 2 * np.pi * found.frequencies.stuck_reduced[0]
    spacing = (AROUND[1] - AROUND[0]) * first / 60
    sweep = Sweep(
        omega_range=(first, first + 9 * spacing),
        selection="always_high",
        low=H,
        high=H,
        frequencies=10,
        peak_points=0,
        samples=SAMPLES,
    )
    start = process_time()
    points = list(forced_response(found.system, found.load, sweep))
    each = (process_time() - start) / 10
    kept = accepted_points(points)
    problem = forced_problem(found.system, found.load, sweep)
    dense, by_lu = replace(problem.high, jacobian="dense"), replace(sweep.newton, linear=Dense())
    begin = process_time()
    other = newton(lambda x: dense.linearise(x, kept[1].omega), dense.unknowns(kept[0].coefficients), by_lu)
    seconds = process_time() - begin
    off = float(np.abs(dense.coefficients(other.x) - kept[1].coefficients).max())
    off /= float(np.abs(kept[1].coefficients).max())
    ratio = seconds / each
    return _record(
        "wheels/mistuned_lu_over_default",
        ratio,
        ">= 20",
        f"{SECTORS} sectors of 20 modes and 9 contacts, H = {H}, {dense.size} unknowns; ten of sixty frequencies, all converged: "
        f"{all(p.converged for p in kept)}, {sum(p.iterations for p in points)} Newton steps, start included, {1e3 * each:.0f} ms each; one by LU "
        f"{other.iterations} steps, {seconds:.1f} s, converged: {other.status.converged}, gaps differ by {off:.1e}",
        ratio >= 20 and off <= 1e-6,
    )


def flutter_record() -> dict[str, Any]:
    """Compare the aerodynamic damping by energy with that by eigenvalues for coefficients and half of them."""
    wheel = rubbing_wheel(24, 3, 1, 3, 3)
    structure = wheel.system.structure.of_harmonic(1)
    bare = replace(structure, damping=0.0 * structure.damping)
    modes = normal_modes(bare, 3)
    rng = np.random.default_rng(3)
    square = 1e-4 * modes.squares[0]  # small, so that the next power of the difference does not count
    one = square * (rng.standard_normal((3, 3)) + 1j * rng.standard_normal((3, 3)))

    def difference(strength: float) -> np.ndarray:
        influence = InfluenceCoefficients(np.array([0]), strength * one.reshape(1, 1, 1, 3, 3), np.array([1.0]))
        feedback = Feedback(bare.mass @ modes.shapes, 0.0, influence, float(np.sqrt(modes.squares[0])))
        found = flutter_of_wave(bare, feedback, 3)
        return np.abs(found.by_energy - found.by_eigenvalue)

    whole, half = difference(1.0), difference(0.5)
    ratio = float(np.median(whole / half))
    return _record(
        "wheels/energy_against_eigenvalue",
        ratio,
        "4 ± 0.2",
        f"difference of the damping ratios of three modes over that with halved coefficients: {', '.join(f'{r:.3f}' for r in whole / half)}",
        bool(np.all(np.abs(whole / half - 4) <= 0.4)) and abs(ratio - 4) <= 0.2,
    )


def run() -> list[dict[str, Any]]:
    """Measure all; about six minutes."""
    return [sectors_record(), *orders_record(), pair_record(), mistuned_record(), flutter_record()]


def _record(name: str, value: float, goal: str, note: str, holds: bool) -> dict[str, Any]:
    return {"name": name, "value": value, "goal": goal, "holds": bool(holds), "note": note}


def _start(*words: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "evidence.benchmarks.bench_wheels", *words],
        cwd=Path(__file__).parents[2],
        env={**os.environ, **ONE_THREAD},
        stdout=subprocess.PIPE,
        text=True,
    )


def _ended(process: "subprocess.Popen[str]") -> dict[str, Any]:
    out, _ = process.communicate()
    if process.returncode:
        raise RuntimeError(f"a process of the benchmark ended with {process.returncode}")
    found: dict[str, Any] = json.loads(out.splitlines()[-1])
    return found


if __name__ == "__main__":
    print(json.dumps(orders(int(sys.argv[2]), int(sys.argv[3]))))
