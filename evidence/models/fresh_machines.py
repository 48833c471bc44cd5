"""Three families of small systems that no rule was tuned on, beside those of `random_machines`.

====== ==============================================================================================================
packet 3 to 5 blades in a row, two masses each with x and z, coupled at their tips by shrouds that are pressed or stand
       apart, friction in the plane or along x alone; an inter-blade phase angle, and in half of the systems a second
       harmonic of the load, a tenth to a half of the first
ring   a mistuned bladed disk of 5 to 9 sectors, disk and blade mass each, all sectors; under the rim of every second
       one or of each a friction ring of constant normal load (Jenkins), or one that is pressed by rotation and
       lifts off; a travelling wave of one engine order
stops  one or two cantilevers that hit stops on both sides, on a spring that hardens or softens (cubic), and rub on a
       joint of many sliders (Iwan) or one
====== ==============================================================================================================

Damping ratios from 2e-4 to 2e-2, contact stiffness 0.1 to 30 times that of the mode, loads over two decades. Ranges of frequency as there.
"""

from collections.abc import Callable

import numpy as np

from evidence.models.random_machines import (
    Drawn,
    Random,
    cantilever,
    decades,
    first_frequencies,
    modal_damping,
    modes_of,
)
from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Dofs, Structure
from stickslip.response.forced.response import Sweep
from stickslip.response.system import System

Built = tuple[System, HarmonicLoad, str]


def draw_fresh(family: str, seed: int, number: int) -> Drawn:
    """Draw system `number` of a family: ``packet``, ``ring`` or ``stops``."""
    rng = np.random.default_rng([seed, number, sorted(FAMILIES).index(family)])
    system, load, note = FAMILIES[family](rng)
    free, stuck = first_frequencies(system, load)
    low, high = 0.92 * min(free, stuck), min(1.08 * max(free, stuck), 2.5 * free)
    sweep = Sweep(omega_range=(low, high), low=max(load.harmonics))
    return Drawn(number, family, system, load, sweep, note)


def packet(rng: Random) -> Built:
    """Blades in a row that touch at their shrouds."""
    blades, omega = int(rng.integers(3, 6)), 2 * np.pi * decades(rng, 80.0, 800.0)
    chain = np.array([[2.0, -1.0], [-1.0, 1.0]])
    chain *= omega**2 / np.linalg.eigvalsh(chain)[0]
    turn = rng.uniform(0.0, 0.5)
    c, s = np.cos(turn), np.sin(turn)
    stiff = np.array([[c, -s], [s, c]]) @ np.diag([1.0, rng.uniform(2.0, 9.0)])
    own = np.kron(chain, stiff @ np.array([[c, s], [-s, c]]))
    own = 0.5 * (own + own.T)
    K = np.zeros((4 * blades, 4 * blades))
    for i in range(blades):
        K[4 * i : 4 * i + 4, 4 * i : 4 * i + 4] = own * (1.0 + 0.02 * rng.standard_normal())
    damping, ratio = decades(rng, 2e-4, 2e-2), decades(rng, 2.0, 300.0)
    shake = np.zeros(4 * blades, dtype=complex)
    shake[2::4] = np.exp(1j * rng.uniform(0.0, 2 * np.pi) * np.arange(blades))
    planar, apart = rng.uniform() < 0.3, rng.uniform() < 0.3
    contact = omega**2 * decades(rng, 0.1, 30.0)
    laws, rows = [], []
    for i in range(blades - 1):
        angle = rng.uniform(0.2, 1.2)
        row = np.zeros((3, 4 * blades))
        for blade, sign in ((i, -1.0), (i + 1, 1.0)):
            row[0, 4 * blade + 2 : 4 * blade + 4] = sign * np.array([np.cos(angle), np.sin(angle)])
            row[2, 4 * blade + 2 : 4 * blade + 4] = sign * np.array([-np.sin(angle), np.cos(angle)])
        k_t, k_n = contact * decades(rng, 0.6, 1.6), contact * decades(rng, 0.6, 2.0)
        preload = ratio * rng.uniform(0.5, 1.0)
        if apart and rng.uniform() < 0.6:
            preload = -k_n / (2.0 * damping * omega**2) * decades(rng, 5e-3, 0.3)
        mu = decades(rng, 0.1, 0.7)
        if planar:
            laws.append(CoupledCoulomb(k_t=k_t, k_n=k_n, mu=mu, preload=preload))
        else:
            laws.append(ElasticCoulomb(k_t=k_t, k_w=0.0, k_n=k_n, mu=mu, preload=preload))
        rows.append(row)
    loads = {1: shake}
    if rng.uniform() < 0.5:
        loads[2] = rng.uniform(0.1, 0.5) * shake**2 * np.exp(1j * rng.uniform(0.0, 2 * np.pi))
    structure = lumped(np.eye(4 * blades), K, damping, ("x", "z"))
    names = tuple(f"S{i}" for i in range(blades - 1))
    system = System(structure, Interface(names, tuple(laws), np.vstack(rows)), np.arange(2, 4 * blades, 4))
    note = f"packet of {blades}, {'planar, ' if planar else ''}{'apart, ' if apart else ''}preload {ratio:.3g}, harmonics {sorted(loads)}, damping {damping:.1e}"
    return system, HarmonicLoad(np.zeros(structure.n), loads), note


