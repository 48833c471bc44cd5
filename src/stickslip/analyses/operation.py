"""The operating range of a machine, and the distance of resonances from it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.column import column
from stickslip.errors import input_error
from stickslip.report.quantities import counted
from stickslip.report.section import Card
from stickslip.study.analysis import Case
from stickslip.study.file.model.loads import Operation
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, RPM

SAME_END = 1e-6  # relative difference of equal ends
NAMED = 4  # resonances that a sentence names
MARGIN = "The margin is relative to the nearer end of the range."


@dataclass(frozen=True)
class Operating:
    """Operating range in its own unit.

    Parameters
    ----------
    lowest, highest
        Ends of the range, NaN for none.
    unit
        ``Hz`` or ``rpm``.
    """

    lowest: float
    highest: float
    unit: str

    @property
    def known(self) -> bool:
        """Whether there is a range."""
        return bool(np.isfinite(self.lowest) and np.isfinite(self.highest))

    def margin(self, value: float) -> float:
        """Return the distance of a value from the nearer end, over this end: positive above, negative below, zero inside."""
        if value < self.lowest:
            return value / self.lowest - 1.0
        return max(value / self.highest - 1.0, 0.0)

    def where(self, value: float) -> str:
        """Return the place of a value: ``inside`` or ``5.1 % above``."""
        off = self.margin(value)
        return f"{100 * abs(off):.2g} % {'above' if off > 0 else 'below'}" if off else "inside"

    def beyond(self, low: float, high: float) -> str:
        """Return what lies beyond `low` to `high`, in words; empty for nothing."""
        if self.lowest > high or self.highest < low:
            return "all"
        ends = [f"{self.lowest:.5g} to {low:.5g}"] * (self.lowest < low * (1 - SAME_END))
        ends += [f"{high:.5g} to {self.highest:.5g}"] * (self.highest > high * (1 + SAME_END))
        return f"{' and '.join(ends)} {self.unit}" if ends else ""

    @property
    def name(self) -> str:
        """What the range is, as a noun."""
        return "operating speeds" if self.unit == "rpm" else "operating range"

    def at(self, rpm: float, order: int) -> float:
        """Return the excitation by an engine order at a speed, in the unit of the range."""
        return rpm if self.unit == "rpm" else order * rpm * RPM / HZ

    def __str__(self) -> str:
        return f"{self.lowest:.5g} to {self.highest:.5g} {self.unit}"


@dataclass(frozen=True)
class Met:
    """A resonance that an engine order excites.

    Parameters
    ----------
    name
        Engine order and mode, in words.
    order
        Engine order.
    rpm
        Speed at which they meet.
    """

    name: str
    order: int
    rpm: float


@dataclass(frozen=True, eq=False, kw_only=True)
class InOperation:
    """Operating range of the machine, stored beside the answer."""

    operating_lowest_rpm: float = column("rpm", "lowest operating speed, NaN without one", default=np.nan)
    operating_highest_rpm: float = column("rpm", "highest operating speed", default=np.nan)
    operating_lowest_hz: float | None = column(
        "Hz", "lowest operating frequency of the excitation, where frequencies were given", default=None
    )
    operating_highest_hz: float | None = column("Hz", "highest operating frequency of the excitation", default=None)

    @property
    def operating(self) -> Operating:
        """Operating range as it was given."""
        if self.operating_lowest_hz is not None and self.operating_highest_hz is not None:
            return Operating(self.operating_lowest_hz, self.operating_highest_hz, "Hz")
        return Operating(self.operating_lowest_rpm, self.operating_highest_rpm, "rpm")


def ends_of(asked: Operation) -> dict[str, Any]:
    """Return the fields of `InOperation` from the table of a study."""
    given = {"rpm": asked.operating_rpm, "hz": asked.operating_hz}
    ends = {unit: range_ for unit, range_ in given.items() if range_}
    return {f"operating_{end}_{u}": r[i] for u, r in ends.items() for i, end in enumerate(("lowest", "highest"))}


def of_resonances(own: Operating, met: Sequence[Met], noun: str) -> Iterator[Verdict]:
    """Yield the resonances inside the operating range, or the margin of the nearest one, in words."""
    if not own.known or not met:
        return
    ordered = sorted(met, key=lambda one: abs(own.margin(own.at(one.rpm, one.order))))
    told = [f"{one.name} at {own.at(one.rpm, one.order):.5g} {own.unit}" for one in ordered]
    inside = sum(not own.margin(own.at(one.rpm, one.order)) for one in ordered)
    if inside:
        more = f" and {inside - NAMED} more" if inside > NAMED else ""
        why = f"{counted(inside, noun)} inside the {own.name}, {own}: {', '.join(told[: min(inside, NAMED)])}{more}"
        these = (
            ("this resonance", "its amplitude", "it")
            if inside == 1
            else ("these resonances", "their amplitudes", "them")
        )
        remedy = "The machine runs at {}: judge {}, or shift {}.".format(*these)
        yield Verdict("trusted", why=why, remedy=remedy)
        return
    where = own.where(own.at(ordered[0].rpm, ordered[0].order))
    them = "them" if own.unit == "rpm" else "it"
    why = f"no {noun} lies in the {own.name}, {own}; the nearest is {where} {them}, {told[0]}"
    yield Verdict("trusted", why=why, remedy=MARGIN)


def answered(own: Operating, met: Sequence[Met], noun: str) -> list[Card]:
    """Return the answer about the operating range; none without a range or a resonance."""
    if not own.known or not met:
        return []
    ordered = sorted(met, key=lambda one: abs(own.margin(own.at(one.rpm, one.order))))
    question = f"the {own.name}, {own}"
    where = [own.where(own.at(one.rpm, one.order)) for one in ordered]
    if inside := where.count("inside"):
        names = ", ".join(one.name for one in ordered[: min(inside, NAMED)])
        label = f"{noun}{'s' * (inside > 1)} inside {question}"
        return [Card(str(inside), label, names, question=question, margin=-inside)]
    margin = abs(own.margin(own.at(ordered[0].rpm, ordered[0].order)))
    label = f"margin of the nearest {noun} to {question}"
    return [Card(where[0], label, ordered[0].name, question=question, margin=margin)]


def asked_of(case: Case) -> Operation:
    """Return the table [operation] of a case; an empty one for a case whose tables lack it."""
    found: Operation = getattr(case.settings, "operation", None) or Operation()
    return found


def of_frequencies(asked: Operation, engine_order: int | None) -> tuple[float, float]:
    """Return the operating range in Hz of the excitation; NaN if the study has none.

    Raises
    ------
    InputError
        If speeds are given and no load has an engine order.
    """
    if asked.operating_hz:
        low, high = asked.operating_hz
        return low, high
    if not asked.operating_rpm:
        return np.nan, np.nan
    if not engine_order:
        raise input_error(
            "operation.operating_rpm",
            f"gives speeds ({asked.operating_rpm}), and no load has an engine order that turns them into frequencies",
            "Give operating_hz, the frequencies of the excitation, or load.NAME.engine_order.",
        )
    low, high = (engine_order * rpm * RPM / HZ for rpm in asked.operating_rpm)
    return low, high
