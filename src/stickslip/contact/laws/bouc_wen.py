"""Smooth hysteresis of Bouc (1967) and Wen (1976)."""

from dataclasses import dataclass
from typing import ClassVar

import numba
import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import SLIP, STICK, UNCOUPLED_TANGENTS, law_kernel
from stickslip.contact.laws.parameter_checks import check_any_stiffness
from stickslip.contact.laws.quantities import (
    axial_stiffness,
    normal_stiffness,
    tangential_stiffness,
)
from stickslip.errors import input_error
from stickslip.units import check_quantities, quantity

# Gauss-Legendre points and weights on [0, 1] after s = y v², which makes broken powers of s smooth
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_V = 0.5 * (_POINTS + 1.0)
_SQUARES, _FACTORS = _V**2, _WEIGHTS * _V
STEPS = 60  # of Newton's method, which needs five or so
SATURATED = 40.0  # -log(1 - y) above which y = 1 to rounding


@numba.njit(cache=True)
def _beyond_pole(s, n):  # type: ignore[no-untyped-def]
    """Return ``1 / (1 - sⁿ) - 1 / (n (1 - s))``, which is smooth on [0, 1]."""
    e = 1.0 - s
    if n * e < 1e-4:
        a, b = (n - 1.0) / 2.0, (n - 1.0) * (n - 2.0) / 6.0
        return (a + (a * a - b) * e) / n
    whole = -np.expm1(n * np.log1p(-e)) if s > 0.0 else 1.0
    return (n * e - whole) / (n * e * whole)


@numba.njit(cache=True)
def _way_up(p, n):  # type: ignore[no-untyped-def]
    """Return ``∫ ds / (1 - sⁿ)`` from 0 to ``1 - exp(-p)`` and its derivative by p."""
    y = -np.expm1(-p)
    rest = 0.0
    for i in range(_SQUARES.size):
        rest += _FACTORS[i] * _beyond_pole(y * _SQUARES[i], n)
    e = np.exp(-p)
    whole = -np.expm1(n * np.log1p(-e)) if p > 0.0 else 1.0
    return p / n + y * rest, e / whole


@numba.njit(cache=True)
def _way_down(y, n, r):  # type: ignore[no-untyped-def]
    """Return ``∫ ds / (1 + r sⁿ)`` from 0 to y."""
    total = 0.0
    for i in range(_SQUARES.size):
        total += _FACTORS[i] / (1.0 + r * (y * _SQUARES[i]) ** n)
    return y * total


@numba.njit(cache=True)
def loaded(y, u, n):  # type: ignore[no-untyped-def]
    """Solve ``dy/du = 1 - yⁿ`` from y in [0, 1] over u >= 0."""
    p = -np.log1p(-y) if y < 1.0 else SATURATED
    p = min(p, SATURATED)
    target = _way_up(p, n)[0] + u
    if target > SATURATED / n + 1.0:
        return 1.0
    for _ in range(
        STEPS
    ):  # the way is concave in p: from below Newton's method goes up and overshoots at most once
        way, slope = _way_up(p, n)
        step = (target - way) / slope
        p = max(p + step, 0.0)
        if abs(step) <= 1e-15 * (1.0 + p):
            break
    return -np.expm1(-p)


@numba.njit(cache=True)
def unloaded(y, u, n, r):  # type: ignore[no-untyped-def]
    """Solve ``dy/du = -(1 + r yⁿ)`` from y in [0, 1] over u >= 0; where y reaches zero, return it with what is left of u."""
    way = _way_down(y, n, r)
    if u >= way:
        return 0.0, u - way
    target = way - u
    for _ in range(STEPS):  # the way is concave in y, too
        step = (target - _way_down(y, n, r)) * (1.0 + r * y**n)
        y = min(max(y + step, 0.0), 1.0)
        if abs(step) <= 1e-15:
            break
    return y, 0.0


