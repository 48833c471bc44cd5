"""Transient passage through a resonance: slowly varying amplitude of a nonlinear mode under a swept frequency.

The complex modal amplitude ``A = a exp(iθ)`` is relative to a force of phase φ with ``dφ/dt = Ω(t)``. The modal
stiffness of `sdof_oscillator` is a product ``(iΩ - λ) (iΩ + d + λ)`` with the dashpots d and an eigenvalue λ, near
``-ζω + iω``, that depends on the amplitude. The equation of motion is nearly the same product with ``d/dt + iΩ`` in
place of ``iΩ``. The motion of its second factor oscillates at about 2Ω in this frame and follows the force without
delay. The slow equation is

    (iΩ + d + λ) dA/dt + A dλ/dt = f - (iΩ - λ) (iΩ + d + λ) A ,

where λ depends on the amplitude only. Its steady motions agree with the synthesis, and its free motions have the right
decay and frequency.
"""

from dataclasses import dataclass

import numpy as np
import scipy.integrate

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import input_error
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.nonlinear_modes.sdof_oscillator import ModalOscillator
from stickslip.response.nonlinear_modes.synthesis import checked_level, motions_at

CELLS = 4096  # cells of the oscillator's table over ln a
PER_BEAT = 24  # approximate number of stored moments in a beat between force and mode
MIN_MOMENTS, MAX_MOMENTS = 400, 20_000  # stored moments
JUDGED_PEAK_SHARE = 0.5  # share of the peak above which a passage is judged


@dataclass(frozen=True, kw_only=True)
class Swept:
    """Frequency sweep of the force.

    Parameters
    ----------
    ends
        First and last frequency, rad/s; the last may be the lower one.
    rate
        Sweep rate, above zero, rad/s².
    tolerance
        Relative error of a step.
    """

    ends: tuple[float, float]
    rate: float
    tolerance: float = 1e-6

    def __post_init__(self) -> None:
        positive = min(self.rate, self.tolerance, *self.ends) > 0.0
        if not (positive and self.ends[0] != self.ends[1] and np.all(np.isfinite(self.ends))):
            raise input_error(
                "Swept",
                f"has rate {self.rate:g}, tolerance {self.tolerance:g}, frequencies {self.ends}",
                "All are above zero, and the ends differ; the direction is that from the first to the last.",
            )

    @property
    def seconds(self) -> float:
        """Duration of the passage, s."""
        return abs(self.ends[1] - self.ends[0]) / self.rate

    @property
    def signed_rate(self) -> float:
        """Sweep rate, rad/s²; negative for falling frequencies."""
        return float(np.copysign(self.rate, self.ends[1] - self.ends[0]))


@dataclass(frozen=True, eq=False)
class Passage:
    """Passage through a resonance, all arrays (p,).

    Parameters
    ----------
    time
        Time, s.
    omega
        Frequency of the force, rad/s.
    place
        Positions on the backbone.
    amplitude
        Modal amplitude, kg^0.5 m.
    phase
        Phase of the motion relative to the force, with the backbone's phase as zero, rad.
    finished
        Whether the last frequency was reached; otherwise the motion grew beyond the backbone.
    change
        Largest relative change of the complex amplitude per radian of the vibration, above half the peak. The method
        assumes a small value.
    """

    time: FloatArray
    omega: FloatArray
    place: FloatArray
    amplitude: FloatArray
    phase: FloatArray
    finished: bool
    change: float

    @property
    def peak(self) -> tuple[float, float]:
        """Largest modal amplitude and the frequency of the force at that moment."""
        top = int(np.argmax(self.amplitude))
        return float(self.amplitude[top]), float(self.omega[top])


