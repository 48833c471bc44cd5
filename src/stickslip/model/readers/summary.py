"""Summary of a model: counts, mass, size, first frequencies, plausibility. Matrices that are not passive are refused."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import InputError, StickslipError, input_error
from stickslip.model.fe.factorisation import DENSE, Say, silent
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import mass_rank, normal_modes, refuse_bad_mass
from stickslip.model.readers.entries import SYMMETRY, asymmetry
from stickslip.model.readers.positions import doubt_about_positions
from stickslip.model.readers.units import ARGUMENTS, SI, Units, doubt_about_units, translational_mass
from stickslip.model.structure import Structure

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
    values, shapes = np.linalg.eigh(matrix.toarray() if scipy.sparse.issparse(matrix) else matrix)
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
