"""Bifurcations of a response and their side branches, stored as notes of a job."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.columns import (
    MOTION,
    BifurcationRows,
    BifurcationSearch,
    PointStability,
    SideBranches,
    SidePoints,
    stored,
)
from stickslip.analyses.forced_response.records.values import Values, texts
from stickslip.analyses.forced_response.stability.examination import FLOPS, by_hill, examination_work, hill_work
from stickslip.analyses.forced_response.stability.stable import Examined, why_not
from stickslip.analyses.forced_response.stability.stable_words import BASES
from stickslip.analyses.forced_response.verdicts.curve import branch_length
from stickslip.errors import StickslipError
from stickslip.response.bifurcations.found import Bifurcation, Bifurcations
from stickslip.response.bifurcations.locate import MAX_EXAMINED_MOTIONS, bifurcations
from stickslip.response.bifurcations.side_branch import POINTS, SideBranch, side_branches
from stickslip.response.forced.collected import Response
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability import Stability, hill_stability, stability
from stickslip.response.stability.found import Floquet
from stickslip.study.analysis import Notes, Pieces
from stickslip.units import HZ

COUNTS = ("resting", "grazing", "transitions")  # counts stored with a stability
LEAVES = ("period doubling", "branch point")  # kinds from which a periodic branch is followed
MOST_FOLLOWED = 6  # bifurcations of a case from which branches are followed
MIN_WHEEL_MOTIONS = 40  # motions of a wheel that Hill's method examines, however long it takes
HILL_SECONDS = 1800.0  # estimated seconds within which it examines more
NOT_FOLLOWED = "what leaves there is not followed: every sector of so large a wheel would count for itself"


@dataclass(eq=False)
class Remembered:
    """Multipliers in the order of requests; after an interruption they and pieces of Hill's method come from the notes."""

    notes: Notes
    hill: bool = False
    count: int = 0

    def __call__(self, problem: ForcedProblem, point: ForcedPoint) -> Stability:
        """Return the stability of a motion."""
        self.count += 1
        name = f"bifurcations.{self.count}"
        known = self.notes.get(name)
        if known is None or known["omega"] != point.omega:
            pieces = Pieces(self.notes, name)
            found = _by_hill(problem, point, pieces) if self.hill else stability(problem, point)
            values = found.floquet.multipliers
            known = {
                "omega": point.omega,
                "re": values.real,
                "im": values.imag,
                "errors": found.errors,
                "moduli": found.errors if found.moduli is None else found.moduli,
            }
            self.notes.put(name, known | {word: getattr(found, word) for word in COUNTS})
            pieces.give_up()
            return found
        floquet = Floquet(np.asarray(known["re"]) + 1j * np.asarray(known["im"]))
        moduli = np.asarray(known.get("moduli", known["errors"]))
        resting, grazing, transitions = (int(known[w]) for w in COUNTS)
        errors = np.asarray(known["errors"])
        return Stability(floquet, errors, resting, grazing, transitions, moduli)


def located(question: Question, response: Response, notes: Notes) -> Bifurcations:
    """Return the bifurcations of the requested kinds along a response; only folds if no multipliers are available."""
    every = response.accepted
    along = branch_length(np.array([a.point.stage == "peak" for a in every], dtype=float))
    branch = [a.point for a in every[:along]]
    if question.bifurcations == "folds" or why_not(question):
        return bifurcations(question.problem, branch, examine=None)
    examine = Remembered(notes, by_hill(question.model.system))
    try:
        return bifurcations(question.problem, branch, examine=examine, most=_most(question))
    except StickslipError as error:
        found = bifurcations(question.problem, branch, examine=None)
        omega = [p.omega for p in branch]
        return replace(found, unseen=(*found.unseen, (min(omega), max(omega), f"{error}")))


def _by_hill(problem: ForcedProblem, point: ForcedPoint, pieces: Pieces) -> Stability:
    """Return the multipliers of a motion by Hill's method; none if it found fewer than it counted."""
    found = hill_stability(problem, point, pieces.keep)
    if found.missing == 0:
        return found.stability
    none = np.array([np.nan + 0j])
    return replace(found.stability, floquet=Floquet(none), errors=np.array([np.inf]))


def _most(question: Question) -> int:
    """Return the largest number of motions examined in a case."""
    if not by_hill(question.model.system):
        return MAX_EXAMINED_MOTIONS
    seconds = hill_work(question.model.system) / FLOPS
    return int(np.clip(HILL_SECONDS / seconds, MIN_WHEEL_MOTIONS, MAX_EXAMINED_MOTIONS))


def followed(question: Question, found: Bifurcations) -> list[tuple[Bifurcation, SideBranch]]:
    """Return the side branches of the response, each with its bifurcation."""
    if question.bifurcations != "branches":
        return []
    own = [b for b in found.found if b.kind in LEAVES][: _most_followed(question)]
    return [(b, side) for b in own for side in side_branches(question.problem, b)]


