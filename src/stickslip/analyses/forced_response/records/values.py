"""Variables of one case, stored by its job for the dataset."""

import json
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.columns import (
    MOTION,
    STAGES,
    Attempts,
    CaseNumbers,
    Drawn,
    ExaminedRows,
    ModelFacts,
    PeakPeriod,
    PointFields,
    Points,
    PointStability,
    Shots,
    TimeChecks,
    stored,
)
from stickslip.analyses.forced_response.stability.in_time import Check
from stickslip.analyses.forced_response.stability.stable import Examined
from stickslip.analyses.forced_response.stability.stable_words import BASES
from stickslip.arrays import ComplexArray, FloatArray, IntArray, TextArray
from stickslip.response.forced.collected import Response
from stickslip.response.forced.from_time import marched_of
from stickslip.response.forced.response import ForcedPoint
from stickslip.response.recovery import equivalent_damping, signals
from stickslip.units import HZ, RPM

Values = dict[str, Any]


def of_model(question: Question, output: int) -> Values:
    """Return the variables of the model: labels, contacts, static state, natural frequencies, skin; `output` is the output with the peak."""
    model, skin = question.model, question.model.skin
    table, frequencies = model.contacts, model.frequencies
    facts = ModelFacts(
        frequency_full_hz=frequencies.free_full,
        frequency_reduced_hz=frequencies.free_reduced,
        frequency_stuck_full_hz=frequencies.stuck_full,
        frequency_stuck_reduced_hz=frequencies.stuck_reduced,
        static_gap=model.static_gap,
        static_force=model.static_force,
        contact_law=table.laws,
        contact_group=table.groups,
        contact_position=table.position,
        contact_frame=table.frame,
        contact_area=table.area,
        surface_point=None if skin is None else skin.points,
        surface_triangle=None if skin is None else skin.triangles,
    )
    labels = {
        "output": model.output_labels,
        "retained": model.system.retained_labels,
        "contact": table.names,
        "driven": question.driven_names,
    }
    return stored(facts) | labels | {"attributes": json.dumps(_attributes(question, output))}


def _attributes(question: Question, output: int) -> Values:
    """Return the attributes of the dataset: texts, numbers and lists of numbers."""
    model, sweep = question.model, question.sweep
    order: Values = {} if model.engine_order is None else {"engine_order": model.engine_order}
    if len(model.orders) > 1:
        order["driven_engine_orders"] = [model.orders[h] for h in question.driven]
    own = {
        "samples": sweep.samples,
        "evaluator": sweep.evaluator,
        "report_output": model.output_labels[output],
        "amplitude_of": sweep.amplitude_of,
        "sectors": model.sectors,
        "driven_harmonics": list(question.driven),
        "direction": sweep.direction,
        "range_key": question.key,
        "stepped": int(sweep.single or sweep.grid.size > 0),
        "error_limit_percent": 100 * question.limit,
    }
    facts = {name: np.asarray(value).tolist() for name, value in question.facts.items()}
    return question.chooser.attributes() | facts | own | order


def of_response(question: Question, response: Response, shift: tuple[float, float]) -> Values:
    """Return the values of a finished response, without the dimension ``case``.

    Parameters
    ----------
    question, response
        The case and its response.
    shift
        Return value of `peak_shift`.
    """
    return (
        _of_case(question, response, shift)
        | _of_points(question, response)
        | _of_fields(question, response)
        | _of_peak(question, response)
        | _of_drawn(question, response)
        | _of_attempts(question, response)
    )


def of_shots(response: Response) -> Values:
    """Return the variables of a response by shooting, one row a point; none of a response by balance."""
    points = [a.point for a in response.accepted if a.point.shot]
    if not points:
        return {}
    shots = [p.shot[0] for p in points]
    return stored(
        Shots(
            shot_frequency_hz=np.array([p.omega / HZ for p in points]),
            shot_residual=np.array([s.residual for s in shots]),
            shot_step_error_percent=100 * np.array([s.step_error for s in shots]),
            shot_steps=_whole(s.steps for s in shots),
            shot_periods=_whole(s.periods for s in shots),
            shot_corrections=_whole(p.iterations for p in points),
        )
    )


def of_checks(checks: Sequence[Check]) -> Values:
    """Return the variables of the comparisons with time integration."""
    return stored(
        TimeChecks(
            verify_frequency_hz=np.array([c.frequency_hz for c in checks]),
            verify_transient=np.array([c.transient for c in checks]),
            verify_balance=np.array([c.balance for c in checks]),
            verify_difference_percent=np.array([c.difference_percent for c in checks]),
            verify_outputs_percent=np.array([c.outputs_percent for c in checks]),
            verify_scatter=np.array([c.scatter for c in checks]),
            verify_refined=np.array([c.refined for c in checks]),
            verify_settled=_whole(int(c.settled) for c in checks),
            verify_periods=_whole(c.periods for c in checks),
            verify_motion=texts(c.motion for c in checks),
            verify_sentence=texts(c.sentence for c in checks),
        )
    )


