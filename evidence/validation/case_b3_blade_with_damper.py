"""B3: a one-mass blade with a friction damper (after Griffin 1980): peaks, optimum preload, H = 1 and 11 against exact.

The source's peaks come from a closed form without sampling error: once the contact force is sampled finely enough here and the top is
fitted, once the peak is tracked directly with exact events. The best preload is found by direct tracking. The source's table of H = 1
and H = 11 is that of 2048 samples a period: its digits are met with that number and with no other power of two (at 65536 samples the
same solver agrees with the closed form of H = 1 to nine digits, and the table does not, by up to 1e-6). Its exact column was
integrated with located events; ours is the integration of `evidence.integrator`, extrapolated from two step lengths.
"""

import numpy as np
from numpy.polynomial import Chebyshev

from evidence.integrator.transient import TimeStepping
from evidence.models.lumped import griffin
from evidence.models.solving import RefinedResult, balance_of, bonded, integrated, motion, solve
from evidence.validation.compare import Record, digits
from stickslip.arrays import FloatArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.response.parameter import Discretisation
from stickslip.response.resonances.tracking import smallest_peak, track_peak

SOURCE = "literature benchmark B3"
PEAK_SAMPLES = 2**16  # sampling error of a peak amplitude near 1e-9, of its frequency below 1e-7
TABLE_SAMPLES = 2048
EXACT = Discretisation(order=1, evaluator="events")  # no sampling error, as the closed form
AROUND = (0.8, 1.4)  # of the first peak, rad/s
STUCK = 1e9  # limit of a damper that never slips
PEAKS = (  # fc, peak, at W; "inf": the damper never slips
    ("0", "5.0002500", "0.999900"),
    ("0.02", "3.7388820", "1.000334"),
    ("0.05", "1.9693838", "1.004519"),
    ("0.08", "0.8446513", "1.031849"),
    ("0.10", "0.6260618", "1.065886"),
    ("0.12", "0.5629705", "1.096192"),
    ("0.14", "0.5509276", "1.119652"),
    ("0.16", "0.5597761", "1.137493"),
    ("0.2", "0.6038447", "1.161950"),
    ("0.5", "1.1288107", "1.211484"),
    ("1", "2.0803123", "1.221983"),
    ("2", "4.0030643", "1.224654"),
    ("inf", "4.0826190", "1.224663"),
)
OPTIMUM = ("0.138956", "0.5509002", "1.118581")
RESPONSE = (  # fc, W, H=1, H=11, exact, exact |X3|
    ("0.1", "1.10", "0.57025109", "0.56839847", "0.56839426", "2.826e-3"),
    ("0.1", "1.15", "0.46676448", "0.46660066", "0.46660338", "2.267e-3"),
    ("0.1", "1.20", "0.38873148", "0.38916180", "0.38916153", "1.762e-3"),
    ("0.2", "1.10", "0.34383960", "0.34383960", "0.34383960", "0"),
    ("0.2", "1.15", "0.59787944", "0.59978108", "0.59978456", "2.670e-3"),
    ("0.2", "1.20", "0.57605135", "0.57777233", "0.57777472", "2.243e-3"),
)


def amplitudes(balance: HarmonicBalance, omegas: FloatArray, start: FloatArray) -> FloatArray:
    """Return |X1| at each frequency, every solution being the start of the next."""
    values = []
    for omega in omegas:
        start = solve(balance, float(omega), start)
        values.append(abs(motion(balance, float(omega), start)[1, 0]))
    return np.array(values)


