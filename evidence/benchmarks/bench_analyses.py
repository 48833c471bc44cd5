"""Analyses by products against arrays, at 540, 1080 and 2739 unknowns, and what keeping preconditioners along a branch saves.

CPU seconds of one process on one thread; the three ways of a row take turns in one run: as it is by default, with no preconditioner kept
from one linear system to the next, and with arrays. The plates of `many_contacts`, and the wheel of `wheel_sector`, have 12 contacts
(H = 7), 24 (H = 7) or 11 (33 coordinates, H = 41). One analysis alone: ``python -m evidence.benchmarks.bench_analyses peak 24 7``.
"""

import json
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import lru_cache
from time import process_time
from typing import Any
from unittest.mock import patch
from weakref import WeakKeyDictionary

import numpy as np
import scipy.sparse.linalg

from evidence.benchmarks.bench_wheels import first_stuck
from evidence.models.many_contacts import Plates, two_plates
from evidence.models.wheel_sector import Rubbing, rubbing_wheel
from stickslip.contact.interface import Interface
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response import track_peak
from stickslip.response.forced.response import accepted_points, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.nonlinear_modes.backbone import ModeSweep, nonlinear_mode
from stickslip.response.parameter import Discretisation, branch_in_parameter
from stickslip.response.rigid import rigid_response
from stickslip.response.self_excited.curve import at_amplitude, slip_amplitude
from stickslip.response.self_excited.cycles import solve_cycle
from stickslip.response.self_excited.modes import StuckMode, stuck_modes
from stickslip.response.self_excited.problem import self_excited_motions
from stickslip.response.system import System
from stickslip.solve.krylov import Automatic, Krylov
from stickslip.solve.newton_method import Newton

SIZES = ((12, 7), (24, 7), (11, 41))  # contacts and harmonics: 540, 1080 and 2739 unknowns
GRIDS = {12: (4, 3), 24: (6, 4), 11: (11, 1)}  # contacts of a sector each way
SAME = 1e-6  # relative difference of two answers ...
VIBRATION = 1e-4  # ... and of vibrations with rigid contacts: what they stick at depends on how they slid before
RIGID_SHARE = 0.05  # of the preload: some rigid contacts slip
SHARE = 0.1  # of the preload: most contacts slip in the resonance
PEAK = 0.98  # of the first frequency of the stuck plates: about there the response is largest
FAR, NEAR = 0.06, 0.006  # share of a frequency to both sides, and the same at the largest size
MODE = (3e-6, 3e-5)  # m, amplitudes: from micro-slip on
SAMPLES, LONG = 128, 20  # harmonics above which only a short way is followed
GOAL = 1.0


class Forgetful(WeakKeyDictionary[object, Any]):
    """A memory that keeps no preconditioner."""

    def __setitem__(self, key: object, value: object) -> None:
        """Keep nothing."""


@contextmanager
def arrays() -> Iterator[None]:
    """Make every Jacobian an array."""
    with patch("stickslip.harmonic.balance.products_pay", lambda _: False):
        yield


@lru_cache(maxsize=1)
def plates_with(contacts: int) -> Plates:
    """Return the plates with 12 or 24 contacts, or with 11 of the 12: one point inside is free."""
    if contacts != 11:
        return two_plates(contacts)
    whole = two_plates(12)
    old = whole.system.interface
    own = np.delete(np.arange(12), 6)
    rows = scipy.sparse.csr_array(old.gap_operator)[(3 * own[:, None] + np.arange(3)).ravel()]
    names, laws = (tuple(every[i] for i in own) for every in (old.names, old.laws))
    return Plates(replace(whole.system, interface=Interface(names, laws, rows)), whole.preload)


def first_frequency(plates: Plates) -> float:
    """Return the first natural frequency with all contacts stuck, rad/s."""
    stuck = plates.system.stuck_structure()
    square = scipy.sparse.linalg.eigsh(
        scipy.sparse.csc_array(stuck.stiffness),
        1,
        scipy.sparse.csc_array(stuck.mass),
        sigma=0.0,
        return_eigenvectors=False,
    )[0]
    return float(np.sqrt(square))


