"""The harmonics against which a solution is judged (judging set).

The set consists of the multiples of the common divisor up to three times the highest harmonic. An odd force in harmonic
h excites 3 h, an even one 2 h and the mean, and a product of two harmonics their sum and difference. The set contains
all of these, and all harmonics between them, where a mode may amplify a small force. A contact may respond to a single
kept harmonic, because of its position in the mode shape or the wave number of a wheel. A solution is exact if no force
acts on any harmonic of this set; no smaller set, and no property of a contact law, proves it. Beyond the set, a small
contact force may cause a large motion at a resonance; `ringing` finds these harmonics.
"""

from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from math import gcd

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.contact.product import harmonic_means
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.factors import solved, with_contacts
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.matrix_products import products
from stickslip.harmonic.sparse_stiffness import SparseProduct

JUDGED_MULTIPLE = 3  # highest harmonic of a judging set over the highest that is kept or driven
HIGHEST = 63  # multiples of the common divisor up to which resonances are searched: beyond, time integration costs less
SAMPLES_A_HARMONIC = 8  # of the contact forces, at least: with fewer, aliasing may hide a force
# error of a solution that is not proved exact, although its prediction is zero; only exact solutions have the error 0
UNSEEN = float(np.finfo(float).tiny)


def judging_set(kept: Iterable[int], driven: Iterable[int] = ()) -> Harmonics:
    """Return the multiples of the common divisor of all kept and excited harmonics, from 0 to three times the largest.

    Parameters
    ----------
    kept
        Harmonics of the solution.
    driven
        Harmonics of the load.
    """
    own = {*kept, *driven} - {0}
    return tuple(range(0, JUDGED_MULTIPLE * max(own, default=0) + 1, gcd(*own) or 1))


