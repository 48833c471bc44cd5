"""Test whether a motion in time is periodic, by its change from period to period and the growth of small differences.

The motion is integrated from rest until the harmonics of all gaps repeat or the periods run out. If it does not repeat,
a copy with a perturbation of a millionth is integrated beside it: a growing difference excludes a slow decay. Without
growth, the changes must keep their size for so long that free motions of the structure would have decayed. Every
negative verdict is checked with half the step, and again while half the step changes the motion: too long a step during
impacts also prevents repetition.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.harmonic.linear import LinearSide
from stickslip.response.time.settling import overflowed, period_harmonics
from stickslip.response.time.start import rest
from stickslip.response.time.stepping.contact_step import StepState
from stickslip.response.time.stepping.marcher import MOST_STEPS, ROUGH, Marcher, prepared, with_enough_steps
from stickslip.response.time.stepping.propagator import PeriodicLoad

Told = Literal["periodic", "not periodic", "not known"]
STEPS = 512  # least number of steps in a period
PERIODS, LATER = 48, 12  # integrated periods, or twice as many; number of the last ones that are judged
SOON, CLEARLY = 2 * LATER + 1, 1.2  # periods that suffice if a small difference grows by this factor in each
WINDOW, APART = 24, 48  # length of two compared stretches and their distance, in periods
STAYS, DIED = (
    0.9,
    0.5,
)  # over that distance: least remaining share of lasting changes, largest of the structure's free motion
ALIKE = 0.5  # least share of the changes with half the step, if the step does not cause them
MOST_WORK = 2e6  # largest product of steps in a period with the number of coordinates and gaps
MOST_TURNS = 6  # largest number of periods after which a motion may repeat
REPEATS = 1e-4  # relative change of the gaps' harmonics below which a motion repeats
NEARLY, NOTHING = 1e-3, 1e-9  # such a change below which it nearly repeats, and below which it is rounding
LASTS = 1e-2  # such a change above which a motion does not repeat, if it has not halved since the previous stretch
KICK, KICKED = 1e-6, 8  # perturbation relative to the speeds; periods with it
PARTED = 0.05  # distance relative to the motion above which it is no longer small


@dataclass(frozen=True, eq=False)
class Repetition:
    """Periodicity of a motion from time integration.

    Attributes
    ----------
    motion
        (order + 1, n) harmonics of all coordinates in the last period, m.
    change
        (periods - 1,) relative change of the harmonics of all gaps from period to period.
    every
        Number of excitation periods after which the motion repeats; 0: it does not repeat.
    wander
        Largest relative change of the first harmonic of the outputs between two of the last periods.
    growth
        Growth factor of a small difference in a period; NaN where it was not computed.
    opened
        Share of the last period in which contacts are open, mean over all contacts.
    steps, angle
        Steps in a period, and phase angle per step of the fastest contact that opens or closes, rad.
    kept
        Decay factor per period of the slowest motion of the structure with all contacts stuck; NaN where it was not
        computed.
    finer
        Result with half the step; None where the motion repeats after one period.
    """

    motion: ComplexArray
    change: FloatArray
    every: int
    wander: float
    growth: float
    opened: float
    steps: int
    angle: float
    kept: float = np.nan
    finer: "Repetition | None" = None

    @property
    def periods(self) -> int:
        """Number of integrated periods."""
        return len(self.change) + 1

    @property
    def finite(self) -> bool:
        """Whether the motion did not overflow."""
        return bool(np.all(np.isfinite(self.change)))

    @property
    def alone(self) -> Told:
        """Verdict without the integration with half the step."""
        if self.every == 1:
            return "periodic"
        if self.every:
            return "not periodic"
        grows_or_stays = self.growth > CLEARLY or self._stays
        return "not periodic" if _lasts(self.change) and grows_or_stays else "not known"

    @property
    def _stays(self) -> bool:
        """Whether changes keep their size for so long that free motions of the structure would have decayed."""
        if len(self.change) < 2 * WINDOW + APART - 1 or not self.kept**APART <= DIED:
            return False
        before = self.change[-WINDOW - APART : -APART]
        return bool(self.change[-WINDOW:].max() >= STAYS * before.max())

    @property
    def verdict(self) -> Told:
        """Common verdict of both step lengths; ``not known`` if they differ."""
        return self.alone if self.finer is None or self.agrees else "not known"

    @property
    def agrees(self) -> bool:
        """Whether half the step resolves the contacts and gives the same motion."""
        finer = self.finer
        if finer is None or finer.alone != self.alone:
            return False
        if self.alone == "not known":
            return True
        if finer.angle > ROUGH or self.every:
            return finer.angle <= ROUGH and finer.every > 0
        wander, change = self.wander, self.change[-LATER:].max()
        alike = finer.wander >= ALIKE * wander and finer.change[-LATER:].max() >= ALIKE * change
        return bool(alike)


def repetition(
    structure: LinearSide,
    contacts: Interface,
    load: PeriodicLoad,
    omega: float,
    outputs: IntArray,
    order: int,
    steps: int = STEPS,
) -> Repetition:
    """Test whether the motion from rest becomes periodic; if not, integrate again with half the step, until both agree.

    Parameters
    ----------
    structure, contacts, load
        Any real structure, contacts with a stiffness, and periodic loads.
    omega
        Frequency of the load, rad/s.
    outputs
        Dofs whose first harmonic is monitored.
    order
        Highest harmonic.
    steps
        Smallest number of steps in a period; it is doubled until half the step resolves the impacts, see
        `stickslip.response.time.stepping.marcher`.
    """

    def made(steps: int) -> Marcher:
        return prepared(structure, contacts.gap_operator, contacts.laws, load, omega, steps, contacts.weights)

    # only half the step has to resolve the impacts
    marcher = with_enough_steps(made, rest(structure.n, contacts.laws), steps, 2.0 * ROUGH)
    state = marcher.begun(rest(structure.n, contacts.laws))
    found = _marched(marcher, state, outputs, order)
    while found.every != 1 and found.finite:
        fine = made(2 * marcher.steps)
        state = fine.begun(marcher.end(state))
        finer = _marched(fine, state, outputs, order)
        if finer.every == 1 or not finer.finite:
            return finer
        # a slowly settling motion may repeat only in the second integration
        found = replace(found, every=found.every or finer.every, finer=finer)
        if found.agrees or 2 * fine.steps > _most_steps(fine):
            return found
        marcher, found = fine, finer
    return found


def _most_steps(marcher: Marcher) -> float:
    return min(MOST_STEPS, MOST_WORK / (marcher.n + marcher.k))


def _marched(marcher: Marcher, state: StepState, outputs: IntArray, order: int) -> Repetition:
    """Integrate until the motion repeats, small differences grow, or the periods run out."""
    record, basis, seen = marcher.record(), marcher.modes.basis, _Seen([], [], [])
    every, growth, kept = 0, np.nan, np.nan
    for until in (SOON, PERIODS, 2 * PERIODS):
        every = _period_by_period(marcher, state, seen, basis[outputs], order, until)
        if every or not seen.finite:
            break
        growth = _growth(marcher, state)
        if growth > CLEARLY and _lasts(_changes(seen.gaps, 1)):
            break
        if until > PERIODS:
            kept = marcher.slowest
    if seen.finite:
        marcher.march(state, record)
    change = _changes(seen.gaps, 1) if seen.finite else np.full(len(seen.gaps), np.inf)
    motion = _harmonics(record.motion @ basis.T, order)
    opened = float(np.mean(record.force[:, :, 2] == 0.0))
    return Repetition(motion, change, every, _wander(seen.first), growth, opened, marcher.steps, max(seen.angles), kept)


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """Record of each period.

    It has harmonics of the gaps, first harmonic of the outputs, and angle of the fastest opening contact.
    """

    gaps: list[ComplexArray]
    first: list[ComplexArray]
    angles: list[float]

    @property
    def finite(self) -> bool:
        return bool(self.gaps) and bool(np.all(np.isfinite(self.gaps[-1])))


def _period_by_period(marcher: Marcher, state: StepState, seen: _Seen, rows: FloatArray, order: int, most: int) -> int:
    """Integrate up to `most` periods or until the motion repeats.

    Return the number of periods after which it does, or 0.
    """
    record = marcher.record()
    while len(seen.gaps) < most:
        lost = marcher.march(state, record) < 0 or overflowed(state.x, record.motion)
        gaps = _harmonics(record.gap.reshape(marcher.steps, -1), order)
        seen.gaps.append(np.full_like(gaps, np.nan) if lost else gaps)
        seen.angles.append(marcher.turn(record))
        seen.first.append(_harmonics(record.motion @ rows.T, 1)[1])
        if lost:
            return 0
        if len(seen.gaps) > LATER and (every := _repeats(seen.gaps)):
            return every
    return 0


def _repeats(gaps: Sequence[ComplexArray]) -> int:
    """Return the number of periods after which a motion repeats; 0: it does not.

    Several periods count only if the change from one to the next persists. In a decaying subharmonic motion, the change
    over two periods is also smaller than over one, but both decay.
    """
    single = float(_changes(gaps[-5:], 1).max())
    if single < REPEATS:
        return 1
    if len(gaps) < LATER + 4 + MOST_TURNS:
        return 0
    before = gaps[:-LATER]
    if single <= max(LASTS, STAYS * _changes(before[-5:], 1).max()):
        return 0
    near = {m: _changes(gaps[-4 - m :], m).max() for m in range(2, MOST_TURNS + 1)}
    found = next((m for m, change in near.items() if change < REPEATS), 0)
    if not found or near[found] > max(DIED * _changes(before[-4 - found :], found).max(), NOTHING):
        return 0
    # before the motion has settled, a multiple of the period may match better
    return next(m for m, change in near.items() if found % m == 0 and change < NEARLY)


def _growth(marcher: Marcher, state: StepState) -> float:
    """Return the growth factor per period of the distance of a perturbed copy while it is small.

    The largest distances in each half of the periods are compared, since a distance may oscillate between displacement
    and speed.
    """
    n, record = marcher.n, marcher.record()
    own, other = (StepState(state.x.copy(), state.seen.copy(), state.law.copy(), state.status.copy()) for _ in range(2))
    other.x[n : 2 * n] += KICK * np.abs(state.x[n : 2 * n]).max() * np.cos(2.4 * np.arange(n))
    size = float(np.linalg.norm(state.x[: 2 * n]))
    apart: list[float] = []
    while len(apart) < KICKED and not (apart and apart[-1] > PARTED):
        for one in (own, other):
            if marcher.march(one, record) < 0:
                return np.inf
        apart.append(float(np.linalg.norm(other.x[: 2 * n] - own.x[: 2 * n])) / size)
    half = len(apart) // 2
    if half == 0 or max(apart[:-half]) == 0.0:
        return np.inf if apart[-1] > PARTED else 0.0
    return float((max(apart[-half:]) / max(apart[:-half])) ** (1.0 / half))


def _harmonics(samples: FloatArray, order: int) -> ComplexArray:
    return period_harmonics(samples[-1], samples, order)


def _changes(gaps: Sequence[ComplexArray], turns: int) -> FloatArray:
    """Return the changes over `turns` periods, relative to the vibration."""
    size = max(*(float(np.linalg.norm(g[1:])) for g in gaps), np.finfo(float).tiny)
    return np.array([float(np.linalg.norm(b - a)) / size for a, b in zip(gaps, gaps[turns:], strict=False)])


def _lasts(change: FloatArray) -> bool:
    last = float(np.max(change[-LATER:], initial=0.0))
    before = float(np.max(change[-2 * LATER : -LATER], initial=0.0))
    return np.isfinite(last) and last > LASTS and last > 0.5 * before


def _wander(first: Sequence[ComplexArray]) -> float:
    last = np.array(first[-LATER:])
    size = float(np.linalg.norm(last, axis=1).max())
    moved = np.linalg.norm(np.diff(last, axis=0), axis=1)
    return float(np.max(moved, initial=0.0)) / size if size > 0.0 else 0.0
