"""What time integration costs against harmonic balance at the same frequencies of the two blades, in one process.

The integration begins at the static equilibrium, as it must where no balance is at hand, and ends when less than 0.1 % of its first harmonic
is left to come; 1024 steps a period leave another 0.05 %. A point of the balance costs a twentieth of the response at twenty frequencies,
with five harmonics everywhere or with the Jacobian Alert. Shooting begins where the integration begins, and once more, in rows named ``along``, each frequency at the motion of the one before. All are compiled beforehand.

The rule that ends an integration cannot know the answer and is careful: what is left is far below 0.1 %. Records "in hindsight" count the
periods only until the first harmonic stays within 0.1 % of where it ends.

The balance with five harmonics is itself some per cent off at these frequencies; the notes say by how much, and how far the integration ends
from the motion that shooting finds from its last state.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from evidence.models.two_blades import two_blades
from stickslip.arrays import ComplexArray, IntArray
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.bouc_wen import BoucWen
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.equilibrium import preload
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.response.time.settling import period_harmonics
from stickslip.response.time.shooting import ShootingResult, period_map, shoot
from stickslip.response.time.start import TransientStart, start_from_harmonics
from stickslip.response.time.stepping.marcher import prepared
from stickslip.response.time.transient import TimeStepping, TransientResult, integrate

HERTZ = (165.0, 184.0)
RATIOS = (20.0, 5.0)
LEVELS = (0.4, 0.7, 1.0)  # of the peak amplitude, below the peak: where points are taken
ACCURACY = 1e-3
STEPPING = TimeStepping(steps_per_period=1024, max_periods=2000, tolerance=ACCURACY)
GOAL = 100.0
BESIDE, FEW = (176.0, 178.0), 5  # hertz and number of frequencies where other laws are tried
LIMIT = 5.0  # N: of their tangential springs
ALONG = (1024, 256)  # steps a period of a sweep by shooting
PATIENCE = 100  # periods within the accuracy that are taken to be for good


@dataclass(frozen=True, eq=False)
class Measured:
    """CPU seconds at one frequency, and what came out."""

    omega: float
    integration: float
    shooting: float
    settled: TransientResult
    shot: ShootingResult
    balance_error: float  # of the first output with H = 5, relative to the orbit
    integration_error: float  # of all outputs, relative to the orbit that its end leads to
    needed: int  # periods after which the first harmonic stays within the accuracy of that orbit

    @property
    def hindsight(self) -> float:
        """CPU seconds of the integration up to the period from which on it is accurate."""
        return self.integration * self.needed / self.settled.periods

    @property
    def note(self) -> str:
        """One frequency in words."""
        return (
            f"{self.omega / (2 * np.pi):.2f} Hz: {self.settled.periods} periods, {self.settled.status}, {self.integration:.2f} s, "
            f"off by {100 * self.integration_error:.2g} %, below 0.1 % after {self.needed}; shooting {self.shot.periods} periods and {self.shot.corrections} corrections, "
            f"{self.shot.status}, {self.shooting:.2f} s; H = 5 off by {100 * self.balance_error:.2g} %"
        )


def equilibrium(system: System, load: HarmonicLoad) -> TransientStart:
    """Return the static equilibrium without tangential forces, at rest."""
    laws = tuple(replace(law, k_t=0.0, k_w=0.0) for law in system.interface.laws)
    smooth = replace(system, interface=replace(system.interface, laws=laws))
    retained = np.zeros((2, system.retained.size), dtype=complex)
    retained[0] = preload(smooth, load.static)
    displacement = smooth.condensed(load, 1).recover(1.0, retained)[0].real
    # the springs are unstretched: their sliders stand where the gaps are
    gaps = (system.interface.gap_operator @ displacement).reshape(-1, 3)[:, :2]
    return TransientStart(displacement, np.zeros(system.structure.n), tuple(gaps))


def balance_seconds(ratio: float, selection: str) -> tuple[float, ForcedProblem, list[ForcedPoint]]:
    """Return the CPU seconds of a frequency, the faster of two responses, and what was solved."""
    seconds = []
    for _ in range(2):
        begin = process_time()
        problem, points = two_blades().stepped(ratio, HERTZ, selection)
        seconds.append(process_time() - begin)
    accepted = [p for p in accepted_points(points) if p.converged]
    return min(seconds) / 20.0, problem, accepted


def chosen(problem: ForcedProblem, points: list[ForcedPoint]) -> list[ForcedPoint]:
    """Return the peak and points below it, by their amplitude."""
    top = max(points, key=problem.amplitude)
    below = [p for p in points if p.omega <= top.omega]
    peak = problem.amplitude(top)
    found = [min(below, key=lambda p: abs(problem.amplitude(p) / peak - level)) for level in LEVELS]
    return list({p.omega: p for p in found}.values())


def needed(arguments: tuple, outputs: IntArray, begin: TransientStart, orbit: ComplexArray) -> int:
    """Return the number of periods after which the first harmonic stays within the accuracy of the orbit's."""
    steps, last = STEPPING.steps_per_period, 0
    mapping, state = period_map(prepared(*arguments, steps), begin)
    for period in range(1, STEPPING.max_periods + 1):
        image = mapping.image(state)
        modal = period_harmonics(image.record.motion[-1], image.record.motion, 1)
        off = np.abs(modal[1] @ mapping.marcher.modes.basis[outputs].T - orbit)
        if np.max(off) > ACCURACY * np.max(np.abs(orbit)):
            last = period
        if period > last + PATIENCE:
            break
        state = image.state
    return last + 1


