"""B12: a ring of twelve blades, tuned and mistuned, under engine order 3."""

import numpy as np
import scipy.optimize

from evidence.models.lumped_disks import blade_ring, mistuned_blade_ring
from evidence.validation.compare import Record, digits
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.modes import natural_frequencies
from stickslip.model.structure import Structure
from stickslip.response.rotating.safe import nodal_diameter_map

SOURCE = "literature benchmark B12"
CASE = "B12 ring of blades"
DEVIATIONS = (0.012, -0.018, 0.005, 0.021, -0.009, -0.014, 0.017, 0.002, -0.023, 0.008, 0.011, -0.012)
TUNED = ("1.00000000", "1.00267591", "1.00995049", "1.01980390", "1.02956301", "1.03664894", "1.03923048")
MISTUNED = (
    "0.99780035",
    "0.99981406",
    "1.00071541",
    "1.00627219",
    "1.01313001",
    "1.01915664",
    "1.02112393",
    "1.02631985",
    "1.03313452",
    "1.03827659",
    "1.03918227",
    "1.04131025",
)


def peak(ring: Structure, near: float) -> tuple[float, float, int]:
    """Return the largest amplitude of any blade near a frequency, that frequency, and the blade."""
    force = np.exp(2j * np.pi * 3 * np.arange(12) / 12)
    linear = condense(ring, np.arange(12), HarmonicLoad(np.zeros(12), {1: force}))

    def amplitudes(omega: float) -> np.ndarray:
        at = linear.condensed(omega, 1)
        return np.abs(np.linalg.solve(at.stiffness[1], at.load[1]))

    found = scipy.optimize.minimize_scalar(
        lambda w: -np.max(amplitudes(w)), bounds=(near - 1e-3, near + 1e-3), method="bounded", options={"xatol": 1e-12}
    )
    return float(-found.fun), float(found.x), int(np.argmax(amplitudes(found.x)))


def run() -> list[Record]:
    """Compare frequencies, peaks and the amplification."""
    tuned = nodal_diameter_map(blade_ring(12), 1).frequencies_hz[:, 0] * 2 * np.pi
    ring = mistuned_blade_ring(DEVIATIONS, damping=0.004)
    mistuned = natural_frequencies(ring, 12) * 2 * np.pi
    records = [
        digits(CASE, f"tuned, {k} nodal diameters, rad/s", ours, theirs, SOURCE)
        for k, (ours, theirs) in enumerate(zip(tuned, TUNED, strict=True))
    ]
    records += [
        digits(CASE, f"mistuned, mode {i + 1}, rad/s", ours, theirs, SOURCE)
        for i, (ours, theirs) in enumerate(zip(mistuned, MISTUNED, strict=True))
    ]
    even, at_even, _ = peak(mistuned_blade_ring(np.zeros(12), damping=0.004), 1.0198)
    most, at_most, blade = peak(ring, 1.0208)
    for name, ours, theirs in (
        ("peak of the tuned ring, m", even, "245.14564"),
        ("its frequency, rad/s", at_even, "1.01979998"),
        ("largest amplitude of the mistuned ring, m", most, "326.0181278"),
        ("its frequency, rad/s", at_most, "1.02076476"),
        ("its blade, from 0", float(blade), "2"),
        ("amplification", most / even, "1.32989568"),
    ):
        records.append(digits(CASE, name, ours, theirs, SOURCE))
    return records
