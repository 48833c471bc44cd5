"""Forced responses on the page: the numbers at its head, the table of cases, and the order of all figures and tables."""

import re
from collections.abc import Mapping

import numpy as np

from stickslip.analyses.forced_response.page.at_peak.bodies import bodies, energy
from stickslip.analyses.forced_response.page.at_peak.contacts import (
    chosen_case,
    friction_ratio_t,
    friction_ratio_w,
    hysteresis_t,
    hysteresis_w,
    state_map,
    surface_map,
)
from stickslip.analyses.forced_response.page.at_peak.motion import in_motion
from stickslip.analyses.forced_response.page.bifurcations import bifurcations
from stickslip.analyses.forced_response.page.checks import (
    amplitudes_in_time,
    retention,
    shooting,
    stability,
    statistics_in_time,
    time_integration,
)
from stickslip.analyses.forced_response.page.curves import abscissa, frequency_response, low_order, of_each_order
from stickslip.analyses.forced_response.page.harmonics import (
    attempts,
    choice,
    error_scatter,
    errors,
    kept_harmonics,
    more_harmonics,
)
from stickslip.analyses.forced_response.page.jacobians import jacobian_blocks, jacobian_change
from stickslip.analyses.forced_response.page.optimisation import optimisation, what_is_needed, where_friction_works
from stickslip.analyses.forced_response.page.response import NEEDED, Response
from stickslip.analyses.forced_response.page.stress import (
    haigh,
    stress_card,
    stress_cycle,
    stress_surface,
    stressed_case,
    worst_places,
)
from stickslip.analyses.forced_response.page.wheel import (
    blades,
    peaks_of_blades,
    statistics,
    wheel_at_peak,
    wheel_in_motion,
)
from stickslip.analyses.forced_response.records.columns import CaseNumbers, OperatingRange, read
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.working_range import loss_at_peak
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase, families_of, first_number
from stickslip.report.quantities import (
    NONE,
    aligned,
    amplitude,
    column,
    counted,
    fixed,
    number,
    percent,
    quantity,
)
from stickslip.report.section import Block, Card, Section, Table
from stickslip.study.coordinates import naming_of
from stickslip.study.verdict import LEVELS, stored

_AT_PEAK = 1e-6  # relative distance of a verdict's frequency from that of the peak
_END = re.compile(r"; |: |\. (?=[A-Z])")  # of the action in a remedy; its reasons follow
_ALIKE = 0.01  # largest difference of equal peaks, relative to the largest peak


def _answer(response: Response) -> Card:
    """Return the answer and the next step: the peak, or for several cases the smallest peak with the best verdict."""
    cases = [c for c in response.peaked if np.isfinite(response.peak_response(c))]
    if not cases:
        return Card(NONE, "peak", "No case has its peak yet.")
    within = [c for c in cases if response.resonates(c)]
    counted_in = within or cases
    peaks = {c: response.peak_response(c) for c in counted_in}
    least = min(response.trust(c) for c in counted_in)
    trusted = [c for c in counted_in if response.trust(c) == least]
    best = min(trusted, key=lambda c: peaks[c])
    ratio, told = (f"{amplitude(peaks[best], response.unit)}, " if response.per_force else ""), []
    if len(cases) == 1:
        output, comma, which = response.output_name.partition(", ")
        label = f"peak of {output}{best.where}{comma}{which.removesuffix(' at the peak')}"
        told.append(f"{ratio}{response.peak_is(best)}")
    else:
        which = f"{len(trusted)} {LEVELS[least]} of " * (len(trusted) < len(counted_in))
        kind = "peak per newton" if response.per_force else "peak"
        share = peaks[best] / max(peaks.values())
        alike = f", and none is {percent(100 * _ALIKE)} larger" * (share > 1 - _ALIKE)
        label = f"with {best.label}, the smallest {kind} of {which}{counted(len(counted_in), 'case')}{alike}"
        told.append(f"{ratio}{percent(100 * float(share))} of the largest, {response.peak_is(best)}")
        told += _smallest_worst(response, peaks)
    idle = all(loss_at_peak(Curve(response.data, c.index)) == 0 for c in counted_in)
    if idle:
        told.append(f"Friction dissipates nothing at {'any' if len(counted_in) > 1 else 'the'} peak")
    if not within:
        told.append("The largest amplitude stands at the end of the sweep: no resonance")
    elif len(within) < len(cases):
        told.append(f"In {counted(len(cases) - len(within), 'other')} the largest stands at the end of the sweep")
    factor = response.blades[best.index].amplification
    if np.isfinite(factor):
        told.append(f"{number(factor, 3)} times the wheel with all sectors alike")
    lower = min(counted_in, key=lambda c: peaks[c])
    if peaks[lower] < peaks[best]:
        told.append(f"{_size(response, lower)} is {response.level(lower)}{lower.where}")
    blade = response.blade_at_peak(best) if len(cases) > 1 else ""  # the label of a single case names it
    value = f"{_size(response, best)} at {response.place(best)}{blade}"
    return Card(value, label, ". ".join([*told, *_next(response, best, idle=idle)]) + ".")


