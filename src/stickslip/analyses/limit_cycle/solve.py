"""Solves one mode of one wave: its damping over the amplitude, its limit cycles, and their stability."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from stickslip.analyses.forced_response.stability.examination import too_long
from stickslip.analyses.limit_cycle.problem import Question
from stickslip.analyses.limit_cycle.records import CycleBranch
from stickslip.analyses.limit_cycle.time import compete, settle_cycles
from stickslip.analyses.vibrating import as_wave, coordinate, known_coordinates
from stickslip.arrays import FloatArray
from stickslip.errors import StickslipError
from stickslip.reduction.waves import NO_WAVE
from stickslip.response.self_excited.curve import AmplitudePoint, damping_over_amplitude, slip_amplitude
from stickslip.response.self_excited.cycles import LimitCycle, crossings, limit_cycles, with_extremes
from stickslip.response.self_excited.modes import StuckMode
from stickslip.response.self_excited.problem import SelfExcited, self_excited_motions
from stickslip.response.self_excited.stable import CycleStability, cycle_stability
from stickslip.study.analysis import Notes
from stickslip.study.store.progress import LOG, advance
from stickslip.units import HZ, millimetres

NOT_EXAMINED = "not examined"
BEGINS = 0.5  # of the amplitude at which slip begins: where the curve begins
ENDS = 300.0  # times that amplitude: where it ends
MODEL, LINEAR, COORDINATES = "model", "linear", "coordinates"  # names of notes


def solve(question: Question, done: Sequence[CycleBranch], notes: Notes) -> Iterator[CycleBranch]:
    """Yield what is found of each mode that is followed and not done."""
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
        name = _named(question, wave, mode)
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
    """Return what is found of a mode."""
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
    return replace(branch, lost=max(len(crossings(solutions)) - len(cycles), 0))


def _branch(
    wave: int, problem: SelfExcited, slips: float, points: Sequence[AmplitudePoint], cycles: Sequence[LimitCycle]
) -> CycleBranch:
    mode = problem.mode
    known = [p for p in points if p.converged]
    top = max(known, key=lambda p: p.level, default=None)
    examined = [_examined(problem.with_order(c.order), c) for c in cycles]
    stable = [e.stability.verdict if isinstance(e, CycleStability) else NOT_EXAMINED for e in examined]
    reason = [e.stability.reason if isinstance(e, CycleStability) else e for e in examined]

    def of_each(function: object, missing: float) -> FloatArray:
        told = [function(e) if isinstance(e, CycleStability) else missing for e in examined]  # type: ignore[operator]
        return np.array([missing if v is None else v for v in told], dtype=float)

    return CycleBranch(
        wave,
        mode.number,
        mode.omega,
        mode.ratio,
        slips,
        np.array([p.amplitude for p in points]),
        np.array([p.omega if p.converged else np.nan for p in points]),
        np.array([p.level if p.converged else np.nan for p in points]),
        np.nan if top is None else top.level,
        np.nan if top is None else top.amplitude,
        np.array([c.amplitude for c in cycles]),
        np.array([c.omega for c in cycles]),
        np.array([c.slope for c in cycles]),
        np.array([c.order for c in cycles], dtype=np.int64),
        np.array([c.change for c in cycles]),
        np.array([c.enough for c in cycles], dtype=np.int64),
        _motions(problem, cycles),
        json.dumps(stable),
        json.dumps(reason),
        of_each(lambda e: e.stability.multiplier, np.nan),
        of_each(lambda e: e.stability.multiplier_error, np.nan),
        of_each(lambda e: abs(e.along - 1.0), np.nan),
        of_each(lambda e: None if e.wave is None else e.wave.wave, NO_WAVE).astype(np.int64),
        of_each(lambda e: None if e.wave is None else e.wave.omega, np.nan),
    )


def _motions(problem: SelfExcited, cycles: Sequence[LimitCycle]) -> FloatArray:
    """Return (cycles, most harmonics + 1, n, 2) the motions of all coordinates."""
    most = max((c.order for c in cycles), default=0)
    out = np.zeros((len(cycles), most + 1, problem.system.structure.n, 2))
    for own, cycle in zip(out, cycles, strict=True):
        linear = problem.with_order(cycle.order).balance.linear
        full = linear.recover(cycle.omega, cycle.coefficients)
        own[: len(full), :, 0], own[: len(full), :, 1] = full.real, full.imag
    return out


def _examined(problem: SelfExcited, cycle: LimitCycle) -> CycleStability | str:
    """Return the stability of a cycle, or why it is not examined."""
    why = too_long(problem.system, forced=False)
    if why:
        return why
    try:
        return cycle_stability(problem, cycle)
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError) as error:
        return str(error)


def _without(wave: int, mode: StuckMode, problem: str) -> CycleBranch:
    none, no_numbers = np.zeros(0), np.zeros(0, dtype=np.int64)
    return CycleBranch(
        wave,
        mode.number,
        mode.omega,
        mode.ratio,
        np.nan,
        none,
        none,
        none,
        np.nan,
        np.nan,
        none,
        none,
        none,
        no_numbers,
        none,
        no_numbers,
        np.zeros((0, 1, 0, 2)),
        "[]",
        "[]",
        none,
        none,
        none,
        no_numbers,
        none,
        problem,
    )


def _linear(modes: dict[int, list[StuckMode]]) -> dict[str, object]:
    """Return frequencies (Hz) and damping ratios of all modes that were looked at, NaN where a wave has fewer."""
    most = max(len(own) for own in modes.values())
    hertz, ratio = np.full((2, len(modes), most), np.nan)
    for i, own in enumerate(modes.values()):
        hertz[i, : len(own)] = [m.omega / HZ for m in own]
        ratio[i, : len(own)] = [m.ratio for m in own]
    return {"wave": np.array(list(modes), dtype=np.int64), "hertz": hertz, "ratio": ratio}


def _named(question: Question, wave: int, mode: StuckMode) -> str:
    of = "" if wave == NO_WAVE else f"wave {wave}, "
    label = f"{question.label}: " if question.label else ""
    return f"{label}{of}mode {mode.number} ({mode.omega / HZ:.3f} Hz, damping ratio {100 * mode.ratio:+.4g} %)"


def _told(branch: CycleBranch) -> str:
    if branch.problem:
        return branch.problem
    each = [
        f"{millimetres(a, 5)} at {w / HZ:.4f} Hz ({word})"
        for a, w, word in zip(branch.cycle_amplitude, branch.cycle_omega, json.loads(branch.stable), strict=True)
    ]
    return f"limit cycles: {', '.join(each) or 'none'}"
