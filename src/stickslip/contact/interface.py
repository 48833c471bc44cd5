"""Where contacts are: pairs of points, their laws, and the operator from displacements to gaps."""

from dataclasses import dataclass

import numba
import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.intervals import NN, TN, TT, WN, WW
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import input_error


@dataclass(frozen=True, eq=False)
class Interface:
    """Node-to-node contacts of a structure.

    Parameters
    ----------
    names
        One name a contact, e.g. ``L1.2``.
    laws
        One law a contact.
    gap_operator
        (3 n_contacts, n) rows t, w, n of each contact: ``gap = gap_operator @ u``; the contact forces act on the structure as
        ``gap_operator.T @ force``, on the left side of the equation of motion.

    Raises
    ------
    InputError
        If the numbers of names, laws and rows do not agree.
    """

    names: tuple[str, ...]
    laws: tuple[ElasticCoulomb, ...]
    gap_operator: FloatArray

    def __post_init__(self) -> None:
        n = len(self.names)
        if len(self.laws) != n or self.gap_operator.shape[0] != 3 * n:
            raise input_error(
                "Interface",
                f"{n} contact names, {len(self.laws)} laws, {self.gap_operator.shape[0]} rows of the gap operator",
                "Give one law and three rows (t, w, n) for each contact.",
            )

    @property
    def n_contacts(self) -> int:
        """Number of contact points."""
        return len(self.names)

    def parameters(self) -> FloatArray:
        """Return the (n_contacts, 6) law parameters for the kernels."""
        return np.array([law.parameters() for law in self.laws]).reshape(self.n_contacts, 6)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3 n_contacts,) spring stiffnesses of contacts that neither slip nor open, N/m."""
        return np.array([[law.k_t, law.k_w, law.k_n] for law in self.laws]).reshape(-1)

    def coordinates(self) -> IntArray:
        """Return the structure's dofs that take part in a gap."""
        return np.flatnonzero(np.any(self.gap_operator != 0.0, axis=0))

    def restricted(self, dofs: IntArray) -> "Interface":
        """Return the interface on the coordinates `dofs` alone; they must hold `coordinates()`."""
        return Interface(self.names, self.laws, self.gap_operator[:, dofs])


@dataclass(frozen=True, eq=False)
class SparseRows:
    """Gap operator by contact: the columns each contact touches and its 3 values in each."""

    columns: IntArray  # (n_contacts, width); unused entries repeat column 0 with value 0
    values: FloatArray  # (n_contacts, 3, width)


def sparse_rows(gap_operator: FloatArray) -> SparseRows:
    """Return the (3 n_contacts, n) `gap_operator` by contact, for `add_contact_jacobian`."""
    by_contact = gap_operator.reshape(-1, 3, gap_operator.shape[1])
    used = [np.flatnonzero(np.any(rows != 0.0, axis=0)) for rows in by_contact]
    width = max((u.size for u in used), default=0)
    columns = np.zeros((len(used), width), dtype=np.int64)
    values = np.zeros((len(used), 3, width))
    for c, u in enumerate(used):
        columns[c, : u.size] = u
        values[c, :, : u.size] = by_contact[c][:, u]
    return SparseRows(columns, values)


@numba.njit(cache=True)
def add_contact_jacobian(blocks, columns, values, n, factor, jac):  # type: ignore[no-untyped-def]
    """Add ``factor * Bᵀ K B`` to the harmonic-major matrix `jac`.

    Parameters
    ----------
    blocks
        (n_contacts, 5, m, m) from `contact_period`.
    columns, values
        The gap operator by contact, from `sparse_rows`.
    n
        Coordinates per harmonic coefficient.
    factor
        Scale of the result.
    jac
        In and out: (m n, m n) matrix; Fortran order is fastest.
    """
    n_contacts, _, m, _ = blocks.shape
    width = columns.shape[1]
    for c in range(n_contacts):
        b = values[c]
        for q in range(m):
            for p in range(m):
                tt, ww, nn = (
                    factor * blocks[c, TT, p, q],
                    factor * blocks[c, WW, p, q],
                    factor * blocks[c, NN, p, q],
                )
                tn, wn = factor * blocks[c, TN, p, q], factor * blocks[c, WN, p, q]
                if tt == 0.0 and ww == 0.0 and nn == 0.0 and tn == 0.0 and wn == 0.0:
                    continue
                for j in range(width):
                    row_t = tt * b[0, j] + tn * b[2, j]
                    row_w = ww * b[1, j] + wn * b[2, j]
                    row_n = nn * b[2, j]
                    col = q * n + columns[c, j]
                    for i in range(width):
                        jac[p * n + columns[c, i], col] += (
                            b[0, i] * row_t + b[1, i] * row_w + b[2, i] * row_n
                        )
