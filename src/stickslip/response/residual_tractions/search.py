"""Smallest and largest amplitude over all slider positions, by adjoint gradients from several starts.

If a slider starts beyond the interval in which it may rest, the motion drags it back to the end. Every start is
therefore admissible. Extremes usually lie at ends of the intervals, which are reached by overshooting: a step goes
along the gradient of each spring, first in full, then in shorter fractions.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.response.residual_tractions.problem import TractionProblem, TractionState
from stickslip.units import check_quantities, quantity

GAIN = 1e-7  # smallest relative change of the amplitude that counts
BEYOND = 4.0  # target of a step from the middle of an interval, in half widths
PLANAR = 2.0  # target of a step in a planar contact, over the distance to the edge
LENGTHS = (1.0, 0.5, 0.2, 0.05, 0.01)  # tried fractions of a step
CLIMBED = 8  # largest number of ascents to each extreme, from the best starts
MOST_STEPS = 30  # of one ascent
ALL_CORNERS = 4  # largest number of springs for which every corner is a start


@dataclass(frozen=True, slots=True, kw_only=True)
class TractionSearch:
    """Options of the search for extremes.

    Parameters
    ----------
    starts
        Number of random starts in addition to the fixed ones: the model's own start, all springs at one end of their
        intervals, all at the other end, and every corner for few springs.
    seed
        Seed of the random numbers.
    """

    starts: int = quantity("random starts", default=4, least=0, usual=10_000)
    seed: int = quantity("seed of the random starts", default=0, least=0)

    def __post_init__(self) -> None:
        check_quantities(self)


@dataclass(frozen=True, eq=False)
class Extremes:
    """Motions with the smallest and the largest amplitude found, and the number of branches."""

    reference: TractionState
    least: TractionState
    most: TractionState
    branches: int = 1


def extremes(reference: TractionState, search: TractionSearch | None, more: Iterable[FloatArray] = ()) -> Extremes:
    """Return the extremes at the frequency of a reference motion.

    Parameters
    ----------
    reference
        The motion from the model's own start.
    search
        Effort of the search; None: from `more` alone.
    more
        Further starts, sliders (n, 2) in m, such as the extremes of a neighbouring frequency.
    """
    problem = reference.problem
    seen: list[TractionState] = []
    given = [(sliders, None) for sliders in (reference.sliders, *more)]
    own = () if search is None else _starts(reference, search)
    for sliders, shares in [*given, *own]:
        begun = problem.solved(sliders, reference.omega, (reference, *seen))
        if begun is not None and shares is not None:  # its friction limits differ from the reference
            again = sliders_at(begun, shares)
            begun = problem.solved(again, reference.omega, (begun, reference)) or begun
        if begun is not None and not any(_same(begun, other) for other in seen):
            seen.append(begun)
    least, most = (_best(seen, sense) for sense in (-1.0, 1.0))
    low = min((_ascended(s, -1.0) for s in least), key=lambda s: s.amplitude, default=reference)
    high = max((_ascended(s, 1.0) for s in most), key=lambda s: s.amplitude, default=reference)
    ends = [e if abs(np.log(e.amplitude / reference.amplitude)) > GAIN else reference for e in (low, high)]
    return Extremes(reference, ends[0], ends[1])


def _best(seen: Sequence[TractionState], sense: float) -> list[TractionState]:
    """Return the starting motions of the ascents to an extreme: the best ones, one of each amplitude."""
    found: list[TractionState] = []
    for state in sorted(seen, key=lambda s: -sense * s.amplitude):
        if all(abs(np.log(state.amplitude / other.amplitude)) > GAIN for other in found):
            found.append(state)
    return found[:CLIMBED]


def _same(one: TractionState, other: TractionState) -> bool:
    """Whether two motions are equal and have the same sticking springs."""
    a, b = one.room, other.room
    if not np.array_equal(a.sticks, b.sticks):
        return False
    size = np.maximum(np.max(np.abs(one.x)), 1e-300)
    return bool(np.max(np.abs(one.x - other.x)) <= 1e-9 * size)


def _starts(reference: TractionState, search: TractionSearch) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield slider positions at the limits, at corners and at random.

    The second array has their shares of the friction limits at t = 0 in the reference.
    """
    problem = reference.problem
    springs = problem.starts.stiffness > 0.0
    count = int(np.count_nonzero(springs))
    signs: Sequence[tuple[float, ...]] = [(1.0,) * count, (-1.0,) * count]
    if 0 < count <= ALL_CORNERS:
        signs = list(product((1.0, -1.0), repeat=count))
    for own in signs if count else ():
        shares = np.zeros(springs.shape)
        shares[springs] = own
        yield sliders_at(reference, shares), shares
    random = np.random.default_rng(search.seed)
    for _ in range(search.starts if count else 0):
        shares = np.zeros(springs.shape)
        shares[springs] = random.uniform(-1.0, 1.0, count)
        yield sliders_at(reference, shares), shares


def sliders_at(state: TractionState, shares: FloatArray) -> FloatArray:
    """Return the sliders (n, 2) that stretch the springs of a motion by shares (n, 2) of their limits at t = 0.

    For a planar contact the shares form a vector, whose length is limited to one.
    """
    problem = state.problem
    starts = problem.starts
    period = problem.at(state.sliders).contacts(state.x, state.omega)
    normal = -period.force[:, 2, 0] / starts.interface.factors
    length = np.hypot(*shares.T)[:, None]
    held = np.where(starts.planar[:, None], shares / np.maximum(length, 1.0), shares)
    stretch = held * starts.limits(normal)[:, None] / np.maximum(starts.stiffness, 1e-300)
    return np.where(starts.stiffness > 0.0, period.gap[:, :2, 0] - stretch, 0.0)


def _ascended(begin: TractionState, sense: float) -> TractionState:
    """Ascend (or descend, with `sense` -1) from a motion until no step changes the amplitude."""
    best = begin
    for _ in range(MOST_STEPS):
        further = _step(best, sense)
        if further is None:
            return best
        best = further
    return best


def _step(state: TractionState, sense: float) -> TractionState | None:
    """Return a better motion; None without one."""
    problem: TractionProblem = state.problem
    room = state.room
    if not np.any(room.sticks & (room.half > 0.0)):
        return None
    inner = state.inside()
    at = problem.solved(inner, state.omega, (state,))
    if at is None:
        return None
    slope = sense * at.gradient()[0]
    slope = np.where(room.sticks, slope, 0.0)
    end = state.farthest(slope)
    if np.sum(slope * (end - inner)) <= GAIN:
        return None
    # a slider beyond the end is dragged back to the new end; in the plane, from far away, it would end elsewhere
    planar = problem.starts.planar[:, None]
    far = np.where(planar, inner + PLANAR * (end - inner), room.middle + BEYOND * (end - room.middle))
    aim = np.where(slope != 0.0, far, inner)
    for share in LENGTHS:
        tried = problem.solved(inner + share * (aim - inner), state.omega, (at, state))
        if tried is not None and sense * np.log(tried.amplitude / state.amplitude) > GAIN:
            return tried
    return None
