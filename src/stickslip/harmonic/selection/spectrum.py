"""What strategies that look at spectra have in common: shares of energy, and supports made of them."""

from collections.abc import Iterable

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.selection.strategy import Step
from stickslip.harmonic.support import Harmonics


def padded_solution(step: Step) -> FloatArray:
    """Return the scaled unknowns of a solution in the reference's space, zeros at the harmonics it lacks."""
    return step.reference.unknowns(step.balance.coefficients(step.x))


def contacts_of_reference(step: Step) -> ContactPeriod:
    """Return the contacts at a solution, with coefficients and derivatives of all harmonics up to the reference's highest."""
    return step.reference.contacts(padded_solution(step), step.omega)


def spectral_shares(balance: HarmonicBalance, x: FloatArray) -> FloatArray:
    """Return the share of each harmonic in the spectral energy (Gastaldi & Berruti 2017, eq. 10).

    ``|q_h|² / (q_0² + sum |q_k|²)``, summed over the relative displacements of the contacts: lengths throughout, where the unknowns
    mix translations with the rotations of rigid dampers.

    Parameters
    ----------
    balance
        The periodic problem.
    x
        Its (size,) scaled unknowns.

    Returns
    -------
    FloatArray
        (len(harmonics),), the static term first; zeros where nothing moves.
    """
    gaps = balance.rows.gaps(x.reshape(balance.n_rows, balance.linear.n))
    square = np.sum(gaps**2, axis=1)
    each = np.append(square[0], square[1::2] + square[2::2])
    total = float(each.sum())
    return each / total if total > 0.0 else np.zeros_like(each)


def above(step: Step, indicators: Iterable[float], threshold: float) -> Harmonics:
    """Return the harmonics of the reference whose indicator exceeds a threshold, and those below which no strategy goes."""
    pairs = zip(step.reference.harmonics, indicators, strict=True)
    return tuple(sorted({*step.smallest, *(h for h, share in pairs if share > threshold)}))


def up_to(step: Step, order: int) -> Harmonics:
    """Return the harmonics of the reference up to `order`, and those below which no strategy goes."""
    return tuple(sorted({*step.smallest, *(h for h in step.reference.harmonics if h <= order)}))


def raised(step: Step) -> Harmonics | None:
    """Return the harmonics of a solution and the reference's next one above them; None where there is none."""
    more = [h for h in step.reference.harmonics if h > step.balance.order]
    return tuple(sorted({*step.balance.harmonics, more[0]})) if more else None