def measured(ratio: float, problem: ForcedProblem, point: ForcedPoint) -> Measured:
    """Integrate and shoot at the frequency of a point."""
    case = two_blades()
    system, load = case.system, case.load(ratio)
    interface = system.interface
    arguments = (system.plain_structure, interface.gap_operator, interface.laws, load, point.omega)
    begin = equilibrium(system, load)
    clock = process_time()
    settled = integrate(*arguments, system.outputs, begin, STEPPING)
    integration = process_time() - clock
    clock = process_time()
    shot = shoot(*arguments, system.outputs, begin, STEPPING)
    shooting = process_time() - clock
    orbit = shoot(*arguments, system.outputs, settled.final, STEPPING).harmonics[1]
    first = settled.harmonics[1] if settled.settled else settled.average
    return Measured(
        point.omega,
        integration,
        shooting,
        settled,
        shot,
        problem.amplitude(point) / abs(orbit[0]) - 1.0,
        float(np.max(np.abs(first - orbit)) / np.max(np.abs(orbit))),
        needed(arguments, system.outputs, begin, orbit),
    )


def entry(name: str, value: float, goal: float | None, note: str) -> dict[str, Any]:
    """Return a record."""
    holds = goal is None or value > goal
    text = "none" if goal is None else f"> {goal:g}"
    return {"name": name, "value": value, "goal": text, "holds": bool(holds), "note": note}


def records(ratio: float) -> list[dict[str, Any]]:
    """Measure one ratio F_CL/F_HE."""
    everywhere, problem, points = balance_seconds(ratio, "always_high")
    alert, _, _ = balance_seconds(ratio, "jacobian_alert")
    found = [measured(ratio, problem, point) for point in chosen(problem, points)]
    integration = float(np.mean([m.integration for m in found]))
    hindsight = float(np.mean([m.hindsight for m in found]))
    shooting = float(np.mean([m.shooting for m in found]))
    note = "; ".join(m.note for m in found)
    where = f"ratio_{ratio:g}"
    costs = f"a frequency by balance {everywhere:.4f} s with H = 5, {alert:.4f} s with the alert, by integration {integration:.2f} s"
    return [
        entry(f"time/integration_over_balance_h5/{where}", integration / everywhere, GOAL, f"{costs}; {note}"),
        entry(
            f"time/integration_over_balance_h5_in_hindsight/{where}",
            hindsight / everywhere,
            GOAL,
            f"integration {hindsight:.2f} s",
        ),
        entry(f"time/integration_over_alert/{where}", integration / alert, GOAL, costs),
        entry(
            f"time/integration_over_shooting/{where}",
            integration / shooting,
            None,
            f"shooting {shooting:.2f} s a frequency",
        ),
        entry(
            f"time/shooting_over_balance_h5/{where}",
            shooting / everywhere,
            None,
            f"shooting {shooting:.2f} s a frequency",
        ),
    ]


def along(ratio: float) -> list[dict[str, Any]]:
    """Shoot at the frequencies of the balance, each from the motion at the one before, as the balance begins, with several steps a period."""
    case = two_blades()
    everywhere, problem, points = balance_seconds(ratio, "always_high")
    interface, load = case.system.interface, case.load(ratio)
    first = problem.low.linear.recover(points[0].omega, points[0].coefficients)
    start = start_from_harmonics(first, points[0].omega, interface.gap_operator, interface.laws)
    rows = []
    for steps in ALONG:
        stepping, begin, shots = replace(STEPPING, steps_per_period=steps), start, []
        clock = process_time()
        for point in points:
            shots.append(
                shoot(
                    case.system.plain_structure,
                    interface.gap_operator,
                    interface.laws,
                    load,
                    point.omega,
                    case.system.outputs,
                    begin,
                    stepping,
                )
            )
            begin = shots[-1].final
        seconds = (process_time() - clock) / len(points)
        coarse = sum(not shot.converged for shot in shots)
        off = max(abs(problem.amplitude(p) / abs(s.harmonics[1, 0]) - 1.0) for p, s in zip(points, shots, strict=True))
        note = (
            f"{seconds:.3f} s a frequency, {np.mean([s.periods for s in shots]):.1f} periods and {np.mean([s.corrections for s in shots]):.1f} corrections; "
            f"error of the step up to {100 * max(s.step_error for s in shots):.2g} %, {coarse} of {len(shots)} not converged; H = 5 off by up to {100 * off:.2g} %"
        )
        rows.append(
            entry(
                f"time/shooting_along_over_balance_h5/ratio_{ratio:g}/steps_{steps}", seconds / everywhere, None, note
            )
        )
    return rows


