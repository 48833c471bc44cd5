"""A curve of tmdsimpy: one node on an elastic Coulomb contact with variable normal load, H = 7, 512 samples."""

import numpy as np

from evidence.models.solving import motion, solve
from evidence.validation.compare import Record, record
from evidence.validation.reference_data import contact2d, contact2d_balance, has_complete
from stickslip.arrays import FloatArray
from stickslip.harmonic.balance import HarmonicBalance

SOURCE = "tmdsimpy, commit 17d5fc3"
COLUMNS = ("x0", "y0", "x_h1", "y_h1", "x_h3", "y_h3")
TOLERANCE = 4e-9  # of the largest amplitude of the dof: the accuracy that the curve's own check gives
# printed; on the flank of the resonance half a unit of the last one changes an amplitude by 9e-9 of itself
OMEGA_DIGITS = 10


def column_values(balance: HarmonicBalance, omega: float, x: FloatArray) -> FloatArray:
    """Return the values of `COLUMNS` at a solution."""
    q = motion(balance, omega, x)
    first, third = np.abs(q[1]), np.abs(q[3])
    return np.concatenate([q[0].real, first, third])


def rounding(omega: float) -> float:
    """Return half a unit of the last printed digit of a frequency."""
    return float(0.5 * 10.0 ** (np.floor(np.log10(omega)) + 1 - OMEGA_DIGITS))


def differences(rows: list[dict[str, float]]) -> FloatArray:
    """Return the largest difference in each column beyond the rounding of omega, over the largest amplitude of that dof."""
    balance = contact2d_balance()
    largest = np.array([max(row[f"{c[0]}_h1"] for row in rows) for c in COLUMNS])
    x = np.zeros(balance.size)
    worst = np.zeros(len(COLUMNS))
    for row in rows:
        omega = row["omega"]
        x = solve(balance, omega, x)
        at = balance.linearise(x, omega)
        slope = np.linalg.solve(at.jac, -at.jac_p)
        h = rounding(omega)
        ours = column_values(balance, omega, x)
        explained = np.abs(column_values(balance, omega + h, x + h * slope) - ours)
        off = np.abs(ours - np.array([row[c] for c in COLUMNS]))
        worst = np.maximum(worst, (off - explained) / largest)
    return worst


def run() -> list[Record]:
    """Compare all rows at hand."""
    rows = contact2d(complete=has_complete())
    return [
        record(
            "tmdsimpy contact2d",
            f"difference of {column} over its dof's largest amplitude, beyond the rounding of omega, {len(rows)} rows",
            worst,
            0.0,
            TOLERANCE,
            SOURCE,
        )
        for column, worst in zip(COLUMNS, differences(rows), strict=True)
    ]
