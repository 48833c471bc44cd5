"""The small systems of the robustness benchmark, drawn at random but such as a machine might have.

A system is drawn by two numbers, the seed of the benchmark and its own number, so that each can be solved again alone. Quantities "over
decades" are drawn evenly in their logarithm. The blades' first mode lies between 50 and 2000 Hz (mass 0.1 to 10 kg), their damping ratio
between 1e-4 and 1e-2 in all modes, the excitation F_HE between 0.1 and 100 N on the tips: on one blade, on both in phase, or with an
inter-blade phase angle. The static load is 1 to 1000 times F_HE. Friction coefficients lie between 0.05 and 0.8.

============ ===== =================================================================================================
family       share what
============ ===== =================================================================================================
wedge        40 %  two blades of 1 to 4 masses with three dofs each, between them a rigid damper of 2, 3 or 6 dofs
                   (1e-3 to 0.1 of a blade's mass) pressed outward against two inclined platforms by F_CL; 2 to 12
                   contacts, whose lines of action give a frictionless equilibrium with all of them closed. Nothing
                   else holds the damper, or a retention stiffness of 1e-4 to 1e-2 of the softest contact spring: always
                   with six dofs (only friction acts along the axis), with half of the others.
shroud       25 %  two blades that touch at their tips, and the second perhaps the ground, by 1 to 6 contacts in general
                   position; each one pressed by a preload, or with a clearance of 0.3 % to half of the amplitude that the
                   free blade would have (a third of the systems)
beam         20 %  a cantilever of 2 to 4 Euler-Bernoulli elements that rubs on 1 to 3 inclined springs: from friction rings
                   with constant or variable normal load to stops with preload or clearance
chain        15 %  2 to 6 masses with 1 to 6 Jenkins sliders between neighbours or to the ground, limits over two decades
============ ===== =================================================================================================

Tangential contact stiffness: 0.03 to 100 times the modal stiffness of the blade (one factor a system, each contact within a factor of
two of it); normal stiffness 0.5 to 3 times that, or zero where the limit is constant.

With `planar` the friction of all families but the chain is coupled in the plane of the contact; all else is drawn as without.

The range of frequencies reaches from 10 % below the lower to 10 % above the higher of the first frequencies with free and with stuck
contacts, but not beyond 2.5 times the free one. One system in four keeps many harmonics everywhere, the others use the alert with the
default orders 1 and 5.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.rigid.body import RigidBody
from stickslip.model.structure import Dofs, Structure, join
from stickslip.response.forced.response import Sweep
from stickslip.response.system import System

Random = np.random.Generator
SHARES = {"wedge": 0.40, "shroud": 0.25, "beam": 0.20, "chain": 0.15}
MANY = (20, 20, 100)  # contacts of the larger wedges, solved beside the small systems


@dataclass(frozen=True, eq=False)
class Drawn:
    """A system with its load and sweep."""

    number: int
    family: str
    system: System
    load: HarmonicLoad
    sweep: Sweep
    note: str


@dataclass(frozen=True, slots=True)
class Blade:
    """What blades of one system have in common."""

    omega: float  # first free frequency, rad/s
    mass: float  # of each lump, kg
    damping: float  # ratio
    excitation: float  # N
    ratio: float  # static load over excitation
    contact: float  # tangential contact stiffness, N/m

    @property
    def stiffness(self) -> float:
        """Of the first mode, N/m."""
        return self.mass * self.omega**2

    @property
    def free_amplitude(self) -> float:
        """Of the blade alone at its resonance, m."""
        return self.excitation / (2.0 * self.damping * self.stiffness)


def decades(rng: Random, low: float, high: float) -> float:
    """Draw evenly in the logarithm."""
    return float(10.0 ** rng.uniform(np.log10(low), np.log10(high)))


def draw(seed: int, number: int, *, planar: bool = False) -> Drawn:
    """Draw system `number` of the benchmark of `seed`; `planar`: the friction of each contact is coupled in its plane."""
    rng = np.random.default_rng([seed, number])
    family = str(rng.choice(list(SHARES), p=list(SHARES.values())))
    system, load, note = FAMILIES[family](rng, common(rng))
    if planar:
        system = coupled(system)
    return finished(rng, number, family, system, load, note)


def has_planes(seed: int, number: int) -> bool:
    """Whether the contacts of a system have a plane in which friction can be coupled: all but those of the chains."""
    rng = np.random.default_rng([seed, number])
    return str(rng.choice(list(SHARES), p=list(SHARES.values()))) != "chain"


def coupled(system: System) -> System:
    """Return the system whose contacts have planar friction, with the stiffness along t in every direction."""
    laws = tuple(
        CoupledCoulomb(k_t=law.k_t, k_n=law.k_n, mu=law.mu, preload=law.preload)
        for law in system.interface.laws
        if isinstance(law, ElasticCoulomb)
    )
    return replace(system, interface=replace(system.interface, laws=laws))


def draw_many(seed: int, number: int, contacts: int) -> Drawn:
    """Draw a wedge damper with six dofs and many contacts, each on its own node of the platforms."""
    rng = np.random.default_rng([seed, number, contacts])
    system, load, note = wedge(rng, common(rng), dofs=6, contacts=contacts)
    return finished(rng, number, f"wedge{contacts}", system, load, note)


def common(rng: Random) -> Blade:
    """Draw what all families share."""
    omega = 2 * np.pi * decades(rng, 50.0, 2000.0)
    mass = decades(rng, 0.1, 10.0)
    stiffness = mass * omega**2
    return Blade(
        omega=omega,
        mass=mass,
        damping=decades(rng, 1e-4, 1e-2),
        excitation=decades(rng, 0.1, 100.0),
        ratio=decades(rng, 1.0, 1000.0),
        contact=stiffness * decades(rng, 0.03, 100.0),
    )


def finished(rng: Random, number: int, family: str, system: System, load: HarmonicLoad, note: str) -> Drawn:
    """Add the sweep: from the free to the stuck resonance."""
    free, stuck = first_frequencies(system, load)
    low, high = 0.9 * min(free, stuck), min(1.1 * max(free, stuck), 2.5 * free)
    selection = "always_high" if rng.uniform() < 0.25 else "jacobian_alert"
    sweep = Sweep(omega_range=(low, high), selection=selection)  # type: ignore[arg-type]
    words = f"{note}, {system.interface.n_contacts} contacts, {selection}"
    return Drawn(number, family, system, load, sweep, words)


def first_frequencies(system: System, load: HarmonicLoad) -> tuple[float, float]:
    """Return the frequencies of the mode that the load excites most, with free and with stuck contacts."""
    found = []
    for structure in (system.structure, system.stuck_structure()):
        w2, modes = modes_of(structure.mass, structure.stiffness)
        elastic = w2 > 1e-6 * w2[-1] if system.free is None else w2 > 0
        # a body on retention alone has modes too; a load on the blades hardly moves it
        share = np.abs(modes.T @ load.harmonics[1]) * (elastic & (w2 > 0)) / np.maximum(w2, 1e-300)
        found.append(float(np.sqrt(w2[int(np.argmax(share))])))
    return found[0], found[1]


def modes_of(mass: FloatArray, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return squared frequencies and mass-normalised modes of a diagonal mass or a full one."""
    lower = np.linalg.cholesky(mass)
    inverse = np.linalg.inv(lower)
    w2, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    return w2, inverse.T @ vectors


