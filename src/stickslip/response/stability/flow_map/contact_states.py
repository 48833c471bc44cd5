"""Piecewise-linear contacts in a disturbed motion: stiffness between transitions, and jumps at transitions.

A sticking tangential spring of stiffness ``k`` connects the structure to its slider. A slipping spring exerts ``±μ``
times the normal force, an open one no force. Forces are continuous at every transition, so disturbances of the
structure do not jump. Only slider positions jump: slip and lift-off erase them, and the beginning of stick sets them
again.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.compiled import CompiledContacts, compile_contacts
from stickslip.contact.element import K_N, MU, RESIDUAL, UNILATERAL
from stickslip.contact.event_integrals import Events, room_for_events
from stickslip.contact.events import exact_period
from stickslip.contact.interface import Interface
from stickslip.contact.law import SLIP, STICK, ContactLaw, NormalContact, PiecewiseLinear
from stickslip.contact.slider import ANCHOR, BY_NORMAL, NO_ANCHOR, PERIOD, SIGN, START, STATE


@dataclass(frozen=True, eq=False)
class ContactStates:
    """States of the contacts over a period, in intervals between transitions.

    Attributes
    ----------
    times
        (n_intervals + 1,) ends of the intervals, from the first transition to the same one a period later; τ = ωt.
    stiffness
        (n_intervals, n_contacts, 3, 3) derivative of the forces by the gaps with fixed sliders, N/m.
    rows
        (n_sliders,) row t or w of the gap operator of each slider that sticks for part of the period.
    normals
        (n_sliders,) row n of the same contact.
    springs
        (n_sliders,) spring stiffness, N/m.
    sticks
        (n_intervals, n_sliders) whether a slider sticks.
    takes_hold
        (n_intervals, n_sliders) whether stick begins with the interval.
    by_normal
        (n_intervals, n_sliders) derivative of the slider position by the normal gap where stick begins; the derivative
        by its own gap is one.
    resting
        Number of sliders that stick for the whole period; they are parameters of the motion, not states.
    grazing
        Number of these that reached their slip limit once and have stuck since.
    always_slipping
        Number of sliders that never stick.
    transitions
        Number of transitions in the period.
    """

    times: FloatArray
    stiffness: FloatArray
    rows: IntArray
    normals: IntArray
    springs: FloatArray
    sticks: BoolArray
    takes_hold: BoolArray
    by_normal: FloatArray
    resting: int
    grazing: int
    always_slipping: int
    transitions: int


@dataclass(frozen=True, slots=True)
class _Spring:
    """One tangential spring of an element."""

    element: int
    contact: int
    tangent: int
    segments: FloatArray  # (n_segments, 6)

    @property
    def changes(self) -> BoolArray:
        """Return whether each segment begins with a transition.

        The first may continue the last one of the previous period.
        """
        states = self.segments[:, [STATE, SIGN]]
        return np.asarray(np.any(states != np.roll(states, 1, axis=0), axis=1))


def located_part(law: ContactLaw) -> PiecewiseLinear | None:
    """Return the part of a law with located transitions.

    It is the whole law, the normal contact of planar friction, or None.
    """
    if isinstance(law, PiecewiseLinear):
        return law
    return law.normal_contact() if isinstance(law, NormalContact) else None


def is_located(law: ContactLaw) -> bool:
    """Whether all transitions of a law are located; this includes planar contacts without friction."""
    frictionless = isinstance(law, NormalContact) and law.mu == 0.0 and law.normal_contact() is not None
    return isinstance(law, PiecewiseLinear) or frictionless


def located_states(interface: Interface, gap_coefficients: FloatArray) -> ContactStates | None:
    """Return the contact states over a period for laws with located transitions.

    The result is None if rounding made more transitions than possible.

    Parameters
    ----------
    interface
        The contacts.
    gap_coefficients
        (2H+1, 3 n_contacts) real Fourier coefficients of the gaps, m.
    """
    laws = [located_part(law) for law in interface.laws]
    own = np.array([c for c, law in enumerate(laws) if law is not None], dtype=np.int64)
    compiled = compile_contacts([laws[c] for c in own], interface.factors[own], "events")
    events = room_for_events((len(gap_coefficients) - 1) // 2, len(compiled.elements))
    gaps = gap_coefficients.reshape(len(gap_coefficients), -1, 3)[:, own]
    gaps = compiled.from_sliders(gaps.reshape(len(gaps), -1))
    none = np.zeros((own.size, 3, 0))
    exact_period(gaps, compiled.elements, compiled.first, none, kept=events)
    return contact_states(events, compiled, own, interface.n_contacts) if events.whole else None


def contact_states(events: Events, compiled: CompiledContacts, own: IntArray, n_contacts: int) -> ContactStates:
    """Return the states of all contacts in the intervals between their transitions.

    Parameters
    ----------
    events
        All events of the motion.
    compiled
        The laws of these events, all piecewise linear.
    own, n_contacts
        Indices of these contacts in the interface, and its number of contacts; other contacts have no stiffness here.
    """
    springs = _springs(events, compiled)
    openings = [events.crossings[e, : events.n_crossings[e]] for e in range(len(compiled.elements))]
    starts = [s.segments[s.changes, START] for s in springs]
    times = np.unique(np.concatenate([np.zeros(0), *openings, *starts]))
    if not times.size:
        times = np.zeros(1)
    times = np.append(times, times[0] + PERIOD)
    middle = 0.5 * (times[1:] + times[:-1]) % PERIOD
    moving = [s for s in springs if np.any(s.changes)]
    factor = np.ones(compiled.n_contacts) if compiled.weights is None else compiled.weights
    own_stiffness = np.zeros((middle.size, compiled.n_contacts, 3, 3))
    _add_normal(own_stiffness, events, compiled, middle)
    for spring in springs:
        _add_tangential(own_stiffness, spring, compiled.elements[spring.element], middle)
    stiffness = np.zeros((middle.size, n_contacts, 3, 3))
    stiffness[:, own] = own_stiffness * factor[:, None, None]
    sticks, takes_hold, by_normal = _sliders(moving, compiled.elements, times, middle)
    still = [s for s in springs if not np.any(s.changes)]
    resting = [s for s in still if s.segments[0, STATE] == STICK]
    k = [factor[s.contact] * compiled.elements[s.element, s.tangent] for s in moving]
    return ContactStates(
        times,
        stiffness,
        np.array([3 * own[s.contact] + s.tangent for s in moving], dtype=np.int64),
        np.array([3 * own[s.contact] + 2 for s in moving], dtype=np.int64),
        np.array(k),
        sticks,
        takes_hold,
        by_normal,
        len(resting),
        sum(_has_slipped(s, compiled.elements[s.element]) for s in resting),
        len(still) - len(resting),
        sum(map(len, openings)) + sum(map(len, starts)),
    )


def _springs(events: Events, compiled: CompiledContacts) -> list[_Spring]:
    """Return all tangential springs."""
    contact = np.repeat(np.arange(compiled.n_contacts), np.diff(compiled.first))
    return [
        _Spring(e, int(contact[e]), d, events.segments[e, d, : events.n_segments[e, d]])
        for e in range(len(compiled.elements))
        for d in range(2)
        if compiled.elements[e, d] != 0.0
    ]


def _has_slipped(spring: _Spring, row: FloatArray) -> bool:
    """Whether a slider that sticks for the whole period has moved from its initial position."""
    began = NO_ANCHOR if np.isnan(row[RESIDUAL]) else 0.0
    return bool(spring.segments[0, ANCHOR] != began)


def _add_normal(stiffness: FloatArray, events: Events, compiled: CompiledContacts, middle: FloatArray) -> None:
    """Add the normal springs of all closed elements."""
    for c in range(compiled.n_contacts):
        for e in range(compiled.first[c], compiled.first[c + 1]):
            row = compiled.elements[e]
            if row[UNILATERAL] == 0.0:
                stiffness[:, c, 2, 2] += row[K_N]
                continue
            passed = np.searchsorted(events.crossings[e, : events.n_crossings[e]], middle)
            closed = (passed + int(events.starts_open[e])) % 2 == 0
            stiffness[closed, c, 2, 2] += row[K_N]


def _segment_at(spring: _Spring, middle: FloatArray) -> IntArray:
    """Return the segment of a spring at each time."""
    return np.searchsorted(spring.segments[:, START], middle, side="right") - 1


def _add_tangential(stiffness: FloatArray, spring: _Spring, row: FloatArray, middle: FloatArray) -> None:
    """Add one tangential spring: its stiffness where it sticks, its share of the normal force where it slips."""
    at = spring.segments[_segment_at(spring, middle)]
    c, d = spring.contact, spring.tangent
    stiffness[at[:, STATE] == STICK, c, d, d] += row[d]
    if row[UNILATERAL] != 0.0:
        slips = at[:, STATE] == SLIP
        stiffness[slips, c, d, 2] -= at[slips, SIGN] * row[MU] * row[K_N]


def _sliders(
    springs: list[_Spring], elements: FloatArray, times: FloatArray, middle: FloatArray
) -> tuple[BoolArray, BoolArray, FloatArray]:
    """Return where sliders stick, where stick begins, and the derivative of their position by the normal gap there."""
    shape = (middle.size, len(springs))
    sticks, takes_hold = np.zeros(shape, dtype=bool), np.zeros(shape, dtype=bool)
    by_normal = np.zeros(shape)
    for j, spring in enumerate(springs):
        sticks[:, j] = spring.segments[_segment_at(spring, middle), STATE] == STICK
        begin = spring.changes & (spring.segments[:, STATE] == STICK)
        at = np.searchsorted(times[:-1], spring.segments[begin, START])
        takes_hold[at, j] = True
        k = elements[spring.element, spring.tangent]
        by_normal[at, j] = spring.segments[begin, BY_NORMAL] / k
    return sticks, takes_hold, by_normal