def _smallest_worst(response: Response, peaks: Mapping[ShownCase, float]) -> list[str]:
    """Return the value of the first varied number whose worst peak over all curves is smallest; nothing for a single curve.

    The other varied keys may be uncertain, such as a friction coefficient, or several loads, so that none of their values can be chosen.
    """
    key = first_number(response.data)[0]
    curves = families_of(response.data, key, list(peaks)) if key else {}
    if len(curves) < 2:
        return []
    of_values: dict[float, list[ShownCase]] = {}
    for case in (c for curve in curves.values() for c in curve):
        of_values.setdefault(case.value, []).append(case)
    worst = [max(own, key=lambda c: peaks[c]) for own in of_values.values() if len(own) == len(curves)]
    if not worst:
        return []
    least = min(worst, key=lambda c: peaks[c])
    named = naming_of(response.data, key).name(least.value)
    level = f", {response.level(least)}" if response.trust(least) else ""
    size = f"{amplitude(peaks[least], response.unit)}{level}"
    over = percent(100 * (peaks[least] / min(peaks.values()) - 1.0))
    return [f"In the worst of {len(curves)} curves {named} is best: {size}, {over} above the smallest peak"]


def _size(response: Response, case: ShownCase) -> str:
    """Return the peak of a case as an amplitude, also where the response is divided by the force."""
    return amplitude(response.peak_response(case) * (case.excitation if response.per_force else 1.0), response.length)


VARY = "[vary] of a study file, stickslip.compare in Python"


def _next(response: Response, best: ShownCase, *, idle: bool) -> list[str]:
    """Return the next step with its key: the remedy of a doubt, a wider sweep, more load, or further values."""
    remedies = _remedies(response, best) if response.trust(best) else []
    if response.level(best) != "wrong" and not response.resonates(best):  # no other doubt matters without a resonance
        wider = [remedy for remedy in remedies if remedy.startswith("widen ")]
        remedies = wider or [f"widen forced_response.{Curve(response.data, best.index).range_key}"]
    if response.trust(best) or remedies:
        return [f"Next: {remedy}" for remedy in remedies[:1]]
    if idle:
        return ["Next: raise load.NAME.force_n, or press the contacts less, until they slip"]
    return _further(response, best)


def _further(response: Response, best: ShownCase) -> list[str]:
    """Return which values of what was varied to add: beyond the last one, or beside the best one."""
    key = first_number(response.data)[0]
    if not key:
        return [] if len(response.cases) > 1 else [f"Next: vary the load or the damper ({VARY})"]
    family = next(own for own in families_of(response.data, key, response.peaked).values() if best in own)
    at, naming = family.index(best), naming_of(response.data, key)
    if len(family) < 2:
        return []
    if at in (0, len(family) - 1):
        side = "below" if at == 0 else "above"  # families rise with the value
        return [f"Next: give [vary] {key} values {side} {naming.value(best.value)}, where a smaller peak may lie"]
    low, high = (naming.value(family[k].value) for k in (at - 1, at + 1))
    return [f"Next: give [vary] {key} values between {low} and {high}"]


def _remedies(response: Response, case: ShownCase) -> list[str]:
    """Return the remedies, each without its reasons, of the verdicts that set the level of a case: on all of it, or on its peak."""
    hz, level = response.peak_hz(case), response.level(case)
    found = [
        v.remedy
        for v in stored(response.data.attrs)
        if v.level == level
        and v.case in ("", case.label)
        and (v.frequency_hz is None or abs(v.frequency_hz - hz) <= _AT_PEAK * hz)
        and v.remedy
    ]
    return [remedy[:1].lower() + _END.split(remedy, maxsplit=1)[0][1:].removesuffix(".") for remedy in found]


