"""Curves f(x, p) = 0 that are known in closed form, for continuation."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class At:
    residual: np.ndarray
    jac: np.ndarray
    jac_p: np.ndarray
    seconds_contact: float = 0.0


@dataclass(frozen=True, eq=False)
class Curve:
    """x ↦ f(x, p) with derivatives, for two unknowns: the second one is 1 and gives the first a size to be measured by."""

    f: object
    f_x: object
    f_p: object

    def linearise(self, x, p):
        return At(
            np.array([self.f(x[0], p), x[1] - 1.0]),
            np.array([[self.f_x(x[0], p), 0.0], [0.0, 1.0]], order="F"),
            np.array([self.f_p(x[0], p), 0.0]),
        )


CUBIC = Curve(lambda x, p: p - x**3 + x, lambda x, _: -3 * x * x + 1, lambda _x, _p: 1.0)  # folds at x = ±1/√3


def corner(slope):
    """p = 1 - slope |x|, as contact laws make them; from slope 1 on the branch turns by more than a right angle."""
    return Curve(lambda x, p: p - 1 + slope * abs(x), lambda x, _: slope * (1.0 if x > 0 else -1.0), lambda _x, _p: 1.0)


def wall(x, p):
    """x = 1, and beyond p = 0.5 no number."""
    return x - 1.0 if p < 0.5 else np.nan
