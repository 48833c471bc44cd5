"""A box-shaped sector of a wheel whose upper sides rub on those of its neighbours, and two such boxes beside each other.

Lower sides are tied from sector to sector, the bottom is clamped. Sectors stand in a row with one set of axes, so that no coordinate turns.
On the upper sides nodes, usually 100, meet as many of the neighbour, under a preload that varies from point to point.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import skfem
from skfem.helpers import ddot, dot, sym_grad, trace

from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import LinearSide
from stickslip.model.damping import rayleigh_damping
from stickslip.model.fe.solid import Material
from stickslip.model.structure import Dofs, Structure, join
from stickslip.reduction.contact_coordinates import in_relative_coordinates
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.tuned import tuned_wheel
from stickslip.response.system import System

WIDTH, DEPTH, DISK, BLADE = 0.03, 0.06, 0.03, 0.09  # m
MODES = 40
NORMAL, TANGENTIAL = 4e11, 3e11  # N/m per m²
PRESSURE, FRICTION = 1e6, 0.3
DAMPING = 0.005, (300.0, 6000.0)
PULL = 0.8, 0.5, 0.3
FORCE = 0.05  # N per N of preload, on top


@dataclass(frozen=True, eq=False)
class Rubbing:
    """A system and its load; its outputs are a node on top of the first box, in x, y, z."""

    system: System
    load: HarmonicLoad


def box(along: int = 10, up: int = 10) -> tuple[Structure, np.ndarray, np.ndarray]:
    """Return a box without damping, and the places (p,) of contacts on its two sides in order, as node numbers (2, p).

    Its sets ``low`` and ``high`` are the lower parts of the sides, which are tied; `along` and `up` count the contacts each way.
    """
    heights = np.concatenate([np.linspace(0, DISK, 5), DISK + np.linspace(0, BLADE, up + 1)[1:]])
    grid = skfem.MeshHex.init_tensor(np.linspace(0, WIDTH, 4), np.linspace(0, DEPTH, along), heights)
    basis = skfem.Basis(grid, skfem.ElementVector(skfem.ElementHex1()))
    steel = Material()
    first, second = steel.lame

    @skfem.BilinearForm
    def stiffness(u, v, _):
        return first * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * second * ddot(sym_grad(u), sym_grad(v))

    @skfem.BilinearForm
    def mass(u, v, _):
        return steel.density * dot(u, v)

    order = basis.nodal_dofs.T.ravel()
    m, k = (scipy.sparse.csr_array(form.assemble(basis))[order][:, order] for form in (mass, stiffness))
    x, y, z = grid.p
    free = np.flatnonzero(np.repeat(z > 1e-9, 3))
    place = np.full(3 * grid.p.shape[1], -1)
    place[free] = np.arange(free.size)
    order = np.lexsort((y, z))
    sides = [order[np.abs(x[order] - at) < 1e-9] for at in (0.0, WIDTH)]
    below = [side[(z[side] > 1e-9) & (z[side] < DISK + 1e-9)] for side in sides]
    above = [side[z[side] > DISK + 1e-9] for side in sides]
    inside = (x > 1e-9) & (x < WIDTH - 1e-9)
    top = int(np.argmax(np.where(inside, z + y - 1e-3 * x, 0.0)))

    def dofs(nodes: np.ndarray) -> np.ndarray:
        return place[(3 * np.asarray(nodes).reshape(-1, 1) + np.arange(3)).ravel()]

    names = {"low": below[0], "high": below[1], "left": above[0], "right": above[1]}
    sets = {name: dofs(nodes) for name, nodes in names.items()} | {"tip": dofs(top)}
    table = Dofs(free // 3, tuple("xyz"[i % 3] for i in free), grid.p.T[free // 3])
    k = (k + k.T) / 2
    own = [scipy.sparse.csr_array(a[free][:, free]) for a in (m, k)]
    empty = scipy.sparse.csr_array(own[0].shape)
    return Structure(own[0], empty, own[1], table, sets)


def sector(sectors: int, along: int = 10, up: int = 10) -> CyclicSector:
    """Return the box as one of so many sectors."""
    structure = box(along, up)
    return CyclicSector(structure, sectors, structure.dof_set("low"), structure.dof_set("high"), axis=None)


def rubbing_wheel(sectors: int, engine_order: int, harmonics: int, along: int = 10, up: int = 10) -> Rubbing:
    """Return the tuned wheel under an engine order."""
    one = sector(sectors, along, up)
    s = one.structure
    damped = rayleigh_damping(s, *DAMPING)
    one = CyclicSector(damped, sectors, one.low, one.high, axis=None)
    left, right, tip = (s.dof_set(name) for name in ("left", "right", "tip"))
    gaps = -_frames(right, s.n), _frames(left, s.n)
    keep = np.concatenate([left, right, tip])
    wheel, operator = tuned_wheel(one, engine_order, harmonics, gaps, keep=keep, n_modes=MODES)
    force = np.zeros(s.n)
    force[tip] = PULL
    return _loaded(wheel, operator, wheel.project(force, 1), _nodes(wheel), along * up)


def rubbing_pair(along: int = 10, up: int = 10) -> Rubbing:
    """Return two boxes, the right side of the first on the left side of the second."""
    one = box(along, up)
    both = []
    for side in ("right", "left"):
        keep = np.union1d(one.dof_set(side), one.dof_set("tip"))
        both.append(craig_bampton(one, keep, MODES))
    pair = rayleigh_damping(join(a=both[0], b=both[1]), *DAMPING)
    gaps = _frames(pair.dof_set("b.left"), pair.n) - _frames(pair.dof_set("a.right"), pair.n)
    structure, operator = in_relative_coordinates(pair, gaps)
    force = np.zeros(pair.n)
    force[pair.dof_set("a.tip")] = PULL
    return _loaded(structure, operator, structure.project(force), _nodes(structure), along * up)


def _nodes(side: LinearSide) -> np.ndarray:
    """Return the coordinates of the first node that is one."""
    return np.flatnonzero(side.dofs.node >= 0)[:3]


def _frames(dofs: np.ndarray, n: int) -> scipy.sparse.csr_array:
    """Return the operator (3 p, n) to the displacements of nodes along t = y, w = z, n = x."""
    order = dofs.reshape(-1, 3)[:, [1, 2, 0]].ravel()
    return scipy.sparse.csr_array((np.ones(order.size), (np.arange(order.size), order)), shape=(order.size, n))


def _loaded(side: LinearSide, operator: np.ndarray, force: np.ndarray, outputs: np.ndarray, points: int) -> Rubbing:
    """Return the system with its contacts, under the pressure and `FORCE` times its sum at `force`; `points` are those of an interface."""
    area = DEPTH * BLADE / points
    interfaces = operator.shape[0] // 3 // points
    one = np.exp(0.5 * np.random.default_rng(0).standard_normal(points))
    rough = np.tile(one, interfaces)
    laws = tuple(
        ElasticCoulomb(
            k_t=TANGENTIAL * area, k_w=TANGENTIAL * area, k_n=NORMAL * area, mu=FRICTION, preload=PRESSURE * area * r
        )
        for r in rough
    )
    names = tuple(str(i) for i in range(rough.size))
    interface = Interface(names, laws, scipy.sparse.csr_array(operator))
    clamping = interface.gap_operator.T @ interface.resting_force()
    system = System(side, interface, outputs)
    preload = PRESSURE * area * one.sum()
    return Rubbing(system, HarmonicLoad(clamping, {1: FORCE * preload * np.asarray(force, dtype=complex)}))