def _operation_card(response: Response) -> Card | None:
    """Return whether the peaks lie in the operating range, or the smallest margin; None without a range."""
    cases = [c for c in response.peaked if response.resonates(c)]
    ranges = {c: read(OperatingRange, response.data, c.index) for c in cases}
    cases = [c for c in cases if ranges[c].range.known]
    if not cases:
        return None
    margins = {c: ranges[c].range.margin(ranges[c].shown(response.peak_hz(c))) for c in cases}
    near = min(cases, key=lambda c: abs(margins[c]))
    own = ranges[near].range
    size, hz = Curve(response.data, near.index).largest_in_operation
    told = (
        f"{amplitude(size, response.length)} at {number(ranges[near].shown(hz), 5)} {own.unit}"
        if np.isfinite(size)
        else ""
    )
    note = f"range {own}{near.where}" + f"; largest there {told}" * bool(told)
    if margins[near]:
        return Card(
            own.where(ranges[near].shown(response.peak_hz(near))), "margin of the peak to the operating range", note
        )
    inside = sum(not m for m in margins.values())
    count = f"{inside} of {len(cases)} peaks" if len(cases) > 1 else "peak"
    return Card("Inside", f"{count} in the operating range", note)


def _shift_card(response: Response) -> Card | None:
    within = [c for c in response.peaked if response.resonates(c)]
    if len(within) < 2:
        return None
    first, last = within[0], within[-1]
    x, _, unit = abscissa(response)
    a, b = (float(x[response.peak(c)]) for c in (first, last))
    blades = [response.blade_at_peak(c) for c in (first, last)]
    note = f"from {number(a, 5)} {unit}{blades[0]}{first.where} to {number(b, 5)} {unit}{blades[1]}{last.where}"
    label = f"shift of the peak ({percent(100 * (b / a - 1))})"
    return Card(f"{number(b - a)} {unit}", label, note)


def _damping_card(response: Response) -> Card | None:
    """Return quality factor and equivalent damping ratio of the case shown first, with the range of all cases."""
    ratios = {c: response.numbers_of[c.index].peak_damping for c in response.peaked}
    known = {c: z for c, z in ratios.items() if z > 0 and response.resonates(c)}
    shown = next((c for c in known if c.index == response.chosen), None)
    if shown is None:
        return None
    note = f"damping ratio {percent(100 * known[shown])}{shown.where}"
    if response.trust(shown):
        note += f", {response.level(shown)}"
    if len(known) > 1:
        ends = [percent(100 * z) for z in (min(known.values()), max(known.values()))]
        note += f"; {ends[0]} to {ends[1]} over {len(known)} cases"
    return Card(number(0.5 / known[shown]), "quality factor at the peak", note)


def _blade_card(response: Response) -> Card | None:
    """Return the largest amplification of a mistuned wheel, and its blade."""
    factors = {c: response.blades[c.index].amplification for c in response.peaked}
    known = sorted((c for c in factors if np.isfinite(factors[c])), key=lambda c: factors[c])
    if not known:
        return None
    told = [f"blade {response.blades[c.index].largest_blade}{c.where}" for c in (known[-1], known[0])]
    note = f"largest: {told[0]}"
    if len(known) > 1:
        note += f"; smallest of {len(known)} cases {number(factors[known[0]])}, {told[1]}"
    label = f"{'largest ' * (len(known) > 1)}amplification over the wheel with all sectors alike"
    return Card(number(factors[known[-1]]), label, note)


def _loss_card(response: Response) -> Card | None:
    """Return the energy dissipated at the peak of a single case; several cases show their frequency shift instead."""
    own = response.fields.dissipated_energy
    if len(response.peaked) != 1 or not np.isfinite(own).any():
        return None
    energy = float(np.nansum(own[response.peak(response.peaked[0])]))
    lost = quantity(energy if energy > 1e-12 else 0.0, "J")
    return Card(lost, "lost in a cycle at the peak", f"by all contacts{response.of_sector} together")


def cards(response: Response) -> list[Card]:
    """Return the numbers at the head of the page, the answer first."""
    found = (
        _answer(response),
        stress_card(response),
        _damping_card(response),
        _blade_card(response),
        _operation_card(response),
        _shift_card(response),
        _loss_card(response),
    )
    return [card for card in found if card is not None]


