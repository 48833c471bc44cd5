"""Initial states of a time integration: displacements, velocities, and states of the contact laws."""

# mypy: disallow-untyped-decorators=False

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numba import types

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.contact.addresses import law_at
from stickslip.contact.cache import njit
from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error
from stickslip.response.time.stepping.contact_step import KERNEL, PARAMETERS, STATES, TimeContacts, time_contacts
from stickslip.response.time.stepping.propagator import require_array

SAMPLES = 1024  # of the gaps in a period
MOST_PERIODS = 50  # largest number of evaluated periods; slower states settle during the integration
REPEATS = 1e-9  # relative change of a law's state over a period that counts as none


@dataclass(frozen=True, eq=False)
class TransientStart:
    """State at t = 0, which is also the state at any whole number of periods.

    Parameters
    ----------
    displacement, velocity
        (n,) in m and m/s.
    states
        One array (n_state,) for each contact: the state of its law, as in the law's `initial_state`. An entry that is
        NaN there may be NaN here: the law then determines it at t = 0.
    """

    displacement: FloatArray
    velocity: FloatArray
    states: Sequence[FloatArray]


def rest(n: int, laws: Sequence[ContactLaw]) -> TransientStart:
    """Return zero displacement and velocity of `n` coordinates, and the laws' own initial states."""
    states = tuple(np.asarray(law.initial_state(), dtype=float) for law in laws)
    return TransientStart(np.zeros(n), np.zeros(n), states)


def start_from_harmonics(
    coefficients: ComplexArray, omega: float, gap_operator: Matrix, laws: Sequence[ContactLaw]
) -> TransientStart:
    """Return the state at t = 0 of a motion ``Re Σ X_h e^{ihωt}``, such as a solution of a harmonic balance.

    The laws are evaluated along the gaps until their states repeat. For a `point` of a forced response `problem`, the
    amplitudes of all dofs are ``problem.low.linear.recover(point.omega, point.coefficients)``.

    Parameters
    ----------
    coefficients
        (H + 1, n) complex displacement amplitudes, m; harmonic 0 first.
    omega
        Angular frequency, rad/s.
    gap_operator
        (3 n_contacts, n), dense or sparse: rows t, w, n of each contact.
    laws
        One law for each contact.

    Raises
    ------
    InputError
        If a contact is rigid, or shapes do not agree.
    """
    caller = "start_from_harmonics"
    contacts = time_contacts(laws, None, caller)
    shape = (3 * contacts.n, coefficients.shape[1])
    if gap_operator.shape != shape:
        raise input_error(f"{caller}: gap_operator", f"has shape {gap_operator.shape}", f"It must be {shape}.")
    orders = np.arange(len(coefficients))[:, None]
    rates = 1j * orders * omega * coefficients
    gaps, gap_rates = ((gap_operator @ c.T).T for c in (coefficients, rates))
    states = settled_states(contacts, gaps, gap_rates)
    return TransientStart(np.sum(coefficients.real, axis=0), np.sum(rates.real, axis=0), contacts.separate(states))


def settled_states(contacts: TimeContacts, gaps: ComplexArray, rates: ComplexArray) -> FloatArray:
    """Return the states of all laws just before t = 0 of periodic gaps.

    Parameters
    ----------
    contacts
        The laws.
    gaps, rates
        (H + 1, 3 n) complex amplitudes of gaps and rates, harmonic 0 first.
    """
    turns = np.exp(2j * np.pi / SAMPLES * np.outer(np.arange(SAMPLES), np.arange(len(gaps))))
    moved, rate = (np.ascontiguousarray((turns @ c).real) for c in (gaps, rates))
    states, table, places = contacts.start.copy(), contacts.table, contacts.table.places
    for c in range(contacts.n):
        part = slice(3 * c, 3 * c + 3)
        path = [np.ascontiguousarray(a[:, part]) for a in (moved, rate)]
        own = states[places[STATES, c] : places[STATES, c + 1]]
        parameters = table.parameters[places[PARAMETERS, c] : places[PARAMETERS, c + 1]]
        step = places[KERNEL, c]
        if np.any(np.isnan(own)):
            _march()(step, parameters, path[0][-1:], path[1][-1:], own)
        for _ in range(MOST_PERIODS if own.size else 0):
            before = own.copy()
            _march()(step, parameters, *path, own)
            if np.all(np.abs(own - before) <= REPEATS * np.maximum(np.abs(own), np.abs(before))):
                break
    return states


def _march_period(address, parameters, gap, rate, state):  # type: ignore[no-untyped-def]
    """Update the state of one contact along samples of its gap, in place."""
    step = law_at(address)
    new, force = np.empty_like(state), np.empty(3)
    jac, status = np.zeros((3 + state.size, 6 + state.size)), np.zeros(2, np.int64)
    for i in range(gap.shape[0]):
        step(gap[i], rate[i], state, parameters, force, new, jac, status)
        state[:] = new


@cache
def _march() -> Any:
    vector, matrix = types.float64[::1], types.float64[:, ::1]
    return njit(types.void(types.int64, vector, matrix, matrix, vector), cache=True)(_march_period)


def check_start(start: TransientStart, n: int, contacts: TimeContacts, caller: str) -> None:
    """Refuse a start of wrong shape or with non-finite numbers; only states that the law leaves open may be NaN."""
    given_type: object = start
    if not isinstance(given_type, TransientStart):
        raise input_error(
            f"{caller}: start",
            f"is a {type(start).__name__}",
            "Give a TransientStart, such as that of `start_from_harmonics`, or None for rest.",
        )
    require_array(f"{caller}: start.displacement", start.displacement, (n,))
    require_array(f"{caller}: start.velocity", start.velocity, (n,))
    sizes = np.diff(contacts.state_places).tolist()
    given = [np.size(s) for s in start.states]
    if given != sizes:
        raise input_error(
            f"{caller}: start.states", f"hold {given} numbers", f"The laws remember {sizes}, one array a contact."
        )
    for c, (state, own) in enumerate(zip(start.states, contacts.separate(contacts.start), strict=True)):
        unknown = ~np.isfinite(np.ravel(state))
        settles = np.isnan(np.ravel(state)) & np.isnan(own)
        if np.any(unknown & ~settles):
            raise input_error(
                f"{caller}: start.states[{c}]",
                f"holds {np.ravel(state)[unknown & ~settles][0]}",
                "Give finite numbers; only what a law's own initial state leaves open may be NaN.",
            )
