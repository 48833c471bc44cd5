"""Two blades and a damper drawn at random about literature benchmark B6: from stuck to slip and lift-off in every period.

Each blade is a point mass that moves in a plane (x circumferential, z radial), as in the benchmark; between the blades and to ground
are springs. The damper is a wedge that a static load presses outward against two inclined platforms. Half of the systems have the
damper of the benchmark, with two dofs and one contact a side; in the others it rotates as well, and its flat side has two contacts.

====================================  ================================================================================
first frequency of a free blade       60 to 600 Hz, masses 0.3 to 3 kg; the second blade within 8 % of the first
stiffness across the first direction  1.2 to 6 times the first, turned at random
spring between the blades             0.02 to 2 times the stiffness of a blade, in each direction
damping ratio of the blades           0.2 to 2 %
damper                                0.03 to 0.3 of a blade's mass, platform angles 20 to 60 degrees, held by springs of
                                      0.5 to 50 % of the softest contact spring
contacts                              k_t of 0.1 to 10 times the stiffness of a blade, k_n of 0.5 to 2 k_t, friction 0.1 to 0.8
severity                              0.7 to 15: at the resonance of the stuck structure, the largest share that the linear
                                      tangential force of a contact has of its static friction limit; it sets F_CL / F_HE
excitation                            on one or both blades, in random directions and phases
====================================  ================================================================================

Quantities over more than a factor of three are drawn evenly in their logarithm. The frequencies lie about the resonance with the largest
response, from the frictionless to the stuck one. A system whose damper finds no equilibrium under its static load, or would need more
than 1000 or less than one times the excitation for its severity, is drawn again: the latter would be thrown about.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from evidence.strategies.cases import HZ, SelectionCase
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import SingularError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.damping import modal_damping
from stickslip.model.structure import Dofs, Structure
from stickslip.response.equilibrium import preload, static_contact_force
from stickslip.response.system import System

Random = np.random.Generator
STREAM = 20261121  # beside the number of the system: other numbers would be other systems
SYSTEMS = 200
HELD_OUT = 1000  # number of the first system of a second set, on which no rule was tried before it was fixed
THIRD = 2000  # the first of a set that was counted by somebody else, before the rule was tightened for the last time
FREQUENCIES = 12
GRID = 2000  # frequencies at which the linear responses are compared
DRAWS = 200  # before a number is given up
RATIOS = (1.0, 1000.0)  # F_CL / F_HE
SIZE = 0.01  # m, of the damper


def decades(rng: Random, low: float, high: float) -> float:
    """Draw a number evenly in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def turned(angle: float) -> FloatArray:
    """Return the (2, 2) rotation by `angle`."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


@dataclass(frozen=True)
class _Blade:
    mass: float
    stiffness: FloatArray  # (2, 2)


def _blade(rng: Random, omega: float, mass: float) -> _Blade:
    turn = turned(rng.uniform(0, np.pi))
    square = omega**2 * mass * np.diag([1.0, decades(rng, 1.2, 6.0)])
    return _Blade(mass, turn @ square @ turn.T)


@lru_cache(maxsize=1024)
def random_two_blade_system(number: int) -> SelectionCase:
    """Draw the system with this number; the same number gives the same system.

    Raises
    ------
    RuntimeError
        If no draw of this number has an equilibrium.
    """
    rng = np.random.default_rng([STREAM, number])
    for _ in range(DRAWS):
        system, shake, note = _drawn(rng)
        severity = decades(rng, 0.7, 15.0)
        (low, high), traction = _resonances(system, shake)
        try:
            limit = _static_limits(system)
        except SingularError:
            continue
        pressed = limit > 0.0
        ratio = float(np.max(traction[pressed] / limit[pressed], initial=0.0)) / severity
        if not RATIOS[0] <= ratio <= RATIOS[1]:
            continue
        note = f"{note}, severity {severity:.2g}, F_CL/F_HE = {ratio:.3g}"
        load = HarmonicLoad(ratio * _outward(system), {1: shake})
        return SelectionCase(
            f"random{number}", f"random system {number}: {note}", system, load, (low, high), FREQUENCIES
        )
    raise RuntimeError(f"no equilibrium in {DRAWS} draws of system {number}")


def _drawn(rng: Random) -> tuple[System, ComplexArray, str]:
    """Return a system, the unit force that shakes its blades, and what it is."""
    omega, mass = HZ * decades(rng, 60.0, 600.0), decades(rng, 0.3, 3.0)
    first = _blade(rng, omega, mass)
    share = float(rng.choice([1.0, rng.uniform(0.92, 1.08)]))
    second = _Blade(mass, share * first.stiffness)
    between = np.diag([omega**2 * mass * decades(rng, 0.02, 2.0) for _ in range(2)])
    rotating = bool(rng.uniform() < 0.5)
    n_damper = 3 if rotating else 2
    n = 4 + n_damper
    soft = omega**2 * mass * decades(rng, 0.1, 10.0)
    laws, gap = _contacts(rng, soft, n_damper)
    K = np.zeros((n, n))
    K[:2, :2], K[2:4, 2:4] = first.stiffness, second.stiffness
    K[:4, :4] += np.kron(np.array([[1.0, -1.0], [-1.0, 1.0]]), between)
    light = mass * decades(rng, 0.03, 0.3)
    M = np.diag([mass] * 4 + [light] * 2 + [0.4 * light * SIZE**2] * (n_damper - 2))
    damping = np.zeros((n, n))
    ratio = decades(rng, 0.002, 0.02)
    blades = Structure(M[:4, :4], np.zeros((4, 4)), K[:4, :4], _dofs(4))
    damping[:4, :4] = modal_damping(blades, ratio).damping
    softest = min(min(law.k_t, law.k_n) for law in laws)
    held = softest * decades(rng, 0.005, 0.5)
    K[[4, 5], [4, 5]] += held
    if rotating:
        K[6, 6] += held * SIZE**2
    names = tuple(f"c{i}" for i in range(len(laws)))
    system = System(Structure(M, damping, K, _dofs(n)), Interface(names, laws, gap), np.arange(4), free=np.arange(4, n))
    phases = rng.normal(size=4) + 1j * rng.normal(size=4)
    phases[2:] *= rng.choice([0.0, 0.3, 1.0])
    force = np.zeros(n, dtype=complex)
    force[:4] = phases / np.linalg.norm(phases)
    return system, force, f"damper of {n_damper} dofs, damping {ratio:.2%}"


def _contacts(rng: Random, soft: float, n_damper: int) -> tuple[tuple[ElasticCoulomb, ...], FloatArray]:
    """Return laws and gap operator: one contact a side, or two on the flat side of a damper that rotates."""
    flat, curved = rng.uniform(np.radians(20), np.radians(60), 2)
    # outward normals of the damper's sides: gaps open inward
    normals = (np.array([-np.sin(flat), np.cos(flat)]), np.array([np.sin(curved), np.cos(curved)]))
    right = SIZE * normals[1]
    # where the line of action of the curved side meets the axis of the load, all three forces meet: the foot of the flat side's resultant
    crossing = np.array([0.0, right[1] - right[0] * normals[1][1] / normals[1][0]])
    along = np.array([normals[0][1], -normals[0][0]])
    foot = crossing + (0.7 * SIZE - crossing @ normals[0]) * normals[0]
    wide = SIZE * rng.uniform(0.2, 0.6)
    shares = (rng.uniform(0.5, 1.0), -rng.uniform(0.5, 1.0)) if n_damper == 3 else (0.0,)
    places = [(0, foot + share * wide * along) for share in shares] + [(2, right)]
    gap = np.zeros((3 * len(places), 4 + n_damper))
    laws = []
    for i, (blade, point) in enumerate(places):
        normal = normals[0 if blade == 0 else 1]
        frame = np.array([[normal[1], -normal[0]], -normal])
        rows = [3 * i, 3 * i + 2]
        gap[rows, blade : blade + 2] -= frame
        gap[rows, 4:6] += frame
        if n_damper == 3:  # a rotation θ moves a point by θ (-z, x)
            gap[rows, 6] += frame @ np.array([-point[1], point[0]])
        k_t = soft * decades(rng, 0.5, 2.0) / (len(shares) if blade == 0 else 1)
        laws.append(ElasticCoulomb(k_t=k_t, k_w=0.0, k_n=k_t * decades(rng, 0.5, 2.0), mu=decades(rng, 0.1, 0.8)))
    return tuple(laws), gap


def _dofs(n: int) -> Dofs:
    parts = ("blades",) * 4 + ("damper",) * (n - 4)
    return Dofs(
        np.repeat([1, 2, 3], [2, 2, max(n - 4, 0)])[:n],
        ("x", "z", "x", "z", "x", "z", "ry")[:n],
        np.zeros((n, 3)),
        parts[:n],
    )


def _outward(system: System) -> FloatArray:
    """Return a unit load on the damper, outward."""
    static = np.zeros(system.structure.n)
    static[5] = 1.0
    return static


def _static_limits(system: System) -> FloatArray:
    """Return the friction limit of each contact under a unit load on the damper."""
    gap = system.interface.gap_operator[:, system.retained] @ preload(system, _outward(system))
    force = static_contact_force(system.interface, gap.reshape(-1, 3))
    mu = np.array([law.mu for law in system.interface.laws])
    return np.asarray(-mu * force[:, 2])


def _resonances(system: System, shake: ComplexArray) -> tuple[tuple[float, float], FloatArray]:
    """Return a range about the largest responses of the frictionless and the stuck structure, and the tractions at the latter."""
    laws, structure = system.interface.laws, system.plain_structure
    b = system.interface.gap_operator
    # of the blades, which have equal masses
    first = np.sqrt(np.linalg.eigvalsh(structure.stiffness[:4, :4])[0] / structure.mass[0, 0])
    omega = first * np.geomspace(0.7, 7.0, GRID)
    peaks, traction = [], np.zeros(len(laws))
    for share in (0.0, 1.0):  # of the tangential springs
        springs = np.array([[share * law.k_t, 0.0, law.k_n] for law in laws]).reshape(-1)
        K = structure.stiffness + b.T @ (springs[:, None] * b)
        w = omega[:, None, None]
        matrices = K - w**2 * structure.mass + 1j * w * structure.damping
        motion = np.linalg.solve(matrices, np.broadcast_to(shake[:, None], (GRID, shake.size, 1)))
        place = int(np.argmax(np.linalg.norm(motion[:, :4, 0], axis=1)))
        peaks.append(omega[place])
        traction = np.abs(springs * (b @ motion[place, :, 0]))[::3]
    low, high = sorted(peaks)
    wide = max(0.03, 0.15 * (high / low - 1.0))
    return (float(low * (1.0 - wide)), float(high * (1.0 + wide))), traction
