"""The response of a case with the stability of its points. Undecided points are integrated in time, some are solved with more harmonics."""

from collections.abc import Generator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from stickslip.analyses.forced_response.estimate import SECONDS_OF_DOUBTS
from stickslip.analyses.forced_response.problem import IN_TIME, STABLE, Question
from stickslip.analyses.forced_response.records.points import Accepted, Response, collect
from stickslip.analyses.forced_response.stability.examining import (
    examined_points,
    neighbours_of,
    with_stable_peak,
)
from stickslip.analyses.forced_response.stability.in_time import Check, check_in_time, seconds_in_time
from stickslip.analyses.forced_response.stability.stable import (
    Examined,
    as_note,
    examine,
    from_note,
    integrable,
    note_of_raised,
    raised_of,
    to_integrate,
    with_motion,
    with_raised,
    without_raised,
)
from stickslip.errors import InputError
from stickslip.response.forced.problem import ForcedPoint
from stickslip.study.analysis import Notes, Pieces
from stickslip.study.store.progress import LOG, stage
from stickslip.units import HZ

MOST_PEAKS = 3  # largest motions integrated in time, each after the larger one proved unstable


@dataclass(eq=False)
class Looked:
    """Examination of points in the order of requests, with memory over interruptions.

    Parameters
    ----------
    question
        Question of the case.
    notes
        Notes of the job.
    count
        Number of points requested.
    taken
        Number of points that an interrupted run had examined.
    """

    question: Question
    notes: Notes
    count: int = 0
    taken: int = 0

    def __call__(self, accepted: Accepted) -> Examined:
        """Return the stability of a point."""
        name, self.count = f"{STABLE}.{self.count}", self.count + 1
        known, pieces = self.notes.get(name), Pieces(self.notes, name)
        stage(f"stability, point {self.count}: {accepted.point.omega / HZ:.2f} Hz")
        one = from_note(known, accepted.point) if known else examine(self.question, accepted, pieces.keep)
        self.taken += bool(known)
        self.notes.put(name, as_note(one))
        pieces.give_up()
        if pieces.taken:
            self._say(f"{one.omega / HZ:.3f} Hz: {pieces.taken} pieces are taken over from a run that was stopped")
        return one

    def tell(self) -> None:
        """Log the number of points known from an interrupted run."""
        if self.taken:
            self._say(f"{self.taken} points that were examined before are taken over from a run that was stopped")

    def _say(self, text: str) -> None:
        LOG.info(f"stability: {self.question.said(text)}")


def with_stability(
    question: Question, points: Sequence[ForcedPoint], notes: Notes
) -> Generator[ForcedPoint, None, tuple[Response, list[Examined]]]:
    """Return the response with its stable peak and the stability of its points; yield solutions that replace points."""
    ended = notes.get("finished") or {"points": len(points)}
    notes.put("finished", ended)
    solved, raised = list(points[: ended["points"]]), list(points[ended["points"] :])
    response = collect(question.problem, solved, question.model.peak_output)
    look = Looked(question, notes)
    examined = _examined(question, response, notes, look)
    for point in with_raised([a.point for a in response.accepted], examined)[len(raised) :]:
        raised.append(point)
        yield point
    if raised:
        response = collect(question.problem, [*solved, *raised], question.model.peak_output)
        examined = _with_peak(response, examined, look)
    return with_stable_peak(response, examined), examined


def _with_peak(response: Response, examined: list[Examined], look: Looked) -> list[Examined]:
    """Examine the largest motion as well, if replaced points have made another motion the largest."""
    for _ in range(MOST_PEAKS):
        peak = with_stable_peak(response, examined)
        known = {e.position for e in examined if e.basis != "not examined"}
        if peak.top is None or peak.peak in known:
            break
        found = replace(look(peak.top), position=peak.peak, raised=None)
        others = [e for e in examined if e.position != peak.peak]
        examined = sorted([*others, found], key=lambda e: e.position)
    return examined


def _examined(question: Question, response: Response, notes: Notes, look: Looked) -> list[Examined]:
    """Return the stability of all points; examinations of an interrupted run are used again.

    A short time integration decides where multipliers leave a motion undecided. The peak comes first; if its motion is
    left in time, the next largest motion becomes the peak. Other motions follow.
    """
    found = examined_points(question, response, look)
    look.tell()
    if question.stepping is not None:
        return found
    for _ in range(MOST_PEAKS):
        peak = with_stable_peak(response, found)
        if not to_integrate(question, peak, found) or peak.top is None:
            break
        check, raised = integrated(question, peak, peak.top, found, notes, raises=True)
        found = [_with_balance(with_motion(e, check), raised) if e.position == peak.peak else e for e in found]
    if question.examine in ("peak", "off") or not integrable(question):
        return found
    return _doubts_in_time(question, response, found, notes)


def _doubts_in_time(question: Question, response: Response, examined: list[Examined], notes: Notes) -> list[Examined]:
    """Integrate in time at points left open by multipliers or predictions, the largest first, and pass confirmed stability on to neighbours."""
    found, tried, spent = examined, set[int](), 0.0
    while spent < SECONDS_OF_DOUBTS:
        open_ = _open_places(question, response, found) - tried
        if not open_:
            break
        place = max(open_, key=lambda i: response.amplitude(response.accepted[i]))
        tried.add(place)
        own = response.accepted[place]
        try:
            check, raised = integrated(question, response, own, found, notes, raises=True)
        except InputError:
            break  # the model cannot be integrated: doubts remain
        spent += seconds_in_time(question.model.system, check.periods * check.steps)
        found = [_with_balance(with_motion(e, check), raised) if e.position == place else e for e in found]
        found = neighbours_of(question, response, found, [own.point.omega] * (check.motion == "attained"))
    return found


def _open_places(question: Question, response: Response, examined: Sequence[Examined]) -> set[int]:
    """Return the indices of undecided points, and of points, except unstable ones, with harmonics doubted by prediction."""
    undecided = {e.position for e in examined if e.verdict == "undecided" and not e.motion}
    unstable = {e.position for e in examined if e.verdict == "unstable"}
    threshold = question.problem.strategy.threshold
    predicted = (
        i
        for i, a in enumerate(response.accepted)
        if a.point.converged and np.isnan(a.audit_error) and a.own_error > threshold
    )
    return undecided | ({*predicted} - unstable)


def _with_balance(examined: Examined, raised: ForcedPoint | None) -> Examined:
    """Return the stability with the balance that was solved again from the motion in time, if there is one."""
    return examined if raised is None else replace(examined, raised=raised)


def integrated(
    question: Question,
    response: Response,
    accepted: Accepted,
    examined: Sequence[Examined],
    notes: Notes,
    *,
    raises: bool = False,
) -> tuple[Check, ForcedPoint | None]:
    """Integrate in time; results of an interrupted run are used again.

    Return the comparison, and the balance with more harmonics that replaces the point; None if the point stays, as it
    does unless `raises`.
    """
    omega = accepted.point.omega
    name = f"{IN_TIME}.{omega!r}"
    known = notes.get(name)
    if known:
        check, raised = Check(**without_raised(known)), raised_of(known, accepted.point)
    else:
        stage(f"check in time: {omega / HZ:.2f} Hz")
        doubted = [e.multiplier for e in examined if e.omega == omega and e.doubted]
        raises = raises and question.sweep.auto and question.problem.strategy.verifies
        check, raised = check_in_time(question, response, accepted, *doubted, raises=raises)
    notes.put(name, asdict(check) | note_of_raised(raised))
    LOG.info(f"time integration: {question.said(check.sentence)}")
    return check, raised
