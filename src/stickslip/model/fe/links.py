"""Links between the nodes of a mesh: linear equations, eliminated exactly, point masses, springs and dashpots."""

from collections import defaultdict
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error

ROUNDING = 1e-9  # smaller coefficients, over the largest one of their equation, are rounding
PIVOT = 0.5  # least coefficient of a dof that follows, over the largest one of its equation
Row = dict[int, float]


@dataclass(frozen=True, eq=False)
class Links:
    """Links between the n nodes of a mesh.

    Parameters
    ----------
    equations
        (m, 3 n + a) CSR: ``equations @ (u, angles) = 0`` with the x, y, z of all nodes, node-major, and `a` rotations of
        reference nodes, in radians times a length. Rotations are eliminated; they have neither stiffness nor inertia.
    places
        (m,) file and line of each equation, for messages.
    mass
        (n,) point mass of each node in kg.
    springs, dashpots
        (3 n, 3 n) CSR stiffness in N/m and damping in N s/m between nodes and to the ground.
    small
        File and line of the first link that is right for small rotations only, and what it is; empty if none is.
        Steady rotation is refused with such a link: its second-order terms, like those of a pendulum, are missing.
    lasting
        (k,) nodes that shall not follow others, as those of cyclic faces.
    """

    equations: Matrix
    places: tuple[str, ...]
    mass: FloatArray
    springs: Matrix
    dashpots: Matrix
    small: str = ""
    lasting: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def nodes(self) -> IntArray:
        """Nodes that a link touches."""
        n = len(self.mass)
        touched = abs(self.equations[:, : 3 * n]).sum(axis=0) + self.springs.diagonal() + self.dashpots.diagonal()
        return np.flatnonzero(np.asarray(touched).reshape(n, 3).any(axis=1) | (self.mass > 0))


@dataclass(frozen=True, eq=False)
class Elimination:
    """Dofs without those that follow others by equations.

    Parameters
    ----------
    moving
        (k,) independent dofs among all N.
    onto
        (N, k) CSR from the independent dofs to all; rows of held dofs are zero.
    surplus
        Places of equations that follow from others and the supports.
    holding
        Places of equations that, together with others and the supports, hold a dof.
    """

    moving: IntArray
    onto: Matrix
    surplus: tuple[str, ...]
    holding: tuple[str, ...]