def judging_indices(driven: Iterable[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    """Return the combined frequencies j ω1 + k ω2 that a nonlinear force excites first.

    For any driven a and b these are 2a, 3a, a ± b, 2a ± b and a ± 2b. Only one of (j, k) and (−j, −k) is returned, as
    in `half_plane`; (0, 0) is left out.
    """
    own = sorted({*driven} - {(0, 0)})
    fed: set[tuple[int, int]] = set(own)
    for one, other in product(own, own):
        for a, b in ((1, 1), (1, -1), (2, 1), (2, -1), (1, 2), (1, -2)):
            fed.add((a * one[0] + b * other[0], a * one[1] + b * other[1]))
    upper = {(j, k) if k > 0 or (k == 0 and j > 0) else (-j, -k) for j, k in fed}
    return tuple(sorted(upper - {(0, 0)}))


def driven_by(load: HarmonicLoad) -> Harmonics:
    """Return the harmonics above zero of a load."""
    return tuple(h for h in sorted(load.harmonics) if h > 0 and np.any(load.harmonics[h]))


def judging_set_of(low: HarmonicBalance) -> Harmonics:
    """Return the judging set of a periodic problem, from its kept harmonics and the harmonics of its load."""
    return judging_set(low.harmonics, driven_by(low.linear.load))


def judging_balance(low: HarmonicBalance, also: Iterable[int] = ()) -> HarmonicBalance:
    """Return the same problem with the harmonics of its judging set, and enough samples for them.

    A wheel that was condensed for fewer harmonics is limited to these; then `covers` is False.

    Parameters
    ----------
    low
        The problem of the solution.
    also
        Further harmonics, such as those of a repeat.
    """
    most = low.linear.most
    harmonics = tuple(h for h in sorted({*judging_set_of(low), *also}) if most is None or h <= most)
    samples = max(low.samples, SAMPLES_A_HARMONIC * harmonics[-1])
    return replace(low, samples=samples).with_harmonics(harmonics)


def covers(low: HarmonicBalance, high: HarmonicBalance) -> bool:
    """Whether `high` contains the judging set of `low`.

    Only then is a solution of `low` exact if no force acts on the other harmonics of `high`.
    """
    return set(judging_set_of(low)) <= set(high.harmonics)


MAX_RINGING = 4  # harmonics with the largest gaps that are returned
FAINTEST_GAP = 1e-4  # relative to the vibration of the gaps; smaller ones are ignored
MAX_RINGING_ROWS = 400  # size of a structure above which no harmonic is solved
MAX_STACKED_ROWS = 100  # size of matrices that are solved in one call: 60 harmonics of them take 10 MB


def ringing(low: HarmonicBalance, x: FloatArray, omega: float) -> Harmonics:
    """Return the few harmonics beyond the judging set at which the contact forces of a solution excite a resonance.

    Each harmonic is solved alone, ``q_h = -(Z_h + Bᵀ K B)⁻¹ Bᵀ λ_h``, with the mean stiffness K of the contacts over
    the period. A mode is near where the gaps are larger than at the harmonics before and after.

    Parameters
    ----------
    low
        The problem of the solution.
    x
        Scaled unknowns of the solution.
    omega
        Frequency, rad/s.

    Returns
    -------
    tuple of int
        Harmonics; empty for a structure with more than `MAX_RINGING_ROWS` retained coordinates.
    """
    judged, most = judging_set_of(low), low.linear.most
    step = judged[1] if len(judged) > 1 else 1
    top = step * HIGHEST if most is None else min(step * HIGHEST, most)
    if low.linear.n > MAX_RINGING_ROWS or top <= judged[-1]:
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
    """Return the harmonics at which `sizes` have a local maximum, at most `MAX_RINGING` of them, ascending."""
    before, after = sizes[:-1], np.append(sizes[2:], 0.0)
    tops = 1 + np.flatnonzero((sizes[1:] > before) & (sizes[1:] >= after) & (sizes[1:] > FAINTEST_GAP))
    chosen = tops[np.argsort(-sizes[tops])][:MAX_RINGING]
    return tuple(sorted(harmonics[i] for i in chosen))


def _gaps_of_each(
    low: HarmonicBalance, omega: float, harmonics: Harmonics, stiffness: ComplexArray, forces: ComplexArray
) -> FloatArray:
    """Return the largest gap (k,) of each harmonic, solved alone.

    The contact forces are (n_contacts, 3, k), their mean stiffness (n_contacts, 3, 3).
    """
    side, rows, count = products(low.linear, (0, *harmonics), omega), low.rows, len(harmonics)
    own = forces.reshape(-1, count).T
    parts = np.zeros((2 * count, low.linear.n))
    rows.add_forces(np.concatenate([own.real, own.imag]), parts)
    pushed = parts[:count] + 1j * parts[count:]
    if isinstance(side, SparseProduct):
        each = zip(harmonics, pushed, strict=True)
        moved = np.array([_solved(with_contacts(side.block(h), stiffness, rows), f) for h, f in each])
    else:
        contacts = with_contacts(np.zeros((low.linear.n, low.linear.n), dtype=complex, order="F"), stiffness, rows)
        if low.linear.n <= MAX_STACKED_ROWS:
            moved = _solved_together(np.array([side.block(h) for h in harmonics]) + contacts, pushed)
        else:
            moved = np.array([_solved(side.block(h) + contacts, f) for h, f in zip(harmonics, pushed, strict=True)])
    gaps = rows.gaps(np.concatenate([moved.real, moved.imag]))
    sizes = np.hypot(gaps[:count], gaps[count:]).max(axis=1, initial=0.0)
    sizes[np.any(np.isinf(moved), axis=1)] = np.inf
    return np.asarray(sizes)


def _solved_together(matrices: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Return the solutions (k, n) of systems (k, n, n); infinite for singular ones."""
    try:
        return np.asarray(np.linalg.solve(matrices, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.array([_solved(m, f) for m, f in zip(matrices, right, strict=True)])


def _solved(matrix: Matrix, right: ComplexArray) -> ComplexArray:
    """Return the solution (n,) of a system; infinite if it is singular, at a resonance without damping."""
    try:
        return np.asarray(solved(matrix, right))
    except np.linalg.LinAlgError:
        return np.full_like(right, np.inf)
