"""Advice of ``stickslip check`` on a case: computation, cost, doubts, contacts at rest, natural frequencies, pressure fields."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from stickslip.analyses.forced_response.estimate import Estimate, estimate
from stickslip.analyses.forced_response.physics.known import (
    LISTED,
    doubts_of_model,
    mixed_places,
    no_resonance,
    nothing_pressed,
    off_engine_order,
    range_around,
)
from stickslip.analyses.forced_response.physics.limits import (
    ESTIMATE,
    NAMED_MODES,
    beforehand,
    damper_lines,
    driven_line,
    physics_of,
    statics_of_dampers,
)
from stickslip.analyses.forced_response.problem import STILL_HZ, Question, question_of, strength_of
from stickslip.analyses.forced_response.shooting import shooting_lines
from stickslip.analyses.forced_response.stability.bifurcating import bifurcations_line
from stickslip.analyses.forced_response.stability.stable import cost_lines
from stickslip.analyses.operation import Operating, asked_of, of_frequencies
from stickslip.analyses.waves.records import label
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.assembly.build import holding_points
from stickslip.assembly.fluid.aero_forces import own_dofs, phases
from stickslip.assembly.forces import Load, force_of
from stickslip.assembly.model import Model
from stickslip.assembly.sides.unreduced import unreduced_line
from stickslip.model.facts import facts_of_part
from stickslip.model.modes import normal_modes
from stickslip.model.slow_steps import step
from stickslip.reduction.waves import excited_wave
from stickslip.response.damping_of_modes import ModesInRange
from stickslip.study.analysis import Advice, Case
from stickslip.study.verdict import Verdict
from stickslip.units import HZ, millimetres

BESIDE_A_RANGE = 0.005  # of an end of the operating range, that a proposed sweep leaves beside it
NAMED_POINTS = 4  # open contact points that a line names
APPROACH_M = 2e-4  # elastic approach of two bodies at rest: pressed metal surfaces approach by micrometres
HEAVY = 0.3  # mass of a rigid body over the mass of all other parts: dampers weigh a few per cent of a blade
FAR_OFF = 20.0  # frequencies off by this factor point to units
_ENDS_OF_SENTENCES = re.compile(r"(?<=[^.0-9])\. (?=[A-Z0-9a-z])|; |: ")
ROUNDING = 1e-12  # m
MODES = 3  # modes with a reported modal force, unless the study sets their number


def advice(case: Case, model: Model) -> Advice:
    """Return the advice on a case before its solution."""
    question = question_of(case, model)
    with step(
        f"modes of {question.model.system.structure.n} coordinates in the range, and how far friction damps them"
    ):
        physics = physics_of(question)
    with step("statics of the dampers at other platform angles"):
        statics = statics_of_dampers(question.model)
    known = [] if physics is None else list(beforehand(physics))
    doubted = [text for text in doubts_of_model(question) if text not in model.warnings]
    doubts = [
        *no_resonance(question),
        *nothing_pressed(question),
        *mixed_places(question.model.error_labels, question.sweep.relative_to),
        *(v for v in known if v.rank),
        *_not_swept(question, *of_frequencies(asked_of(case), model.engine_order)),
    ]
    idle = strength_of(case).idle
    cost = estimate(model, question.sweep) if question.stepping is None else None
    if cost is not None and physics is not None:
        cost = replace(cost, slips=physics.slip_ratio)
    return Advice(
        computed=_computed(case, model, question, cost),
        doubts=(
            *doubted,
            *(f"{v.why}. {v.remedy}" for v in doubts),
            *units_in_doubt(question, model),
            *[f"{idle}. Remove what is not used, or choose the rule that uses it."] * bool(idle),
        ),
        at_rest=(*contacts_at_rest(question), *damper_lines(statics)),
        beside=(
            *beside_the_range(question),
            *_in_operation(question, *of_frequencies(asked_of(case), model.engine_order)),
            *([] if physics is None else driven_line(physics)),
            *_of_friction(physics),
            *_left_out(question, physics),
            *_notes(question),
        ),
        solving_s=(0.0, 0.0) if cost is None else (cost.likely_seconds, cost.upper_seconds),
    )


def _computed(case: Case, model: Model, question: Question, cost: Estimate | None) -> tuple[str, ...]:
    """Return lines on the computation and its cost."""
    lowest, highest = (omega / HZ for omega in question.sweep.omega_range)
    return (
        f"sweep: {lowest:.2f} to {highest:.2f} Hz",
        *of_pressures(case, model),
        *_of_method(case, question, cost),
    )


def _of_method(case: Case, question: Question, cost: Estimate | None) -> tuple[str, ...]:
    """Return lines on balance or shooting."""
    if question.stepping is not None:
        return (*question.orders_lines, *shooting_lines(question.model, question.sweep, question.stepping))
    return (
        *(() if cost is None else cost.lines),
        *unreduced_line(question.model),
        *question.orders_lines,
        *(f"harmonics: {line}" for line in question.chooser.lines(case.settings.harmonics.passages)),
        *cost_lines(question),
        *bifurcations_line(question),
    )


def of_pressures(case: Case, model: Model) -> tuple[str, ...]:
    """Return lines about pressure fields; empty for a Python model, which has no table of its loads."""
    given = getattr(case.settings, "load", {})
    return pressure_lines(model, {name: table.modal_forces for name, table in given.items()})


def beside_the_range(question: Question) -> list[str]:
    """Return the natural frequencies below, in and above the range of the sweep; of a model with contacts, with these open and stuck."""
    times = question.driven[0]
    lowest, highest = (times * omega / HZ for omega in question.sweep.omega_range)
    told: list[str] = []
    if times > 1:
        told.append(
            f"{question.driven_names[0]} acts at {times} times the swept frequencies: {lowest:.2f} to {highest:.2f} Hz"
        )
    free, stuck = question.natural_states
    both = ((", contacts open", free), (", contacts stuck", stuck))
    for state, hertz in both if question.model.contacts.names else (("", free),):
        rigid = int(np.count_nonzero(hertz < STILL_HZ))
        elastic = hertz[rigid:]
        pieces = [f"{rigid} of rigid motions"] * bool(rigid)
        pieces += _listed(elastic[elastic < lowest][-1:], "below")
        pieces += _listed(elastic[(elastic >= lowest) & (elastic <= highest)][:LISTED], "in the range") or [
            "none in the range"
        ]
        pieces += _listed(elastic[elastic > highest][:1], "above")
        told += [f"natural frequencies{state}: {', '.join(pieces)}"] * bool(hertz.size)
    return told


def _not_swept(question: Question, lowest: float, highest: float) -> list[Verdict]:
    """Doubt a sweep that leaves out some of the operating range."""
    own, swept = Operating(lowest, highest, "Hz"), [omega / HZ for omega in question.sweep.omega_range]
    left = own.beyond(min(swept), max(swept)) if own.known else ""
    if not left:
        return []
    times, why = question.driven[0], f"the sweep leaves out {left} of the operating range, {own}"
    held = range_around(question, times * min(lowest, *swept), times * max(highest, *swept), BESIDE_A_RANGE)
    return [Verdict("doubtful", why=why, remedy=f"Widen forced_response.{question.key}: {held} holds it.")]


def _in_operation(question: Question, lowest: float, highest: float) -> list[str]:
    """Return the natural frequencies inside the operating range, or the nearest one with its margin."""
    range_ = Operating(lowest, highest, "Hz")
    if not range_.known:
        return []
    times, told = question.driven[0], []
    both = zip((", contacts open", ", contacts stuck"), question.natural_states, strict=True)
    for state, hertz in both if question.model.contacts.names else (("", question.natural_states[0]),):
        excited = hertz[hertz > STILL_HZ] / times
        inside = [f"{f:.2f}" for f in excited if range_.margin(f) == 0.0][:LISTED]
        if inside:
            told.append(f"operating range {range_}{state}: {' and '.join(inside)} Hz inside")
        elif excited.size:
            near = min(excited, key=lambda f: abs(range_.margin(f)))
            told.append(f"operating range {range_}{state}: nearest {near:.2f} Hz, {range_.where(near)}")
    return told


def _listed(hertz: FloatArray, where: str) -> list[str]:
    return [f"{' and '.join(f'{f:.2f}' for f in hertz)} Hz {where}"] if hertz.size else []


def contacts_at_rest(question: Question) -> list[str]:
    """Return the static forces of all contacts, then for each contact closed and open points, normal forces, T/N."""
    model = question.model
    normal, along = -model.static_force[:, 2], np.abs(model.static_force[:, :2])
    if not np.any(normal):
        return []
    pressed = np.count_nonzero(normal > 0)
    told = [
        f"static equilibrium: {pressed} of {normal.size} contact points are pressed, normal forces up to {normal.max():.3g} N"
    ]
    mu = np.array([getattr(law, "mu", np.nan) for law in model.system.interface.laws])
    groups = np.array(model.contacts.groups)
    for name in dict.fromkeys(model.contacts.groups):
        own = groups == name
        told.append(_of_contact(name, normal[own], along[own], mu[own]))
        opened = [p for p, at, n in zip(model.contacts.names, own, normal, strict=True) if at and n <= 0]
        if 0 < len(opened) < np.count_nonzero(own):
            more = f" and {len(opened) - NAMED_POINTS} more" if len(opened) > NAMED_POINTS else ""
            told.append(f"contact {name}: open are {', '.join(opened[:NAMED_POINTS])}{more}")
    return told


def _of_contact(name: str, normal: FloatArray, along: FloatArray, mu: FloatArray) -> str:
    closed = normal > 0
    if not closed.any():
        return f"contact {name}: all {normal.size} points are open, or their law has no normal force"
    total, least, most = normal[closed].sum(), normal[closed].min(), normal[closed].max()
    each = f"{least:.3g} to {most:.3g} N each" if closed.sum() > 1 else "at one point"
    ratio = along[closed].sum(axis=0).max() / total  # elastic_coulomb bounds each direction by itself
    friction = f", T/N {ratio:.2g} of at most {np.mean(mu[closed]):.2g}" if np.all(np.isfinite(mu[closed])) else ""
    return f"contact {name}: {closed.sum()} of {normal.size} closed, {total:.3g} N, {each}{friction}"


def units_in_doubt(question: Question, model: Model) -> Iterator[str]:
    """Yield doubts that point to wrong units: frequencies far off the range, soft contacts, heavy dampers."""
    yield from _frequencies_far_off(question)
    at = np.isfinite(question.model.contacts.position).all(axis=1) & (question.model.static_force[:, 2] < 0.0)
    approach = -question.model.static_gap[at, 2]
    if approach.size and approach.max() > APPROACH_M:
        group = question.model.contacts.groups[int(np.flatnonzero(at)[np.argmax(approach)])]
        yield (
            f"at rest contact {group} is pressed together by {millimetres(approach.max(), 2)}, and metal surfaces approach by micrometres. "
            f"Check the units of its stiffness (N/m) and of the static load (N)."
        )
    mass = {name: facts_of_part(part).mass for name, part in model.parts.items()}
    for name, part in model.parts.items():
        others = sum(m for other, m in mass.items() if other != name and np.isfinite(m))
        if part.body is not None and others > 0.0 and mass[name] > HEAVY * others:
            yield (
                f"{name} weighs {mass[name]:.3g} kg beside {others:.3g} kg of all other parts, and dampers weigh a few per cent of a blade. "
                "Check the units of its mass and sizes (kg, m)."
            )


def _frequencies_far_off(question: Question) -> Iterator[str]:
    """Yield the doubt about a range that lies far from all natural frequencies."""
    if len(question.driven) > 1:
        return
    (lowest, highest), every = question.driven_hz, question.natural_hz
    every = every[every > STILL_HZ]
    if not every.size:
        return
    factor = max(every.min() / highest, lowest / every.max())
    if factor < FAR_OFF:
        return
    which, where = (every.min(), "above") if every.min() > highest else (every.max(), "below")
    yield (
        f"the nearest natural frequency, {which:.4g} Hz, lies {factor:.3g} times {where} the range. Check the units: mm for m shifts "
        "frequencies 1000 times, a mass or stiffness 1000 times off 31.6 times."
    )


def _of_friction(physics: ModesInRange | None) -> Iterator[str]:
    """Yield the estimate of the damping by friction, mode by mode."""
    damped = [] if physics is None else physics.damped[:NAMED_MODES]
    for mode in damped:
        yield from mode.sentences
    if damped:
        yield ESTIMATE


def _left_out(question: Question, physics: ModesInRange | None) -> Iterator[str]:
    """Yield the range that the sweep leaves out between the sticking and the sliding mode that the load drives most."""
    top = None if physics is None else physics.driven
    if physics is None or top is None:
        return
    ends = sorted((physics.ends(top) / HZ, top.hz))
    lowest, highest = (omega / HZ for omega in question.sweep.omega_range)
    if ends[0] < lowest or ends[1] > highest:
        held = range_around(question, *(question.driven[0] * end for end in ends))
        yield f"the sweep leaves out a part between this mode stuck, {top.hz:.2f} Hz, and sliding freely, {physics.ends(top) / HZ:.2f} Hz"
        yield f"{held} holds both"


def _notes(question: Question) -> Iterator[str]:
    """Yield notes on the range, each sentence a line."""
    for note in off_engine_order(question):
        yield from sentences(f"note: {note.why}. {note.remedy}")


def sentences(text: str) -> Sequence[str]:
    """Return the sentences and clauses of a text, one a line, indented from the second on."""
    head, _, rest = text.partition(": ")
    first, *others = _ENDS_OF_SENTENCES.split(rest.removesuffix("."))
    return [f"{head}: {first}", *(f"  {other}" for other in others)]


def pressure_lines(model: Model, modes: Mapping[str, int]) -> tuple[str, ...]:
    """Return sentences about the pressure fields of a model, with the modal forces of `modes` modes for each load."""
    found: list[str] = []
    for name, load in model.loads.items():
        if load.field is not None:
            found += _about(model, name, load, modes.get(name, MODES))
    return tuple(found)


def _about(model: Model, name: str, load: Load, count: int) -> list[str]:
    assert load.field is not None
    put = load.field.on(model.places, load.on, f"load.{name}.on")
    (force, moment), (own_force, own_moment) = put.before, put.after
    offset = f"; points up to {millimetres(put.offset if put.offset > ROUNDING else 0.0, 3)} off it"
    if put.inward:
        offset += ", their normals point into the body"
    if np.any(put.clamped):
        offset += f"; {_vector(put.clamped)} N act on clamped nodes"
    sums = (
        f"load.{name}: pressure on {load.on}: force {_vector(force)} N, on its nodes {_vector(own_force)} N; moment about the origin "
        f"{_vector(moment)} N m, on its nodes {_vector(own_moment)} N m{offset}"
    )
    if not load.harmonic or not count:
        return [sums]
    number = excited_wave((load.engine_order or 0) * load.harmonic, model.sectors)
    moving = model.at(model.speed, number, holding_points(model, "static"))
    shapes = normal_modes(moving, count)
    turned = np.asarray(moving.expand(shapes.shapes))
    turned = turned * phases(turned, own_dofs(model))
    modal = turned.conj().T @ force_of(model.places, name, load)
    wave = label(number, model.sectors, parted=True)
    told = ", ".join(
        f"{hz:.6g} Hz: {abs(q):.4g} at {np.degrees(np.angle(q)):.1f} deg"
        for hz, q in zip(shapes.frequencies_hz, modal, strict=True)
    )
    return [sums, f"load.{name}: modal forces in N/sqrt(kg) on {wave}, contacts static: {told}"]


def _vector(values: ComplexArray) -> str:
    """Write three complex numbers as amplitude and phase, real ones as they are."""
    if not np.any(values.imag):
        return f"({', '.join(f'{v:.5g}' for v in values.real)})"
    size = np.abs(values).max()
    told = [f"{abs(v):.5g} at {np.degrees(np.angle(v)) if abs(v) > 1e-9 * size else 0:.1f} deg" for v in values]
    return f"({', '.join(told)})"