def other_laws() -> dict[str, Callable[[ElasticCoulomb], ContactLaw]]:
    """Return laws with the stiffnesses of the example's, by name; two of them without unloading of the normal direction."""
    return {
        "coupled_coulomb": lambda c: CoupledCoulomb(k_t=c.k_t, k_n=c.k_n, mu=c.mu, preload=c.preload),
        "iwan": lambda c: Iwan(k_t=c.k_t, k_w=c.k_w, k_n=c.k_n, limit=LIMIT),
        "bouc_wen": lambda c: BoucWen(
            k_t=c.k_t, k_w=c.k_w, k_n=c.k_n, beta=0.5 * c.k_t / LIMIT, gamma=0.5 * c.k_t / LIMIT
        ),
    }


def other(name: str, law: Callable[[ElasticCoulomb], ContactLaw]) -> dict[str, Any]:
    """Shoot from the balance with H = 5 at one frequency of the two blades with another law, after a first time that compiles."""
    case = two_blades()
    contacts = replace(case.system.interface, laws=tuple(law(c) for c in case.system.interface.laws))
    system, load = replace(case.system, interface=contacts), case.load(RATIOS[0])
    low, high = (2 * np.pi * hertz for hertz in BESIDE)
    sweep = Sweep(
        omega_range=(low, high),
        low=5,
        high=5,
        samples=case.sweep.samples,
        selection="always_high",
        frequencies=FEW,
        peak_points=0,
    )
    seconds, shooting, shot = np.inf, np.inf, None
    problem = forced_problem(system, load, sweep)
    for _ in range(2):
        clock = process_time()
        points = accepted_points(list(forced_response(system, load, sweep)))
        seconds = min(seconds, (process_time() - clock) / FEW)
        point = points[-1]
        motion = problem.low.linear.recover(point.omega, point.coefficients)
        start = start_from_harmonics(motion, point.omega, contacts.gap_operator, contacts.laws)
        clock = process_time()
        shot = shoot(
            system.plain_structure,
            contacts.gap_operator,
            contacts.laws,
            load,
            point.omega,
            system.outputs,
            start,
            STEPPING,
        )
        shooting = min(shooting, process_time() - clock)
    note = f"{BESIDE[1]:g} Hz, {shot.status} after {shot.periods} periods and {shot.corrections} corrections, {shooting:.2f} s; balance {seconds:.4f} s"
    return entry(f"time/shooting_over_balance_h5/{name}", shooting / seconds, None, note)


def compilation() -> dict[str, Any]:
    """Compile what `shoot` needs beside the laws in a process with an empty cache."""
    program = (
        "from time import process_time\nimport stickslip.response.time.shooting\n"
        "from stickslip.response.time.stepping.time_step import run_steps\n"
        "clock = process_time(); run_steps(); print(process_time() - clock)"
    )
    with TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        told = subprocess.run(
            [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True
        )
    seconds = float(told.stdout.split()[-1])
    record = entry("time/first_compilation_seconds", seconds, None, "CPU seconds of one process; goal below 10")
    return record | {"goal": "< 10", "holds": seconds < 10.0}


def run() -> list[dict[str, Any]]:
    """Compile, then measure the ratios."""
    case = two_blades()
    system, load = case.system, case.load(RATIOS[0])
    case.stepped(RATIOS[0], HERTZ, "jacobian_alert")
    begin = equilibrium(system, load)
    interface = system.interface
    arguments = (system.plain_structure, interface.gap_operator, interface.laws, load, 1000.0)
    few = TimeStepping(steps_per_period=64, max_periods=8)  # with tangents too
    integrate(*arguments, system.outputs, begin, few)
    shoot(*arguments, system.outputs, begin, few)
    found = [record for ratio in RATIOS for record in records(ratio)]
    found += [record for ratio in RATIOS for record in along(ratio)]
    return [*found, *(other(name, law) for name, law in other_laws().items()), compilation()]