def modal_damping(mass: FloatArray, stiffness: FloatArray, ratio: float) -> FloatArray:
    """Return the damping matrix with one ratio for all modes."""
    w2, modes = modes_of(mass, stiffness)
    left = mass @ modes
    return left @ np.diag(2.0 * ratio * np.sqrt(np.maximum(w2, 0.0))) @ left.T


def rotation(rng: Random, size: float) -> FloatArray:
    """Return a random rotation of typical angle `size`."""
    x, y, z = size * rng.standard_normal(3)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    out: FloatArray = np.linalg.solve(np.eye(3) - skew / 2, np.eye(3) + skew / 2)  # Cayley
    return out


def lumped_blade(rng: Random, blade: Blade, lumps: int, detune: float = 1.0) -> Structure:
    """Return a chain of `lumps` masses with x, y, z each; softest along (nearly) x."""
    chain = 2.0 * np.eye(lumps) - np.eye(lumps, k=1) - np.eye(lumps, k=-1)
    chain[-1, -1] = 1.0
    chain /= np.linalg.eigvalsh(chain)[0]
    turn = rotation(rng, 0.15)
    directions = turn @ np.diag([1.0, rng.uniform(1.5, 10.0), rng.uniform(4.0, 30.0)]) @ turn.T
    K = detune * blade.stiffness * np.kron(chain, directions)
    M = blade.mass * np.eye(3 * lumps)
    dofs = Dofs(np.repeat(np.arange(lumps), 3), ("x", "y", "z") * lumps, np.zeros((3 * lumps, 3)))
    return Structure(M, modal_damping(M, K, blade.damping), K, dofs)