def peaks(response: Response) -> Table:
    """Return a table with one row a case: peak, points, work."""
    cases, (x, _, unit_at) = response.cases, abscissa(response)
    value = np.array([response.peak_response(c) for c in cases])
    force = np.array([c.excitation for c in cases])
    newton, forces = column(force, "N")
    length, sizes = column(value * (force if response.per_force else 1.0), response.length, millimetres=True)
    unit, ratios = column(value if response.per_force else value * np.nan, response.unit)
    zeta = np.array([own.peak_damping for own in response.numbers_of])
    head = [
        f"excitation ({newton})",
        f"peak ({length})",
        f"peak / force ({unit})",
        f"at ({unit_at})",
        "damping ratio (%)",
        "quality factor",
        "verdict",
        "points",
        f"with H = {response.first_name}",
        f"with {response.more_name if response.decides else 'other H'}",
        "failed",
        "Newton steps",
        "unknowns solved",
        "contact (s)",
        "linear (s)",
        "rest (s)",
    ]
    dampings, qualities = aligned(100 * zeta, 3), aligned(0.5 / zeta, 3)
    places = [float(x[response.peak(c)]) if response.peak(c) >= 0 else np.nan for c in cases]
    rows = [
        [
            case.short,
            *own,
            fixed(place, 2),
            damping,
            quality,
            response.level(case) or NONE,
            *_work(response.numbers_of[case.index]),
        ]
        for case, *own, place, damping, quality in zip(
            cases, forces, sizes, ratios, places, dampings, qualities, strict=True
        )
    ]
    told = [*_force_sentence(response), *_damping_sentence(zeta), *_work_sentence(response)]
    return response.table("", told, head, rows)


def _force_sentence(response: Response) -> list[str]:
    if not response.per_force:
        return []
    return ["The excitation is the amplitude of the largest harmonic force of a case; responses are divided by it."]


def _damping_sentence(zeta: FloatArray) -> list[str]:
    if not np.isfinite(zeta).any():
        return []
    text = "The equivalent damping ratio is the work of the load in a cycle over 4π times the largest energy stored in structure and contacts. The quality factor is half its inverse."
    return [text]


def _work(of: CaseNumbers) -> list[str]:
    counts = (of.points, of.points_low, of.points_high, of.points_failed, of.newton_steps, of.unknowns_solved)
    seconds = (of.seconds_contact, of.seconds_linear, of.seconds_rest)
    return [fixed(n, 0) if n >= 0 else NONE for n in counts] + [fixed(s, 2) for s in seconds]


def _work_sentence(response: Response) -> list[str]:
    each = np.array([(n.seconds_contact, n.seconds_linear, n.seconds_rest) for n in response.numbers_of])
    spent = dict(zip(("the contact laws", "linear algebra", "the rest"), np.nansum(each, axis=0).tolist(), strict=True))
    total = sum(spent.values())
    if total <= 0:
        return []
    shares = [f"{number(100 * s / total, 2)} % in {text}" for text, s in spent.items()]
    return [f"The solver took {quantity(total, 's')}: {', '.join(shares)}."]


SECTION: Section = Section(
    "forced_response",
    NEEDED,
    Response,
    (
        Block("response", "Forced response", (frequency_response, of_each_order)),
        Block("optimisation", "Optimisation curves", (optimisation, where_friction_works, what_is_needed)),
        Block("stress", "Stress and margin", (stressed_case, stress_surface, haigh, worst_places, stress_cycle)),
        Block("wheel", "Blades of the wheel", (blades, peaks_of_blades, wheel_at_peak, wheel_in_motion, statistics)),
        Block(
            "contact",
            "Contacts at the peak",
            (chosen_case, in_motion, state_map, surface_map, hysteresis_t, hysteresis_w, energy, bodies),
        ),
        Block("friction_ratio", "T/N at the contacts", (chosen_case, friction_ratio_t, friction_ratio_w), folded=True),
        Block("cases", "Cases", (peaks,), folded=True),
        Block(
            "checks",
            "Checks",
            (
                shooting,
                stability,
                bifurcations,
                amplitudes_in_time,
                statistics_in_time,
                time_integration,
                retention,
            ),
            folded=True,
        ),
        Block(
            "harmonics",
            "Harmonics: where more were needed, and what they cost",
            (
                choice,
                kept_harmonics,
                errors,
                error_scatter,
                low_order,
                more_harmonics,
                jacobian_change,
                jacobian_blocks,
                attempts,
            ),
            folded=True,
        ),
    ),
    cards=cards,
    answer=(optimisation, frequency_response),
)
