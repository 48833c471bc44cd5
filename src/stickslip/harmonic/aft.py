"""Contact forces in the frequency domain: alternating frequency/time (Cameron & Griffin 1989)."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.intervals import contact_period, prefix_sums


@dataclass(frozen=True, eq=False)
class ContactPeriod:
    """Contacts over one period.

    Attributes
    ----------
    coefficients
        (2H+1, 3 n_contacts) real Fourier coefficients of the contact forces, N.
    blocks
        (n_contacts, 5, 2H+1, 2H+1) their derivatives, N/m; see `contact_period`.
    gap, force
        (n_contacts, 3, samples) in m and N.
    state
        (n_contacts, 2, samples): 0 stick, 1 slip, 2 open, for t and w.
    """

    coefficients: FloatArray
    blocks: FloatArray
    gap: FloatArray
    force: FloatArray
    state: IntArray


@lru_cache(maxsize=32)
def _tables(order: int, samples: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    basis, cos_table, sin_table = prefix_sums(order, samples)
    analysis = basis * (2.0 / samples)
    analysis[:, 0] *= 0.5
    return basis, cos_table, sin_table, analysis


def contact_forces(
    gap_coefficients: FloatArray, parameters: FloatArray, samples: int
) -> ContactPeriod:
    """Evaluate contacts whose gaps have the given Fourier coefficients.

    Parameters
    ----------
    gap_coefficients
        (2H+1, 3 n_contacts) real coefficients of the gaps (t, w, n of each contact), m.
    parameters
        (n_contacts, 6) from `Interface.parameters`.
    samples
        Samples per period; at least 8 H keeps aliasing below the truncation error.
    """
    m, width = gap_coefficients.shape
    n_contacts = width // 3
    basis, cos_table, sin_table, analysis = _tables((m - 1) // 2, samples)
    gap = np.ascontiguousarray((basis @ gap_coefficients).T).reshape(n_contacts, 3, samples)
    force = np.empty_like(gap)
    state = np.empty((n_contacts, 2, samples), dtype=np.int64)
    blocks = np.empty((n_contacts, 5, m, m))
    contact_period(gap, parameters, basis, cos_table, sin_table, force, state, blocks)
    return ContactPeriod(analysis.T @ force.reshape(width, samples).T, blocks, gap, force, state)