@numba.njit(cache=True)
def advanced(y, u, n, r):  # type: ignore[no-untyped-def]
    """Advance the share y of the limit, signed, by u, signed: return it with its derivatives by u and by its start."""
    if u == 0.0:
        return y, 1.0, 1.0
    sign = 1.0 if u > 0.0 else -1.0
    start, way = sign * y, abs(u)
    if start >= 0.0:
        end = loaded(min(start, 1.0), way, n)
        rate = -np.expm1(n * np.log(end)) if end > 0.0 else 1.0
        before = -np.expm1(n * np.log(start)) if start > 0.0 else 1.0
        return sign * end, rate, (rate / before if before > 0.0 else np.exp(-n * way))
    before = 1.0 + r * (-start) ** n
    below, left = unloaded(-start, way, n, r)
    if left == 0.0:
        rate = 1.0 + r * below**n
        return -sign * below, rate, rate / before
    end = loaded(0.0, left, n)
    rate = -np.expm1(n * np.log(end)) if end > 0.0 else 1.0
    return sign * end, rate, rate / before


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Integrate over the increment; the state is displacement and share of the largest z, of t, then of w."""
    alpha, largest, initial, n, r, k_n = parameters[2:8]
    for d in range(2):
        k, x = parameters[d], displacement[d]
        per_metre = initial / largest
        y, rate, by_start = advanced(state[2 * d + 1], (x - state[2 * d]) * per_metre, n, r)
        slope = rate * per_metre
        inner = (1.0 - alpha) * k * largest
        force[d] = alpha * k * x + inner * y
        new_state[2 * d] = x
        new_state[2 * d + 1] = y
        jac[d, d] = alpha * k + inner * slope
        jac[d, 6 + 2 * d] = -inner * slope
        jac[d, 7 + 2 * d] = inner * by_start
        jac[3 + 2 * d, d] = 1.0
        jac[4 + 2 * d, d] = slope
        jac[4 + 2 * d, 6 + 2 * d] = -slope
        jac[4 + 2 * d, 7 + 2 * d] = by_start
        status[d] = SLIP if rate < 0.5 else STICK
    force[2] = k_n * displacement[2]
    jac[2, 2] = k_n


@dataclass(frozen=True, slots=True, kw_only=True)
class BoucWen:
    """Smooth hysteresis ``T = alpha k x + (1 - alpha) k z``, ``dz = (a - (beta sign(z dx) + gamma) |z|ⁿ) dx`` (Wen 1976).

    Independent of the rate, and integrated exactly over each increment. Acts along t and w, each for itself and with the same shape;
    along n stands a linear spring that also pulls. The largest z is ``(a / (beta + gamma))^(1/n)``. A tangent is said to
    slip where dz/dx has fallen below half of a.

    Parameters
    ----------
    k_t
        Stiffness along t, N/m; times ``alpha + (1 - alpha) a`` at rest.
    beta, gamma
        Shape of the loop, m⁻ⁿ; ``beta > 0`` and ``-beta < gamma <= beta``, without which the law would give energy.
    alpha
        Share of the stiffness left when z no longer grows, 0 to 1.
    a
        dz/dx at z = 0.
    exponent
        n, at least 1: sharpness of the knee; integrated to 1e-7 of the largest z up to 10.
    k_w
        Stiffness along w, N/m.
    k_n
        Stiffness of the linear normal spring, N/m.

    Raises
    ------
    InputError
        If a parameter is not finite or out of its range.
    """

    k_t: float = tangential_stiffness()
    beta: float = quantity("shape of the loop β, m to the power of minus the exponent", above=0)
    gamma: float = quantity("shape of the loop γ, above -β and at most β")
    alpha: float = quantity(
        "share of the stiffness left at the largest force", default=0.0, least=0, most=1
    )
    a: float = quantity("slope of the hysteretic part at zero force", default=1.0, above=0)
    exponent: float = quantity("sharpness of the knee", default=1.0, least=1, most=20)
    k_w: float = axial_stiffness(default=0.0)
    k_n: float = normal_stiffness(default=0.0)

    kernel = law_kernel(_step)
    pairs: ClassVar[int] = UNCOUPLED_TANGENTS

    def __post_init__(self) -> None:
        check_quantities(self)
        check_any_stiffness(self, "k_t", "k_w", "k_n")
        if not -self.beta < self.gamma <= self.beta:
            raise input_error(
                "BoucWen.gamma",
                f"must be above -beta and at most beta = {self.beta}, got {self.gamma}",
                "Outside, the law grows without limit or gives energy.",
            )

    @property
    def limit(self) -> float:
        """Largest force of the hysteretic part along t, N."""
        return (1.0 - self.alpha) * self.k_t * self._largest

    @property
    def _largest(self) -> float:
        return float((self.a / (self.beta + self.gamma)) ** (1.0 / self.exponent))

    def parameters(self) -> FloatArray:
        """Return the (8,) k_t, k_w, alpha, largest z, a, exponent, (beta - gamma) / (beta + gamma) and k_n."""
        ratio = (self.beta - self.gamma) / (self.beta + self.gamma)
        shape = (self.alpha, self._largest, self.a, self.exponent, ratio)
        return np.array([self.k_t, self.k_w, *shape, self.k_n])

    def initial_state(self) -> FloatArray:
        """Return the (4,) displacement and share of the largest z, of t and of w, before t = 0: all zero."""
        return np.zeros(4)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3,) stiffnesses t, w, n at rest, N/m."""
        share = self.alpha + (1.0 - self.alpha) * self.a
        return np.array([share * self.k_t, share * self.k_w, self.k_n])