@by_one_thread
def passage_through_resonance(oscillator: ModalOscillator, level: float, sweep: Swept) -> Passage:
    """Compute the amplitude of a nonlinear mode while the frequency of its force is swept at a constant rate.

    Parameters
    ----------
    oscillator
        Backbone and load.
    level
        Factor on the harmonic load.
    sweep
        Range and rate. The passage begins with the steady motion at the first frequency, the smallest if there are
        several.

    Raises
    ------
    InputError
        If the amplitude turns back along the backbone, or there is no steady motion at the first frequency.
    """
    table = _Table.of(oscillator)
    starts = motions_at(oscillator, checked_level(level), sweep.ends[0])
    if not starts.size:
        raise input_error(
            "modal_synthesis: passage",
            f"no amplitude of the backbone is one of a steady motion at {sweep.ends[0] / (2 * np.pi):.6g} Hz",
            "Begin farther away from the resonance, or follow the backbone to larger amplitudes.",
        )
    begin = oscillator.at(starts[:1])
    omega = np.array([sweep.ends[0]])
    start = level * begin.force[0] / begin.stiffness(omega)[0]
    rate, first = sweep.signed_rate, sweep.ends[0]

    def slope(time: float, y: FloatArray) -> tuple[float, float]:
        found = table.slope(first + rate * time, complex(y[0], y[1]), level)
        return found.real, found.imag

    def beyond(_time: float, y: FloatArray) -> float:
        return table.largest - float(np.hypot(y[0], y[1]))

    beyond.terminal = True  # type: ignore[attr-defined]  # as solve_ivp asks
    solved = scipy.integrate.solve_ivp(
        slope,
        (0.0, sweep.seconds),
        [start.real, start.imag],
        method="DOP853",
        dense_output=True,
        events=beyond,
        rtol=sweep.tolerance,
        atol=sweep.tolerance * abs(start),
    )
    last = float(solved.t[-1])
    beats = abs(sweep.ends[1] - sweep.ends[0]) * sweep.seconds / (4 * np.pi)
    time = np.linspace(0.0, last, int(np.clip(PER_BEAT * beats, MIN_MOMENTS, MAX_MOMENTS)))
    y = solved.sol(time)
    amplitude, along = y[0] + 1j * y[1], first + rate * time
    size = np.abs(amplitude)
    near = size > JUDGED_PEAK_SHARE * size.max()
    moves = [abs(table.slope(w, a, level)) / (w * abs(a)) for w, a in zip(along[near], amplitude[near], strict=True)]
    place = np.clip(np.log(size) - table.first, *oscillator.ends)
    return Passage(time, along, place, size, np.angle(amplitude), solved.status == 0, float(max(moves)))


@dataclass(frozen=True, eq=False)
class _Table:
    """Oscillator on an even grid of ln a, for fast evaluation at single amplitudes."""

    first: float
    width: float
    rows: ComplexArray  # (CELLS + 1, 4): eigenvalue, dashpots, force, change of the eigenvalue with ln a
    largest: float

    @classmethod
    def of(cls, oscillator: ModalOscillator) -> "_Table":
        first, last = oscillator.ends
        points = oscillator.at(oscillator.place)
        if np.any(np.diff(points.amplitude) <= 0.0):
            raise input_error(
                "modal_synthesis: passage",
                "the backbone turns back in its amplitude, where another mode takes part in the motion",
                "Ask for a run-up, or keep the backbone below that amplitude.",
            )
        o = oscillator.at(np.linspace(first, last, CELLS + 1))
        width = (last - first) / CELLS
        by_size = np.gradient(o.eigenvalue, width)
        rows = np.stack([o.eigenvalue, o.viscous, o.force, by_size], axis=-1)
        begin, end = np.log(points.amplitude[[0, -1]])
        return cls(float(begin), float(end - begin) / CELLS, rows, float(points.amplitude[-1]))

    def slope(self, driven: float, amplitude: complex, level: float) -> complex:
        """Return dA/dt at a frequency of the force, rad/s."""
        at = (np.log(max(abs(amplitude), 1e-300)) - self.first) / self.width
        cell = min(max(int(at), 0), CELLS - 1)
        share = min(max(at - cell, 0.0), 1.0)
        row = (1.0 - share) * self.rows[cell] + share * self.rows[cell + 1]
        eigenvalue, viscous, force, by_size = row.tolist()
        fast = 1j * driven + viscous + eigenvalue
        # (fast + by_size) g + i fast h = pull, with dA/dt = (g + ih) A: λ changes with the amplitude
        pull = (eigenvalue - 1j * driven) * fast + level * force / amplitude
        across = (1j * fast).conjugate()
        grows = (pull * across).imag / ((fast + by_size) * across).imag
        turns = ((pull - (fast + by_size) * grows) / (1j * fast)).real
        return amplitude * complex(grows, turns)
