"""B6: blade, damper, blade with variable normal load and lift-off: amplitudes, peaks, mean values, natural frequencies.

The source's H = 1, 3 and 5 columns belong to 256 samples a period, its H = 11 column to 1024; the same are used here. Its exact column
was integrated with located events; ours is the integration of `evidence.integrator`, extrapolated from two step lengths.

The benchmark's note says what its digits are good to, found by comparing three programs: the exact column to 2e-5 at 150 and 160 Hz,
and the peaks to 1.2e-4 in amplitude and 4e-4 in frequency, because with 256 samples the curve has several tops. All other numbers
hold to their digits.
"""

import numpy as np
import scipy.linalg

from evidence.integrator.transient import TimeStepping
from evidence.models.lumped import Y2, blades_and_damper
from evidence.models.solving import at_frequency, balance_of, frictionless, integrated, motion, solve
from evidence.validation.compare import Record, digits
from stickslip.arrays import FloatArray
from stickslip.response.equilibrium import preload
from stickslip.response.forced.response import Sweep, forced_problem
from stickslip.response.system import System

SOURCE = "literature benchmark B6"
TABLE = (  # Hz, exact, H=1, H=3, H=5 (256 samples), H=11 (1024 samples)
    ("150", "2.79188e-5", "2.791850e-5", "2.791850e-5", "2.791850e-5", "2.791850e-5"),
    ("160", "1.99957e-4", "1.986549e-4", "1.997869e-4", "2.000666e-4", "2.000624e-4"),
    ("163", "2.273072e-4", "2.413643e-4", "2.251325e-4", "2.273523e-4", "2.273046e-4"),
    ("170", "7.11574e-5", "7.115741e-5", "7.115741e-5", "7.115741e-5", "7.115741e-5"),
)
ORDERS = ((1, 256), (3, 256), (5, 256), (11, 1024))
PEAKS = (  # harmonics, residual traction, amplitude, Hz
    (1, 0.0, "2.59298e-4", "161.808"),
    (5, 0.0, "2.27376e-4", "162.976"),
    (5, -1.0, "2.27393e-4", "162.988"),
    (5, 1.0, "2.27380e-4", "162.918"),
)
STUCK = ("84.97105", "161.98103", "225.07908", "256.62963", "399.94984", "555.08743")
FRICTIONLESS = ("84.80810", "155.76838", "200.27034", "245.24800", "280.53383", "490.37644")
EXACT_GOOD_TO = {"150": 2e-5, "160": 2e-5}  # relative
PEAK_GOOD_TO, PEAK_HZ_GOOD_TO = 1.2e-4, 4e-4
MEANS = {"163": "1.43807e-4", "stuck": "1.32755e-4"}


def y2(problem: System, hertz: float, order: int, samples: int, harmonic: int = 1, factor: float = 1.0) -> complex:
    """Return a harmonic of y2 from the public forced response."""
    load = blades_and_damper(excitation=factor)[1]
    point = at_frequency(problem, load, hertz, order, samples)
    made = forced_problem(problem, load, Sweep(omega_range=(1.0, 2.0)))
    return complex(made.low.linear.recover(point.omega, point.coefficients)[harmonic, Y2])


def time_domain(hertz: float) -> tuple[float, float]:
    """Return |y2| of the first harmonic and the mean of y2 from time integration.

    At 160 Hz the motion depends on the start, because a residual traction survives (benchmark B8): between 1.9995e-4 from rest and
    2.0004e-4 from the solution of H = 11. The source does not state its start; ours is the static equilibrium without tangential
    forces, which comes closest. At the other frequencies the contacts stick, or slip both ways in every period, and the integration
    starts from H = 11.
    """
    order, steps = (0, 2048) if hertz == 160.0 else (11, 4096)
    stepping = TimeStepping(steps_per_period=steps, tolerance=1e-7, max_periods=1500)
    result = integrated(*blades_and_damper(), 2 * np.pi * hertz, order, stepping)
    return float(abs(result.first_harmonic[0])), float(result.fine.harmonics[0, 0].real)


