"""Sensitivity of a peak to the model: the peak is found again after a change of reduction, contact points, contact or retention stiffness."""

from dataclasses import replace

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.columns import ModelChanges, StiffnessChange, stored
from stickslip.analyses.forced_response.records.values import Values
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.forced.collected import Response
from stickslip.response.forced.resonance import peak_from
from stickslip.response.forced.response import forced_problem
from stickslip.response.peak_sensitivity import (
    UNKNOWN_CHANGE,
    at_resonance,
    comparing_sweep,
    halved,
    peak_change,
    peak_near,
    stiffness_slope,
    with_few_harmonics,
)
from stickslip.response.system import System
from stickslip.units import HZ

NO_SHIFT = (float("nan"), float("nan"))
# shares of the study's stiffness, each solved from the one before; the last one counts
WEAKER = (0.5, 0.2, 0.1)


def model_changes(question: Question, response: Response) -> Values:
    """Return the change of the peak with 50 % more modes, and with half the points of meshed contacts; NaN if unknown."""
    more = fewer = UNKNOWN_CHANGE
    left_out = 0
    richer, coarser = _richer(question), _coarser(question)
    top, model = response.top, question.model
    if top is not None and top.point.converged and (richer or coarser):
        start, sweep = with_few_harmonics(model.load, top.point), question.sweep
        own = peak_near(model.system, model.load, sweep, start)
        if richer is not None:
            more = peak_change(own, peak_near(*richer, sweep, start), response.output)
        if coarser is not None:
            system, left_out = coarser
            stays = np.isin(model.system.retained, system.retained)
            point = replace(start, coefficients=start.coefficients[:, stays])
            fewer = peak_change(own, peak_near(system, model.load, sweep, point), response.output)
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
        resonance = at_resonance(question.sweep, top.point)
        slope = stiffness_slope(question.problem, top.point, response.output, resonance=resonance)
    unknown = float("nan")
    return stored(
        StiffnessChange(
            stiffness_peak_slope=unknown if slope is None else slope.amplitude,
            stiffness_frequency_slope_hz=unknown if slope is None else slope.omega / HZ,
        )
    )


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
    point = with_few_harmonics(model.load, top.point)
    fewer = point.order < top.point.order
    own = peak_near(model.system, model.load, question.sweep, point) if fewer else (question.problem, point)
    if own is None:
        return NO_SHIFT
    first = point = own[1]
    before = own[0].amplitude(first, response.output) if fewer else response.peak_amplitude
    sweep = comparing_sweep(question.sweep, first)
    for share in WEAKER:
        held = model.bare.with_retention(share * model.retention)
        problem = forced_problem(held, model.load, sweep)
        again = peak_from(problem, point)
        if again is None:
            return NO_SHIFT
        point = again
    return problem.amplitude(point, response.output) / before - 1, (point.omega - first.omega) / HZ
