"""One planar Coulomb contact whose gaps are given over the period: stick, slip and open with located events.

Forces are T = K (x - s) along the tangents with K = diag(k_t, k_w), N = max(0, preload - k_n g_n) along the normal and |T| <= L = mu N.
While it sticks the slider s rests. While it slips T = L e(θ), and the slider moves along the force, s' = λ e with λ >= 0: the condition
|T| = L gives

    λ = (e·K x' - L') / (e·K e),    L θ' = e⊥·K (x' - λ e).

θ is integrated by DOP853; slip ends where λ falls to zero or where the contact opens. Where the contact closes again, L = 0 and the equation
is singular: the force grows as T = L e with x' = (λ + L' K⁻¹) e and |e| = 1 or, if |K x'| <= L', it sticks. Periods are marched until the
state repeats. Before τ = 0 the spring is unstretched at zero displacement, and x(0) is reached while N grows from zero, both in proportion;
with one stiffness that is the return along the radius of the disc. τ = ω t, and all derivatives are by τ.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

STICK, SLIP, OPEN = "stick", "slip", "open"
PERIOD = 2.0 * np.pi
PANEL = PERIOD / 64  # longest step of an integration, and longest panel of a quadrature
CELL = PERIOD / 2048  # of the grid on which changes of the state are searched
FAINT = 1e-6  # share of the largest limit below which the slip equation is not integrated: forces there count 1e-12
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)

State = tuple[str, np.ndarray]  # what the contact does, and T


@dataclass(frozen=True)
class Contact:
    """Parameters of the contact, SI; `k_w` None: as k_t."""

    k_t: float
    k_n: float
    mu: float
    preload: float
    k_w: float | None = None

    @property
    def springs(self) -> np.ndarray:
        """(2,) stiffnesses along t and w."""
        return np.array([self.k_t, self.k_t if self.k_w is None else self.k_w])


@dataclass(frozen=True)
class Judged:
    """The periodic motion.

    `coefficients` (2 order + 1, 3) of T_t, T_w and -N; `events` (τ, from, to) over the last period; `periods` marched, and `distance`:
    how far the last state is from the one that repeats, as a share of the largest limit.
    """

    coefficients: np.ndarray
    events: list[tuple[float, str, str]]
    periods: int
    distance: float


class _Motion:
    """Gaps over τ and what follows from them at once; τ may be an array, then the last axis."""

    def __init__(self, gaps: np.ndarray, contact: Contact) -> None:
        self.mean, self.c, self.s = gaps[0], gaps[1::2].T, gaps[2::2].T
        self.h = np.arange(1, self.c.shape[1] + 1)
        self.contact, self.k = contact, contact.springs
        self.rates = np.hstack([self.s * self.h, -self.c * self.h])
        self.rates_and_normal = np.vstack([self.rates, np.hstack([self.c[2], self.s[2]])])

    def gap(self, t: Any) -> np.ndarray:
        turn = np.multiply.outer(self.h, t)
        return ((self.c @ np.cos(turn) + self.s @ np.sin(turn)).T + self.mean).T

    def rate(self, t: Any) -> np.ndarray:
        turn = np.multiply.outer(self.h, t)
        return self.rates @ np.concatenate([np.cos(turn), np.sin(turn)])

    def normal(self, t: Any) -> Any:
        return self.contact.preload - self.contact.k_n * self.gap(t)[2]

    def limit(self, t: float) -> float:
        return self.contact.mu * max(0.0, self.normal(t))

    def limit_rate(self, t: float) -> float:
        return float(-self.contact.mu * self.contact.k_n * self.rate(t)[2])

    def multiplier(self, t: Any, angle: Any) -> Any:
        """Return λ."""
        e = np.array([np.cos(angle), np.sin(angle)])
        rate = self.rate(t)
        along = np.sum(e.T * self.k * rate[:2].T, axis=-1)
        grown = -self.contact.mu * self.contact.k_n * rate[2]
        return (along - grown) / np.sum(e.T * e.T * self.k, axis=-1)

    def slip(self, t: float, angle: float) -> tuple[float, float]:
        """Return λ and θ'."""
        turn, contact = self.h * t, self.contact
        x, y, z, normal = self.rates_and_normal @ np.concatenate([np.cos(turn), np.sin(turn)])
        along_x, along_y = np.cos(angle), np.sin(angle)
        k_x, k_y = self.k
        pull = along_x * k_x * x + along_y * k_y * y
        stiff = k_x * along_x**2 + k_y * along_y**2
        multiplier = (pull + contact.mu * contact.k_n * z) / stiff
        across = along_x * k_y * (y - multiplier * along_y) - along_y * k_x * (x - multiplier * along_x)
        limit = contact.mu * (contact.preload - contact.k_n * (self.mean[2] + normal))
        return multiplier, across / max(0.0, limit)


