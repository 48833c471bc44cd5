"""Small models shared by the tests of the numerical core, and a second, plain evaluation of a contact."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Dofs, Structure
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton, newton

STICK, SLIP, OPEN = 0, 1, 2
SAMPLES = 64


def table(names: tuple[str, ...]) -> Dofs:
    return Dofs(np.arange(len(names)), names, np.zeros((len(names), 3)))


# ---- a contact, sample by sample ---------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Twin:
    force: FloatArray  # (3, samples)
    state: FloatArray  # (2, samples) of the second period
    history: FloatArray  # (2, 2 samples): state times sign of slip, both periods
    margin: FloatArray  # (2, samples) distance of the tangential force from the limit, second period


def twin(gap: FloatArray, law: ElasticCoulomb) -> Twin:
    """Sliders marched sample by sample through two periods; knows neither intervals nor anchors."""
    samples = gap.shape[1]
    pressure = law.preload - law.k_n * gap[2]
    normal = np.maximum(pressure, 0.0)
    force = np.zeros((3, samples))
    force[2] = -normal
    state = np.zeros((2, samples), dtype=int)
    history = np.zeros((2, 2 * samples))
    margin = np.zeros((2, samples))
    for d, k in enumerate((law.k_t, law.k_w)):
        slider = 0.0
        # a spring that comes back to where it slipped lies on its limit again: rounding must not make that a second slip
        rounding = 1e-13 * (k * np.max(np.abs(gap[d])) + law.mu * np.max(normal))
        if law.residual_traction is not None:
            slider = gap[d, -1] - law.residual_traction * law.mu * normal[-1] / k
        for step in range(2 * samples):
            i = step % samples
            x, limit = gap[d, i], law.mu * normal[i]
            spring = k * (x - slider)
            margin[d, i] = abs(abs(spring) - limit)
            if pressure[i] < 0.0:
                slider, force[d, i], state[d, i] = x, 0.0, OPEN
                margin[d, i] = abs(pressure[i])
            elif abs(spring) > limit + rounding:
                force[d, i], state[d, i] = np.sign(spring) * limit, SLIP
                slider = x - force[d, i] / k if k > 0 else 0.0
            else:
                force[d, i], state[d, i] = spring, STICK
            history[d, step] = state[d, i] * (np.sign(spring) if state[d, i] == SLIP else 1.0)
    return Twin(force, state, history, margin)


def basis(order: int, samples: int) -> FloatArray:
    """(samples, 2 order + 1) Fourier basis 1, cos, sin, cos 2, ..."""
    tau = 2 * np.pi * np.arange(samples) / samples
    columns = [np.ones(samples)]
    for h in range(1, order + 1):
        columns += [np.cos(h * tau), np.sin(h * tau)]
    return np.array(columns).T


def analyse(signal: FloatArray, order: int) -> FloatArray:
    """Real Fourier coefficients of the last axis by FFT: (..., 2 order + 1)."""
    spectrum = np.fft.rfft(signal) / signal.shape[-1]
    out = np.empty((*signal.shape[:-1], 2 * order + 1))
    out[..., 0] = spectrum[..., 0].real
    for h in range(1, order + 1):
        out[..., 2 * h - 1] = 2 * spectrum[..., h].real
        out[..., 2 * h] = -2 * spectrum[..., h].imag
    return out


# ---- systems ------------------------------------------------------------------------------------------------------------


def lifting() -> tuple[System, HarmonicLoad]:
    """One mass on its spring and on a pressed contact that lifts off: its response bends to lower frequencies and folds.

    m = k = 1, contact stiffness 1 and preload 1, c = 0.02, force 0.05.
    """
    one = np.ones((1, 1))
    structure = Structure(one, 0.02 * one, one.copy(), table(("x",)))
    law = ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=1.0, mu=0.0, preload=1.0)
    system = System(structure, Interface(("n",), (law,), np.array([[0.0], [0.0], [1.0]])), np.array([0]))
    return system, HarmonicLoad(np.zeros(1), {1: np.array([0.05 + 0j])})


def free_body_3d(seed: int = 0, preload: float = 30.0) -> tuple[System, HarmonicLoad]:
    """Two grounded masses and a free body of six coordinates between them, two contacts in general position."""
    rng = np.random.default_rng(seed)
    n = 12
    mass = np.diag([1.0, 1, 1, 1, 1, 1, 0.2, 0.2, 0.2, 2e-2, 2e-2, 2e-2])
    grounded = rng.standard_normal((6, 6))
    stiffness = np.zeros((n, n))
    stiffness[:6, :6] = 1e5 * (grounded @ grounded.T / 6 + 2 * np.eye(6))
    damping = 1e-4 * stiffness + np.diag([3.0] * 6 + [0.0] * 6)
    gap = np.zeros((6, n))
    for contact, (arm, blade) in enumerate(((np.array([0.2, -0.1, 0.3]), 0), (np.array([-0.3, 0.2, 0.1]), 3))):
        frame = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        cross = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        rows = slice(3 * contact, 3 * contact + 3)
        gap[rows, blade : blade + 3] = frame.T
        gap[rows, 6:9] = -frame.T
        gap[rows, 9:12] = frame.T @ cross
    laws = tuple(ElasticCoulomb(k_t=2e5, k_w=1e5, k_n=3e5, mu=0.4, preload=p) for p in (preload, 0.5 * preload))
    names = tuple(f"b{i}.{c}" for i in (1, 2) for c in "xyz")
    dofs = table((*names, "x", "y", "z", "rx", "ry", "rz"))
    system = System(
        Structure(mass, damping, stiffness, dofs), Interface(("1", "2"), laws, gap), np.arange(6), free=np.arange(6, 12)
    )
    shake = np.zeros(n, dtype=complex)
    shake[:6] = 10.0 * (rng.standard_normal(6) + 1j * rng.standard_normal(6))
    return system, HarmonicLoad(5.0 * rng.standard_normal(n), {1: shake})


# ---- solutions ----------------------------------------------------------------------------------------------------------


def balance_of(system, load, order=3, samples=SAMPLES):
    return harmonic_balance(condense(system.structure, system.retained, load), system.interface, order, samples)


def solved(system, load, omega, order=3, samples=SAMPLES, start=None):
    balance = balance_of(system, load, order, samples)
    if start is None:
        start = bonded(system, load, omega, balance)
    solution = newton(lambda v: balance.linearise(v, omega), balance.unknowns(start), Newton(max_iterations=60))
    assert solution.status.converged, solution.status
    return balance, solution


def bonded(system, load, omega, balance):
    structure = system.stuck_structure()
    f = load.coefficients(balance.order)
    f[0] = f[0] - system.interface.gap_operator.T @ np.concatenate(
        [[0, 0, -law.preload] for law in system.interface.laws]
    )
    q = []
    for h in range(balance.order + 1):
        w = h * omega
        q.append(np.linalg.solve(structure.stiffness + 1j * w * structure.damping - w**2 * structure.mass, f[h]))
    return np.array(q)[:, system.retained]
