"""Records of a comparison, with the tolerance that the printed digits of the reference allow."""

from typing import Any

Record = dict[str, Any]

ROUNDING = 1e-12  # of the reference, added to half a unit of its last digit: both sides are binary fractions


def record(case: str, quantity: str, ours: float, reference: float, tolerance: float, source: str) -> Record:
    """Compare relative to the reference; absolutely where the reference is zero, which the quantity then says."""
    ours, reference = float(ours), float(reference)
    if reference == 0.0:
        quantity, difference = f"{quantity} (absolute)", abs(ours)
    else:
        difference = abs(ours - reference) / abs(reference)
    return {
        "case": case,
        "quantity": quantity,
        "ours": ours,
        "reference": reference,
        "tolerance": float(tolerance),
        "holds": bool(difference <= tolerance),
        "source": source,
    }


def left_out(case: str, reason: str, source: str) -> Record:
    """Return what stands for comparisons that cannot be made on this machine."""
    return {**record(case, reason, 0.0, 0.0, 0.0, source), "quantity": reason, "holds": "left out"}


def digits(case: str, quantity: str, ours: float, printed: str, source: str, least: float = 0.0) -> Record:
    """Compare with a reference as it is printed: half a unit of its last digit is the tolerance, or `least` if that is more.

    `least` is relative: what the reference is good to where that is less than its digits promise.
    """
    reference = float(printed)
    mantissa, _, exponent = printed.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    half_unit = 0.5 * 10.0 ** (int(exponent or 0) - decimals)
    if reference == 0.0:
        return record(case, quantity, ours, 0.0, half_unit, source)
    tolerance = max(half_unit / abs(reference) + ROUNDING, least)
    return record(case, quantity, ours, reference, tolerance, source)


def bound(case: str, quantity: str, ours: float, largest: float, source: str) -> Record:
    """Ask that a number which ought to be zero stays below `largest` in absolute value."""
    return record(case, quantity, ours, 0.0, largest, source)
