"""Search for a second frequency beside a forced motion: unstable modes, and angles of multipliers."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray
from stickslip.errors import StickslipError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.problem import forced_problem
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.quasi_periodic.problem import TorusMotion, TwoTones
from stickslip.response.quasi_periodic.tone import beginnings, forced_motion, over_amplitude, second_tone
from stickslip.response.stability import stability

REAL = 1e-6  # rad: an angle that is smaller, or nearer to π, is none of a second frequency


ORDER = 7  # harmonics of the motion whose multipliers are looked at
HIGHEST = 3  # harmonic beside which a frequency is looked for
TRIED = 3  # frequencies
# of a frequency: from how far a branch is followed to it, and how near its points may be
WIDE, POINT_DISTANCE_RTOL = 0.3, 1e-3
NARROW = 1e-6  # half width of the range about a frequency that is solved alone


@dataclass(frozen=True, eq=False)
class Found:
    """Result of a search for a second tone.

    Attributes
    ----------
    motion
        Motion with a second tone; None without one.
    forced
        Forced motion without a second tone.
    ratio
        Damping ratio of the last examined second tone at small amplitudes, of a growing one if there is any; NaN if none was examined.
    near
        Frequency near that tone, rad/s; NaN if none was examined.
    """

    motion: TorusMotion | None
    forced: TorusMotion
    ratio: float
    near: float


@by_one_thread
def tone_beside(
    problem: TwoTones, omega: float, guesses: Sequence[float], starts: Iterable[ComplexArray] = ()
) -> Found:
    """Return the motion whose second tone grows out of the forced motion at a frequency.

    Parameters
    ----------
    problem
        Problem without a load at the second frequency.
    omega
        Frequency ω1 of the load, rad/s.
    guesses
        Estimates of the frequency of the second tone, rad/s.
    starts
        Further starts (H + 1, n_retained), m, for the forced motion, if it is not found from stuck contacts.
    """
    forced = forced_motion(problem, omega)
    for start in starts if not forced.converged else ():
        forced = forced_motion(problem, omega, start)
        if forced.converged:
            break
    ratio = near = float("nan")
    if not forced.converged:
        return Found(None, forced, ratio, near)
    for begin in beginnings(problem, forced, distinct(guesses, omega))[:TRIED]:
        first = next(over_amplitude(begin))
        if not first.converged:
            continue
        if ratio < 0.0 and first.ratio >= 0.0:
            continue  # one that grows has been seen: that another decays does not undo it
        ratio, near = first.ratio, first.omega
        if ratio >= 0.0:
            continue
        motion = second_tone(begin)
        if motion is not None:
            return Found(motion, forced, ratio, near)
    return Found(None, forced, ratio, near)


def swept(problem: TwoTones, load: HarmonicLoad, omega: float) -> Iterator[ComplexArray]:
    """Yield the forced motions (H + 1, n_retained), m, of a single structure at a frequency, on branches from below and from above."""
    retained = problem.balance.side.first.retained
    ways: tuple[tuple[float, Literal["up", "down"]], ...] = ((1 - WIDE, "up"), (1 + WIDE, "down"))
    for far, direction in ways:
        ends = sorted((far * omega, omega))
        sweep = Sweep(
            omega_range=(ends[0], ends[1]),
            low=ORDER,
            high=ORDER,
            selection="always_low",
            points=10,
            peak_points=0,
            direction=direction,
        )
        try:
            forced = forced_problem(problem.system, load, sweep)
            points = accepted_points(list(forced_response(problem.system, load, sweep)))
        except (StickslipError, FloatingPointError, np.linalg.LinAlgError):
            continue
        for point in points:
            if point.converged and abs(point.omega / omega - 1.0) < POINT_DISTANCE_RTOL:
                yield forced.low.linear.recover(point.omega, point.coefficients)[:, retained]


def growing_tones(problem: TwoTones, load: HarmonicLoad, omega: float) -> tuple[list[float], str]:
    """Return the frequencies, rad/s, of growing disturbances of the forced motion of a single structure, from its multipliers.

    Returns
    -------
    list[float], str
        The frequencies, and why the multipliers do not prove stability; empty where they do.
    """
    sweep = Sweep(
        omega_range=((1.0 - NARROW) * omega, (1.0 + NARROW) * omega),
        at=(omega,),
        low=ORDER,
        high=ORDER,
        selection="always_low",
        peak_points=0,
    )
    try:
        forced = forced_problem(problem.system, load, sweep)
        points = accepted_points(list(forced_response(problem.system, load, sweep)))
        known = [p for p in points if p.converged]
        if not known:
            return [], f"no multipliers: the forced motion was not found with {ORDER} harmonics"
        found = stability(forced, known[0])
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError) as error:
        return [], f"no multipliers ({str(error).removesuffix('.')})"
    multipliers = found.floquet.multipliers
    doubt = "" if found.verdict == "stable" else f"{found.verdict}: {found.reason}"
    return tones_of_multipliers(multipliers[np.isfinite(multipliers)], omega, HIGHEST), doubt


def tones_of_multipliers(multipliers: ComplexArray, omega: float, highest: int, count: int = 1) -> list[float]:
    """Return the possible frequencies, rad/s, of the disturbances that grow most, one beside every harmonic of the motion.

    Parameters
    ----------
    multipliers
        Floquet multipliers of a motion.
    omega
        Frequency of the motion, rad/s.
    highest
        Highest harmonic h of the frequencies.
    count
        Number of pairs of multipliers.

    Notes
    -----
    The angle φ of a multiplier determines the frequency of the disturbance only up to multiples of ω: ``|h ω ± φ ω / 2π|``.
    """
    grow = [
        value
        for value in sorted(multipliers, key=abs, reverse=True)
        if abs(value) > 1.0 and REAL < np.angle(value) < np.pi - REAL
    ]
    return [
        abs(h + sign * float(np.angle(value)) / (2.0 * np.pi)) * omega
        for value in grow[:count]
        for h in range(highest + 1)
        for sign in ((1.0, -1.0) if h else (1.0,))
    ]


def distinct(frequencies: Sequence[float], omega: float) -> list[float]:
    """Return frequencies that are no multiples of `omega` and differ by more than a thousandth."""
    out: list[float] = []
    for one in frequencies:
        off = abs(one / omega - round(one / omega))
        if one > 0.0 and off > 1e-4 and all(abs(one / known - 1.0) > 1e-3 for known in out):
            out.append(float(one))
    return out
