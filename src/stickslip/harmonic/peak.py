"""The resonance peak as an equation: the periodic problem bordered by a condition that holds where an amplitude is largest.

The unknowns are those of the balance and the frequency. With ``a`` the first harmonic of one retained coordinate, the condition is

- by horizontal tangent, ``d|a|/dω = 0`` along the response, with the exact sensitivity ``dx/dω = -J⁻¹ ∂r/∂ω``: true for every maximum,
  minimum and saddle of the amplitude (Krack et al. 2017, section 3.4 and note 22);
- by phase quadrature, ``a`` lags the force by 90°: no second derivative is needed, and it is not exactly the maximum.

The gradient of the first condition follows from the adjoint ``Jᵀ μ = ∂ ln|a|``. With ``v = dx/dω``, the matrix ``∂(J v + ∂r/∂ω)/∂x``
is, by the symmetry of second derivatives, the derivative of J along the response, and two evaluations of the Jacobian give it.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray
from stickslip.harmonic.balance import HarmonicBalance, Linearisation
from stickslip.harmonic.parameters import (
    BalanceAt,
    ParameterLinearisation,
    by_parameter,
    difference,
)

Condition = Literal["horizontal_tangent", "phase_quadrature"]
EVALUATIONS: dict[Condition, int] = {"horizontal_tangent": 3, "phase_quadrature": 1}
WANDERED = 3.0  # |ln(ω / omega_scale)| at which a corrector has lost the peak
ALONG = 1e-6  # relative change of the state over which the Jacobian is differenced
# the same where forces are sampled, in samples: J changes only when an event passes one
ALONG_SAMPLES = 8.0


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """How the response goes on from one solution when the frequency changes.

    Attributes
    ----------
    at
        Residual, Jacobian and ω-derivative.
    rate
        ``d ln|a| / d ln ω`` along the response.
    state
        (size,) ``dx / d ln ω``.
    adjoint
        (size,) ``J⁻ᵀ ∂ ln|a| / ∂x``.
    """

    at: Linearisation
    rate: float
    state: FloatArray
    adjoint: FloatArray


@dataclass(frozen=True, eq=False)
class BorderedLinearisation(ParameterLinearisation):
    """The same with a Jacobian that is always an array."""

    jac: FloatArray


@dataclass(frozen=True, eq=False)
class PeakProblem:
    """The periodic problem with the frequency at which one amplitude peaks as a further unknown; an equation in a design parameter.

    Unknowns are those of the balance and ``ln(ω / omega_scale)``.

    Parameters
    ----------
    family
        Harmonic balance of each value of the design parameter.
    condition
        What makes a peak.
    position
        Position of the coordinate among the retained ones.
    phase
        Phase of the force, rad; the phase condition asks the coordinate to lag it by 90°.
    omega_scale
        Frequency at which the last unknown is zero, rad/s.
    sharpness
        Typical ``|da / d ln ω| / |a|``, by which the slope is divided, so that the tolerance does not depend on the damping.
    """

    family: BalanceAt
    condition: Condition
    position: int
    phase: float
    omega_scale: float
    sharpness: float = 1.0

    def omega(self, y: FloatArray) -> float:
        """Return the frequency of the unknowns `y`, rad/s."""
        return self.omega_scale * float(np.exp(y[-1]))

    def linearise(self, y: FloatArray, p: float) -> "BorderedLinearisation":
        """Evaluate the bordered problem at the unknowns `y` (size + 1,) and the design parameter `p`."""
        if not abs(y[-1]) < WANDERED:
            n = y.size
            return BorderedLinearisation(np.full(n, np.inf), np.eye(n), 0.0, lambda: np.zeros(n))
        at, value, row = self._bordered(self.family(p), y)
        n = at.residual.size
        jac: FloatArray = np.empty((n + 1, n + 1), order="F")
        jac[:n, :n] = at.dense_jac()
        jac[:n, n] = at.jac_p * self.omega(y)
        jac[n] = row

        def residual(value_of_p: float) -> FloatArray:
            other, condition, _ = self._bordered(self.family(value_of_p), y)
            return np.append(other.residual, condition)

        return BorderedLinearisation(
            np.append(at.residual, value), jac, at.seconds_contact, lambda: difference(residual, p)
        )

    def sensitivity(self, balance: HarmonicBalance, y: FloatArray) -> Sensitivity | None:
        """Return how the response goes on with the frequency; None where its Jacobian is singular, at a fold."""
        omega = self.omega(y)
        at = balance.linearise(y[:-1], omega)
        lu, pivots, info = scipy.linalg.lapack.dgetrf(at.dense_jac())
        if info != 0 or not np.all(np.isfinite(lu)):
            return None
        gradient = self._gradient(balance, y)
        state, _ = scipy.linalg.lapack.dgetrs(lu, pivots, -omega * at.jac_p)
        adjoint, _ = scipy.linalg.lapack.dgetrs(lu, pivots, gradient, trans=1)
        return Sensitivity(at, float(gradient @ state), state, adjoint)

    def curvature(self, y: FloatArray, p: float) -> float:
        """Return ``d² ln|a| / d(ln ω)²`` along the response: negative at a maximum; NaN at a fold."""
        balance = self.family(p)
        here = self.sensitivity(balance, y)
        if here is None:
            return np.nan
        row = self._tangent_row(balance, y, here)
        return float(row[:-1] @ here.state + row[-1])

    def amplitude_slope(self, y: FloatArray, p: float) -> float:
        """Return ``d ln|a| / dp`` along the curve of peaks; NaN where the problem is singular.

        By horizontal tangent a shift of the frequency does not change the amplitude (envelope theorem), so that the adjoint answers.
        """
        balance = self.family(p)
        by_p = by_parameter(self.family, y[:-1], self.omega(y), p)
        if self.condition == "horizontal_tangent":
            here = self.sensitivity(balance, y)
            return np.nan if here is None else -float(here.adjoint @ by_p)
        change = _solved(self.linearise(y, p).jac, -np.append(by_p, 0.0))
        return np.nan if change is None else float(self._gradient(balance, y) @ change[:-1])

    def amplitude(self, y: FloatArray, p: float) -> complex:
        """Return the first harmonic ``a`` of the coordinate at the unknowns `y`, m."""
        balance = self.family(p)
        cos, sin = self._places(balance)
        return balance.displacement_scale * complex(y[cos], -y[sin])

    def _places(self, balance: HarmonicBalance) -> tuple[int, int]:
        """Positions of cosine and sine part of the first harmonic in the unknowns."""
        n = balance.linear.n
        return n + self.position, 2 * n + self.position

    def _gradient(self, balance: HarmonicBalance, y: FloatArray) -> FloatArray:
        """Return (size,) the derivative of ``ln|a|``."""
        cos, sin = self._places(balance)
        out = np.zeros(y.size - 1)
        square = y[cos] ** 2 + y[sin] ** 2
        out[cos], out[sin] = y[cos] / square, y[sin] / square
        return out

    def _bordered(
        self, balance: HarmonicBalance, y: FloatArray
    ) -> tuple[Linearisation, float, FloatArray]:
        """Return the periodic problem, the value of the condition and its (size + 1,) derivative."""
        if self.condition == "phase_quadrature":
            at = balance.linearise(y[:-1], self.omega(y))
            return at, *self._quadrature(balance, y)
        here = self.sensitivity(balance, y)
        if here is None:
            at = balance.linearise(y[:-1], self.omega(y))
            return at, np.inf, np.zeros(y.size)
        row = self._tangent_row(balance, y, here)
        return here.at, here.rate / self.sharpness, row / self.sharpness

    def _quadrature(self, balance: HarmonicBalance, y: FloatArray) -> tuple[float, FloatArray]:
        """Return the cosine of the phase lag and its derivative."""
        cos, sin = self._places(balance)
        size = np.hypot(y[cos], y[sin])
        direction = np.zeros(y.size)
        direction[cos], direction[sin] = np.cos(self.phase), -np.sin(self.phase)
        value = float(direction @ y) / size
        row = direction / size
        row[:-1] -= value * self._gradient(balance, y)
        return value, row

    def _tangent_row(
        self, balance: HarmonicBalance, y: FloatArray, here: Sensitivity
    ) -> FloatArray:
        """Return the (size + 1,) derivative of the rate ``d ln|a| / d ln ω`` by state and frequency."""
        v = here.state
        along = np.append(v, 1.0)
        relative = ALONG_SAMPLES / balance.samples if _is_sampled(balance) else ALONG
        size = float(np.linalg.norm(y[:-1]))
        step = relative * size / max(float(np.linalg.norm(v)), size)
        sides = []
        for s in (step, -step):
            moved = y + s * along
            omega = self.omega(moved)
            at = balance.linearise(moved[:-1], omega)
            sides.append((at.dense_jac(), at.dense_jac() @ v + omega * at.jac_p))
        second = (sides[0][0] - sides[1][0]) / (2.0 * step)
        by_omega = (sides[0][1] - sides[1][1]) / (2.0 * step) - second @ v
        cos, sin = self._places(balance)
        square = y[cos] ** 2 + y[sin] ** 2
        row = np.zeros(y.size)
        row[[cos, sin]] = v[[cos, sin]] / square
        row[:-1] -= 2.0 * here.rate * self._gradient(balance, y) + here.adjoint @ second
        row[-1] = -here.adjoint @ by_omega
        return row


def _is_sampled(balance: HarmonicBalance) -> bool:
    """Whether a law with memory or contact states is evaluated on samples, so that the Jacobian jumps when an event passes one."""
    contacts = balance.compiled
    on_grid = contacts.piecewise.size > 0 and contacts.evaluator != "events"
    return on_grid or any(laws.start.shape[1] > 0 for laws in contacts.marched)


def _solved(matrix: FloatArray, right: FloatArray) -> FloatArray | None:
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return None
