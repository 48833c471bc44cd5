"""Time integration by central differences (velocity Verlet), for contacts of any kind that `evidence.integrator.hysteresis` knows.

The scheme is explicit in the displacements, so that a contact is moved once a step and nothing is iterated; damping is taken at both ends of
the step. Of second order: the contacts follow straight ways from one end of a step to the other.
"""

# mypy: disallow-untyped-decorators=False

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from numba import njit

from evidence.integrator.hysteresis import advance, contact_table
from evidence.integrator.propagator import PeriodicLoad, dense
from evidence.integrator.settling import Progress, overflowed, period_harmonics
from evidence.integrator.transient import TimeStepping, TransientResult, TransientStart, check_arguments
from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.harmonic.linear import LinearSide, one_structure

LONGEST = 0.2  # of a step times the highest frequency with stuck contacts; 2 is where the scheme explodes
HISTORY = 4  # periods of a given motion over which contacts are marched to learn what they remember


class Scheme(NamedTuple):
    """Matrices of a step of length h, s, and the contacts."""

    h: float
    inertia: FloatArray  # (n, n) inverse mass
    damped: FloatArray  # (n, n) inverse of M + h/2 C
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    gaps: FloatArray  # (3 n_contacts, n)
    loads: FloatArray  # (steps, n) at the ends of the steps of a period
    kind: IntArray
    table: FloatArray


class Record(NamedTuple):
    """A period, at the ends of its steps."""

    motion: FloatArray
    gap: FloatArray
    force: FloatArray


@njit(cache=True)
def _move(kind, table, before, now, states, force):  # type: ignore[no-untyped-def]
    """Move all contacts. Compiled code is kept by file: a change of a law is seen here once this file is newer, too."""
    for c in range(kind.size):
        own = slice(3 * c, 3 * c + 3)
        advance(kind[c], table[c], before[own], now[own], states[c], force[own])


@njit(cache=True)
def _period(scheme, q, v, states, force, every, record):  # type: ignore[no-untyped-def]
    """March over a period; `every` so many steps are written down."""
    h, steps = scheme.h, scheme.loads.shape[0]
    gap = scheme.gaps @ q
    pull = scheme.loads[steps - 1] - scheme.stiffness @ q - scheme.gaps.T @ force
    a = scheme.inertia @ (pull - scheme.damping @ v)
    for i in range(steps):
        q[:] = q + h * v + 0.5 * h * h * a
        now = scheme.gaps @ q
        _move(scheme.kind, scheme.table, gap, now, states, force)
        gap = now
        pull = scheme.loads[i] - scheme.stiffness @ q - scheme.gaps.T @ force
        v[:] = scheme.damped @ (scheme.mass @ (v + 0.5 * h * a) + 0.5 * h * pull)
        a = scheme.inertia @ (pull - scheme.damping @ v)
        if (i + 1) % every == 0:
            j = (i + 1) // every - 1
            record.motion[j], record.gap[j], record.force[j] = q, now, force


def _springs(laws: Sequence[Any]) -> FloatArray:
    """Return the (3 n_contacts,) stiffnesses of the contacts at rest, N/m."""
    rows = [[getattr(w, "k_t", 0.0), getattr(w, "k_w", None), w.k_n] for w in laws]
    return np.array([[t, t if w is None else w, n] for t, w, n in rows]).reshape(-1)


def prepared(
    structure: LinearSide, gap_operator: Matrix, laws: Sequence[Any], load: PeriodicLoad, omega: float, steps: int
) -> tuple[Scheme, int, FloatArray]:
    """Return the scheme, by how many its steps divide those asked for, and the contacts' states at rest."""
    one = one_structure(structure, "integrate")
    mass, damping, stiffness = (dense(m) for m in (one.mass, one.damping, one.stiffness))
    gaps = np.ascontiguousarray(dense(gap_operator))
    stuck = stiffness + gaps.T @ (_springs(laws)[:, None] * gaps)
    fastest = np.sqrt(scipy.linalg.eigh(stuck, mass, eigvals_only=True)[-1])
    every = int(np.ceil(2.0 * np.pi / omega / steps * fastest / LONGEST))
    fine = every * steps
    h = 2.0 * np.pi / omega / fine
    angles = 2.0 * np.pi * (np.arange(fine) + 1.0) / fine
    loads = np.tile(np.asarray(load.static, dtype=float), (fine, 1))
    for order, amplitude in load.harmonics.items():
        loads += (np.exp(1j * order * angles)[:, None] * amplitude).real
    kind, table, states = contact_table(laws)
    scheme = Scheme(
        h,
        np.linalg.inv(mass),
        np.linalg.inv(mass + 0.5 * h * damping),
        mass,
        damping,
        stiffness,
        gaps,
        loads,
        kind,
        table,
    )
    return scheme, every, states


