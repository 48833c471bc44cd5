"""Other motions at the peak and beside it, and their stability."""

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.columns import OtherMotions, stored
from stickslip.analyses.forced_response.records.values import Values, texts
from stickslip.analyses.forced_response.stability.stable import examine
from stickslip.response.forced.collected import Accepted, Response
from stickslip.response.forced.other_motions import ANOTHER, OtherMotion, other_motions
from stickslip.response.recovery import fields
from stickslip.units import HZ

SAME_FREQUENCY_RTOL = 0.005  # largest relative difference of frequency of a motion on the branch
ALIKE = 0.03  # largest relative difference of its amplitude


def motions_elsewhere(question: Question, response: Response) -> Values:
    """Return other motions at the peak and the points beside it: frequency, amplitude, origin, stability."""
    found: list[tuple[OtherMotion, str]] = []
    if response.top is not None and response.top.point.converged:
        points = [a.point for a in (response.top, *response.flanks)]
        for other in other_motions(question.problem, points, response.solved, response.output):
            if not _on_branch(response, other):
                word = _stability(question, other)
                found += [(other, word)] * (word != "unstable")
    if not found:
        return {}
    return stored(
        OtherMotions(
            another_frequency_hz=np.array([o.point.omega / HZ for o, _ in found]),
            another_amplitude=np.array([o.amplitude for o, _ in found]),
            another_known=np.array([o.known for o, _ in found]),
            another_start=texts(o.start for o, _ in found),
            another_stability=texts(word for _, word in found),
        )
    )


def _on_branch(response: Response, other: OtherMotion) -> bool:
    """Whether the branch of the response contains the motion, for example beyond a fold."""
    return any(
        abs(a.point.omega / other.point.omega - 1.0) <= SAME_FREQUENCY_RTOL
        and abs(response.amplitude(a) / other.amplitude - 1.0) <= max(ALIKE, ANOTHER)
        for a in response.accepted
        if a.fields is not None
    )


def _stability(question: Question, other: OtherMotion) -> str:
    if question.examine == "off":
        return "not examined"
    problem = question.problem
    made = Accepted(other.point, None, fields(problem, other.point), None, float("nan"))
    return examine(question, made).verdict
