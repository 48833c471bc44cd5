"""Sensitivity of a peak to the model: the peak is found again after a change of reduction, contact points, contact or retention stiffness."""

from dataclasses import replace

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.columns import ModelChanges, StiffnessChange, stored
from stickslip.analyses.forced_response.records.points import Response
from stickslip.analyses.forced_response.records.values import Values
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.forced.resonance import peak_from
from stickslip.response.forced.response import (
    ForcedPoint,
    ForcedProblem,
    Sweep,
    accepted_points,
    forced_problem,
    forced_response,
)
from stickslip.response.peak_sensitivity import halved, stiffness_slope
from stickslip.response.system import System
from stickslip.solve.newton_method import newton
from stickslip.units import HZ

Change = tuple[float, float]  # relative change of the amplitude, change of the frequency in Hz
Found = tuple[ForcedProblem, ForcedPoint] | None
UNKNOWN: Change = (float("nan"), float("nan"))
BESIDE = 0.03  # half-width of a short sweep about a peak, relative to its frequency
SWEPT_POINTS = 12  # points of this sweep
PEAK_POINTS = 4  # points added to resolve its peak
MOST_HARMONICS = 15  # of peaks that are compared, both alike; more change the comparison less than its last digit told
AT_AN_END = 1e-9  # relative distance from an end of the sweep, below which a peak is no resonance


def model_changes(question: Question, response: Response) -> Values:
    """Return the change of the peak with 50 % more modes, and with half the points of meshed contacts; NaN if unknown."""
    more = fewer = UNKNOWN
    left_out = 0
    richer, coarser = _richer(question), _coarser(question)
    top, model = response.top, question.model
    if top is not None and top.point.converged and (richer or coarser):
        start = _with_few_harmonics(question, top.point)
        own = _found(question, model.system, model.load, start)
        if richer is not None:
            more = _change(response, own, _found(question, *richer, start))
        if coarser is not None:
            system, left_out = coarser
            stays = np.isin(model.system.retained, system.retained)
            point = replace(start, coefficients=start.coefficients[:, stays])
            fewer = _change(response, own, _found(question, system, model.load, point))
    return stored(
        ModelChanges(
            modes_peak_change=more[0],
            modes_frequency_change_hz=more[1],
            points_peak_change=fewer[0],
            points_frequency_change_hz=fewer[1],
            points_left_out=left_out,
        )
    )


def stiffness_changes(question: Question, response: Response) -> Values:
    """Return the derivative of the peak with respect to the stiffness of all contacts; NaN if unknown."""
    top, slope = response.top, None
    if top is not None and top.point.converged:
        resonance = _at_resonance(question, top.point)
        slope = stiffness_slope(question.problem, top.point, response.output, resonance=resonance)
    unknown = float("nan")
    return stored(
        StiffnessChange(
            stiffness_peak_slope=unknown if slope is None else slope.amplitude,
            stiffness_frequency_slope_hz=unknown if slope is None else slope.omega / HZ,
        )
    )


def _with_few_harmonics(question: Question, point: ForcedPoint) -> ForcedPoint:
    """Return a point without the harmonics that a comparison of two peaks does not need."""
    most = max(MOST_HARMONICS, 3 * max(question.model.load.harmonics))
    rows = point.harmonics <= most
    if np.all(rows):
        return point
    kept = point.kept[rows] if point.kept.size else point.kept
    harmonics = point.harmonics[rows]
    return replace(point, coefficients=point.coefficients[: harmonics[-1] + 1], harmonics=harmonics, kept=kept)


def _at_resonance(question: Question, point: ForcedPoint) -> bool:
    """Return whether a peak was resolved at a point: frequencies are not listed, and it is no end of the sweep."""
    ends = np.array(question.sweep.omega_range)
    return not (np.any(np.abs(ends / point.omega - 1.0) < AT_AN_END) or question.sweep.grid.size)


