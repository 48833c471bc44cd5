"""Cache of reduced structures on disk; the file name is a hash of the inputs."""

import dataclasses
import hashlib
import types
import uuid
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import scipy

import stickslip
from stickslip.arrays import Matrix
from stickslip.errors import InputError, input_error
from stickslip.model.fe.factorisation import Say, silent
from stickslip.model.structure import Dofs, Structure
from stickslip.model.structure_file import load_structure, save_structure

LAYOUT = 1  # version of the hash, increased when the same input gives another hash


def cached(
    reduction: Callable[..., Structure], structure: Structure, *arguments: object, folder: Path | str, say: Say = silent
) -> Structure:
    """Return ``reduction(structure, *arguments)``, or read it from disk if it was computed before.

    Parameters
    ----------
    reduction
        A function of a module, such as `craig_bampton`, `rubin` or `reduce_interface`.
    structure
        Structure to reduce. All numbers of its matrices, dofs, sets and basis enter the key.
    *arguments
        Further arguments: numbers, texts, None, arrays, and dataclasses of these such as `ModesBelow`.
    folder
        Folder of the files; it is created if missing, and may be deleted at any time.
    say
        Called with a sentence when a file is used, written, or unusable.

    Returns
    -------
    Structure
        The structure, bit by bit the same whether computed or read.

    Raises
    ------
    InputError
        If the function is not a named function of a module, or an argument has another type than those above.

    Notes
    -----
    The name of a file is the SHA-256 of the function's name, the version of this package and all content. The file contains plain
    arrays and no executable content. It appears under its name only when complete; a damaged file is computed again.
    """
    path = Path(folder) / f"{_key(reduction, structure, arguments)}.npz"
    if path.exists():
        try:
            found = load_structure(path)
        except InputError as error:
            say(f"the cached reduction is of no use and is computed again: {error}")
        else:
            say(f"reduction read from {path}")
            return found
    made = reduction(structure, *arguments)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        own = path.with_name(f"{uuid.uuid4().hex}.npz")  # two runs may write at the same time
        save_structure(made, own)
        own.replace(path)
    except (InputError, OSError) as error:
        say(f"the reduction could not be kept: {error}")
    else:
        say(f"reduction kept in {path}")
    return made


def content_hash(*values: object) -> str:
    """Return the SHA-256 of this package's version and of `values`: numbers, texts, None, arrays, dataclasses of these."""
    digest = hashlib.sha256(f"{LAYOUT} {stickslip.__version__}".encode())
    for i, value in enumerate(values):
        _add(digest, f"value {i + 1}", value)
    return digest.hexdigest()


def _key(reduction: Callable[..., Structure], structure: Structure, arguments: tuple[object, ...]) -> str:
    # a method, a partial or a callable object has bound arguments, which the hash would miss
    plain = isinstance(reduction, types.FunctionType)
    name = reduction.__qualname__ if plain else repr(reduction)
    if not plain or "<" in name:
        raise input_error(
            "cached: reduction",
            f"{name} has no name by which to find it again, or arguments of its own",
            "Give a function of a module and its arguments, e.g. cached(craig_bampton, structure, keep, 50, folder=…).",
        )
    digest = hashlib.sha256()
    _add(digest, "what", f"{LAYOUT} {stickslip.__version__} {reduction.__module__}.{name}")
    _add(digest, "structure", structure)
    for i, argument in enumerate(arguments):
        _add(digest, f"argument {i + 1}", argument)
    return digest.hexdigest()


def _add(digest: "hashlib._Hash", name: str, value: object) -> None:
    """Add a value to the hash with its name and type, so that different contents have different hashes."""
    digest.update(f"\n{name}:{type(value).__name__}:".encode())
    parts = _parts(value)
    if parts is not None:
        for part, content in parts:
            _add(digest, part, content)
    elif scipy.sparse.issparse(value):
        _add_sparse(digest, value)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
        _add_array(digest, value)
    elif isinstance(value, bool | int | float | complex | str | np.number | None):
        digest.update(repr(value).encode())
    else:
        raise input_error(
            f"cached: {name}",
            f"a {type(value).__name__} has no content that could be compared",
            "Give numbers, texts, arrays, or dataclasses of these.",
        )


def _parts(value: object) -> list[tuple[str, object]] | None:
    """Return the named parts of a value; None for a value without parts."""
    if isinstance(value, Dofs):
        words = "\0".join([*value.component, "", *value.part])
        return [("node", value.node), ("position", value.position), ("words", words)]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [(field.name, getattr(value, field.name)) for field in dataclasses.fields(value)]
    if isinstance(value, Mapping):
        return [(str(key), value[key]) for key in sorted(value)]
    if isinstance(value, tuple | list):
        return [(str(i), item) for i, item in enumerate(value)]
    return None


def _add_array(digest: "hashlib._Hash", array: Matrix) -> None:
    digest.update(f"{array.dtype.str}{array.shape}".encode())
    digest.update(np.ascontiguousarray(array).data)


def _add_sparse(digest: "hashlib._Hash", matrix: Matrix) -> None:
    csr = scipy.sparse.csr_array(matrix)
    digest.update(f"{csr.shape}".encode())
    for array in (csr.indptr, csr.indices):
        _add_array(digest, array.astype(np.int64))
    _add_array(digest, csr.data)
