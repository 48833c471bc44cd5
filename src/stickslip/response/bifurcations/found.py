"""Bifurcations found on a branch, their cost, and ranges that were not searched."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.response.forced.problem import ForcedPoint
from stickslip.response.stability.found import Stability
from stickslip.units import HZ, millimetres

BifurcationKind = Literal["fold", "period doubling", "Neimark-Sacker", "branch point", "jump of multipliers"]
LEADS_TO: dict[BifurcationKind, str] = {
    "fold": "the branch turns back",
    "period doubling": "a motion of twice the period leaves",
    "Neimark-Sacker": "a motion of two frequencies leaves",
    "branch point": "a motion of less symmetry leaves",
    "jump of multipliers": "a contact changes its state there and the multipliers jump: no smooth bifurcation",
}


@dataclass(frozen=True, eq=False)
class Bifurcation:
    """A place on a branch where multipliers cross the unit circle, or where it folds.

    Parameters
    ----------
    kind
        What happens there: ``fold``, ``period doubling`` (at -1), ``Neimark-Sacker`` (at an angle), ``branch point`` (at 1 without a fold:
        a branch of less symmetry crosses), ``jump of multipliers`` (over the circle, by a contact that changes its state).
    point
        The solution there, with the harmonics of the branch.
    amplitude
        Of the response there, m.
    multiplier
        That which crosses; of a fold that nearest to 1, of a jump that on the side where it is larger. NaN where none is known.
    multiplier_error
        How far it may be from that of the motion with all harmonics.
    omega_error
        How far the frequency may be off, rad/s: what is left of the bracket, and what the error of the multiplier makes of it. Of a
        fold that is the difference from the same fold with more harmonics.
    before, after
        Number of multipliers outside of the unit circle on either side.
    place
        Positions of the two neighbouring points between which it lies.
    certain
        Whether the multiplier that crosses lies on its side of the circle at both of these points, with its error. A fold is.
    """

    kind: BifurcationKind
    point: ForcedPoint
    amplitude: float
    multiplier: complex
    multiplier_error: float
    omega_error: float
    before: int
    after: int
    place: tuple[int, int]
    certain: bool = True

    @property
    def omega(self) -> float:
        """Its frequency, rad/s."""
        return self.point.omega

    @property
    def multiplicity(self) -> int:
        """Number of multipliers that cross."""
        return abs(self.after - self.before)

    @property
    def beat(self) -> float:
        """Second frequency of what leaves a Neimark-Sacker bifurcation, rad/s, known up to multiples of the first; else 0."""
        if self.kind != "Neimark-Sacker":
            return 0.0
        return float(abs(np.angle(self.multiplier))) / (2.0 * np.pi) * self.omega

    @property
    def sentence(self) -> str:
        """What was found, in words."""
        error = f" ± {self.omega_error / HZ:.2g}" if np.isfinite(self.omega_error) else ""
        m = self.multiplier
        off = f" ± {self.multiplier_error:.2g}" if np.isfinite(self.multiplier_error) else ""
        value = f"{m.real:.5g}" if abs(m.imag) < 1e-6 else f"{m.real:.5g} ± {abs(m.imag):.5g}i"
        known = f", multiplier {value}{' (modulus' + off + ')' if off else ''}" if np.isfinite(m) else ""
        beat = f", second frequency {self.beat / HZ:.5g} Hz" if self.beat else ""
        head, doubt = "", ""
        if not self.certain:
            head = "perhaps a "
            doubt = "; by the error of its multiplier it may lie in another step of the branch, or nowhere"
        return (
            f"{head}{self.kind} at {self.omega / HZ:.6g}{error} Hz: {LEADS_TO[self.kind]}; "
            f"amplitude {millimetres(self.amplitude)}{known}{beat}{doubt}"
        )


@dataclass(frozen=True, eq=False)
class Bifurcations:
    """The bifurcations of a branch.

    Parameters
    ----------
    found
        Along the branch.
    unseen
        First and last frequency of each step in which nothing could be seen, rad/s, and why.
    examined
        Number of motions whose multipliers were asked for.
    stabilities
        What is known of the stability of each point of the branch; None where it was not asked for, or nothing is known.
    stride
        Of how many points one was looked at, and those between where the numbers of multipliers outside differ.
    """

    found: tuple[Bifurcation, ...]
    unseen: tuple[tuple[float, float, str], ...]
    examined: int
    stabilities: tuple[Stability | None, ...] = ()
    stride: int = 1

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was found, and `limits`."""
        return (*(b.sentence for b in self.found), *self.none_met, *self.limits)

    @property
    def none_met(self) -> tuple[str, ...]:
        """That none was met, or nothing; and how many motions of the branch have multipliers that leave it open."""
        known = [s for s in self.stabilities if s is not None]
        open_ = sum(s.verdict == "undecided" for s in known)
        unjudged = f"{open_} of {len(known)} motions could not be judged" if open_ else ""
        if self.found:
            return (unjudged,) * bool(unjudged)
        none = "no bifurcation" if self.examined else "no fold"
        return (f"{none} was met on the branch{', but ' * bool(unjudged)}{unjudged}",)

    @property
    def limits(self) -> tuple[str, ...]:
        """Where nobody looked, and what looking took."""
        told = [
            f"between {a / HZ:.6g} and {b / HZ:.6g} Hz bifurcations are not seen: {why}" for a, b, why in self.unseen
        ]
        if self.examined:
            told.append(f"multipliers of {self.examined} motions were asked for")
        if self.stride > 1:
            told.append(
                f"one in {self.stride} points of the branch was looked at: a loss of stability that ends before the next one is not seen"
            )
        return tuple(told)
