"""B1: one Jenkins element under ``A cos t`` against the closed forms.

The library samples the contact force, with an error that falls with the square of the number of samples; so many samples are taken
here that ten digits are met, and the order of the fall is a row of its own.
"""

import numpy as np

from evidence.validation.compare import Record, bound, digits, record
from stickslip.arrays import ComplexArray
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.harmonic_set import to_complex

SOURCE = "literature benchmark B1 (closed form)"
ORDER = 5
SAMPLES = 2**20  # for the ten digits of the describing function, of which one ends within 2e-12 of a rounding boundary
SAMPLES_HARMONICS = 2**18  # for the eight digits of the higher harmonics
# A/xc, kr/k, ki/k, F3/fc, F5/fc
TABLE = (
    ("1.25", "0.8576215101", "0.2037183272", ("-0.08148733", "-0.02376714"), ("0.00195570", "-0.03338264")),
    ("1.5", "0.7082085942", "0.2829421211", ("-0.08892013", "-0.11003305"), ("0.03754405", "-0.01013003")),
    ("2", "0.5000000000", "0.3183098862", ("0.00000000", "-0.21220659"), ("0.00000000", "0.04244132")),
    ("3", "0.2917914058", "0.2829421211", ("0.17784026", "-0.22006609"), ("-0.07508811", "-0.02026005")),
    ("5", "0.1423784899", "0.2037183272", ("0.32594932", "-0.09506855"), ("-0.00782278", "-0.13353057")),
    ("10", "0.0520440193", "0.1145915590", ("0.36669299", "0.10695212"), ("0.15547783", "-0.10744105")),
    ("100", "0.0016925506", "0.0126050715", ("0.16388067", "0.38689166"), ("0.15349719", "0.19431059")),
)
CIRCLE = (("2", "0.50000", "0.31831"),)


def element_force(ratio: float, samples: int, order: int = ORDER) -> ComplexArray:
    """Return the force harmonics 0..order over fc of an element with k = fc = 1 under the amplitude `ratio`."""
    gap = np.zeros((2 * order + 1, 3))
    gap[1, 0] = ratio
    contacts = compile_contacts([Jenkins(k_t=1.0, limit=1.0)])
    return to_complex(contact_forces(gap, contacts, samples).coefficients)[:, 0]


def circle_force(ratio: float, samples: int) -> ComplexArray:
    """Return the harmonics of both tangential forces on a circular path; limits and springs are 1."""
    gap = np.zeros((3, 3))
    gap[1, 0], gap[2, 1] = ratio, ratio
    contacts = compile_contacts([Jenkins(k_t=1.0, k_w=1.0, limit=1.0)])
    return to_complex(contact_forces(gap, contacts, samples).coefficients)


def exact_stiffness(ratio: float) -> complex:
    """Return (kr + i ki)/k from the formula."""
    angle = np.arccos(1 - 2 / ratio)
    return complex((angle - np.sin(2 * angle) / 2) / np.pi, 4 / (np.pi * ratio) * (1 - 1 / ratio))


def convergence_order(ratio: float) -> float:
    """Return the exponent with which the error of the describing function falls, fitted over 32 to 8192 samples."""
    samples = 2 ** np.arange(5, 14)
    errors = [abs(element_force(ratio, int(n))[1] / ratio - exact_stiffness(ratio)) for n in samples]
    return float(-np.polyfit(np.log(samples), np.log(errors), 1)[0])


def run() -> list[Record]:
    """Compare every row and column of the table."""
    case = "B1 Jenkins element"
    records = []
    for printed, kr, ki, third, fifth in TABLE:
        ratio = float(printed)
        force = element_force(ratio, SAMPLES_HARMONICS)
        stiffness = element_force(ratio, SAMPLES, order=1)[1] / ratio
        at = f"at A/xc = {printed}"
        records += [
            digits(case, f"kr/k {at}", stiffness.real, kr, SOURCE),
            digits(case, f"ki/k {at}", stiffness.imag, ki, SOURCE),
        ]
        for h, pair in ((3, third), (5, fifth)):
            records += [
                digits(case, f"{part} F{h}/fc {at}", value, text, SOURCE)
                for part, value, text in zip(("Re", "Im"), (force[h].real, force[h].imag), pair, strict=True)
            ]
        records.append(bound(case, f"largest even harmonic/fc {at}", np.max(np.abs(force[[0, 2, 4]])), 1e-12, SOURCE))
        energy = np.pi * stiffness.imag * ratio**2
        records.append(record(case, f"dissipation/(fc xc) {at}", energy, 4 * (ratio - 1), 1e-9, SOURCE))
    records += [
        record(case, f"order of the sampling error at A/xc = {r:g}", convergence_order(r), 2.0, 0.1, "second order")
        for r in (1.5, 3.0)
    ]
    for printed, real, imaginary in CIRCLE:
        ratio = float(printed)
        force = circle_force(ratio, 4096)
        for column, phase in ((0, 1.0), (1, 1j)):
            stiffness = force[1, column] * phase / ratio
            at = f"of two uncoupled elements on a circle, tangent {column + 1}, A/xc = {printed}"
            records += [
                digits(case, f"kr/k {at}", stiffness.real, real, SOURCE),
                digits(case, f"ki/k {at}", stiffness.imag, imaginary, SOURCE),
            ]
    return records
