"""Contact forces in the frequency domain: alternating frequency/time (Cameron & Griffin 1989)."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.compiled import CompiledContacts, MarchedLaws
from stickslip.contact.intervals import contact_period, prefix_sums
from stickslip.contact.march import march_period


@dataclass(frozen=True, eq=False)
class ContactPeriod:
    """Contacts over one period.

    Attributes
    ----------
    coefficients
        (2H+1, 3 n_contacts) real Fourier coefficients of the contact forces, N.
    blocks
        (n_contacts, P, 2H+1, 2H+1) their derivatives by the coefficients of the gaps, N/m, in the order of `contact.law.PAIRS`.
    by_omega
        (2H+1, 3 n_contacts) their derivatives by ω at fixed coefficients, N s; None where no force depends on velocity.
    gap, force
        (n_contacts, 3, samples) in m and N.
    state
        (n_contacts, 2, samples): 0 stick, 1 slip, 2 open, for t and w.
    unsettled
        Contacts whose state did not become periodic.
    """

    coefficients: FloatArray
    blocks: FloatArray
    by_omega: FloatArray | None
    gap: FloatArray
    force: FloatArray
    state: IntArray
    unsettled: int


@dataclass(frozen=True, eq=False)
class _Tables:
    basis: FloatArray  # (samples, m)
    slope: FloatArray  # (samples, m), derivative by τ = ω t
    cos: FloatArray
    sin: FloatArray
    analysis: FloatArray  # (samples, m)


@lru_cache(maxsize=32)
def _tables(order: int, samples: int) -> _Tables:
    basis, cos_table, sin_table = prefix_sums(order, samples)
    analysis = basis * (2.0 / samples)
    analysis[:, 0] *= 0.5
    h = np.arange(1, order + 1)
    slope = np.zeros_like(basis)
    slope[:, 1::2] = -h * basis[:, 2::2]
    slope[:, 2::2] = h * basis[:, 1::2]
    return _Tables(basis, slope, cos_table, sin_table, analysis)


def contact_forces(
    gap_coefficients: FloatArray, contacts: CompiledContacts, samples: int, omega: float = 1.0
) -> ContactPeriod:
    """Evaluate contacts whose gaps have the given Fourier coefficients.

    Parameters
    ----------
    gap_coefficients
        (2H+1, 3 n_contacts) real coefficients of the gaps (t, w, n of each contact), m.
    contacts
        The laws, from `compile_contacts` or `Interface.compiled`.
    samples
        Samples per period; at least 8 H keeps aliasing below the truncation error.
    omega
        Frequency in rad/s; only laws that depend on velocity ask for it.
    """
    m, width = gap_coefficients.shape
    n = contacts.n_contacts
    factor = 1.0 if contacts.weights is None else contacts.weights[:, None, None]
    tables = _tables((m - 1) // 2, samples)
    gap = np.ascontiguousarray((tables.basis @ gap_coefficients).T).reshape(n, 3, samples)
    force: FloatArray = np.empty_like(gap)
    state = np.empty((n, 2, samples), dtype=np.int64)
    blocks = np.empty((n, contacts.pairs, m, m))
    own = contacts.piecewise
    if own.size == n:
        contact_period(gap, contacts.elements, contacts.first, tables.basis, tables.cos, tables.sin, force, state, blocks)  # fmt: skip
    elif own.size:
        part = force[own], state[own], blocks[own]
        contact_period(gap[own], contacts.elements, contacts.first, tables.basis, tables.cos, tables.sin, *part)  # fmt: skip
        force[own], state[own], blocks[own] = part
    by_omega: FloatArray | None = np.zeros_like(force) if contacts.marched else None
    unsettled = 0
    for laws in contacts.marched:
        c = laws.contacts
        velocity = omega * (tables.slope @ gap_coefficients).T.reshape(n, 3, samples)[c]
        f, s, b, slope, periods = _march(laws, gap[c], velocity, tables, omega, contacts.pairs)
        force[c], state[c], blocks[c] = f, s, b
        if by_omega is not None:
            by_omega[c] = slope
        unsettled += int(np.count_nonzero(periods < 0))
    if contacts.weights is not None:
        blocks *= contacts.weights[:, None, None, None]
    force = factor * force
    return ContactPeriod(
        tables.analysis.T @ force.reshape(width, samples).T,
        blocks,
        None
        if by_omega is None
        else tables.analysis.T @ (factor * by_omega).reshape(width, samples).T,
        gap,
        force,
        state,
        unsettled,
    )


def _march(
    laws: MarchedLaws,
    gap: FloatArray,
    velocity: FloatArray,
    tables: _Tables,
    omega: float,
    pairs: int,
) -> tuple[FloatArray, IntArray, FloatArray, FloatArray, IntArray]:
    n, _, samples = gap.shape
    m = tables.basis.shape[1]
    force, slope = np.empty_like(gap), np.empty_like(gap)
    state = np.empty((n, 2, samples), dtype=np.int64)
    blocks = np.empty((n, pairs, m, m))
    periods = np.empty(n, dtype=np.int64)
    march_period(
        laws.kernel, laws.parameters, laws.start, gap, np.ascontiguousarray(velocity), tables.basis,
        omega * tables.slope, omega, force, state, blocks, slope, periods,
    )  # fmt: skip
    return force, state, blocks, slope, periods