@dataclass(frozen=True)
class Task:
    """One analysis of one size; `short` follows a tenth of the way."""

    contacts: int
    how: Discretisation
    short: bool

    @property
    def plates(self) -> Plates:
        """What vibrates."""
        return plates_with(self.contacts)

    @property
    def load(self) -> HarmonicLoad:
        """On the plates."""
        return self.plates.load(SHARE, "slide")

    def around(self, middle: float) -> tuple[float, float]:
        """Return frequencies on both sides of one."""
        share = NEAR if self.short else FAR
        return (1.0 - share) * middle, (1.0 + share) * middle

    @property
    def resonance(self) -> float:
        """About where the plates vibrate most, rad/s."""
        return PEAK * first_frequency(self.plates)

    @property
    def points(self) -> int:
        """Asked for."""
        return 2 if self.short else 10


def forced(task: Task) -> np.ndarray:
    """Return the last point of a forced response by arc length through the resonance."""
    return _swept(task, task.plates.system, task.load, task.resonance)


def wheel(task: Task) -> np.ndarray:
    """Return the same of a tuned wheel under engine order 3."""
    one = wheel_with(task.contacts, task.how.order)
    return _swept(task, one.system, one.load, first_stuck(one, 3))


@lru_cache(maxsize=1)
def wheel_with(contacts: int, order: int) -> Rubbing:
    """Return a wheel of 24 sectors."""
    return rubbing_wheel(24, 3, order, *GRIDS[contacts])


def _swept(task: Task, system: System, load: HarmonicLoad, middle: float) -> np.ndarray:
    how = task.how
    sweep = Sweep(
        omega_range=task.around(middle),
        selection="always_high",
        low=how.order,
        high=how.order,
        points=task.points,
        peak_points=0,
        samples=how.samples,
        newton=how.newton,
    )
    found = accepted_points(list(forced_response(system, load, sweep)))
    _all_found(p.converged for p in found)
    return np.ravel(found[-1].coefficients)


def rigid(task: Task) -> np.ndarray:
    """Return the vibration at the last point of a response with rigid contacts."""
    plates, old = task.plates, task.plates.system.interface
    laws = tuple(RigidCoulomb(mu=0.3) for _ in old.laws)
    system = replace(plates.system, interface=Interface(old.names, laws, old.gap_operator))
    load, around = plates.load(RIGID_SHARE, "slide"), task.around(task.resonance)
    found = list(rigid_response(system, load, around, task.points, task.how))
    _all_found(p.converged for p in found)
    return np.ravel(found[-1].coefficients[1:])


def level(task: Task) -> np.ndarray:
    """Return the last point of a branch in the level of the load, below the resonance."""
    span = (1.0, 1.3) if task.short else (0.5, 4.0)
    omega = (1.0 - 0.5 * FAR) * task.resonance
    system = task.plates.system
    found = list(branch_in_parameter(system, task.load, "excitation", span, omega, task.points, task.how))
    _all_found(p.converged for p in found)
    return np.ravel(found[-1].coefficients)


def peak(task: Task) -> np.ndarray:
    """Return amplitudes of a peak tracked through levels of the load."""
    values = (1.0, 1.05) if task.short else (1.0, 1.3)
    around = task.around(task.resonance)
    found = list(track_peak(task.plates.system, task.load, "excitation", values, around, discretisation=task.how))
    _all_found(p.converged for p in found)
    return np.array([p.amplitude for p in found])


def mode(task: Task) -> np.ndarray:
    """Return the damping ratio at the largest amplitude of a nonlinear mode."""
    one, still = _first_mode(task)
    span = MODE[0], 1.5 * MODE[0] if task.short else MODE[1]
    system = task.plates.system
    sweep = ModeSweep(points=task.points, span=span)
    found = nonlinear_mode(system, still, one, int(system.outputs[0]), task.how, sweep)
    _all_found(p.converged for p in found.points)
    return np.array([found.points[-1].ratio])


