"""Limits of linear kinematics at the peak: rotations, strain, slip over facets."""

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.points import Response
from stickslip.analyses.forced_response.records.values import Values
from stickslip.response.recovery import signals

ROTATIONS = ("rx", "ry", "rz")


def motion_at_peak(question: Question, response: Response) -> Values:
    """Return how large the motion at the peak is, in what linear kinematics is limited by; NaN where that is not known.

    Rotations are those of rigid bodies and of nodes that have some, and the mean slope of a meshed part from its clamp to an output, which its
    steepest slope is above. The strain is the root mean square over the elastic parts, which the largest one is above.
    """
    none = float("nan")
    found = {"peak_rotation_rad": none, "peak_strain_rms": none, "peak_slip_facets": none}
    top = response.top
    if top is None or not top.point.converged:
        return found
    problem, extent = question.problem, question.extent
    system, linear, point = problem.system, problem.low.linear, top.point
    moved = np.abs(linear.recover(point.omega, point.coefficients))[1:].sum(axis=0)
    turns = np.array([c in ROTATIONS for c in system.structure.dofs.component], dtype=bool)
    slopes = [moved[turns]]
    if extent is not None:
        away = dict(zip(extent.labels, extent.from_clamp, strict=True))
        each = np.array([away.get(name, none) for name in question.model.output_labels])
        slopes.append(moved[system.outputs[: each.size]] / each)
        strain = linear.strain_energy(point.omega, point.coefficients)[1:].sum()
        found["peak_strain_rms"] = float(np.sqrt(max(4.0 * strain, 0.0) / extent.stiff_volume))
    known = np.concatenate(slopes)
    known = known[np.isfinite(known)]
    found["peak_rotation_rad"] = float(known.max()) if known.size else none
    facet = np.sqrt(question.model.contacts.area)
    if np.any(np.isfinite(facet)):
        gap = signals(problem, point).gap[:, :2]
        slip = 0.5 * np.hypot(*(np.ptp(gap[:, k], axis=1) for k in range(2)))
        found["peak_slip_facets"] = float(np.nanmax(slip / facet[: len(slip)]))
    return found
