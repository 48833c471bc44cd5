"""The resonance peak as an equation: the periodic problem with the condition that an amplitude is stationary.

The unknowns are those of the balance and the frequency. With ``|a|`` the norm of one retained coordinate over the
harmonics that the load drives, the condition is

- by horizontal tangent, ``d|a|/dω = 0`` along the response, with the exact sensitivity ``dx/dω = -J⁻¹ ∂r/∂ω``: true for
  every maximum, minimum and saddle of the amplitude (Krack et al. 2017, section 3.4 and note 22);
- by phase quadrature, a lag of the coordinate behind the force of 90°: no second derivative is needed, but it is not
  exactly the maximum;
- by variable phase, the phase of the coordinate at the last known maximum (Förster and Krack, arXiv 2012.14458, hold
  the lag of the linear resonance).

The condition uses the tangent (v, τ) of x and ln ω along the response, which exists at folds too: ``v`` is τ times the
sensitivity. Its gradient follows from an adjoint μ. It needs the matrix ``∂(J v + τ ∂r/∂ω)/∂x``; since second
derivatives are symmetric, this is the derivative of J along the response, a difference of two Jacobians.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.bordered import Condition, Evaluated, Invert, PeriodicProblem, State, unknown_frequency
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.parameters import BalanceAt, ParameterLinearisation, by_parameter
from stickslip.operators import transposed_times

Peak = Literal["horizontal_tangent", "phase_quadrature", "variable_phase"]
EVALUATIONS: dict[Peak, int] = {"horizontal_tangent": 3, "phase_quadrature": 1, "variable_phase": 1}
ALONG = 1e-6  # relative step of the state for differences of the Jacobian
# the same step in samples, for sampled forces: J changes only when an event passes a sample
ALONG_SAMPLES = 8.0


@dataclass(frozen=True)
class Driven:
    """One coordinate in the harmonics that the load excites.

    Parameters
    ----------
    position
        Position of the coordinate among the retained ones.
    harmonics
        The harmonics, the one of the largest force first.
    """

    position: int
    harmonics: tuple[int, ...]

    def places(self, balance: HarmonicBalance) -> IntArray:
        """Return the (2 k,) positions of the cosine and sine parts among the unknowns, a pair for each harmonic."""
        rows = np.array([balance.harmonics.index(h) for h in self.harmonics])
        pairs = np.stack([2 * rows - 1, 2 * rows], axis=1)
        return np.asarray(pairs.reshape(-1) * balance.linear.n + self.position)

    def motion(self, balance: HarmonicBalance, x: FloatArray) -> ComplexArray:
        """Return the (k,) complex displacements at the unknowns `x`, m."""
        own = x[self.places(balance)]
        return np.asarray(balance.displacement_scale * (own[::2] - 1j * own[1::2]))

    def gradient(self, balance: HarmonicBalance, x: FloatArray) -> FloatArray:
        """Return the (size,) derivative of ``ln|a|``, |a| being the norm over the harmonics."""
        places = self.places(balance)
        out = np.zeros(x.size)
        out[places] = x[places] / (x[places] @ x[places])
        return out


def driven_by(load: HarmonicLoad) -> tuple[tuple[int, ...], float]:
    """Return the harmonics of a load, the one of the largest force first, and the phase of this force, rad.

    Raises
    ------
    InputError
        If the load has no harmonics.
    """
    largest = {h: f[np.argmax(np.abs(f))] for h, f in load.harmonics.items() if np.any(f)}
    if not largest:
        raise input_error("load", "drives no harmonic", "A peak needs an excitation.")
    order = sorted(largest, key=lambda h: (-abs(largest[h]), h))
    return tuple(order), float(np.angle(largest[order[0]]))


@dataclass(frozen=True)
class HorizontalTangent:
    """Condition of a stationary amplitude along the response: the change of the amplitudes is orthogonal to them.

    The frequency is the first extra unknown.

    Parameters
    ----------
    driven
        Coordinate and harmonics of the amplitude.
    """

    driven: Driven

    def value(self, state: State) -> float:
        """Return the cosine of the angle between the amplitudes and their change along the response.

        It is infinite if the tangent is unknown.
        """
        if state.along is None:
            return np.inf
        own, change, cosine = self._three(state, state.along)
        return cosine if np.any(own) and np.any(change) else np.inf

    def gradient(self, state: State) -> FloatArray:
        """Return the (size + m,) derivative of the value; zeros if unknown."""
        if state.along is None:
            return np.zeros(state.y.size)
        own, change, cosine = self._three(state, state.along)
        squares = float(own @ own), float(change @ change)
        both = np.sqrt(squares[0] * squares[1])
        by_own = change / both - cosine * own / squares[0]
        by_change = own / both - cosine * change / squares[1]
        return _gradient(self.driven, state, state.along, by_own, by_change)

    def _three(self, state: State, along: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        places = self.driven.places(state.setting.balance)
        own, change = state.x[places], along[places]
        size = float(np.linalg.norm(own) * np.linalg.norm(change))
        return own, change, float(own @ change) / size if size > 0.0 else 0.0


def _gradient(driven: Driven, state: State, along: FloatArray, by_own: FloatArray, by_change: FloatArray) -> FloatArray:
    """Return the (size + m,) derivative of a function of the driven amplitudes and of their change along the response.

    Zeros if the derivative is unknown.

    Parameters
    ----------
    driven
        Coordinate and harmonics of the amplitude.
    state
        State at which the derivative is taken.
    along
        (size + 1,) tangent at this state.
    by_own, by_change
        (2 k,) derivatives of the function by the amplitudes and by their change.
    """
    size, row, right = state.x.size, np.zeros(state.y.size), np.zeros(along.size)
    places = driven.places(state.setting.balance)
    right[places] = by_change
    adjoint = None if state.inverse is None else state.inverse(right, transposed=True)
    if adjoint is None:
        return row
    mu = adjoint[:-1]
    row[places] = by_own
    row[: size + 1] -= _turned(state, along, mu)
    for place in range(1, state.extra.size):
        row[size + place] = -state.by_extra(place, lambda s: _weighted(s, mu) @ along)
    return row


def _turned(state: State, along: FloatArray, adjoint: FloatArray) -> FloatArray:
    """Return (size + 1,) ``μᵀ ∂(J v + τ ∂r/∂z)`` by x and by z, with (v, τ) and μ fixed.

    By symmetry this is the derivative of ``μᵀ [J, ∂r/∂z]`` along (v, τ).
    """
    balance, size = state.setting.balance, float(np.linalg.norm(state.x))
    relative = ALONG_SAMPLES / balance.samples if _is_sampled(balance) else ALONG
    step = relative * size / max(float(np.linalg.norm(along[:-1])), size * abs(float(along[-1])))
    way = np.zeros(state.y.size)
    way[: along.size] = step * along
    return (_weighted(state.moved(way), adjoint) - _weighted(state.moved(-way), adjoint)) / (2 * step)


def _weighted(state: State, adjoint: FloatArray) -> FloatArray:
    """Return (size + 1,) ``μᵀ [J, ∂r/∂z]`` at a state, z the first extra unknown."""
    return np.append(transposed_times(state.at.jac, adjoint), adjoint @ state.columns[:, 0])


@dataclass(frozen=True)
class PhaseQuadrature:
    """Condition of phase quadrature: the coordinate lags the force by 90°, in the harmonic of the largest force.

    Parameters
    ----------
    driven
        Coordinate and harmonics of the response.
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
        """Return the (size + m,) derivative of the value."""
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
    """The periodic problem with the frequency of an amplitude peak as an additional unknown.

    It is an equation in a design parameter. Unknowns are those of the balance and ``ln(ω / omega_scale)``.

    Parameters
    ----------
    family
        Function from the design parameter to the harmonic balance.
    by
        Condition of a peak.
    driven
        Coordinate and harmonics of the amplitude.
    phase
        Phase that the coordinate lags by 90°, rad, in the first harmonic of `driven`, for conditions on the phase. By
        phase quadrature it is the phase of the force; by variable phase, the phase of the coordinate at the last known
        maximum plus 90°, see `of_the_top`.
    omega_scale
        Frequency at which the last unknown is zero, rad/s.
    invert
        Function from a Jacobian of the balance to a solver; it limits the accuracy of the peak.
    sharpness
        Typical ``|da / d ln ω| / |a|``, the scale of changes of ``ln ω``.
    row
        Last row of the equations of the tangent; see `aligned`.
    """

    family: BalanceAt
    by: Peak
    driven: Driven
    phase: float
    omega_scale: float
    invert: Invert
    sharpness: float = 1.0
    row: FloatArray | None = None

    @cached_property
    def bordered(self) -> PeriodicProblem:
        """The periodic problem with the condition of a peak."""
        condition: Condition = HorizontalTangent(self.driven)
        if self.by != "horizontal_tangent":
            condition = PhaseQuadrature(self.driven, self.phase)
        settings = unknown_frequency(self.family, self.omega_scale)
        return PeriodicProblem(settings, (condition,), self.invert, self.row)

    def sharpened(self, state: State) -> "PeakProblem":
        """Return the problem with the sharpness of a `state` near the peak."""
        if state.along is None:
            return self
        places = self.driven.places(state.setting.balance)
        sharp = np.linalg.norm(state.along[places]) / np.linalg.norm(state.x[places])
        return replace(self, sharpness=max(float(sharp), 1.0))

    def aligned(self, state: State) -> "PeakProblem":
        """Return the problem with a row along the response at a `state` near the peak, so that it is regular at folds.

        Lengths are relative to the size of the motion, and to the width of the peak in ``ln ω``, so that the meaning of
        the tolerance depends neither on units nor on damping.
        """
        if state.along is None:
            return self
        measure = np.full(state.along.size, 1.0 / float(state.x @ state.x))
        measure[-1] = self.sharpness**2
        row = measure * state.along
        return replace(self, row=row / np.sqrt(row @ state.along))

    def of_the_top(self, state: State) -> "PeakProblem":
        """Return the problem with variable phase, from the phase of the coordinate at the maximum near a `state`.

        If `top` finds no maximum, the phase is taken at the state itself.
        """
        if state.along is None:
            return self
        away, _ = self.top(state)
        if not abs(away) * self.sharpness < 1.0:
            away = 0.0
        places = self.driven.places(state.setting.balance)[:2]
        (c, s), (by_c, by_s) = state.x[places], state.along[places]
        turn = (s * by_c - c * by_s) / (c**2 + s**2)  # derivative of the angle of c - i s
        return replace(self, phase=float(np.arctan2(-s, c) + turn * away + 0.5 * np.pi))

    def omega(self, y: FloatArray) -> float:
        """Return the frequency of the unknowns `y`, rad/s."""
        return self.omega_scale * float(np.exp(y[-1]))

    def linearise(self, y: FloatArray, p: float) -> ParameterLinearisation | Evaluated:
        """Evaluate the bordered problem at the unknowns `y` (size + 1,) and the design parameter `p`."""
        return self.bordered.linearise(y, p)

    def state(self, y: FloatArray, p: float) -> State:
        """Return the problem at the unknowns `y` and the design parameter `p`, its tangent by ``ln ω``."""
        return replace(self.bordered, row=None).state(y, p)

    def rate(self, state: State) -> float:
        """Return ``d ln|a| / d ln ω`` along the response at a `state` of this problem; infinite at a fold."""
        if state.along is None:
            return np.inf
        return float(self.driven.gradient(state.setting.balance, state.x) @ state.along[:-1])

    def curvature(self, state: State) -> float:
        """Return ``d² ln|a| / d(ln ω)²`` along the response: negative at a maximum; NaN at a fold."""
        if state.along is None:
            return np.nan
        places = self.driven.places(state.setting.balance)
        own, change = state.x[places], state.along[places]
        square = float(own @ own)
        by_own = change / square - 2.0 * float(own @ change) * own / square**2
        return float(_gradient(self.driven, state, state.along, by_own, own / square) @ state.along)

    def top(self, state: State) -> tuple[float, float]:
        """Return the distance in ln ω from a `state` to the nearest maximum, and its relative excess in amplitude.

        Both are NaN without a maximum. ``1/|a|²`` is approximated by a parabola, which is exact for a linear mode.
        """
        slope, curvature = self.rate(state), self.curvature(state)
        bends = 2.0 * slope**2 - curvature
        if not (np.isfinite(bends) and bends > slope**2):
            return np.nan, np.nan
        return slope / bends, 1.0 / np.sqrt(1.0 - slope**2 / bends) - 1.0

    def amplitude_slope(self, state: State) -> float:
        """Return ``d ln|a| / dp`` along the curve of peaks; NaN if the problem is singular.

        By horizontal tangent, a shift of the frequency does not change the amplitude (envelope theorem), so this is the
        slope at fixed frequency.
        """
        by_p = by_parameter(self.family, state.x, state.setting.omega, state.p)
        lagging = self.by != "horizontal_tangent"
        inverse = self.invert(self.linearise(state.y, state.p).jac) if lagging else state.inverse
        change = None if inverse is None else inverse(-np.append(by_p, 0.0))
        if change is None:
            return np.nan
        own = self.driven.gradient(state.setting.balance, state.x)
        return float(own @ change[: own.size])

    def motion(self, y: FloatArray, p: float) -> ComplexArray:
        """Return the (k,) complex displacements in the driven harmonics at the unknowns `y`, m."""
        return self.driven.motion(self.family(p), y[:-1])


def _is_sampled(balance: HarmonicBalance) -> bool:
    """Whether a law with memory or contact states is evaluated on samples.

    The Jacobian then jumps when an event passes a sample.
    """
    contacts = balance.compiled
    on_grid = contacts.piecewise.size > 0 and contacts.evaluator != "events"
    return on_grid or any(laws.start.shape[1] > 0 for laws in contacts.marched)
