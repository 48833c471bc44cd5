"""Model of a measured hysteresis loop: elastic Coulomb friction under a constant normal load.

Besides stiffness and limit, each recording has its own unknowns: the spring force at the first sample, the offset of
the force sensor, and its drift. The friction force is a piecewise linear function of all of them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.prescribed_gap import forces_along

RIGID_STIFFNESS = 1e6  # times the force range over the displacement range: a spring that slips almost at once
Loop = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class LoopModel:
    """Measured recordings and their unknown offsets and drifts.

    Parameters
    ----------
    loops
        Displacements (n,) in m and forces (n,) in N of each recording.
    offset, drift
        Whether each recording's force has an unknown offset, and a drift that is linear in time.
    """

    loops: tuple[Loop, ...]
    offset: bool
    drift: bool

    @cached_property
    def measured(self) -> FloatArray:
        """(samples,) forces of all recordings."""
        return np.concatenate([force for _, force in self.loops])

    @cached_property
    def swing(self) -> float:
        """Half of the largest range of the force of a recording, N."""
        return max(float(np.ptp(force)) for _, force in self.loops) / 2

    @cached_property
    def stroke(self) -> float:
        """Half of the largest range of the displacement, m."""
        return max(float(np.ptp(x)) for x, _ in self.loops) / 2

    @property
    def stuck(self) -> float:
        """Stiffness of a straight line between the ends of the loop, N/m: the scale of stiffnesses."""
        return self.swing / self.stroke

    @cached_property
    def sensor(self) -> FloatArray:
        """(samples, k) contributions of offsets and drifts to the forces, each of size one."""
        columns = []
        for j, (x, _) in enumerate(self.loops):
            rising = np.linspace(-1.0, 1.0, x.size)
            shapes = [np.ones(x.size)] * self.offset + [rising] * self.drift
            columns += [self._only(j, shape) for shape in shapes]
        return np.stack(columns, axis=1) if columns else np.zeros((self.measured.size, 0))

    @cached_property
    def first(self) -> IntArray:
        """Positions of the first sample of each recording."""
        return np.cumsum([0, *(x.size for x, _ in self.loops[:-1])])

    @cached_property
    def signs(self) -> FloatArray:
        """(samples,) forces of a rigid contact with limit one: 1 if the last motion was forward, -1 if backward."""
        ahead = [np.argmax(np.diff(x) != 0.0) for x, _ in self.loops]  # the first sample that moves
        held = [np.sign(np.diff(x)[i]) for (x, _), i in zip(self.loops, ahead, strict=True)]
        return np.sign(self.friction(RIGID_STIFFNESS * self.stuck, 1.0, held)[0])

    def friction(
        self, stiffness: float, limit: float, held: Sequence[float] | FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the friction forces (samples,) and 1 where a sample slips forward, -1 backward, 0 where it sticks.

        Parameters
        ----------
        stiffness, limit
            Tangential stiffness, N/m, and friction limit, N.
        held
            Force of the spring at the first sample of each recording, N.
        """
        law = ElasticCoulomb(k_t=stiffness, k_w=0.0, k_n=0.0, mu=limit, preload=1.0)
        forces, slips = [], []
        for (x, _), at_first in zip(self.loops, held, strict=True):
            gap = np.zeros((x.size, 3))
            gap[:, 0] = x
            force, state = forces_along(law, gap, np.array([x[0] - at_first / stiffness, 0.0]))
            forces.append(force[:, 0])
            slips.append(np.sign(force[:, 0]) * state[:, 0])
        return np.concatenate(forces), np.concatenate(slips)

    def both_ways(self, slips: FloatArray) -> bool:
        """Whether a recording slips both forward and backward, given the signs (samples,) of slip."""
        return any({-1.0, 1.0} <= set(part.tolist()) for part in np.split(slips, self.first[1:]))

    def line(self) -> "Line":
        """Fit a contact that never slips; the first value is the stiffness."""
        moved = np.concatenate([x - x.mean() for x, _ in self.loops])
        intercepts = [self._only(j, np.ones(x.size)) for j, (x, _) in enumerate(self.loops)]
        drifts = (
            [self.sensor[:, 1 + 2 * j] if self.offset else self.sensor[:, j] for j in range(len(self.loops))]
            if self.drift
            else []
        )
        return _line(np.stack([moved / self.stroke, *intercepts, *drifts], axis=1), self.measured, self.stroke)

    def direction(self) -> "Line":
        """Fit a contact that always slips; the first value is the limit.

        First samples are left out, because their direction of slip is unknown.
        """
        columns = np.column_stack([self.signs, self.sensor])
        known = np.delete(np.arange(self.signs.size), self.first)
        fit = _line(columns[known], self.measured[known])
        return replace(fit, fitted=columns @ fit.values)

    def _only(self, recording: int, shape: FloatArray) -> FloatArray:
        """Return a shape along one recording, zero along the others."""
        whole = np.zeros(self.measured.size)
        at = sum(x.size for x, _ in self.loops[:recording])
        whole[at : at + shape.size] = shape
        return whole


@dataclass(frozen=True, eq=False)
class Line:
    """A linear fit.

    Its fields are the values, the standard deviation of the first value, whether the loops determine this value, the
    sum of squares, and the fitted forces.
    """

    values: FloatArray
    deviation: float
    whole: bool
    squares: float
    fitted: FloatArray


def _line(columns: FloatArray, measured: FloatArray, unit: float = 1.0) -> Line:
    """Fit by least squares; the first column is divided by `unit`."""
    inverse = np.linalg.pinv(columns, rcond=1e-10)
    values = inverse @ measured
    fitted = columns @ values
    squares = float(np.sum((measured - fitted) ** 2))
    rank = int(np.linalg.matrix_rank(columns, tol=1e-8))
    variance = squares / max(measured.size - rank, 1) * float(inverse[0] @ inverse[0])
    values[0] /= unit
    # an exact fit up to rounding does not mean certainty
    deviation = max(math.sqrt(variance) / unit, 1e-12 * abs(float(values[0])), 1e-300)
    return Line(values, deviation, rank == columns.shape[1], squares, fitted)
