"""Search for motions that a sweep misses, with their basins of attraction: the analysis ``all_motions``."""

from collections.abc import Iterator, Sequence
from functools import partial

from stickslip.analyses.all_motions.problem import Question, question_of
from stickslip.analyses.all_motions.records import FOUND, FoundMotions, answer, found_motions
from stickslip.analyses.all_motions.table import AllMotionsTable
from stickslip.analyses.all_motions.verdicts import case_verdicts, tables
from stickslip.analyses.columns import of_answers
from stickslip.assembly.model import Model
from stickslip.response.all_motions.found import Stage, gathered
from stickslip.response.all_motions.search import PERIODS_OF_A_START, search_seconds, search_stages
from stickslip.study.analysis import Analysis, Case, Notes, of_tables
from stickslip.study.store.archive import flat
from stickslip.study.store.progress import LOG, advance
from stickslip.units import HZ


def _inputs(case: Case, model: Model) -> Question:
    """Return the problem of a search; refuse a case that cannot be searched."""
    question = question_of(case, model)
    LOG.info(f"all_motions: {_said(question)}")
    return question


def _solve(inputs: Question, done: Sequence[Stage], notes: Notes) -> Iterator[Stage]:
    """Yield the missing stages."""
    if notes.get(FOUND) is not None:
        return
    output = inputs.model.output_labels[0]
    notes.put("model", dict(inputs.facts) | {"output": output})
    problem, stages = inputs.problem, list(done)
    most = 3 * len(inputs.search.places)
    for stage in search_stages(problem, inputs.search, done):
        stages.append(stage)
        over = sum(s.kind != "branch" for s in stages)
        advance(0.95 * min(over / most, 1.0), _told(stage, inputs))
        yield stage
    found = gathered(problem, stages, inputs.search)
    notes.put(FOUND, flat(found_motions(found, inputs.search.solves, output)))


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Describe the search, and its estimated time."""
    question = question_of(case, model)
    seconds = search_seconds(question.problem, question.search)
    return (
        f"all_motions: {_said(question)}",
        f"all_motions: about {seconds:.2g} s for these, where a start settles in {PERIODS_OF_A_START} periods; branches that are found take more",
    )


def _said(question: Question) -> str:
    search = question.search
    return (
        f"{len(search.places)} frequencies searched by deflation and {search.starts} starts in time each, "
        f"{search.solves} solves at most; {search.harmonics} harmonics"
    )


def _told(stage: Stage, inputs: Question) -> str:
    if stage.kind == "branch":
        how = {"sweep": "the sweep", "deflation": "a branch found by deflation", "time": "a branch found in time"}
        return f"{how[stage.origin]}: {stage.omega.size} points; {stage.end}"
    hertz = inputs.search.places[stage.place] / HZ
    told = {
        "searched": f"{stage.tries} deflated solves",
        "starts": f"{stage.tries} starts in time",
        "motions": f"{stage.omega.size} motions",
    }
    return f"{hertz:.6g} Hz: {told[stage.kind]}{', ' * bool(stage.end)}{stage.end}"


ALL_MOTIONS = Analysis(
    name="all_motions",
    table=AllMotionsTable,
    record=Stage,
    key=of_tables("all_motions", "solver"),
    inputs=_inputs,
    solve=_solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts),
    check=_check,
    summary=tables,
    shared=("solver",),
    answers=(FoundMotions,),
)
