"""Every law with a judge of its own in time: the balance with many harmonics, and the integration over compiled laws, against it.

The judge (`evidence.integrator.verlet`) has laws and a scheme of its own, of second order; its motion is extrapolated from two steps.
"""

import numpy as np

from evidence.integrator.transient import TimeStepping
from evidence.integrator.verlet import integrate
from evidence.models.small_laws import LAWS, OMEGA, on_one_contact
from evidence.models.solving import balance_of, bonded, motion, solve
from evidence.validation.compare import Record, bound
from stickslip.arrays import ComplexArray
from stickslip.contact.law import ContactLaw
from stickslip.response.time import transient

CASE, SOURCE = "motion in time for every law", "integration with laws of its own"
STEPS = 1024
ORDER, SAMPLES = 31, 2048
TOLERANCE = 1e-9


def judged(law: ContactLaw) -> ComplexArray:
    """Return the (H + 1, 3) harmonics of the judge's motion, extrapolated to a vanishing step."""
    system, load = on_one_contact(law)
    coarse, fine = (
        integrate(
            system.structure,
            system.interface.gap_operator,
            system.interface.laws,
            load,
            OMEGA,
            np.arange(3),
            stepping=TimeStepping(steps_per_period=steps, tolerance=TOLERANCE),
        ).harmonics
        for steps in (STEPS, 2 * STEPS)
    )
    return np.asarray(fine + (fine - coarse) / 3.0)


def balanced(law: ContactLaw, order: int) -> ComplexArray:
    """Return the harmonics of the balance."""
    system, load = on_one_contact(law)
    made = balance_of(system, load, order, SAMPLES)
    return motion(made, OMEGA, solve(made, OMEGA, bonded(system, made, load, OMEGA)))


def marched(law: ContactLaw) -> ComplexArray:
    """Return the harmonics of the integration over compiled laws."""
    system, load = on_one_contact(law)
    found = transient.integrate(
        system.structure,
        system.interface.gap_operator,
        system.interface.laws,
        load,
        OMEGA,
        np.arange(3),
        stepping=transient.TimeStepping(steps_per_period=STEPS, tolerance=TOLERANCE),
    )
    return found.harmonics


def run() -> list[Record]:
    """Compare the first seven harmonics of three coordinates for each law."""
    records = []
    for name, law in LAWS.items():
        truth = judged(law)
        size = float(np.max(np.abs(truth[1])))
        for what, found, most in (
            (f"balance, H = {ORDER}", balanced(law, ORDER), 1e-5),
            (f"compiled laws in time, {STEPS} steps", marched(law), 1e-4),
        ):
            rows = min(len(found), len(truth))
            off = float(np.max(np.abs(found[:rows] - truth[:rows]))) / size
            records.append(bound(CASE, f"{name}: {what}, largest error of a harmonic", off, most, SOURCE))
    return records