def growing(k: np.ndarray, way: np.ndarray, limit: float) -> np.ndarray | None:
    """Return the direction of a force that grows from nothing to `limit` over `way`; None if it sticks."""
    if np.linalg.norm(k * way) <= limit:
        return None

    def beyond(multiplier: float) -> float:
        return float(np.linalg.norm(k * way / (limit + k * multiplier)) - 1.0)

    most = 2.0 * float(np.linalg.norm(way))
    multiplier = brentq(beyond, 0.0, most, xtol=1e-16 * most, rtol=1e-15)
    e = k * way / (limit + k * multiplier)
    return e / np.linalg.norm(e)


def _zero(f: Callable[[Any], Any], left: float, right: float) -> float:
    """Return where f rises through zero, an end where its value there is zero but for rounding."""
    if f(left) >= 0.0:
        return float(left)
    return float(brentq(f, left, right, xtol=1e-15, rtol=1e-15)) if f(right) > 0.0 else float(right)


def _first_crossing(f: Callable[[Any], Any], begin: float, begun: bool = False, last: float = PERIOD) -> float:
    """Return where f first rises through zero, `last` if nowhere before; with `begun` it is zero at the beginning and leaves it downward."""
    near = begin + 1e-5 * 2.0 ** np.arange(9) if begun else np.array([begin])
    grid = np.concatenate([near, np.arange(near[-1] + CELL, last, CELL), [last]])
    grid = grid[grid <= last]
    values = f(grid)
    above = np.append(np.flatnonzero(values > 0.0), len(grid))[0]
    bent = np.max(np.abs(np.diff(values, 2)), initial=0.0)
    for i in range(1, min(above, len(grid) - 1)):
        if values[i] >= max(values[i - 1], values[i + 1]) and values[i] > -bent:  # it may rise between
            top = minimize_scalar(
                lambda t: -f(t), bounds=(grid[i - 1], grid[i + 1]), method="bounded", options={"xatol": 1e-12}
            )
            if top.fun < 0.0:
                return _zero(f, grid[i - 1], top.x)
    if above == len(grid):
        return last
    if above == 0:
        return begin
    return _zero(f, grid[above - 1], grid[above])


def _first_dip(multiplier: Callable[[Any], Any], begin: float, last: float) -> float:
    """Return where the multiplier of a slip falls below zero, `last` if nowhere: within one step it may fall and come back."""
    near = min(begin + 1e-5, last)
    if multiplier(near) < 0.0:
        return float(brentq(multiplier, begin, near)) if multiplier(begin) > 0.0 else begin
    # where the slip has ended by its event the multiplier is zero but for rounding
    faint = 1e-12 * float(np.max(np.abs(multiplier(np.linspace(begin, last, 9)))))
    return _first_crossing(lambda at: -multiplier(at) - faint, near, last=last)


class _Sums:
    """Fourier integrals of the forces, collected piece by piece."""

    def __init__(self, order: int) -> None:
        self.h = np.arange(1, order + 1)
        self.total = np.zeros((2 * order + 1, 3))

    def add(self, motion: _Motion, force: Callable[[float], np.ndarray], cuts: np.ndarray) -> None:
        for a, b in pairwise(cuts):
            for node, weight in zip(NODES, WEIGHTS, strict=True):
                t = 0.5 * (a + b) + 0.5 * (b - a) * node
                row = np.empty(len(self.total))
                row[0], row[1::2], row[2::2] = 0.5, np.cos(self.h * t), np.sin(self.h * t)
                value = np.append(force(t), -max(0.0, motion.normal(t)))
                self.total += weight * 0.5 * (b - a) / np.pi * np.outer(row, value)


