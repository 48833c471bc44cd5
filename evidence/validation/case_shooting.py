"""Shooting against closed forms and integration, and the error of the time step at strongly nonlinear points.

The error of the first harmonic over all outputs is measured against the value extrapolated from the two finest steps. Shooting is the
instrument: its motions are periodic to rounding, so that nothing but the step is left in the differences, and a motion found at one step is
the start at the next, so that residual tractions of contacts that never slip stay as they are.
"""

import numpy as np
import scipy.linalg

from evidence.models.lumped import blades_and_damper, griffin
from evidence.models.solving import at_frequency
from evidence.models.two_blades import COARSER, two_blades
from evidence.validation.case_b3_blade_with_damper import RESPONSE
from evidence.validation.compare import Record, bound, digits, record
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.forced.response import Sweep, forced_problem
from stickslip.response.system import System
from stickslip.response.time.shooting import ShootingResult, period_map, shoot
from stickslip.response.time.start import TransientStart, rest, start_from_harmonics
from stickslip.response.time.stepping.marcher import prepared
from stickslip.response.time.transient import TimeStepping, integrate

CASE = "Shooting"
HZ = 2 * np.pi
CLOSED, B3, B6 = "closed form", "literature benchmark B3", "literature benchmark B6"
TIGHT = 1e-9  # of the vibration
POINTS = ((20.0, 179.0), (5.0, 178.15))  # F_CL/F_HE and Hz of the two blades: at the peaks
STEPS = (256, 512, 1024, 2048, 4096, 8192)
DEFAULT = 1024
RESOLVED, FINER = 512, 2048  # steps between which the order is measured
BESIDE = (0.9, 0.94, 0.97, 1.0, 1.03, 1.06, 1.1)  # times these
PERIODS = 600  # of integration, at most
EXACT_STEPS = (32768, 65536)


def shot(
    system: System, load: HarmonicLoad, omega: float, steps: int, start: TransientStart | None = None
) -> ShootingResult:
    """Shoot, and insist on a result.

    Raises
    ------
    RuntimeError
        If it is not periodic.
    """
    interface, stepping = system.interface, TimeStepping(steps, tolerance=TIGHT)
    found = shoot(
        system.plain_structure, interface.gap_operator, interface.laws, load, omega, system.outputs, start, stepping
    )
    if found.status not in {"converged", "coarse"}:  # the error of the step is what is measured
        raise RuntimeError(f"omega = {omega}: {found.status}, residual {found.residual:.1e}")
    return found


def refined(
    system: System, load: HarmonicLoad, omega: float, start: TransientStart | None, steps: tuple
) -> list[ShootingResult]:
    """Shoot with each number of steps, from the motion of the one before."""
    found: list[ShootingResult] = []
    for count in steps:
        found.append(shot(system, load, omega, count, found[-1].final if found else start))
    return found


def extrapolated(found: list[ShootingResult]) -> ComplexArray:
    """Return the first harmonic at a vanishing step, as for an error of second order."""
    fine, coarse = found[-1].harmonics[1], found[-2].harmonics[1]
    return np.asarray(fine + (fine - coarse) / 3.0)


def step_errors(found: list[ShootingResult]) -> FloatArray:
    """Return the largest error of the first harmonic over the outputs, relative to the largest amplitude."""
    exact = extrapolated(found)
    size = np.max(np.abs(exact))
    return np.array([np.max(np.abs(r.harmonics[1] - exact)) / size for r in found])


def balance_start(system: System, load: HarmonicLoad, hertz: float) -> tuple[TransientStart, ComplexArray]:
    """Return the state at t = 0 of the balance with five harmonics, and its first harmonic of the outputs."""
    point = at_frequency(system, load, hertz, order=5)
    problem = forced_problem(system, load, Sweep(omega_range=(1.0, 2.0)))
    motion = problem.low.linear.recover(point.omega, point.coefficients)
    gaps, laws = system.interface.gap_operator, system.interface.laws
    return start_from_harmonics(motion, point.omega, gaps, laws), motion[1, system.outputs]


