"""Choice of the reader for a model file, and summary of its content."""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix, as_array
from stickslip.errors import InputError, StickslipError, input_error
from stickslip.model.fe.factorisation import DENSE, Say, silent
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import mass_rank, normal_modes, refuse_bad_mass
from stickslip.model.readers.abaqus import read_abaqus_matrices
from stickslip.model.readers.ansys_archive import read_ansys_archive
from stickslip.model.readers.ansys_binary import AnsysResults, read_ansys_full, read_ansys_results
from stickslip.model.readers.calculix import read_calculix_matrices
from stickslip.model.readers.calculix_deck import Deck, assemble_deck, read_deck
from stickslip.model.readers.entries import SYMMETRY, asymmetry
from stickslip.model.readers.frd import FrdResults, read_frd
from stickslip.model.readers.matrix_files import names_in, read_matrix_files, refuse_other_names
from stickslip.model.readers.nastran import NastranResults, read_nastran_op2
from stickslip.model.readers.nastran_bulk import refuse_bulk_model
from stickslip.model.readers.positions import doubt_about_positions
from stickslip.model.readers.text import read_text
from stickslip.model.readers.units import ARGUMENTS, SI, Units, doubt_about_units, translational_mass
from stickslip.model.structure import Structure
from stickslip.model.structure_file import load_structure

ROUNDED = 1e-3  # negative eigenvalue over the largest one: less is rounding in files with few digits


def refuse_indefinite(structure: Structure, place: str) -> None:
    """Refuse a mass that is not positive, and a stiffness with a negative eigenvalue.

    Raises
    ------
    InputError
        If a matrix is indefinite; the message names the matrix and the dof.
    """
    if structure.n and abs(structure.mass).max() > 0:
        refuse_bad_mass(structure, place)
    worst = _most_negative(structure.stiffness)
    if worst is not None:
        raise input_error(
            f"{place}: stiffness",
            f"is not positive: a motion, {structure.dofs.labels[worst[0]]} the most, has {worst[1]:.6g} N/m",
            "Check its source: a sign, or a triangle of a matrix given as the whole; or give $plausible where it is meant.",
            **ARGUMENTS,
        )


def negative_damping(structure: Structure, name: str) -> tuple[str, ...]:
    """Return a warning if the damping in file `name` adds energy to a motion."""
    worst = _most_negative((structure.damping + structure.damping.conj().T) / 2)
    if worst is None:
        return ()
    dof, value = structure.dofs.labels[worst[0]], worst[1]
    text = (
        f"{name}: the damping is negative, {value:.4g} N s/m in a motion of {dof} the most: it feeds vibration instead of "
        "taking from it. Periodic solutions may be unstable; check the sign."
    )
    return (text,)


def _most_negative(matrix: Matrix) -> tuple[int, float] | None:
    """Return the dof with the largest motion in the most negative eigenvector of a Hermitian matrix, and the eigenvalue.

    For large matrices they follow from the diagonal.
    """
    if not matrix.shape[0]:
        return None
    diagonal = matrix.diagonal().real
    if matrix.shape[0] > DENSE:
        dof = int(np.argmin(diagonal))
        negative = diagonal[dof] < -ROUNDED * np.abs(diagonal).max()
        return (dof, float(diagonal[dof])) if negative else None
    values, shapes = np.linalg.eigh(as_array(matrix))
    if values[0] >= -ROUNDED * max(abs(values[-1]), abs(values[0])) or values[0] == 0:
        return None
    return int(np.argmax(np.abs(shapes[:, 0]))), float(values[0])


DIGITS = 6


@dataclass(frozen=True, eq=False)
class ModelSummary:
    """Content of the output of `stickslip inspect`; quantities that are not in the file are None.

    Parameters
    ----------
    kind
        Kind of file, e.g. ``matrices``.
    nodes, cells, dofs
        Counts.
    components
        Name -> number of dofs of that kind.
    sets
        Name -> number of members.
    members
        Kind of members of the sets: ``dofs`` of matrices, ``nodes`` of a mesh.
    mass
        (3,) mass in kg that moves with a unit translation along x, y, z, without supported dofs.
    whole_mass
        Mass in kg with clamped nodes; known for cells with materials.
    centre
        (3,) centre of the whole mass in m, or else of the mass that moves along the first direction.
    box
        (2, 3) lowest and highest coordinates in m.
    symmetric
        Whether mass and stiffness are symmetric, or Hermitian.
    rigid_modes
        Number of modes without strain among the computed ones.
    frequencies_hz
        First natural frequencies, or all frequencies stored in the file.
    remarks
        Sentences on doubtful, missing and ignored content.
    """

    kind: str
    nodes: int
    cells: int | None = None
    dofs: int | None = None
    components: Mapping[str, int] = field(default_factory=dict)
    sets: Mapping[str, int] = field(default_factory=dict)
    members: str = "dofs"
    mass: FloatArray | None = None
    whole_mass: float | None = None
    centre: FloatArray | None = None
    box: FloatArray | None = None
    symmetric: bool | None = None
    rigid_modes: int | None = None
    frequencies_hz: FloatArray | None = None
    remarks: tuple[str, ...] = ()

    def rows(self) -> list[tuple[str, str]]:
        """Return names and values of all known quantities, as texts, for a table."""
        counts = {"nodes": self.nodes, "cells": self.cells, "dofs": self.dofs}
        found = [("holds", self.kind)]
        found += [(name, str(count)) for name, count in counts.items() if count is not None]
        if self.components:
            found.append(("components", ", ".join(f"{k}: {v}" for k, v in self.components.items())))
        found += [("set " + name, f"{count} {self.members}") for name, count in self.sets.items()]
        if self.box is not None:
            spans = zip("xyz", *self.box, strict=True)
            found.append(("box (m)", ", ".join(f"{k} {a:.5g} … {b:.5g}" for k, a, b in spans)))
        if self.whole_mass is not None:
            found.append(("mass (kg)", f"{self.whole_mass:.{DIGITS}g}"))
        for name, values in (
            ("free mass x, y, z (kg)", self.mass),
            ("centre of mass (m)", self.centre),
            ("frequencies (Hz)", self.frequencies_hz),
        ):
            if values is not None:
                found.append((name, ", ".join(f"{v:.{DIGITS}g}" for v in values)))
        if self.symmetric is not None:
            found.append(("symmetric", "yes" if self.symmetric else "no"))
        if self.rigid_modes is not None:
            found.append(("rigid modes", str(self.rigid_modes)))
        return found + [("remark", text) for text in self.remarks]


