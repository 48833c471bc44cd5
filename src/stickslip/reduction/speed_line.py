"""A structure along an engine-order line: matrices and static load follow the speed.

Matrices at a few speeds, on the same coordinates, are interpolated by polynomials in the square of the speed, times the speed for
Coriolis forces. For solids this is exact: their matrices are such polynomials of second degree, their load of third. With modal
coordinates of a reduction the interpolation converges faster, the more smoothly the modes change with the speed.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.tuned import TunedWheel

AtRest = Structure | TunedWheel
REMEMBERED = 8  # number of speeds whose matrices are cached


def speed_nodes(lowest: float, highest: float, intervals: int) -> FloatArray:
    """Return ascending speeds whose squares are Chebyshev points, including the ends.

    Every second one of them belongs to half as many intervals.
    """
    angles = np.pi * np.arange(intervals + 1) / intervals
    middle, half = (highest**2 + lowest**2) / 2, (highest**2 - lowest**2) / 2
    nodes = np.sqrt(middle - half * np.cos(angles))
    nodes[[0, -1]] = lowest, highest
    return np.asarray(nodes)


@dataclass(frozen=True, eq=False)
class SpeedLine:
    """A structure or wheel along the engine-order line ``ω = m Ω``: a linear side whose matrices follow the frequency.

    Parameters
    ----------
    engine_order
        Engine order m, at least 1.
    speeds
        (k,) speeds from `speed_nodes`, rad/s.
    sides
        Structure or tuned wheel at each speed, all on the same coordinates.
    loads
        Harmonic -> (k, n) load at each speed, N; harmonic 0 is the static load.

    Raises
    ------
    InputError
        If numbers of speeds or coordinates differ, or a wheel has aerodynamic forces.
    """

    engine_order: int
    speeds: FloatArray
    sides: tuple[AtRest, ...]
    loads: dict[int, ComplexArray]
    known: dict[float, AtRest] = field(default_factory=dict, repr=False)
    stacks: dict[int, tuple[Any, ...]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        sizes = {side.n for side in self.sides}
        fits = len(self.sides) == len(self.speeds) and len(sizes) == 1
        if not fits or any(len(load) != len(self.speeds) for load in self.loads.values()):
            raise input_error(
                "SpeedLine",
                f"has {len(self.speeds)} speeds, {len(self.sides)} sides of {sorted(sizes)} coordinates",
                "Give a side and a load a speed, all on the same coordinates.",
            )
        if any(side.feedback for side in self.sides if isinstance(side, TunedWheel)):
            raise input_error(
                "SpeedLine",
                "holds a wheel with aerodynamic forces, which are not followed over speed",
                "Compute forced responses at single speeds.",
            )

    def __getstate__(self) -> dict[str, object]:
        """Drop cached values, which can be computed again."""
        return self.__dict__ | {"known": {}, "stacks": {}}

    def __setstate__(self, state: dict[str, object]) -> None:
        """Restore the fields."""
        self.__dict__.update(state)

    @property
    def top(self) -> AtRest:
        """Structure or wheel at the highest speed, used where matrices are needed without a frequency."""
        return self.sides[-1]

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.top.n

    @property
    def dofs(self) -> Dofs:
        """Table of the coordinates."""
        return self.top.dofs

    @property
    def multipliers(self) -> IntArray:
        """Indices of the coordinates that are constraint forces."""
        return self.top.multipliers

    @property
    def harmonics(self) -> int | None:
        """Highest harmonic for which there are matrices; None: any."""
        return self.top.harmonics

    @property
    def wheel(self) -> None:
        """None, even if the sides are tuned wheels (see `LinearSide`)."""
        return None

    @property
    def speed_follows_frequency(self) -> bool:
        """Whether the speed changes with the frequency (see `LinearSide`)."""
        return True

    @property
    def reduced(self) -> bool:
        """Whether coordinates without contact are condensed (see `LinearSide`)."""
        return True

    def at_frequency(self, omega: float) -> AtRest:
        """Return the structure or wheel at the speed that belongs to a frequency in rad/s."""
        return self.at(self.speed(omega))

    def of_harmonic(self, harmonic: int) -> Structure:
        """Return the structure of a harmonic at the highest speed."""
        return self.top.of_harmonic(harmonic)

    def feedback_of(self, _harmonic: int) -> None:
        """Return None: there is no aerodynamic force."""

    def grounded(self, springs: Matrix) -> "SpeedLine":
        """Return the line with springs, a sparse matrix (n, n) in N/m, from its coordinates to the ground."""
        sides = tuple(side.grounded(springs) for side in self.sides)
        return replace(self, sides=sides, known={}, stacks={})

    def speed(self, omega: float) -> float:
        """Return the speed at which the engine order excites a frequency, both in rad/s."""
        return omega / self.engine_order

    def at(self, speed: float) -> AtRest:
        """Return the structure or wheel at a speed in rad/s."""
        found = self.known.get(speed)
        if found is None:
            while len(self.known) >= REMEMBERED:
                del self.known[next(iter(self.known))]
            found = self.known[speed] = self._between(self.weights(speed), speed / self.speeds)
        return found

    def load(self, harmonic: int, speed: float) -> ComplexArray:
        """Return the (n,) load of a harmonic at a speed in rad/s, N."""
        return np.asarray(self.weights(speed) @ self.loads[harmonic])

    def weights(self, speed: float) -> FloatArray:
        """Return the (k,) values at a speed in rad/s of the Lagrange polynomials through `speeds`."""
        distance = speed**2 - self.speeds**2
        if np.any(distance == 0.0):
            return np.asarray(distance == 0.0, dtype=float)
        sign = np.where(np.arange(len(distance)) % 2, -1.0, 1.0)
        sign[[0, -1]] /= 2
        share = sign / distance
        return np.asarray(share / share.sum())

    def _between(self, weights: FloatArray, ratio: FloatArray) -> AtRest:
        if np.any(weights == 1.0):
            return self.sides[int(np.flatnonzero(weights == 1.0)[0])]
        top = self.top
        if isinstance(top, Structure):
            return self._mixed(0, [s for s in self.sides if isinstance(s, Structure)], weights, ratio)
        wheels = [side for side in self.sides if isinstance(side, TunedWheel)]
        waves = {k: self._mixed(k, [w.waves[k] for w in wheels], weights, ratio) for k in top.waves}
        return replace(top, waves=waves)

    def _mixed(self, k: int, structures: list[Structure], weights: FloatArray, ratio: FloatArray) -> Structure:
        """Return the weighted sum of matrices; the skew part of the damping is scaled by the `ratio` of the speeds."""
        if k not in self.stacks:
            self.stacks[k] = _stacked(structures)
        mass, even, skew, stiffness, loss = self.stacks[k]
        first = structures[-1]
        return Structure(
            _summed(mass, weights),
            _summed(even, weights) + _summed(skew, weights * ratio),
            _summed(stiffness, weights),
            first.dofs,
            first.sets,
            None,
            None if loss is None else _summed(loss, weights),
        )


def _stacked(structures: list[Structure]) -> tuple[Any, ...]:
    """Return mass, even and skew damping, stiffness and loss at all speeds, as one array each if dense."""
    damping = [s.damping for s in structures]
    skew = [(d - d.conj().T) / 2 for d in damping]
    even = [d - g for d, g in zip(damping, skew, strict=True)]
    loss = [s.loss for s in structures if s.loss is not None]
    every = [s.mass for s in structures], even, skew, [s.stiffness for s in structures], loss
    return tuple(_stack(one) if one else None for one in every)


def _stack(matrices: list[Matrix]) -> Any:
    return matrices if scipy.sparse.issparse(matrices[0]) else np.array(matrices)


def _summed(matrices: Any, weights: FloatArray) -> Matrix:
    if isinstance(matrices, np.ndarray):
        return np.asarray(np.tensordot(weights, matrices, 1))
    total = sum(w * m for w, m in zip(weights, matrices, strict=True))
    return scipy.sparse.csr_array(total)
