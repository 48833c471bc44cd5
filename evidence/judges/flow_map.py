"""Differences of the flow map of a structure with piecewise-linear contacts: what judges multipliers, and shares no code with them.

The motion that is judged is prescribed by its Fourier coefficients. Whatever force makes it a motion of the structure, a disturbance d of
it obeys ``M d̈ + C ḋ + K d + Bᵀ (λ(g + B d) - λ(g)) = 0``, in which that force does not appear. Both contact forces are marched
side by side, each contact with its own mode (open, sticking, slipping forward or backward); steps of the explicit Runge-Kutta method of order
eight by Dormand and Prince end at each change of a mode, which is found by taking the step anew until its end is there.
"""

from dataclasses import dataclass

import numba
import numpy as np
import scipy.linalg
from scipy.integrate._ivp import dop853_coefficients as dop853

from stickslip.arrays import ComplexArray, FloatArray

_A, _B, _C = dop853.A[:12, :12].copy(), dop853.B.copy(), dop853.C[:12].copy()
ANGLE = 0.3  # of the fastest vibration, rad, in a step
SMALL = 1e-7  # disturbance over the vibration
SETTLING = 3  # periods after which the contacts repeat
OPEN, STICK, FORWARD, BACKWARD = 0, 1, 2, 3
LOST = 20000  # steps beyond those of a march without changes, after which it is given up
BISECTIONS = 60
ROUND_OFF = 2e-15
T, W, N, MU, PRELOAD, RESIDUAL, UNILATERAL = range(7)  # columns of the elements


@dataclass(frozen=True, eq=False)
class Judged:
    """A structure, its contacts and a prescribed motion, in the time τ = ωt.

    `stiffness` and `damping` are multiplied by the inverse mass and made dimensionless by ω; `spread` is the acceleration by the contact
    forces; `elements` (n, 7) belong to the contacts `owner`.
    """

    stiffness: FloatArray
    damping: FloatArray
    rows: FloatArray
    spread: FloatArray
    elements: FloatArray
    owner: FloatArray
    polynomials: FloatArray  # (3 n_contacts, m)
    step: float


def judged(
    mass: FloatArray,
    damping: FloatArray,
    stiffness: FloatArray,
    gap_operator: FloatArray,
    elements: list[FloatArray],
    weights: FloatArray,
    gaps: FloatArray,
    omega: float,
) -> Judged:
    """Set a judged motion up: gaps are (2H+1, 3 n_contacts), `elements` one (k, 7) array a contact."""
    inverse = np.linalg.inv(mass)
    owner = np.repeat(np.arange(len(elements)), [len(e) for e in elements])
    rows = np.concatenate([e * [w, w, w, 1.0, w, 1.0, 1.0] for e, w in zip(elements, weights, strict=True)])
    springs = np.zeros(len(gap_operator))
    for c, row in zip(owner, rows, strict=True):
        springs[3 * c : 3 * c + 3] += row[:3]
    stuck = stiffness + gap_operator.T @ (springs[:, None] * gap_operator)
    fastest = np.sqrt(np.max(np.abs(scipy.linalg.eigvals(inverse @ stuck)))) / omega
    order = (len(gaps) - 1) // 2
    per_period = int(np.ceil(2 * np.pi * max(fastest, 8.0 * max(order, 1)) / ANGLE))
    return Judged(
        inverse @ stiffness / omega**2,
        inverse @ damping / omega,
        np.ascontiguousarray(gap_operator),
        inverse @ gap_operator.T / omega**2,
        rows,
        owner,
        np.ascontiguousarray(gaps.T),
        2 * np.pi / per_period,
    )


