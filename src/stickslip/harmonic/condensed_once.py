"""Cache of condensed structures, shared by checks, the static equilibrium and all loads of a study."""

from hashlib import blake2b
from weakref import WeakKeyDictionary

import numpy as np
import scipy.sparse

from stickslip.arrays import IntArray, Matrix
from stickslip.harmonic.dynamic_stiffness import CondensedStiffness, condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure

LARGE = 300  # dofs from which the eigenproblem of the interior takes much longer than reading the matrices

_last: "WeakKeyDictionary[Structure, tuple[bytes, CondensedStiffness]]" = WeakKeyDictionary()


def condensed_once(structure: Structure, retained: IntArray, load: HarmonicLoad) -> CondensedStiffness:
    """Prepare the exact condensation as `condense` does, from what the same structure's last one left.

    Matrices changed in place are told by their contents.
    """
    if structure.n < LARGE or load.static.size != structure.n:
        return condense(structure, retained, load)
    contents = _contents(structure, retained)
    known = _last.get(structure)
    if known is None or known[0] != contents:
        known = _last[structure] = contents, condense(structure, retained, load)
    return known[1].with_load(load)


def _contents(structure: Structure, retained: IntArray) -> bytes:
    digest = blake2b(np.asarray(retained, dtype=np.int64).tobytes())
    for matrix in (structure.mass, structure.damping, structure.stiffness, structure.loss):
        for own in _arrays(matrix):
            digest.update(own.tobytes())
    return digest.digest()


def _arrays(matrix: Matrix | None) -> tuple[np.ndarray, ...]:
    if matrix is None:
        return ()
    if scipy.sparse.issparse(matrix):
        plain = scipy.sparse.csr_array(matrix)
        return plain.data, plain.indices, plain.indptr
    return (np.asarray(matrix),)