def linear_records() -> list[Record]:
    """Compare with the linear structure, where every contact sticks."""
    system, load = blades_and_damper()
    records = []
    for hertz, printed in ((150.0, "2.791850e-5"), (170.0, "7.115741e-5")):
        found = shot(system, load, HZ * hertz, DEFAULT)
        at = f"B6 at {hertz:g} Hz, stuck"
        stuck = system.stuck_structure()
        inverse = np.linalg.inv(stuck.mass)
        first_order = np.block([[np.zeros((6, 6)), np.eye(6)], [-inverse @ stuck.stiffness, -inverse @ stuck.damping]])
        exact = np.exp(scipy.linalg.eigvals(first_order) / hertz)
        left = list(found.floquet.multipliers)
        worst = 0.0
        for value in [*exact, 1.0, 1.0]:  # and a residual traction of each contact
            nearest = int(np.argmin(np.abs(np.array(left) - value)))
            worst = max(worst, abs(left.pop(nearest) - value))
        records += [
            digits(CASE, f"{at}: |y2|, m", abs(found.harmonics[1, 0]), printed, B6),
            bound(CASE, f"{at}: Floquet multipliers, largest error", worst, 1e-8, CLOSED),
            record(CASE, f"{at}: neutral multipliers", found.floquet.neutral, 2, 0, CLOSED),
        ]
    return records


def griffin_records() -> list[Record]:
    """Compare with the exact column of B3."""
    records = []
    for limit, at, _, _, exact, _ in RESPONSE:
        system, load = griffin(float(limit))
        found = refined(system, load, float(at), None, EXACT_STEPS)
        value = abs(extrapolated(found)[0])
        records.append(digits(CASE, f"B3 |X1|, fc = {limit}, W = {at}", value, exact, B3))
    return records


def mean_error(
    system: System, load: HarmonicLoad, omega: float, begin: ShootingResult, exact: ComplexArray, steps: int
) -> float:
    """Return the root mean square error over neighbouring numbers of steps: where switches fall within one is a matter of chance."""
    counts = [round(steps * factor) for factor in BESIDE]
    found = [shot(system, load, omega, count, begin.final).harmonics[1] for count in counts]
    errors = [np.max(np.abs(first - exact)) / np.max(np.abs(exact)) for first in found]
    return float(np.sqrt(np.mean(np.square(errors))))


def order_records(
    name: str,
    system: System,
    load: HarmonicLoad,
    omega: float,
    found: list[ShootingResult],
    judged: ComplexArray,
    *,
    slow: bool,
) -> list[Record]:
    """Ask for second order where all contact springs are slow, and for an error an order below the difference that the integration judges."""
    errors = step_errors(found)
    steps = np.array([len(r.outputs) for r in found])
    exact = extrapolated(found)
    coarse, fine = (mean_error(system, load, omega, found[-1], exact, count) for count in (RESOLVED, FINER))
    judged_error = float(np.max(np.abs(judged - exact)) / np.max(np.abs(exact)))
    used = float(errors[list(steps).index(DEFAULT)])
    source = "values extrapolated to a vanishing step; errors " + ", ".join(
        f"{error:.1e} at {count}" for count, error in zip(steps, errors, strict=True)
    )
    over = "over neighbouring numbers of steps"
    order = np.log(coarse / fine) / np.log(FINER / RESOLVED)
    known = (
        [record(CASE, f"{name}: order of the error in the step, {RESOLVED} to {FINER} steps", order, 2.0, 0.15, source)]
        if slow
        # fast springs, held at their mean, and slow ones, held along a line, err with opposite signs: what is left has no order
        else [
            bound(CASE, f"{name}: mean error at {RESOLVED} steps, {over}", coarse, 5e-4, source),
            bound(CASE, f"{name}: mean error at {FINER} steps, {over}", fine, 5e-5, source),
        ]
    )
    return [
        *known,
        bound(CASE, f"{name}: error of the first harmonic at {DEFAULT} steps, all outputs", used, 1e-3, source),
        bound(
            CASE,
            f"{name}: that error over the error of the balance with H = 5",
            used / judged_error,
            0.1,
            f"{source}; error of the balance {judged_error:.1e}",
        ),
    ]


