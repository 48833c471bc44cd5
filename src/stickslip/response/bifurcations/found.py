"""Results of a search for bifurcations: bifurcations, cost, and ranges that were not examined."""

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
    """Point of a branch at which multipliers cross the unit circle, or at which the branch folds.

    Parameters
    ----------
    kind
        ``fold``, ``period doubling`` (crossing at -1), ``Neimark-Sacker`` (crossing at an angle), ``branch point``
        (crossing at 1 without a fold: a branch of less symmetry crosses), or ``jump of multipliers`` (across the
        circle, by a change of a contact state).
    point
        Solution at the bifurcation, with the harmonics of the branch.
    amplitude
        Amplitude of the response, m.
    multiplier
        Crossing multiplier; at a fold the one nearest to 1, at a jump the larger one of both sides. NaN if unknown.
    multiplier_error
        Error bound of the multiplier against the motion with all harmonics.
    omega_error
        Error bound of the frequency, rad/s, from the bracket and from the error of the multiplier; at a fold, the
        difference to the same fold with more harmonics.
    before, after
        Number of multipliers outside the unit circle on either side.
    place
        Positions of the two neighbouring points.
    certain
        Whether the crossing multiplier, with its error, lies on one side of the circle at both points. A fold is
        certain.
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
        """Frequency of the bifurcation, rad/s."""
        return self.point.omega

    @property
    def multiplicity(self) -> int:
        """Number of multipliers that cross."""
        return abs(self.after - self.before)

    @property
    def beat(self) -> float:
        """Second frequency of the motions from a Neimark-Sacker bifurcation, rad/s; otherwise 0.

        It is known up to multiples of the first frequency.
        """
        if self.kind != "Neimark-Sacker":
            return 0.0
        return float(abs(np.angle(self.multiplier))) / (2.0 * np.pi) * self.omega

    @property
    def sentence(self) -> str:
        """Description of the bifurcation."""
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
    """Bifurcations of a branch.

    Parameters
    ----------
    found
        Bifurcations in the order of the branch.
    unseen
        First and last frequency of each segment that could not be examined, rad/s, and the reason.
    examined
        Number of motions whose multipliers were computed.
    stabilities
        Stability of each point of the branch; None where it was not computed or is unknown.
    stride
        Distance of examined points. Points between two of them are examined where the numbers of multipliers outside
        the circle differ.
    """

    found: tuple[Bifurcation, ...]
    unseen: tuple[tuple[float, float, str], ...]
    examined: int
    stabilities: tuple[Stability | None, ...] = ()
    stride: int = 1

    @property
    def sentences(self) -> tuple[str, ...]:
        """Descriptions of all bifurcations, followed by `limits`."""
        return (*(b.sentence for b in self.found), *self.none_met, *self.limits)

    @property
    def none_met(self) -> tuple[str, ...]:
        """Sentence that no bifurcation was found, with the number of undecided motions; empty if some were found."""
        known = [s for s in self.stabilities if s is not None]
        open_ = sum(s.verdict == "undecided" for s in known)
        unjudged = f"{open_} of {len(known)} motions could not be judged" if open_ else ""
        if self.found:
            return (unjudged,) * bool(unjudged)
        none = "no bifurcation" if self.examined else "no fold"
        return (f"{none} was met on the branch{', but ' * bool(unjudged)}{unjudged}",)

    @property
    def limits(self) -> tuple[str, ...]:
        """Sentences about unexamined segments and about the cost of the examination."""
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
