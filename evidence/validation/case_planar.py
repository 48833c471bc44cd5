"""Planar friction on paths through all states: evaluators against a judge that shares no code and locates its events.

Paths are drawn with three harmonics, k_t = k_n = 1 and µ = 0.5. Goals are those of the issue: 1e-8 of the largest coefficient where the normal
force stays above 1 % of its mean, 1e-6 through lift-off. The march on samples is of second order, with one stiffness and with two.
"""

import numpy as np

from evidence.judges.planar_contact import Contact, judged
from evidence.validation.compare import Record, bound, record
from stickslip.arrays import FloatArray
from stickslip.contact.compiled import Evaluator, compile_contacts
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.harmonic.aft import ContactPeriod, contact_forces

CASE = "planar friction against a judge"
SOURCE = "evidence.judges.planar_contact"
# of the motions: seed, least normal force as a share of its mean
TABLE = ((0, 0.02), (1, 0.3), (2, 0.6), (3, 0.1), (4, 0.9), (5, -0.2), (6, -0.5), (7, -1.0), (8, -0.05), (9, -3.0))
SAMPLES = 2 ** np.arange(7, 12)


def drawn(seed: int, least: float) -> tuple[FloatArray, float]:
    """Return gaps (7, 3) and the preload with which the normal force falls to `least` of its mean."""
    gaps = np.random.default_rng(seed).standard_normal((7, 3))
    gaps /= np.array([1.0, 1, 1, 2, 2, 3, 3])[:, None]
    tau = 2 * np.pi * np.arange(4096) / 4096
    waves = [f(h * tau) for h in (1, 2, 3) for f in (np.cos, np.sin)]
    swing = np.max(gaps[1:, 2] @ np.array(waves))
    return gaps, float(gaps[0, 2] + swing / (1.0 - least))


def evaluated(gaps: FloatArray, preload: float, k_w: float | None, how: Evaluator, samples: int = 64) -> ContactPeriod:
    """Evaluate one contact."""
    law = CoupledCoulomb(k_t=1.0, k_w=k_w, k_n=1.0, mu=0.5, preload=preload)
    return contact_forces(gaps, compile_contacts([law], evaluator=how), samples)


def run() -> list[Record]:
    """Compare the event evaluator on every motion, and the order of the march on some."""
    records: list[Record] = []
    for seed, least in TABLE:
        gaps, preload = drawn(seed, least)
        truth = judged(gaps, Contact(1.0, 1.0, 0.5, preload))
        period = evaluated(gaps, preload, None, "events")
        off = np.max(np.abs(period.coefficients - truth.coefficients))
        off /= np.max(np.abs(truth.coefficients))
        states = "-".join([event[2] for event in truth.events]) or "no change"
        at = f"least N {least:g} of its mean: {states}"
        records.append(bound(CASE, f"force at located events, {at}", off, 1e-8 if least > 0 else 1e-6, SOURCE))
    for k_w in (None, 0.4, 2.5):
        errors = np.zeros(SAMPLES.size)
        for seed, least in TABLE[1:8:3]:
            gaps, preload = drawn(seed, least)
            truth = judged(gaps, Contact(1.0, 1.0, 0.5, preload, k_w)).coefficients
            for i, samples in enumerate(SAMPLES):
                found = evaluated(gaps, preload, k_w, "march", int(samples)).coefficients
                errors[i] += np.max(np.abs(found - truth))
        order = -np.polyfit(np.log(SAMPLES), np.log(errors), 1)[0]
        at = f"k_w / k_t = {1.0 if k_w is None else k_w}"
        records += [
            record(CASE, f"order of the march, {at}", order, 2.0, 0.1, SOURCE),
            bound(CASE, f"force marched on 2048 samples, {at}", errors[-1], 3e-5, SOURCE),
        ]
    return records
