"""Whether a motion in time is periodic: its scatter from period to period, and the growth of small differences.

It is marched from rest until the harmonics of all gaps repeat or the periods are spent. Of a motion that does not repeat, a copy that is kicked
by a millionth is marched beside it: if the two part, it is no slow decay. If they do not, the changes must stay as large as they were, where a
motion of the structure alone would have died: a slow decay looks alike for long. All is done once more with half the step before it is told, and
again while that makes the motion another one: what an impact is made of by a step that is too long does not repeat itself either.
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
STEPS = 512  # in a period, at least
PERIODS, LATER = 48, 12  # marched, or twice as many; the last ones are judged
SOON, CLEARLY = 2 * LATER + 1, 1.2  # periods that do where a small difference grows by so much
WINDOW, APART = 24, 48  # periods that are compared, and from one to the other: ...
STAYS, DIED = 0.9, 0.5  # ... least share left of the changes, most of the structure's own motion
ALIKE = 0.5  # least share that half the step leaves of changes that it does not make
MOST_WORK = 2e6  # coordinates and gaps, times steps in a period, that are not passed
MOST_TURNS = 6  # periods after which a motion may repeat itself
REPEATS = 1e-4  # largest change of the gaps' harmonics, of their size, that counts as none ...
NEARLY, NOTHING = 1e-3, 1e-9  # ... as none soon, and as rounding
LASTS = 1e-2  # that counts as one, if it has not become less over the last quarters
KICK, KICKED = 1e-6, 8  # of the speeds; periods
PARTED = 0.05  # distance, of the size of the motion, that is no longer small


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
        Number of periods after which the motion repeats; 0: it does not repeat.
    wander
        Largest relative change of the first harmonic of the outputs between two of the last periods.
    growth
        Growth factor of a small difference in a period; NaN where it was not computed.
    opened
        Share of the time in which contacts are open, in the last period.
    steps, angle
        Steps in a period, and phase angle per step, rad, of the fastest contact that opens or closes.
    kept
        Decay factor per period of the slowest motion of the structure with all contacts stuck; NaN where it was not computed.
    finer
        Result with half the step; None where every period is like the previous one.
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
        """Whether changes last where a motion of the structure would have died."""
        if len(self.change) < 2 * WINDOW + APART - 1 or not self.kept**APART <= DIED:
            return False
        before = self.change[-WINDOW - APART : -APART]
        return bool(self.change[-WINDOW:].max() >= STAYS * before.max())

    @property
    def verdict(self) -> Told:
        """Common verdict of both step lengths, if they agree."""
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
    """Return whether the motion from rest becomes periodic. Otherwise it is integrated again with half the step, until both agree.

    Parameters
    ----------
    structure, contacts, load
        Any real structure, contacts with a stiffness, and periodic loads.
    omega
        rad/s.
    outputs
        Dofs whose first harmonic is watched.
    order
        Highest harmonic.
    steps
        Smallest number of steps in a period, doubled until half the step resolves the impacts, see
        `stickslip.response.time.stepping.marcher`.
    """

    def made(steps: int) -> Marcher:
        return prepared(structure, contacts.gap_operator, contacts.laws, load, omega, steps, contacts.weights)

    # the march with half the step is the one that has to follow the impacts
    marcher = with_enough_steps(made, rest(structure.n, contacts.laws), steps, 2.0 * ROUGH)
    state = marcher.begun(rest(structure.n, contacts.laws))
    found = _marched(marcher, state, outputs, order)
    while found.every != 1 and found.finite:
        fine = made(2 * marcher.steps)
        state = fine.begun(marcher.end(state))
        finer = _marched(fine, state, outputs, order)
        if finer.every == 1 or not finer.finite:
            return finer
        # a motion that settles slowly may come to repeat itself only in the second march
        found = replace(found, every=found.every or finer.every, finer=finer)
        if found.agrees or 2 * fine.steps > _most_steps(fine):
            return found
        marcher, found = fine, finer
    return found


def _most_steps(marcher: Marcher) -> float:
    return min(MOST_STEPS, MOST_WORK / (marcher.n + marcher.k))


def _marched(marcher: Marcher, state: StepState, outputs: IntArray, order: int) -> Repetition:
    """March until the motion repeats itself, small differences are seen to grow, or the periods are spent."""
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
    """Harmonics of the gaps, first harmonic of the outputs, and angle of the fastest contact that opens, of each period."""

    gaps: list[ComplexArray]
    first: list[ComplexArray]
    angles: list[float]

    @property
    def finite(self) -> bool:
        return bool(self.gaps) and bool(np.all(np.isfinite(self.gaps[-1])))


def _period_by_period(marcher: Marcher, state: StepState, seen: _Seen, rows: FloatArray, order: int, most: int) -> int:
    """March until there are so many periods or it repeats itself; return after how many periods it does, 0: it does not."""
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
    """Return the number of periods after which a motion repeats, 0 for none; several only if the motion keeps changing within them.

    A motion that dies at a half of the frequency changes less from two periods to the next two than from one to the next, too, but both alike.
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
    # before all has settled a multiple may be nearer
    return next(m for m, change in near.items() if found % m == 0 and change < NEARLY)


def _growth(marcher: Marcher, state: StepState) -> float:
    """Return the factor by which the distance of a kicked copy grows in a period while it is small.

    Of each half of the periods the largest distance counts: one that merely swings between displacement and speed does not grow.
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
    """Return the changes over so many periods, of the size of the vibration."""
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