def ring(rng: Random) -> Built:
    """All sectors of a mistuned disk over a friction ring."""
    sectors, omega = int(rng.integers(5, 10)), 2 * np.pi * decades(rng, 80.0, 800.0)
    n = 2 * sectors
    M = np.diag(np.tile([rng.uniform(2.0, 8.0), 1.0], sectors))
    K = np.zeros((n, n))
    for i in range(sectors):
        disk, blade, other = 2 * i, 2 * i + 1, 2 * ((i + 1) % sectors)
        one = omega**2 * (1.0 + 0.01 * rng.standard_normal())
        K[np.ix_([disk, blade], [disk, blade])] += one * np.array([[1.0, -1.0], [-1.0, 1.0]])
        K[disk, disk] += 3.0 * omega**2
        K[np.ix_([disk, other], [disk, other])] += 4.0 * omega**2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    damping, ratio = decades(rng, 2e-4, 2e-2), decades(rng, 0.3, 30.0)
    lifts = rng.uniform() < 0.4
    laws: list[Jenkins | ElasticCoulomb] = []
    rows = []
    for i in range(0, sectors, int(rng.integers(1, 3))):
        row = np.zeros((3, n))
        row[0, 2 * i] = 1.0
        k_t = omega**2 * decades(rng, 0.3, 10.0)
        if lifts:
            row[2, 2 * i] = rng.uniform(0.2, 1.0)  # the rim tilts: its motion opens the contact, too
            laws.append(
                ElasticCoulomb(
                    k_t=k_t, k_w=0.0, k_n=k_t * decades(rng, 0.5, 2.0), mu=decades(rng, 0.1, 0.6), preload=ratio
                )
            )
        else:
            laws.append(Jenkins(k_t=k_t, limit=ratio * rng.uniform(0.5, 1.0)))
        rows.append(row)
    wave = int(rng.integers(1, sectors // 2 + 1))
    shake = np.zeros(n, dtype=complex)
    shake[1::2] = np.exp(-2j * np.pi * wave * np.arange(sectors) / sectors)
    structure = lumped(M, K, damping, ("x", "x"))
    names = tuple(f"R{i}" for i in range(len(laws)))
    system = System(structure, Interface(names, tuple(laws), np.vstack(rows)), np.arange(1, n, 2))
    note = f"ring under {sectors} sectors, engine order {wave}, {'lifts, ' if lifts else ''}load {ratio:.3g}, {len(laws)} contacts, damping {damping:.1e}"
    return system, HarmonicLoad(np.zeros(n), {1: shake}), note


def stops(rng: Random) -> Built:
    """Cantilevers between stops, on a spring of third degree and a joint of sliders."""
    elements, omega = int(rng.integers(2, 4)), 2 * np.pi * decades(rng, 80.0, 800.0)
    M, K = cantilever(elements)
    K = K * (omega**2 / modes_of(M, K)[0][0])
    n = len(M)
    damping = decades(rng, 1e-3, 2e-2)
    free = 1.0 / (2.0 * damping * omega**2)  # amplitude of the free beam, order of magnitude
    tip = n - 2
    laws: list[ElasticCoulomb | CubicSpring | Iwan | Jenkins] = []
    rows = []

    def add(law: ElasticCoulomb | CubicSpring | Iwan | Jenkins, direction: int, sign: float) -> None:
        row = np.zeros((3, n))
        row[direction, tip] = sign
        laws.append(law)
        rows.append(row)

    stiff, clearance = omega**2 * decades(rng, 0.1, 10.0), free * decades(rng, 0.02, 0.5)
    for sign in (1.0, -1.0)[: int(rng.integers(1, 3))]:
        add(ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=stiff, mu=0.0, preload=-stiff * clearance), 2, sign)
    cubic = rng.uniform(-0.15, 1.0) * omega**2 / free**2 * decades(rng, 0.1, 3.0)
    add(CubicSpring(k_t=0.0, cubic_t=max(cubic, -0.02 * omega**2 / free**2)), 0, 1.0)
    k_t, limit = omega**2 * decades(rng, 0.1, 1.0), decades(rng, 0.1, 3.0)
    many = rng.uniform() < 0.5
    add(Iwan(k_t=k_t, limit=limit) if many else Jenkins(k_t=k_t, limit=limit), 0, 1.0)
    dofs = Dofs(np.repeat(np.arange(elements), 3), ("x", "z", "ry") * elements, np.zeros((n, 3)))
    structure = Structure(M, modal_damping(M, K, damping), K, dofs)
    shake = np.zeros(n, dtype=complex)
    shake[tip] = 1.0
    names = tuple(f"C{i}" for i in range(len(laws)))
    system = System(structure, Interface(names, tuple(laws), np.vstack(rows)), np.array([tip]))
    note = f"stops at {clearance / free:.2g} of the free amplitude, {'Iwan' if many else 'Jenkins'}, cubic {cubic * free**2 / omega**2:.2g}, damping {damping:.1e}"
    return system, HarmonicLoad(np.zeros(n), {1: shake}), note


def lumped(mass: FloatArray, stiffness: FloatArray, damping: float, names: tuple[str, str]) -> Structure:
    """Return masses with two named dofs a node and the same damping ratio in all modes."""
    n = len(mass)
    dofs = Dofs(np.repeat(np.arange(n // 2), 2), names * (n // 2), np.zeros((n, 3)))
    if names[0] == names[1]:
        dofs = Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3)))
    return Structure(mass, modal_damping(mass, stiffness, damping), stiffness, dofs)


FAMILIES: dict[str, Callable[[Random], Built]] = {"packet": packet, "ring": ring, "stops": stops}
