"""Motions with two frequencies: two loads, or a forced motion and a self-excited second tone."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from stickslip.analyses.columns import of_answers
from stickslip.analyses.forced_response.stability.examination import too_long
from stickslip.analyses.quasi_periodic.problem import NAME, Question, hertz, question_of
from stickslip.analyses.quasi_periodic.records import NOT_FOUND, QuasiPeriodic, TwoFrequencies, answer
from stickslip.analyses.quasi_periodic.table import QuasiPeriodicTable
from stickslip.analyses.quasi_periodic.verdicts import case_verdicts, tables
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.assembly.model import Model
from stickslip.errors import StickslipError
from stickslip.harmonic.two_frequency import Indices, TorusPath
from stickslip.response.quasi_periodic.in_time import second_tone_in_time, two_loads_in_time
from stickslip.response.quasi_periodic.problem import Solving, TorusMotion, TwoTones, envelope, farthest, with_enough
from stickslip.response.quasi_periodic.tone import growing_tones, solve_free, swept, tone_beside
from stickslip.study.analysis import Analysis, Case, Notes, of_tables
from stickslip.study.store.progress import LOG, advance
from stickslip.units import HZ, millimetres_between

PHASES = 96
FAILED = (StickslipError, FloatingPointError, np.linalg.LinAlgError)


def solve(question: Question, done: Sequence[TwoFrequencies], notes: Notes) -> Iterator[TwoFrequencies]:
    """Yield the missing motions."""
    own = {"output": list(question.model.output_labels)}
    asked = {"accuracy": 0.01 * question.asked.accuracy_percent}
    notes.put("model", dict(question.facts) | own | asked)
    found = list(done)
    wanted = question.asked.first_hz
    for i, hz in enumerate(wanted):
        if i < len(done):
            continue
        one = at_frequency(question, HZ * hz, found[-1] if found else None)
        said = _told(one)
        label = f"{question.label}: " if question.label else ""
        LOG.info(f"{label}{said}")
        advance((i + 1) / len(wanted), hertz(one.first))
        found.append(one)
        yield one


def at_frequency(question: Question, omega: float, before: TwoFrequencies | None) -> TwoFrequencies:
    """Return the motion at a first frequency, rad/s; `before` is the motion at another one, the initial guess."""
    try:
        problem, motion, kind, why, unknown = _found(question, omega, before)
        if motion is None or not motion.converged:
            return _nothing(question, omega, why)
        in_time = _in_time(question, problem, motion, kind) if question.in_time else None
    except FAILED as error:
        return _nothing(question, omega, str(error))
    outputs = np.asarray(question.model.system.outputs)
    shown = envelope(motion, outputs, PHASES)
    alone = kind == "no second tone"
    none = np.full(outputs.size, np.nan)
    largest, least, off = (none, none, np.nan) if in_time is None else in_time
    seen = motion.coefficients[:, outputs]
    return TwoFrequencies(
        first=motion.omegas[0],
        second=np.nan if alone else motion.omegas[1],
        kind=kind,
        why=why,
        unknown=unknown,
        combined=len(motion.indices) - 1,
        left_out=motion.left_out,
        slip=motion.slip,
        newton_iterations=motion.iterations,
        largest=shown.largest,
        least=shown.least,
        rms=shown.rms,
        extreme=farthest(motion, outputs),
        envelope=shown.amplitude[:, 0],
        indices=np.array(motion.indices, dtype=np.int64),
        amplitude=np.hypot(seen.real, seen.imag),
        time_largest=largest,
        time_least=least,
        time_off=off,
        unknowns=_parts(problem.balance.coefficients(motion.x)),
    )


def _in_time(
    question: Question, problem: TwoTones, motion: TorusMotion, kind: str
) -> tuple[FloatArray, FloatArray, float] | None:
    """Return largest and smallest amplitude (outputs,) in time, and the difference from the balance; None without a result.

    The difference is NaN for a self-excited tone. One tone alone and a failed integration have no result.
    """
    try:
        if kind == "two loads":
            return two_loads_in_time(problem, motion, question.first, question.second)
        if kind == "second tone":
            found = second_tone_in_time(problem, motion, question.first)
            return found.largest, found.least, np.nan
    except FAILED as error:
        LOG.warning(f"{NAME}: {hertz(motion.omegas[0])}: not integrated in time: {error}")
    return None


def _found(
    question: Question, omega: float, before: TwoFrequencies | None
) -> tuple[TwoTones, TorusMotion | None, str, str, str]:
    """Return problem, motion, kind of the second frequency and the reason, and what is unknown without a second tone."""
    problem = question.problem()
    if question.driven:
        omegas = omega, question.second_frequency(omega)
        kind, why = "two loads", f"loads act with {hertz(omegas[0])} and {hertz(omegas[1])}"

        def driven(own: TwoTones, x: FloatArray | None, path: TorusPath | None) -> TorusMotion:
            return own.solve(omegas, x, path)

        motion = None
        if before is not None and before.kind == kind:
            problem, x = _begun(problem, before)
            motion = driven(problem, x, None)
        if motion is None or not motion.converged:
            problem = question.problem()
            motion = driven(problem, None, None)
        if motion.converged:
            problem, motion = _enough(question, problem, motion, driven)
        return problem, motion, kind, why, ""
    return _of_tone(question, problem, omega, before)


def _of_tone(
    question: Question, problem: TwoTones, omega: float, before: TwoFrequencies | None
) -> tuple[TwoTones, TorusMotion | None, str, str, str]:
    kind = "second tone"
    if before is not None and before.kind == kind:
        near, x = _begun(problem, before)
        motion = solve_free(near, x, (omega, before.second))
        if motion.converged:
            enough = _enough(question, near, motion, _free(motion))
            return *enough, kind, "followed from the frequency before", ""
    guesses, unknown = _guesses(question, problem, omega)
    starts = [] if question.waves is not None else swept(problem, question.first, omega)
    found = tone_beside(problem, omega, guesses, starts)
    if found.motion is not None:
        enough = _enough(question, problem, found.motion, _free(found.motion))
        why = f"it grows out of the forced motion near {hertz(found.near)} with a damping ratio of {100 * found.ratio:.3g} %"
        return *enough, kind, why, ""
    if not found.forced.converged:
        return problem, None, kind, "the forced motion was not found", ""
    alone = problem.with_indices(found.forced.indices)
    if np.isnan(found.ratio) and guesses:
        return problem, None, kind, "no second tone converged near " + ", ".join(hertz(g) for g in guesses[:3]), ""
    if found.ratio < 0.0:
        return (
            problem,
            None,
            kind,
            f"a tone near {hertz(found.near)} grows, and friction holds it at no amplitude that was found",
            "",
        )
    why = (
        "nothing was found that grows"
        if not guesses
        else f"a second tone near {hertz(found.near)} decays, damping ratio {100 * found.ratio:.3g} %"
    )
    return alone, replace(found.forced, left_out=np.nan), "no second tone", why, unknown


def _guesses(question: Question, problem: TwoTones, omega: float) -> tuple[list[float], str]:
    """Return frequencies near which a second tone is sought, rad/s, and why more tones may grow; empty if none can."""
    if question.asked.second_hz is not None:
        return [HZ * question.asked.second_hz], ""
    wave = None if question.waves is None else question.waves[1] % question.model.sectors
    found = [m.omega for k, m in question.growing() if wave is None or k == wave]
    if question.waves is not None:
        return found, "of a tuned wheel multipliers are not looked at"
    if why := too_long(question.model.system, forced=True):
        return found, why
    more, unknown = growing_tones(problem, question.first, omega)
    return found + more, unknown


def _enough(
    question: Question, problem: TwoTones, motion: TorusMotion, solving: Solving
) -> tuple[TwoTones, TorusMotion]:
    asked = question.asked
    return with_enough(problem, motion, asked.most_harmonics, 0.01 * asked.accuracy_percent, solving)


def _free(motion: TorusMotion) -> Solving:
    return lambda own, x, _path: solve_free(own, x, motion.omegas)


def _begun(problem: TwoTones, before: TwoFrequencies) -> tuple[TwoTones, FloatArray]:
    """Return the problem with the combined frequencies of another motion, and the unknowns of this motion."""
    indices: Indices = tuple((int(j), int(k)) for j, k in before.indices)
    own = problem.with_indices(indices)
    return own, own.balance.unknowns(before.unknowns[..., 0] + 1j * before.unknowns[..., 1])


def _parts(rows: ComplexArray) -> FloatArray:
    return np.stack([rows.real, rows.imag], axis=-1)


def _nothing(question: Question, omega: float, why: str) -> TwoFrequencies:
    n = len(question.model.system.outputs)
    none = np.full(n, np.nan)
    return TwoFrequencies(
        first=omega,
        second=np.nan,
        kind=NOT_FOUND,
        why=why,
        unknown="",
        combined=0,
        left_out=np.nan,
        slip=np.nan,
        newton_iterations=0,
        largest=none,
        least=none,
        rms=none,
        extreme=none,
        envelope=np.full(PHASES, np.nan),
        indices=np.zeros((0, 2), dtype=np.int64),
        amplitude=np.zeros((0, n)),
        time_largest=none,
        time_least=none,
        time_off=np.nan,
    )


def _told(one: TwoFrequencies) -> str:
    head = f"{NAME}: {hertz(one.first)}"
    if not one.solved:
        return f"{head}: no motion found ({one.why})"
    if one.kind == "no second tone":
        return f"{head}: no second tone ({one.why})"
    return (
        f"{head} and {hertz(one.second)} ({one.kind}): amplitude {millimetres_between(one.least[0], one.largest[0])}, "
        f"{one.combined} combined frequencies, {100 * one.left_out:.2g} % left out"
    )


def _lost(found: QuasiPeriodic) -> int:
    """Return the number of frequencies without a motion."""
    return sum(not point.solved for point in found.points)


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return lines on the second frequency and the number of unknowns."""
    question = question_of(case, model)
    first = HZ * question.asked.first_hz[0]
    size = question.problem().balance.size
    if question.driven:
        what = f"loads with {hertz(first)} and {hertz(question.second_frequency(first))}"
    else:
        near = [hertz(m.omega) for _, m in question.growing()[:3]]
        what = f"a second tone, looked for near {', '.join(near) or 'what multipliers say'}"
    return (f"{NAME}: {what}; {size} unknowns at first",)


QUASI_PERIODIC = Analysis(
    name=NAME,
    table=QuasiPeriodicTable,
    record=TwoFrequencies,
    key=of_tables(NAME),
    inputs=question_of,
    solve=solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts, lost=_lost),
    check=_check,
    summary=tables,
    answers=(QuasiPeriodic,),
)
