"""Constraint modes and normal modes of the separate bodies of a structure.

Bodies that are coupled only through kept dofs are solved one by one: equal blades have equal frequencies, and a Krylov method
may miss some of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix, as_array
from stickslip.errors import SingularError
from stickslip.model.fe.factorisation import Say, Solve, factorise
from stickslip.model.modes import SHIFT, connected_parts, lowest_modes, submatrix
from stickslip.model.rigid.motion import refuse_unheld
from stickslip.model.structure import Structure
from stickslip.reduction.basis import BLOCK

RIGID_SQUARE = 1e-4  # square of a frequency over the shift: less is a rigid motion with rounding
FIRST_GUESS = 16  # modes computed first if a frequency limits them


@dataclass(frozen=True, eq=False)
class Body:
    """A body: dofs that the matrices couple.

    Parameters
    ----------
    dofs
        (m,) indices in the structure.
    stiffness, mass
        (m, m) matrices of the body.
    solve
        Solver with ``stiffness − shift · mass``.
    shift
        Shift in rad²/s²; zero if the body is supported, slightly negative if it is free to move.
    """

    dofs: IntArray
    stiffness: Matrix
    mass: Matrix
    solve: Solve
    shift: float = 0.0

    @property
    def heavy(self) -> int:
        """Number of dofs with mass, which bounds the number of modes."""
        return int(np.count_nonzero(self.mass.diagonal()))


@dataclass(frozen=True, eq=False)
class BodyModes:
    """Modes of several bodies, lowest first.

    Parameters
    ----------
    squares
        (m,) squares of circular frequencies in rad²/s²; exactly zero for rigid motions of a free body.
    body
        (m,) number of the body that moves.
    column
        (m,) column in the shapes of this body.
    shapes
        Mass-normalised modes, an array for each body.
    """

    squares: FloatArray
    body: IntArray
    column: IntArray
    shapes: Sequence[Matrix]

    def first(self, count: int) -> "BodyModes":
        """Return the lowest `count` modes."""
        return BodyModes(self.squares[:count], self.body[:count], self.column[:count], self.shapes)

    def of(self, body: int) -> tuple[IntArray, Matrix]:
        """Return the indices of the modes in which a body moves, and its shapes."""
        mine = np.flatnonzero(self.body == body)
        return mine, self.shapes[body][:, self.column[mine]]


def bodies_fixed_at(structure: Structure, keep: IntArray, place: str, say: Say) -> list[Body]:
    """Return the bodies that remain when the dofs `keep` are fixed.

    Raises
    ------
    SingularError
        If a body can move rigidly; the message names it and begins with `place`.
    """
    inner = np.setdiff1d(np.arange(structure.n), keep)
    if not inner.size:
        return []
    refuse_unheld(submatrix(structure.stiffness, inner, inner), structure.dofs.take(inner), place)
    bodies = []
    for part in _parts(structure, inner):
        K, M = _own(structure, part)
        bodies.append(Body(part, K, M, factorise(K, say=say)))
    return bodies


def loose_bodies(structure: Structure, inner: IntArray, say: Say) -> list[Body]:
    """Return the bodies among the dofs `inner` with all other dofs fixed; bodies that can move rigidly get a shift."""
    bodies = []
    for part in _parts(structure, inner):
        K, M = _own(structure, part)
        try:
            refuse_unheld(K, structure.dofs.take(part), "loose_bodies")
            bodies.append(Body(part, K, M, factorise(K, say=say)))
        except SingularError:
            stiff, heavy = (float(abs(m.diagonal()).sum()) for m in (K, M))
            shift = -SHIFT * (stiff / heavy or 1.0)
            bodies.append(Body(part, K, M, factorise(K - shift * M, say=say), shift))
    return bodies


def _parts(structure: Structure, inner: IntArray) -> list[IntArray]:
    own = (submatrix(m, inner, inner) for m in (structure.stiffness, structure.mass))
    return [inner[part] for part in connected_parts(*own)]


def _own(structure: Structure, part: IntArray) -> tuple[Matrix, Matrix]:
    K, M = (submatrix(m, part, part) for m in (structure.stiffness, structure.mass))
    return K, M


def lowest_of(bodies: Sequence[Body], count: int, say: Say) -> BodyModes:
    """Return the `count` lowest modes of all bodies, or all modes if there are fewer."""
    found = [_modes(body, min(count, body.heavy), say) for body in bodies]
    return _sorted(found).first(count)


def modes_up_to(bodies: Sequence[Body], limit: float, say: Say, most: float = np.inf) -> BodyModes:
    """Return all modes below `limit` (rad/s), but for each body not many more than `most`."""
    found = []
    for body in bodies:
        count = min(FIRST_GUESS, body.heavy)
        squares, shapes = _modes(body, count, say)
        while count < min(body.heavy, most) and squares[-1] <= limit**2:
            count = min(2 * count, body.heavy)
            squares, shapes = _modes(body, count, say)
        below = squares <= limit**2
        found.append((squares[below], shapes[:, below]))
    return _sorted(found)


def _modes(body: Body, count: int, say: Say) -> tuple[FloatArray, Matrix]:
    if not count:
        return np.zeros(0), np.zeros((body.dofs.size, 0))
    say(f"{count} modes of {body.dofs.size} dofs")
    squares, shapes = lowest_modes(body.stiffness, body.mass, count, body.solve, body.shift)
    return np.where(np.abs(squares) < -RIGID_SQUARE * body.shift, 0.0, squares), shapes


def _sorted(found: Sequence[tuple[FloatArray, Matrix]]) -> BodyModes:
    sizes = [len(squares) for squares, _ in found]
    squares = np.concatenate([np.zeros(0), *(s for s, _ in found)])
    order = np.argsort(squares, kind="stable")
    body = np.repeat(np.arange(len(found)), sizes)
    column = np.concatenate([np.zeros(0, dtype=np.int64), *(np.arange(s) for s in sizes)])
    return BodyModes(squares[order], body[order], column[order], [shapes for _, shapes in found])


def fill_constraint_modes(
    structure: Structure, keep: IntArray, bodies: Sequence[Body], columns: Matrix, say: Say
) -> None:
    """Write the static shapes of unit displacements of `keep` into `columns` (n, k), which holds zeros."""
    columns[keep, np.arange(keep.size)] = 1.0
    say(f"{keep.size} constraint modes")
    for body in bodies:
        load = submatrix(structure.stiffness, body.dofs, keep)
        for first in range(0, keep.size, BLOCK):
            some = np.arange(first, min(first + BLOCK, keep.size))
            block = load[:, some]
            block = as_array(block)
            touched = some[np.any(block != 0, axis=0)]
            if touched.size:
                columns[np.ix_(body.dofs, touched)] = -body.solve(block[:, touched - first])
