"""Numbers in percent: two digits, three from 100 on, and never an exponent."""

import numpy as np


def percent(share: float, *, unit: bool = True) -> str:
    """Write a fraction in percent with at most three digits; above 1000 % as a bound."""
    value = 100 * share
    if not np.isfinite(value):
        return "-"
    if abs(value) > 1000.0:
        text = "over 1000" if value > 0 else "below -1000"
    elif abs(value) >= 9.95:
        text = f"{value:.0f}"
    else:
        text = _short(value)
    return f"{text} %" if unit else text


def _short(value: float) -> str:
    """Write a number below ten with two digits; below 0.001 as a bound."""
    if abs(value) < 1e-3:
        return "0" if value == 0.0 else "< 0.001"
    digits = max(0, 1 - int(np.floor(np.log10(abs(value)))))
    return f"{value:.{digits}f}".rstrip("0").rstrip(".")