def settled_records(name: str, system: System, load: HarmonicLoad, omega: float, start: TransientStart) -> list[Record]:
    """Compare with the settled state of an integration from the same start, and begin at its end."""
    interface = system.interface
    arguments = (system.plain_structure, interface.gap_operator, interface.laws)
    stepping = TimeStepping(DEFAULT, max_periods=PERIODS, tolerance=1e-5)
    settled = integrate(*arguments, load, omega, system.outputs, start, stepping)
    same = shot(system, load, omega, DEFAULT, settled.final)
    own = shot(system, load, omega, DEFAULT, start)
    size = np.max(np.abs(same.harmonics[1]))
    first = settled.harmonics[1]
    source = (
        f"time integration, {settled.status} after {settled.periods} periods; shooting {own.periods} and {own.corrections} corrections "
        f"from the same start, {same.periods} and {same.corrections} from its end; {own.floquet.neutral} neutral multipliers"
    )
    return [
        bound(
            CASE,
            f"{name}: first harmonic against integration, begun at its end",
            np.max(np.abs(same.harmonics[1] - first)) / size,
            1e-4,
            source,
        ),
        bound(
            CASE,
            f"{name}: the same, both from one start (residual tractions may differ)",
            np.max(np.abs(own.harmonics[1] - first)) / size,
            2e-3,
            source,
        ),
        bound(
            CASE, f"{name}: periods of shooting over periods of integration", own.periods / settled.periods, 0.2, source
        ),
        decay_record(name, system, load, omega, own),
    ]


def decay_record(name: str, system: System, load: HarmonicLoad, omega: float, found: ShootingResult) -> Record:
    """Compare the decay of a small disturbance over ten periods of integration with the largest multiplier.

    The disturbance is the mode of the largest multiplier that is not neutral, so that the others do not mix in. It is small enough to
    leave nearly all steps in their contact states.
    """
    interface, periods, small = system.interface, 10, 1e-6
    marcher = prepared(system.plain_structure, interface.gap_operator, interface.laws, load, omega, DEFAULT)
    mapping, state = period_map(marcher, found.final)
    values, modes = np.linalg.eig(mapping.derivative(state).monodromy)
    chosen = int(np.argmin(np.abs(values - found.floquet.multipliers[found.floquet.neutral])))
    mode = modes[:, chosen] / np.linalg.norm(modes[:, chosen])
    size = small * np.linalg.norm(state)
    disturbed = state + size * mode.real
    for _ in range(periods):
        disturbed, state = mapping.image(disturbed).state, mapping.image(state).state
    expected = size * (values[chosen] ** periods * mode).real
    off = np.linalg.norm(disturbed - state - expected) / np.linalg.norm(expected)
    source = f"Floquet multiplier of modulus {abs(values[chosen]):.6f}"
    return bound(CASE, f"{name}: a disturbance after {periods} periods of integration", off, 0.02, source)


def run() -> list[Record]:
    """Compare with closed forms, with exact values and with the settled state, and measure the order."""
    records = linear_records() + griffin_records()
    (system, load), omega = blades_and_damper(), HZ * 163.0
    start, judged = balance_start(system, load, 163.0)
    found = refined(system, load, omega, start, STEPS)
    records.append(digits(CASE, "B6 at 163 Hz: |y2|, m", abs(extrapolated(found)[0]), "2.273072e-4", B6))
    records += order_records("B6 at 163 Hz", system, load, omega, found, judged, slow=True)
    still = rest(system.structure.n, system.interface.laws)
    records += settled_records("B6 at 163 Hz", system, load, omega, still)
    case = two_blades(COARSER)
    for ratio, hertz in POINTS:
        load, name = case.load(ratio), f"two blades, F_CL/F_HE = {ratio:g}, {hertz:g} Hz"
        start, judged = balance_start(case.system, load, hertz)
        found = refined(case.system, load, HZ * hertz, start, STEPS)
        records += order_records(name, case.system, load, HZ * hertz, found, judged, slow=False)
        records += settled_records(name, case.system, load, HZ * hertz, start)
    return records
