"""Modal amplitude of a nonlinear mode, from its kinetic energy: unaffected by internal resonances."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.bordered import State
from stickslip.response.self_excited.problem import SelfExcited


@dataclass(frozen=True, eq=False)
class Size:
    """``sum_h X_h^H W X_h`` over all harmonics above zero is one, in the scale of the problem.

    Parameters
    ----------
    weight
        (n, n) Hermitian.
    """

    weight: ComplexArray

    def value(self, state: State) -> float:
        """Return what is zero where it holds."""
        x = _vibration(state)
        return float(np.vdot(x, x @ self.weight.T).real - 1.0)

    def gradient(self, state: State) -> FloatArray:
        """Return its derivative by the unknowns."""
        slope = 2.0 * _vibration(state) @ self.weight.T
        return _row(state, slope)


@dataclass(frozen=True, eq=False)
class Phase:
    """The share of the linear mode in the first harmonic is real: time begins where it is largest.

    Parameters
    ----------
    row
        (n,) the product of which with the first harmonic is that share.
    """

    row: ComplexArray

    def value(self, state: State) -> float:
        """Return what is zero where it holds."""
        return float((self.row @ _vibration(state)[0]).imag)

    def gradient(self, state: State) -> FloatArray:
        """Return its derivative by the unknowns."""
        slope = np.zeros_like(_vibration(state))
        slope[0] = 1j * self.row.conj()
        return _row(state, slope)


def by_energy(problem: SelfExcited) -> tuple[Size, Phase]:
    """Return size and phase of the motions of a mode by the mass of all that moves; of the linear mode, size one is an amplitude of one of its coordinate.

    The mass is condensed at the frequency of the linear mode.
    """
    linear, mode = problem.balance.linear, problem.mode
    own = problem.system.structure.of_harmonic(1)
    spread = linear.output_rows(mode.omega, 1, np.arange(own.n))
    weight = spread.conj().T @ (own.mass @ spread)
    weight = 0.5 * (weight + weight.conj().T)
    shape = mode.shape[linear.retained] / mode.shape[problem.dof]
    weight = weight / np.vdot(shape, weight @ shape).real
    return Size(weight), Phase(shape.conj() @ weight)


def _vibration(state: State) -> ComplexArray:
    """Return the (H, n) harmonics above zero, in the scale of the problem."""
    rows = state.x.reshape(state.setting.balance.n_rows, -1)[1:]
    return np.asarray(rows[0::2] - 1j * rows[1::2])


def _row(state: State, slope: ComplexArray) -> FloatArray:
    """Return the derivative by all unknowns of what changes by ``Re sum_h slope_h^H X_h``."""
    out = np.zeros(state.y.size)
    rows = np.zeros((state.setting.balance.n_rows, slope.shape[1]))
    rows[1::2], rows[2::2] = slope.real, -slope.imag
    out[: state.x.size] = rows.reshape(-1)
    return out
