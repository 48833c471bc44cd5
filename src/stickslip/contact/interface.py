"""Contact points: their laws, and the operator from displacements to gaps."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.contact.cache import njit
from stickslip.contact.compiled import CompiledContacts, Evaluator, checked_weights, compile_contacts
from stickslip.contact.law import PAIRS, ContactLaw, Rigid, softened
from stickslip.errors import input_error

_PAIRS = np.array(PAIRS)


@dataclass(frozen=True, eq=False)
class Interface:
    """Contacts of a structure: nodes against nodes, nodes against facets, or quadrature points.

    Parameters
    ----------
    names
        One name per contact, e.g. ``L1.2``.
    laws
        One law per contact.
    gap_operator
        (3 n_contacts, n) rows t, w, n of each contact: ``gap = gap_operator @ u``. The contact forces act on the
        structure as ``gap_operator.T @ force``, on the left side of the equation of motion. Dense or sparse; stored as
        `scipy.sparse.csr_array` without zeros, because a contact acts on a few coordinates of thousands.
    weights
        (n_contacts,) factors of the forces of each law, such as the area of a point if laws are given per area; None:
        ones.

    Raises
    ------
    InputError
        If the numbers of names, laws, rows and weights do not agree, a weight is not positive, or a gap is not finite.
    """

    names: tuple[str, ...]
    laws: tuple[ContactLaw, ...]
    gap_operator: Matrix
    weights: FloatArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "gap_operator", _without_zeros(self.gap_operator))
        n = len(self.names)
        if len(self.laws) != n or self.gap_operator.shape[0] != 3 * n:
            raise input_error(
                "Interface",
                f"{n} contact names, {len(self.laws)} laws, {self.gap_operator.shape[0]} rows of the gap operator",
                "Give one law and three rows (t, w, n) for each contact.",
            )
        if not np.all(np.isfinite(self.gap_operator.data)):
            raise input_error(
                "Interface.gap_operator",
                "contains NaN or infinite numbers",
                "Check the frames and places of the contacts.",
            )
        if self.weights is not None:
            object.__setattr__(self, "weights", checked_weights(self.weights, n))

    @property
    def n_contacts(self) -> int:
        """Number of contact points."""
        return len(self.names)

    @property
    def factors(self) -> FloatArray:
        """(n_contacts,) weights, ones where none are given."""
        return np.ones(self.n_contacts) if self.weights is None else self.weights

    def compiled(self, evaluator: Evaluator = "intervals") -> CompiledContacts:
        """Return the laws as arrays for the evaluators."""
        return compile_contacts(self.laws, self.weights, evaluator)

    def stuck_stiffness(self) -> FloatArray:
        """Return the (3 n_contacts,) spring stiffnesses of contacts that neither slip nor open, N/m."""
        own = np.array([law.stuck_stiffness() for law in self.laws]).reshape(self.n_contacts, 3)
        return np.asarray(self.factors[:, None] * own).reshape(-1)

    def resting_force(self) -> FloatArray:
        """Return the (3 n_contacts,) contact forces at zero gap before any motion, N: preloads."""
        rest = np.zeros(3)
        out = np.empty((self.n_contacts, 3))
        for law, force in zip(self.laws, out, strict=True):
            state = law.initial_state()
            jac = np.zeros((3 + state.size, 6 + state.size))
            status = np.empty(2, dtype=np.int64)
            law.kernel(rest, rest, state, law.parameters(), force, np.empty_like(state), jac, status)
        return (self.factors[:, None] * out).reshape(-1)

    @property
    def rigid(self) -> bool:
        """Whether a contact is rigid, so that its force is not a function of its gap."""
        return any(isinstance(law, Rigid) for law in self.laws)

    def sprung(self, stiffness: float) -> "Interface":
        """Return the interface with springs of `stiffness` (N/m) instead of rigid contacts."""
        return replace(self, laws=softened(self.laws, stiffness))

    def coordinates(self) -> IntArray:
        """Return the dofs of the structure that occur in a gap."""
        return np.unique(self.gap_operator.indices).astype(np.int64)

    def restricted(self, dofs: IntArray) -> "Interface":
        """Return the interface on the coordinates `dofs` alone, which must include `coordinates()`."""
        return replace(self, gap_operator=self.gap_operator[:, dofs])


def _without_zeros(gap_operator: Matrix) -> Matrix:
    """Return a matrix as a new csr_array of doubles with sorted entries, none of them zero."""
    operator = scipy.sparse.csr_array(gap_operator, dtype=float, copy=True)
    operator.sum_duplicates()
    operator.eliminate_zeros()
    return operator


@dataclass(frozen=True, eq=False)
class SparseRows:
    """Gap operator, sorted by contact: the nonzero columns of each contact, and its 3 values in each column."""

    columns: IntArray  # (n_contacts, width); unused entries repeat column 0 with value 0
    values: FloatArray  # (n_contacts, 3, width)

    def gaps(self, vector: FloatArray) -> FloatArray:
        """Return the (m, 3 n_contacts) gaps of coordinates `vector` (m, n), both in C order."""
        gap = np.zeros((vector.shape[0], 3 * len(self.columns)))
        add_gaps(self.columns, self.values, vector, gap)
        return gap

    def add_forces(self, force: FloatArray, out: FloatArray) -> None:
        """Add the forces on the coordinates from contact forces (m, 3 n_contacts) to `out` (m, n)."""
        add_forces(self.columns, self.values, force, out)


def sparse_rows(gap_operator: Matrix) -> SparseRows:
    """Return the (3 n_contacts, n) `gap_operator`, dense or sparse, sorted by contact."""
    operator = _without_zeros(gap_operator)
    starts = operator.indptr[::3]
    used = [np.unique(operator.indices[a:b]) for a, b in pairwise(starts)]
    width = max((u.size for u in used), default=0)
    columns = np.zeros((len(used), width), dtype=np.int64)
    values = np.zeros((len(used), 3, width))
    direction = np.repeat(np.arange(operator.shape[0]) % 3, np.diff(operator.indptr))
    for c, (u, (a, b)) in enumerate(zip(used, pairwise(starts), strict=True)):
        columns[c, : u.size] = u
        values[c, direction[a:b], np.searchsorted(u, operator.indices[a:b])] = operator.data[a:b]
    return SparseRows(columns, values)


@njit(cache=True)
def add_gaps(columns, values, vector, gap):  # type: ignore[no-untyped-def]
    """Add the gaps of coordinates `vector` (m, n) to `gap` (m, 3 n_contacts); `columns` and `values` from `sparse_rows`."""
    for q in range(vector.shape[0]):
        for c in range(columns.shape[0]):
            for d in range(3):
                total = 0.0
                for j in range(columns.shape[1]):
                    total += values[c, d, j] * vector[q, columns[c, j]]
                gap[q, 3 * c + d] += total


@njit(cache=True)
def add_forces(columns, values, force, out):  # type: ignore[no-untyped-def]
    """Add the forces on the coordinates from contact forces `force` (m, 3 n_contacts) to `out` (m, n).

    `columns` and `values` come from `sparse_rows`.
    """
    for q in range(out.shape[0]):
        for c in range(columns.shape[0]):
            for j in range(columns.shape[1]):
                total = 0.0
                for d in range(3):
                    total += values[c, d, j] * force[q, 3 * c + d]
                out[q, columns[c, j]] += total


@njit(cache=True)
def add_contact_jacobian(blocks, columns, values, n, factor, jac):  # type: ignore[no-untyped-def]
    """Add ``factor * Bᵀ K B`` to the harmonic-major matrix `jac`.

    Parameters
    ----------
    blocks
        (n_contacts, P, m, m) derivative blocks in the order of `PAIRS`.
    columns, values
        The gap operator by contact, from `sparse_rows`.
    n
        Coordinates per harmonic coefficient.
    factor
        Scale of the result.
    jac
        In and out: (m n, m n) matrix; Fortran order is fastest.
    """
    n_contacts, n_pairs, m, _ = blocks.shape
    width = columns.shape[1]
    local = np.empty((3, 3))
    stride, place = (np.uintp(n), columns.astype(np.uintp))  # unsigned, for the inner loop
    for c in range(n_contacts):
        b, own = values[c], place[c]
        for q in range(m):
            for p in range(m):
                local[:] = 0.0
                empty = True
                for k in range(n_pairs):
                    value = blocks[c, k, p, q]
                    if value != 0.0:
                        local[_PAIRS[k, 0], _PAIRS[k, 1]] = factor * value
                        empty = False
                if empty:
                    continue
                for j in range(width):
                    row_t = local[0, 0] * b[0, j] + local[0, 1] * b[1, j] + local[0, 2] * b[2, j]
                    row_w = local[1, 0] * b[0, j] + local[1, 1] * b[1, j] + local[1, 2] * b[2, j]
                    row_n = local[2, 0] * b[0, j] + local[2, 1] * b[1, j] + local[2, 2] * b[2, j]
                    col = np.uintp(q) * stride + own[j]
                    for i in range(width):
                        jac[np.uintp(p) * stride + own[i], col] += b[0, i] * row_t + b[1, i] * row_w + b[2, i] * row_n