def cycle(task: Task) -> np.ndarray:
    """Return limit cycles, unknowns and all, that are fed with growing shares of the damping at one of their amplitudes."""
    one, still = _first_mode(task)
    system = task.plates.system
    problem = self_excited_motions(system, still, one, int(system.outputs[0]), task.how)
    begin = at_amplitude(problem, 1.5 * slip_amplitude(problem))
    fed = problem.level(begin.level, begin.omega)
    y = np.append(begin.unknowns[:-1], np.log(begin.amplitude))
    for share in np.linspace(1.0, 1.05, task.points):
        found = solve_cycle(problem, y[:-2], float(np.exp(y[-1])), problem.omega(y), share * fed)
        _all_found([found is not None])
        y = found
    return y


def _first_mode(task: Task) -> tuple[StuckMode, HarmonicLoad]:
    return stuck_modes(task.plates.system, 1)[0], HarmonicLoad(task.load.static)


def _all_found(converged: Iterable[bool]) -> None:
    if not all(converged):
        raise RuntimeError("a point did not converge")


CASES = {
    "forced": ("forced response by arc length", forced, SAME),
    "level": ("branch in the level of the load", level, SAME),
    "peak": ("resonance peak tracked, its sweep included", peak, SAME),
    "mode": ("nonlinear mode", mode, SAME),
    "cycle": ("limit cycles", cycle, SAME),
    "rigid": ("forced response with rigid contacts", rigid, VIBRATION),
    "wheel": ("forced response of a tuned wheel", wheel, SAME),
}


def measured(name: str, contacts: int, order: int) -> dict[str, Any]:
    """Compare the three ways of one analysis of one size."""
    told, analysis, same = CASES[name]
    ways = {
        "auto": (Krylov(), nullcontext),
        "anew": (Krylov(memory=Forgetful()), nullcontext),
        "arrays": (Krylov(), arrays),
    }
    spent, answers = dict[str, float](), dict[str, np.ndarray]()
    for way, (krylov, form) in ways.items():
        newton = Newton(linear=Automatic(krylov=krylov))
        how = Discretisation(order=order, samples=max(SAMPLES, 8 * order), newton=newton)
        task = Task(contacts, how, order > LONG)
        if not spent:
            analysis(replace(task, how=replace(how, newton=Newton())))  # kernels, tables and models are there for all
        start = process_time()
        with form():
            answers[way] = analysis(task)
        spent[way] = process_time() - start
    own, size = answers["auto"], float(np.max(np.abs(answers["auto"])))
    off = {way: float(np.max(np.abs(x - own))) / size for way, x in answers.items()}
    ratio, saved = spent["arrays"] / spent["auto"], spent["anew"] / spent["auto"]
    kept, anew = (ways[way][0].counts for way in ("auto", "anew"))
    unknowns = 3 * contacts * (2 * order + 1)
    return {
        "name": f"krylov/{name}_{unknowns}",
        "value": ratio,
        "goal": f">= {GOAL:g}",
        "holds": bool(ratio >= GOAL and max(off.values()) <= same),
        "note": f"{told}, {contacts} contacts, H = {order}: {spent['arrays']:.2f} s with arrays over {spent['auto']:.2f} s by default; {kept.systems} systems, "
        f"{kept.products} products, {kept.preconditioners} preconditioners; with none kept {anew.systems} systems, {anew.products} products, {anew.preconditioners} "
        f"preconditioners, {spent['anew']:.2f} s: keeping saves {saved:.1f} times; answers differ by {off['arrays']:.1e} and {off['anew']:.1e}",
    }


def run() -> list[dict[str, Any]]:
    """Measure all; five minutes."""
    return [measured(name, *size) for size in SIZES for name in CASES]


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])), indent=1))
