"""The operating range of a machine, and the distance of resonances from it."""

from dataclasses import dataclass

import numpy as np

from stickslip.errors import input_error
from stickslip.study.analysis import Case
from stickslip.study.file.model.loads import Operation
from stickslip.units import HZ, RPM

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

    def __str__(self) -> str:
        return f"{self.lowest:.5g} to {self.highest:.5g} {self.unit}"


NONE = Operating(np.nan, np.nan, "Hz")


def asked_of(case: Case) -> Operation:
    """Return the table [operation] of a case; an empty one for a case whose tables lack it."""
    found: Operation = getattr(case.settings, "operation", None) or Operation()
    return found


def of_speeds(asked: Operation) -> Operating:
    """Return the operating speeds in rpm; `NONE` if the study has none."""
    if not asked.operating_rpm:
        return NONE
    low, high = asked.operating_rpm
    return Operating(low, high, "rpm")


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
