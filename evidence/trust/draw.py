"""Random small machines in plain NumPy: matrices, contacts, loads. Nothing of stickslip is imported here.

A machine is drawn by a seed and its own number. Masses 0.2 to 5 kg, first frequency of the free structure 10 to 300 Hz, modal damping 5e-4 to 2e-2.

======= ===== ==========================================================================================
family  share what
======= ===== ==========================================================================================
chain   35 %  1 to 4 masses in line; 1 to 3 sliders with constant limits, to the ground or between masses
stop    25 %  1 to 3 masses in line; 1 or 2 one-sided stops with clearance, a quarter with a slider beside
pad     30 %  1 or 2 nodes that move along x and z, coupled; each presses on the ground and rubs along x
cubic   10 %  1 to 3 masses in line; a cubic spring to the ground, half of them with a slider beside it
======= ===== ==========================================================================================

The load acts on one dof (harmonic 1; one machine in eight: harmonic 2), pads on both directions with a phase between them. Contacts are 0.05 to 20
times as stiff as the mode. Limits, preloads and clearances are 0.05 to 1 times what the stuck or free resonance would ask for.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
SHARES = {"chain": 0.35, "stop": 0.25, "pad": 0.30, "cubic": 0.10}


@dataclass(frozen=True)
class Contact:
    """One contact of a machine.

    `kind` is slider, pad, stop or cubic. `tangent` and `normal` (n,) give ``t = tangent @ q`` and the approach ``z = normal @ q``, positive towards each
    other. A slider has the stiffness and limit of a spring on t; a pad besides `normal_stiffness`, `friction` and the normal force `preload` at z = 0; a stop
    the spring on ``z - clearance``; a cubic spring the force ``stiffness t³``.
    """

    kind: str
    tangent: Array
    normal: Array
    stiffness: float = 0.0
    limit: float = 0.0
    normal_stiffness: float = 0.0
    friction: float = 0.0
    preload: float = 0.0
    clearance: float = 0.0
    between: tuple[int, int] = (0, -1)  # dofs or nodes; -1: the ground


@dataclass(frozen=True)
class Machine:
    """Matrices, contacts and loads; `nodes` (n,) and `components` name the dofs; `force` (n,) complex acts in `harmonic`."""

    number: int
    family: str
    mass: Array
    damping: Array
    stiffness: Array
    nodes: tuple[int, ...]
    components: tuple[str, ...]
    contacts: tuple[Contact, ...]
    force: npt.NDArray[np.complex128]
    static: Array
    harmonic: int
    hz: tuple[float, float]


def draw(seed: int, number: int) -> Machine:
    """Draw machine `number` of a seed."""
    rng = np.random.default_rng([seed, number, 31])
    family = str(rng.choice(list(SHARES), p=list(SHARES.values())))
    return _pad(rng, number) if family == "pad" else _line(rng, number, family)


def _decades(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _modal_damping(mass: Array, stiffness: Array, ratio: float) -> Array:
    root = np.sqrt(np.diag(mass))
    squares, modes = np.linalg.eigh(stiffness / np.outer(root, root))
    full = modes @ np.diag(2 * ratio * np.sqrt(squares)) @ modes.T
    return np.asarray(full * np.outer(root, root))


def _line(rng: np.random.Generator, number: int, family: str) -> Machine:
    n = int(rng.integers(1, 5 if family == "chain" else 4))
    mass = np.diag([_decades(rng, 0.2, 5.0) for _ in range(n)])
    stiffness = np.zeros((n, n))
    for i in range(n):
        k = _decades(rng, 0.3, 3.0)
        stiffness[i, i] += k
        if i:
            stiffness[i - 1, i - 1] += k
            stiffness[i - 1, i] -= k
            stiffness[i, i - 1] -= k
    first = 2 * np.pi * _decades(rng, 10.0, 300.0)
    stiffness *= first**2 / _lowest(mass, stiffness) ** 2
    damping = _modal_damping(mass, stiffness, _decades(rng, 5e-4, 2e-2))
    harmonic = 2 if rng.uniform() < 0.125 else 1
    force = np.zeros(n, dtype=complex)
    force[int(rng.integers(n))] = 1.0
    contacts: list[Contact] = []
    kinds = {
        "chain": ["slider"] * int(rng.integers(1, 4)),
        "stop": ["stop"] * int(rng.integers(1, 3)) + ["slider"] * int(rng.uniform() < 0.25),
        "cubic": ["cubic"] + ["slider"] * int(rng.uniform() < 0.5),
    }[family]
    free = _resonance(mass, damping, stiffness, force)
    modal = float(np.max(np.abs(np.diag(stiffness)))) / n
    for kind in kinds:
        own = int(rng.integers(n))
        other = -1 if n == 1 or kind != "slider" or rng.uniform() < 0.5 else int((own + 1) % n)
        row = np.zeros(n)
        row[own] = 1.0
        if other >= 0:
            row[other] = -1.0
        k = modal * _decades(rng, 0.05, 20.0)
        size = float(np.max(np.abs(free @ row)))
        if kind == "slider":
            # at most what the spring would carry if it stuck at the free resonance
            limit = min(k, modal) * size * _decades(rng, 0.02, 1.0)
            contacts.append(Contact("slider", row, np.zeros(n), k, limit=limit, between=(own, other)))
        elif kind == "stop":
            gap = size * _decades(rng, 0.05, 0.8)
            contacts.append(Contact("stop", np.zeros(n), row, k, clearance=gap, between=(own, -1)))
        else:
            cubic = modal / size**2 * _decades(rng, 1e-3, 0.3)
            contacts.append(Contact("cubic", row, np.zeros(n), cubic, between=(own, -1)))
    stuck = stiffness + sum(
        (c.stiffness * np.outer(c.tangent, c.tangent) for c in contacts if c.kind == "slider"), np.zeros((n, n))
    )
    low, high = sorted((_lowest(mass, stiffness), _lowest(mass, stuck)))
    hz = (0.8 * low / (2 * np.pi * harmonic), 1.25 * min(high, 2 * low) / (2 * np.pi * harmonic))
    nodes = tuple(range(1, n + 1))
    return Machine(
        number, family, mass, damping, stiffness, nodes, ("x",) * n, tuple(contacts), force, np.zeros(n), harmonic, hz
    )


def _pad(rng: np.random.Generator, number: int) -> Machine:
    count = int(rng.integers(1, 3))
    n = 2 * count
    mass = np.diag(np.repeat([_decades(rng, 0.2, 5.0) for _ in range(count)], 2))
    angle = rng.normal(0.0, 0.4)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    own = turn @ np.diag([1.0, rng.uniform(1.5, 20.0)]) @ turn.T
    chain = np.array([[1.0]]) if count == 1 else np.array([[2.0, -1.0], [-1.0, 1.5]])
    stiffness = np.kron(chain, own)
    first = 2 * np.pi * _decades(rng, 10.0, 300.0)
    stiffness *= first**2 / _lowest(mass, stiffness) ** 2
    damping = _modal_damping(mass, stiffness, _decades(rng, 5e-4, 2e-2))
    harmonic = 2 if rng.uniform() < 0.125 else 1
    force = np.zeros(n, dtype=complex)
    at = int(rng.integers(count))
    force[2 * at] = 1.0
    force[2 * at + 1] = rng.uniform(0.0, 2.0) * np.exp(1j * rng.uniform(0.0, 2 * np.pi))
    free = _resonance(mass, damping, stiffness, force)
    modal = float(np.max(np.abs(np.diag(stiffness)))) / n
    static = np.zeros(n)
    contacts = []
    for i in range(count):
        tangent, normal = np.zeros(n), np.zeros(n)
        tangent[2 * i], normal[2 * i + 1] = 1.0, 1.0
        k, kn, mu = modal * _decades(rng, 0.05, 20.0), modal * _decades(rng, 0.05, 20.0), rng.uniform(0.1, 0.8)
        size = float(np.max(np.abs(free[:, 2 * i : 2 * i + 2])))
        preload = min(k, modal) * size * _decades(rng, 0.05, 2.0) / mu
        static[2 * i + 1] = preload
        contacts.append(
            Contact("pad", tangent, normal, k, normal_stiffness=kn, friction=mu, preload=preload, between=(i, -1))
        )
    stuck = stiffness + sum(
        (
            c.stiffness * np.outer(c.tangent, c.tangent) + c.normal_stiffness * np.outer(c.normal, c.normal)
            for c in contacts
        ),
        np.zeros((n, n)),
    )
    low, high = sorted((_lowest(mass, stiffness), _lowest(mass, stuck)))
    hz = (0.8 * low / (2 * np.pi * harmonic), 1.25 * min(high, 2 * low) / (2 * np.pi * harmonic))
    nodes = tuple(int(i) + 1 for i in np.repeat(np.arange(count), 2))
    # the ground carries what presses the node, so that it rests at zero
    return Machine(
        number, "pad", mass, damping, stiffness, nodes, ("x", "z") * count, tuple(contacts), force, static, harmonic, hz
    )


def _lowest(mass: Array, stiffness: Array) -> float:
    root = np.sqrt(np.diag(mass))
    return float(np.sqrt(np.linalg.eigvalsh(stiffness / np.outer(root, root))[0]))


def _resonance(mass: Array, damping: Array, stiffness: Array, force: npt.NDArray[np.complex128]) -> Array:
    """Return (m, n) amplitudes of the free structure around its first resonance."""
    first = _lowest(mass, stiffness)
    return np.array(
        [
            np.abs(np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, force))
            for w in first * np.linspace(0.9, 1.1, 201)
        ]
    )