def with_platform(structure: Structure, nodes: int, at: int, blade: Blade) -> Structure:
    """Hang `nodes` small masses on the lump `at`, each by springs of ten times the contact stiffness: a compliant platform."""
    n, m = structure.n, 3 * nodes
    hang = np.zeros((m, n + m))
    hang[:, n:] = np.eye(m)
    for i in range(m):
        hang[i, 3 * at + i % 3] = -1.0
    K = np.zeros((n + m, n + m))
    K[:n, :n] = structure.stiffness
    K += 10.0 * blade.contact * hang.T @ hang
    M = np.eye(n + m) * blade.mass
    M[n:, n:] *= 0.2 / nodes
    dofs = Dofs(
        np.concatenate([structure.dofs.node, np.repeat(100 + np.arange(nodes), 3)]),
        structure.dofs.component + ("x", "y", "z") * nodes,
        np.zeros((n + m, 3)),
    )
    return Structure(M, modal_damping(M, K, blade.damping), K, dofs)


def law_of(rng: Random, blade: Blade, *, k_n: float | None = None, preload: float = 0.0) -> ElasticCoulomb:
    """Draw a contact about the stiffness of the system."""
    k_t, k_w = (blade.contact * decades(rng, 0.5, 2.0) for _ in range(2))
    normal = k_t * decades(rng, 0.5, 3.0) if k_n is None else k_n
    return ElasticCoulomb(k_t=k_t, k_w=k_w, k_n=normal, mu=decades(rng, 0.05, 0.8), preload=preload)


# ---- families ---------------------------------------------------------------------------------------------------------


