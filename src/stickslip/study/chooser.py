"""What chose the harmonics of a run, in words and as attributes of its result."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.harmonic.selection.strategy import always_kept
from stickslip.harmonic.support import Harmonics
from stickslip.study.harmonics_table import Harmonics as HarmonicsTable
from stickslip.study.harmonics_table import named


def error_text(error: float) -> str:
    """Return a predicted error (a fraction) as text: a linear prediction beyond the motion itself has no digits worth telling."""
    return "over 100 %" if error > 1.0 else f"{100 * error:.2g} %"


@dataclass(frozen=True)
class Chooser:
    """How the harmonics of a run were chosen.

    Parameters
    ----------
    name
        Of the selection.
    single
        Whether each frequency was settled before the next one.
    low, high
        Harmonics of the first passage and of the reference.
    threshold
        Indicator above which more harmonics are asked for; NaN where nothing is decided.
    is_error
        Whether the indicator is the predicted error of the solution, a fraction.
    over
        Labels of the dofs over which an error is taken.
    harmonics
        Harmonics of which it is taken; empty: those that the excitation drives.
    """

    name: str
    single: bool
    low: Harmonics
    high: Harmonics
    threshold: float
    is_error: bool
    over: tuple[str, ...]
    harmonics: tuple[int, ...] = ()

    @property
    def decides(self) -> bool:
        """Whether anything is chosen: not with the same harmonics everywhere."""
        return bool(np.isfinite(self.threshold))

    @property
    def indicator(self) -> str:
        """What the indicator is called."""
        return "predicted error" if self.is_error else "indicator"

    @property
    def limit(self) -> str:
        """The threshold as text, in percent where it is one of an error."""
        return f"{100 * self.threshold:g} %" if self.is_error else f"{self.threshold:g}"

    @property
    def low_name(self) -> str:
        """Harmonics of the first passage as text."""
        return named(self.high if self.name == "always_high" else self.low)

    def shown(self, indicator: float) -> str:
        """Return a value of the indicator as text."""
        if self.is_error:
            return error_text(indicator)
        return "beyond all bounds" if np.isinf(indicator) else f"{indicator:.3g}"

    def attributes(self) -> dict[str, Any]:
        """Return it as attributes of a netCDF file."""
        own: dict[str, Any] = {
            "selection": self.name,
            "passages": "single" if self.single else "double",
            "low_order": self.low[-1],
            "high_order": self.high[-1],
            "low_harmonics": np.array(self.low, dtype=np.int64),
            "high_harmonics": np.array(self.high, dtype=np.int64),
            "selection_threshold": self.threshold,
            "indicator_name": self.indicator,
            "error_over": ", ".join(self.over),
        }
        # the name that results have had from the beginning
        return own | ({"alert_threshold_percent": 100 * self.threshold} if self.is_error else {})

    def lines(self, passages_asked: str) -> list[str]:
        """Say what will be done, a line a thought.

        Parameters
        ----------
        passages_asked
            What the study says under ``passages``.
        """
        low, high = named(self.low), named(self.high)
        if self.name == "always_low":
            return [f"harmonics {low} at every frequency ({self.name})"]
        if self.name == "always_high":
            return [f"harmonics {high} at every frequency ({self.name})"]
        how = (
            "single passage: each frequency is settled before the next one"
            if self.single
            else "double passage: the response with few harmonics first, then what needs more"
        )
        said = [
            f"{self.name} chooses between harmonics {low} and {high}, {self.indicator} above {self.limit}; {how}"
        ]
        if self.is_error:
            of = ", ".join(map(str, self.harmonics)) or "1, which the force drives"
            said.append(f"its error is that of harmonic {of} over {', '.join(self.over)}")
        elif passages_asked == "double":
            said.append(
                f"{self.name} foretells the harmonics of the next frequency or raises them step by step, which needs a single "
                'passage: passages = "double" and alert_threshold_percent are not used'
            )
        return said


def cost_sentence(solved: int, points: int, each: int, high: str) -> str:
    """Say what choosing has cost beside the harmonics of the reference at every frequency.

    Parameters
    ----------
    solved
        Unknowns of all solutions together, those not accepted included.
    points
        Accepted points.
    each
        Unknowns of a solution with the reference's harmonics.
    high
        Those as text.
    """
    everywhere = points * each
    return (
        f"{solved} unknowns were solved in all; H = {high} everywhere would be about {points} points × {each} unknowns = {everywhere} "
        f"(an estimate: as many points, each solved once), so that choosing took {100 * solved / everywhere:.0f} % of it."
    )


def chooser_of(table: HarmonicsTable, over: Sequence[str]) -> Chooser:
    """Return how the harmonics of a study are chosen.

    Parameters
    ----------
    table
        Its table [harmonics].
    over
        Labels of the dofs over which an error is taken.
    """
    strategy = table.strategy
    return Chooser(
        name=table.selection,
        single=table.single,
        low=table.low_harmonics,
        high=table.high_harmonics,
        threshold=float("nan") if always_kept(strategy) else float(strategy.threshold),
        is_error=strategy.verifies,
        over=tuple(over),
        harmonics=tuple(table.alert_harmonics or ()),
    )