@numba.njit(cache=True)
def _gaps(polynomials, tau, value, rate):  # type: ignore[no-untyped-def]
    """Fill the prescribed gaps and their rates."""
    for a in range(polynomials.shape[0]):
        value[a] = polynomials[a, 0]
        rate[a] = 0.0
    for h in range(1, (polynomials.shape[1] + 1) // 2):
        c, s = np.cos(h * tau), np.sin(h * tau)
        for a in range(polynomials.shape[0]):
            p, q = polynomials[a, 2 * h - 1], polynomials[a, 2 * h]
            value[a] += p * c + q * s
            rate[a] += h * (q * c - p * s)


@numba.njit(cache=True)
def _pressure(row, g, v):  # type: ignore[no-untyped-def]
    """Return what limits friction, over μ, and its rate."""
    if row[UNILATERAL] == 0.0:
        return row[PRELOAD], 0.0
    return row[PRELOAD] - row[N] * g, -row[N] * v


@numba.njit(cache=True)
def _force(elements, owner, mode, place, x, out):  # type: ignore[no-untyped-def]
    """Fill the contact forces at the gaps x."""
    out[:] = 0.0
    for e in range(elements.shape[0]):
        row, c = elements[e], 3 * owner[e]
        pressure = _pressure(row, x[c + 2], 0.0)[0]
        if row[UNILATERAL] == 0.0:
            out[c + 2] += row[N] * x[c + 2]
        elif mode[e, 2] != OPEN:
            out[c + 2] -= pressure
        for d in range(2):
            if row[d] == 0.0:
                continue
            if mode[e, d] == STICK:
                out[c + d] += row[d] * (x[c + d] - place[e, d])
            elif mode[e, d] == FORWARD:
                out[c + d] += row[MU] * pressure
            elif mode[e, d] == BACKWARD:
                out[c + d] -= row[MU] * pressure


@numba.njit(cache=True)
def _margins(elements, owner, mode, place, x, v, out):  # type: ignore[no-untyped-def]
    """Fill how far each contact is from a change of mode: below zero it is past it."""
    for e in range(elements.shape[0]):
        row, c = elements[e], 3 * owner[e]
        pressure, rise = _pressure(row, x[c + 2], v[c + 2])
        out[e, 2] = 1.0
        if row[UNILATERAL] != 0.0:
            out[e, 2] = -pressure if mode[e, 2] == OPEN else pressure
        for d in range(2):
            out[e, d] = 1.0
            if row[d] == 0.0:
                continue
            if mode[e, d] == STICK:
                out[e, d] = row[MU] * pressure - abs(row[d] * (x[c + d] - place[e, d]))
                # a slider that has just come to rest is at its limit, and off by rounding
                size = row[d] * (abs(x[c + d]) + abs(place[e, d]))
                size += row[MU] * (abs(row[PRELOAD]) + abs(row[N] * x[c + 2]))
                out[e, d] += ROUND_OFF * size
            elif mode[e, d] == FORWARD:
                out[e, d] = row[d] * v[c + d] - row[MU] * rise
            elif mode[e, d] == BACKWARD:
                out[e, d] = -row[d] * v[c + d] - row[MU] * rise


@numba.njit(cache=True)
def _change(elements, owner, mode, place, x, v, e, d):  # type: ignore[no-untyped-def]
    """Change a mode whose margin has come to zero."""
    row, c = elements[e], 3 * owner[e]
    pressure, rise = _pressure(row, x[c + 2], v[c + 2])
    if d == 2 and mode[e, 2] == OPEN:
        mode[e, 2] = STICK
        for t in range(2):
            rate = row[t] * v[c + t]
            mode[e, t] = STICK if abs(rate) <= row[MU] * rise else FORWARD if rate > 0.0 else BACKWARD
            place[e, t] = x[c + t]
    elif d == 2:
        mode[e, :] = OPEN
    elif mode[e, d] == STICK:
        mode[e, d] = FORWARD if x[c + d] > place[e, d] else BACKWARD
    else:
        sign = 1.0 if mode[e, d] == FORWARD else -1.0
        mode[e, d] = STICK
        place[e, d] = x[c + d] - sign * row[MU] * pressure / row[d]


@numba.njit(cache=True)
def _add_product(matrix, vector, factor, out):  # type: ignore[no-untyped-def]
    """Add ``factor * matrix @ vector`` to `out`."""
    for i in range(matrix.shape[0]):
        total = 0.0
        for j in range(matrix.shape[1]):
            total += matrix[i, j] * vector[j]
        out[i] += factor * total


@numba.njit(cache=True)
def _rate(tau, y, model, modes, places, work, out):  # type: ignore[no-untyped-def]
    """Fill the rate of (d, ḋ)."""
    stiffness, damping, rows, spread, elements, owner, polynomials = model
    x, v, first, second = work
    n = stiffness.shape[0]
    _gaps(polynomials, tau, x, v)
    _force(elements, owner, modes[0], places[0], x, first)
    _add_product(rows, y[:n], 1.0, x)
    _force(elements, owner, modes[1], places[1], x, second)
    for c in range(second.size):
        second[c] -= first[c]
    for i in range(n):
        out[i] = y[n + i]
        out[n + i] = 0.0
    _add_product(stiffness, y[:n], -1.0, out[n:])
    _add_product(damping, y[n:], -1.0, out[n:])
    _add_product(spread, second, -1.0, out[n:])


@numba.njit(cache=True)
def _combine(y, h, weights, count, stages, end):  # type: ignore[no-untyped-def]
    """Fill `end` with y and `h` times the weighted sum of the first stages."""
    for k in range(y.size):
        total = 0.0
        for j in range(count):
            total += weights[j] * stages[j, k]
        end[k] = y[k] + h * total


@numba.njit(cache=True)
def _try(tau, h, y, a, b, c, stages, model, modes, places, work, end, margins):  # type: ignore[no-untyped-def]
    """Take a step without a change of modes; fill its end and the margins there; return the smallest margin."""
    rows, elements, owner, polynomials = model[2], model[4], model[5], model[6]
    n = rows.shape[1]
    for i in range(12):
        _combine(y, h, a[i], i, stages, end)
        _rate(tau + c[i] * h, end, model, modes, places, work, stages[i])
    _combine(y, h, b, 12, stages, end)
    x, v = work[0], work[1]
    _gaps(polynomials, tau + h, x, v)
    _margins(elements, owner, modes[0], places[0], x, v, margins[0])
    _add_product(rows, end[:n], 1.0, x)
    _add_product(rows, end[n:], 1.0, v)
    _margins(elements, owner, modes[1], places[1], x, v, margins[1])
    return np.min(margins)


@numba.njit(cache=True)
def _last_before(tau, h, y, a, b, c, stages, model, modes, places, work, end, margins):  # type: ignore[no-untyped-def]
    """Return the shortest step after which a mode has to change; the arrays are those at its end."""
    low, high = 0.0, h
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if _try(tau, middle, y, a, b, c, stages, model, modes, places, work, end, margins) >= 0.0:
            low = middle
        else:
            high = middle
    _try(tau, high, y, a, b, c, stages, model, modes, places, work, end, margins)
    return high


@numba.njit(cache=True)
def _change_all(tau, y, model, modes, places, work, margins):  # type: ignore[no-untyped-def]
    """Change the modes whose margins are below zero, of the prescribed and of the disturbed contacts; return their number."""
    _, _, rows, _, elements, owner, polynomials = model
    n = rows.shape[1]
    x, v = work[0], work[1]
    changes = 0
    for copy in range(2):
        _gaps(polynomials, tau, x, v)
        if copy == 1:
            _add_product(rows, y[:n], 1.0, x)
            _add_product(rows, y[n:], 1.0, v)
        for e in range(elements.shape[0]):
            for d in (2, 0, 1):
                if margins[copy, e, d] < 0.0:
                    _change(elements, owner, modes[copy], places[copy], x, v, e, d)
                    changes += 1
                    if d == 2:
                        break
    return changes


@numba.njit(cache=True)
def _march(begin, finish, step, y, a, b, c, model, modes, places):  # type: ignore[no-untyped-def]
    """March (d, ḋ) and the modes in place; return the number of changes, or -1."""
    rows, elements = model[2], model[4]
    n, wide = rows.shape[1], rows.shape[0]
    work = (np.empty(wide), np.empty(wide), np.empty(wide), np.empty(wide))
    stages, end = np.zeros((12, 2 * n)), np.empty(2 * n)
    margins = np.empty((2, elements.shape[0], 3))
    tau, changes = begin, 0
    for _ in range(LOST + int((finish - begin) / step)):
        if tau >= finish:
            return changes
        h = min(step, finish - tau)
        whole = _try(tau, h, y, a, b, c, stages, model, modes, places, work, end, margins) >= 0.0
        if not whole:
            h = _last_before(tau, h, y, a, b, c, stages, model, modes, places, work, end, margins)
        tau = finish if h == finish - tau else tau + h
        y[:] = end
        if not whole:
            changes += _change_all(tau, y, model, modes, places, work, margins)
    return -1


class FlowMap:
    """The map of disturbances over one period from the time `begin` (rad) on."""

    def __init__(self, case: Judged, begin: float = 0.0) -> None:
        self.case, self.begin = case, begin
        self.model = (case.stiffness, case.damping, case.rows, case.spread, case.elements, case.owner, case.polynomials)
        self.modes, self.places = self._settled()

    def _settled(self) -> tuple[FloatArray, FloatArray]:
        """March the prescribed motion alone until its contacts repeat; return modes and sliders at `begin`."""
        case = self.case
        start = self.begin - 2 * np.pi * SETTLING
        x, v = np.empty(len(case.polynomials)), np.empty(len(case.polynomials))
        _gaps(case.polynomials, start, x, v)
        mode, place = (np.zeros((len(case.elements), 3), dtype=np.int64), np.zeros((len(case.elements), 3)))
        for e, row in enumerate(case.elements):
            own = x[3 * case.owner[e] : 3 * case.owner[e] + 3]
            pressure = _pressure(row, own[2], 0.0)[0]
            if row[UNILATERAL] != 0.0 and pressure < 0.0:
                continue
            mode[e] = STICK
            for d in range(2):
                if row[d] == 0.0:
                    continue
                share = row[RESIDUAL]
                force = row[d] * own[d] if np.isnan(share) else share * row[MU] * pressure
                if abs(force) > row[MU] * pressure:
                    mode[e, d] = FORWARD if force > 0 else BACKWARD
                place[e, d] = own[d] - force / row[d]
        modes, places = np.array([mode, mode]), np.array([place, place])
        still = np.zeros(2 * len(case.stiffness))
        if _march(start, self.begin, case.step, still, _A, _B, _C, self.model, modes, places) < 0:
            raise RuntimeError("the contacts of the prescribed motion change their modes without end")
        modes[1], places[1] = modes[0], places[0]
        return modes, places

    @property
    def sticking(self) -> FloatArray:
        """(k, 2) element and tangent of the sliders that rest at the beginning."""
        return np.argwhere((self.modes[1, :, :2] == STICK) & (self.case.elements[:, :2] != 0.0))

    def image(self, disturbance: FloatArray) -> FloatArray:
        """Return the disturbance (d, ḋ, sliders) a period later."""
        n = len(self.case.stiffness)
        modes, places = self.modes.copy(), self.places.copy()
        own = self.sticking
        y = disturbance[: 2 * n].copy()
        places[1][own[:, 0], own[:, 1]] += disturbance[2 * n :]
        finish = self.begin + 2 * np.pi
        if _march(self.begin, finish, self.case.step, y, _A, _B, _C, self.model, modes, places) < 0:
            raise RuntimeError("a disturbed motion changes its modes without end")
        after = places[1] - places[0]
        return np.concatenate([y, after[own[:, 0], own[:, 1]]])

    def derivative(self, small: float) -> FloatArray:
        """Return the matrix of central differences with disturbances of the size `small` (m)."""
        size = 2 * len(self.case.stiffness) + len(self.sticking)
        both = ((self.image(small * unit), self.image(-small * unit)) for unit in np.eye(size))
        return np.array([(plus - minus) / (2 * small) for plus, minus in both]).T

    def multipliers(self, share: float = SMALL) -> ComplexArray:
        """Return the multipliers, largest first, by disturbances that are a share of the vibration of the gaps."""
        vibration = np.max(np.linalg.norm(self.case.polynomials[:, 1:], axis=1))
        values = np.linalg.eigvals(self.derivative(share * float(vibration)))
        return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])
