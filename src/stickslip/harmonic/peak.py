"""The resonance peak as an equation: the periodic problem bordered by a condition that holds where an amplitude is largest.

The unknowns are those of the balance and the frequency. With ``|a|`` the norm of one retained coordinate over the harmonics that the load
drives, the condition is

- by horizontal tangent, ``d|a|/dω = 0`` along the response, with the exact sensitivity ``dx/dω = -J⁻¹ ∂r/∂ω``: true for every maximum,
  minimum and saddle of the amplitude (Krack et al. 2017, section 3.4 and note 22);
- by phase quadrature, the coordinate lags the force by 90°: no second derivative is needed, and it is not exactly the maximum.

The gradient of the first condition follows from the adjoint ``Jᵀ μ = ∂ ln|a|``. With ``v = dx/dω``, the matrix ``∂(J v + ∂r/∂ω)/∂x``
is, by the symmetry of second derivatives, the derivative of J along the response, and two evaluations of the Jacobian give it.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.bordered import (
    Condition,
    Invert,
    PeriodicProblem,
    State,
    unknown_frequency,
)
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.parameters import BalanceAt, ParameterLinearisation, by_parameter
from stickslip.operators import transposed_times

Peak = Literal["horizontal_tangent", "phase_quadrature"]
EVALUATIONS: dict[Peak, int] = {"horizontal_tangent": 3, "phase_quadrature": 1}
ALONG = 1e-6  # relative change of the state over which the Jacobian is differenced
# the same where forces are sampled, in samples: J changes only when an event passes one
ALONG_SAMPLES = 8.0


@dataclass(frozen=True)
class Driven:
    """One coordinate in the harmonics that the load drives.

    Parameters
    ----------
    position
        Position of the coordinate among the retained ones.
    harmonics
        The harmonics, that of the largest force first.
    """

    position: int
    harmonics: tuple[int, ...]

    def places(self, balance: HarmonicBalance) -> IntArray:
        """Return the (2 k,) places of the cosine and sine parts among the unknowns, a pair for each harmonic."""
        rows = np.array([balance.harmonics.index(h) for h in self.harmonics])
        pairs = np.stack([2 * rows - 1, 2 * rows], axis=1)
        return np.asarray(pairs.reshape(-1) * balance.linear.n + self.position)

    def motion(self, balance: HarmonicBalance, x: FloatArray) -> ComplexArray:
        """Return the (k,) complex displacements at the unknowns `x`, m."""
        own = x[self.places(balance)]
        return np.asarray(balance.displacement_scale * (own[::2] - 1j * own[1::2]))

    def gradient(self, balance: HarmonicBalance, x: FloatArray) -> FloatArray:
        """Return (size,) the derivative of ``ln|a|``, |a| the norm over the harmonics."""
        places = self.places(balance)
        out = np.zeros(x.size)
        out[places] = x[places] / (x[places] @ x[places])
        return out


def driven_by(load: HarmonicLoad) -> tuple[tuple[int, ...], float]:
    """Return the harmonics that a load drives, that of the largest force first, and the phase of this force, rad.

    Raises
    ------
    InputError
        If it drives none.
    """
    largest = {h: f[np.argmax(np.abs(f))] for h, f in load.harmonics.items() if np.any(f)}
    if not largest:
        raise input_error("load", "drives no harmonic", "A peak needs an excitation.")
    order = sorted(largest, key=lambda h: (-abs(largest[h]), h))
    return tuple(order), float(np.angle(largest[order[0]]))


@dataclass(frozen=True)
class HorizontalTangent:
    """The amplitude changes neither way with the first extra unknown, ``ln ω``.

    Parameters
    ----------
    driven
        What peaks.
    sharpness
        Typical ``|da / d ln ω| / |a|``, by which the slope is divided, so that the tolerance does not depend on the damping.
    """

    driven: Driven
    sharpness: float = 1.0

    def value(self, state: State) -> float:
        """Return the slope ``d ln|a| / d ln ω``; infinite at a fold."""
        if state.along is None:
            return np.inf
        slope = self.driven.gradient(state.setting.balance, state.x) @ state.along
        return float(slope) / self.sharpness

    def gradient(self, state: State) -> FloatArray:
        """Return its (size + m,) derivative; zeros at a fold."""
        size, v, row = state.x.size, state.along, np.zeros(state.y.size)
        own = self.driven.gradient(state.setting.balance, state.x)
        adjoint = None if state.inverse is None else state.inverse(own, transposed=True)
        if v is None or adjoint is None:
            return row
        places = self.driven.places(state.setting.balance)
        row[places] = v[places] / (state.x[places] @ state.x[places])
        second, by_frequency = _along(state, v, adjoint)
        row[:size] -= 2.0 * float(own @ v) * own + second
        row[size] = -by_frequency
        for place in range(1, state.extra.size):
            row[size + place] = -state.by_extra(place, lambda s: _weighted(s, v, adjoint)[0])
        return row / self.sharpness


def _along(state: State, v: FloatArray, adjoint: FloatArray) -> tuple[FloatArray, float]:
    """Return (size,) ``μᵀ ∂(J v + dr/d ln ω)/∂x`` and the same by ``ln ω``, from two evaluations along the response."""
    balance, size = state.setting.balance, float(np.linalg.norm(state.x))
    relative = ALONG_SAMPLES / balance.samples if _is_sampled(balance) else ALONG
    step = relative * size / max(float(np.linalg.norm(v)), size)
    way = np.zeros(state.y.size)
    way[: v.size], way[v.size] = v, 1.0
    up, down = (_weighted(state.moved(s * way), v, adjoint) for s in (step, -step))
    second, change = ((a - b) / (2.0 * step) for a, b in zip(up[::-1], down[::-1], strict=True))
    return second, float(change - second @ v)


def _weighted(state: State, v: FloatArray, adjoint: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ``μᵀ(J v + dr/d ln ω)`` and (size,) ``μᵀ J`` at a state, with direction v and adjoint μ of another one."""
    rows = transposed_times(state.at.jac, adjoint)
    return np.asarray(rows @ v + adjoint @ state.columns[:, 0]), rows