def wedge(
    rng: Random, blade: Blade, dofs: int | None = None, contacts: int | None = None
) -> tuple[System, HarmonicLoad, str]:
    """Two blades and a rigid damper between their platforms."""
    dofs = dofs or int(rng.choice([2, 3, 6]))
    lumps = int(rng.integers(1, 5))
    at = int(rng.integers(0, max(1, (lumps + 1) // 2)))
    own = contacts is not None
    points, frames, left = wedge_contacts(rng, dofs, contacts)
    parts = {}
    for name, own_nodes, detune in (
        ("left", left.sum(), 1.0),
        ("right", (~left).sum(), float(rng.choice([1.0, 1.02]))),
    ):
        parts[name] = lumped_blade(rng, blade, lumps, detune)
        if own:
            parts[name] = with_platform(parts[name], min(int(own_nodes), 10), at, blade)
    size, mass = 0.01, blade.mass * decades(rng, 1e-3, 0.1)
    body = RigidBody(mass=mass, inertia=(0.4 * mass * size**2,) * 3, centre=(0.0, 0.0, 0.0))
    kept = {2: [0, 2], 3: [0, 2, 4], 6: list(range(6))}[dofs]
    damper = body.structure()
    M = np.asarray(damper.mass)[np.ix_(kept, kept)]
    parts["damper"] = Structure(
        M, 2.0 * blade.damping * blade.omega * M, np.zeros_like(M), damper.dofs.take(np.array(kept))
    )
    whole = join(**parts)
    operator = body.displacement_operator(points)[:, :, kept]
    gap = np.zeros((3 * len(points), whole.n))
    counts = [0, 0]
    for i, frame in enumerate(frames):
        side = 0 if left[i] else 1
        nodes = min(int(np.sum(left == left[i])), 10)
        offset = (0, parts["left"].n)[side]
        node = lumps + counts[side] % nodes if own else at
        counts[side] += 1
        rows = slice(3 * i, 3 * i + 3)
        gap[rows, offset + 3 * node : offset + 3 * node + 3] = frame.T
        gap[rows, -dofs:] = -frame.T @ operator[i]
    laws = tuple(law_of(rng, blade) for _ in points)
    if dofs < 6:  # planar
        laws = tuple(replace(law, k_w=0.0) for law in laws)
    shake = np.zeros(whole.n, dtype=complex)
    tips = np.array([3 * (lumps - 1), parts["left"].n + 3 * (lumps - 1)])
    shake[tips] = blade.excitation * both_blades(rng)
    static = np.zeros(whole.n)
    static[-dofs + kept.index(2)] = blade.ratio * blade.excitation
    names = tuple(f"{'L' if side else 'R'}{i}" for i, side in enumerate(left))
    free = np.arange(whole.n - dofs, whole.n)
    system = System(whole, Interface(names, laws, gap), tips, free=free)
    retention = 0.0
    if dofs == 6 or rng.uniform() < 0.5:
        retention = decades(rng, 1e-4, 1e-2) * min(min(w.k_t, w.k_n) for w in laws)
    note = f"damper of {dofs} dofs, F_CL/F_HE = {blade.ratio:.3g}, retention {retention:.2g} N/m, damping {blade.damping:.1e}"
    return system.with_retention(retention), HarmonicLoad(static, {1: shake}), note


def wedge_contacts(rng: Random, dofs: int, contacts: int | None) -> tuple[FloatArray, list[FloatArray], np.ndarray]:
    """Return positions on the damper (m), frames and which lie on the left platform.

    The left lines stand on both sides of the point where the resultant of the left platform passes: the frictionless equilibrium
    presses them all.
    """
    flat, curved = rng.uniform(np.radians(15), np.radians(60), 2)
    left_normal = np.array([-np.sin(flat), 0.0, np.cos(flat)])
    right_normal = np.array([np.sin(curved), 0.0, np.cos(curved)])
    w = np.array([0.0, 1.0, 0.0])
    frames_of = [np.column_stack([np.cross(w, n) * s, s * w, n]) for n, s in ((left_normal, 1), (right_normal, -1))]
    size = 0.01
    right_point = size * right_normal + 0.2 * size * rng.uniform(-1, 1) * frames_of[1][:, 0]
    crossing = np.array([0.0, 0.0, right_point[2] - right_point[0] * right_normal[2] / right_normal[0]])
    foot = crossing + (0.7 * size - crossing @ left_normal) * left_normal
    wide = size * rng.uniform(0.15, 0.5)
    lines_left = [foot + share * wide * frames_of[0][:, 0] for share in (rng.uniform(0.5, 1.0), -rng.uniform(0.5, 1.0))]
    if dofs == 2:
        lines_left = lines_left[: int(rng.integers(1, 3))]
    sections = 1 if dofs < 6 else int(rng.integers(2, 5))
    if contacts is not None:
        sections = max(2, contacts // (len(lines_left) + 1))
    heights = size * np.linspace(-1.0, 1.0, sections) if sections > 1 else np.zeros(1)
    points, frames, left = [], [], []
    for line, side in [*((p, 0) for p in lines_left), (right_point, 1)]:
        for y in heights:
            points.append(line + y * w)
            frames.append(frames_of[side])
            left.append(side == 0)
    return np.array(points), frames, np.array(left)


def both_blades(rng: Random) -> np.ndarray:
    """Return the phasors of the excitation of the two blades."""
    kind = rng.choice(["one", "in phase", "angle"])
    second = {"one": 0.0, "in phase": 1.0, "angle": np.exp(1j * rng.uniform(0, 2 * np.pi))}[kind]
    return np.array([1.0, second], dtype=complex)


def shroud(rng: Random, blade: Blade) -> tuple[System, HarmonicLoad, str]:
    """Two blades that touch each other, perhaps the ground too."""
    lumps = int(rng.integers(1, 4))
    whole = join(
        left=lumped_blade(rng, blade, lumps), right=lumped_blade(rng, blade, lumps, float(rng.choice([1.0, 1.05, 1.5])))
    )
    n_contacts = int(rng.integers(1, 7))
    clearance = rng.uniform() < 1 / 3
    laws, rows = [], []
    normals = rotation(rng, 0.4) @ np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]]).T
    for i in range(n_contacts):
        frame = normals @ rotation(rng, 0.2)
        a, b = 3 * (lumps - 1), 3 * (2 * lumps - 1)
        row = np.zeros((3, whole.n))
        row[:, b : b + 3] = frame.T
        if i == 0 or rng.uniform() < 0.8:
            row[:, a : a + 3] = -frame.T
        law = law_of(rng, blade)
        share = rng.uniform(0.5, 1.0)
        force = share * blade.ratio * blade.excitation / n_contacts
        if clearance and rng.uniform() < 0.7:
            force = -law.k_n * blade.free_amplitude * decades(rng, 3e-3, 0.5)
        laws.append(replace(law, preload=force))
        rows.append(row)
    shake = np.zeros(whole.n, dtype=complex)
    tips = np.array([3 * (lumps - 1), 3 * (2 * lumps - 1)])
    shake[tips] = blade.excitation * both_blades(rng)
    names = tuple(f"S{i}" for i in range(n_contacts))
    system = System(whole, Interface(names, tuple(laws), np.vstack(rows)), tips)
    note = f"{'clearances' if clearance else 'pressed'}, preload/F_HE = {blade.ratio:.3g}, damping {blade.damping:.1e}"
    return system, HarmonicLoad(np.zeros(whole.n), {1: shake}), note


def beam(rng: Random, blade: Blade) -> tuple[System, HarmonicLoad, str]:
    """A cantilever with axial, transverse and rotational dofs that rubs on inclined springs."""
    elements = int(rng.integers(2, 5))
    M, K = cantilever(elements)
    w2 = modes_of(M, K)[0][0]
    M, K = M * blade.mass, K * (blade.mass * blade.omega**2 / w2)
    n = len(M)
    dofs = Dofs(np.repeat(np.arange(elements), 3), ("x", "z", "ry") * elements, np.zeros((n, 3)))
    kind = str(rng.choice(["constant limit", "pressed", "clearance"]))
    laws, rows = [], []
    for _ in range(int(rng.integers(1, 4))):
        node = int(rng.integers(elements // 2, elements))
        angle = rng.uniform(0.0, np.pi / 2)  # 0: the normal lies along the beam; 90°: a stop
        law = replace(law_of(rng, blade), k_w=0.0)
        force = blade.ratio * blade.excitation * decades(rng, 0.3, 1.0)
        if kind == "clearance":
            force = -law.k_n * blade.free_amplitude * decades(rng, 3e-3, 0.5)
        if kind == "constant limit":
            law = replace(law, k_n=0.0)
        c, s = np.cos(angle), np.sin(angle)
        row = np.zeros((3, n))
        row[0, 3 * node : 3 * node + 2] = [-s, c]  # axial, transverse
        row[2, 3 * node : 3 * node + 2] = [c, s]
        laws.append(replace(law, preload=force))
        rows.append(row)
    structure = Structure(M, modal_damping(M, K, blade.damping), K, dofs)
    shake = np.zeros(n, dtype=complex)
    shake[n - 2] = blade.excitation
    names = tuple(f"B{i}" for i in range(len(laws)))
    system = System(structure, Interface(names, tuple(laws), np.vstack(rows)), np.array([n - 2]))
    note = f"{kind}, preload/F_HE = {blade.ratio:.3g}, damping {blade.damping:.1e}"
    return system, HarmonicLoad(np.zeros(n), {1: shake}), note


def cantilever(elements: int) -> tuple[FloatArray, FloatArray]:
    """Return mass and stiffness of a slender beam of length, bending stiffness and mass one; axial, transverse, rotation a node."""
    length = 1.0 / elements
    bend = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4.0]])
    inert = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4.0]])
    scale = np.diag([1.0, length, 1.0, length])
    n = 3 * (elements + 1)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for e in range(elements):
        axial = np.array([3 * e, 3 * e + 3])
        lateral = np.array([3 * e + 1, 3 * e + 2, 3 * e + 4, 3 * e + 5])
        K[np.ix_(axial, axial)] += 400.0 / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
        M[np.ix_(axial, axial)] += length / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])
        K[np.ix_(lateral, lateral)] += scale @ bend @ scale / length**3
        M[np.ix_(lateral, lateral)] += scale @ inert @ scale * length / 420
    return M[3:, 3:], K[3:, 3:]


