"""The resonance peak followed directly while a design parameter varies, without a sweep for each value.

Each peak is the solution of one equation (see `harmonic.peak`), started from the peak before. A damper optimisation curve costs a few
Newton steps a point, and its lowest point is the root of the exact slope of the peak amplitude.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import scipy.optimize

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.peak import Peak
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.parameter import Discretisation, Parameter
from stickslip.response.resonances.first import PeakSearch
from stickslip.response.resonances.point import PeakPoint
from stickslip.response.resonances.tracker import Tracker, trackers
from stickslip.response.system import System

APART = 1e-5  # relative distance of the frequencies of two peaks that are not the same


@by_one_thread
def track_peak(
    system: System,
    load: HarmonicLoad,
    parameter: Parameter,
    values: Sequence[float] | FloatArray,
    omega_range: tuple[float, float],
    by: Peak = "horizontal_tangent",
    output: int = 0,
    discretisation: Discretisation | None = None,
) -> Iterator[PeakPoint]:
    """Follow the highest resonance peak through the values of a design parameter; `follow_peaks` follows several, and harmonics that are not driven.

    Parameters
    ----------
    system
        Structure, contacts and outputs.
    load
        Static and harmonic forces on all dofs, N.
    parameter
        As in `branch_in_parameter`: a factor on a load, a field of the contact laws, or a function of the value.
    values
        Values of the parameter, in the order in which they are to be visited.
    omega_range
        Frequencies between which the first peak is searched for by a sweep, rad/s.
    by
        ``horizontal_tangent``: the largest amplitude; ``phase_quadrature``: the output lags the force by 90°, which is close to it for
        a lightly damped resonance, and cheaper; ``variable_phase``: the output has the phase of the
        largest amplitude beside the last peak, which serves several forces and modes, and harmonics that are not driven.
    output
        Position among the outputs of the dof whose amplitude peaks.
    discretisation
        Harmonics, samples, solver.

    Yields
    ------
    PeakPoint
        One a value. After one that is not found the next is tried from the last that was.

    Raises
    ------
    InputError
        If there are no values, the parameter, the condition or the output is unknown, the load drives no harmonic, or the range holds no
        peak at the first value.
    """
    how = discretisation or Discretisation()
    one = PeakSearch(system, load, parameter, omega_range, by, output, how)
    yield from follow_peaks(one, values, 1)


@by_one_thread
def follow_peaks(
    search: PeakSearch, values: Sequence[float] | FloatArray, most: int = 3, done: Sequence[PeakPoint] = ()
) -> Iterator[PeakPoint]:
    """Follow several resonance peaks through the values of a design parameter, each from its own last one.

    Parameters
    ----------
    search
        Of what, and by which condition.
    values
        Values of the parameter, in the order in which they are to be visited.
    most
        Number of peaks, the highest of the first value; fewer where it has fewer.
    done
        What an interrupted run has yielded; it is not computed again.

    Yields
    ------
    PeakPoint
        Not in `done`, one a value and peak, all peaks of a value before the next. Where two become one, one of them ends: that which had the longer way to it.

    Raises
    ------
    InputError
        If there are no values, or the range holds no peak at the first.
    """
    followed = trackers(search, float(values[0]) if len(values) else np.nan, most)
    yield from _through(followed, values, done)


def _through(
    followed: Sequence[Tracker],
    values: Sequence[float] | FloatArray,
    done: Sequence[PeakPoint],
    others: Sequence[PeakPoint] = (),
) -> Iterator[PeakPoint]:
    """Follow peaks through the values; one that has become another one, of these or of the `others`, ends."""
    known = {(p.value, p.peak): p for p in done}
    going, last = list(followed), dict[int, PeakPoint]()
    for value in map(float, values):
        here: list[PeakPoint] = []
        for tracker in going:
            stored = known.get((value, tracker.number))
            if stored is not None and stored.converged:
                tracker.take(stored)
            here.append(tracker.point(value) if stored is None else stored)
        there = [p for p in others if p.value == value]
        kept: list[PeakPoint] = []
        # the one that had to go the least way is the one that goes on
        for point in sorted(here, key=lambda p: _way(last.get(p.peak), p)):
            if not any(_is_one(point, other) for other in (*there, *kept)):
                kept.append(point)
        numbers = {p.peak for p in kept}
        going = [tracker for tracker in going if tracker.number in numbers]
        for point in (p for p in here if p.peak in numbers):
            if point.converged:
                last[point.peak] = point
            if (value, point.peak) not in known:
                yield point


def _is_one(one: PeakPoint, other: PeakPoint) -> bool:
    """Whether two points of the same value are one peak."""
    if not (one.converged and other.converged):
        return False
    near = abs(one.omega - other.omega) <= APART * other.omega
    return near and abs(one.amplitude - other.amplitude) <= APART * other.amplitude


def _way(before: PeakPoint | None, point: PeakPoint) -> float:
    """Return how far the frequency of a peak has gone since its last value, relatively."""
    return 0.0 if before is None else abs(point.omega / before.omega - 1.0)


@by_one_thread
def later_peaks(
    search: PeakSearch,
    values: Sequence[float] | FloatArray,
    known: Sequence[PeakPoint],
    most: int = 3,
    done: Sequence[PeakPoint] = (),
) -> Iterator[PeakPoint]:
    """Follow backwards the peaks at the last value that no peak followed from the first value reaches.

    Parameters
    ----------
    search, values, most, done
        As in `follow_peaks`.
    known
        What that has yielded.

    Yields
    ------
    PeakPoint
        From the last value to the first, numbered after the known ones. One that becomes a known one ends.
    """
    last = float(values[-1])
    there = [p.omega for p in known if p.value == last and p.converged]
    number = 1 + max((p.peak for p in known), default=-1)
    found: list[Tracker] = []
    for tracker in trackers(search, last, most):
        omega = search.periods * tracker.problem.omega(tracker.reached(last).x)
        if all(abs(omega - other) > APART * other for other in there):
            tracker.number = number + len(found)
            found.append(tracker)
    yield from _through(found, list(values)[::-1], done, known)


@by_one_thread
def smallest_peak(
    system: System,
    load: HarmonicLoad,
    parameter: Parameter,
    span: tuple[float, float],
    omega_range: tuple[float, float],
    output: int = 0,
    discretisation: Discretisation | None = None,
) -> PeakPoint:
    """Return the design with the smallest resonance peak: the value of the parameter at which the peak amplitude is stationary.

    Parameters
    ----------
    system, load, parameter, omega_range, output, discretisation
        As in `track_peak`.
    span
        Two values between which the peak falls first and then rises.

    Raises
    ------
    InputError
        If the peak is not found at an end, or its amplitude has a slope of the same sign at both.
    """
    how = discretisation or Discretisation()
    asked = PeakSearch(system, load, parameter, omega_range, "horizontal_tangent", output, how)
    (tracker,) = trackers(asked, float(span[0]), 1)
    ends = [tracker.point(value) for value in span]
    for end in (e for e in ends if not e.status.converged):
        raise input_error("span", f"the peak at {end.value:g} was not found ({end.status.advice})", "Take another end.")
    if not ends[0].slope * ends[1].slope < 0.0:
        raise input_error(
            "span",
            f"the peak amplitude changes by {ends[0].slope:.3g} and {ends[1].slope:.3g} per unit at its ends",
            "Give two values with the smallest peak between them.",
        )
    value = scipy.optimize.brentq(
        lambda v: tracker.point(float(v)).slope, *span, xtol=1e-12 * max(map(abs, span)), rtol=1e-12
    )
    return tracker.point(float(value))