@dataclass(frozen=True)
class PhaseQuadrature:
    """The coordinate lags the force by 90°, in the harmonic of the largest force.

    Parameters
    ----------
    driven
        What lags.
    phase
        Phase of the force, rad.
    """

    driven: Driven
    phase: float

    def value(self, state: State) -> float:
        """Return the cosine of the phase lag."""
        own = state.x[self._places(state)]
        return float(self._direction @ own / np.linalg.norm(own))

    def gradient(self, state: State) -> FloatArray:
        """Return its (size + m,) derivative."""
        places = self._places(state)
        own = state.x[places]
        size = float(np.linalg.norm(own))
        row = np.zeros(state.y.size)
        row[places] = self._direction / size - self.value(state) * own / size**2
        return row

    def _places(self, state: State) -> IntArray:
        return self.driven.places(state.setting.balance)[:2]

    @property
    def _direction(self) -> FloatArray:
        return np.array([np.cos(self.phase), -np.sin(self.phase)])


@dataclass(frozen=True, eq=False)
class PeakProblem:
    """The periodic problem with the frequency at which one amplitude peaks as a further unknown; an equation in a design parameter.

    Unknowns are those of the balance and ``ln(ω / omega_scale)``.

    Parameters
    ----------
    family
        Harmonic balance of each value of the design parameter.
    by
        What makes a peak.
    driven
        What peaks.
    phase
        Phase of the force in the first harmonic of `driven`, rad; the phase condition asks the coordinate to lag it by 90°.
    omega_scale
        Frequency at which the last unknown is zero, rad/s.
    invert
        How systems with the Jacobian of the balance are solved, as exactly as the peak is to be found.
    sharpness
        That of the horizontal tangent.
    """

    family: BalanceAt
    by: Peak
    driven: Driven
    phase: float
    omega_scale: float
    invert: Invert
    sharpness: float = 1.0

    @cached_property
    def bordered(self) -> PeriodicProblem:
        """The equation."""
        condition: Condition = HorizontalTangent(self.driven, self.sharpness)
        if self.by == "phase_quadrature":
            condition = PhaseQuadrature(self.driven, self.phase)
        settings = unknown_frequency(self.family, self.omega_scale)
        return PeriodicProblem(settings, (condition,), self.invert)

    def sharpened(self, state: State) -> "PeakProblem":
        """Return the problem with the sharpness that a `state` near the peak has."""
        if state.along is None:
            return self
        places = self.driven.places(state.setting.balance)
        sharp = np.linalg.norm(state.along[places]) / np.linalg.norm(state.x[places])
        return replace(self, sharpness=max(float(sharp), 1.0))

    def omega(self, y: FloatArray) -> float:
        """Return the frequency of the unknowns `y`, rad/s."""
        return self.omega_scale * float(np.exp(y[-1]))

    def linearise(self, y: FloatArray, p: float) -> ParameterLinearisation:
        """Evaluate the bordered problem at the unknowns `y` (size + 1,) and the design parameter `p`."""
        return self.bordered.linearise(y, p)

    def state(self, y: FloatArray, p: float) -> State:
        """Return the problem at the unknowns `y` and the design parameter `p`, for what follows."""
        return self.bordered.state(y, p)

    def rate(self, state: State) -> float:
        """Return ``d ln|a| / d ln ω`` along the response; infinite at a fold."""
        return HorizontalTangent(self.driven).value(state)

    def curvature(self, state: State) -> float:
        """Return ``d² ln|a| / d(ln ω)²`` along the response: negative at a maximum; NaN at a fold."""
        if state.along is None:
            return np.nan
        row = HorizontalTangent(self.driven).gradient(state)
        return float(row[:-1] @ state.along + row[-1])

    def amplitude_slope(self, state: State) -> float:
        """Return ``d ln|a| / dp`` along the curve of peaks; NaN where the problem is singular.

        By horizontal tangent a shift of the frequency does not change the amplitude (envelope theorem): the slope is that at fixed frequency.
        """
        by_p = by_parameter(self.family, state.x, state.setting.omega, state.p)
        inverse, right = state.inverse, -by_p
        if self.by == "phase_quadrature":
            inverse = self.invert(self.linearise(state.y, state.p).jac)
            right = np.append(right, 0.0)
        change = None if inverse is None else inverse(right)
        if change is None:
            return np.nan
        own = self.driven.gradient(state.setting.balance, state.x)
        return float(own @ change[: own.size])

    def motion(self, y: FloatArray, p: float) -> ComplexArray:
        """Return the (k,) complex displacements in the driven harmonics at the unknowns `y`, m."""
        return self.driven.motion(self.family(p), y[:-1])


def _is_sampled(balance: HarmonicBalance) -> bool:
    """Whether a law with memory or contact states is evaluated on samples, so that the Jacobian jumps when an event passes one."""
    contacts = balance.compiled
    on_grid = contacts.piecewise.size > 0 and contacts.evaluator != "events"
    return on_grid or any(laws.start.shape[1] > 0 for laws in contacts.marched)
