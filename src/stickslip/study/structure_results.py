"""What the commands for bladed disks find, before it is written: plain arrays, wave by wave."""

from dataclasses import dataclass

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.model.facts import Facts as Facts


@dataclass(frozen=True, eq=False)
class Skin:
    """The skin of the model, for pictures.

    Parameters
    ----------
    points
        (n, 3) positions in metres.
    triangles
        (k, 3) points of each triangle.
    cut
        (k,) 1 where the triangle lies on a cyclic face, which is inside the wheel.
    """

    points: FloatArray
    triangles: IntArray
    cut: IntArray


@dataclass(frozen=True, eq=False)
class WaveModes:
    """Modes of one travelling wave.

    Parameters
    ----------
    wave_number
        Of the wave.
    frequencies_hz
        (m,) ascending.
    shapes
        (m, n, 3) complex displacements of the skin's points, the largest of length 1; n = 0 if not asked for.
    growth
        (m,) derivatives of ω² by Ω² at the speed; zeros for a model that no speed changes.
    seconds
        Time of the computation.
    """

    wave_number: int
    frequencies_hz: FloatArray
    shapes: ComplexArray
    growth: FloatArray
    seconds: float


@dataclass(frozen=True, eq=False)
class WaveBranches:
    """Frequencies of one travelling wave against speed, and where engine orders cross them.

    Parameters
    ----------
    wave_number
        Of the wave.
    frequencies_hz
        (s, m) at the speeds, followed by mode shape.
    engine_orders, modes
        (c,) of each crossing; modes count from 0.
    speeds, crossings_hz
        (c,) in rad/s and Hz.
    error
        Largest relative error of the frequencies that the small basis was found to have.
    seconds
        Time of the computation.
    """

    wave_number: int
    frequencies_hz: FloatArray
    engine_orders: IntArray
    modes: IntArray
    speeds: FloatArray
    crossings_hz: FloatArray
    error: float
    seconds: float
