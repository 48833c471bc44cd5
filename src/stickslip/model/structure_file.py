"""Structures in files: one ``.npz``, plain arrays only, with a version.

Layout: ``format``, ``version``; each matrix dense under its name or as ``name.data``, ``name.indices``, ``name.indptr``,
``name.shape`` (compressed rows); ``dofs.node``, ``dofs.component``, ``dofs.position``, ``dofs.part``; ``set_names`` and
``set.0``, ``set.1`` and so on. `numpy.load` opens it without this package.
"""

from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.npz import BROKEN, Arrays, read_npz, write_npz
from stickslip.model.structure import Dofs, Structure

FORMAT = "stickslip structure"
VERSION = 1
MATRICES = ("mass", "damping", "stiffness")


def save_structure(structure: Structure, path: Path | str) -> None:
    """Write a structure with all its fields to an ``.npz`` file; sparse matrices stay sparse.

    Parameters
    ----------
    structure
        Dense or sparse, real or complex, reduced or not.
    path
        Path that ends in ``.npz``; an existing file is replaced when the new one is complete.

    Raises
    ------
    InputError
        If a set is no list of indices, or the file cannot be written.
    """
    arrays: Arrays = {"format": np.array(FORMAT), "version": np.array(VERSION)}
    for name in MATRICES:
        arrays |= _packed(name, getattr(structure, name))
    if structure.basis is not None:
        arrays |= _packed("basis", structure.basis)
    if structure.loss is not None:
        arrays |= _packed("loss", structure.loss)
    dofs = structure.dofs
    arrays |= {
        "dofs.node": dofs.node,
        "dofs.component": np.array(dofs.component, dtype=np.str_),
        "dofs.position": dofs.position,
        "dofs.part": np.array(dofs.part, dtype=np.str_),
        "set_names": np.array(list(structure.sets), dtype=np.str_),
    }
    for i, (name, members) in enumerate(structure.sets.items()):
        index = np.asarray(members)
        if index.size and index.dtype.kind not in "iu":
            raise input_error(f"save_structure: set {name!r}", f"holds {index.dtype} values", "Give dof indices.")
        arrays[f"set.{i}"] = index.astype(np.int64)
    write_npz(Path(path), arrays)


def load_structure(path: Path | str) -> Structure:
    """Read a structure written by `save_structure`; nothing in the file is executed.

    Raises
    ------
    InputError
        If the file is missing, damaged, from another program or a later version, or its arrays are inconsistent.
    """
    path = Path(path)
    arrays = read_npz(path)
    kind, version = arrays.get("format"), arrays.get("version")
    if kind is None or kind.shape or str(kind) != FORMAT or version is None or version.shape:
        raise input_error(
            str(path),
            "is an .npz file, but not of a structure",
            "Use save_structure to write one, or read_matrix_files for single matrices.",
        )
    if str(version) != str(VERSION):
        raise input_error(
            str(path),
            f"has version {version} of the format, this program reads {VERSION}",
            "Use the newest stickslip, or write the file again.",
        )
    try:
        return _unpack(arrays)
    except KeyError as error:
        raise input_error(str(path), f"lacks the array {error}", BROKEN) from error
    except (ValueError, TypeError, IndexError) as error:
        raise input_error(str(path), f"its parts do not fit together ({error})", BROKEN) from error


def _unpack(arrays: Arrays) -> Structure:
    dofs = Dofs(
        arrays["dofs.node"].astype(np.int64, casting="safe"),
        tuple(str(c) for c in arrays["dofs.component"].astype(np.str_, casting="safe")),
        arrays["dofs.position"].astype(float, casting="safe"),
        tuple(str(p) for p in arrays["dofs.part"].astype(np.str_, casting="safe")),
    )
    if len(dofs.part) != len(dofs):
        raise ValueError(f"{len(dofs)} dofs, {len(dofs.part)} parts")
    basis = None
    if "basis" in arrays or "basis.data" in arrays:
        basis = unpacked("basis", arrays)
        if basis.ndim != 2 or basis.shape[1] != len(dofs):
            raise ValueError(f"basis of shape {basis.shape} for {len(dofs)} dofs")
    loss = unpacked("loss", arrays) if "loss" in arrays or "loss.data" in arrays else None
    mass, damping, stiffness = (unpacked(name, arrays) for name in MATRICES)
    sets = {
        str(name): _members(arrays[f"set.{i}"], len(dofs))
        for i, name in enumerate(arrays["set_names"].astype(np.str_, casting="safe"))
    }
    return Structure(mass, damping, stiffness, dofs, sets, basis, loss)


def _members(index: IntArray, n: int) -> IntArray:
    index = index.astype(np.int64, casting="safe")
    if index.ndim != 1 or (index.size and not 0 <= index.min() <= index.max() < n):
        raise ValueError(f"a set with dofs outside 0 .. {n - 1}")
    return index


def _packed(name: str, matrix: Matrix) -> Arrays:
    if not scipy.sparse.issparse(matrix):
        return {name: np.asarray(matrix)}
    csr = scipy.sparse.csr_array(matrix)
    return {
        f"{name}.data": csr.data,
        f"{name}.indices": csr.indices,
        f"{name}.indptr": csr.indptr,
        f"{name}.shape": np.array(csr.shape),
    }


def unpacked(name: str, arrays: Arrays) -> Matrix:
    """Return the matrix `name` of a structure file's arrays; `ValueError` if they are inconsistent."""
    if name in arrays:
        return _numbers(arrays[name])
    parts = tuple(arrays[f"{name}.{part}"] for part in ("data", "indices", "indptr"))
    if parts[1].dtype.kind not in "iu" or parts[2].dtype.kind not in "iu":
        raise ValueError(f"{name}: indices that are no integers")
    matrix = scipy.sparse.csr_array(
        (_numbers(parts[0]), *parts[1:]), shape=tuple(int(s) for s in arrays[f"{name}.shape"])
    )
    matrix.check_format(full_check=True)
    return matrix


def _numbers(array: Matrix) -> Matrix:
    if array.dtype.kind not in "fciu":
        raise ValueError(f"a matrix of {array.dtype} values")
    return array
