"""Follows the modes of each wave."""

from collections.abc import Iterator, Sequence

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import StickslipError
from stickslip.response.nonlinear_modes.backbone import Backbone, nonlinear_mode
from stickslip.response.self_excited.modes import StuckMode
from stickslip.study.analyses.analysis import Notes
from stickslip.study.analyses.backbones.question import Question
from stickslip.study.analyses.backbones.records import ModeBranch
from stickslip.study.analyses.vibrating import ONE, as_wave
from stickslip.study.keep.progress import LOG, advance
from stickslip.units import HZ


def solve(question: Question, done: Sequence[ModeBranch], notes: Notes) -> Iterator[ModeBranch]:
    """Yield the modes that are not done."""
    notes.put("model", dict(question.facts) | {"output": question.model.output_labels[0]})
    tasks = [(wave, mode) for wave in question.waves for mode in question.followed(wave)]
    for i, (wave, mode) in enumerate(tasks):
        if i < len(done):
            continue
        branch = follow_mode(question, wave, mode)
        name = _named(question, wave, mode)
        LOG.info(f"{name}: {branch.problem or branch.end}")
        advance((i + 1) / len(tasks), name)
        yield branch


def follow_mode(question: Question, wave: int, mode: StuckMode) -> ModeBranch:
    """Return what is found of a mode."""
    try:
        found = nonlinear_mode(
            as_wave(question.model.system, wave),
            question.model.load,
            mode,
            question.dof,
            question.discretisation,
            question.sweep,
        )
    except StickslipError as error:
        found = Backbone(
            as_wave(question.model.system, wave), question.model.load, mode, question.dof, (), ""
        )
        return _branch(wave, found, question.sweep.tolerance, str(error))
    return _branch(wave, found, question.sweep.tolerance)


def _branch(wave: int, found: Backbone, tolerance: float, problem: str = "") -> ModeBranch:
    points = found.points

    def each(name: str) -> FloatArray:
        return np.array([getattr(p, name) if p.converged else np.nan for p in points], dtype=float)

    return ModeBranch(
        wave, found.mode.number, found.mode.omega, found.mode.ratio,
        each("amplitude"), each("omega"), each("ratio"), each("modal_amplitude"), each("energy"),
        np.array([p.order for p in points], dtype=np.int64), np.array([int(p.status) for p in points], dtype=np.int64),
        each("slipping"), each("open_for"), each("change"), tolerance, found.end, problem,
    )  # fmt: skip


def _named(question: Question, wave: int, mode: StuckMode) -> str:
    of = "" if wave == ONE else f"wave {wave}, "
    label = f"{question.label}: " if question.label else ""
    return f"{label}{of}mode {mode.number} ({mode.omega / HZ:.3f} Hz, damping ratio {100 * mode.ratio:+.4g} %)"
