"""Contact laws of the judge's own for `evidence.integrator.verlet`: what a contact does while its gaps go on a straight way over a step.

None of it is shared with the laws of the package, of which only the parameters are read. Sliders are carried as their forces, not as their
places. The limit of friction changes linearly over a step, so that a slider that is caught stays caught until the end of it: the force is
the trial force held between the limits, exactly. A planar slider turns while it slips, ``T' = K (x' - λ e)`` with e = T / |T| and
``λ = (e·K x' - L') / (e·K e)``, which is integrated from the place in the step where it is caught. Laws of Bouc-Wen and Dahl are
differential equations in the gap. Runge-Kutta's classical method does all of these.
"""

# mypy: disallow-untyped-decorators=False

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error

ELASTIC, PLANAR, SLIDERS, BOUC_WEN, DAHL, CUBIC = range(6)
TURNS = 4  # Runge-Kutta steps in a step of the integration, where a planar slider slips
GRAZE = 1e-12  # share of the limit by which a force that is held there may fall below it by rounding


def contact_table(laws: Sequence[Any]) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the (n,) kinds of the laws, their (n, p) parameters and (n, s) states at rest, filled up with zeros.

    Raises
    ------
    InputError
        If a law is none of those known.
    """
    known = [_of(law) for law in laws]
    width = max((len(row) for _, row, _ in known), default=1)
    states = max((size for _, _, size in known), default=1)
    table = np.zeros((len(known), width))
    for row, (_, own, _) in zip(table, known, strict=True):
        row[: len(own)] = own
    return np.array([kind for kind, _, _ in known]), table, np.zeros((len(known), states))


def _of(law: Any) -> tuple[int, list[float], int]:
    """Return kind, parameters and number of states of a law."""
    name = type(law).__name__
    if name == "ElasticCoulomb":
        return ELASTIC, [law.k_t, law.k_w, law.k_n, law.mu, law.preload], 2
    if name == "CoupledCoulomb":
        across = getattr(law, "k_w", None)
        k_w = law.k_t if across is None else across
        return PLANAR, [law.k_t, k_w, law.k_n, law.mu, law.preload], 2
    if name in {"Iwan", "Jenkins"}:
        shares = law.population.sliders() if name == "Iwan" else np.ones((2, 1))
        stiffness, limit = shares[0], law.limit * shares[1]
        row = [len(limit), law.k_n, *law.k_t * stiffness, *law.k_w * stiffness, *limit]
        return SLIDERS, row, 2 * len(limit)
    if name == "BoucWen":
        shape = [law.alpha, law.beta, law.gamma, law.a, law.exponent]
        return BOUC_WEN, [law.k_t, law.k_w, law.k_n, *shape], 2
    if name == "Dahl":
        return DAHL, [law.k_t, law.k_w, law.k_n, law.limit], 2
    if name == "CubicSpring":
        return (CUBIC, [law.k_t, law.k_w, law.k_n, law.cubic_t, law.cubic_w, law.cubic_n], 0)
    raise input_error(
        "evidence.integrator",
        f"has no law {name} of its own",
        "Judge ElasticCoulomb, CoupledCoulomb, Iwan, Jenkins, BoucWen, Dahl or CubicSpring.",
    )


@njit(cache=True)
def _held(force: float, limit: float) -> float:
    return min(max(force, -limit), limit)


@njit(cache=True)
def _planar_rate(t, w, k_t, k_w, move_t, move_w, growth):  # type: ignore[no-untyped-def]
    """Return the rate of a force at its limit; it comes off the limit where λ would fall below zero."""
    size = np.sqrt(t * t + w * w)
    e_t, e_w = t / size, w / size
    push = (e_t * k_t * move_t + e_w * k_w * move_w - growth) / (k_t * e_t * e_t + k_w * e_w * e_w)
    push = max(push, 0.0)
    return k_t * (move_t - push * e_t), k_w * (move_w - push * e_w)


@njit(cache=True)
def _caught(t, w, trial_t, trial_w, limit, growth):  # type: ignore[no-untyped-def]
    """Return the share of the way at which a force that grows linearly from (t, w) meets its limit; one if it does not."""
    d_t, d_w = trial_t - t, trial_w - w
    if trial_t**2 + trial_w**2 <= (limit + growth) ** 2:
        return 1.0
    a = d_t * d_t + d_w * d_w - growth * growth
    b = t * d_t + w * d_w - limit * growth
    c = min(t * t + w * w - limit * limit, 0.0)
    root = np.sqrt(max(b * b - a * c, 0.0))
    if b >= 0.0 and b + root == 0.0:  # at the limit, or beyond it by rounding, and not moved
        return 0.0
    # the only root of a s² + 2 b s + c in 0..1, without cancellation
    share = -c / (b + root) if b >= 0.0 else (root - b) / a
    return min(max(share, 0.0), 1.0)


@njit(cache=True)
def _first_direction(k_t, k_w, move_t, move_w, growth):  # type: ignore[no-untyped-def]
    """Return the direction of a force that grows from zero at its limit: ``K x' = (λ K + L') e`` with |e| = 1."""
    a, b = k_t * move_t, k_w * move_w
    low, high = 0.0, np.sqrt(a * a + b * b) / min(k_t, k_w)
    for _ in range(60):
        push = 0.5 * (low + high)
        e_t, e_w = a / (push * k_t + growth), b / (push * k_w + growth)
        if e_t * e_t + e_w * e_w > 1.0:
            low = push
        else:
            high = push
    size = np.sqrt(e_t * e_t + e_w * e_w)
    return e_t / size, e_w / size


@njit(cache=True)
def _planar(k_t, k_w, move_t, move_w, limit, growth, state):  # type: ignore[no-untyped-def]
    """Move a closed planar slider; the limit goes from `limit` to ``limit + growth`` over the move."""
    t, w = state[0], state[1]
    end = limit + growth
    if limit <= 0.0:
        rate = np.sqrt((k_t * move_t) ** 2 + (k_w * move_w) ** 2)
        state[0], state[1] = k_t * move_t, k_w * move_w
        if rate > growth:
            e_t, e_w = _first_direction(k_t, k_w, move_t, move_w, growth)
            state[0], state[1] = end * e_t, end * e_w
        return
    share = _caught(t, w, t + k_t * move_t, w + k_w * move_w, limit, growth)
    t, w = t + share * k_t * move_t, w + share * k_w * move_w
    if share < 1.0:
        part = (1.0 - share) / TURNS
        h_t, h_w, g = part * move_t, part * move_w, part * growth
        now = limit + share * growth
        for _ in range(TURNS):
            a_t, a_w = _planar_rate(t, w, k_t, k_w, h_t, h_w, g)
            b_t, b_w = _planar_rate(t + 0.5 * a_t, w + 0.5 * a_w, k_t, k_w, h_t, h_w, g)
            c_t, c_w = _planar_rate(t + 0.5 * b_t, w + 0.5 * b_w, k_t, k_w, h_t, h_w, g)
            d_t, d_w = _planar_rate(t + c_t, w + c_w, k_t, k_w, h_t, h_w, g)
            t += (a_t + 2.0 * b_t + 2.0 * c_t + d_t) / 6.0
            w += (a_w + 2.0 * b_w + 2.0 * c_w + d_w) / 6.0
            now += g
            size = np.sqrt(t * t + w * w)
            if size > now * (1.0 - GRAZE):
                t, w = t * now / size, w * now / size
    state[0], state[1] = t, w


@njit(cache=True)
def _pressed(kind, row, before, now, state, force):  # type: ignore[no-untyped-def]
    """Contacts that press: elastic Coulomb along two tangents, or in the plane."""
    k_t, k_w, k_n, mu, preload = row[0], row[1], row[2], row[3], row[4]
    first, last = preload - k_n * before[2], preload - k_n * now[2]
    force[2] = -max(last, 0.0)
    if last <= 0.0:
        state[0] = state[1] = 0.0
    else:
        share = 1.0  # of the way on which it is closed
        if first <= 0.0:
            share = last / (last - first)
            state[0] = state[1] = 0.0
            first = 0.0
        move_t, move_w = share * (now[0] - before[0]), share * (now[1] - before[1])
        if kind == PLANAR:
            _planar(k_t, k_w, move_t, move_w, mu * first, mu * (last - first), state)
        else:
            state[0] = _held(state[0] + k_t * move_t, mu * last)
            state[1] = _held(state[1] + k_w * move_w, mu * last)
    force[0], force[1] = state[0], state[1]


@njit(cache=True)
def _smooth_rate(kind, row, z, move):  # type: ignore[no-untyped-def]
    if kind == DAHL:
        return 1.0 - np.sign(move) * z
    return row[6] - (row[4] * np.sign(z * move) + row[5]) * abs(z) ** row[7]


@njit(cache=True)
def _smooth(kind, row, d, before, now, state, force):  # type: ignore[no-untyped-def]
    """Bouc-Wen's z, or Dahl's force over its limit, over a move along tangent `d`."""
    move = now[d] - before[d]
    if row[d] == 0.0:
        force[d] = 0.0
        return
    scale = row[d] / row[3] if kind == DAHL else 1.0
    h, z = scale * move, state[d]
    a = h * _smooth_rate(kind, row, z, move)
    b = h * _smooth_rate(kind, row, z + 0.5 * a, move)
    c = h * _smooth_rate(kind, row, z + 0.5 * b, move)
    e = h * _smooth_rate(kind, row, z + c, move)
    state[d] = z + (a + 2.0 * b + 2.0 * c + e) / 6.0
    if kind == DAHL:
        force[d] = row[3] * state[d]
    else:
        force[d] = row[d] * (row[3] * now[d] + (1.0 - row[3]) * state[d])


@njit(cache=True)
def advance(kind, row, before, now, state, force):  # type: ignore[no-untyped-def]
    """Move one contact from the gaps `before` to `now` (3,), m; write its state and the force T_t, T_w, -N (3,), N."""
    if kind in (ELASTIC, PLANAR):
        _pressed(kind, row, before, now, state, force)
    elif kind == SLIDERS:
        n = int(row[0])
        for d in range(2):
            force[d] = 0.0
            for i in range(n):
                k = row[2 + d * n + i]
                trial = state[d * n + i] + k * (now[d] - before[d])
                state[d * n + i] = _held(trial, row[2 + 2 * n + i])
                force[d] += state[d * n + i]
        force[2] = row[1] * now[2]
    elif kind == CUBIC:
        for d in range(3):
            force[d] = row[d] * now[d] + row[3 + d] * now[d] ** 3
    else:
        for d in range(2):
            _smooth(kind, row, d, before, now, state, force)
        force[2] = row[2] * now[2]