def of_examined(examined: Sequence[Examined], count: int) -> Values:
    """Return the variables of the stability: one row an examined point, and one value for each of the `count` points of the response."""
    rows = [e for e in examined if e.basis == "examined" or e.position < 0 or len(examined) == 1]
    word = np.full(count, MOTION["not examined"], dtype=np.int64)
    basis = np.zeros(count, dtype=np.int64)
    for e in examined:
        word[e.position], basis[e.position] = MOTION[e.verdict], BASES.index(e.basis)
    examined_rows = ExaminedRows(
        stability_frequency_hz=np.array([e.omega / HZ for e in rows]),
        stability_verdict=texts(e.verdict for e in rows),
        stability_multiplier=np.array([e.multiplier for e in rows]),
        stability_multiplier_error=np.array([e.error for e in rows]),
        stability_sentence=texts(e.sentence for e in rows),
    )
    return stored(examined_rows) | stored(PointStability(motion_stability=word, motion_stability_basis=basis))


def _of_case(question: Question, response: Response, shift: tuple[float, float]) -> Values:
    contact, linear, rest = response.seconds
    larger, larger_hz = _unstable_peak(response)
    return stored(
        CaseNumbers(
            excitation_n=question.model.excitation,
            lowest_hz=question.sweep.omega_range[0] / HZ,
            highest_hz=question.sweep.omega_range[1] / HZ,
            peak_amplitude=response.peak_amplitude,
            peak_frequency_hz=response.peak_hz,
            peak_point=response.peak,
            peak_damping=_damping(question, response),
            unstable_peak_amplitude=larger,
            unstable_peak_frequency_hz=larger_hz,
            points=len(response.accepted),
            points_low=response.points_low,
            points_high=len(response.accepted) - response.points_low,
            points_failed=response.failed,
            unknowns_solved=response.unknowns,
            newton_steps=response.newton_steps,
            seconds_contact=contact,
            seconds_linear=linear,
            seconds_rest=rest,
            choice_sentence=question.chooser.sentence(response) if question.chooser.decides else "",
            retention_peak_shift=shift[0],
            retention_frequency_shift_hz=shift[1],
        )
    )


def _unstable_peak(response: Response) -> tuple[float, float]:
    """Return amplitude and frequency (Hz) of the largest motion if it is unstable; else NaN."""
    if response.unstable_peak < 0:
        return np.nan, np.nan
    own = response.accepted[response.unstable_peak]
    return response.amplitude(own), own.point.omega / HZ


def _damping(question: Question, response: Response) -> float:
    top = response.top
    return float("nan") if top is None else equivalent_damping(question.problem, top.point)


def _of_points(question: Question, response: Response) -> Values:
    chooser, engine_order = question.chooser, question.model.engine_order
    labels = question.model.error_labels
    points = [a.point for a in response.accepted]
    asked = np.array([a.indicator for a in response.accepted], dtype=float)
    own = np.array([p.predicted_error for p in points], dtype=float)
    omega = np.array([p.omega for p in points])
    speed = omega / engine_order / RPM if question.over_speed and engine_order else omega * np.nan
    return stored(
        Points(
            frequency_hz=omega / HZ,
            speed_rpm=speed,
            order=_whole(p.order for p in points),
            unknowns=_whole(p.unknowns for p in points),
            status=_whole(int(p.status) for p in points),
            indicator=asked if chooser.is_error else own,
            predicted_error_percent=100 * asked if chooser.is_error else np.full(asked.size, np.nan),
            own_error_percent=100 * np.array([a.own_error for a in response.accepted]),
            audit_error_percent=100 * np.array([a.audit_error for a in response.accepted]),
            audit_error_of=texts(labels[a.audit_place] if a.audit_place >= 0 else "" for a in response.accepted),
            real_error_percent=100 * np.array([a.real_error for a in response.accepted]),
            newton_iterations=_whole(p.iterations for p in points),
            seconds=np.array([p.seconds_total for p in points]),
            refinement=_whole(int(p.stage == "peak") for p in points),
            marched_sentence=texts(str(marched_of(p) or "") for p in points),
        )
    )


def _of_fields(question: Question, response: Response) -> Values:
    low, high, every = question.chooser.low, highest(response), response.accepted
    n_outputs, n_contacts = len(question.model.output_labels), len(question.model.contacts.names)
    n_retained = question.model.system.retained.size

    def block(name: str, *shape: int) -> FloatArray:
        rows = [_padded(getattr(a.fields, name, None), high, shape) for a in every]
        return _parts(rows, (high + 1, *shape))

    retained = [_padded(a.point.coefficients if a.fields else None, high, (n_retained,)) for a in every]
    lost = np.full(n_contacts, np.nan)
    return stored(
        PointFields(
            harmonic_kept=_kept([a.point for a in every], high),
            amplitude=_stacked([a.amplitudes(n_outputs) for a in every], n_outputs),
            amplitude_low=_stacked([a.first_amplitudes(n_outputs, low) for a in every], n_outputs),
            driven_amplitude=_stacked([a.driven_amplitudes(n_outputs) for a in every], len(question.driven), n_outputs),
            output_displacement=block("outputs", n_outputs),
            retained_displacement=_parts(retained, (high + 1, n_retained)),
            gap=block("gaps", n_contacts, 3),
            contact_force=block("forces", n_contacts, 3),
            dissipated_energy=_stacked([getattr(a.fields, "energy", lost) for a in every], n_contacts),
        )
    )


