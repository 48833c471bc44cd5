"""Exact propagation of a linear structure over a time step, for `evidence.integrator.transient`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.sparse

from evidence.integrator.time_step import StepOperators
from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.errors import input_error
from stickslip.model.structure import Structure


class PeriodicLoad(Protocol):
    """Any load ``f(t) = static + Re Σ_h harmonics[h] e^{ihωt}``, N."""

    @property
    def static(self) -> FloatArray:
        """(n,) static forces."""

    @property
    def harmonics(self) -> Mapping[int, ComplexArray]:
        """Order -> (n,) complex amplitudes."""


@dataclass(frozen=True, eq=False)
class ModalCoordinates:
    """Modal coordinates with every contact stuck: ``u = basis q``, ``u̇ = ω basis (speed w)``, motion = (q, w)."""

    basis: FloatArray  # (n, n), mass-normalised
    inverse: FloatArray  # (n, n) = basisᵀ M
    speed: FloatArray  # (n,) scale of w, which keeps the propagator of a stiff mode near a rotation
    omega: float

    def motion(self, displacement: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return (q, w) of physical displacement and velocity."""
        return np.concatenate([self.inverse @ displacement, self.inverse @ velocity / (self.omega * self.speed)])

    def physical(self, motion: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and velocity of (q, w)."""
        n = self.speed.size
        return self.basis @ motion[:n], self.omega * (self.basis @ (self.speed * motion[n:]))


def require_array(name: str, array: FloatArray | ComplexArray, shape: tuple[int, ...]) -> None:
    """Refuse an array that has another shape or entries that are not finite."""
    if np.shape(array) != shape:
        raise input_error(name, f"has shape {np.shape(array)}", f"It must be {shape}.")
    if not np.all(np.isfinite(array)):
        raise input_error(name, "contains NaN or infinity", "Give finite numbers.")


def dense(matrix: Matrix) -> FloatArray:
    """Return a matrix, dense or sparse, as an array of doubles."""
    return np.asarray(matrix.toarray() if scipy.sparse.issparse(matrix) else matrix, dtype=float)


def _coordinates(structure: Structure, stiffness: FloatArray, omega: float) -> ModalCoordinates:
    mass = dense(structure.mass)
    try:
        values, basis = scipy.linalg.eigh((stiffness + stiffness.T) / 2, mass)
    except np.linalg.LinAlgError as error:
        diagonal = np.diag(mass)
        name = structure.dofs.labels[int(np.argmin(diagonal))]
        raise input_error(
            "Structure.mass",
            f"is not positive definite (smallest diagonal entry {np.min(diagonal):.3g} at {name})",
            "Time integration needs a mass on every coordinate: condense the massless ones.",
        ) from error
    speed = np.maximum(1.0, np.sqrt(np.abs(values)) / omega)
    return ModalCoordinates(basis, basis.T @ mass, speed, omega)


def step_operators(
    structure: Structure,
    gap_operator: Matrix,
    law: FloatArray,
    load: PeriodicLoad,
    omega: float,
    steps: int,
    caller: str = "integrate",
) -> tuple[StepOperators, ModalCoordinates]:
    """Return the matrices of one of `steps` time steps in a period, and the coordinates they act on.

    Parameters
    ----------
    law
        (n_contacts, 5): k_t, k_w, k_n (N/m), mu, preload (N) of each contact; the rest as in `integrate`.
    caller
        Public function that errors name.
    """
    if structure.loss is not None:
        raise input_error(
            f"{caller}: structure",
            "has structural damping, which is defined for vibration at one frequency and not in time",
            "Use viscous damping: modal_damping with half the loss factor has the same effect at resonance.",
        )
    gap_operator = dense(gap_operator)
    _check(structure.n, gap_operator, law, load, omega, caller)
    springs = law[:, :3].reshape(-1, 1)
    stuck = dense(structure.stiffness) + gap_operator.T @ (springs * gap_operator)
    modes = _coordinates(structure, stuck, omega)
    n, k, m = structure.n, gap_operator.shape[0], 2 * structure.n
    gaps = np.hstack([gap_operator @ modes.basis, np.zeros((k, n))])
    damping = modes.basis.T @ dense(structure.damping) @ modes.basis
    motion = _motion_matrix(modes.basis.T @ stuck @ modes.basis, damping, modes)
    exponential = _step_exponential(motion, gaps[:, :n], modes, load, 2 * np.pi / steps)
    hold = exponential[:, m + k : m + 2 * k]
    transfer = np.hstack([exponential[:, :m], exponential[:, m : m + k] - hold])
    drive = _clock(sorted(load.harmonics), steps) @ exponential[:, m + 2 * k :].T
    operators = StepOperators(
        np.ascontiguousarray(np.vstack([transfer, gaps @ transfer]).T),
        np.hstack([drive, drive @ gaps.T]),
        np.ascontiguousarray(hold.T),
        np.ascontiguousarray((gaps @ hold).T),
        law,
    )
    return operators, modes


def _motion_matrix(stiffness: FloatArray, damping: FloatArray, modes: ModalCoordinates) -> FloatArray:
    """Matrix A of ``d(q, w)/dτ = A (q, w)`` in the time ``τ = ωt``, from modal stiffness and damping."""
    speed, omega = modes.speed[:, None], modes.omega
    free = np.hstack([np.zeros_like(stiffness), np.diag(modes.speed)])
    forced = np.hstack([-stiffness / (omega**2 * speed), -damping * speed.T / (omega * speed)])
    return np.vstack([free, forced])


def _step_exponential(
    motion: FloatArray, gaps: FloatArray, modes: ModalCoordinates, load: PeriodicLoad, step: float
) -> FloatArray:
    """Rows of the motion in the exponential of one block matrix, which holds all that a step needs.

    The columns are those of the motion, of the contact force at the beginning of the step, of its increase over the step
    (it is linear in time), and of the clock ``(1, cos hτ, sin hτ, ...)`` that drives the loads. No stiffness is inverted,
    so that a free rigid body is welcome.
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


def _check(n: int, gap_operator: FloatArray, law: FloatArray, load: PeriodicLoad, omega: float, caller: str) -> None:
    require_array(f"{caller}: gap_operator", gap_operator, (3 * len(law), n))
    require_array(f"{caller}: load.static", load.static, (n,))
    for order, amplitude in load.harmonics.items():
        require_array(f"{caller}: load.harmonics[{order}]", amplitude, (n,))
    if not (np.isfinite(omega) and omega > 0.0):
        raise input_error(f"{caller}: omega", f"must be positive, got {omega}", "It is in rad/s.")
