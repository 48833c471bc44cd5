"""Limit cycles: unstable waves bounded by friction, the stability of the motion, and which of several waves dominates in time."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from stickslip.analyses.columns import of_answers
from stickslip.analyses.forced_response.problem import MOST_IN_TIME
from stickslip.analyses.forced_response.stability.examination import too_long
from stickslip.analyses.forced_response.stability.in_time import KICK, disturbed
from stickslip.analyses.limit_cycle.problem import IN_TIME, Question, question_of
from stickslip.analyses.limit_cycle.records import Cycle, CycleBranch, LimitCycles, answer
from stickslip.analyses.limit_cycle.table import LimitCycleTable
from stickslip.analyses.limit_cycle.verdicts import case_verdicts, tables
from stickslip.analyses.vibrating import as_wave, coordinate, known_coordinates, mode_name, mode_told
from stickslip.arrays import ComplexArray
from stickslip.assembly.model import Model
from stickslip.errors import StickslipError
from stickslip.reduction.waves import NO_WAVE
from stickslip.response.self_excited.curve import AmplitudePoint, damping_over_amplitude, slip_amplitude
from stickslip.response.self_excited.cycles import (
    CycleStability,
    LimitCycle,
    crossings,
    cycle_stability,
    limit_cycles,
    with_extremes,
)
from stickslip.response.self_excited.in_time import Marched, all_in_time, march_periods, mixed_start, wave_history
from stickslip.response.self_excited.modes import StuckMode
from stickslip.response.self_excited.problem import SelfExcited, self_excited_motions
from stickslip.response.time.sectors import whole_wheel
from stickslip.response.time.start import TransientStart, start_from_harmonics
from stickslip.study.analysis import Analysis, Case, Notes, of_tables
from stickslip.study.store.progress import LOG, advance
from stickslip.units import HZ, millimetres

NOT_EXAMINED = "not examined"
BEGINS = 0.5  # first amplitude of the curve over the amplitude at which slip begins
ENDS = 300.0  # last amplitude, in the same way
STEPS = 512  # time steps of a period beside a limit cycle
FEW_STEPS = 256  # time steps of a period in the competition of waves, which takes hundreds of periods
SETTLED = 1e-7  # relative change of the motion in a period, below which it has settled
SHARE = 0.3  # initial amplitude of a competing wave, as a share of its attracting cycle
MODEL, LINEAR, COORDINATES = "model", "linear", "coordinates"  # names of notes


def solve(question: Question, done: Sequence[CycleBranch], notes: Notes) -> Iterator[CycleBranch]:
    """Yield the branches of unfinished modes."""
    modes = {wave: question.modes(wave) for wave in question.waves}
    notes.put(MODEL, dict(question.facts) | {"output": question.model.output_labels[0]})
    notes.put(LINEAR, _linear(modes))
    notes.put(COORDINATES, known_coordinates(question.model))
    tasks = [(w, m) for w, own in modes.items() for m in question.followed(own)]
    found = list(done)
    for i, (wave, mode) in enumerate(tasks):
        if i < len(done):
            continue
        branch = follow_mode(question, wave, mode)
        name = mode_told(question.label, wave, mode)
        LOG.info(f"{name}: {_told(branch)}")
        advance((i + 1) / len(tasks), name)
        found.append(branch)
        yield branch
    if question.in_time:
        for i, branch in enumerate(found):
            name = f"in_time.{i}"
            if notes.get(name) is None:
                notes.put(name, settle_cycles(question, branch))
        if notes.get("competition") is None:
            notes.put("competition", compete(question, found))


def follow_mode(question: Question, wave: int, mode: StuckMode) -> CycleBranch:
    """Return the branch of a mode."""
    system = as_wave(question.model.system, wave)
    try:
        problem = self_excited_motions(system, question.model.load, mode, coordinate(system), question.discretisation)
        slips = slip_amplitude(problem)
    except StickslipError as error:
        return _without(wave, mode, str(error))
    given = question.asked.amplitude_mm
    span = (BEGINS * slips, ENDS * slips)
    if given is not None:
        span = (1e-3 * given[0], 1e-3 * given[1])
    points = damping_over_amplitude(problem, span, question.asked.points)
    solutions = with_extremes(problem, points)
    cycles = limit_cycles(
        problem,
        solutions,
        most_harmonics=question.asked.most_harmonics,
        tolerance=0.01 * question.asked.accuracy_percent,
    )
    every = sorted([p for p in points if not p.converged], key=lambda p: p.amplitude)
    branch = _branch(wave, problem, slips, [*solutions, *every], cycles)
    return replace(branch, lost_cycles=max(len(crossings(solutions)) - len(cycles), 0))


def _branch(
    wave: int, problem: SelfExcited, slips: float, points: Sequence[AmplitudePoint], cycles: Sequence[LimitCycle]
) -> CycleBranch:
    known = [p for p in points if p.converged]
    top = max(known, key=lambda p: p.level, default=None)
    return CycleBranch(
        wave_number=wave,
        mode=problem.mode.number,
        omega=problem.mode.omega,
        ratio=problem.mode.ratio,
        slip_amplitude=slips,
        largest_damping_ratio=np.nan if top is None else top.level,
        largest_damping_amplitude=np.nan if top is None else top.amplitude,
        amplitude=np.array([p.amplitude for p in points]),
        motion_omega=np.array([p.omega if p.converged else np.nan for p in points]),
        damping_ratio=np.array([p.level if p.converged else np.nan for p in points]),
        cycles=tuple(_cycle(problem, cycle) for cycle in cycles),
    )


def _cycle(problem: SelfExcited, cycle: LimitCycle) -> Cycle:
    """Return the record of a limit cycle, its stability examined."""
    own = problem.with_order(cycle.order)
    examined = _examined(own, cycle)
    known = examined if isinstance(examined, CycleStability) else None
    full = own.balance.linear.recover(cycle.omega, cycle.coefficients)
    stability = None if known is None else known.stability
    grows = None if known is None else known.wave
    return Cycle(
        amplitude=cycle.amplitude,
        omega=cycle.omega,
        slope=cycle.slope,
        harmonics=cycle.order,
        change=cycle.change,
        enough=cycle.enough,
        stability=NOT_EXAMINED if stability is None else stability.verdict,
        reason=str(examined) if stability is None else stability.reason,
        multiplier=_number(None if stability is None else stability.multiplier),
        multiplier_error=_number(None if stability is None else stability.multiplier_error),
        along=np.nan if known is None else abs(known.along - 1.0),
        growing_wave=NO_WAVE if grows is None else grows.wave,
        growing_omega=np.nan if grows is None else grows.omega,
        coefficients=np.stack([full.real, full.imag], axis=-1),
    )


def _number(value: float | None) -> float:
    return np.nan if value is None else value


def _examined(problem: SelfExcited, cycle: LimitCycle) -> CycleStability | str:
    """Return the stability of a cycle, or the reason why it is not examined."""
    why = too_long(problem.system, forced=False)
    if why:
        return why
    try:
        return cycle_stability(problem, cycle)
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError) as error:
        return str(error)


def _without(wave: int, mode: StuckMode, problem: str) -> CycleBranch:
    none = np.zeros(0)
    return CycleBranch(
        wave_number=wave,
        mode=mode.number,
        omega=mode.omega,
        ratio=mode.ratio,
        slip_amplitude=np.nan,
        largest_damping_ratio=np.nan,
        largest_damping_amplitude=np.nan,
        problem=problem,
        amplitude=none,
        motion_omega=none,
        damping_ratio=none,
    )


def _linear(modes: dict[int, list[StuckMode]]) -> dict[str, object]:
    """Return frequencies (Hz) and damping ratios of all examined modes; NaN if a wave has fewer."""
    most = max(len(own) for own in modes.values())
    hertz, ratio = np.full((2, len(modes), most), np.nan)
    for i, own in enumerate(modes.values()):
        hertz[i, : len(own)] = [m.omega / HZ for m in own]
        ratio[i, : len(own)] = [m.ratio for m in own]
    return {"wave": np.array(list(modes), dtype=np.int64), "hertz": hertz, "ratio": ratio}


def _told(branch: CycleBranch) -> str:
    if branch.problem:
        return branch.problem
    each = [f"{millimetres(c.amplitude, 5)} at {c.omega / HZ:.4f} Hz ({c.stability})" for c in branch.cycles]
    return f"limit cycles: {', '.join(each) or 'none'}"


def _lost(found: LimitCycles) -> int:
    """Return the number of amplitudes without a motion."""
    return sum(int(np.count_nonzero(np.isfinite(b.amplitude) & ~np.isfinite(b.damping_ratio))) for b in found.branches)


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return lines on the growing modes, and on stability if it cannot be examined."""
    question = question_of(case, model)
    lines = []
    for wave in question.waves:
        for mode in question.followed(question.modes(wave)):
            name = mode_name(wave, mode.number)
            lines.append(f"limit_cycle: {name}, damping ratio {100 * mode.ratio:+.3g} %")
    why = too_long(question.model.system, forced=False)
    stability = f"limit_cycle: stability not examined, {why}" if why else ""
    none = "limit_cycle: no mode grows with contacts stuck"
    return tuple(line for line in (*(lines or [none]), stability) if line)


