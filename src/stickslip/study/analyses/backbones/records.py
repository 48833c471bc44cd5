"""What is found of one nonlinear mode, as it is kept in the journal of a job."""

from dataclasses import dataclass

from stickslip.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class ModeBranch:
    """A nonlinear mode of a wave.

    Parameters
    ----------
    wave_number
        -1 for a single structure.
    mode
        From 1, by frequency with contacts stuck.
    omega, ratio
        Of the linear mode: rad/s and damping ratio.
    amplitude, motion_omega, motion_ratio
        (points,) m, rad/s, damping ratio; NaN where none was found.
    modal_amplitude, energy
        (points,) kg^0.5 m and J.
    order, status
        (points,) highest harmonic, and how the solver ended.
    slipping, open_for, change
        (points,) share of contact points that slip or open (of several sliders the share that slips), largest share of the period for which one is open, and relative change that
        more harmonics are foretold to make.
    tolerance
        Relative change of frequency or damping ratio that was asked for.
    end
        How the curve ended.
    problem
        Why there is none; empty where there is one.
    """

    wave_number: int
    mode: int
    omega: float
    ratio: float
    amplitude: FloatArray
    motion_omega: FloatArray
    motion_ratio: FloatArray
    modal_amplitude: FloatArray
    energy: FloatArray
    order: IntArray
    status: IntArray
    slipping: FloatArray
    open_for: FloatArray
    change: FloatArray
    tolerance: float
    end: str
    problem: str = ""