def peak(limit: float, near: float, samples: int = PEAK_SAMPLES) -> tuple[float, float]:
    """Return the largest |X1| at H = 1 and its frequency.

    The maximum of a polynomial through nine Chebyshev points: sampling leaves an error of 1e-9 in each amplitude, which would hide the
    flat top from a search by differences but moves the fitted maximum by less than 1e-7. The window shrinks until slip sets in outside.
    """
    problem, load = griffin(limit)
    balance = balance_of(problem, load, 1, samples)
    nodes = np.cos(np.pi * (np.arange(9) + 0.5) / 9)[::-1]
    best = near
    for width in (4e-3, 1e-3, 3e-4, 3e-4):
        omegas = best + width * nodes
        start = bonded(problem, balance, load, float(omegas[0]))
        values = amplitudes(balance, omegas, start)
        fit = Chebyshev.fit(omegas, values, 6)
        turning = [float(r.real) for r in fit.deriv().roots() if abs(r.imag) < 1e-9 and abs(r.real - best) < width]
        best = max(turning, key=fit) if turning else float(omegas[np.argmax(values)])
    return float(fit(best)), best


def tracked() -> list[tuple[float, float]]:
    """Return the largest |X1| at H = 1 and its frequency for each limit of `PEAKS`, each found from the one before."""
    limits = [STUCK if fc == "inf" else float(fc) for fc, *_ in PEAKS][::-1]
    peaks = track_peak(*griffin(STUCK), "preload", limits, AROUND, discretisation=EXACT)
    found = [(p.amplitude, p.omega) if p.converged else (np.nan, np.nan) for p in peaks]
    return found[::-1]


def optimum() -> tuple[float, float, float]:
    """Return the preload with the smallest peak, that peak and its frequency: the root of the exact slope of the tracked peak."""
    best = smallest_peak(*griffin(0.1), "preload", (0.1, 0.2), AROUND, discretisation=EXACT)
    return best.value, best.amplitude, best.omega


def time_domain(limit: float, omega: float) -> RefinedResult:
    """Integrate to the steady state; the error of the step is below 1e-9."""
    stepping = TimeStepping(steps_per_period=32768, tolerance=1e-9, max_periods=1000)
    return integrated(*griffin(limit), omega, 11, stepping)


def response(limit: float, omega: float, order: int, samples: int = TABLE_SAMPLES) -> float:
    """Return |X1| of the harmonic balance with harmonics 0..order."""
    problem, load = griffin(limit)
    balance = balance_of(problem, load, order, samples)
    x = solve(balance, omega, bonded(problem, balance, load, omega))
    return float(abs(motion(balance, omega, x)[1, 0]))


def run() -> list[Record]:
    """Compare the peak table, the optimum and the response table."""
    case = "B3 blade with friction damper"
    records = []
    for (fc, amplitude, at), direct in zip(PEAKS, tracked(), strict=True):
        found = peak(STUCK if fc == "inf" else float(fc), float(at))
        records += [
            digits(case, f"tracked peak |X1| at H = 1, fc = {fc}", direct[0], amplitude, SOURCE),
            digits(case, f"tracked peak frequency at H = 1, fc = {fc}", direct[1], at, SOURCE),
            digits(case, f"peak |X1| at H = 1, fc = {fc}", found[0], amplitude, SOURCE),
            digits(case, f"peak frequency at H = 1, fc = {fc}", found[1], at, SOURCE),
        ]
    names = ("optimum fc", "peak |X1| at the optimum", "peak frequency at the optimum")
    records += [
        digits(case, f"{name}, H = 1, by direct tracking", ours, printed, SOURCE)
        for name, ours, printed in zip(names, optimum(), OPTIMUM, strict=True)
    ]
    for fc, at, first, eleventh, exact, third in RESPONSE:
        limit, omega = float(fc), float(at)
        where = f"fc = {fc}, W = {at}"
        time = time_domain(limit, omega)
        records += [
            digits(case, f"|X1| at H = 1, {where}", response(limit, omega, 1), first, SOURCE),
            digits(case, f"|X1| at H = 11, {where}", response(limit, omega, 11), eleventh, SOURCE),
            digits(case, f"|X1| by time integration, {where}", abs(time.first_harmonic[0]), exact, SOURCE),
            digits(
                case,
                f"|X3| by time integration, {where}",
                abs(time.fine.harmonics[3, 0]),
                "0.0000000" if third == "0" else third,
                SOURCE,
            ),
        ]
    return records
