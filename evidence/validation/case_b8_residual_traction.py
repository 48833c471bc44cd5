"""B8: the response of the blade-damper-blade system that depends on the residual tractions, H = 5, 256 samples."""

import numpy as np

from evidence.models.lumped import Y2, blades_and_damper
from evidence.models.solving import at_frequency, balance_of, motion
from evidence.validation.compare import Record, digits
from stickslip.harmonic.balance import HarmonicBalance

SOURCE = "literature benchmark B8"
SHARES = (-1.0, -0.5, 0.0, 0.5, 1.0)
TABLE = (  # Hz, smallest, at (m1, m2), largest, at (m1, m2), ratio
    ("158", "1.016409e-4", None, "1.016409e-4", None, "1.000"),
    ("159", "1.327118e-4", (-1.0, 0.5), "1.351601e-4", (1.0, -1.0), "1.018"),
    ("162", "2.251094e-4", None, "2.251094e-4", None, "1.000"),
    ("164", "1.895695e-4", (-1.0, -1.0), "1.975866e-4", (1.0, 1.0), "1.042"),
    ("215", "4.382925e-5", (-1.0, -1.0), "5.108913e-5", (1.0, -0.5), "1.166"),
    ("220", "3.748268e-5", (-1.0, -1.0), "6.640432e-5", (1.0, 1.0), "1.772"),
    ("228", "2.725740e-5", (-1.0, -1.0), "4.749974e-5", (1.0, 1.0), "1.743"),
)
MEANS_158 = ("1.2379e-4", "1.4954e-4")


def y2(hertz: float, shares: tuple[float, float]) -> tuple[float, float]:
    """Return |y2| of the first harmonic and the mean of y2."""
    problem, load = blades_and_damper(m=shares)
    point = at_frequency(problem, load, hertz, 5)
    balance: HarmonicBalance = balance_of(problem, load, 5, 256)
    q = motion(balance, point.omega, balance.unknowns(point.coefficients))
    return float(abs(q[1, Y2])), float(q[0, Y2].real)


def run() -> list[Record]:
    """Compare every row; the extremes are taken over all 25 pairs of starts."""
    case = "B8 residual traction"
    records = []
    for hertz, smallest, at_smallest, largest, at_largest, ratio in TABLE:
        found = {(a, b): y2(float(hertz), (a, b)) for a in SHARES for b in SHARES}
        amplitudes = {pair: value[0] for pair, value in found.items()}
        low, high = min(amplitudes.values()), max(amplitudes.values())
        records += [
            digits(case, f"smallest |y2| at {hertz} Hz, m", low, smallest, SOURCE),
            digits(case, f"largest |y2| at {hertz} Hz, m", high, largest, SOURCE),
            digits(case, f"largest over smallest |y2| at {hertz} Hz", high / low, ratio, SOURCE),
        ]
        records += [
            digits(case, f"|y2| at {hertz} Hz with starts {pair}, m", amplitudes[pair], text, SOURCE)
            for pair, text in ((at_smallest, smallest), (at_largest, largest))
            if pair is not None
        ]
        if hertz == "158":
            means = [value[1] for value in found.values()]
            records += [
                digits(case, "smallest mean of y2 at 158 Hz, m", np.min(means), MEANS_158[0], SOURCE),
                digits(case, "largest mean of y2 at 158 Hz, m", np.max(means), MEANS_158[1], SOURCE),
            ]
    return records