def settle_cycles(question: Question, branch: CycleBranch) -> dict[str, Any]:
    """Return amplitude (m) and frequency (rad/s) in time after a start near each attracting cycle; NaN for other cycles."""
    amplitude, omega = np.full((2, len(branch.cycles)), np.nan)
    said = ""
    for i, cycle in enumerate(branch.cycles):
        if not cycle.attracting:
            continue
        try:
            marched = _from_cycle(question, branch, cycle)
        except StickslipError as error:
            said = str(error)
            continue
        if not marched.overflowed:
            amplitude[i], omega[i] = marched.amplitude[0], marched.frequency[0]
        LOG.info(
            f"time integration: {millimetres(amplitude[i], 5)} at {omega[i] / HZ:.4f} Hz where the balance has "
            f"{millimetres(cycle.amplitude, 5)} at {cycle.omega / HZ:.4f} Hz{_unconfirmed(cycle, marched)}"
        )
    return {"amplitude": amplitude, "omega": omega, "said": said}


def _unconfirmed(cycle: Cycle, marched: Marched) -> str:
    """Return the remark that time integration near an unstable cycle confirms nothing; empty for other cycles."""
    if cycle.stability != "unstable":
        return ""
    return (
        f"; that confirms nothing: the cycle is unstable, and {len(marched.first)} periods may be too few to leave it"
    )


