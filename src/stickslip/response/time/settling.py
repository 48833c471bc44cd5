"""Harmonics of a period in time, and the test whether the motion has become periodic.

A motion is periodic by its change from period to period and the growth of small differences. It is integrated from rest until the
harmonics of all gaps repeat or the periods run out. If it does not repeat, a copy with a perturbation of a millionth is integrated
beside it: a growing difference excludes a slow decay. Without growth, the changes must keep their size for so long that free motions of
the structure would have decayed. Every negative verdict is checked with half the step, and again while half the step changes the
motion: too long a step during impacts also prevents repetition.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.harmonic.linear import LinearSide
from stickslip.response.time.start import rest
from stickslip.response.time.stepping.contact_step import StepState
from stickslip.response.time.stepping.marcher import MOST_STEPS, ROUGH, Marcher, prepared, with_enough_steps
from stickslip.response.time.stepping.propagator import PeriodicLoad

SettlingStatus = Literal["settled", "unsettled", "diverged"]
LONGEST_MEMORY = 1e4  # periods; slowest assumed decay of a structure (damping ratio 1.6e-5)
RINGING = slice(96, None, 32)  # periods after which a motion may be found to ring; a decay by 1 % a period shows in 32
STEADY = (0.8, 1.1)  # largest change of the last stretch over the one before, if neither decay nor growth is seen
OVERFLOW = 1e100  # far above every motion, with a finite square


def overflowed(*arrays: FloatArray) -> bool:
    """Return whether a number is NaN or so large that later computations may overflow."""
    return any(not np.max(np.abs(array), initial=0.0) < OVERFLOW for array in arrays)


def last_third(n: int) -> int:
    """Return the length of the stretch that judges `n` periods: a third, at least four."""
    return max(4, n // 3)


def remaining_change(changes: Sequence[float]) -> float:
    """Estimate the sum of the remaining changes of a sequence that decays per period.

    The largest changes d of two successive stretches, each a third of the record and at least four periods, give the
    decay ratio ρ per period; the remaining sum is ``d ρ / (1 - ρ)``. The stretches grow with the record, so that slow
    beating is recognised. A small last change alone proves nothing: a lightly damped transient that changes by 1e-6 a
    period may still have 1e-3 to go. Without a visible decay, as at the level of rounding, the slowest decay of
    `LONGEST_MEMORY` is assumed.
    """
    late, early = last_changes(changes)
    if np.isnan(late):
        return np.inf
    if late == 0.0:
        return 0.0
    stretch = last_third(len(changes))
    ratio = (late / early) ** (1.0 / stretch) if early > 0.0 else 1.0
    return late * (min(ratio / (1.0 - ratio), LONGEST_MEMORY) if ratio < 1.0 else LONGEST_MEMORY)


def last_changes(changes: Sequence[float]) -> tuple[float, float]:
    """Return the largest changes of the last stretch and of the one before; NaN if the record is too short for two."""
    stretch = last_third(len(changes))
    if len(changes) < 2 * stretch:
        return np.nan, np.nan
    return max(changes[-stretch:]), max(changes[-2 * stretch : -stretch])


def period_harmonics(began: FloatArray, samples: FloatArray, order: int) -> ComplexArray:
    """Return the Fourier coefficients 0..order of a period by the trapezoidal rule, with half weight for each end."""
    period = np.vstack([(began + samples[-1]) / 2, samples[:-1]])
    coefficients = np.fft.rfft(period, axis=0)[: order + 1] * (2.0 / len(period))
    coefficients[0] /= 2.0
    return np.asarray(coefficients)


@dataclass(slots=True)
class Progress:
    """Progress of a time integration; its only state besides the motion."""

    harmonics: ComplexArray  # (n_h + 1, n_outputs) of the last period; NaN before the first
    unknown: FloatArray  # (n,) NaN: unknown drift
    status: SettlingStatus = "unsettled"
    periods: int = 0
    failures: int = 0
    remaining: float = np.inf
    judged: tuple[int, ...] = (1,)  # harmonics that have to settle
    changes: list[float] = field(default_factory=list)  # relative changes of these harmonics
    each: list[ComplexArray] = field(default_factory=list)  # harmonics of every period
    means: list[FloatArray] = field(default_factory=list)  # (n,) mean displacement of every period

    def take_in(self, harmonics: ComplexArray, mean: FloatArray, failures: int, tolerance: float) -> None:
        """Add a period and judge whether the motion has settled."""
        self.harmonics, self.periods, self.failures = (harmonics, self.periods + 1, self.failures + failures)
        self.each.append(harmonics)
        self.means.append(mean)
        if self.periods > 1:
            self.changes.append(self._relative(self.each[-1] - self.each[-2], self.each[-1]))
            self.remaining = remaining_change(self.changes)
            self.status = "settled" if self.remaining < tolerance else "unsettled"

    def goes_on(self, least: int, rings: float = 0.0) -> bool:
        """Whether to continue: not after an overflow, and in a settled or ringing motion only up to `least` periods.

        A motion rings if it stays within `rings` of its average, and its changes neither decay nor grow.
        """
        if self.status == "unsettled":
            return self.periods < least or not self._rings(rings)
        return self.status == "settled" and self.periods < least

    def _rings(self, rings: float) -> bool:
        after = self.periods - RINGING.start
        if rings == 0.0 or after < 0 or after % RINGING.step:
            return False
        return STEADY[0] <= self.decay <= STEADY[1] and self.scatter <= rings

    @property
    def decay(self) -> float:
        """Largest change of the last third over the third before.

        It is NaN without two such stretches or without any change.
        """
        late, early = last_changes(self.changes)
        return late / early if early > 0.0 else np.nan

    @property
    def change(self) -> float:
        """Largest relative change of the judged harmonics over the last four periods."""
        return max(self.changes[-4:], default=np.nan)

    @property
    def average(self) -> ComplexArray:
        """(n_h + 1, n_outputs) harmonics averaged over the last third."""
        last = self.each[-last_third(self.periods) :] or [self.harmonics]
        return np.asarray(np.mean(last, axis=0))

    @property
    def scatter(self) -> float:
        """Largest relative distance of a period's harmonics from the average."""
        average = self.average
        last = self.each[-last_third(self.periods) :]
        return max((self._relative(one - average, average) for one in last), default=np.nan)

    @property
    def drift(self) -> FloatArray:
        """Change of the mean displacement per period over the last third."""
        stretch = min(last_third(self.periods), len(self.means) - 1)
        if stretch < 1:
            return self.unknown
        return (self.means[-1] - self.means[-1 - stretch]) / stretch

    def _relative(self, difference: ComplexArray, size: ComplexArray) -> float:
        """Return the largest judged harmonic of a difference, relative to the reference's largest."""
        own = list(self.judged)
        largest = float(np.max(np.abs(size[own])))
        return float(np.max(np.abs(difference[own]))) / largest if largest > 0.0 else 0.0


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
