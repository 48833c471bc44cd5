"""Energy shares of harmonics in a spectrum, and supports chosen from them."""

from collections.abc import Iterable

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import ByDof, Harmonics, joined, of_all
from stickslip.harmonic.selection.strategy import NOISE, Step, Verdict


def padded_solution(step: Step) -> FloatArray:
    """Return the scaled unknowns of a solution in the reference's space, zeros for missing harmonics."""
    return step.reference.unknowns(step.balance.coefficients(step.x))


def contacts_of_reference(step: Step) -> ContactPeriod:
    """Return the contacts at a solution, with all harmonics up to the highest of the reference."""
    return step.reference.contacts(padded_solution(step), step.omega)


def spectral_shares(balance: HarmonicBalance, x: FloatArray) -> FloatArray:
    """Return the share of each harmonic in the spectral energy (Gastaldi & Berruti 2017, eq. 10).

    ``|q_h|² / (q_0² + sum |q_k|²)``, summed over the relative displacements of the contacts, which are all lengths; the
    unknowns may also contain rotations of rigid dampers.

    Parameters
    ----------
    balance
        The periodic problem.
    x
        (size,) scaled unknowns of the solution.

    Returns
    -------
    FloatArray
        (len(harmonics),), the static term first; zeros if nothing moves.
    """
    gaps = balance.rows.gaps(x.reshape(balance.n_rows, balance.linear.n))
    square = np.sum(gaps**2, axis=1)
    each = np.append(square[0], square[1::2] + square[2::2])
    total = float(each.sum())
    return each / total if total > 0.0 else np.zeros_like(each)


def shares_by_dof(balance: HarmonicBalance, x: FloatArray) -> FloatArray:
    """Return the share of each harmonic in the energy of each coordinate (Gastaldi & Berruti 2017, eq. 10).

    Parameters
    ----------
    balance
        The periodic problem.
    x
        (size,) scaled unknowns of the solution.

    Returns
    -------
    FloatArray
        (len(harmonics), n), the static term first; zeros for a coordinate that moves less than a millionth of the
        largest, the level of solver residuals.
    """
    square = x.reshape(balance.n_rows, balance.linear.n) ** 2
    each = np.concatenate([square[:1], square[1::2] + square[2::2]])
    total = each.sum(axis=0)
    moves = total > NOISE**2 * total.max(initial=0.0)
    return np.asarray(np.where(moves, each / np.where(moves, total, 1.0), 0.0))


def above(step: Step, indicators: Iterable[float], threshold: float) -> Harmonics:
    """Return the harmonics of the reference whose indicator exceeds a threshold, and those of the first passage."""
    pairs = zip(step.reference.harmonics, indicators, strict=True)
    return tuple(sorted({*step.smallest, *(h for h, share in pairs if share > threshold)}))


def up_to(step: Step, order: int) -> Harmonics:
    """Return the harmonics of the reference up to `order`, and the harmonics of the first passage."""
    return tuple(sorted({*step.smallest, *(h for h in step.reference.harmonics if h <= order)}))


def next_up(step: Step, had: Harmonics) -> Harmonics:
    """Return the given harmonics and the next higher one of the reference, if there is one."""
    more = [h for h in step.reference.harmonics if h > had[-1]]
    return tuple(sorted({*had, *more[:1]}))


def raised(step: Step) -> Harmonics | None:
    """Return the harmonics of a solution and the next higher one of the reference; None if there is none."""
    more = next_up(step, step.balance.harmonics)
    return None if more == step.balance.harmonics else more


def foretold(
    step: Step, indicator: float, following: Harmonics, *, repeats: bool, by_dof: ByDof | None = None
) -> Verdict:
    """Return the verdict of a rule that predicts the harmonics of the next frequency.

    `by_dof` contains the predicted harmonics of each coordinate; None: the same for all. With `repeats`, this frequency
    is solved again with its own and the predicted harmonics until it has all predicted ones (Gastaldi & Berruti 2017,
    section 4.5.3). Harmonics are only added, so that the repeats end.
    """
    if by_dof is None:
        lacks = set(following) - set(step.balance.harmonics)
        again = tuple(sorted({*step.balance.harmonics, *following})) if repeats and lacks else None
        return Verdict(indicator, again, following)
    both = joined(step.supports, by_dof)
    if not repeats or both == step.supports:
        return Verdict(indicator, None, of_all(by_dof), following_by_dof=by_dof)
    return Verdict(indicator, of_all(both), of_all(by_dof), None, both, by_dof)
