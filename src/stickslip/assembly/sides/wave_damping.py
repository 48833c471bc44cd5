"""Damping of a wave from the modal damping of its parts."""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from stickslip.arrays import Matrix
from stickslip.errors import input_error
from stickslip.model.damping import Damping
from stickslip.model.structure import Structure

JOINED = 1e-12  # of the largest entry: what leads from part to part


@dataclass(frozen=True)
class DampingOfParts:
    """Modal damping of parts that are connected by contacts only.

    Parameters
    ----------
    parts
        Name and damping of each part; None: the part has no modal damping.
    """

    parts: tuple[tuple[str, Damping | None], ...]

    def of_modes(self, moving: Structure) -> Structure:
        """Return a wave of all parts with the modal damping of each part.

        Raises
        ------
        InputError
            If parts are connected by more than contacts.
        """
        owner = np.array(moving.dofs.part)
        damping = _dense(moving.damping).astype(complex if moving.is_complex else float)
        for name, own in self.parts:
            if own is None:
                continue
            rows = np.flatnonzero(owner == name)
            others = np.flatnonzero(owner != name)
            _refuse_joined(name, moving, np.ix_(rows, others))
            square = np.ix_(rows, rows)
            mass, skew, stiffness = (_dense(m)[square] for m in (moving.mass, moving.damping, moving.stiffness))
            alone = Structure(mass, skew, stiffness, moving.dofs.take(rows))
            damping[square] = _dense(own.of_modes(alone).damping)
        sparse = scipy.sparse.issparse(moving.stiffness)
        return replace(moving, damping=scipy.sparse.csr_array(damping) if sparse else damping)


def _refuse_joined(name: str, moving: Structure, across: tuple[Matrix, ...]) -> None:
    for matrix in (moving.mass, moving.stiffness):
        dense = _dense(matrix)
        if np.abs(dense[across]).max(initial=0.0) > JOINED * np.abs(dense).max(initial=0.0):
            raise input_error(
                f"part.{name}.damping",
                "differs from that of a part it is joined to, and modes are those of both together",
                "Give them the same damping by modes, or another form.",
            )


def _dense(matrix: Matrix) -> Matrix:
    return np.asarray(matrix.toarray() if scipy.sparse.issparse(matrix) else matrix)
