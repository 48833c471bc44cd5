"""Reductions of one model in several states, as at several speeds, to coordinates that change as little as can be from state to state."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_coordinates, surviving_sets, with_modal_dofs
from stickslip.reduction.choice import Reduction

COMMON = 0.7  # cosine of the angle between what modes of two states span, above which they are the same ones


class ModesExchangedError(ValueError):
    """The lowest modes of two states are not the same ones: no turn brings them together."""


def modes_of(structure: Structure, keep: IntArray, reduction: Reduction) -> Matrix:
    """Return the (n, m) modes that a reduction adds to the static shapes of the kept dofs."""
    return _basis(structure, keep, reduction)[1][:, len(keep) :]


def on_modes_of_others(
    structure: Structure, keep: IntArray, reduction: Reduction, others: Sequence[Matrix]
) -> Structure:
    """Return a structure reduced to the dofs `keep` and modal coordinates that change smoothly from state to state.

    Modes of neighbouring states, as those of two speeds, may differ in sign and order, and change fast where frequencies come
    close; what they span changes little.

    Parameters
    ----------
    structure
        In one state.
    keep
        (k,) dofs that stay physical.
    reduction
        How it is reduced.
    others
        Modes in other states (`modes_of`). Of one: the structure's own modes are turned to be as near to them as can be. Of
        several: most of what all of them span takes the place of its own, half as many modes again.

    Raises
    ------
    ModesExchangedError
        If there is one other state, and a mode has taken the place of another one.
    """
    small, basis = _basis(structure, keep, reduction)
    static, modes = basis[:, : len(keep)], basis[:, len(keep) :]
    if len(others) > 1:
        common = _spanned(others, structure.mass)
        dofs = with_modal_dofs(structure.dofs.take(keep), common.shape[1])
        return in_coordinates(structure, np.hstack([static, common]), dofs, surviving_sets(structure, keep))
    (other,) = others
    sizes = [np.linalg.norm(_in_mass(m, structure.mass, m), 2) ** 0.5 for m in (modes, other)]
    left, common, right = np.linalg.svd(_in_mass(modes, structure.mass, other))
    if modes.shape != other.shape or common.min(initial=np.inf) < COMMON * sizes[0] * sizes[1]:
        raise ModesExchangedError
    turn = np.eye(small.n, dtype=np.result_type(left, right))
    turn[len(keep) :, len(keep) :] = left @ right
    turned = in_coordinates(replace(small, basis=None), turn, small.dofs, small.sets)
    return replace(turned, basis=structure.expand(basis @ turn))


def _basis(structure: Structure, keep: IntArray, reduction: Reduction) -> tuple[Structure, Matrix]:
    small = reduction.of(replace(structure, basis=None), keep)
    basis: Matrix = small.basis
    return small, basis.toarray() if scipy.sparse.issparse(basis) else np.asarray(basis)


def _in_mass(one: Matrix, mass: Matrix, other: Matrix) -> Matrix:
    return one.conj().T @ (mass @ other)


def _spanned(modes: Sequence[Matrix], mass: Matrix) -> Matrix:
    """Return a basis, of unit mass, of most of what modes of several states span, half as many again as there are of one."""
    count = max(m.shape[1] for m in modes)
    basis = np.hstack(list(modes))
    most = min(count + (count + 1) // 2, np.linalg.matrix_rank(basis))
    for _ in range(2):  # the second time for rounding
        basis = basis / np.sqrt(np.einsum("ij,ij->j", basis.conj(), mass @ basis).real)
        values, vectors = np.linalg.eigh(_in_mass(basis, mass, basis))
        basis = basis @ (vectors[:, -most:] / np.sqrt(values[-most:]))
    return np.asarray(basis)
