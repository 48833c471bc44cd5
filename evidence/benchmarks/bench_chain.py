"""The grounded chain with 6 and with 60 Jenkins elements: CPU time per converged point against pyHarm-os, equal answers.

pyHarm runs in an environment of its own (`make bench-rival`), because it brings a notebook server and pins versions. It is timed near
its defaults (`hybr` of SciPy along the arc length), with tightened tolerances, and with its own Newton-Raphson, which is faster on the
large chain. Both programs keep harmonics 0..5 with 256 samples and take steps of about the same length over the same range. Neither the
set-up of the system nor compilation is timed; both take turns, so that a load on the machine meets both.
"""

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from evidence.benchmarks.bench_newton import medians
from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import chain
from stickslip.response.forced.response import ForcedPoint, Sweep, forced_problem, forced_response
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton, newton

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
OWN_ENVIRONMENT = ROOT / ".venv-rival" / "bin" / "python"
ABSENT = "not measured: install stickslip[bench], or run `make bench-rival`"
REPEATS = 120  # over the number of elements: runs of which the fastest counts
EQUAL = 1e-6  # of the largest coefficient of the point
PARTS = 101  # rounds in which the parts of a point are timed
STEP = 0.2  # rad/s between points
LOAD_SHARES = (0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)  # of a load that is ramped up
HYBRID = {
    "solver": "scipyroot",
    "solver_options": {"residual_tolerance": 1e-8, "root": {"method": "hybr", "options": {"xtol": 1e-10}}},
}
NEWTON_RAPHSON = {"solver": "NewtonRaphson", "solver_options": {"tol_residual": 1e-9, "max_iter": 30}}


@dataclass(frozen=True, kw_only=True)
class Chain:
    """A chain of masses, the first elements of which rub against ground."""

    masses: int
    mass: float
    stiffness: float
    elements: int
    k_t: float
    limit: float
    omega_range: tuple[float, float]
    points: int
    damping_factor: float = 2e-3
    force: float = 12.0
    order: int = 5
    samples: int = 256
    rival_runs: int = 1  # of which the fastest counts, as it does for ours

    def system(self) -> System:
        """Return the chain; its output is the free end."""
        structure = chain(self.masses, self.mass, self.stiffness, self.damping_factor)
        element = Jenkins(k_t=self.k_t, limit=self.limit)
        gap = np.zeros((3 * self.elements, self.masses))
        gap[3 * np.arange(self.elements), np.arange(self.elements)] = 1.0
        names = tuple(f"element{i}" for i in range(self.elements))
        interface = Interface(names, (element,) * self.elements, gap)
        return System(structure, interface, np.array([self.masses - 1]))

    def load(self) -> HarmonicLoad:
        """Return the force on the free end."""
        force = np.zeros(self.masses, dtype=complex)
        force[-1] = self.force
        return HarmonicLoad(np.zeros(self.masses), {1: force})

    def sweep(self) -> Sweep:
        """Return a sweep over the range with five harmonics everywhere."""
        return Sweep(
            omega_range=self.omega_range,
            low=self.order,
            high=self.order,
            samples=self.samples,
            evaluator="intervals",  # on the samples, as pyHarm does
            selection="always_high",
            frequencies=self.points,
            peak_points=0,
        )


CASES = {
    "small": (
        Chain(
            masses=20,
            mass=1.0,
            stiffness=1e4,
            elements=6,
            k_t=2e3,
            limit=10.0,
            omega_range=(6.0, 12.0),
            points=32,
            rival_runs=3,
        ),
        80.0,
    ),
    "big": (
        Chain(
            masses=100, mass=0.2, stiffness=5e4, elements=60, k_t=200.0, limit=1.0, omega_range=(8.0, 14.0), points=32
        ),
        90.0,
    ),
}


