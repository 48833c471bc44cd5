"""B1: planar friction on a circular path, the test that tells a coupled law from two tangents side by side.

Located events give the closed form to round-off. The march takes the path as straight between samples: an error of second order in the
samples, a row of its own.
"""

import numpy as np

from evidence.validation.compare import Record, bound, digits, record
from stickslip.arrays import ComplexArray
from stickslip.contact.compiled import Evaluator, compile_contacts
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.harmonic_set import to_complex

SOURCE = "literature benchmark B1 (closed form)"
# A/xc, real and imaginary part of F/U
TABLE = (("1.5", "0.44444444", "0.49690399"), ("2", "0.25", "0.43301270"), ("5", "0.04", "0.19595918"))


def circle_force(ratio: float, evaluator: Evaluator = "events", samples: int = 0) -> tuple[ComplexArray, int]:
    """Return the harmonics 0..3 of both tangential forces, k = limit = 1, and the contacts whose state did not repeat."""
    gap = np.zeros((7, 3))
    gap[1, 0], gap[2, 1] = ratio, ratio
    law = CoupledCoulomb(k_t=1.0, k_n=0.0, mu=1.0, preload=1.0)
    period = contact_forces(gap, compile_contacts([law], evaluator=evaluator), samples)
    return to_complex(period.coefficients)[:, :2], period.unsettled


def exact_stiffness(ratio: float) -> complex:
    """Return F/U of the steady circular motion, for k = limit = 1."""
    return complex(1.0 / ratio**2, np.sqrt(1.0 - 1.0 / ratio**2) / ratio)


def convergence_order(ratio: float) -> float:
    """Return the exponent with which the error falls, fitted over 64 to 2048 samples."""
    samples = 2 ** np.arange(6, 12)
    errors = [abs(circle_force(ratio, "march", int(n))[0][1, 0] / ratio - exact_stiffness(ratio)) for n in samples]
    return float(-np.polyfit(np.log(samples), np.log(errors), 1)[0])


def run() -> list[Record]:
    """Compare every row of the table, both tangents."""
    case, records = "B1 planar friction on a circle", []
    for printed, real, imaginary in TABLE:
        ratio = float(printed)
        force, unsettled = circle_force(ratio)
        exact = exact_stiffness(ratio)
        for tangent, phase in ((0, 1.0), (1, 1j)):
            stiffness = force[1, tangent] * phase / ratio
            at = f"of F/U, tangent {tangent + 1}, A/xc = {printed}"
            records += [
                record(case, f"real part {at}", stiffness.real, exact.real, 1e-11, "closed form"),
                record(case, f"imaginary part {at}", stiffness.imag, exact.imag, 1e-11, "closed form"),
            ]
        at = f"at A/xc = {printed}"
        records += [
            record(
                case, f"order of the march's sampling error {at}", convergence_order(ratio), 2.0, 0.02, "second order"
            ),
            digits(case, f"closed form, real part {at}", exact.real, real, SOURCE),
            digits(case, f"closed form, imaginary part {at}", exact.imag, imaginary, SOURCE),
            bound(
                case,
                f"harmonics other than the first {at}",
                np.max(np.abs(force[[0, 2, 3]])),
                1e-10,
                "a circle is a circle",
            ),
            bound(case, f"contacts that did not settle {at}", unsettled, 0.5, "events"),
        ]
    return records