def integrate(
    structure: LinearSide,
    gap_operator: Matrix,
    laws: Sequence[Any],
    load: PeriodicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart | None = None,
    stepping: TimeStepping | None = None,
) -> TransientResult:
    """Integrate until the first harmonic of the outputs is periodic; arguments and result as of `evidence.integrator.transient`.

    A start without states of the contacts takes their tractions where these are all they remember, else contacts at rest.
    """
    stepping = stepping or TimeStepping()
    n, steps = structure.n, stepping.steps_per_period
    scheme, every, states = prepared(structure, gap_operator, laws, load, omega, steps)
    begin = start or TransientStart(np.zeros(n), np.zeros(n), np.zeros((len(laws), 2)))
    check_arguments(n, len(laws), outputs, begin)
    if begin.states is not None:
        states = begin.states.copy()
    elif states.shape[1] == 2:
        states[:] = begin.traction
    q, v = begin.displacement.copy(), begin.velocity.copy()
    force = np.zeros(3 * len(laws))
    _move(scheme.kind, scheme.table, scheme.gaps @ q, scheme.gaps @ q, states, force)
    k = len(force)
    record = Record(np.empty((steps, n)), np.empty((steps, k)), np.empty((steps, k)))
    unknown = np.full((stepping.harmonics + 1, len(outputs)), np.nan, dtype=complex)
    now = Progress(unknown, np.full(n, np.nan))
    while now.periods < stepping.max_periods and now.status == "unsettled":
        began = q.copy()
        _period(scheme, q, v, states, force, every, record)
        if overflowed(q, record.motion):
            now.periods, now.status = now.periods + 1, "diverged"
            break
        period = period_harmonics(began, record.motion, stepping.harmonics)
        now.take_in(period[:, outputs], period[0].real, 0, stepping.tolerance)
    known = np.nan if now.status == "diverged" else 1.0
    contacts = (steps, -1, 3)
    return TransientResult(
        status=now.status,
        harmonics=np.asarray(known * now.harmonics),
        average=np.asarray(known * now.average),
        scatter=known * now.scatter,
        periods=now.periods,
        change=known * now.change,
        remaining=known * now.remaining,
        contact_failures=0,
        drift=known * now.drift,
        swing=np.ptp(record.motion, axis=0) / 2,
        labels=structure.dofs.labels,
        final=TransientStart(q, v, force.reshape(-1, 3)[:, :2].copy(), states),
        outputs=record.motion[:, outputs],
        gap=record.gap.reshape(contacts),
        contact_force=record.force.reshape(contacts),
    )


def start_along(
    coefficients: ComplexArray, omega: float, gap_operator: Matrix, laws: Sequence[Any], steps: int = 4096
) -> TransientStart:
    """Return the state at t = 0 of a given motion (H + 1, n): the contacts are marched along its gaps for some periods."""
    kind, table, states = contact_table(laws)
    h = np.arange(len(coefficients))
    turns = np.exp(2j * np.pi / steps * np.outer(np.arange(steps + 1) % steps, h))
    motion = (turns @ coefficients).real
    gaps = np.ascontiguousarray(motion @ dense(gap_operator).T)
    force = np.zeros(gaps.shape[1])
    _move(kind, table, np.zeros_like(force), gaps[0], states, force)
    for _ in range(HISTORY):
        for before, now in pairwise(gaps):
            _move(kind, table, before, now, states, force)
    velocity = (1j * omega * h @ coefficients).real
    return TransientStart(motion[0], velocity, force.reshape(-1, 3)[:, :2].copy(), states)
