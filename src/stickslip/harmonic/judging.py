"""The harmonics towards which a solution is judged: all multiples of their common divisor up to three times the highest.

A force that is odd in one harmonic h answers in 3 h, one that is even in 2 h and in the mean; a product of two harmonics in their sum and their
difference. All of these are in the set, and so is what lies between them, where a mode may make much of a small force. A contact may see one kept
harmonic alone, by its place in the shape or by the wave of a wheel. A solution is exact if nothing acts on any harmonic of this set; no other
set, and no name of a law, tells so.
"""

from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from math import gcd

import numpy as np

from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics

REACH = 3  # highest harmonic of a judging set over the highest that is kept or driven
HIGHEST = 63  # harmonic, in multiples of the common divisor, beyond which nothing is looked for: there a motion in time costs less
SAMPLES_A_HARMONIC = 8  # of the contact forces at least: with fewer, aliasing may hide what acts
# error of a solution that is not known to be exact, and that a prediction leaves as it is: `exact` is 0, and nothing else is
UNSEEN = float(np.finfo(float).tiny)


def judging_set(kept: Iterable[int], driven: Iterable[int] = ()) -> Harmonics:
    """Return all multiples, 0 among them, of the common divisor of the harmonics that are kept or driven, up to three times the largest.

    Parameters
    ----------
    kept
        Harmonics of the solution.
    driven
        Harmonics that the load acts in.
    """
    own = {*kept, *driven} - {0}
    return tuple(range(0, REACH * max(own, default=0) + 1, gcd(*own) or 1))


def judging_indices(driven: Iterable[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    """Return the combined frequencies j ω1 + k ω2 that a nonlinear force of driven ones may feed first: 2a, 3a, a ± b, 2a ± b and a ± 2b of any a and b.

    Of (j, k) and (−j, −k) one is returned, as `half_plane` orders them; (0, 0) is not.
    """
    own = sorted({*driven} - {(0, 0)})
    fed: set[tuple[int, int]] = set(own)
    for one, other in product(own, own):
        for a, b in ((1, 1), (1, -1), (2, 1), (2, -1), (1, 2), (1, -2)):
            fed.add((a * one[0] + b * other[0], a * one[1] + b * other[1]))
    upper = {(j, k) if k > 0 or (k == 0 and j > 0) else (-j, -k) for j, k in fed}
    return tuple(sorted(upper - {(0, 0)}))


def driven_by(load: HarmonicLoad) -> Harmonics:
    """Return the harmonics above zero that a load acts in."""
    return tuple(h for h in sorted(load.harmonics) if h > 0 and np.any(load.harmonics[h]))


def judging_set_of(low: HarmonicBalance) -> Harmonics:
    """Return the judging set of a periodic problem: of the harmonics that it keeps and of those of its load."""
    return judging_set(low.harmonics, driven_by(low.linear.load))


def judging_balance(low: HarmonicBalance, also: Iterable[int] = ()) -> HarmonicBalance:
    """Return the same problem with its judging set, with samples enough for it.

    Of a wheel that was condensed for few harmonics these alone are left: `covers` says no then.

    Parameters
    ----------
    low
        The problem of the solution.
    also
        Further harmonics, such as those with which it would be solved next.
    """
    most = low.linear.most
    harmonics = tuple(h for h in sorted({*judging_set_of(low), *also}) if most is None or h <= most)
    samples = max(low.samples, SAMPLES_A_HARMONIC * harmonics[-1])
    return replace(low, samples=samples).with_harmonics(harmonics)


def covers(low: HarmonicBalance, high: HarmonicBalance) -> bool:
    """Whether `high` holds the judging set of `low`: only then does its silence make a solution exact."""
    return set(judging_set_of(low)) <= set(high.harmonics)