def _most_followed(question: Question) -> int:
    """Return the largest number of bifurcations whose branches are followed; none on a wheel too large for its multipliers."""
    system = question.model.system
    return 0 if system.structure.wheel is not None and by_hill(system) else MOST_FOLLOWED


def of_bifurcations(
    question: Question,
    response: Response,
    found: Bifurcations,
    sides: Sequence[tuple[Bifurcation, SideBranch]],
    examined: Sequence[Examined] = (),
) -> Values:
    """Return the variables of bifurcations and side branches, and the stability of points known from both examination and branch."""
    own, problem = found.found, question.problem
    points = [(n, side, p) for n, (_, side) in enumerate(sides) for p in side.points]
    output = response.output
    known = [*found.stabilities, *([None] * (len(response.accepted) - len(found.stabilities)))]
    rows = BifurcationRows(
        bifurcation_frequency_hz=np.array([b.omega / HZ for b in own]),
        bifurcation_frequency_error_hz=np.array([b.omega_error / HZ for b in own]),
        bifurcation_amplitude=np.array([problem.amplitude_of(b.omega, b.point.coefficients, output) for b in own]),
        bifurcation_kind=texts(b.kind for b in own),
        bifurcation_multiplier=np.array([[b.multiplier.real, b.multiplier.imag] for b in own]).reshape(-1, 2),
        bifurcation_multiplier_error=np.array([b.multiplier_error for b in own]),
        bifurcation_certain=np.array([int(b.certain) for b in own], dtype=np.int64),
        bifurcation_outside=np.array([b.after for b in own], dtype=np.int64),
        bifurcation_sentence=texts(b.sentence for b in own),
    )
    branches = SideBranches(
        side_branch_frequency_hz=np.array([b.omega / HZ for b, _ in sides]),
        side_branch_periods=np.array([s.periods for _, s in sides], dtype=np.int64),
        side_branch_sentence=texts(f"from the {b.kind} at {b.omega / HZ:.6g} Hz: {s.sentence}" for b, s in sides),
    )
    beside = SidePoints(
        side_point_frequency_hz=np.array([s.periods * p.omega / HZ for _, s, p in points]),
        side_point_branch=np.array([n for n, _, _ in points], dtype=np.int64),
        side_point_amplitude=np.array([s.amplitude(p, output) for _, s, p in points]),
        side_point_subharmonic=np.array([s.subharmonic(p, output) for _, s, p in points]),
        side_point_localisation=np.array([s.localisation(p) for _, s, p in points]),
    )
    search = BifurcationSearch(bifurcations_limits="; ".join(limits(question, found)))
    every = stored(search) | stored(rows) | stored(branches) | stored(beside)
    return every | _of_motions(known, examined)


def limits(question: Question, found: Bifurcations) -> tuple[str, ...]:
    """Return the limits of the search for bifurcations: kinds not sought, method, branches not followed."""
    why = why_not(question) if question.bifurcations != "folds" else ""
    alone = [f"folds alone were looked for: {why}"] * bool(why)
    hill = by_hill(question.model.system)
    way = ["they come from Hill's method"] * bool(hill and found.examined)
    count = len([b for b in found.found if b.kind in LEAVES][_most_followed(question) :])
    more = [f"branches of {count} bifurcations were not followed"] * bool(count and question.bifurcations == "branches")
    return (*found.none_met, *alone, *found.limits, *way, *more)


def bifurcations_line(question: Question) -> tuple[str, ...]:
    """Return the line of ``stickslip check`` about the search for bifurcations."""
    if question.bifurcations == "off":
        return ()
    why, system = why_not(question), question.model.system
    if question.bifurcations == "folds" or why:
        because = f" ({why})" if why and question.bifurcations != "folds" else ""
        return (f"bifurcations: folds alone{because}, a few solutions each",)
    hill = by_hill(system)
    each = (
        f"up to {max(1.0, hill_work(system) / FLOPS):.0f} s each by Hill's method"
        if hill
        else f"about {examination_work(system) / FLOPS:.1g} s each"
    )
    branches = question.bifurcations == "branches"
    sides = f"; branches of at most {POINTS} points from at most {MOST_FOLLOWED} of them"
    sides = sides if _most_followed(question) else f"; {NOT_FOLLOWED}"
    return (
        f"bifurcations: multipliers along the branch, of at most {_most(question)} motions a case, {each}{sides * branches}",
    )


def _of_motions(known: Sequence[Stability | None], examined: Sequence[Examined]) -> Values:
    """Return the stability of each point: by an examination, by multipliers along the branch, or inferred from others."""
    word = np.full(len(known), MOTION["not examined"], dtype=np.int64)
    basis = np.zeros(len(known), dtype=np.int64)
    own = {e.position: e for e in examined}
    for i, found in enumerate(known):
        if found is not None:
            word[i], basis[i] = MOTION[found.verdict], BASES.index("examined")
        if i in own and (found is None or own[i].motion or own[i].basis == "examined"):
            word[i], basis[i] = MOTION[own[i].verdict], BASES.index(own[i].basis)
    return stored(PointStability(motion_stability=word, motion_stability_basis=basis))
