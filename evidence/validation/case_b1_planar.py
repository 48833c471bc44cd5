"""B1: planar friction on a circular path, the test that tells a coupled law from two tangents side by side.

Radial return takes the direction of slip at the end of a step, half a sample late where it turns: an error of first order in the samples,
a row of its own. Twice the force with 2 N samples less that with N is free of it.
"""

import numpy as np

from evidence.validation.compare import Record, bound, digits, record
from stickslip.arrays import ComplexArray
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.fourier import to_complex

SOURCE = "literature benchmark B1 (closed form)"
SAMPLES = 2**13
# A/xc, real and imaginary part of F/U
TABLE = (
    ("1.5", "0.44444444", "0.49690399"),
    ("2", "0.25", "0.43301270"),
    ("5", "0.04", "0.19595918"),
)


def circle_force(ratio: float, samples: int) -> tuple[ComplexArray, int]:
    """Return the harmonics 0..3 of both tangential forces, k = limit = 1, and the contacts whose state did not repeat."""
    gap = np.zeros((7, 3))
    gap[1, 0], gap[2, 1] = ratio, ratio
    law = CoupledCoulomb(k_t=1.0, k_n=0.0, mu=1.0, preload=1.0)
    period = contact_forces(gap, compile_contacts([law]), samples)
    return to_complex(period.coefficients)[:, :2], period.unsettled


def exact_stiffness(ratio: float) -> complex:
    """Return F/U of the steady circular motion, for k = limit = 1."""
    return complex(1.0 / ratio**2, np.sqrt(1.0 - 1.0 / ratio**2) / ratio)


def extrapolated(ratio: float, samples: int) -> ComplexArray:
    """Return the harmonics of both tangential forces without the error of first order in the samples."""
    return 2.0 * circle_force(ratio, 2 * samples)[0] - circle_force(ratio, samples)[0]


def convergence_order(ratio: float) -> float:
    """Return the exponent with which the error falls, fitted over 64 to 2048 samples."""
    samples = 2 ** np.arange(6, 12)
    errors = [
        abs(circle_force(ratio, int(n))[0][1, 0] / ratio - exact_stiffness(ratio)) for n in samples
    ]
    return float(-np.polyfit(np.log(samples), np.log(errors), 1)[0])


def run() -> list[Record]:
    """Compare every row of the table, both tangents."""
    case, records = "B1 planar friction on a circle", []
    for printed, real, imaginary in TABLE:
        ratio = float(printed)
        force, unsettled = extrapolated(ratio, SAMPLES), circle_force(ratio, SAMPLES)[1]
        exact = exact_stiffness(ratio)
        for tangent, phase in ((0, 1.0), (1, 1j)):
            stiffness = force[1, tangent] * phase / ratio
            at = f"of F/U, tangent {tangent + 1}, A/xc = {printed}"
            records += [
                record(case, f"real part {at}", stiffness.real, exact.real, 5e-7, "closed form"),
                record(case, f"imaginary part {at}", stiffness.imag, exact.imag, 5e-7, "closed form"),
            ]  # fmt: skip
        at = f"at A/xc = {printed}"
        records += [
            record(case, f"order of the sampling error {at}", convergence_order(ratio), 1.0, 0.02, "first order"),
            digits(case, f"closed form, real part {at}", exact.real, real, SOURCE),
            digits(case, f"closed form, imaginary part {at}", exact.imag, imaginary, SOURCE),
            bound(case, f"harmonics other than the first {at}", np.max(np.abs(force[[0, 2, 3]])), 1e-10, "a circle is a circle"),
            bound(case, f"contacts that did not settle {at}", unsettled, 0.5, "march"),
        ]  # fmt: skip
    return records