def _panels(a: float, b: float) -> np.ndarray:
    return np.linspace(a, b, max(2, int(np.ceil((b - a) / PANEL)) + 1))


def _open(motion: _Motion, t: float) -> tuple[float, str, np.ndarray]:
    """Return when the contact closes again, what it does then and the direction of the force that grows."""
    closing = _first_crossing(motion.normal, t, begun=True)
    if closing == PERIOD:
        return PERIOD, OPEN, np.zeros(2)
    e = growing(motion.k, motion.rate(closing)[:2], motion.limit_rate(closing))
    return (closing, STICK, np.zeros(2)) if e is None else (closing, SLIP, e)


def _stick(motion: _Motion, t: float, force: np.ndarray, sums: _Sums | None) -> tuple[float, str, np.ndarray]:
    """March over a stick; return its end, what follows and the force there."""
    origin = motion.gap(t)[:2] - force / np.where(motion.k > 0.0, motion.k, 1.0)

    def spring(at: Any) -> np.ndarray:
        return motion.k * (motion.gap(at)[:2].T - origin)

    def beyond(at: Any) -> Any:
        return np.linalg.norm(spring(at), axis=-1) - motion.contact.mu * motion.normal(at)

    on_limit = np.linalg.norm(force) >= motion.limit(t) * (1.0 - 1e-9)
    end = _first_crossing(beyond, t, bool(on_limit))
    if sums is not None:
        sums.add(motion, spring, _panels(t, end))
    return end, STICK if end == PERIOD else SLIP, spring(end)


def _landing(motion: _Motion, t: float, e: np.ndarray, faint: float) -> tuple[float, float]:
    """Return a time shortly behind the closing of the contact and the angle there, by the first term of its series."""
    k, steep = motion.k, motion.limit_rate(t)
    angle = float(np.arctan2(e[1], e[0]))
    behind = min(t + faint / steep, PERIOD)

    def across(at: float, theta: float) -> float:  # L θ' as a function of τ and θ
        d = np.array([np.cos(theta), np.sin(theta)])
        pull = k * motion.rate(at)[:2]
        rest = pull - (d @ pull - motion.limit_rate(at)) / (d @ (k * d)) * k * d
        return float(rest[1] * d[0] - rest[0] * d[1])

    small = 1e-5
    by_time = (across(t + small, angle) - across(t - small, angle)) / (2 * small)
    by_angle = (across(t, angle + small) - across(t, angle - small)) / (2 * small)
    return behind, angle + by_time / (steep - by_angle) * (behind - t)


def _slip(
    motion: _Motion, t: float, angle: float, faint: float, tolerance: float, sums: _Sums | None
) -> tuple[float, str, np.ndarray]:
    """March over a slip; return its end, what follows and the force there."""

    def stops(at: float, y: np.ndarray) -> float:
        return motion.slip(at, y[0])[0]

    stops.terminal, stops.direction = True, -1.0  # type: ignore[attr-defined]
    opens = _first_crossing(lambda at: 0.5 * faint - motion.contact.mu * motion.normal(at), t)
    run = solve_ivp(
        lambda at, y: [motion.slip(at, y[0])[1]],
        (t, opens),
        [angle],
        method="DOP853",
        rtol=tolerance,
        atol=tolerance,
        max_step=PANEL,
        events=stops,
        dense_output=True,
    )
    if not run.success:
        raise RuntimeError(run.message)
    end = _first_dip(lambda at: motion.multiplier(at, run.sol(at)[0]), t, float(run.t[-1]))
    stopped = run.t_events[0].size > 0 or end < run.t[-1]
    angle = float(run.sol(end)[0])
    if sums is not None:

        def force(at: float) -> np.ndarray:
            theta = run.sol(at)[0]
            return motion.limit(at) * np.array([np.cos(theta), np.sin(theta)])

        sums.add(motion, force, np.append(run.t[run.t < end], end))
    after = STICK if stopped else OPEN if end < PERIOD else SLIP
    return end, after, motion.limit(end) * np.array([np.cos(angle), np.sin(angle)])


