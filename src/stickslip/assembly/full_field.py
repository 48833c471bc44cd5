"""Recovery of the motion of every node from the reduced coordinates, and its static correction."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.assembly.build import linear_side, physical, system_of
from stickslip.assembly.joints.ties import MEAN
from stickslip.assembly.locations import AXES, picked
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import at_speed, steady_load, with_ways_back
from stickslip.assembly.response_request import asked
from stickslip.assembly.sides.mistuned import of_all, system_of_all
from stickslip.assembly.sides.wheel import faces_of
from stickslip.assembly.skin import mesh_motion
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.model.fe.factorisation import Factorisation, factorise
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import Part
from stickslip.reduction.waves import wave
from stickslip.response.system import System

NO_MOTION = 1e-14  # of the stiffest coordinate: coordinates of the reduction that no elastic part feels
COLUMNS = 64  # number of columns of a recovery matrix that are computed together
Felt = Callable[[DynamicStiffness], DynamicStiffness]


def as_it_is(side: DynamicStiffness) -> DynamicStiffness:
    """Return the dynamic stiffness unchanged, for a steady motion."""
    return side


@dataclass(frozen=True, eq=False)
class Nodes:
    """The nodes of a part.

    Parameters
    ----------
    part
        Name of the part.
    numbers
        (n,) node numbers; 0 for the centre of a rigid body.
    points
        (n, 3) positions, m.
    cells
        (m, k) nodes of each cell in VTK order; None if the part has no mesh.
    cell_numbers
        (m,) numbers of the cells; None without a mesh.
    motion
        (3 n, N) CSR from the dofs of all parts to x, y, z of the nodes; rows of clamped ones are zero.
    """

    part: str
    numbers: IntArray
    points: FloatArray
    cells: IntArray | None
    cell_numbers: IntArray | None
    motion: Matrix

    def of(self, field: Matrix) -> Matrix:
        """Return displacements (..., n, 3) from fields (..., N) on the dofs of all parts."""
        moved = self.motion @ field.reshape(-1, field.shape[-1]).T
        return np.asarray(moved).T.reshape(*field.shape[:-1], -1, 3)


def nodes_of(model: Model) -> tuple[Nodes, ...]:
    """Return the nodes of all parts with known positions.

    Raises
    ------
    InputError
        If no part has such nodes.
    """
    found = [own for name in model.parts if (own := _nodes(model, name)) is not None]
    if not found:
        raise input_error("export", "no part has nodes with a place in space", "Give the matrices their nodes.")
    return tuple(found)


def _nodes(model: Model, name: str) -> Nodes | None:
    part, first = model.parts[name], model.places.offset(name)
    mesh, table = part.mesh, part.structure.dofs
    if mesh is not None:
        motion = mesh_motion(part, mesh) @ picked(model.places.own(name), model.places.n)
        return Nodes(name, mesh.numbers, mesh.points, mesh.cells, mesh.cell_numbers, motion)
    placed = np.isin(table.component, AXES) & np.isfinite(table.position).all(axis=1)
    rows = np.flatnonzero(placed & ((table.node >= 0) | (part.body is not None)))
    if not rows.size:
        return None
    numbers, where, place = np.unique(table.node[rows], return_index=True, return_inverse=True)
    dofs = np.full((numbers.size, 3), -1)
    dofs[place, [AXES.index(table.component[row]) for row in rows]] = rows + first
    motion = picked(dofs.ravel(), model.places.n)
    return Nodes(name, np.maximum(numbers, 0), table.position[rows[where]], None, None, motion)


@dataclass(frozen=True, eq=False)
class Everywhere:
    """Recovery of all dofs of all parts from the retained coordinates of a motion.

    Parameters
    ----------
    system, load
        As in `Assembled`.
    output_labels, outputs
        Labels of the outputs, and (k, 2) the sector and the dof of all parts of each.
    order, sectors
        Engine order or wave number, and number of sectors of a wheel; 0 and 1 for a single structure.
    alike
        Whether all sectors have the same motion with a phase shift; otherwise each sector has its own.
    """

    system: System
    load: HarmonicLoad
    output_labels: tuple[str, ...]
    outputs: IntArray
    order: int
    sectors: int
    alike: bool
    _expand: Callable[[Matrix, int], Matrix]

    def fields(self, omega: float, retained: ComplexArray, more: IntArray, felt: Felt = as_it_is) -> ComplexArray:
        """Return the (s, H+1, N) motion of all dofs of each sector in its own axes, or of one sector if all are alike.

        Parameters
        ----------
        omega
            In rad/s.
        retained
            (H+1, n) motion of the retained coordinates of the system and of `more`, in ascending order, m.
        more
            Further coordinates with known motion.
        felt
            Function from the dynamic stiffness of a steady motion to the dynamic stiffness of this motion.
        """
        condensed = felt(self.system.condensed(self.load, len(retained) - 1, more))
        every = condensed.recover(omega, retained)
        each = [np.atleast_2d(self._expand(own, h)) for h, own in enumerate(every)]
        return np.stack(each, axis=1)

    def way(self, rows: Matrix, harmonic: int) -> Matrix:
        """Return the (r, n) matrix from the coordinates to operators `rows` (r, N) on all dofs of a sector.

        It is in single precision. Some columns are computed at a time: single columns would take as long as the
        reduction, all columns as much memory as the mesh.
        """
        n = self.system.structure.n
        each = (np.eye(n)[:, k : k + COLUMNS] for k in range(0, n, COLUMNS))
        found = np.hstack([rows @ self._expand(own, harmonic) for own in each])
        return found.astype(np.complex64 if np.iscomplexobj(found) else np.float32)

    def modes(self, harmonic: int) -> Matrix:
        """Return the (N, n) matrix from the coordinates to all dofs of a sector, in the wave of a harmonic."""
        return np.asarray(self._expand(np.eye(self.system.structure.n), harmonic))

    def phase(self, harmonic: int, sector: int) -> complex:
        """Return the phase factor of a harmonic between a sector and sector 0, if all sectors are alike.

        Each sector has its own axes.
        """
        return complex(wave(harmonic * self.order, self.sectors).phase) ** sector


def everywhere(model: Model, harmonics: int, *, every_wave: bool = False, wave_number: int | None = None) -> Everywhere:
    """Reduce a model again, with the recovery of all its dofs.

    Parameters
    ----------
    model
        The solved model.
    harmonics, every_wave
        As in the call of `assemble`. Other values may change the number of modes of a wheel.
    wave_number
        Wave number of a self-excited motion of a tuned wheel; None: it follows from the loads.
    """
    what = asked(model, harmonics)
    names, dofs = what.labels.names, what.labels.dofs
    if model.mistuning is not None:
        n = model.sectors
        wheel, (_, held), load = system_of_all(model, what, with_ways_back)
        outputs = np.column_stack([np.repeat(np.arange(n), dofs.size), np.tile(dofs, n)])
        named, order = of_all(names, n), what.order or 0
        return Everywhere(held, load, named, outputs, order, n, False, lambda q, _: wheel.expand(q))
    order = (what.order if wave_number is None else wave_number) or 0
    more = range(model.sectors) if every_wave else ()
    linear = linear_side(model, order, harmonics, what.kept, what.stay, with_ways_back, more)
    _, held, load = system_of(model, linear, what)
    outputs = np.column_stack([np.zeros_like(dofs), dofs])
    return Everywhere(held, load, names, outputs, order, model.sectors, True, linear.expand)


@dataclass(frozen=True, eq=False)
class NodeMotion:
    """Displacement of the nodes of a meshed part, of one sector in its own axes.

    Parameters
    ----------
    reduced
        (H+1, nodes, 3) complex coefficients of ``u(t) = Re Σ U_h exp(i h ω t)`` in m, by the reduced model.
    correction
        (H+1, nodes, 3) the static correction: what the modes that the reduction leaves out contribute, quasi-statically.
    phases
        (H+1,) factor of each harmonic between a sector and the one before, each in its own axes.
    faces
        (p, 2) indices of nodes of the low cyclic face and of their partners on the high one, without those on the axis; None without
        faces of like meshes.
    """

    reduced: ComplexArray
    correction: ComplexArray
    phases: ComplexArray
    faces: IntArray | None = None

    @property
    def whole(self) -> ComplexArray:
        """(H+1, nodes, 3) displacement with the correction, m."""
        return self.reduced + self.correction


def node_motion(model: Model, whole: Everywhere, fields: ComplexArray, omega: float) -> dict[str, NodeMotion]:
    """Return the displacement of all mesh nodes by part, with the static correction (mode acceleration).

    The reduced motion leaves a residual ``f_h - K u_h + (h ω)² M u_h`` inside the parts. Its static displacement with contact points,
    loaded nodes and rigid bodies held is what the omitted modes contribute far below their frequencies. A part of it that the kept modes
    can express is their damping force, and is taken out (K-orthogonally). Damping and fluid are neglected in the correction.

    Parameters
    ----------
    model
        The model, of one structure or a tuned wheel.
    whole
        Its recovery.
    fields
        (1, H+1, N) motion of all dofs of `Everywhere.fields`, m.
    omega
        Frequency, rad/s.

    References
    ----------
    Craig & Kurdila, Fundamentals of Structural Dynamics, 2nd ed. 2006, section 11.4 (mode-acceleration method).
    """
    corrected = _corrections(model, whole, fields[0], omega)
    found = {}
    for name, part in model.parts.items():
        if part.solid is None or part.mesh is None:
            continue
        motion, own = mesh_motion(part, part.mesh), model.places.own(name)
        reduced, more = (_at_nodes(motion, field[:, own]) for field in (fields[0], corrected))
        phases = np.array([whole.phase(h, 1) for h in range(len(reduced))])
        found[name] = NodeMotion(reduced, more, phases, _paired_nodes(name, part, part.mesh))
    return found


def _paired_nodes(name: str, part: Part, mesh: SolidMesh) -> IntArray | None:
    """Return (p, 2) mesh nodes of both cyclic faces; None without faces, or with meshes that do not match."""
    sector = faces_of(name, part) if part.sectors > 1 else None
    if sector is None or sector.axis is None or part.cyclic == MEAN:
        return None
    numbers = np.stack([part.structure.dofs.node[own] for own in (sector.low, sector.high)], axis=1)
    apart = np.unique(numbers[numbers[:, 0] != numbers[:, 1]], axis=0)
    order = np.argsort(mesh.numbers, kind="stable")
    return np.asarray(order[np.searchsorted(mesh.numbers, apart, sorter=order)])


def _at_nodes(motion: Matrix, field: ComplexArray) -> ComplexArray:
    return np.asarray((motion @ field.T).T).reshape(len(field), -1, 3)


def _corrections(model: Model, whole: Everywhere, field: ComplexArray, omega: float) -> ComplexArray:
    """Return the (H+1, N) static correction of a motion (H+1, N) of all dofs, m."""
    loads = _forces(model, len(field))
    full = model.full(model.speed)
    kept, _ = physical(model, asked(model, len(field) - 1).kept)
    found = np.zeros_like(field)
    ways: dict[int, _Way] = {}
    for h in range(len(field)):
        if not (np.any(field[h]) or np.any(loads[h])):
            continue
        number = h * whole.order % whole.sectors
        if number not in ways:
            ways[number] = _way(model, whole, full.stiffness, kept, h, number)
        inertia = (h * omega) ** 2 * (full.mass @ field[h])
        found[h] = ways[number].of(loads[h] - full.stiffness @ field[h] + inertia)
    found[0] = found[0].real
    return found


def _forces(model: Model, harmonics: int) -> ComplexArray:
    """Return the (H+1, N) loads on all dofs of a sector, N: those of the model, and static ones of steady rotation and heat."""
    found = np.zeros((harmonics, model.places.n), dtype=complex)
    for name, force in asked(model, harmonics - 1).forces.items():
        found[model.driven[name]] += force
    if model.loads_steadily:
        spin, rest = model.spin(model.speed), model.steady
        for name, part in model.parts.items():
            structure = at_speed(name, part, spin, rest[name])
            found[0, model.places.own(name)] += steady_load(part, spin, structure, rest[name])
    return found


@dataclass(frozen=True, eq=False)
class _Way:
    """Static displacement of the parts in one wave with the kept dofs held, without what the reduction can express."""

    onto: Matrix  # (N, m) from the free coordinates of the full model to all dofs
    solve: Factorisation  # of its (m, m) stiffness
    modes: Matrix  # (N, n) from the coordinates of the reduction to all dofs
    stiffness: Matrix  # (N, N) of all parts
    reduced: Matrix  # (n, n) of the reduction

    def of(self, residual: ComplexArray) -> ComplexArray:
        """Return the (N,) displacement of a residual (N,), m."""
        right = self.onto.conj().T @ residual
        moved = self.onto @ (self.solve(right.real) + 1j * self.solve(right.imag))
        share = scipy.linalg.lstsq(self.reduced, self.modes.conj().T @ (self.stiffness @ moved), cond=NO_MOTION)[0]
        return np.asarray(moved - self.modes @ share)


def _way(model: Model, whole: Everywhere, stiffness: Matrix, kept: IntArray, harmonic: int, number: int) -> _Way:
    full = model.at(model.speed, number)
    onto = picked(np.arange(model.places.n), model.places.n) if full.basis is None else full.basis
    held = np.unique(scipy.sparse.csr_array(onto)[kept].nonzero()[1])
    free = np.setdiff1d(np.arange(full.n), held)
    modes = whole.modes(harmonic)
    inner = scipy.sparse.csr_array(full.stiffness)[free][:, free]
    reduced = modes.conj().T @ (stiffness @ modes)
    return _Way(scipy.sparse.csr_array(onto)[:, free], factorise(inner), modes, stiffness, reduced)
