"""Multifrontal Cholesky factors of large sparse matrices, and Schur complements; the order of elimination is by nested dissection.

J. W. H. Liu, "The multifrontal method for sparse matrix solution: theory and practice", SIAM Review 34 (1992) 82-109. A. George,
"Nested dissection of a regular finite element mesh", SIAM Journal on Numerical Analysis 10 (1973) 345-363: a piece is cut midway
between two distant vertices, by the difference of the distances from both. The separator is the smallest set of vertices that covers
the edges of the cut; it follows from a maximum matching (Kőnig's theorem).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import BoolArray, IntArray, Matrix
from stickslip.errors import SingularError

LEAF = 150  # largest number of rows of a piece that is not cut
CUTS = (0.5, 0.46, 0.54, 0.42, 0.58)  # fractions of a piece in its first part that are tried
UNEVEN = 4.0  # penalty of uneven cuts: a cut costs its separator's size times 1 + UNEVEN (larger fraction − 1/2)²


@dataclass(frozen=True, eq=False)
class Front:
    """A front: rows that are eliminated together, numbered in the order of elimination.

    Parameters
    ----------
    first, last
        Pivots: rows ``first`` to ``last - 1``.
    update
        (u,) later rows coupled to the pivots, ascending.
    children
        Fronts whose `update` is assembled here.
    """

    first: int
    last: int
    update: IntArray
    children: tuple[int, ...]

    @property
    def pivots(self) -> int:
        """Number of rows eliminated."""
        return self.last - self.first


@dataclass(frozen=True, eq=False)
class Dissection:
    """An order of elimination.

    Parameters
    ----------
    order
        (n,) rows in the order of elimination; kept rows come last.
    fronts
        Fronts, children before parents.
    kept
        Number of rows that are not eliminated.
    """

    order: IntArray
    fronts: tuple[Front, ...]
    kept: int

    @property
    def entries(self) -> int:
        """Number of entries of the factors and of the Schur complement."""
        each = (f.pivots * (f.pivots + f.update.size) for f in self.fronts)
        return int(sum(each)) + self.kept**2

    @property
    def peak(self) -> int:
        """Largest number of entries stored at the same time, including the front being eliminated."""
        factors, waiting, most = self.kept**2, 0, 0
        for front in self.fronts:
            square = int(front.update.size) ** 2
            factors += front.pivots * (front.pivots + front.update.size)
            waiting += square
            most = max(most, factors + waiting)
            waiting -= sum(int(self.fronts[child].update.size) ** 2 for child in front.children)
        return most


def dissected(pattern: Matrix, kept: IntArray) -> Dissection:
    """Return an order of elimination for a matrix of symmetric sparsity.

    Parameters
    ----------
    pattern
        (n, n) CSR matrix with a complete diagonal.
    kept
        (k,) different rows that are not eliminated; they come last, in this order.
    """
    group, members, graph = _grouped(pattern, kept)
    whole = np.zeros(len(members), dtype=bool)
    whole[group[kept]] = True
    pieces: list[tuple[IntArray, tuple[int, ...]]] = []
    size = np.array([rows.size for rows in members])
    inner = np.flatnonzero(~whole)
    _, label = scipy.sparse.csgraph.connected_components(graph[inner][:, inner], directed=False)
    for part in range(int(label.max(initial=-1)) + 1):
        _cut(graph, inner[label == part], size, pieces)
    return _symbolic(graph, pieces, members, group, kept)


def _grouped(pattern: Matrix, kept: IntArray) -> tuple[IntArray, list[IntArray], Matrix]:
    """Group rows with the same pattern, such as the dofs of a node.

    Return the group of each row, the rows of each group, and the graph of groups.
    """
    n = pattern.shape[0]
    ones = scipy.sparse.csr_array((np.ones(pattern.nnz), pattern.indices, pattern.indptr), shape=(n, n))
    random = np.random.default_rng(0).random(n)
    own = np.zeros(n)
    own[kept] = 1.0
    key = np.column_stack([ones @ random, np.diff(pattern.indptr), own])
    first, group = np.unique(key, axis=0, return_index=True, return_inverse=True)[1:]
    group = group.reshape(-1)
    rows = np.argsort(group, kind="stable")
    members = np.split(rows, np.cumsum(np.bincount(group))[:-1])
    to_group = scipy.sparse.csr_array((np.ones(n), (np.arange(n), group)), shape=(n, len(members)))
    graph = scipy.sparse.csr_array(ones[first] @ to_group)
    graph.setdiag(0.0)
    graph.eliminate_zeros()
    return group, members, graph


def _cut(graph: Matrix, nodes: IntArray, size: IntArray, pieces: list[tuple[IntArray, tuple[int, ...]]]) -> int:
    """Append the pieces of `nodes`, the separator after its halves; return the index of the last piece."""
    halves = None
    if size[nodes].sum() > LEAF and nodes.size > 2:
        halves = _halves(graph[nodes][:, nodes])
    if halves is None:
        pieces.append((nodes, ()))
    else:
        one, other, between = halves
        children = tuple(_cut(graph, nodes[half], size, pieces) for half in (one, other))
        pieces.append((nodes[between], children))
    return len(pieces) - 1


def _halves(graph: Matrix) -> tuple[BoolArray, BoolArray, BoolArray] | None:
    """Return two parts of a graph and the separator between them; None if every cut leaves a part empty."""
    n = graph.shape[0]
    start = _distances(graph, 0)
    a = int(np.argmax(start))
    from_a = _distances(graph, a)
    b = int(np.argmax(from_a))
    from_b = _distances(graph, b)
    c = int(np.argmax(np.minimum(from_a, from_b)))
    from_c = _distances(graph, c)
    best, found = np.inf, None
    for first, second, third in ((from_a, from_b, from_c), (from_c, from_a, from_b)):
        order = np.lexsort((third, first - second))
        for share in CUTS:
            inside = np.zeros(n, dtype=bool)
            inside[order[: int(share * n)]] = True
            between = _separator(graph, inside)
            one, other = inside & ~between, ~inside & ~between
            sizes = np.count_nonzero(one), np.count_nonzero(other)
            cost = np.count_nonzero(between) * (1 + UNEVEN * (max(sizes) / n - 0.5) ** 2)
            if min(sizes) and cost < best:
                best, found = cost, (one, other, between)
    return found


def _distances(graph: Matrix, start: int) -> IntArray:
    """Return the number of edges from a vertex to all others; -1 for vertices that are not connected."""
    distance = np.full(graph.shape[0], -1, dtype=np.int64)
    distance[start] = 0
    front, step = np.array([start]), 0
    while front.size:
        step += 1
        begin, count = graph.indptr[front], np.diff(graph.indptr)[front]
        total = int(count.sum())
        offset = np.repeat(begin - np.concatenate([[0], np.cumsum(count)[:-1]]), count)
        near = graph.indices[np.arange(total) + offset]
        front = np.unique(near[distance[near] < 0])
        distance[front] = step
    return distance


def _separator(graph: Matrix, inside: BoolArray) -> BoolArray:
    """Return the smallest set of vertices whose removal cuts all edges out of `inside`."""
    rows = np.flatnonzero(inside)
    across = graph[rows]
    out = ~inside[across.indices]
    source = np.repeat(rows, np.diff(across.indptr))[out]
    target = across.indices[out]
    left, row = np.unique(source, return_inverse=True)
    right, column = np.unique(target, return_inverse=True)
    edges = scipy.sparse.csr_array((np.ones(row.size), (row, column)), shape=(left.size, right.size))
    match = scipy.sparse.csgraph.maximum_bipartite_matching(edges, perm_type="column")  # partner of each left vertex
    partner = np.full(right.size, -1)
    partner[match[match >= 0]] = np.flatnonzero(match >= 0)
    # Kőnig's theorem: the vertices that alternating paths from unmatched left vertices reach
    reached_left, reached_right = match < 0, np.zeros(right.size, dtype=bool)
    front = np.flatnonzero(reached_left)
    while front.size:
        near = np.unique(edges[front].indices)
        near = near[~reached_right[near]]
        reached_right[near] = True
        front = partner[near]
        front = front[(front >= 0) & ~reached_left[front]]
        reached_left[front] = True
    between = np.zeros(inside.size, dtype=bool)
    between[left[~reached_left]] = True
    between[right[reached_right]] = True
    return between


def _symbolic(
    graph: Matrix,
    pieces: list[tuple[IntArray, tuple[int, ...]]],
    members: list[IntArray],
    group: IntArray,
    kept: IntArray,
) -> Dissection:
    """Return the dissection: its fronts, and the rows that each of them updates."""
    n = group.size
    place = np.full(len(members), len(pieces))
    for i, (nodes, _) in enumerate(pieces):
        place[nodes] = i
    eliminated = [members[g] for nodes, _ in pieces for g in nodes]
    order = np.concatenate([*eliminated, kept]).astype(np.int64)
    rank = np.empty(n, dtype=np.int64)
    rank[order] = np.arange(n)
    touched: list[IntArray] = []  # groups
    fronts: list[Front] = []
    first = 0
    for i, (nodes, children) in enumerate(pieces):
        near = np.unique(np.concatenate([graph[nodes].indices, *(touched[c] for c in children)]))
        later = near[place[near] > i]
        touched.append(later)
        rows = [members[g] for g in later]
        update = np.sort(rank[np.concatenate(rows)]) if rows else np.zeros(0, dtype=np.int64)
        last = first + sum(members[g].size for g in nodes)
        fronts.append(Front(first, last, update, children))
        first = last
    return Dissection(order, tuple(fronts), int(kept.size))


COLUMNS = 32  # right-hand sides of one pass
BLOCK = 256  # columns added at a time


@dataclass(frozen=True, eq=False)
class Multifrontal:
    """Factors of a Hermitian positive definite matrix, with a Schur complement on the kept rows; `multifrontal` makes them.

    Parameters
    ----------
    dissection
        The order of elimination.
    lower
        For each front the (p, p) Cholesky factor of its pivots, in Fortran order; real where no complex entry was assembled.
    below
        For each front the (u, p) rows below this factor.
    rest
        (k, k) Schur complement on the kept rows, in their order.
    """

    dissection: Dissection
    lower: tuple[Matrix, ...]
    below: tuple[Matrix, ...]
    rest: Matrix

    def forward(self, right: Matrix) -> Matrix:
        """Return the right-hand sides (n, m) after elimination, in the order of elimination; the last rows belong to the Schur complement.

        Parameters
        ----------
        right
            (n, m) in the matrix's own order.
        """
        x: Matrix = np.array(right[self.dissection.order], order="C", dtype=self._kind(right))
        for front, lower, below in self._each:
            flat = _like(lower, x)
            own = flat[front.first : front.last]
            _solve(lower, own, False)
            if front.update.size:
                flat[front.update] -= below @ own
        return x

    def backward(self, forward: Matrix) -> Matrix:
        """Return the solutions (n, m), in the order of the matrix, from the result of `forward` with the solution in the kept rows."""
        x: Matrix = np.array(forward, order="C")
        for front, lower, below in reversed(self._each):
            flat = _like(lower, x)
            own = flat[front.first : front.last]
            if front.update.size:
                own -= below.conj().T @ flat[front.update]
            _solve(lower, own, True)
        out = np.empty_like(x)
        out[self.dissection.order] = x
        return out

    def solve(self, right: Matrix) -> Matrix:
        """Return the solutions for right-hand sides (n,) or (n, m), if no row is kept."""
        columns = right.reshape(len(right), -1)
        found: Matrix = np.empty(columns.shape, dtype=self._kind(columns))
        for first in range(0, columns.shape[1], COLUMNS):
            some = slice(first, first + COLUMNS)
            found[:, some] = self.backward(self.forward(columns[:, some]))
        return found.reshape(right.shape)

    @property
    def _each(self) -> list[tuple[Front, Matrix, Matrix]]:
        return list(zip(self.dissection.fronts, self.lower, self.below, strict=True))

    def _kind(self, right: Matrix) -> Any:
        return complex if np.iscomplexobj(right) or np.iscomplexobj(self.rest) else float


def multifrontal(matrix: Matrix, kept: IntArray | None = None, dissection: Dissection | None = None) -> Multifrontal:
    """Factorise a sparse Hermitian matrix whose eliminated rows are positive definite.

    Parameters
    ----------
    matrix
        (n, n) CSR matrix with a complete diagonal.
    kept
        (k,) rows that are not eliminated; None: no such rows.
    dissection
        The order of elimination, if known.

    Raises
    ------
    SingularError
        If a pivot is not positive.
    """
    if dissection is None:
        dissection = dissected(matrix, np.zeros(0, dtype=np.int64) if kept is None else kept)
    kind = complex if np.iscomplexobj(matrix) else float
    own = scipy.sparse.tril(matrix[dissection.order][:, dissection.order], format="csc")
    own.sort_indices()
    n = matrix.shape[0]
    begin = n - dissection.kept
    rest = np.zeros((dissection.kept,) * 2, dtype=kind, order="F")
    rest += own[begin:, begin:].toarray()
    waiting: dict[int, Matrix] = {}
    lower, below = [], []
    parents = {child for front in dissection.fronts for child in front.children}
    for i, front in enumerate(dissection.fronts):
        pivots, update = _assembled(own, front, dissection.fronts, waiting)
        factor, under = _eliminated(pivots, front.pivots)
        lower.append(factor)
        below.append(under)
        if front.update.size:
            _subtract_square(update, under)
            if i in parents:
                waiting[i] = update
            else:
                place = front.update - begin
                _add(rest, place, place, update)
    return Multifrontal(dissection, tuple(lower), tuple(below), _mirrored(rest))


def _assembled(
    own: Matrix, front: Front, fronts: tuple[Front, ...], waiting: dict[int, Matrix]
) -> tuple[Matrix, Matrix]:
    """Return the columns of the pivots, and the lower triangle of the update matrix."""
    p, u = front.pivots, front.update.size
    begin, end = own.indptr[front.first], own.indptr[front.last]
    # away from the cyclic faces a wave's matrix is real: such fronts take half the memory and a quarter of the time
    plain = _really(own.data[begin:end])
    moves = [child for child in front.children if child in waiting]
    kind = np.result_type(plain, *(waiting[child] for child in moves))
    pivots = np.zeros((p + u, p), dtype=kind, order="F")
    update = np.zeros((u, u), dtype=kind, order="F")
    rows = own.indices[begin:end]
    columns = np.repeat(np.arange(p), np.diff(own.indptr[front.first : front.last + 1]))
    pivots[_local(front, rows), columns] = plain
    for child in moves:
        moved = waiting.pop(child)
        place = _local(front, fronts[child].update)
        here = int(np.searchsorted(place, p))
        later = place[here:] - p
        _add(pivots, place, place[:here], moved[:, :here])
        _add(update, later, later, moved[here:, here:])
    return pivots, update


def _really(values: Matrix) -> Matrix:
    """Return values as real numbers if none has an imaginary part."""
    return values if not np.iscomplexobj(values) or values.imag.any() else values.real


def _add(to: Matrix, rows: IntArray, columns: IntArray, values: Matrix) -> None:
    """Add `values` to rows and columns of an array, `BLOCK` columns at a time, so that no large copy is made."""
    for first in range(0, columns.size, BLOCK):
        some = slice(first, first + BLOCK)
        to[np.ix_(rows, columns[some])] += values[:, some]


def _local(front: Front, rows: IntArray) -> IntArray:
    """Return the positions of rows in a front."""
    inside = rows < front.last
    after = front.pivots + np.searchsorted(front.update, rows)
    return np.where(inside, rows - front.first, after)


def _eliminated(columns: Matrix, p: int) -> tuple[Matrix, Matrix]:
    """Return the Cholesky factor of the pivots and the rows below it."""
    lapack, blas = scipy.linalg.lapack, scipy.linalg.blas
    is_complex = np.iscomplexobj(columns)
    potrf, trsm = (lapack.zpotrf, blas.ztrsm) if is_complex else (lapack.dpotrf, blas.dtrsm)
    factor, info = potrf(np.asfortranarray(columns[:p]), lower=1, clean=1, overwrite_a=1)
    if info != 0:
        raise SingularError("factorise: the matrix is not positive definite")
    under: Matrix = np.asfortranarray(columns[p:])
    if len(under):
        under = trsm(1.0, factor, under, side=1, lower=1, trans_a=2, overwrite_b=1)
    return factor, under


def _subtract_square(update: Matrix, under: Matrix) -> None:
    """Subtract ``under underᴴ`` from the lower triangle of `update`."""
    if np.iscomplexobj(update):
        scipy.linalg.blas.zherk(-1.0, under, beta=1.0, c=update, lower=1, overwrite_c=1)
    else:
        scipy.linalg.blas.dsyrk(-1.0, under, beta=1.0, c=update, lower=1, overwrite_c=1)


def _mirrored(lower: Matrix) -> Matrix:
    """Complete a lower triangle to the Hermitian matrix, row by row, since it may be large."""
    for i in range(1, len(lower)):
        lower[:i, i] = lower[i, :i].conj()
    return lower


def _like(lower: Matrix, x: Matrix) -> Matrix:
    """Return complex columns as pairs of real ones if the front's factors are real, without a copy."""
    return x if np.iscomplexobj(lower) else x.view(float)


def _solve(lower: Matrix, rows: Matrix, transposed: bool) -> None:
    """Solve with a triangle, or its conjugate transpose; the solution overwrites `rows` (p, m) in C order."""
    trsm = scipy.linalg.blas.ztrsm if np.iscomplexobj(lower) else scipy.linalg.blas.dtrsm
    if not transposed:
        # xᵀ Lᵀ = bᵀ
        trsm(1.0, lower, rows.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    elif np.iscomplexobj(lower):
        # xᵀ conj(L) = bᵀ
        np.conj(rows, out=rows)
        trsm(1.0, lower, rows.T, side=1, lower=1, overwrite_b=1)
        np.conj(rows, out=rows)
    else:
        trsm(1.0, lower, rows.T, side=1, lower=1, overwrite_b=1)
