"""Journal records of one mode of one wave."""

from dataclasses import dataclass

from stickslip.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class CycleBranch:
    """A mode of a wave: its damping over the amplitude, and its limit cycles.

    Parameters
    ----------
    wave_number
        -1 for a single structure.
    mode
        From 1, by frequency with contacts stuck.
    omega, ratio
        Of the linear mode: rad/s and damping ratio.
    slips
        Amplitude at which the first contact leaves its state, m; NaN where none does.
    amplitude, motion_omega, motion_ratio
        (points,) of the motions: m, rad/s, damping ratio; amplitude NaN where none was found.
    largest_ratio, largest_at
        Most damping of a motion, and its amplitude, m.
    cycle_amplitude, cycle_omega, slope, order, change, enough
        (cycles,) of the limit cycles: m, rad/s, dζ/d ln a, highest harmonic, relative change by the last raise of the harmonics, and whether
        that is below what was asked for.
    coefficients
        (cycles, order + 1, n, 2) amplitudes of all coordinates, real and imaginary, m; zero above the harmonics of each.
    stable, reason
        JSON lists of texts: ``stable``, ``unstable``, ``undecided`` or ``not examined``, and why.
    multiplier, error, along
        (cycles,) modulus of the multiplier that decides, its error, and the distance of the one along the motion from 1; NaN where unknown.
    grows_as, grows_omega
        (cycles,) wave number and frequency (rad/s) of the disturbance that decides; -1 and NaN where unknown.
    problem
        Why there is no curve; empty where there is one.
    lost
        Zeros of the damping that were not solved as limit cycles.
    """

    wave_number: int
    mode: int
    omega: float
    ratio: float
    slips: float
    amplitude: FloatArray
    motion_omega: FloatArray
    motion_ratio: FloatArray
    largest_ratio: float
    largest_at: float
    cycle_amplitude: FloatArray
    cycle_omega: FloatArray
    slope: FloatArray
    order: IntArray
    change: FloatArray
    enough: IntArray
    coefficients: FloatArray
    stable: str
    reason: str
    multiplier: FloatArray
    error: FloatArray
    along: FloatArray
    grows_as: IntArray
    grows_omega: FloatArray
    problem: str = ""
    lost: int = 0