def eliminate(links: Links, still: BoolArray, sets: IntArray) -> Elimination:
    """Eliminate the dofs that follow others.

    Each equation gives one of its dofs as the sum of others: of those whose coefficient is at least half the largest one, that whose
    node is in the fewest sets, and of several the first. Chains of equations are followed. Rotations are eliminated first, each by the equation with the longest arm.

    Parameters
    ----------
    links
        The links of the mesh.
    still
        (3 n,) held components x, y, z of the nodes, node-major.
    sets
        (n,) number of node sets that contain each node.

    Raises
    ------
    InputError
        If an equation has dofs of `lasting` nodes only; the message names its line.
    """
    n = still.size
    rows = _rows(links.equations, still)
    lasting = np.zeros(links.equations.shape[1], dtype=bool)
    lasting[:n] = np.repeat(np.isin(np.arange(n // 3), links.lasting), 3)
    rank = np.append(np.repeat(sets, 3), np.zeros(lasting.size - n, dtype=np.int64))
    found = _Followers(lasting, rank)
    left = list(range(len(rows)))
    for angle in range(n, links.equations.shape[1]):
        left = _without_angle(found, rows, left, angle)
    surplus, holding = [], []
    for k in left:
        outcome = found.add(rows[k], links.places[k])
        if outcome == "surplus":
            surplus.append(links.places[k])
        elif outcome == "holds" and len(rows[k]) > 1:
            holding.append(links.places[k])
    follows = np.zeros(n, dtype=bool)
    follows[[dof for dof in found.rows if dof < n]] = True
    moving = np.flatnonzero(~still & ~follows)
    return Elimination(moving, found.matrix(n, moving), tuple(surplus), tuple(holding))


def _rows(equations: Matrix, still: BoolArray) -> list[Row]:
    """Return the coefficients of each equation by dof, without held dofs."""
    table = scipy.sparse.csr_array(equations)
    held = np.append(still, np.zeros(table.shape[1] - still.size, dtype=bool))
    ends = table.indptr
    return [
        {int(c): float(v) for c, v in zip(table.indices[a:b], table.data[a:b], strict=True) if v != 0.0 and not held[c]}
        for a, b in pairwise(ends)
    ]


def _without_angle(found: "_Followers", rows: list[Row], left: list[int], angle: int) -> list[int]:
    """Eliminate a rotation by the equation in which it is largest; return the equations that are left."""
    arms = {}
    for k in left:
        if any(c == angle or angle in found.rows.get(c, {}) for c in rows[k]):
            reduced = found.reduced(rows[k])
            if angle in reduced:
                arms[k] = abs(reduced[angle]) / max(map(abs, reduced.values()))
    if not arms:
        return left
    longest = max(arms, key=lambda k: arms[k])
    found.solve(found.reduced(rows[longest]), angle)
    return [k for k in left if k != longest]


class _Followers:
    """Dofs that follow others, each with its weights of independent dofs."""

    def __init__(self, lasting: BoolArray, rank: IntArray) -> None:
        self.rows: dict[int, Row] = {}
        self._users: defaultdict[int, set[int]] = defaultdict(set)
        self._lasting, self._rank = lasting, rank

    def reduced(self, row: Row) -> Row:
        """Return an equation with followers replaced by what they follow, without what is rounding."""
        out: Row = {}
        for dof, value in row.items():
            for other, weight in self.rows.get(dof, {dof: 1.0}).items():
                out[other] = out.get(other, 0.0) + value * weight
        least = ROUNDING * max(map(abs, row.values()), default=0.0)
        return {dof: value for dof, value in out.items() if abs(value) > least}

    def add(self, row: Row, place: str) -> str:
        """Let one dof of an equation follow the others; return ``follows``, ``holds`` or ``surplus``."""
        left = self.reduced(row)
        if not left:
            return "surplus"
        free = {dof: abs(value) for dof, value in left.items() if not self._lasting[dof]}
        if not free:
            raise input_error(
                place,
                "ties nodes of the cyclic faces to each other or holds them in a turned direction, which the symmetry does already or which "
                "is not read",
                "Let an equation have a node beside the faces, or take it out; hold nodes there in all directions, or along x, y or z.",
            )
        strong = [dof for dof in free if free[dof] >= PIVOT * max(free.values())]
        self.solve(left, min(strong, key=lambda dof: self._rank[dof]))
        return "follows" if len(left) > 1 else "holds"

    def solve(self, row: Row, dof: int) -> None:
        """Let `dof` follow the other dofs of a reduced equation."""
        weights = {other: -value / row[dof] for other, value in row.items() if other != dof}
        for user in self._users.pop(dof, set()):
            own = self.rows[user]
            share = own.pop(dof)
            for other, weight in weights.items():
                own[other] = own.get(other, 0.0) + share * weight
                self._users[other].add(user)
        self.rows[dof] = weights
        for other in weights:
            self._users[other].add(dof)

    def matrix(self, n: int, moving: IntArray) -> Matrix:
        """Return the (n, k) CSR matrix from the independent dofs `moving` (k,) to all."""
        column = np.full(n, -1)
        column[moving] = np.arange(moving.size)
        rows, columns, values = list(moving), list(range(moving.size)), [1.0] * moving.size
        for dof, weights in self.rows.items():
            if dof < n:
                # what is left of a rotation that no equation determines moves nothing
                own = {other: weight for other, weight in weights.items() if other < n}
                rows += [dof] * len(own)
                columns += [int(column[other]) for other in own]
                values += own.values()
        return scipy.sparse.csr_array((values, (rows, columns)), shape=(n, moving.size))
