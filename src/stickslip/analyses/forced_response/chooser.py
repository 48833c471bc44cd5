"""The harmonic selection of a response, in words and as attributes of its dataset."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import BoolArray
from stickslip.assembly.sides.mistuned import listed
from stickslip.harmonic.harmonic_set import Harmonics, named
from stickslip.harmonic.selection.strategy import Strategy, always_kept
from stickslip.harmonic.strategies import STRATEGIES
from stickslip.response.forced.choices import RUNGS
from stickslip.response.forced.collected import Response
from stickslip.response.forced.response import ForcedPoint, Sweep
from stickslip.units import HZ

NAMED = 4  # sets of harmonics that a sentence names


def error_text(error: float) -> str:
    """Return a predicted error (a fraction) as text; above 100 % as ``over 100 %``, since the prediction is linear."""
    return "over 100 %" if error > 1.0 else f"{100 * error:.2g} %"


@dataclass(frozen=True)
class Chooser:
    """The selection of harmonics of a response.

    Parameters
    ----------
    name
        Name of the strategy.
    single
        Whether each frequency gets its final harmonics before the next one.
    low, high
        Harmonics of the first passage and of the reference.
    threshold
        Indicator above which more harmonics are requested; NaN if nothing is chosen.
    is_error
        Whether the indicator is the predicted error of the solution, a fraction.
    over
        Labels of the dofs in the error norm.
    harmonics
        Harmonics in the error norm.
    first
        Harmonics that the first passage uses.
    auto
        Whether harmonics are raised along the branch, up to the highest of `high`.
    """

    name: str
    single: bool
    low: Harmonics
    high: Harmonics
    threshold: float
    is_error: bool
    over: tuple[str, ...]
    harmonics: tuple[int, ...]
    first: Harmonics
    auto: bool = False

    @property
    def decides(self) -> bool:
        """Whether the strategy chooses; false with the same harmonics at every frequency."""
        return bool(np.isfinite(self.threshold))

    @property
    def indicator(self) -> str:
        """Name of the indicator."""
        return "predicted error" if self.is_error else "indicator"

    @property
    def limit(self) -> str:
        """The threshold as text; in percent if it limits an error."""
        return f"{100 * self.threshold:g} %" if self.is_error else f"{self.threshold:g}"

    def shown(self, indicator: float) -> str:
        """Return a value of the indicator as text."""
        if self.is_error:
            return error_text(indicator)
        return "beyond all bounds" if np.isinf(indicator) else f"{indicator:.3g}"

    def attributes(self) -> dict[str, Any]:
        """Return the selection as attributes of a netCDF file: texts, numbers, lists of numbers."""
        own: dict[str, Any] = {
            "selection": self.name,
            "passages": "auto" if self.auto else "single" if self.single else "double",
            "low_order": self.low[-1],
            "high_order": self.high[-1],
            "low_harmonics": list(self.low),
            "high_harmonics": list(self.high),
            "selection_threshold": self.threshold,
            "indicator_name": self.indicator,
            "error_over": listed(self.over),
        }
        # a second name, which results of early versions have
        return own | ({"alert_threshold_percent": 100 * self.threshold} if self.is_error else {})

    def lines(self, passages_asked: str) -> list[str]:
        """Describe the selection before the run, one statement a line.

        Parameters
        ----------
        passages_asked
            Value of the key ``passages``.
        """
        if not self.decides:
            return [f"harmonics {named(self.first)} at every frequency ({self.name})"]
        if self.auto:
            of = ", ".join(map(str, self.harmonics))
            most = f"up to {self.high[-1]}" + ("" if self.high[-1] >= RUNGS[-1] else ", which the study's [limits] set")
            return [
                f"raised from {named(self.low)} {most}, until the {self.indicator} of {self.name} is well below {self.limit}",
                "audited at every tenth point and at the peak",
                f"its error counts harmonic {of} of {listed(self.over)}",
            ]
        how = (
            "single passage: each frequency is settled before the next one"
            if self.single
            else "double passage: the response with few harmonics first, then what needs more"
        )
        said = [
            (
                f"{self.name} chooses between harmonics {named(self.low)} and {named(self.high)}, "
                f"{self.indicator} above {self.limit}"
            ),
            how,
        ]
        if self.is_error:
            of = ", ".join(map(str, self.harmonics))
            said.append(f"its error counts harmonic {of} of {listed(self.over)}")
        elif passages_asked == "double":
            said.append(
                f"{self.name} foretells the harmonics of the next frequency or raises them step by step, which needs a single "
                'passage: passages = "double" and alert_threshold_percent are not used'
            )
        return said

    def sentence(self, response: Response) -> str:
        """State the frequencies of a case at which the strategy requested more harmonics, and the reason.

        An alert is evaluated at the points of the first passage, even if a repeat or a branch with many harmonics has replaced them.
        """
        if not self.is_error or self.auto:
            return f"{_kept(response)}{_audited(response)}."
        passage = [p for p in response.solved if p.stage == "low"]
        said = np.array([p.predicted_error for p in passage])
        if np.all(np.isnan(said)):
            return f"{self.name} was not asked."
        worst, over = int(np.nanargmax(said)), said > self.threshold
        if not np.any(over):
            return (
                f"no frequency needs more harmonics; the largest predicted error is {self.shown(said[worst])}, "
                f"below the threshold of {self.limit}."
            )
        return (
            f"{int(over.sum())} of {len(over)} points repeated with {_more(response, self)} harmonics, at "
            f"{_listed(passage, over)} Hz, because leaving the higher harmonics out was predicted to change the response by "
            f"more than {self.limit} (largest: {self.shown(said[worst])} at {passage[worst].omega / HZ:.2f} Hz)."
        )


def _audited(response: Response) -> str:
    """State the accuracy of the points: solved again with more harmonics, exact, or judged by prediction."""
    every = [a for a in response.accepted if a.point.converged]
    again = [a.audit_error for a in every if not np.isnan(a.audit_error)]
    rest = [a for a in every if np.isnan(a.audit_error)]
    exact = sum(a.exact for a in rest)
    alone = [a.own_error for a in rest if not a.exact and not np.isnan(a.own_error)]
    told = []
    if again:
        told.append(
            f"audits: {_points(len(again))} solved again with more harmonics, which changed the motion by at most "
            f"{error_text(max(again))}"
        )
    if exact:
        told.append(f"{_points(exact)} exact, as no force acts on the harmonics left out")
    if alone:
        told.append(f"{_points(len(alone))} judged by prediction alone, of at most {error_text(max(alone))}")
    return "".join(f"; {text}" for text in told)


def _points(n: int) -> str:
    return f"{n} point{'s' * (n != 1)}"


def chooser_of(sweep: Sweep, over: Sequence[str], driven: Sequence[int]) -> Chooser:
    """Return the selection of harmonics of a sweep.

    Parameters
    ----------
    sweep
        The sweep.
    over
        Labels of the dofs in the error norm.
    driven
        Harmonics of the excitation; the error norm takes these if the sweep names none.
    """
    strategy = sweep.strategy
    decides = always_kept(strategy) is None
    return Chooser(
        name=_name(strategy),
        single=sweep.single,
        low=sweep.low_harmonics,
        high=sweep.high_harmonics,
        threshold=float(strategy.threshold) if decides else float("nan"),
        is_error=decides and strategy.verifies,
        over=tuple(over),
        harmonics=tuple(sweep.error_harmonics or driven),
        first=sweep.first_harmonics,
        auto=sweep.auto,
    )


def _name(strategy: Strategy) -> str:
    """Return the name of a strategy in study files; for one of the user the name of its class."""
    own = type(strategy).__name__
    return next((name for name, (_, known) in STRATEGIES.items() if known == own), own)


def _more(response: Response, chooser: Chooser) -> str:
    """Return the harmonics of the repeats as text."""
    asked = {tuple(p.asked.tolist()) for p in response.solved if p.asked.size} or {chooser.high}
    return named(chooser.high) if asked == {chooser.high} else "more"


def _kept(response: Response) -> str:
    """Count the points with each set of harmonics, the most frequent set first."""
    counts = Counter(named(a.point.harmonics) for a in response.accepted)
    each = [f"H = {own} at {n}" for own, n in counts.most_common(NAMED)]
    rest = sum(counts.values()) - sum(n for _, n in counts.most_common(NAMED))
    also = f" and others at {rest}" if rest else ""
    return f"harmonics kept: {'; '.join(each)}{also} of {len(response.accepted)} points"


def _listed(points: Sequence[ForcedPoint], over: BoolArray) -> str:
    """Return the frequency ranges above the threshold as text."""
    found: list[tuple[float, float]] = []
    inside = False
    for i in np.argsort([p.omega for p in points]):
        hz = points[i].omega / HZ
        if over[i]:
            found = [*found[:-1], (found[-1][0], hz)] if inside else [*found, (hz, hz)]
        inside = bool(over[i])
    return ", ".join(f"{lo:.2f}" if lo == hi else f"{lo:.2f} to {hi:.2f}" for lo, hi in found)
