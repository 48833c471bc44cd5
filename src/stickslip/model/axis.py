"""The axis of rotation."""

import math
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error


@dataclass(frozen=True)
class Axis:
    """An axis of rotation; angles and speeds are positive by the right-hand rule.

    Parameters
    ----------
    direction
        Vector along the axis, of any length.
    origin
        A point of the axis in metres.

    Raises
    ------
    InputError
        If the direction has no length, or a number is not finite.
    """

    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("direction", "origin"):
            value = getattr(self, name)
            if len(value) != 3 or not all(math.isfinite(v) for v in value):
                raise input_error(f"Axis.{name}", f"needs three numbers, got {value}", "Give x, y, z.")
        if not any(self.direction):
            raise input_error("Axis.direction", "has no length", "The z axis is (0, 0, 1).")

    @property
    def unit(self) -> FloatArray:
        """(3,) unit vector along the axis."""
        vector = np.asarray(self.direction, dtype=float)
        return np.asarray(vector / np.linalg.norm(vector))

    @property
    def cross(self) -> FloatArray:
        """(3, 3) matrix with ``cross @ v = unit x v``."""
        x, y, z = self.unit
        return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])

    def rotation(self, angle: float) -> FloatArray:
        """Return the (3, 3) matrix that turns vectors by `angle` (rad) about the axis (Rodrigues)."""
        cross = self.cross
        return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)

    def turned(self, points: FloatArray, angle: float) -> FloatArray:
        """Return `points` (n, 3) turned by `angle` (rad) about the axis."""
        origin = np.asarray(self.origin)
        return np.asarray((points - origin) @ self.rotation(angle).T + origin)

    def arm(self, points: FloatArray) -> FloatArray:
        """Return the (n, 3) vectors from the axis to `points`, perpendicular to it."""
        offset = points - np.asarray(self.origin)
        return np.asarray(offset - np.outer(offset @ self.unit, self.unit))
