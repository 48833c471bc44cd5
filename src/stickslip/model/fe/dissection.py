"""Nested dissection: an order of elimination for the matrices of solid models, from their sparsity pattern.

A. George, "Nested dissection of a regular finite element mesh", SIAM Journal on Numerical Analysis 10 (1973) 345-363. A piece is
cut midway between two distant vertices, by the difference of the distances from both. The separator is the smallest set of
vertices that covers the edges of the cut; it follows from a maximum matching (Kőnig's theorem).
"""

from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import BoolArray, IntArray, Matrix

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