def compete(question: Question, branches: Sequence[CycleBranch]) -> dict[str, Any]:
    """Return the result of a mixed start of all waves of a wheel that are unstable or have an attracting cycle."""
    there = [b for b in branches if b.wave_number != NO_WAVE and (b.ratio < 0.0 or b.attracting)]
    own = {"waves": np.array([b.wave_number for b in there], dtype=np.int64)}
    nothing = {"time": np.zeros(0), "amplitude": np.zeros((0, 0)), "sentence": "", "kept": "[]", "left_out": ""}
    if len({b.wave_number for b in there}) < 2:
        return own | nothing
    try:
        system = as_wave(question.model.system, there[0].wave_number)
        structure, contacts, load, outputs = all_in_time(system, question.model.load, question.dof, MOST_IN_TIME)
        motions = _beginnings(question, there)
    except StickslipError as error:
        return own | nothing | {"left_out": str(error)}
    omega = motions[0][1]
    rest = np.zeros((2, structure.n), dtype=complex)
    like = start_from_harmonics(rest, omega, contacts.gap_operator, contacts.laws)
    start = _kicked(mixed_start(motions, like), motions)
    marched = march_periods(structure, contacts, load, omega, outputs, start, question.asked.periods, FEW_STEPS)
    history = wave_history(marched)
    if not history.time.size:
        return own | nothing | {"left_out": f"it grew beyond all numbers in {len(marched.first)} periods"}
    return own | {
        "time": history.time,
        "amplitude": history.amplitude,
        "sentence": history.sentence,
        "kept": json.dumps(list(history.waves)),
        "left_out": "",
    }


def _beginnings(question: Question, branches: Sequence[CycleBranch]) -> list[tuple[ComplexArray, float]]:
    """Return initial amplitudes (n,) of all sectors and frequencies, rad/s, of the waves: a share of their attracting cycle.

    A wave without an attracting cycle begins as its mode, at the amplitude at which it begins to slip. If it never slips,
    the smallest such amplitude of the other waves is taken.
    """
    slips = [b.slip_amplitude for b in branches if np.isfinite(b.slip_amplitude)]
    found = []
    for branch in branches:
        if branch.attracting:
            cycle = branch.attracting[0]
            found.append((SHARE * _motion(question, branch, cycle)[1], cycle.omega))
            continue
        if not slips:
            raise StickslipError("no wave has an amplitude from which on it slips")
        amplitude = branch.slip_amplitude if np.isfinite(branch.slip_amplitude) else min(slips)
        system = as_wave(question.model.system, branch.wave_number)
        mode = next(m for m in question.modes(branch.wave_number) if m.number == branch.mode)
        shape = amplitude / abs(mode.shape[coordinate(system)]) * mode.shape
        full = np.array([np.zeros_like(shape), shape])
        found.append((whole_wheel(system).spread(full)[1], mode.omega))
    return found


def _from_cycle(question: Question, branch: CycleBranch, cycle: Cycle) -> Marched:
    system = as_wave(question.model.system, branch.wave_number)
    structure, contacts, load, outputs = all_in_time(system, question.model.load, question.dof, MOST_IN_TIME)
    motion, omega = _motion(question, branch, cycle), cycle.omega
    start = start_from_harmonics(motion, omega, contacts.gap_operator, contacts.laws)
    start = _kicked(start, [(motion[1], omega)])
    return march_periods(
        structure, contacts, load, omega, outputs, start, question.asked.periods, STEPS, settles=SETTLED
    )


def _motion(question: Question, branch: CycleBranch, cycle: Cycle) -> ComplexArray:
    """Return the (H+1, n) amplitudes of a cycle; all sectors of a wheel are included."""
    full = cycle.coefficients[..., 0] + 1j * cycle.coefficients[..., 1]
    if branch.wave_number == NO_WAVE:
        return full
    return whole_wheel(as_wave(question.model.system, branch.wave_number)).spread(full)


def _kicked(start: TransientStart, motions: Sequence[tuple[ComplexArray, float]]) -> TransientStart:
    """Return a start whose velocities are disturbed, differently in each coordinate."""
    size = sum(omega * np.abs(motion) for motion, omega in motions)
    return disturbed(start, np.asarray(size), KICK)


LIMIT_CYCLE = Analysis(
    name="limit_cycle",
    table=LimitCycleTable,
    record=CycleBranch,
    key=of_tables("limit_cycle", "solver"),
    inputs=question_of,
    solve=solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts, lost=_lost),
    check=_check,
    summary=tables,
    shared=("solver",),
    answers=(LimitCycles,),
    checks=(IN_TIME,),
)
