"""Exact propagation of a linear structure over a time step, for `stickslip.response.time.transient`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, Matrix, as_array
from stickslip.errors import input_error
from stickslip.model.blas_threads import threads_for
from stickslip.model.structure import Structure
from stickslip.response.time.stepping.time_step import StepOperators

# frequency of a contact spring with its effective mass, over the load frequency;
# above it the spring is no part of the linear structure
FAST = 10.0

COUPLED = 1e-12  # coupling of two modes in a step, below which it is rounding


class PeriodicLoad(Protocol):
    """Load ``f(t) = static + Re Σ_h harmonics[h] e^{ihωt}``, N."""

    @property
    def static(self) -> FloatArray:
        """(n,) static forces."""

    @property
    def harmonics(self) -> Mapping[int, ComplexArray]:
        """Mapping from order to (n,) complex amplitudes."""


@dataclass(frozen=True, eq=False)
class ModalCoordinates:
    """Modal coordinates with every contact stuck: ``u = basis q``, ``u̇ = ω basis (speed w)``, motion = (q, w)."""

    basis: FloatArray  # (n, n), mass-normalised
    inverse: FloatArray  # (n, n) = basisᵀ M
    speed: FloatArray  # (n,) scale of w, so that the propagator of a stiff mode is nearly a rotation
    seen: FloatArray  # (2k, 2n): gaps and their rates of a motion
    omega: float
    paces: FloatArray  # (k,) frequency of each contact spring with the effective mass of its gap, rad/s

    def motion(self, displacement: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return (q, w) of physical displacement and velocity."""
        return np.concatenate([self.inverse @ displacement, self.inverse @ velocity / (self.omega * self.speed)])

    def physical(self, motion: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and velocity of (q, w)."""
        n = self.speed.size
        return self.basis @ motion[:n], self.omega * (self.basis @ (self.speed * motion[n:]))


def require_array(name: str, array: FloatArray | ComplexArray, shape: tuple[int, ...]) -> None:
    """Refuse an array of another shape or with non-finite entries."""
    if np.shape(array) != shape:
        raise input_error(name, f"has shape {np.shape(array)}", f"It must be {shape}.")
    if not np.all(np.isfinite(array)):
        raise input_error(name, "contains NaN or infinity", "Give finite numbers.")


def _dense(matrix: Matrix) -> FloatArray:
    return np.asarray(as_array(matrix), dtype=float)


def _paces(structure: Structure, gap_operator: FloatArray, stuck: FloatArray) -> FloatArray:
    """Return the frequency of each contact spring with the effective mass ``1 / B M⁻¹ Bᵀ`` of its gap, rad/s."""
    mass = _dense(structure.mass)
    try:
        root = scipy.linalg.cholesky(mass, lower=True)
    except np.linalg.LinAlgError as error:
        diagonal = np.diag(mass)
        name = structure.dofs.labels[int(np.argmin(diagonal))]
        raise input_error(
            "Structure.mass",
            f"is not positive definite (smallest diagonal entry {np.min(diagonal):.3g} at {name})",
            "Time integration needs a mass on every coordinate: condense the massless ones.",
        ) from error
    moved = scipy.linalg.solve_triangular(root, gap_operator.T, lower=True)
    return np.asarray(np.sqrt(np.maximum(stuck, 0.0) * np.sum(moved**2, axis=0)))


def _coordinates(
    structure: Structure, stiffness: FloatArray, gap_operator: FloatArray, paces: FloatArray, omega: float
) -> ModalCoordinates:
    mass = _dense(structure.mass)
    with threads_for(len(mass)):
        values, basis = scipy.linalg.eigh((stiffness + stiffness.T) / 2, mass)
    speed = np.maximum(1.0, np.sqrt(np.abs(values)) / omega)
    gaps = gap_operator @ basis
    none = np.zeros_like(gaps)
    seen = np.block([[gaps, none], [none, omega * gaps * speed]])
    return ModalCoordinates(basis, basis.T @ mass, speed, seen, omega, paces)


def step_operators(
    structure: Structure,
    gap_operator: Matrix,
    stuck: FloatArray,
    load: PeriodicLoad,
    omega: float,
    steps: int,
    caller: str = "integrate",
) -> tuple[StepOperators, ModalCoordinates, FloatArray]:
    """Return the matrices of a time step, their coordinates, and the springs (3 n_contacts,) in them.

    A period has `steps` steps.

    Parameters
    ----------
    stuck
        (3 n_contacts,) stiffness of sticking contacts, N/m; other arguments as in `integrate`.
    caller
        Public function named in errors.
    """
    if structure.loss is not None:
        raise input_error(
            f"{caller}: structure",
            "has structural damping, which is defined for vibration at one frequency and not in time",
            "Use viscous damping: modal_damping with half the loss factor has the same effect at resonance.",
        )
    gap_operator = _dense(gap_operator)
    _check(structure.n, gap_operator, stuck.size, load, omega, caller)
    paces = _paces(structure, gap_operator, stuck)
    # in the linear structure a sticking spring is exact, while a slipping one reduces the mass by about k h²/12,
    # which must be small against its effective mass
    springs = np.where(paces > FAST * omega, 0.0, stuck)
    stiffness = _dense(structure.stiffness) + gap_operator.T @ (springs[:, None] * gap_operator)
    modes = _coordinates(structure, stiffness, gap_operator, paces, omega)
    n, k, m, seen = structure.n, gap_operator.shape[0], 2 * structure.n, modes.seen
    damping = modes.basis.T @ _dense(structure.damping) @ modes.basis
    motion = _motion_matrix(modes.basis.T @ stiffness @ modes.basis, damping, modes)
    exponential = _step_exponential(motion, seen[:k, :n], modes, load, 2 * np.pi / steps)
    constant, line = exponential[:, m : m + k], exponential[:, m + k : m + 2 * k]
    # linear interpolation would make fast springs unstable; the mean of both ends conserves their energy
    hold = np.where(springs == stuck, line, constant / 2)
    transfer = np.hstack([exponential[:, :m], constant - hold])
    drive = _clock(sorted(load.harmonics), steps) @ exponential[:, m + 2 * k :].T
    operators = StepOperators(
        np.ascontiguousarray(transfer.T),
        np.ascontiguousarray(drive),
        np.ascontiguousarray(hold.T),
        np.ascontiguousarray((seen @ hold).T),
        np.ascontiguousarray(seen[:k, :n]),
        np.ascontiguousarray(seen[k:, n:]),
        _turn(exponential[:, :m]),
    )
    return operators, modes, springs


def _turn(step: FloatArray) -> FloatArray:
    """Return the (4, n) entries of a step (2n, 2n) within each mode; (0, n) where modes are coupled."""
    n = len(step) // 2
    parts = [step[a : a + n, b : b + n] for a in (0, n) for b in (0, n)]
    if any(np.any(np.abs(part - np.diag(np.diag(part))) > COUPLED) for part in parts):
        return np.zeros((0, n))
    return np.array([np.diag(part) for part in parts])


def _motion_matrix(stiffness: FloatArray, damping: FloatArray, modes: ModalCoordinates) -> FloatArray:
    """Return the matrix A of ``d(q, w)/dτ = A (q, w)`` in the time ``τ = ωt``, from modal stiffness and damping."""
    speed, omega = modes.speed[:, None], modes.omega
    free = np.hstack([np.zeros_like(stiffness), np.diag(modes.speed)])
    forced = np.hstack([-stiffness / (omega**2 * speed), -damping * speed.T / (omega * speed)])
    return np.vstack([free, forced])


def _step_exponential(
    motion: FloatArray, gaps: FloatArray, modes: ModalCoordinates, load: PeriodicLoad, step: float
) -> FloatArray:
    """Return the rows of the motion in the exponential of one block matrix with all parts of a step.

    The columns belong to the motion, the contact force at the beginning of the step, its increase over the step (linear
    in time), and the clock ``(1, cos hτ, sin hτ, ...)`` of the loads. No stiffness is inverted, so free rigid bodies
    are allowed.
    """
    m, n, k = len(motion), len(motion) // 2, len(gaps)
    orders = sorted(load.harmonics)
    forces = [load.static]
    for h in orders:
        forces += [load.harmonics[h].real, -load.harmonics[h].imag]
    acceleration = 1.0 / (modes.omega**2 * modes.speed[:, None])
    block = np.zeros((m + 2 * k + len(forces),) * 2)
    block[:m, :m] = motion
    block[n:m, m : m + k] = -gaps.T * acceleration
    block[n:m, m + 2 * k :] = (modes.basis.T @ np.array(forces).T) * acceleration
    for i, h in enumerate(orders):
        row = m + 2 * k + 1 + 2 * i
        block[row, row + 1], block[row + 1, row] = -h, h
    block *= step
    block[m : m + k, m + k : m + 2 * k] = np.eye(k)
    return np.asarray(scipy.linalg.expm(block)[:m])


def _clock(orders: list[int], steps: int) -> FloatArray:
    """Return (steps, 1 + 2 len(orders)) values of ``(1, cos hτ, sin hτ, ...)`` at the beginning of each step."""
    tau = 2 * np.pi / steps * np.arange(steps)
    waves = [wave(h * tau) for h in orders for wave in (np.cos, np.sin)]
    return np.array([np.ones(steps), *waves]).T


def _check(n: int, gap_operator: FloatArray, rows: int, load: PeriodicLoad, omega: float, caller: str) -> None:
    require_array(f"{caller}: gap_operator", gap_operator, (rows, n))
    require_array(f"{caller}: load.static", load.static, (n,))
    for order, amplitude in load.harmonics.items():
        require_array(f"{caller}: load.harmonics[{order}]", amplitude, (n,))
    if not (np.isfinite(omega) and omega > 0.0):
        raise input_error(f"{caller}: omega", f"must be positive, got {omega}", "It is in rad/s.")
