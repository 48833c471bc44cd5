"""Contact forces in the frequency domain: alternating frequency/time (Cameron & Griffin 1989)."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.addresses import law_address
from stickslip.contact.compiled import CompiledContacts, MarchedLaws
from stickslip.contact.event_integrals import Events, integrated, room_for_events
from stickslip.contact.events import exact_period
from stickslip.contact.intervals import contact_period, contact_period_threads, prefix_sums
from stickslip.contact.march import period_march
from stickslip.contact.planar.period import planar_period
from stickslip.contact.threads import thread_shares
from stickslip.errors import input_error


@dataclass(frozen=True, eq=False)
class ContactPeriod:
    """Contacts over one period.

    Attributes
    ----------
    coefficients
        (2H+1, 3 n_contacts) real Fourier coefficients of the contact forces, N.
    blocks
        (n_contacts, P, 2H+1, 2H+1) their derivatives by the coefficients of the gaps, N/m, in the order of
        `contact.law.PAIRS`.
    by_omega
        (2H+1, 3 n_contacts) their derivatives by ω at fixed coefficients, N s; None where no force depends on velocity.
    gap, force
        (n_contacts, 3, samples) in m and N.
    state
        (n_contacts, 2, samples): 0 stick, 1 slip, 2 open, for t and w.
    unsettled
        Number of contacts whose state did not become periodic.
    events
        State changes, from which `forces_between` gives the forces of more harmonics. None for contacts that are
        evaluated on samples or marched, and where samples were requested.
    """

    coefficients: FloatArray
    blocks: FloatArray
    by_omega: FloatArray | None
    gap: FloatArray
    force: FloatArray
    state: IntArray
    unsettled: int
    events: Events | None = None


@dataclass(frozen=True, eq=False)
class _Tables:
    basis: FloatArray  # (samples, m)
    synthesis: FloatArray  # (m, samples), its transpose in C order
    slope: FloatArray  # (samples, m), derivative by τ = ω t
    cos: FloatArray
    sin: FloatArray
    analysis: FloatArray  # (m, samples)


@lru_cache(maxsize=32)
def _tables(order: int, samples: int) -> _Tables:
    basis, cos_table, sin_table = prefix_sums(order, samples)
    synthesis = np.ascontiguousarray(basis.T)
    analysis = synthesis * (2.0 / max(samples, 1))
    analysis[0] *= 0.5
    h = np.arange(1, order + 1)
    slope = np.zeros_like(basis)
    slope[:, 1::2] = -h * basis[:, 2::2]
    slope[:, 2::2] = h * basis[:, 1::2]
    return _Tables(basis, synthesis, slope, cos_table, sin_table, analysis)


def contact_forces(
    gap_coefficients: FloatArray, contacts: CompiledContacts, samples: int, omega: float = 1.0, *, history: bool = True
) -> ContactPeriod:
    """Evaluate contacts whose gaps have the given Fourier coefficients.

    Parameters
    ----------
    gap_coefficients
        (2H+1, 3 n_contacts) real coefficients of the gaps (t, w, n of each contact), m.
    contacts
        The laws, from `compile_contacts` or `Interface.compiled`.
    samples
        Samples per period; at least 8 H keeps aliasing below the truncation error. Exact events need them for display only.
    omega
        Frequency in rad/s; only laws that depend on velocity need it.
    history
        Whether gaps, forces and states over the period are returned, too. If not, exact events are evaluated
        without samples.
    """
    gap_coefficients = np.asarray(gap_coefficients, dtype=float)
    m = gap_coefficients.shape[0] if gap_coefficients.ndim else 0
    if m % 2 == 0 or gap_coefficients.shape != (m, 3 * contacts.n_contacts):
        raise input_error(
            "contact_forces",
            f"gap coefficients of shape {gap_coefficients.shape} for {contacts.n_contacts} contacts",
            "Give 2 H + 1 rows, and columns t, w, n of each contact.",
        )
    if not history and not contacts.needs_samples:
        samples = 0
    tables = _tables((m - 1) // 2, samples)
    gap_coefficients = contacts.from_sliders(gap_coefficients)
    # contiguous in time: evaluators run along one gap
    gap = (gap_coefficients.T @ tables.synthesis).reshape(contacts.n_contacts, 3, samples)
    parts = []
    if contacts.piecewise.size:
        own = contacts.piecewise
        evaluate = _exact if contacts.evaluator == "events" else _on_samples
        period = evaluate(gap_coefficients, gap, contacts, tables)
        parts.append((own, period))
    if contacts.planar.size:
        parts.append((contacts.planar, _planar(gap_coefficients, gap, contacts)))
    for laws in contacts.marched:
        period = _marched(gap_coefficients, gap, laws, contacts.pairs, tables, omega)
        parts.append((laws.contacts, period))
    # without any contact there is no part, and the result is zero
    whole = parts[0][1] if len(parts) == 1 else _put_together(parts, gap, contacts.pairs, m)
    if contacts.sliders is not None:
        whole = replace(whole, gap=whole.gap + contacts.sliders[:, :, None])
    return whole if contacts.weights is None else _weighted(whole, contacts.weights)


def _of(gap_coefficients: FloatArray, contacts: IntArray) -> FloatArray:
    """Return the (2H+1, 3 n) coefficients of some contacts; the array itself if these are all contacts."""
    m, width = gap_coefficients.shape
    if 3 * contacts.size == width:
        return gap_coefficients
    return gap_coefficients.reshape(m, -1, 3)[:, contacts].reshape(m, -1)


def _on_samples(_: FloatArray, gap: FloatArray, contacts: CompiledContacts, tables: _Tables) -> ContactPeriod:
    """Evaluate sums of elementary contacts by intervals of the samples."""
    gap = gap if contacts.piecewise.size == len(gap) else gap[contacts.piecewise]
    n, _, samples = gap.shape
    m = tables.basis.shape[1]
    force = np.empty_like(gap)
    state = np.empty((n, 2, samples), dtype=np.int64)
    blocks = np.empty((n, contacts.pairs, m, m))
    arrays = (gap, contacts.elements, contacts.first, tables.basis, tables.cos, tables.sin, force, state, blocks)
    shares = thread_shares(n)
    if shares > 1:
        contact_period_threads(shares, *arrays)
    else:
        contact_period(*arrays)
    coefficients = tables.analysis @ force.reshape(3 * n, samples).T
    return ContactPeriod(coefficients, blocks, None, gap, force, state, 0)


def _exact(gap_coefficients: FloatArray, gap: FloatArray, contacts: CompiledContacts, _: _Tables) -> ContactPeriod:
    """Evaluate sums of elementary contacts at exact events."""
    own = contacts.piecewise
    gap = gap if own.size == len(gap) else gap[own]
    of_own = _of(gap_coefficients, own)
    kept = None
    if gap.shape[2] == 0 and contacts.keeps_events:
        kept = room_for_events((len(of_own) - 1) // 2, len(contacts.elements))
    coefficients, blocks, force, state = exact_period(
        of_own, contacts.elements, contacts.first, gap, contacts.pairs, kept
    )
    if kept is not None:
        kept = replace(kept, polynomials=of_own.T.reshape(own.size, 3, -1))
    return ContactPeriod(coefficients, blocks, None, gap, force, state, 0, kept)


def _planar(gap_coefficients: FloatArray, gap: FloatArray, contacts: CompiledContacts) -> ContactPeriod:
    """Evaluate contacts with isotropic planar friction at located events."""
    own = contacts.planar
    gap = gap if own.size == len(gap) else np.ascontiguousarray(gap[own])
    coefficients, blocks, force, state, unsettled = planar_period(
        _of(gap_coefficients, own), contacts.planar_elements, gap, contacts.pairs
    )
    return ContactPeriod(coefficients, blocks, None, gap, force, state, unsettled)


def forces_between(events: Events, contacts: CompiledContacts, order: int) -> ContactPeriod:
    """Return forces and derivatives up to `order` for a motion with fewer harmonics and known events, without sampling.

    Parameters
    ----------
    events
        All events of the motion, from `ContactPeriod.events`.
    contacts
        The laws with which the events were found.
    order
        Highest harmonic, at least the highest one of the motion.
    """
    coefficients, blocks = integrated(events, contacts.elements, contacts.first, order, contacts.pairs)
    none = np.zeros((contacts.n_contacts, 3, 0))
    states = np.zeros((contacts.n_contacts, 2, 0), dtype=np.int64)
    whole = ContactPeriod(coefficients, blocks, None, none, none, states, 0)
    return whole if contacts.weights is None else _weighted(whole, contacts.weights)


def _marched(
    gap_coefficients: FloatArray, gap: FloatArray, laws: MarchedLaws, pairs: int, tables: _Tables, omega: float
) -> ContactPeriod:
    """Evaluate contacts of one law class sample by sample."""
    gap = np.ascontiguousarray(gap[laws.contacts])
    n, _, samples = gap.shape
    m = tables.basis.shape[1]
    rate = omega * tables.slope
    velocity = _of(gap_coefficients, laws.contacts).T @ rate.T
    force, by_omega = np.empty_like(gap), np.empty_like(gap)
    state = np.empty((n, 2, samples), dtype=np.int64)
    blocks = np.empty((n, pairs, m, m))
    periods = np.empty(n, dtype=np.int64)
    period_march()(
        law_address(laws.kernel),
        laws.parameters,
        laws.start,
        gap,
        velocity.reshape(gap.shape),
        tables.basis,
        rate,
        omega,
        force,
        state,
        blocks,
        by_omega,
        periods,
    )
    return ContactPeriod(
        tables.analysis @ force.reshape(3 * n, samples).T,
        blocks,
        tables.analysis @ by_omega.reshape(3 * n, samples).T,
        gap,
        force,
        state,
        int(np.count_nonzero(periods < 0)),
    )


def _put_together(parts: list[tuple[IntArray, ContactPeriod]], gap: FloatArray, pairs: int, m: int) -> ContactPeriod:
    """Bring contacts that were evaluated in groups back into their order."""
    n, _, samples = gap.shape
    coefficients, by_omega = np.zeros((m, n, 3)), np.zeros((m, n, 3))
    blocks = np.empty((n, pairs, m, m))
    force = np.empty_like(gap)
    state = np.empty((n, 2, samples), dtype=np.int64)
    for own, part in parts:
        coefficients[:, own] = part.coefficients.reshape(m, -1, 3)
        if part.by_omega is not None:
            by_omega[:, own] = part.by_omega.reshape(m, -1, 3)
        blocks[own], force[own], state[own] = part.blocks, part.force, part.state
    return ContactPeriod(
        coefficients.reshape(m, -1),
        blocks,
        by_omega.reshape(m, -1),
        gap,
        force,
        state,
        sum(part.unsettled for _, part in parts),
    )


def _weighted(period: ContactPeriod, weights: FloatArray) -> ContactPeriod:
    """Multiply the forces of each contact by its weight."""
    each = np.repeat(weights, 3)
    return replace(
        period,
        coefficients=period.coefficients * each,
        blocks=period.blocks * weights[:, None, None, None],
        by_omega=None if period.by_omega is None else period.by_omega * each,
        force=period.force * weights[:, None, None],
    )
