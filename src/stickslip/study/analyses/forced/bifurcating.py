"""The bifurcations of a response, and the branches that leave there: what a job puts down of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.errors import StickslipError
from stickslip.response.bifurcations.found import Bifurcation, Bifurcations
from stickslip.response.bifurcations.locate import MOST, bifurcations
from stickslip.response.bifurcations.side_branch import POINTS, SideBranch, side_branches
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability import Stability, stability
from stickslip.response.time.floquet import Floquet
from stickslip.study.analyses.analysis import Notes
from stickslip.study.analyses.forced.curve import branch_length
from stickslip.study.analyses.forced.examination import FLOPS, examination_work
from stickslip.study.analyses.forced.points import Response
from stickslip.study.analyses.forced.question import Question
from stickslip.study.analyses.forced.stable import unexaminable
from stickslip.study.analyses.forced.values import Values, texts
from stickslip.units import HZ

COUNTS = ("resting", "grazing", "transitions")  # of a stability
LEAVES = ("period doubling", "branch point")  # kinds from which a periodic branch is followed
MOST_FOLLOWED = 6  # bifurcations of a case from which branches are followed
BY_VERDICT = {"stable": 0, "unstable": 1, "undecided": 2}
NOT_EXAMINED = 3


@dataclass(eq=False)
class Remembered:
    """Multipliers in the order in which they are asked for; what an interrupted run has asked for is not done again."""

    notes: Notes
    count: int = 0

    def __call__(self, problem: ForcedProblem, point: ForcedPoint) -> Stability:
        """Return what becomes of disturbances of a motion."""
        self.count += 1
        name = f"bifurcations.{self.count}"
        known = self.notes.get(name)
        if known is None or known["omega"] != point.omega:
            found = stability(problem, point)
            values = found.floquet.multipliers
            known = {
                "omega": point.omega,
                "re": values.real,
                "im": values.imag,
                "errors": found.errors,
            }
            self.notes.put(name, known | {word: getattr(found, word) for word in COUNTS})
            return found
        floquet = Floquet(np.asarray(known["re"]) + 1j * np.asarray(known["im"]))
        return Stability(floquet, np.asarray(known["errors"]), *(int(known[w]) for w in COUNTS))


def located(question: Question, response: Response, notes: Notes) -> Bifurcations:
    """Return the bifurcations along the branch of a response: all that were asked for, folds alone where nothing can be examined."""
    every = response.accepted
    along = branch_length(np.array([a.point.stage == "peak" for a in every], dtype=float))
    branch = [a.point for a in every[:along]]
    if question.bifurcations == "folds" or unexaminable(question):
        return bifurcations(question.problem, branch, examine=None)
    try:
        return bifurcations(question.problem, branch, examine=Remembered(notes))
    except StickslipError:  # as the examination of the peak has told
        return bifurcations(question.problem, branch, examine=None)


def followed(question: Question, found: Bifurcations) -> list[tuple[Bifurcation, SideBranch]]:
    """Return the branches that leave the response, each with where it does."""
    if question.bifurcations != "branches":
        return []
    own = [b for b in found.found if b.kind in LEAVES][:MOST_FOLLOWED]
    return [(b, side) for b in own for side in side_branches(question.problem, b)]


def of_bifurcations(
    question: Question,
    response: Response,
    found: Bifurcations,
    sides: Sequence[tuple[Bifurcation, SideBranch]],
) -> Values:
    """Return bifurcations and the branches that leave there as values of the dataset."""
    own, problem = found.found, question.problem
    points = [(n, side, p) for n, (_, side) in enumerate(sides) for p in side.points]
    output = response.output
    known = [*found.stabilities, *([None] * (len(response.accepted) - len(found.stabilities)))]
    return {
        "bifurcation_frequency_hz": np.array([b.omega / HZ for b in own]),
        "bifurcation_frequency_error_hz": np.array([b.omega_error / HZ for b in own]),
        "bifurcation_amplitude": np.array(
            [problem.amplitude_of(b.omega, b.point.coefficients, output) for b in own]
        ),
        "bifurcation_kind": texts(b.kind for b in own),
        "bifurcation_multiplier": np.array([[b.multiplier.real, b.multiplier.imag] for b in own]).reshape(-1, 2),
        "bifurcation_multiplier_error": np.array([b.multiplier_error for b in own]),
        "bifurcation_certain": np.array([int(b.certain) for b in own], dtype=np.int64),
        "bifurcation_outside": np.array([b.after for b in own], dtype=np.int64),
        "bifurcation_sentence": texts(b.sentence for b in own),
        "bifurcations_limits": "; ".join(limits(question, found)),
        "motion_stability": np.array([_of_point(s) for s in known], dtype=np.int64),
        "side_branch_frequency_hz": np.array([b.omega / HZ for b, _ in sides]),
        "side_branch_periods": np.array([s.periods for _, s in sides], dtype=np.int64),
        "side_branch_sentence": texts(f"from the {b.kind} at {b.omega / HZ:.6g} Hz: {s.sentence}" for b, s in sides),
        "side_point_frequency_hz": np.array([s.periods * p.omega / HZ for _, s, p in points]),
        "side_point_branch": np.array([n for n, _, _ in points], dtype=np.int64),
        "side_point_amplitude": np.array([s.amplitude(p, output) for _, s, p in points]),
        "side_point_subharmonic": np.array([s.subharmonic(p, output) for _, s, p in points]),
        "side_point_localisation": np.array([s.localisation(p) for _, s, p in points]),
    }  # fmt: skip


def limits(question: Question, found: Bifurcations) -> tuple[str, ...]:
    """Return what was not looked at, and what looking took."""
    why = unexaminable(question) if question.bifurcations != "folds" else ""
    alone = [f"folds alone were looked for: {why}"] * bool(why)
    followed_alone = [b for b in found.found if b.kind in LEAVES][MOST_FOLLOWED:]
    more = [f"branches of {len(followed_alone)} more bifurcations were not followed"] * bool(
        followed_alone and question.bifurcations == "branches"
    )
    return (*found.none_met, *alone, *found.limits, *more)


def bifurcations_line(question: Question) -> tuple[str, ...]:
    """Return what ``stickslip check`` says of the search for bifurcations."""
    if question.bifurcations == "off":
        return ()
    why = unexaminable(question)
    if question.bifurcations == "folds" or why:
        because = f" ({why})" if why and question.bifurcations != "folds" else ""
        return (f"bifurcations: folds alone{because}, a few solutions each",)
    each = examination_work(question.model.system) / FLOPS
    sides = (
        f"; branches of at most {POINTS} points from at most {MOST_FOLLOWED} of them"
        if question.bifurcations == "branches"
        else ""
    )
    return (
        f"bifurcations: multipliers along the branch, of at most {MOST} motions a case, about {each:.1g} s each{sides}",
    )


def _of_point(found: Stability | None) -> int:
    return NOT_EXAMINED if found is None else BY_VERDICT[found.verdict]
