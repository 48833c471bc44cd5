"""Stability along a response: the choice of the points that are examined, the verdicts inferred for the others, and the mending of both.

Undecided points are integrated in time, some are solved with more harmonics.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property, lru_cache
from heapq import heapify, heappop, heappush
from itertools import pairwise

import numpy as np

from stickslip.analyses.forced_response.estimate import SECONDS_OF_DOUBTS
from stickslip.analyses.forced_response.problem import IN_TIME, STABLE, Question
from stickslip.analyses.forced_response.stability.examination import by_hill
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
    why_not,
    with_motion,
    with_raised,
    without_raised,
)
from stickslip.analyses.forced_response.verdicts.curve import branch_length
from stickslip.arrays import IntArray
from stickslip.errors import InputError
from stickslip.model.structure import Structure
from stickslip.response.forced.collected import Accepted, Response, collect, jumps, stored_energy
from stickslip.response.forced.problem import ForcedPoint
from stickslip.response.stability.course import Course, course_of, has_transitions
from stickslip.response.stability.found import changes
from stickslip.response.stability.missing_harmonics import newton_work
from stickslip.study.analysis import Notes, Pieces
from stickslip.study.store.progress import LOG, stage
from stickslip.units import HZ

ALWAYS_ROWS = 500  # rows of matrices up to which every point is examined, or inferred from examined points
CARRIED = 0.95  # largest modulus of multipliers, error included, with which a verdict is inferred between two points
FURTHER = 10  # points that are examined to find the largest motion that is not unstable
FEW = 3  # points among them that are examined whatever has been spent

Examine = Callable[[Accepted], Examined]


def examined_points(question: Question, response: Response, examine: Examine) -> list[Examined]:
    """Return the known stability of points in the order of the branch.

    Parameters
    ----------
    question, response
        The case and its response.
    examine
        Function that examines a point.
    """
    if question.examine == "off" or response.top is None:
        return []
    if question.stepping is not None:  # multipliers of every motion are known
        chosen = [response.peak] if question.examine == "peak" else range(len(response.accepted))
        return [replace(examine(response.accepted[i]), position=i) for i in chosen if response.accepted[i].fields]
    if why_not(question):
        return [replace(examine(response.top), position=response.peak)]
    course = _course(question, response)
    search = _Search(question, response, course, examine, _allowed(question, response))
    search.look(course.order.index(response.peak))
    if question.examine == "all" and not by_hill(question.model.system):
        for place in range(len(course.order)):
            search.look(place)
    elif question.examine != "peak":
        search.along()
    search.settle_peak()
    if question.examine != "peak":
        search.close_gaps()
    return search.all_points()


def neighbours_of(
    question: Question, response: Response, examined: list[Examined], attained: list[float]
) -> list[Examined]:
    """Return all points; undecided ones are stable next to a point with the same transitions that is confirmed in time.

    Not those with a multiplier above 1: it says growth, though within its error. Nor points with fewer harmonics than the confirmed
    motion, which may be another one.
    """
    known = [e for e in examined if e.omega in attained]
    if not known or not any(e.verdict == "undecided" for e in examined):
        return examined
    course = _course(question, response)
    place = {position: k for k, position in enumerate(course.order)}

    def beside(e: Examined) -> Examined:
        if e.verdict != "undecided" or e.motion or e.multiplier > 1.0:
            return e
        order = response.accepted[e.position].point.order
        fewer = (k for k in known if (k.raised or response.accepted[k.position].point).order <= order)
        near = [k for k in fewer if course.like(place[k.position], place[e.position])]
        if not near:
            return e
        said = (
            f"the motion in time has attained its neighbour at {near[0].omega / HZ:.3f} Hz on the same branch, with the same transitions "
            "in the cycle"
        )
        return replace(e, verdict="stable", basis="carried", reason=said)

    return [beside(e) for e in examined]


@dataclass(eq=False)
class _Search:
    """Search along the points of a course for changes of stability."""

    question: Question
    response: Response
    course: Course
    examine: Examine
    allowed: float
    spent: float = 0.0
    found: dict[int, Examined] = field(default_factory=dict)  # by place on the course

    def look(self, place: int) -> Examined:
        """Examine a point once, whatever its cost."""
        if place not in self.found:
            position = self.course.order[place]
            one = self._linear(place) or self.examine(self.response.accepted[position])
            self.found[place] = replace(one, position=position)
            self.spent += one.work
        return self.found[place]

    def along(self) -> None:
        """Examine points next to possible changes of stability, then bisect until the points between follow from the ends."""
        for place in self._first():
            if self.spent > self.allowed:
                return
            if place not in self.found and not self._opposed(place):
                self.look(place)
        ends = sorted(self.found)
        open_ = [(a - b, a, b) for a, b in pairwise(ends)]
        heapify(open_)
        while open_ and self.spent <= self.allowed:
            _, a, b = heappop(open_)
            if b == a + 1 or self._carries(a, b):
                continue
            middle = (a + b) // 2
            if not self._opposed(middle):
                self.look(middle)
            heappush(open_, (a - middle, a, middle))
            heappush(open_, (middle - b, middle, b))

    def settle_peak(self) -> None:
        """Examine the largest motion not known to be unstable, repeatedly until one is stable or undecided; a few whatever their cost."""
        for further in range(FURTHER):
            every = self.all_points()
            position = largest(self.response, every)
            known = any(e.position == position for e in every)
            if position < 0 or known or (further >= FEW and self.spent > self.allowed):
                return
            self.look(self.course.order.index(position))

    def close_gaps(self) -> None:
        """Examine points that the sign of the determinant decided during the search, and does not with all that was found since."""
        while self.spent <= self.allowed:
            known = {e.position for e in self.all_points()}
            open_ = [k for k, position in enumerate(self.course.order) if position not in known]
            if not open_:
                return
            for place in open_:
                if self.spent <= self.allowed:
                    self.look(place)

    def all_points(self) -> list[Examined]:
        """Return the stability of every point: examined, inferred between two points, by the sign of the determinant, or unknown."""
        own = dict(self.found)
        for k, position in enumerate(self.course.order):
            linear = None if k in own else self._linear(k)
            if linear is not None:
                own[k] = replace(linear, position=position)
        for a, b in pairwise(sorted(self.found)):
            if b > a + 1 and self._carries(a, b):
                own = {k: self._carried(k, a, b) for k in range(a + 1, b)} | own
        for k in range(len(self.course.order)):
            # beside a fold Newton's method may find the stable motion from the unstable one
            open_ = k not in own or own[k].verdict in ("stable", "undecided")
            if open_ and self._opposed(k):
                own[k] = self._by_sign(k)
        return [own[k] for k in sorted(own)]

    # --- points that are not examined ------------------------------------------------------------

    def _carries(self, a: int, b: int) -> bool:
        """Whether the verdict of two examined points holds for all points between them."""
        if a not in self.found or b not in self.found:
            return False
        ends = (self.found[a], self.found[b])
        far = all(e.verdict == "stable" and e.multiplier + e.error < CARRIED for e in ends)
        # a verdict on a motion with more harmonics says nothing about points solved with fewer
        as_solved = all(e.raised is None for e in ends)
        return far and as_solved and self.course.like(a, b) and _inside_between(*ends)

    def _carried(self, place: int, a: int, b: int) -> Examined:
        ends = (self.found[a], self.found[b])
        larger = max(ends, key=lambda e: e.multiplier)
        low, high = sorted(e.omega / HZ for e in ends)
        said = f"stable by its neighbours at {low:.3f} and {high:.3f} Hz: their multipliers are below {CARRIED:g} and move too little to pass the unit circle, the transitions in the cycle are the same, and the branch does not turn"
        return Examined(
            self._omega(place),
            "stable",
            larger.multiplier,
            larger.error,
            said,
            basis="carried",
            position=self.course.order[place],
        )

    def _by_sign(self, place: int) -> Examined:
        said = (
            "the determinant of the Jacobian has another sign than at stable points of the branch: an odd number of real multipliers lies "
            "above 1"
        )
        return Examined(
            self._omega(place), "unstable", np.nan, np.nan, said, basis="by sign", position=self.course.order[place]
        )

    def _opposed(self, place: int) -> bool:
        """Whether the determinant differs in sign from the nearest stable point of the branch, and examined neighbours with this sign are unstable.

        Undecided neighbours do not contradict it. Neighbours with more harmonics do not count: the fold of a point with fewer lies
        elsewhere. Stable ones beside a fold do not, either: more harmonics may have led to the motion on its other side.
        """
        sign, stretch, fold = self.course.sign, self._stretches, self.course.fold
        others = [k for k in self._of_run(place) if k != place]
        alike = (k for k in others if stretch[k] == stretch[place] and self._order(k) <= self._order(place))
        far = [k for k in others if not np.any(fold[max(k - 1, 0) : k + 1])]
        verdicts = {self.found[k].verdict for k in alike if k in far or self.found[k].verdict != "stable"}
        stable = [k for k in far if self.found[k].verdict == "stable"]
        if "unstable" not in verdicts or not verdicts <= {"unstable", "undecided"} or not stable:
            return False
        return bool(sign[min(stable, key=lambda k: abs(k - place))] * sign[place] < 0.0)

    def _order(self, place: int) -> int:
        """Return the highest harmonic of a point as solved."""
        return self.response.accepted[self.course.order[place]].point.order

    def _of_run(self, place: int) -> list[int]:
        run = self._runs[place]
        return [k for k in self.found if self._runs[k] == run]

    @cached_property
    def _runs(self) -> IntArray:
        """(n,) index of the run of the branch that contains each point."""
        return np.concatenate([[0], np.cumsum(self.course.cut)]).astype(np.int64)

    @cached_property
    def _stretches(self) -> IntArray:
        """(n,) index of the range of constant sign that contains each point."""
        sign = self.course.sign
        return np.concatenate([[0], np.cumsum((sign[1:] != sign[:-1]) | self.course.cut)]).astype(np.int64)

    def _omega(self, place: int) -> float:
        return self.response.accepted[self.course.order[place]].point.omega

    def _linear(self, place: int) -> Examined | None:
        """Return the stability of a point without changes of contact state from a point with the same states.

        Both obey one linear system, whose exponents do not depend on the frequency of the load. The multipliers are the
        other point's multipliers to the power of the ratio of the periods. Samples may miss a short slip, which acts on
        harmonics that are not driven; therefore the solution must be exact, too.
        """
        cycle, side = self.course.cycle[place], self.question.model.system.structure
        point = self.response.accepted[self.course.order[place]].point
        exact = point.predicted_error == 0.0
        if cycle is None or has_transitions(cycle) or not exact or type(side) is not Structure:
            return None
        omega = point.omega
        for k, e in self.found.items():
            if self.course.cycle[k] == cycle and e.verdict == "stable" and e.error == 0.0:
                size = e.multiplier ** (e.omega / omega)
                return replace(e, omega=omega, multiplier=size, work=0.0, reason=e.linear(size))
        return None

    # --- where to look ----------------------------------------------------------------------------

    def _first(self) -> Iterator[int]:
        """Yield the ends of the branch, points next to folds, and points between which the list of transitions changes, the nearest to the peak first."""
        course = self.course
        peak = course.order.index(self.response.peak)
        yield from (k for run in course.runs() for k in (run[0], run[-1]))
        for steps in (course.fold | course.turns, course.changes & ~course.fold):
            beside = {int(k) + d for k in np.flatnonzero(steps) for d in (0, 1)}
            yield from sorted(beside, key=lambda k: abs(k - peak))


def _inside_between(one: Examined, other: Examined) -> bool:
    """Whether no multiplier moves so far between two points that it may cross the unit circle.

    A complex pair moves along a circle, whose radius is set by its damping, until it meets on the real axis. There one
    multiplier may leave the circle.
    """
    for a, b in ((one, other), (other, one)):
        _, moduli = changes(a.multipliers, b.multipliers)
        if not np.all(np.abs(a.multipliers) + moduli < 1.0):
            return False
    return True


def largest(response: Response, known: list[Examined]) -> int:
    """Return the index of the largest motion not known to be unstable; -1 for none."""
    off = {e.position for e in known if e.verdict == "unstable"}
    sizes = [
        (response.amplitude(a), -i) for i, a in enumerate(response.accepted) if i not in off and a.fields is not None
    ]
    return -max(sizes)[1] if sizes else -1


def with_stable_peak(response: Response, known: list[Examined]) -> Response:
    """Return the response whose peak is the largest motion not known to be unstable; a larger unstable one is noted in it."""
    position = largest(response, known)
    unstable = {e.position for e in known if e.verdict == "unstable"}
    if response.peak not in unstable or position < 0:
        return response
    return replace(response, peak=position, unstable_peak=response.peak)


@lru_cache(maxsize=2)
def _course(question: Question, response: Response) -> Course:
    """Return the course of a response; cached, because each time integration needs it again."""
    every = response.accepted
    along = branch_length(np.array([a.point.stage == "peak" for a in every], dtype=float))
    return course_of(question.problem, [a.point for a in every], along, _jumps(response, along))


def _jumps(response: Response, along: int) -> list[int]:
    """Return the indices of points after which the response jumps."""
    every = response.accepted
    branch = [i for i, a in enumerate(every[:along]) if a.fields is not None]
    shown = [f for f in (every[i].fields for i in branch) if f is not None]
    amplitude = np.array([response.amplitude(every[i]) for i in branch])
    few = np.array([every[i].point.support == response.low_harmonics for i in branch], dtype=bool)
    loss = np.array([f.energy.sum() for f in shown])
    elastic = max((stored_energy(f.gaps[None, 1:], f.forces[None, 1:]) for f in shown), default=0.0)
    return [branch[jump.step] for jump in jumps(amplitude, loss, few, elastic)]


def _allowed(question: Question, response: Response) -> float:
    """Return the operations allowed for the examinations of a case: unlimited for small matrices, else as many as for its solutions."""
    system = question.model.system
    side = system.structure
    sectors = 1 if side.wheel is None else side.wheel.sectors
    rows = max(2 * sectors * side.n, *(p.unknowns for p in response.solved))
    if not by_hill(system) and rows <= ALWAYS_ROWS:
        return np.inf
    return sum(p.iterations * newton_work(p.unknowns) for p in response.solved)


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
    examined = _confirmed_peak(question, response, examined, notes)
    return with_stable_peak(response, examined), examined


def _confirmed_peak(question: Question, response: Response, examined: list[Examined], notes: Notes) -> list[Examined]:
    """Integrate in time at a peak whose stability only neighbours confirm; if its motion is left, the next largest is the peak."""
    if question.stepping is not None or not integrable(question):
        return examined
    for _ in range(MOST_PEAKS):
        peak = with_stable_peak(response, examined)
        own = next((e for e in examined if e.position == peak.peak), None)
        if own is None or peak.top is None or own.basis != "carried" or own.multiplier + own.error < 1.0:
            break
        check, _raised = integrated(question, peak, peak.top, examined, notes)
        told = with_motion(replace(own, verdict="undecided", basis="examined"), check)
        examined = [told if e.position == peak.peak else e for e in examined]
    return examined


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
