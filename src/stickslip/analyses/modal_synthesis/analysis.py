"""Forced responses at many levels from one nonlinear mode."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from time import process_time
from typing import Any

import numpy as np

from stickslip.analyses.columns import of_answers
from stickslip.analyses.modal_synthesis.problem import NAME, Question, question_of
from stickslip.analyses.modal_synthesis.records import ModalSynthesis, SynthesisLevel, answer
from stickslip.analyses.modal_synthesis.table import ModalSynthesisTable
from stickslip.analyses.modal_synthesis.verdicts import case_verdicts, percent, tables
from stickslip.arrays import FloatArray
from stickslip.assembly.model import Model
from stickslip.errors import SingularError, StickslipError
from stickslip.response.forced.sweep import Sweep
from stickslip.response.nonlinear_modes.backbone import Backbone, ModePoint, nonlinear_mode
from stickslip.response.nonlinear_modes.more_points import refined
from stickslip.response.nonlinear_modes.passage import Swept, passage_through_resonance
from stickslip.response.nonlinear_modes.sdof_oscillator import ModalOscillator, modal_oscillator
from stickslip.response.nonlinear_modes.single_mode_validity import (
    Isolation,
    OtherModes,
    along,
    isolation,
    other_modes,
    peak_with_others,
)
from stickslip.response.nonlinear_modes.synthesis import (
    Synthesised,
    change_of_peak,
    direct_response,
    free_motions,
    is_homogeneous,
    level_to_solve,
    peak_curve,
    resonances,
    synthesise,
)
from stickslip.response.self_excited.modes import StuckMode
from stickslip.solve.status import Status
from stickslip.study.analysis import Analysis, Case, Notes, of_tables
from stickslip.study.store.progress import LOG, advance
from stickslip.units import HZ, millimetres

NOTE = "backbone"
NUMBERS = ("amplitude", "omega", "ratio", "modal_amplitude", "energy", "slipping", "open_for", "change")


TRUSTED, DOUBTFUL = 0.02, 0.05  # largest relative error of the peak by other modes
COARSE = 0.08  # change of the peak with every second point of the backbone: four times the error with all points
HARMONICS = 0.2  # higher harmonics over the first, above which the first alone does not measure the motion
AROUND = 12.0  # half-widths of the widest peak that are shown on either side
NARROWEST, WIDEST = 0.02, 0.2  # limits of this range, relative to the frequency
MOMENTS = 600  # stored instants of a passage
NOTHING = np.zeros(0)
NOBODY = Isolation(np.nan, np.nan, np.nan, np.nan, np.nan, np.nan, linear=False)


@dataclass(frozen=True, eq=False)
class Synthesis:
    """Data common to all levels."""

    question: Question
    oscillator: ModalOscillator
    others: OtherModes
    coarser: ModalOscillator
    ends: tuple[float, float]


def solve(question: Question, done: Sequence[SynthesisLevel], notes: Notes) -> Iterator[SynthesisLevel]:
    """Yield the missing levels."""
    began = process_time()
    notes.put("model", dict(question.facts) | {"output": question.model.output_labels[0]})
    mode = question.mode
    if mode is None:
        raise SingularError("the mode is none of the model")
    backbone = backbone_of(question, mode, notes)
    own = modal_oscillator(backbone, question.model.load)
    if notes.get("design") is None:
        notes.put(
            "design",
            _design(own, question)
            | {
                "seconds": process_time() - began,
                "mode": mode.number,
                "mode_omega": mode.omega,
                "mode_ratio": mode.ratio,
            },
        )
    shared = Synthesis(question, own, other_modes(own), own.coarser(), _ends(question, own))
    for i, level in enumerate(question.asked.levels):
        if i < len(done):
            continue
        record = _level(shared, level)
        label = f"{question.label}: " if question.label else ""
        LOG.info(f"{label}level {level:g}: {record.answer}, {record.why}")
        advance((i + 1) / len(question.asked.levels), f"level {level:g}")
        yield record


def judged(alone: Isolation, resolved: float, changed: float) -> tuple[str, str]:
    """Return the verdict on a peak and its reason; `changed` is the predicted change of the nonlinear mode by more harmonics."""
    off = percent(alone.foreign)
    motion = f"the other modes move by {percent(max(alone.output, alone.gaps))} of the mode"
    near = f"the next frequency is {percent(alone.distance)} away"
    if not np.isfinite(alone.distance):
        motion, near = "there is no other mode", "nothing is near"
    if alone.linear:
        return "trusted", "nothing slips: the other modes are added, and the response is exact"
    if alone.foreign > DOUBTFUL:
        return "refused", f"{motion}, {near}: the peak would be off by about {off}"
    more = "raise modal_synthesis.most_harmonics"
    doubts = (
        (alone.foreign > TRUSTED, f"{motion}, {near}: the peak may be off by about {off}"),
        (
            resolved > COARSE,
            f"the nonlinear mode has too few points here: without every second one the peak moves by {percent(resolved)}",
        ),
        (
            alone.harmonics > HARMONICS,
            f"higher harmonics have {percent(alone.harmonics)} of the first, and the load works on that alone",
        ),
        (np.isnan(changed), f"the nonlinear mode was solved with one set of harmonics alone: {more}"),
        (
            changed > TRUSTED,
            f"more harmonics change frequency or damping ratio of the nonlinear mode by {percent(changed)}: {more}",
        ),
    )
    trusted = motion if not np.isfinite(alone.distance) else f"{motion}, {near}"
    return next((("doubtful", why) for doubted, why in doubts if doubted), ("trusted", trusted))


def _level(shared: Synthesis, level: float) -> SynthesisLevel:
    began = process_time()
    own, question = shared.oscillator, shared.question
    known = level_to_solve(own, level)
    share = level / known
    curve = synthesise(own, known)
    tops = curve.peaks
    # every curve has one peak; a sweep meets the first curve
    peaks = [peak_with_others(shared.others, curve.alone(i), r, question.dof) for i, r in enumerate(tops)]
    alone = isolation(shared.others, tops[0], question.dof) if peaks else NOBODY
    resolved = change_of_peak(shared.coarser, tops[0]) if peaks else np.nan
    changed = own.by_harmonics(tops[0].place) if peaks else np.nan
    detached = max(peaks[1:], default=(np.nan, np.nan))
    answer, why = _answer(shared, curve, alone, (resolved, changed))
    shown = answer in ("trusted", "doubtful")
    if shown and len(peaks) > 1 and curve.resonances[0].top:
        swept = f"the highest peak that a sweep meets has {millimetres(peaks[0][0])} at {peaks[0][1] / HZ:.5g} Hz"
        answer, why = (
            "doubtful",
            f"{swept}; on a detached curve it is {millimetres(detached[0])} at {detached[1] / HZ:.5g} Hz, which a sweep does not reach; {why}",
        )
    inside = (curve.omega >= shared.ends[0]) & (curve.omega <= shared.ends[1]) & shown
    beside = along(shared.others, curve, question.dof)
    spent = process_time() - began
    passages = _passages(shared, known, shown=shown)
    began = process_time()
    direct: tuple[FloatArray, FloatArray] = NOTHING, NOTHING
    if question.asked.direct:
        how, most = question.discretisation, max(question.asked.most_harmonics, 1)
        sweep = Sweep(omega_range=shared.ends, cap=most, samples=how.samples, evaluator=how.evaluator)
        direct = direct_response(question.model.system, question.model.load, level, sweep, question.dof)
    top = int(np.nanargmax(direct[1])) if np.any(np.isfinite(direct[1])) else -1
    return SynthesisLevel(
        level=level,
        answer=answer,
        why=why,
        peak=share * peaks[0][0] if shown else np.nan,
        peak_omega=peaks[0][1] if shown else np.nan,
        detached_peak=detached[0] if shown else np.nan,
        detached_peak_omega=detached[1] if shown else np.nan,
        foreign=alone.foreign,
        output=alone.output,
        gaps=alone.gaps,
        distance=alone.distance,
        overlap=alone.overlap,
        growth=alone.growth,
        harmonics=alone.harmonics,
        resolved=resolved,
        detached=int(curve.curve.max(initial=0)) if shown else 0,
        omega=curve.omega[inside],
        amplitude=share * beside.amplitude[inside],
        others=beside.share[inside],
        alone=beside.alone[inside].astype(np.int64),
        curve=curve.curve[inside],
        stable=curve.stable[inside].astype(np.int64),
        direct_omega=direct[0],
        direct_amplitude=direct[1],
        direct_peak=float(direct[1][top]) if top >= 0 else np.nan,
        direct_peak_omega=float(direct[0][top]) if top >= 0 else np.nan,
        seconds=spent,
        direct_seconds=process_time() - began if question.asked.direct else 0.0,
        passage_omega=passages[0],
        passage_amplitude=share * passages[1],
        passage_finished=passages[2],
        passage_change=passages[3],
        changed=changed,
    )


def _answer(shared: Synthesis, curve: Synthesised, alone: Isolation, errors: tuple[float, float]) -> tuple[str, str]:
    """Return the verdict on a level and its reason; the peak on the curve from small amplitudes counts."""
    if not curve.place.size:
        return "beyond", "the nonlinear mode begins with more than the level reaches"
    if not curve.peaks or float(curve.place.max()) >= shared.oscillator.ends[1]:
        return "beyond", "the nonlinear mode ends before it needs this level of the load"
    answer, why = judged(alone, *errors)
    if answer in ("trusted", "doubtful") and not curve.resonances[0].top:
        return (
            "doubtful",
            f"the nonlinear mode begins with more than the level reaches, so that this is the peak of a detached curve, which a sweep does not reach; {why}",
        )
    return answer, why


def _ends(question: Question, own: ModalOscillator) -> tuple[float, float]:
    """Return the range of frequencies in the figure, rad/s."""
    given = question.asked.frequency_hz
    if given is not None:
        return given[0] * HZ, given[1] * HZ
    tops = [r for level in question.asked.levels for r in resonances(own, level)]
    omega = np.array([own.backbone.mode.omega, *(r.omega for r in tops)])
    here = own.at(np.array([own.ends[0], *(r.place for r in tops)]))
    widest = float(np.clip(AROUND * np.max(np.abs(here.ratio)), NARROWEST, WIDEST))
    return float(omega.min() * (1.0 - widest)), float(omega.max() * (1.0 + widest))


def _passages(shared: Synthesis, level: float, *, shown: bool) -> tuple[Any, Any, Any, Any]:
    """Return frequencies, amplitudes, completion and relative change of all passages at a level."""
    rates = shared.question.asked.passage_hz_per_s
    omega, amplitude = np.full((2, len(rates), MOMENTS), np.nan)
    finished, change = np.zeros(len(rates), dtype=np.int64), np.full(len(rates), np.nan)
    low, high = shared.ends
    ends = (high, low) if shared.question.asked.passage_down else (low, high)
    dof = np.array([shared.question.dof])
    for i, rate in enumerate(rates if shown else []):
        try:
            found = passage_through_resonance(shared.oscillator, level, Swept(ends=ends, rate=rate * HZ))
        except StickslipError as error:
            LOG.info(f"level {level:g} at {rate:g} Hz/s: {error}")
            continue
        kept = np.unique(
            np.append(np.linspace(0, found.time.size - 1, MOMENTS - 1).astype(int), int(np.argmax(found.amplitude)))
        )
        size = np.abs(shared.oscillator.displacement(found.place[kept], dof)[:, 1, 0])
        omega[i, : kept.size], amplitude[i, : kept.size] = found.omega[kept], size
        finished[i], change[i] = found.finished, found.change
    return omega, amplitude, finished, change


def _design(own: ModalOscillator, question: Question) -> dict[str, Any]:
    curve = peak_curve(own, question.dof)
    here = own.at(curve.place)
    return {
        "level": curve.level,
        "amplitude": curve.amplitude,
        "omega": here.omega,
        "ratio": here.ratio,
        "peak_omega": curve.omega,
        "cycles": np.abs(own.displacement(free_motions(own), np.array([question.dof]))[:, 1, 0]),
        "homogeneous": int(is_homogeneous(own, question.discretisation)),
    }


def backbone_of(question: Question, mode: StuckMode, notes: Notes) -> Backbone:
    """Return the nonlinear mode of a job, from its notes if stored."""
    known = notes.get(NOTE)
    if known is not None:
        return _read(question, mode, known)
    system, rest, how = question.model.system, question.rest, question.discretisation
    found = nonlinear_mode(system, rest, mode, question.dof, how, question.sweep)
    whole = refined(found, question.model.load, how)
    notes.put(NOTE, _written(whole))
    return whole


def _written(backbone: Backbone) -> dict[str, Any]:
    points = backbone.solutions
    most = max((p.order for p in points), default=0)
    motion = np.zeros((len(points), most + 1, backbone.system.structure.n, 2))
    for own, point in zip(motion, points, strict=True):
        own[: point.order + 1, :, 0] = point.coefficients.real
        own[: point.order + 1, :, 1] = point.coefficients.imag
    numbers = {name: np.array([getattr(p, name) for p in points], dtype=float) for name in NUMBERS}
    order = np.array([p.order for p in points], dtype=np.int64)
    return {**numbers, "order": order, "motion": motion, "end": backbone.end}


def _read(question: Question, mode: StuckMode, known: Mapping[str, Any]) -> Backbone:
    points = []
    for i, order in enumerate(known["order"]):
        own = known["motion"][i, : int(order) + 1]
        numbers = {name: float(known[name][i]) for name in NUMBERS}
        points.append(
            ModePoint(coefficients=own[..., 0] + 1j * own[..., 1], order=int(order), status=Status.CONVERGED, **numbers)
        )
    return Backbone(question.model.system, question.rest, mode, question.dof, tuple(points), str(known["end"]))


def _check(case: Case, model: Model) -> tuple[str, ...]:
    """Return the line on the mode that answers."""
    mode = question_of(case, model).mode
    told = (
        "" if mode is None else f"mode {mode.number}, {mode.omega / HZ:.4g} Hz, damping ratio {100 * mode.ratio:+.3g} %"
    )
    return (f"{NAME}: {len(case.settings.modal_synthesis.levels)} levels of {told}",)


MODAL_SYNTHESIS = Analysis(
    name=NAME,
    table=ModalSynthesisTable,
    record=SynthesisLevel,
    key=of_tables("modal_synthesis", "solver"),
    inputs=question_of,
    solve=solve,
    dataset=partial(of_answers, answer=answer, verdicts=case_verdicts),
    check=_check,
    summary=tables,
    shared=("solver",),
    answers=(ModalSynthesis,),
)
