"""Choice of the reader for a model file, and summary of its content."""

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.errors import InputError, input_error
from stickslip.model.fe.factorisation import Say, silent
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.abaqus import read_abaqus_matrices
from stickslip.model.readers.ansys import read_ansys_full
from stickslip.model.readers.ansys_archive import read_ansys_archive
from stickslip.model.readers.ansys_results import AnsysResults, read_ansys_results
from stickslip.model.readers.calculix import read_calculix_matrices
from stickslip.model.readers.calculix_deck import Deck, assemble_deck, read_deck
from stickslip.model.readers.frd import FrdResults, read_frd
from stickslip.model.readers.matrix_files import names_in, read_matrix_files, refuse_other_names
from stickslip.model.readers.nastran import NastranResults, read_nastran_op2
from stickslip.model.readers.summary import ModelSummary, mesh_summary, results_summary, structure_summary
from stickslip.model.readers.text import read_text
from stickslip.model.readers.units import SI, Units
from stickslip.model.structure import Structure
from stickslip.model.structure_file import load_structure

Model = Structure | Deck | SolidMesh | FrdResults | AnsysResults | NastranResults
READS = ".inp, .sti, .mas, .dof, .frd, .full, .rst, .cdb, .op2, .mtx, .npz, .h5"


@dataclass(frozen=True)
class _Files:
    """Files and settings of a reader."""

    path: Path
    units: Units
    mesh: Path | None
    mass: Path | None
    damping: Path | None
    nodes: Path | None
    plausible: bool


def read_model(
    path: Path | str,
    *,
    units: Units = SI,
    mesh: Path | str | None = None,
    mass: Path | str | None = None,
    damping: Path | str | None = None,
    nodes: Path | str | None = None,
    plausible: bool = True,
) -> Model:
    """Read a model or results; the suffix of the file selects the reader.

    Parameters
    ----------
    path
        A deck (``.inp``), results (``.frd``, ``.rst``, ``.op2``), a mesh (``.cdb``), a structure of `save_structure`
        (``.npz``) or matrices; if these are in several files, the stiffness.
    units
        Unit system of the file; a structure of `save_structure` is in SI.
    mesh, nodes
        Source of node positions, for matrices without them: see the reader of each format.
    mass, damping
        Further files, for matrices in several files. With CalculiX, the mass of another job; with Abaqus, the default is the file
        with ``MASS`` in place of ``STIF`` in its name.
    plausible
        False accepts implausible mass, size and materials.

    Returns
    -------
    Structure, Deck, SolidMesh, FrdResults, AnsysResults or NastranResults
        In SI.

    Raises
    ------
    InputError
        If the kind of file is unknown, a further file is missing, or a file is damaged.
    """
    path = Path(path)
    files = _Files(path, units, _path(mesh), _path(mass), _path(damping), _path(nodes), plausible)
    suffixes = [s.lower() for s in path.suffixes]
    suffix = suffixes[-2] if suffixes[-1:] == [".gz"] and suffixes[:-1] else "".join(suffixes[-1:])
    if suffix not in _READERS:
        raise input_error(
            str(path),
            f"no reader for files {suffix!r}" if suffix else "a file without suffix",
            _OTHERS.get(suffix, f"Files that are read: {READS}."),
            use="Use",
        )
    if not path.is_file():
        read_text(path)  # its error suggests a similar file name
    return _READERS[suffix](files)


def read_structure(place: str, path: Path, **settings: Any) -> Structure:
    """Read matrices; `place` is the key for messages, all other arguments are as in `read_model`.

    Raises
    ------
    InputError
        If the file holds results or a deck, and as in `read_model`.
    """
    found = read_model(path, **settings)
    if isinstance(found, Structure):
        return found
    raise input_error(
        place, f"{path.name} holds results, not a model", "Give a deck (.inp), an archive (.cdb), or matrices."
    )


def refuse_other_models(place: str, reader: str, found: object) -> None:
    """Refuse the result of a user's reader if it is neither a structure nor a mesh."""
    if not isinstance(found, Structure | SolidMesh):
        raise input_error(
            place,
            f"{reader} returns a {type(found).__name__}",
            "Return a stickslip.Structure or a stickslip.model.SolidMesh, in SI.",
        )


def _path(name: Path | str | None) -> Path | None:
    return None if name is None else Path(name)


def model_summary(model: Model, *, n_modes: int = 10, units: Units = SI, say: Say = silent) -> ModelSummary:
    """Return a summary of a model from `read_model`.

    Parameters
    ----------
    model
        The model; a deck is assembled.
    n_modes
        Number of natural frequencies to compute.
    units
        Unit system of the reader, for remarks on mass and size.
    say
        Called with a sentence before each long step.
    """
    if isinstance(model, Structure):
        return structure_summary(model, n_modes=n_modes, units=units, say=say)
    if isinstance(model, SolidMesh):
        return mesh_summary(model)
    if isinstance(model, Deck):
        return _deck_summary(model, n_modes, units, say)
    if isinstance(model, FrdResults):
        return _frd_summary(model)
    dofs = model.dofs
    return results_summary(dofs.node, dofs.position, list(model.frequencies_hz), ())


