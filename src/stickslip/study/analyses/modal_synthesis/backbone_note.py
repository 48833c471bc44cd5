"""A nonlinear mode as a note of a job: written once, taken up again after an interruption."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from stickslip.response.nonlinear_modes.backbone import Backbone, ModePoint, nonlinear_mode
from stickslip.response.nonlinear_modes.more_points import refined
from stickslip.response.self_excited.modes import StuckMode
from stickslip.solve.status import Status
from stickslip.study.analyses.analysis import Notes
from stickslip.study.analyses.modal_synthesis.problem import Question

NOTE = "backbone"
NUMBERS = ("amplitude", "omega", "ratio", "modal_amplitude", "energy", "slipping", "open_for", "change")


def backbone_of(question: Question, mode: StuckMode, notes: Notes) -> Backbone:
    """Return the nonlinear mode of a job, from its notes where it is among them."""
    known = notes.get(NOTE)
    if known is not None:
        return _read(question, mode, known)
    system, rest, how = question.model.system, question.rest, question.discretisation
    found = nonlinear_mode(system, rest, mode, question.dof, how, question.sweep)
    whole = refined(found, question.model.load, how)
    notes.put(NOTE, _written(whole))
    return whole


def _written(backbone: Backbone) -> dict[str, Any]:
    points = backbone.solutions
    most = max((p.order for p in points), default=0)
    motion = np.zeros((len(points), most + 1, backbone.system.structure.n, 2))
    for own, point in zip(motion, points, strict=True):
        own[: point.order + 1, :, 0] = point.coefficients.real
        own[: point.order + 1, :, 1] = point.coefficients.imag
    numbers = {name: np.array([getattr(p, name) for p in points], dtype=float) for name in NUMBERS}
    order = np.array([p.order for p in points], dtype=np.int64)
    return {**numbers, "order": order, "motion": motion, "end": backbone.end}


def _read(question: Question, mode: StuckMode, known: Mapping[str, Any]) -> Backbone:
    points = []
    for i, order in enumerate(known["order"]):
        own = known["motion"][i, : int(order) + 1]
        numbers = {name: float(known[name][i]) for name in NUMBERS}
        points.append(
            ModePoint(coefficients=own[..., 0] + 1j * own[..., 1], order=int(order), status=Status.CONVERGED, **numbers)
        )
    return Backbone(question.model.system, question.rest, mode, question.dof, tuple(points), str(known["end"]))
