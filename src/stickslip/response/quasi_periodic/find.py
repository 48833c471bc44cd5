"""Finds a second tone beside a forced motion: near modes that grow, and at the angles of multipliers."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.errors import StickslipError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.problem import forced_problem
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.quasi_periodic.motion import TorusMotion
from stickslip.response.quasi_periodic.problem import TwoTones
from stickslip.response.quasi_periodic.start import distinct, tones_of_multipliers
from stickslip.response.quasi_periodic.tone import (
    beginnings,
    forced_motion,
    over_amplitude,
    second_tone,
)
from stickslip.response.stability import stability

ORDER = 7  # harmonics of the motion whose multipliers are looked at
HIGHEST = 3  # harmonic beside which a frequency is looked for
TRIED = 3  # frequencies
NARROW = 1e-6  # half width of the range about a frequency that is solved alone


@dataclass(frozen=True, eq=False)
class Found:
    """What was found beside a forced motion.

    Attributes
    ----------
    motion
        With a second tone; None where there is none.
    forced
        The motion without it.
    ratio
        Damping ratio of the second tone at small amplitudes, of the last that was looked at; NaN where none was.
    near
        The frequency near which that was, rad/s; NaN where none was.
    """

    motion: TorusMotion | None
    forced: TorusMotion
    ratio: float
    near: float


def tone_beside(problem: TwoTones, omega: float, guesses: Sequence[float]) -> Found:
    """Return the motion whose second tone grows out of the forced motion at a frequency.

    Parameters
    ----------
    problem
        Nothing acts with the second frequency.
    omega
        ω1, rad/s.
    guesses
        Frequencies near which the tone is looked for, rad/s.
    """
    forced = forced_motion(problem, omega)
    ratio = near = float("nan")
    if not forced.converged:
        return Found(None, forced, ratio, near)
    for begin in beginnings(problem, forced, distinct(guesses, omega))[:TRIED]:
        first = next(over_amplitude(begin))
        if not first.converged:
            continue
        ratio, near = first.ratio, first.omega
        if ratio >= 0.0:
            continue
        motion = second_tone(begin)
        if motion is not None:
            return Found(motion, forced, ratio, near)
    return Found(None, forced, ratio, near)


def growing_tones(problem: TwoTones, load: HarmonicLoad, omega: float) -> list[float]:
    """Return the frequencies (rad/s) that the multipliers of the forced motion of a single structure say; none where these are not known."""
    sweep = Sweep(
        omega_range=((1.0 - NARROW) * omega, (1.0 + NARROW) * omega), at=(omega,), low=ORDER, high=ORDER,
        selection="always_low", peak_points=0,
    )  # fmt: skip
    try:
        forced = forced_problem(problem.system, load, sweep)
        points = accepted_points(list(forced_response(problem.system, load, sweep)))
        known = [p for p in points if p.converged]
        if not known:
            return []
        multipliers = stability(forced, known[0]).floquet.multipliers
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError):
        return []
    return tones_of_multipliers(multipliers[np.isfinite(multipliers)], omega, HIGHEST)
