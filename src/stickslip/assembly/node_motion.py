"""Displacement of all mesh nodes in a solved motion, with the static correction of the reduction."""

from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, IntArray, Matrix
from stickslip.assembly.build import physical
from stickslip.assembly.full_field import Everywhere
from stickslip.assembly.locations import picked
from stickslip.assembly.model import Model
from stickslip.assembly.part_reduction import at_speed, steady_load
from stickslip.assembly.response_request import asked
from stickslip.assembly.skin import mesh_motion
from stickslip.model.fe.factorisation import Factorisation, factorise

NO_MOTION = 1e-14  # of the stiffest coordinate: coordinates of the reduction that no elastic part feels


@dataclass(frozen=True, eq=False)
class NodeMotion:
    """Displacement of the nodes of a meshed part, of one sector in its own axes.

    Parameters
    ----------
    reduced
        (H+1, nodes, 3) complex coefficients of ``u(t) = Re Σ U_h exp(i h ω t)`` in m, by the reduced model.
    correction
        (H+1, nodes, 3) the static correction: what the modes that the reduction leaves out contribute, quasi-statically.
    """

    reduced: ComplexArray
    correction: ComplexArray

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
        found[name] = NodeMotion(reduced, more)
    return found


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