def _of_peak(question: Question, response: Response) -> Values:
    laws = question.problem.system.interface.laws
    friction = np.array([getattr(law, "mu", np.nan) for law in laws], dtype=float)
    if response.top is None:
        n, samples = len(question.model.contacts.names), question.sweep.samples
        lost = np.full((n, 3, samples), np.nan)
        state = np.full((n, 2, samples), -1)
        nothing = PeakPeriod(
            peak_time=lost[0, 0], peak_gap=lost, peak_force=lost, peak_state=state, peak_friction=friction
        )
        return stored(nothing)
    period = signals(question.problem, response.top.point)
    return stored(
        PeakPeriod(
            peak_time=period.time,
            peak_gap=period.gap,
            peak_force=period.force,
            peak_state=period.state,
            peak_friction=friction,
        )
    )


def _of_drawn(question: Question, response: Response) -> Values:
    """Return the geometry for pictures of the model, and its motion at the peak."""
    scene, top = question.scene, response.top
    if scene is None or not len(scene.points):
        return {}
    count, contacts = (1, len(scene.points), 3), (1, len(scene.contacts), 3)
    moved, of_contacts = (np.full(shape, complex(np.nan, np.nan)) for shape in (count, contacts))
    if scene.moving is not None and top is not None:
        moved, of_contacts = scene.moving.at(top.point.omega, top.point.coefficients)
    return stored(
        Drawn(
            drawn_point=scene.points,
            drawn_triangle=scene.triangles,
            drawn_part=scene.part,
            drawn_kind=scene.kind,
            drawn_contact=scene.contacts,
            drawn_load=scene.load,
            drawn_load_harmonic=scene.load_harmonic,
            drawn_load_point=scene.load_points,
            drawn_load_direction=scene.load_directions,
            drawn_support=scene.supports,
            peak_drawn_motion=np.stack([moved.real, moved.imag], axis=-1),
            peak_contact_motion=np.stack([of_contacts.real, of_contacts.imag], axis=-1),
        )
    )


def _of_attempts(question: Question, response: Response) -> Values:
    points = response.solved
    # a branch with many harmonics replaces accepted points, so the values of the alert come from all solutions
    alert = question.chooser.is_error
    asked = [p for p in points if alert and p.stage in ("low", "point") and not np.isnan(p.predicted_error)]
    return stored(
        Attempts(
            attempt_frequency_hz=np.array([p.omega / HZ for p in points]),
            attempt_stage=_whole(STAGES.index(p.stage) for p in points),
            attempt_kept=_kept(points, highest(response)),
            attempt_unknowns=_whole(p.unknowns for p in points),
            attempt_indicator=np.array([p.predicted_error for p in points]),
            attempt_repeated=_whole(int(p.asked.size > 0) for p in points),
            attempt_status=_whole(int(p.status) for p in points),
            attempt_newton_iterations=_whole(p.iterations for p in points),
            attempt_seconds=np.array([p.seconds_total for p in points]),
            alert_frequency_hz=np.array([p.omega / HZ for p in asked]),
            alert_error_percent=np.array([100 * p.predicted_error for p in asked]),
            alert_repeated=_whole(int(p.asked.size > 0) for p in asked),
        )
    )


def highest(response: Response) -> int:
    """Return the highest harmonic of all solutions."""
    return max((p.order for p in response.solved), default=1)


def _kept(points: Sequence[ForcedPoint], high: int) -> IntArray:
    """Return 1 for every harmonic from 0 to `high` in a solution, else 0."""
    table = np.zeros((len(points), high + 1), dtype=np.int64)
    for row, point in zip(table, points, strict=True):
        row[point.harmonics] = 1
    return table


def _padded(values: ComplexArray | None, high: int, shape: tuple[int, ...]) -> ComplexArray:
    """Return harmonics 0..high: zero if not kept, NaN without a solution."""
    out = np.zeros((high + 1, *shape), dtype=complex)
    if values is None:
        out[:] = complex(np.nan, np.nan)
    else:
        out[: len(values)] = values
    return out


def texts(values: Iterable[str]) -> TextArray:
    """Return texts as an array, also for an empty list."""
    return np.array(list(values), dtype=str)


def _whole(values: Iterable[int]) -> IntArray:
    return np.array(list(values), dtype=np.int64)


def _stacked(rows: Sequence[FloatArray], *shape: int) -> FloatArray:
    return np.array(rows, dtype=float).reshape(len(rows), *shape)


def _parts(rows: Sequence[ComplexArray], shape: tuple[int, ...]) -> FloatArray:
    values = np.array(rows, dtype=complex).reshape(len(rows), *shape)
    return np.stack([values.real, values.imag], axis=-1)