def _period(
    motion: _Motion, state: State, faint: float, tolerance: float, sums: _Sums | None
) -> tuple[State, list[tuple[float, str, str]]]:
    """March over one period."""
    t, (doing, force), events = 0.0, state, []
    while t < PERIOD:
        before = doing
        if doing == OPEN:
            t, doing, e = _open(motion, t)
            force = np.zeros(2)
            if doing == SLIP:
                events.append((t, before, doing))
                begin = t
                t, angle = _landing(motion, t, e, faint)
                d = np.array([np.cos(angle), np.sin(angle)])
                if sums is not None:
                    sums.add(motion, lambda at, d=d: motion.limit(at) * d, _panels(begin, t))  # type: ignore[misc]
                force = motion.limit(t) * d
                continue
        elif doing == STICK:
            t, doing, force = _stick(motion, t, force, sums)
        else:
            angle = float(np.arctan2(force[1], force[0]))
            t, doing, force = _slip(motion, t, angle, faint, tolerance, sums)
            if doing == OPEN:  # the last FAINT of the limit: it opens where N is zero
                begin, d = t, force / np.linalg.norm(force)
                t = _first_crossing(lambda at: -motion.normal(at), t)
                if sums is not None:
                    sums.add(motion, lambda at, d=d: motion.limit(at) * d, _panels(begin, t))  # type: ignore[misc]
                force = np.zeros(2)
        if doing != before:
            events.append((t, before, doing))
    return (doing, force), events


def _begun(motion: _Motion) -> State:
    """Return the state at τ = 0."""
    if motion.normal(0.0) < 0.0:
        return OPEN, np.zeros(2)
    way, limit = motion.gap(0.0)[:2], motion.limit(0.0)
    e = growing(motion.k, way, limit)
    if e is None:
        return STICK, motion.k * way
    sliding = motion.slip(0.0, float(np.arctan2(e[1], e[0])))[0] > 0.0
    return (SLIP if sliding else STICK), limit * e


def judged(
    gaps: np.ndarray,
    contact: Contact,
    order: int | None = None,
    *,
    tolerance: float = 1e-12,
    settled: float = 1e-11,
    max_periods: int = 3000,
) -> Judged:
    """March a contact until it repeats.

    Parameters
    ----------
    gaps
        (2H+1, 3) real Fourier coefficients of the gaps t, w, n: mean, cos τ, sin τ, cos 2τ, ...
    contact
        Its parameters.
    order
        Highest harmonic of the forces; None: H.
    tolerance
        Of the integration of θ.
    settled
        Largest distance from the state that repeats, as a share of the largest limit.

    Raises
    ------
    RuntimeError
        If the state does not repeat within `max_periods`.
    """
    gaps = np.asarray(gaps, dtype=float)
    motion = _Motion(gaps, contact)
    largest = max(motion.limit(t) for t in np.linspace(0.0, PERIOD, 257))
    scale = largest if largest > 0.0 else 1.0
    state, change, distance = _begun(motion), np.inf, np.inf
    for period in range(1, max_periods):
        new, _ = _period(motion, state, FAINT * scale, tolerance, None)
        last, change = change, float(np.linalg.norm(new[1] - state[1])) / scale
        ratio = min(change / last, 0.9999) if last > 0.0 else 0.0
        # the change shrinks by `ratio` a period, so this much is still to come
        distance = change * max(1.0, ratio / (1.0 - ratio)) if np.isfinite(last) else change
        same, state = new[0] == state[0], new
        if same and (change <= 1e-14 or (period > 2 and distance <= settled)):
            break
    else:
        raise RuntimeError(f"does not repeat within {max_periods} periods, distance {distance:.1e}")
    sums = _Sums((len(gaps) - 1) // 2 if order is None else order)
    _, events = _period(motion, state, FAINT * scale, tolerance, sums)
    return Judged(sums.total, events, period + 1, distance)
