"""A tracked resonance peak of many contacts: the bordered problem by products and a Krylov method against arrays and LU.

CPU times of one process on one thread. The plates of `many_contacts` at H = 3, a corner pulled along the contact, at three levels of the load.
"""

from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np

from evidence.models.many_contacts import two_plates
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response import PeakPoint, track_peak
from stickslip.response.parameter import Discretisation
from stickslip.response.system import System
from stickslip.solve.krylov import Automatic, Krylov
from stickslip.solve.newton_method import Newton

POINTS, ORDER, SAMPLES = 100, 3, 64
SHARE = 0.01  # of the preload, at level 1
LEVELS = (1.0, 1.3, 1.6)
AROUND = (2 * np.pi * 1500.0, 2 * np.pi * 2000.0)  # rad/s, of the first resonance
GOAL, SAME = 5.0, 1e-7


class ByArray(Discretisation):
    """The Jacobian as an array, whatever its size."""

    def balance(self, system: System, load: HarmonicLoad, more: np.ndarray) -> HarmonicBalance:
        return replace(Discretisation.balance(self, system, load, more), jacobian="dense")


def tracked(form: type[Discretisation], system: System, load: HarmonicLoad) -> list[PeakPoint]:
    """Track the peak with a solver of its own."""
    how = form(order=ORDER, samples=SAMPLES, newton=Newton(linear=Automatic(krylov=Krylov())))
    return list(track_peak(system, load, "excitation", LEVELS, AROUND, discretisation=how))


def run() -> list[dict[str, Any]]:
    """Measure; about a minute."""
    plates = two_plates(POINTS)
    system, load = plates.system, plates.load(SHARE, "slide")
    unknowns = Discretisation(order=ORDER).balance(system, load, system.outputs[:1]).size
    spent, peaks = [], []
    for form in (Discretisation, ByArray):
        start = process_time()
        peaks.append(tracked(form, system, load))
        spent.append(process_time() - start)
    away = max(
        abs(getattr(one, name) / getattr(other, name) - 1.0)
        for one, other in zip(*peaks, strict=True)
        for name in ("amplitude", "omega")
    )
    faster = spent[1] / spent[0]
    converged = all(p.converged for each in peaks for p in each)
    return [
        {
            "name": f"tracking/peak_by_products_over_lu_{POINTS}",
            "value": faster,
            "goal": f">= {GOAL:g}",
            "holds": bool(faster >= GOAL and away <= SAME and converged),
            "note": f"peak at {len(LEVELS)} levels of the load, the sweep for the first one included, {unknowns} unknowns: {spent[0]:.3g} s by "
            f"products and GMRES, {spent[1]:.3g} s by LU; amplitudes and frequencies differ by {away:.1e}",
        }
    ]
