"""Floquet multipliers of a motion, their errors, and the verdict."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray

ROUGH = 0.5  # relative error of a multiplier above which it proves no growth
NEUTRAL = 1e-3  # distance of a modulus from 1 up to which it counts as neither growth nor decay
TURNED = 0.1  # share of a multiplier's change that counts as error of the modulus
CLEAR = 2.0  # distance from the real axis, over a multiplier's change, below which a complex pair may become real
# way of a multiplier to the motion with 63 harmonics over its first change: 8 to 85 at three points of stops (evidence.trust, seeds 190007 and 190008)
FURTHER = 20.0

Verdict = Literal["stable", "unstable", "neutral", "undecided"]
ROUNDS_TO_ONE = 5e-4  # distance from 1 below which four digits may show 1
UNIT_TOLERANCE = 1e-6  # distance from 1: far above the rounding of a period, far below the damping of any structure


@dataclass(frozen=True, eq=False)
class Floquet:
    """Multipliers of a periodic motion.

    A multiplier within `UNIT_TOLERANCE` of 1 is neutral and is not judged: it belongs to a family of periodic motions,
    with different residual tractions of sticking contacts or different positions of free bodies. Other multipliers on
    the unit circle belong to undamped vibrations, which neither grow nor decay and count as stable.

    Parameters
    ----------
    multipliers
        (n_states,) eigenvalues of the derivative of the period map, largest first.
    """

    multipliers: ComplexArray

    @property
    def neutral(self) -> int:
        """Number of multipliers that are 1."""
        return int(np.count_nonzero(self._neutral))

    @property
    def ringing(self) -> int:
        """Number of multipliers on the unit circle that are not 1."""
        on = np.abs(np.abs(self.multipliers) - 1.0) <= UNIT_TOLERANCE
        return int(np.count_nonzero(on & ~self._neutral))

    @property
    def growth(self) -> float:
        """Largest modulus of the non-neutral multipliers; 0 without any."""
        return float(np.max(np.abs(self.multipliers[~self._neutral]), initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether no small disturbance grows: the moduli of all non-neutral multipliers are at most 1."""
        return self.growth <= 1.0 + UNIT_TOLERANCE

    @property
    def _neutral(self) -> BoolArray:
        return np.asarray(np.abs(self.multipliers - 1.0) <= UNIT_TOLERANCE)


def floquet(monodromy: FloatArray) -> Floquet:
    """Return the multipliers of a monodromy matrix; NaN where the matrix is NaN, since the motion was lost."""
    if not np.all(np.isfinite(monodromy)):
        return Floquet(np.full(len(monodromy), np.nan, dtype=complex))
    values = np.linalg.eigvals(monodromy)
    return Floquet(np.asarray(values[np.argsort(-np.abs(values), kind="stable")], dtype=complex))


@dataclass(frozen=True, eq=False)
class Stability:
    """Growth or decay of small disturbances of a periodic motion.

    Parameters
    ----------
    floquet
        Multipliers of the states of structure and moving sliders. `resting` sliders have multipliers of 1, which are
        left out.
    errors
        (n_states,) error of each multiplier against the motion with all harmonics: its change with more harmonics and,
        for laws with sampled tangents, with half the step. Not finite where unknown. The step error is underestimated
        where friction stops a light mass within a step (measured: by up to a factor of 20) and where planar contacts
        close into stick (up to 10).
    resting
        Number of tangential springs, planar contacts included, whose sliders rest for the whole period. Each slider is
        a parameter of the motion, not a state.
    grazing
        Number of these that reached their slip limit once and have rested since; the multipliers are one-sided, of the
        sticking side.
    transitions
        Number of transitions located in the period.
    moduli
        (n_states,) errors of the moduli, which are smaller than the errors of the angles since damping determines the
        moduli; None: `errors`.
    work
        Estimated floating-point operations of the computation.
    """

    floquet: Floquet
    errors: FloatArray
    resting: int
    grazing: int
    transitions: int
    moduli: FloatArray | None = None
    work: float = 0.0

    @property
    def error(self) -> float:
        """Largest error of a multiplier."""
        return float(np.max(self.errors, initial=0.0))

    @property
    def verdict(self) -> Verdict:
        """Stable, unstable or neutral; undecided if the error of a modulus reaches the unit circle.

        A multiplier above 1 with an error above half its value proves no growth. Multipliers of 1 within rounding
        belong to families of motions and are not judged. Any other multiplier within `NEUTRAL` of the unit circle,
        error included, is neutral, such as an undamped vibration or the drift of a slider.
        """
        size, errors = self._judged
        if np.any(self._outside):
            return "unstable"
        on = self._reaching
        if not np.any(on):
            return "stable"
        flat = np.abs(size[on] - 1.0) + errors[on] <= NEUTRAL
        return "neutral" if np.all(flat) else "undecided"

    @property
    def settled(self) -> bool:
        """Whether more harmonics cannot change the verdict."""
        verdict = self.verdict
        return verdict in ("stable", "unstable") or (
            verdict == "neutral" and bool(np.all(self._judged[1][self._reaching] <= 0.1 * NEUTRAL))
        )

    @property
    def multiplier(self) -> float:
        """Modulus of the deciding multiplier, see `reason`; 0 if all belong to families, NaN if none is known."""
        return self._decisive[0]

    @property
    def multiplier_error(self) -> float:
        """Error bound of the deciding modulus against the motion with all harmonics."""
        return self._decisive[1]

    @property
    def reason(self) -> str:
        """Basis of the verdict: the deciding multiplier and its error, or the missing information."""
        size, error = self._decisive
        if np.isnan(size):
            return (
                "no multiplier is known: rounding makes more transitions than gaps of these harmonics can have, or a law gave "
                "tangents that are not finite"
            )
        if not np.isfinite(error):
            return f"the largest multiplier has the modulus {size:.4g} with the harmonics solved; its error is not known, as no motion with more harmonics was found nearby"
        said = modulus_text(size, error)
        return {
            "unstable": f"a multiplier of modulus {said} lies outside the unit circle, so a disturbance grows by this factor in a period",
            "stable": f"the largest multiplier that is not neutral has the modulus {said}, so disturbances die",
            "neutral": f"a multiplier of modulus {said} lies on the unit circle, so a disturbance neither grows nor dies",
            "undecided": f"a multiplier of modulus {said} may lie inside or outside the unit circle",
        }[self.verdict]

    @property
    def grows(self) -> bool:
        """Whether a multiplier lies outside the unit circle, without regard to errors."""
        size, _ = self._judged
        return bool(np.any(size > 1.0 + UNIT_TOLERANCE))

    @property
    def _judged(self) -> tuple[FloatArray, FloatArray]:
        """Return the moduli of the judged multipliers, and their errors."""
        off = np.abs(self.floquet.multipliers - 1.0) > UNIT_TOLERANCE
        judged = off | ~(self.errors <= UNIT_TOLERANCE)
        errors = self.errors if self.moduli is None else self.moduli
        return np.abs(self.floquet.multipliers[judged]), errors[judged]

    @property
    def _outside(self) -> BoolArray:
        """Return whether each judged multiplier proves growth."""
        size, errors = self._judged
        return (size - errors > 1.0 + UNIT_TOLERANCE) & (errors <= ROUGH * size)

    @property
    def _reaching(self) -> BoolArray:
        """Return whether each judged multiplier may lie on or outside the unit circle."""
        size, errors = self._judged
        return ~(size + errors < 1.0 - UNIT_TOLERANCE)

    @property
    def _decisive(self) -> tuple[float, float]:
        """Return modulus and error of the largest deciding multiplier."""
        size, errors = self._judged
        of_verdict = next((own for own in (self._outside, self._reaching) if np.any(own)), size >= 0.0)
        if not np.any(of_verdict):
            unknown = np.any(np.isnan(size))
            return (np.nan, np.inf) if unknown else (0.0, 0.0)
        at = np.flatnonzero(of_verdict)[np.argmax(size[of_verdict])]
        return float(size[at]), float(errors[at])

    @property
    def unknown(self) -> bool:
        """Whether no multiplier is known."""
        return bool(np.any(np.isnan(self.floquet.multipliers)))

    @property
    def stable(self) -> bool:
        """Whether every small disturbance is known to decay."""
        return self.verdict == "stable"