def curve(order: int, traction: float, hertz: FloatArray, samples: int = 256) -> FloatArray:
    """Return |y2| at each frequency; every solution is the start of the next."""
    problem, load = blades_and_damper(m=traction)
    balance = balance_of(problem, load, order, samples)
    first = at_frequency(problem, load, float(hertz[0]), order, samples)
    x = balance.unknowns(first.coefficients)
    values = []
    for f in hertz:
        omega = 2 * np.pi * float(f)
        x = solve(balance, omega, x)
        values.append(abs(motion(balance, omega, x)[1, Y2]))
    return np.array(values)


def peak_records(case: str, order: int, traction: float, amplitude: str, at: str) -> list[Record]:
    """Compare the highest point, and the height of our curve where the source has its own highest point.

    With 256 samples the curve has several tops within 0.1 Hz of each other whose heights differ by 1e-4, because samples change from
    stick to slip one by one; which of them a search returns is a matter of its grid. The second record does not depend on that: it asks
    for the printed height somewhere within the rounding of the printed frequency.
    """
    near, where = float(at), f"H = {order}, residual traction {traction:+g}"
    grid = near + np.arange(-0.15, 0.15, 0.001)
    values = curve(order, traction, grid)
    top = int(np.argmax(values))
    within = curve(order, traction, near + np.concatenate([[-0.02, -0.005], np.linspace(-5e-4, 5e-4, 21)]))[2:]
    closest = float(within[np.argmin(np.abs(within - float(amplitude)))])
    return [
        digits(case, f"peak |y2|, {where}, m", values[top], amplitude, SOURCE, PEAK_GOOD_TO),
        digits(case, f"peak frequency, {where}, Hz", grid[top], at, SOURCE, PEAK_HZ_GOOD_TO),
        digits(case, f"|y2| at {at} Hz (where the source has the peak), {where}, m", closest, amplitude, SOURCE),
    ]


def frequencies(*, stuck: bool) -> FloatArray:
    """Return the natural frequencies (Hz) with all contact springs, or with the normal ones alone."""
    problem, _ = blades_and_damper()
    problem = problem if stuck else frictionless(problem)
    structure = problem.stuck_structure()
    return np.sqrt(scipy.linalg.eigh(structure.stiffness, structure.mass, eigvals_only=True)) / (2 * np.pi)


def run() -> list[Record]:
    """Compare every table of the benchmark."""
    case = "B6 blade-damper-blade"
    records = []
    for name, printed, stuck in (("stuck", STUCK, True), ("frictionless", FRICTIONLESS, False)):
        records += [
            digits(case, f"natural frequency {i + 1}, {name}, Hz", ours, text, SOURCE)
            for i, (ours, text) in enumerate(zip(frequencies(stuck=stuck), printed, strict=True))
        ]
    problem, load = blades_and_damper()
    for hertz, exact, *columns in TABLE:
        f = float(hertz)
        amplitude, mean = time_domain(f)
        good_to = EXACT_GOOD_TO.get(hertz, 0.0)
        name = f"|y2| at {hertz} Hz, time integration, m"
        records.append(digits(case, name, amplitude, exact, SOURCE, good_to))
        if hertz in MEANS:
            records.append(digits(case, f"mean y2 at {hertz} Hz, time integration, m", mean, MEANS[hertz], SOURCE))
        for (order, samples), printed in zip(ORDERS, columns, strict=True):
            ours = abs(y2(problem, f, order, samples))
            records.append(digits(case, f"|y2| at {hertz} Hz, H = {order}, m", ours, printed, SOURCE))
    for order, traction, amplitude, at in PEAKS:
        records += peak_records(case, order, traction, amplitude, at)
    # a stuck mean depends on the start; the source's is that of tangential forces which are zero at rest
    mean = preload(frictionless(problem), load.static)[Y2]
    records.append(digits(case, "mean y2 when stuck, m", mean, MEANS["stuck"], SOURCE))
    return records
