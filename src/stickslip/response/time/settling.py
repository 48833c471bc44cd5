"""Harmonics of a period in time, and the test whether the motion has become periodic."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray

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