def partners(coarse: ComplexArray, fine: ComplexArray) -> ComplexArray:
    """Return the coarse multipliers in the order of the fine ones."""
    apart = np.abs(fine[:, None] - coarse[None, :])
    apart[np.isnan(apart)] = np.inf
    out = np.full_like(fine, np.nan)
    for i, row in enumerate(apart):
        nearest = int(np.argmin(row))
        if row[nearest] < np.inf:
            out[i] = coarse[nearest]
            apart[:, nearest] = np.inf
    return out


def changes(found: ComplexArray, other: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return the changes of multipliers against a less accurate motion, and the resulting errors of their moduli.

    Damping alone determines the modulus of a complex pair until the pair meets on the real axis, or another pair
    elsewhere. The error is therefore twice the change of the modulus, at least the share `TURNED` of the whole change;
    where the pair may meet, it is the whole change.

    Parameters
    ----------
    found, other
        (n,) and (m,) multipliers; missing others count as zero.
    """
    rest = np.zeros(max(0, found.size - other.size))
    theirs = partners(np.append(other, rest), found)
    distance = np.abs(found - theirs)
    moduli = np.maximum(2.0 * np.abs(np.abs(found) - np.abs(theirs)), TURNED * distance)
    may_meet = (np.abs(found.imag) <= CLEAR * distance) | (_nearest(found) <= 2.0 * CLEAR * distance)
    return distance, np.where(may_meet, distance, np.minimum(moduli, distance))


def may_leave(found: ComplexArray, other: ComplexArray) -> bool:
    """Return whether a multiplier inside the unit circle may leave it if it moves `FURTHER` times as far as from a less accurate motion.

    It leaves if it reaches the circle by this way and may meet another multiplier, its conjugate included. Without a
    meeting its modulus stays.

    Parameters
    ----------
    found, other
        (n,) and (m,) multipliers; missing others count as zero.
    """
    distance = changes(found, other)[0]
    inside = np.abs(found) < 1.0 - UNIT_TOLERANCE
    reaches = np.abs(found) + FURTHER * distance >= 1.0
    return bool(np.any(inside & reaches & (_nearest(found) <= 2.0 * FURTHER * distance)))


def _nearest(multipliers: ComplexArray) -> FloatArray:
    """Return the distance of each multiplier from its nearest other one; real ones from real ones do not count."""
    apart = np.abs(multipliers[:, None] - multipliers[None, :])
    real = multipliers.imag == 0.0
    apart[real[:, None] & real[None, :]] = np.inf
    np.fill_diagonal(apart, np.inf)
    return np.asarray(np.min(apart, axis=1, initial=np.inf))


def modulus_text(size: float, error: float = 0.0) -> str:
    """Format a modulus with four digits and its error; close to 1, show its difference from 1, which decides."""
    off = size - 1.0
    text = f"{size:.4g}"
    if 0.0 < abs(off) < ROUNDS_TO_ONE:
        text = f"1 {'-' if off < 0.0 else '+'} {abs(off):.2g}"
    return f"{text} ± {error:.2g}" if error > 0.0 else text
