"""Matrices from Nastran's OP4 files, and modes from OP2 files, through the optional package pyYeti."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.errors import did_you_mean, input_error
from stickslip.model.readers.nastran_bulk import NastranDofs, assembled, read_nastran_dofs, real_symmetric
from stickslip.model.readers.nastran_library import (
    CUT_SHORT,
    check_lines,
    check_records,
    existing_file,
    is_binary,
    nastran_library,
    reading,
)
from stickslip.model.readers.units import Units, check_units, in_si
from stickslip.model.structure import Dofs, Structure


@dataclass(frozen=True, eq=False)
class NastranResults:
    """Modes in an OP2 file of Nastran.

    Parameters
    ----------
    frequencies_hz
        (k,) natural frequencies.
    shapes
        (n, k) modes along the basic axes, mass-normalised in SI where Nastran normalised them to mass; (0, k) if
        the file has none.
    dofs
        Table of the n coordinates; scalar points appear as modal coordinates.
    """

    frequencies_hz: FloatArray
    shapes: FloatArray
    dofs: Dofs


def read_nastran_op4(
    path: Path | str,
    *,
    mass: str,
    stiffness: str,
    geometry: Path | str,
    dof_set: str,
    damping: str | None = None,
    units: Units | None = None,
    plausible: bool = True,
) -> Structure:
    """Read mass, stiffness and damping from an OP4 file, text or binary, of any precision and byte order.

    Coordinates with neither mass nor stiffness are left out.

    Parameters
    ----------
    path
        The file, as ``OUTPUT4`` writes it.
    mass, stiffness, damping
        Names of the matrices, e.g. ``"maa"`` and ``"kaa"``; if several have the same name, ``"maa[0]"`` is the first and
        ``"maa[-1]"`` the last.
    geometry
        Source of degrees of freedom and positions: the ``.op2`` file, the bulk data or the ``.asm`` file (``EXTSEOUT``) of the
        same model.
    dof_set
        Nastran's set of the matrices: ``"g"``, ``"f"``, ``"a"`` ...; sets other than ``"g"`` need an ``.op2``
        file with the table ``USET``, or an ``.asm`` file, which contains its a-set.
    units
        Unit system of the model, SI by default; it is not in the files.
    plausible
        Whether mass and size are checked for plausibility.

    Returns
    -------
    Structure
        Sparse, in SI, along the basic axes. Scalar points are coordinates of the kind ``mode``. The set ``massless`` contains
        the coordinates without mass, if any.

    Raises
    ------
    InputError
        If a file is damaged, a name unknown, or the matrices do not have the size of the set.
    StickslipError
        If pyYeti is not installed.
    """
    units = Units.si() if units is None else units
    path = existing_file(path)
    names = [name.lower() for name in (mass, stiffness, damping) if name is not None]
    known = read_nastran_dofs(geometry)
    rows = known.rows(dof_set)
    if dof_set == "g" and known.constraint:
        raise input_error(
            known.constraint,
            "holds degrees of freedom or ties them, which matrices of the g-set do not show",
            "Give the .op2 file with the table USET and a set without them, or a file with the GRID and CORD2 cards alone to "
            "take the matrices as they are.",
        )
    found = op4_matrices(path, names, partial(_check_size, path, known, dof_set))
    dependent = np.intersect1d(known.sets.get("m", []), rows)
    if len(dependent):
        raise input_error(
            f"{path}: {dof_set}-set",
            f"holds {len(dependent)} degrees of freedom that depend on others (MPC, RBE), without the equations",
            "Write the matrices of the f-set or the a-set.",
        )
    free = np.flatnonzero(~np.isin(rows, known.sets.get("s", [])))  # the s-set is constrained (SPC)
    whole = [real_symmetric(found[name], f"{path}: {name}") for name in names]
    matrices = [matrix[free][:, free] for matrix in whole]
    structure = assembled(matrices, known, rows[free])
    structure = in_si(structure, units)
    if plausible:
        check_units(structure, units, str(path))
    return structure


def _check_size(path: Path, known: NastranDofs, dof_set: str, name: str, shape: tuple[int, int]) -> None:
    """Refuse a matrix that does not belong to the set; the message names the sets of its size."""
    n = len(known.rows(dof_set))
    if shape == (n, n):
        return
    fits = [other for other, rows in known.sets.items() if shape == (len(rows), len(rows))]
    sizes = ", ".join(f"{other} {len(rows)}" for other, rows in known.sets.items())
    raise input_error(
        f"{path}: {name}",
        f"is {shape[0]} x {shape[1]}, the {dof_set}-set of {known.place} has {n} degrees of freedom",
        f"Sets of that size: {', '.join(fits)}." if fits else f"Give the geometry of the same run; its sets: {sizes}.",
    )


def op4_matrices(path: Path, names: list[str], check: Callable[[str, tuple[int, int]], None]) -> dict[str, Matrix]:
    """Return the named matrices of a file, sparse and unchanged.

    Parameters
    ----------
    path
        The file, text or binary.
    names
        Names in lower case, with an index if several matrices have the same name.
    check
        Called with the name and the shape in the file, before memory is allocated.
    """
    op4 = nastran_library("op4")
    (check_records if is_binary(path) else check_lines)(path)
    plain = {name: name.split("[")[0] for name in names}
    with reading(path):
        there, shapes, *_ = op4.dir(str(path), verbose=False)
        places = {}
        for name, word in plain.items():
            same = [i for i, other in enumerate(there) if other == word]
            if not same:
                raise input_error(str(path), f"holds no matrix {word!r}", did_you_mean(word, sorted(set(there))))
            places[name] = _pick(path, name, len(same)) % len(same)
            check(name, tuple(shapes[same[places[name]]]))
        # sparse, whatever the header says: memory then depends on the stored entries only
        read = op4.load(str(path), namelist=list(plain.values()), into="list", sparse=True)
        return {
            name: scipy.sparse.csr_array(
                [matrix for other, matrix in zip(*read[:2], strict=True) if other == plain[name]][i]
            )
            for name, i in places.items()
        }


def _pick(path: Path, name: str, count: int) -> int:
    """Return the index of ``name`` or ``name[index]`` among `count` matrices of that name."""
    plain = name.split("[", maxsplit=1)[0]
    index = re.fullmatch(r"[^\[]+(?:\[(-?\d{1,6})\])?", name)
    if index is None or (index[1] is None and count > 1):
        raise input_error(
            str(path),
            f"holds {count} matrices {name!r}",
            f"Say which: '{plain}[0]' is the first, '{plain}[-1]' the last.",
        )
    pick = int(index[1] or 0)
    if not -count <= pick < count:
        raise input_error(str(path), f"has no {name!r}: there are {count}", "Count from 0.")
    return pick


def read_nastran_op2(path: Path | str, *, units: Units | None = None) -> NastranResults:
    """Read natural frequencies and modes from an OP2 file (``PARAM,POST,-1``).

    Parameters
    ----------
    path
        The file.
    units
        Unit system of the model, SI by default; it is not in the file.

    Raises
    ------
    InputError
        If the file is damaged or has no natural frequencies.
    StickslipError
        If pyYeti is not installed.
    """
    units = Units.si() if units is None else units
    path = existing_file(path)
    check_records(path)
    with reading(path):
        with nastran_library("op2").OP2(str(path)) as file:
            there = any(str(name).startswith("LAMA") for name in file.dbnames)
            found = file.rdparampost(get_mats=False, get_dr_tables=False, get_ougs=True) if there else {}
        table = found.get("lama")
        if table is None:
            raise input_error(
                str(path),
                "holds no natural frequencies (table LAMA)",
                "Run SOL 103 with PARAM,POST,-1 and DISPLACEMENT(PLOT)=ALL.",
            )
        frequencies = np.asarray(table, dtype=float)[:, 4] / units.time
        modes = next((v for k, v in found.items() if k in {"ougv1", "oug1", "bophig"}), None)
    if not np.isfinite(frequencies).all():
        raise input_error(str(path), "has frequencies that are not finite", CUT_SHORT)
    if modes is None:
        empty = Dofs(np.empty(0, dtype=np.int64), (), np.empty((0, 3)))
        return NastranResults(frequencies, np.zeros((0, len(frequencies))), empty)
    return _with_modes(path, frequencies, modes, units)


def _with_modes(path: Path, frequencies: FloatArray, table: Any, units: Units) -> NastranResults:
    """Combine pyYeti's table of modes, rows (grid, component), with the geometry in the same file."""
    known = read_nastran_dofs(path)
    with reading(path):
        wanted = 10 * np.asarray(table.index.get_level_values(0), dtype=np.int64)
        wanted += np.asarray(table.index.get_level_values(1), dtype=np.int64)
        shapes = np.asarray(table, dtype=float)
    if not np.isfinite(shapes).all():
        raise input_error(str(path), "has modes that are not finite", CUT_SHORT)
    key = 10 * known.ids + known.components
    order = np.argsort(key, kind="stable")
    rows = order[np.minimum(np.searchsorted(key[order], wanted), len(key) - 1)]
    if (key[rows] != wanted).any() or shapes.shape != (len(rows), len(frequencies)):
        raise input_error(
            str(path),
            f"has modes of shape {shapes.shape}, {len(frequencies)} frequencies and {len(key)} degrees of freedom, "
            "which do not belong together",
            "Write one solution of one structure to a file.",
        )
    turn, dofs = known.rotation(rows), known.table(rows)
    # φᵀMφ = 1 in the file's units and in SI; rotations have the unit of a displacement over a length
    scale = units.lengths(dofs) / (np.sqrt(units.mass) * units.length)
    shapes = shapes if turn is None else turn @ shapes
    position = units.length * dofs.position
    return NastranResults(frequencies, scale[:, None] * shapes, Dofs(dofs.node, dofs.component, position))
