"""A motion with two frequencies and its envelope."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.two_frequency_path import Indices
from stickslip.solve.status import Status


@dataclass(frozen=True, eq=False)
class TorusMotion:
    """A motion with two frequencies.

    Attributes
    ----------
    indices
        (j, k) of the combined frequencies ``jω1 + kω2``.
    omegas
        ω1 and ω2, rad/s.
    coefficients
        (len(indices), n) complex displacement of all dofs, m.
    x
        Unknowns of the balance.
    status
        How the solver ended.
    iterations
        Newton steps.
    residual
        Largest entry of the scaled residual.
    slip
        By how much the second phase in the contacts is off after a turn of the first, rad.
    unsettled
        Contacts whose state did not repeat on a characteristic.
    left_out
        By how much a Newton step with those left out changes the motion, root mean square over that of the motion, of the coordinate that it changes most; NaN where nobody asked.
    """

    indices: Indices
    omegas: tuple[float, float]
    coefficients: ComplexArray
    x: FloatArray
    status: Status
    iterations: int
    residual: float
    slip: float
    unsettled: int = 0
    left_out: float = float("nan")

    @property
    def converged(self) -> bool:
        """Whether it is a solution."""
        return self.status.converged and bool(np.all(np.isfinite(self.coefficients)))

    @property
    def order(self) -> int:
        """Largest sum of harmonics."""
        return max(abs(j) + abs(k) for j, k in self.indices)

    def values(self, dofs: IntArray, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return the (..., len(dofs)) displacements of dofs at phases (rad), m."""
        angles = np.multiply.outer(np.asarray(first), [j for j, _ in self.indices])
        angles = angles + np.multiply.outer(np.asarray(second), [k for _, k in self.indices])
        return np.asarray((np.exp(1j * angles) @ self.coefficients[:, dofs]).real)

    def at_times(self, dofs: IntArray, times: FloatArray, phase: float = 0.0) -> FloatArray:
        """Return the (times, len(dofs)) displacements at times (s), m; `phase` is that of the second frequency at t = 0."""
        return self.values(dofs, self.omegas[0] * times, self.omegas[1] * times + phase)


@dataclass(frozen=True, eq=False)
class Envelope:
    """How the amplitude of a motion with two frequencies goes up and down.

    Attributes
    ----------
    phase
        (n,) of the second frequency where a turn of the first begins, rad.
    amplitude
        (n, outputs) half of peak to peak over that turn, m.
    rms
        (outputs,) root mean square about the mean, m.
    """

    phase: FloatArray
    amplitude: FloatArray
    rms: FloatArray

    @property
    def largest(self) -> FloatArray:
        """(outputs,) largest amplitude, m."""
        return np.asarray(self.amplitude.max(axis=0))

    @property
    def least(self) -> FloatArray:
        """(outputs,) least amplitude, m."""
        return np.asarray(self.amplitude.min(axis=0))


def envelope(motion: TorusMotion, dofs: IntArray, phases: int = 96) -> Envelope:
    """Return half of peak to peak over one period of the first frequency, for every phase of the second where it may begin."""
    ratio = motion.omegas[1] / motion.omegas[0]
    a_turn = max(256, int(32 * motion.order * max(1.0, ratio)))
    along = 2.0 * np.pi * np.arange(a_turn + 1) / a_turn
    begins = 2.0 * np.pi * np.arange(phases) / phases
    amplitude = np.array([0.5 * np.ptp(motion.values(dofs, along, begin + ratio * along), axis=0) for begin in begins])
    size = np.sum(np.abs(motion.coefficients[1:, dofs]) ** 2, axis=0)
    return Envelope(begins, amplitude, np.sqrt(0.5 * size))