@dataclass(frozen=True, eq=False)
class Rival:
    """What pyHarm found."""

    seconds: float  # a converged point
    omega: FloatArray
    unknowns: FloatArray  # (points, masses (2 order + 1)), harmonic-major
    note: str


def rival_python() -> str | None:
    """Return the interpreter that has pyHarm; None if there is none."""
    if importlib.util.find_spec("pyHarm"):
        return sys.executable
    return str(OWN_ENVIRONMENT) if OWN_ENVIRONMENT.exists() else None


def rival(python: str, case: Chain, method: dict[str, Any]) -> Rival:
    """Solve the chain with pyHarm in a process of its own."""
    options = {"step": STEP, "corrector": "arc_length", "reductor": "noreductor", **method}
    with tempfile.TemporaryDirectory() as folder:  # pyHarm leaves a folder where it runs
        run = subprocess.run(
            [python, str(HERE / "rival_pyharm.py"), json.dumps(asdict(case) | {"options": options})],
            capture_output=True,
            text=True,
            check=True,
            cwd=folder,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
    found = json.loads(run.stdout.splitlines()[-1])
    per_point = found["seconds"] / len(found["omega"])
    note = (
        f"pyHarm {found['version']} {method['solver']}: {1e3 * per_point:.0f} ms a point, {len(found['omega'])} of {found['tried']} "
        f"points converged, {found['jacobians']} Jacobians, residual below {found['residual']:.0e}"
    )
    return Rival(per_point, np.array(found["omega"]), np.array(found["unknowns"]), note)


def timed(case: Chain) -> tuple[float, list[ForcedPoint]]:
    """Return the CPU seconds of a converged point of our forced response, fastest of some runs, and the points.

    The set-up of the problem, which the generator does on its way, is measured beside it and taken off: pyHarm's is not timed either. What is
    taken off is the fastest set-up: the difference of one run is small, or negative, where a disturbance met its set-up alone.
    """
    system, load, sweep = case.system(), case.load(), case.sweep()
    seconds = []
    for _ in range(1 + max(REPEATS // case.elements, 2)):  # the first one compiles
        began = process_time()
        forced_problem(system, load, sweep)
        set_up = process_time()
        points = list(forced_response(system, load, sweep))
        seconds.append((set_up - began, process_time() - set_up))
    set_up, whole = np.min(seconds[1:], axis=0)
    return float(whole - set_up) / sum(p.converged for p in points), points


def split(case: Chain, points: list[ForcedPoint], seconds: float) -> str:
    """Return how the time of a point splits: what its evaluations, linear systems and one condensation take at the point in the middle."""
    balance = forced_problem(case.system(), case.load(), case.sweep()).high
    point = points[len(points) // 2]
    x, omega = balance.unknowns(point.coefficients), point.omega
    at = balance.linearise(x, omega)
    linear = case.sweep().newton.linear
    array = isinstance(at.jac, np.ndarray)

    def solve() -> None:  # an array is overwritten
        linear.solve(at.jac.copy(order="K") if isinstance(at.jac, np.ndarray) else at.jac, at.residual)

    contacts, residual, jacobian, slope, factors, condensed = medians(
        [
            lambda: balance.forces(x, omega),
            lambda: balance.linearise(x, omega),
            lambda: balance.linearise(x, omega).jac,
            lambda: balance.linearise(x, omega).jac_p,
            solve,
            lambda: balance.linear.condensed(omega, case.order),
        ],
        PARTS,
    )
    # a Jacobian and a linear system each Newton step, a residual more a point; the last factors of an array give the tangent
    steps = sum(p.iterations for p in points) / len(points)
    equations = (1.0 + steps) * (residual - contacts) + steps * (jacobian - residual)
    parts = {
        "contacts": (1.0 + steps) * contacts,
        "equations": equations + slope - residual,
        "linear systems": (steps if array else 1.0 + steps) * factors,
        "condensation": condensed,
    }
    parts["steps and the rest"] = seconds - sum(parts.values())
    return ", ".join(f"{name} {1e6 * t:.0f} us" for name, t in parts.items())


def difference(case: Chain, other: Rival) -> float:
    """Return the largest difference of a coefficient from pyHarm's at its own frequencies, over the largest of the point.

    Every dof and harmonic is compared. Our solutions start from each other, never from pyHarm's.
    """
    balance = forced_problem(case.system(), case.load(), case.sweep()).high
    x = np.zeros(balance.size)
    worst = 0.0
    for i in np.argsort(other.omega):
        omega = float(other.omega[i])
        x = _solved(balance, omega, x)
        ours = balance.linear.recover(omega, balance.coefficients(x))
        theirs = other.unknowns[i].reshape(2 * case.order + 1, case.masses)
        expected = np.vstack([theirs[:1].astype(complex), theirs[1::2] - 1j * theirs[2::2]])
        worst = max(worst, float(np.max(np.abs(ours - expected)) / np.max(np.abs(expected))))
    return worst


def _solved(balance: HarmonicBalance, omega: float, x: FloatArray) -> FloatArray:
    """Solve from a neighbouring solution; from zero, with the load ramped up, if that fails."""
    options = Newton(tolerance=1e-12, max_iterations=60)
    solution = newton(lambda v: balance.linearise(v, omega), x, options)
    if solution.status.converged:
        return solution.x
    load = balance.linear.load
    x = np.zeros(balance.size)
    for share in LOAD_SHARES:
        ramped = HarmonicLoad(load.static, {h: share * f for h, f in load.harmonics.items()})
        eased = replace(balance, linear=balance.linear.with_load(ramped))
        solution = newton(lambda v, b=eased: b.linearise(v, omega), x, options)
        x = solution.x
    if not solution.status.converged:
        raise RuntimeError(f"omega = {omega}: {solution.status.advice}")
    return solution.x


def compared(name: str, case: Chain, goal: float, python: str) -> list[dict[str, Any]]:
    """Time the chain with both programs and compare their answers."""
    ours, points = timed(case)
    others = {}
    for key, method in (("", HYBRID), ("_newton", NEWTON_RAPHSON)):
        others[key] = rival(python, case, method)
        ours = min(ours, timed(case)[0])
    failed = sum(not p.converged for p in points)
    note = (
        f"{case.elements} elements, H = {case.order}, {case.samples} samples; stickslip {1e3 * ours:.2f} ms a point, {len(points)} points, "
        f"{failed} without a solution, {sum(p.iterations for p in points)} Newton steps: {split(case, points, ours)}"
    )
    records = [
        {
            "name": f"chain/{name}_pyharm{key}_over_stickslip",
            "value": other.seconds / ours,
            # the goal speaks of pyHarm near its defaults; the faster way is there to be seen
            "goal": f">= {goal:g}" if not key else "none",
            "holds": bool(key or other.seconds / ours >= goal) and not failed,
            "note": f"CPU time of a converged point; {note}; {other.note}",
        }
        for key, other in others.items()
    ]
    off = max(difference(case, other) for other in others.values())
    equal = {
        "name": f"chain/{name}_difference_from_pyharm",
        "value": off,
        "goal": f"<= {EQUAL:g}",
        "holds": off <= EQUAL,
        "note": "largest difference of any coefficient at pyHarm's frequencies, over the largest of the point; every dof and harmonic",
    }
    return [*records, equal]


def run() -> list[dict[str, Any]]:
    """Compare both chains."""
    python = rival_python()
    records: list[dict[str, Any]] = []
    for name, (case, goal) in CASES.items():
        if python is None:
            records.append(
                {
                    "name": f"chain/{name}_pyharm_over_stickslip",
                    "value": "not measured",
                    "goal": f">= {goal:g}",
                    "holds": False,
                    "note": ABSENT,
                }
            )
            continue
        records += compared(name, case, goal, python)
    return records
