"""B1: Iwan's element with evenly spread limits: first-loading curve, energy lost in a cycle and its slope in micro-slip."""

import numpy as np

from evidence.validation.compare import Record, digits, record
from stickslip.arrays import FloatArray
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.laws.iwan import FourParameter, Iwan, UniformBand
from stickslip.harmonic.aft import contact_forces

SOURCE = "literature benchmark B1 (closed form)"
SLIDERS = 400
SAMPLES = 2**12
ENERGY = (("0.5", "0.0416666667"), ("1", "0.3333333333"), ("2", "2.6666666667"), ("4", "10.6666666667"))


def exact_energy(amplitude: float) -> float:
    """Return the energy lost in a cycle for k = Fs = 1, all sliders moving from xs = 2 on."""
    return amplitude**3 / 3.0 if amplitude <= 2.0 else 4.0 * amplitude - 16.0 / 3.0


def energy(law: Iwan, amplitude: float, samples: int = SAMPLES) -> float:
    """Return the energy lost in a cycle under ``amplitude cos τ``, from the first harmonic of the force."""
    gap = np.zeros((3, 3))
    gap[1, 0] = amplitude
    period = contact_forces(gap, compile_contacts([law]), samples)
    return float(-np.pi * period.coefficients[2, 0] * amplitude)


def first_loading(law: Iwan, displacement: FloatArray) -> FloatArray:
    """Return the forces under displacements that grow from zero, by the compiled step."""
    state = law.initial_state()
    force, new, status = np.empty(3), np.empty_like(state), np.empty(2, dtype=np.int64)
    jac = np.zeros((3 + state.size, 6 + state.size))
    out = np.empty_like(displacement)
    for i, x in enumerate(displacement):
        at = np.array([x, 0.0, 0.0])
        law.kernel(at, np.zeros(3), state, law.parameters(), force, new, jac, status)
        state[:], out[i] = new, force[0]
    return out


def slope(law: Iwan, amplitudes: FloatArray) -> float:
    """Return the exponent with which the energy grows with the amplitude."""
    lost = [energy(law, float(a)) for a in amplitudes]
    return float(np.polyfit(np.log(amplitudes), np.log(lost), 1)[0])


def run() -> list[Record]:
    """Compare energies, first loading and slopes."""
    case, records = "B1 Iwan element", []
    law = Iwan(k_t=1.0, limit=1.0, population=UniformBand(n_sliders=SLIDERS))
    for printed, lost in ENERGY:
        amplitude = float(printed)
        # midpoint rule over the sliders, relative error at most (cell / A)² with cell = 2 / n, and sampling
        tolerance = (2.0 / SLIDERS / amplitude) ** 2 + 30.0 / SAMPLES**2
        records += [
            record(
                case,
                f"energy of {SLIDERS} sliders at A = {printed}",
                energy(law, amplitude),
                exact_energy(amplitude),
                tolerance,
                SOURCE,
            ),
            digits(case, f"closed form of the energy at A = {printed}", exact_energy(amplitude), lost, SOURCE),
        ]
    x = np.array([0.1, 0.5, 1.0, 1.5, 2.0, 3.0])
    want = np.where(x < 2.0, x - x**2 / 4.0, 1.0)
    for at, got, exact in zip(x, first_loading(law, x), want, strict=True):
        # at an edge of a cell the sum over sliders is the integral
        records.append(record(case, f"force in first loading at x = {at:g}", got, exact, 1e-12, SOURCE))
    records.append(
        record(case, "slope of the energy in micro-slip", slope(law, np.array([0.1, 0.2, 0.4])), 3.0, 2e-3, SOURCE)
    )
    for chi in (-0.3, -0.7):
        four = Iwan(k_t=1.0, limit=1.0, population=FourParameter(chi=chi, beta=0.5, n_sliders=SLIDERS))
        records.append(
            record(
                case,
                f"slope of the energy in micro-slip, chi = {chi:g}",
                slope(four, np.array([0.1, 0.2, 0.4])),
                3.0 + chi,
                2e-3,
                "Segalman 2005: 3 + chi",
            )
        )
    return records