def chain(rng: Random, blade: Blade) -> tuple[System, HarmonicLoad, str]:
    """Masses in a row with sliders of constant limit."""
    n = int(rng.integers(2, 7))
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1] = 1.0
    K *= blade.stiffness / np.linalg.eigvalsh(K)[0]
    M = blade.mass * np.eye(n)
    dofs = Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3)))
    laws, rows = [], []
    for _ in range(int(rng.integers(1, 7))):
        row = np.zeros((3, n))
        a = int(rng.integers(0, n))
        row[0, a] = 1.0
        if a > 0 and rng.uniform() < 0.5:
            row[0, a - 1] = -1.0
        limit = blade.ratio * blade.excitation * decades(rng, 0.03, 3.0)
        law = replace(law_of(rng, blade, k_n=0.0), k_w=0.0, mu=1.0, preload=limit)
        laws.append(law)
        rows.append(row)
    structure = Structure(M, modal_damping(M, K, blade.damping), K, dofs)
    shake = np.zeros(n, dtype=complex)
    shake[-1] = blade.excitation
    names = tuple(f"J{i}" for i in range(len(laws)))
    system = System(structure, Interface(names, tuple(laws), np.vstack(rows)), np.array([n - 1]))
    note = f"limit/F_HE about {blade.ratio:.3g}, damping {blade.damping:.1e}"
    return system, HarmonicLoad(np.zeros(n), {1: shake}), note


Family = Callable[[Random, Blade], tuple[System, HarmonicLoad, str]]
FAMILIES: dict[str, Family] = {"wedge": wedge, "shroud": shroud, "beam": beam, "chain": chain}
