"""Two steel plates pressed on each other, with as many contact points as wanted.

The lower plate is clamped at one end, the upper one at the other, and they touch over their whole face, with a rough surface: preload and
stiffness vary from point to point. Retained are the relative displacements of the contact points alone and all else is condensed; or nothing is
reduced.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import skfem
from skfem.helpers import ddot, dot, sym_grad, trace

from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.sparse_stiffness import Unreduced
from stickslip.model.damping import rayleigh_damping
from stickslip.model.fe.solid import Material
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.response.system import System

LENGTH, WIDTH, THICKNESS = 0.2, 0.12, 0.008  # m, each plate
MODES = 40
DAMPING = 0.01, (200.0, 4000.0)  # Rayleigh: ratio at two frequencies, Hz
PRESSURE = 1e6  # Pa
NORMAL, TANGENTIAL = 1e12, 0.7e12  # N/m per m²
FRICTION = 0.3
GRIDS = {
    8: (4, 2),
    12: (4, 3),
    16: (4, 4),
    24: (6, 4),
    36: (6, 6),
    50: (10, 5),
    100: (10, 10),
    150: (15, 10),
    200: (20, 10),
    300: (20, 15),
    1000: (40, 25),
    2000: (50, 40),
    5000: (100, 50),
}
# unit forces at the free corner of the upper plate: the first opens contacts, the second makes them slip
PULLS = {"lift": (0.3, 0.2, 0.9), "slide": (0.95, 0.3, 0.0)}


@dataclass(frozen=True, eq=False)
class Plates:
    """The system, whose outputs are the free corner of the upper plate in x, y, z, and the sum of its preloads."""

    system: System
    preload: float  # N

    def load(self, share: float, pull: str = "lift") -> HarmonicLoad:
        """Return the clamping that balances the preloads, and an excitation of `share` times their sum in harmonic 1."""
        interface = self.system.interface
        clamping = interface.gap_operator.T @ interface.resting_force()
        force = np.zeros(self.system.structure.n, dtype=complex)
        force[self.system.outputs] = share * self.preload * np.array(PULLS[pull])
        return HarmonicLoad(clamping, {1: force})


def two_plates(points: int, seed: int = 0) -> Plates:
    """Assemble and reduce the plates with `points` contact points, a key of `GRIDS`."""
    full, gaps, tip = _assembled(points)
    reduced = craig_bampton(full, np.concatenate([gaps, tip]), MODES)
    reduced = rayleigh_damping(reduced, *DAMPING)
    return _with_contacts(reduced, np.arange(gaps.size), gaps.size + np.arange(3), seed)


def unreduced_plates(points: int, seed: int = 0) -> Plates:
    """Assemble the same plates and reduce nothing: all dofs stay, and their matrices are sparse."""
    full, gaps, tip = _assembled(points)
    damped = rayleigh_damping(full, *DAMPING)
    return _with_contacts(Unreduced(damped), gaps, tip, seed)


def _assembled(points: int) -> tuple[Structure, np.ndarray, np.ndarray]:
    """Return both plates, the dofs that are gaps, contact by contact, and those of the free corner."""
    along, across = GRIDS[points]
    mass, stiffness, places = _plate(along + 2, across)
    n = len(places)
    bottom, top = places[:, 2] == 0.0, places[:, 2] == places[:, 2].max()
    inside = (places[:, 0] > 1e-9) & (places[:, 0] < LENGTH - 1e-9)
    lower, upper = np.flatnonzero(top & inside), np.flatnonzero(bottom & inside)
    # upper = lower + gap at the contact points: their rows of the upper plate become the gaps
    three = np.arange(3)
    rows = (3 * n + 3 * upper[:, None] + three).ravel()
    follow = scipy.sparse.coo_array(
        (np.ones(rows.size), (rows, (3 * lower[:, None] + three).ravel())), shape=(6 * n, 6 * n)
    )
    to_full = scipy.sparse.csr_array(scipy.sparse.eye_array(6 * n) + follow)
    free = np.concatenate([np.repeat(places[:, 0] > 1e-9, 3), np.repeat(places[:, 0] < LENGTH - 1e-9, 3)])
    free = np.flatnonzero(free)
    matrices = [
        scipy.sparse.csr_array(to_full.T @ scipy.sparse.block_diag([a, a], format="csr") @ to_full)[free][:, free]
        for a in (mass, stiffness)
    ]
    new = np.full(6 * n, -1)
    new[free] = np.arange(free.size)
    nodes = np.repeat(np.arange(2 * n), 3)[free]
    table = Dofs(nodes, tuple("xyz"[i % 3] for i in free), np.vstack([places, places])[nodes])
    full = Structure(matrices[0], scipy.sparse.csr_array(matrices[0].shape), matrices[1], table)
    gaps = new[rows]
    corner = np.flatnonzero(top & (places[:, 0] < 1e-9) & (places[:, 1] < 1e-9))[0]
    return full, gaps, new[3 * n + 3 * corner + three]


def _with_contacts(structure: Structure | Unreduced, gaps: np.ndarray, tip: np.ndarray, seed: int) -> Plates:
    points = gaps.size // 3
    area = LENGTH * WIDTH / points
    rng = np.random.default_rng(seed)
    rough = np.exp(0.5 * rng.standard_normal(points))
    laws = tuple(
        ElasticCoulomb(
            k_t=TANGENTIAL * area, k_w=TANGENTIAL * area, k_n=NORMAL * area, mu=FRICTION, preload=PRESSURE * area * r
        )
        for r in rough
    )
    entries = np.ones(gaps.size), (np.arange(gaps.size), gaps)
    operator = scipy.sparse.csr_array(entries, shape=(gaps.size, structure.n))
    names = tuple(str(i) for i in range(points))
    system = System(structure, Interface(names, laws, operator), tip)
    return Plates(system, float(PRESSURE * area * rough.sum()))


def _plate(along: int, across: int) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array, np.ndarray]:
    """Return mass, stiffness (node-major) and node places of one free plate, two elements thick."""
    grid = skfem.MeshHex.init_tensor(
        np.linspace(0, LENGTH, along), np.linspace(0, WIDTH, across), np.linspace(0, THICKNESS, 3)
    )
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
    both = [scipy.sparse.csr_array(form.assemble(basis))[order][:, order] for form in (mass, stiffness)]
    return both[0], scipy.sparse.csr_array((both[1] + both[1].T) / 2), grid.p.T
