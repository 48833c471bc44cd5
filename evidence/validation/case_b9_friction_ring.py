"""B9: the blisk of 24 sectors with a friction ring, as a whole wheel of 96 masses under engine order 2.

The reference solved one sector, giving temporal harmonic h the wave number 2h modulo 24. Here nothing is known of waves: 24 sliders, a
load on every blade. That all blades move alike, and as the sector does, is the result.
"""

from dataclasses import replace

import numpy as np

from evidence.models.lumped_disks import blisk_with_ring
from evidence.validation.compare import Record, bound, digits, record
from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.damping import modal_damping
from stickslip.model.structure import Structure
from stickslip.reduction.full_wheel import wheel
from stickslip.response.rotating.safe import nodal_diameter_map
from stickslip.solve.newton_method import Newton, newton

SOURCE = "literature benchmark B9"
CASE = "B9 blisk with friction ring"
SECTORS, ORDER, STIFFNESS = 24, 2, 2e7
RETENTION = 1.0  # N/m a piece of the ring: where all of it slips, nothing else decides its mean position
FREQUENCIES = {
    0: ("88.263744", "249.311652", "619.343305"),
    1: ("169.344130", "335.565379", "619.820217"),
    2: ("189.301853", "555.310179", "626.202586"),
    3: ("193.049623", "615.150178", "810.006797"),
    4: ("194.333101", "616.585022", "1044.518774"),
    6: ("195.230656", "617.126968", "1464.728714"),
    12: ("195.676051", "617.325797", "2062.975678"),
}
PEAKS = (  # slip limit, amplitude of the tip with one harmonic, at Hz
    (1.0, 3.382108e-5, 626.19668),
    (2.0, 1.836555e-5, 625.90627),
    (2.5, 1.442240e-5, 625.32098),
    (3.0, 1.376320e-5, 624.70200),
    (4.0, 1.563655e-5, 624.03075),
    (5.0, 1.865550e-5, 623.85272),
    (100.0, 5.589923e-5, 623.38244),
)
HARMONICS = (  # slip limit 4: Hz, with harmonic 1, 1 and 3, 1 to 13
    (622, 1.45227935e-5, 1.52363085e-5, 1.53558124e-5),
    (623, 1.52058157e-5, 1.60215522e-5, 1.61767365e-5),
    (624, 1.56359776e-5, 1.65892122e-5, 1.67785425e-5),
    (625, 1.50504969e-5, 1.59609154e-5, 1.61112959e-5),
    (626, 1.29685968e-5, 1.29643813e-5, 1.29667960e-5),
    (627, 9.55604913e-6, 9.55604913e-6, 9.55604913e-6),
)
ONE_HARMONIC = 1e-6  # relative: seven digits are printed, and the peak's frequency to 1e-5 Hz
SEVERAL = 1e-5  # relative: the reference has 4096 samples, exact events are used here


def damped_wheel() -> Structure:
    """Return the wheel with its ring; the modes of the blisk alone are damped by 0.1 %."""
    blisk = wheel(blisk_with_ring(SECTORS, ring=None))
    both = wheel(blisk_with_ring(SECTORS))
    blades = np.concatenate(
        [both.sets[f"sector{n}.{part}"] for n in range(SECTORS) for part in ("disk", "root", "tip")]
    )
    damping = np.zeros((both.n, both.n))
    damping[np.ix_(blades, blades)] = modal_damping(blisk, 1e-3).damping.toarray()
    stiffness = both.stiffness.toarray()
    stiffness[both.sets["ring"], both.sets["ring"]] += RETENTION
    return replace(both, mass=both.mass.toarray(), damping=damping, stiffness=stiffness)


def tips(structure: Structure, limit: float, hertz: float, order: int) -> FloatArray:
    """Return the first-harmonic amplitude of every blade tip."""
    rows = np.zeros((3 * SECTORS, structure.n))
    along = 3 * np.arange(SECTORS)
    rows[along, structure.sets["disk"]], rows[along, structure.sets["ring"]] = 1.0, -1.0
    law = Jenkins(k_t=STIFFNESS, limit=limit)
    contacts = Interface(tuple(f"{n}" for n in range(SECTORS)), (law,) * SECTORS, rows)
    force = np.zeros(structure.n, dtype=complex)
    force[structure.sets["tip"]] = np.exp(2j * np.pi * ORDER * np.arange(SECTORS) / SECTORS)
    retained = np.concatenate([structure.sets["disk"], structure.sets["ring"]])
    linear = condense(structure, retained, HarmonicLoad(np.zeros(structure.n), {1: force}))
    omega = 2 * np.pi * hertz
    motion = np.zeros((1, retained.size), dtype=complex)
    for high in sorted({1, min(order, 3), order}):
        balance = harmonic_balance(linear, contacts, order=high, samples=256, evaluator="events")
        start = balance.unknowns(motion)
        found = newton(lambda v, b=balance: b.linearise(v, omega), start, Newton(max_iterations=60))
        if not found.status.converged:
            raise RuntimeError(f"{hertz} Hz, limit {limit}: {found.status.advice}")
        motion = balance.coefficients(found.x)
    return np.asarray(np.abs(linear.recover(omega, motion)[1, structure.sets["tip"]]))


def run() -> list[Record]:
    """Compare frequencies by nodal diameter, peaks with one harmonic, and amplitudes with several."""
    table = nodal_diameter_map(blisk_with_ring(SECTORS, ring=None), 3)
    records = [
        digits(CASE, f"nodal diameter {diameter}, family {family + 1}, Hz", hertz, printed, SOURCE)
        for diameter, row in FREQUENCIES.items()
        for family, (hertz, printed) in enumerate(zip(table.of_wave(diameter), row, strict=True))
    ]
    structure = damped_wheel()
    for limit, peak, hertz in PEAKS:
        ours = tips(structure, limit, hertz, 1)
        name = f"limit {limit:g} N, {hertz} Hz, H = 1: tip, m"
        records.append(record(CASE, name, ours[0], peak, ONE_HARMONIC, SOURCE))
    for hertz, *amplitudes in HARMONICS:
        for order, theirs in zip((1, 3, 13), amplitudes, strict=True):
            ours = tips(structure, 4.0, hertz, order)
            name = f"limit 4 N, {hertz} Hz, H = {order}: tip, m"
            records.append(record(CASE, name, ours[0], theirs, SEVERAL, SOURCE))
            spread = float(np.ptp(ours) / ours[0])
            records.append(bound(CASE, f"{hertz} Hz, H = {order}: spread of the blades", spread, 1e-6, SOURCE))
    return records