def _frd_summary(results: FrdResults) -> ModelSummary:
    """Summarise results; the real and imaginary part of a travelling mode count as one frequency."""
    modes = {f.step: f for f in results.fields if f.frequency_hz is not None}
    steps = Counter(f.name for f in results.fields)
    remarks = [f"field {name} at {count} steps" for name, count in steps.items()]
    diameters = [f.nodal_diameter for f in modes.values() if f.nodal_diameter is not None]
    if diameters:
        remarks.append("nodal diameters of the modes: " + ", ".join(map(str, diameters)))
    found = [f.frequency_hz for f in modes.values() if f.frequency_hz is not None]
    summary = results_summary(results.nodes.numbers, results.nodes.points, found, tuple(remarks))
    cells = None if results.mesh is None else len(results.mesh.cells)
    return replace(summary, cells=cells)


def _deck_summary(deck: Deck, n_modes: int, units: Units, say: Say) -> ModelSummary:
    shown = mesh_summary(deck.mesh, f"deck of {deck.element_type} cells")
    structure = assemble_deck(deck)
    found = structure_summary(structure, n_modes=n_modes, units=units, say=say)
    remarks = [f"material {name}: {m.in_words}" for name, m in deck.materials.items()]
    if deck.sectors:
        remarks.append(f"one of {deck.sectors} sectors; frequencies with free cyclic faces")
    if deck.speed is not None:
        remarks.append(f"rotates at {deck.speed:.6g} rad/s; frequencies at rest")
    of_matrices = list(found.remarks)
    if deck.links is not None:
        # equations may resist a rigid rotation, and positions are the deck's own
        of_matrices = [text for text in of_matrices if not text.startswith("Positions:")]
        held = np.count_nonzero(deck.held)
        remarks.append(f"{deck.mesh.points.size - held - structure.n} dofs follow others (equations, turned supports)")
    remarks += [*deck.told, *(f"passed over: {text}" for text in deck.ignored)]
    return replace(
        found,
        kind=shown.kind,
        cells=shown.cells,
        sets=shown.sets,
        nodes=shown.nodes,
        members=shown.members,
        box=shown.box,
        remarks=(*remarks, *of_matrices),
    )


def _calculix(files: _Files) -> Structure:
    return read_calculix_matrices(
        files.path, units=files.units, mesh=files.mesh or files.nodes, mass=files.mass, plausible=files.plausible
    )


def _npz(files: _Files) -> Structure:
    if files.mass is None and "stiffness" not in names_in(files.path):
        refuse_other_names(files.path)
        return load_structure(files.path)
    return _neutral(files)


def _mtx(files: _Files) -> Structure:
    """Read an ``.mtx`` file, which is Matrix Market or Abaqus' text format."""
    if read_text(files.path).startswith("%%MatrixMarket"):
        return _neutral(files)
    partner = re.sub("STIF", "MASS", files.path.name)
    mass = files.mass or files.path.with_name(partner)
    if mass == files.path or not mass.is_file():
        raise _lacks(files.path, "$mass, the matrix of the mass")
    nodes = files.nodes or files.mesh
    if nodes is None:
        raise _lacks(files.path, "$nodes, a deck or a CSV file with the positions of the nodes")
    return read_abaqus_matrices(
        files.path, mass, damping=files.damping, nodes=nodes, units=files.units, plausible=files.plausible
    )


def _neutral(files: _Files) -> Structure:
    here = names_in(files.path)  # one file may contain all matrices
    mass = files.mass or (files.path if "mass" in here else None)
    damping = files.damping or (files.path if "damping" in here else None)
    if mass is None:
        raise _lacks(files.path, "$mass, the matrix of the mass")
    return read_matrix_files(
        files.path, mass, nodes=files.nodes, damping=damping, units=files.units, plausible=files.plausible
    )


def _lacks(path: Path, what: str) -> InputError:
    return input_error(str(path), "is one matrix, not a whole model", f"Give {what}.", mass="mass=…", nodes="nodes=…")


_READERS: dict[str, Callable[[_Files], Model]] = {
    ".inp": lambda f: read_deck(f.path, units=f.units, plausible=f.plausible),
    ".sti": _calculix,
    ".mas": _calculix,
    ".dof": _calculix,
    ".frd": lambda f: read_frd(f.path, units=f.units),
    ".full": lambda f: read_ansys_full(f.path, nodes=f.nodes or f.mesh, units=f.units, plausible=f.plausible),
    ".rst": lambda f: read_ansys_results(f.path, units=f.units),
    ".cdb": lambda f: read_ansys_archive(f.path, units=f.units),
    ".op2": lambda f: read_nastran_op2(f.path, units=f.units),
    ".mtx": _mtx,
    ".npz": _npz,
    ".h5": _neutral,
    ".hdf5": _neutral,
}
_OTHERS = {
    ".op4": "$use read_nastran_op4, which asks for the names of the matrices in it.",
    ".pch": "$use read_nastran_dmig, which asks for the names of the matrices in it.",
    ".bdf": "$use read_nastran_dmig, which asks for the names of the matrices in it.",
    ".dat": "$use read_nastran_dmig for bulk data; results of CalculiX are in its .frd file.",
}
