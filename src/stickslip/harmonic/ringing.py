"""Harmonics beyond the judging set that meet a mode: a small contact force may cause a large motion there."""

from dataclasses import replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.contact.product import harmonic_means
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.factors import solved, with_contacts
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.judging import HIGHEST, SAMPLES_A_HARMONIC, judging_set_of
from stickslip.harmonic.matrix_products import products
from stickslip.harmonic.sparse_product import SparseProduct

MOST_RINGING = 4  # harmonics, those with the largest gaps
FAINTEST_GAP = 1e-4  # of the vibration of the gaps, below which nothing is made of it
MOST_ROWS = 400  # of a structure, above which its matrices are not solved with for each harmonic
MOST_ROWS_TOGETHER = 100  # of matrices that are solved with in one call: 60 harmonics of them take 10 MB


def ringing(low: HarmonicBalance, x: FloatArray, omega: float) -> Harmonics:
    """Return the few harmonics beyond the judging set at which the contact forces of a solution meet a mode.

    Each harmonic is solved alone, ``q_h = -(Z_h + Bᵀ K B)⁻¹ Bᵀ λ_h``, with the mean stiffness K of the contacts over the period. Where the gaps are
    larger than at the harmonics before and after, a mode lies near.

    Parameters
    ----------
    low
        The problem of the solution.
    x
        Its scaled unknowns.
    omega
        Frequency, rad/s.

    Returns
    -------
    tuple of int
        Empty for a structure of over `MOST_ROWS` retained coordinates.
    """
    judged, most = judging_set_of(low), low.linear.most
    step = judged[1] if len(judged) > 1 else 1
    top = step * HIGHEST if most is None else min(step * HIGHEST, most)
    if low.linear.n > MOST_ROWS or top <= judged[-1]:
        return ()
    beyond = tuple(range(judged[-1], top + 1, step))
    enough = replace(low, samples=max(low.samples, SAMPLES_A_HARMONIC * top))
    period = enough.contacts(x, omega)
    gaps = np.abs(np.fft.rfft(period.gap, axis=2)[:, :, 1:]).max(initial=0.0)
    forces = np.fft.rfft(period.force, axis=2)[:, :, list(beyond)]
    if gaps == 0.0 or not np.any(forces):
        return ()
    sizes = _gaps_of_each(low, omega, beyond, harmonic_means(period.blocks)[0], forces)
    return loudest(beyond, sizes / gaps)


def loudest(harmonics: Harmonics, sizes: FloatArray) -> Harmonics:
    """Return the harmonics at which `sizes` are larger than before and after, at most `MOST_RINGING` of them, growing."""
    before, after = sizes[:-1], np.append(sizes[2:], 0.0)
    tops = 1 + np.flatnonzero((sizes[1:] > before) & (sizes[1:] >= after) & (sizes[1:] > FAINTEST_GAP))
    chosen = tops[np.argsort(-sizes[tops])][:MOST_RINGING]
    return tuple(sorted(harmonics[i] for i in chosen))


def _gaps_of_each(
    low: HarmonicBalance, omega: float, harmonics: Harmonics, stiffness: ComplexArray, forces: ComplexArray
) -> FloatArray:
    """Return the largest gap (k,) of each harmonic, solved alone under contact forces (n_contacts, 3, k) with their mean stiffness (n_contacts, 3, 3)."""
    side, rows, count = products(low.linear, (0, *harmonics), omega), low.rows, len(harmonics)
    own = forces.reshape(-1, count).T
    parts = np.zeros((2 * count, low.linear.n))
    rows.add_forces(np.concatenate([own.real, own.imag]), parts)
    pushed = parts[:count] + 1j * parts[count:]
    if low.linear.n <= MOST_ROWS_TOGETHER and not isinstance(side, SparseProduct):
        contacts = with_contacts(np.zeros((low.linear.n, low.linear.n), dtype=complex, order="F"), stiffness, rows)
        moved = _solved_together(np.array([side.block(h) for h in harmonics]) + contacts, pushed)
    else:
        each = zip(harmonics, pushed, strict=True)
        moved = np.array([_solved(with_contacts(side.block(h), stiffness, rows), f) for h, f in each])
    gaps = rows.gaps(np.concatenate([moved.real, moved.imag]))
    sizes = np.hypot(gaps[:count], gaps[count:]).max(axis=1, initial=0.0)
    sizes[np.any(np.isinf(moved), axis=1)] = np.inf
    return np.asarray(sizes)


def _solved_together(matrices: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Return the solutions (k, n) of systems (k, n, n); infinite where one is singular."""
    try:
        return np.asarray(np.linalg.solve(matrices, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.array([_solved(m, f) for m, f in zip(matrices, right, strict=True)])


def _solved(matrix: Matrix, right: ComplexArray) -> ComplexArray:
    """Return the solution (n,) of a system; infinite where it is singular: a mode without damping."""
    try:
        return np.asarray(solved(matrix, right))
    except np.linalg.LinAlgError:
        return np.full_like(right, np.inf)