def structure_summary(structure: Structure, *, n_modes: int = 10, units: Units = SI, say: Say = silent) -> ModelSummary:
    """Summarise matrices.

    Parameters
    ----------
    structure
        Structure in SI.
    n_modes
        Number of natural frequencies to compute.
    units
        Unit system of the file, for remarks on mass and size.
    say
        Called with a sentence before each long step.
    """
    dofs = structure.dofs
    remarks = []
    doubt = doubt_about_units(structure, units)
    if doubt:
        remarks.append(f"Units: {doubt}.")
    doubt = doubt_about_positions(structure)
    if doubt:
        remarks.append(f"Positions: {doubt}; they probably belong to another mesh.")
    rank, said = _rank_of_mass(structure)
    remarks += said
    finite = dofs.position[np.isfinite(dofs.position).all(axis=1)]
    symmetric = max(asymmetry(structure.mass), asymmetry(structure.stiffness)) <= SYMMETRY
    travelling = np.iscomplexobj(structure.stiffness)
    if travelling:
        remarks.append("Complex matrices, of a travelling wave.")
    mass = None if travelling else translational_mass(structure)
    summary = ModelSummary(
        "matrices",
        len(np.unique(dofs.node[dofs.node >= 0])),
        dofs=structure.n,
        components=dict(Counter(dofs.component)),
        sets={name: len(members) for name, members in structure.sets.items()},
        mass=mass,
        centre=None if mass is None else _centre(structure),
        box=np.vstack([finite.min(axis=0), finite.max(axis=0)]) if len(finite) else None,
        symmetric=symmetric,
        remarks=tuple(remarks),
    )
    if not symmetric:
        more = "Not symmetric: no frequencies computed."
        return replace(summary, remarks=(*summary.remarks, more))
    return _with_modes(summary, structure, min(n_modes, rank), say)


def _rank_of_mass(structure: Structure) -> tuple[int, list[str]]:
    """Return the number of modes (an upper bound for a large model), and a remark on motions without mass."""
    heavy = int(np.count_nonzero(structure.mass.diagonal()))
    said = [f"{structure.n - heavy} dofs have no mass."] if heavy < structure.n else []
    if not 0 < structure.n <= DENSE:
        return heavy, said
    try:
        rank = mass_rank(structure.mass)
    except InputError:  # a negative mass, which the computation of modes reports
        return heavy, said
    if rank < heavy:
        said.append(
            f"The mass has rank {rank} of {structure.n}: the other motions have none, as of few bricks with reduced integration."
        )
    return rank, said


def mesh_summary(mesh: SolidMesh, kind: str = "mesh") -> ModelSummary:
    """Summarise a mesh."""
    return ModelSummary(
        kind,
        len(mesh.points),
        cells=len(mesh.cells),
        sets={name: len(members) for name, members in mesh.node_sets.items()},
        members="nodes",
        box=np.vstack([mesh.points.min(axis=0), mesh.points.max(axis=0)]),
    )


def _centre(structure: Structure) -> FloatArray | None:
    """Return the centre of mass for the first direction in which the structure has mass."""
    components = np.array(structure.dofs.component)
    for axis in ("x", "y", "z"):
        unit = (components == axis).astype(float)
        weight = unit * np.real(structure.mass @ unit)
        if weight.sum() > 0:
            weighed = weight != 0
            return np.asarray(weight[weighed] @ structure.dofs.position[weighed] / weight.sum())
    return None


def _with_modes(summary: ModelSummary, structure: Structure, n_modes: int, say: Say) -> ModelSummary:
    if n_modes < 1:
        return summary
    try:
        modes = normal_modes(structure, n_modes, say=say)
    except StickslipError as error:  # the summary is given without frequencies
        return replace(summary, remarks=(*summary.remarks, f"No frequencies: {error}"))
    remarks = summary.remarks
    if modes.rigid:
        remarks = (*remarks, f"{modes.rigid} of its first {n_modes} modes are rigid: it is not held.")
    return replace(summary, rigid_modes=modes.rigid, frequencies_hz=modes.frequencies_hz, remarks=remarks)


def results_summary(
    nodes: IntArray, points: FloatArray, frequencies_hz: Sequence[float], remarks: tuple[str, ...]
) -> ModelSummary:
    """Summarise results: nodes (with repetitions), their positions, stored frequencies."""
    finite = points[np.isfinite(points).all(axis=1)]
    return ModelSummary(
        "results",
        len(np.unique(nodes[nodes >= 0])),
        box=np.vstack([finite.min(axis=0), finite.max(axis=0)]) if len(finite) else None,
        frequencies_hz=np.array(frequencies_hz) if len(frequencies_hz) else None,
        remarks=remarks,
    )


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
        if suffix in (".bdf", ".nas", ".dat") and path.is_file():
            refuse_bulk_model(path)
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