def _richer(question: Question) -> tuple[System, HarmonicLoad] | None:
    """Return the model with more modes and the sliders of the given model; None without one of the same coordinates."""
    own = question.model.system
    if question.richer is None or question.richer[0].retained_labels != own.retained_labels:
        return None
    system, load = question.richer
    interface = replace(system.interface, laws=own.interface.laws)
    return replace(system, interface=interface), load


def _coarser(question: Question) -> tuple[System, int] | None:
    """Return the model with half the points of meshed contacts, and the number of points removed."""
    model, table = question.model, question.model.contacts
    if model.blades is not None or not model.system.structure.reduced or model.system.interface.rigid:
        return None
    return halved(model.system, table.groups, table.position, table.area)


def _change(response: Response, own: Found, other: Found) -> Change:
    """Return the change of a peak from the model's own peak, found in the same way; NaN if either is not found."""
    if own is None or other is None:
        return UNKNOWN
    before, after = (problem.amplitude(point, response.output) for problem, point in (own, other))
    return after / before - 1.0, (other[1].omega - own[1].omega) / HZ


def _swept(system: System, load: HarmonicLoad, sweep: Sweep, point: ForcedPoint) -> ForcedPoint | None:
    """Find the peak of another model by a short sweep if no solver finds it from a point; None at an end of the sweep."""
    around = (point.omega * (1.0 - BESIDE), point.omega * (1.0 + BESIDE))
    short = replace(sweep, omega_range=around, points=SWEPT_POINTS, rescue="off")
    problem = forced_problem(system, load, short)
    found = [p for p in accepted_points(list(forced_response(system, load, short))) if p.converged]
    top = max(found, key=problem.amplitude, default=None)
    inside = top is not None and min(p.omega for p in found) < top.omega < max(p.omega for p in found)
    return top if inside else None


def _found(question: Question, system: System, load: HarmonicLoad, point: ForcedPoint) -> Found:
    """Find the peak of a system near a point; for listed frequencies and at ends of the sweep at the frequency of the point."""
    own, sweep = point.support, _of_comparison(question, point)
    problem = forced_problem(system, load, sweep)
    if _at_resonance(question, point):
        peak = peak_from(problem, point) or _swept(system, load, sweep, point)
        return None if peak is None else (problem, peak)
    balance = problem.balance(own)
    start = balance.unknowns(point.coefficients)
    found = newton(lambda x: balance.linearise(x, point.omega), start, sweep.newton)
    if not found.status.converged:
        return None
    return problem, replace(point, coefficients=balance.coefficients(found.x))


def _of_comparison(question: Question, point: ForcedPoint) -> Sweep:
    """Return the sweep that finds a peak from a point, with its harmonics and few points."""
    own, few = point.support, min(question.sweep.peak_points, PEAK_POINTS)
    return replace(question.sweep, low=own, high=own, selection="always_high", peak_points=few)


NO_SHIFT = (float("nan"), float("nan"))
# shares of the study's stiffness, each solved from the one before; the last one counts
WEAKER = (0.5, 0.2, 0.1)


def peak_shift(question: Question, response: Response) -> tuple[float, float]:
    """Follow the peak while the retention stiffness is reduced to a tenth.

    Returns
    -------
    tuple of float
        Relative change of the peak amplitude, and change of its frequency in Hz; NaN without retention, without a peak, or where no
        periodic motion was found with a weaker retention.
    """
    model, top = question.model, response.top
    if model.retention == 0.0 or top is None:
        return NO_SHIFT
    point = _with_few_harmonics(question, top.point)
    fewer = point.order < top.point.order
    own = _found(question, model.system, model.load, point) if fewer else (question.problem, point)
    if own is None:
        return NO_SHIFT
    first = point = own[1]
    before = own[0].amplitude(first, response.output) if fewer else response.peak_amplitude
    sweep = _of_comparison(question, first)
    for share in WEAKER:
        held = model.bare.with_retention(share * model.retention)
        problem = forced_problem(held, model.load, sweep)
        again = peak_from(problem, point)
        if again is None:
            return NO_SHIFT
        point = again
    return problem.amplitude(point, response.output) / before - 1, (point.omega - first.omega) / HZ
