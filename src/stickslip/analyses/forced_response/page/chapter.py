"""Forced responses on the page: boxes at its head, the table of cases, and the order of all figures and tables."""

import numpy as np

from stickslip.analyses.forced_response.page.bifurcations import bifurcations
from stickslip.analyses.forced_response.page.bodies import bodies, energy
from stickslip.analyses.forced_response.page.checks import (
    amplitudes_in_time,
    retention,
    stability,
    statistics_in_time,
    time_integration,
)
from stickslip.analyses.forced_response.page.contacts import (
    chosen_case,
    hysteresis_t,
    hysteresis_w,
    state_map,
    surface_map,
)
from stickslip.analyses.forced_response.page.curves import frequency_response, low_order, of_each_order
from stickslip.analyses.forced_response.page.errors import error_scatter, errors
from stickslip.analyses.forced_response.page.harmonics import attempts, choice, kept_harmonics, more_harmonics
from stickslip.analyses.forced_response.page.optimisation import optimisation, what_is_needed, where_friction_works
from stickslip.analyses.forced_response.page.response import NEEDED, Response
from stickslip.analyses.forced_response.page.wheel import (
    blades,
    peaks_of_blades,
    statistics,
    wheel_at_peak,
    wheel_in_motion,
)
from stickslip.analyses.forced_response.records.columns import CaseNumbers
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase
from stickslip.report.content import Table
from stickslip.report.quantities import (
    NONE,
    aligned,
    amplitude,
    column,
    counted,
    fixed,
    number,
    percent,
    predicted,
    quantity,
    scale_for,
)
from stickslip.report.section import Block, Card, Section
from stickslip.study.verdict import LEVELS, POINT_LEVELS


def _peak_card(response: Response) -> Card:
    cases = [c for c in response.peaked if np.isfinite(response.peak_response(c))]
    if not cases:
        return Card(NONE, "peak", "no case has its peak yet")
    within = [c for c in cases if response.resonates(c)]
    peaks = np.array([response.peak_response(c) for c in within or cases])
    least = min((response.trust(c) for c in within or cases), default=0)
    counts = np.array([response.trust(c) == least for c in within or cases])
    best = int(np.argmin(np.where(counts, peaks, np.inf)))
    scale = scale_for(peaks[best : best + 1], response.unit)
    size = f"{number(float(peaks[best]) * scale.factor)} {scale.unit}"
    no_resonance = "the largest amplitude stands at the end of the sweep: no resonance"
    if len(cases) == 1:
        more = _whole(response, cases[0]) if response.per_force else ""
        at = f"{response.peak_is(cases[0])}, at {number(response.peak_hz(cases[0]), 5)} Hz{more}"
        return Card(size, f"peak of {response.output_name}", at if within else f"{at}; {no_resonance}")
    if not within:
        return Card(size, cases[best].label, f"in every case {no_resonance}")
    left_out = len(cases) - len(within)
    blade = response.blade_at_peak(within[best])
    kind = counted(int(counts.sum()), "case")
    if not counts.all():
        kind = f"{int(counts.sum())} {LEVELS[least]} of {counted(len(within), 'case')}"
    note = f"{response.peak_is(within[best])}, {response.output_name}{within[best].where}{blade}, at {number(response.peak_hz(within[best]), 5)} Hz{_whole(response, within[best]) if response.per_force else ''}, {percent(100 * float(peaks[best] / peaks.max()))} of the largest"
    if within[best] in (response.cases[0], response.cases[-1]):
        note += f"; the {'first' if within[best] is response.cases[0] else 'last'} case, so that a smaller one may lie beyond"
    lower = int(np.argmin(peaks))
    if peaks[lower] < peaks[best]:
        note += f"; {number(float(peaks[lower]) * scale.factor)} {scale.unit} is {response.level(within[lower])}{within[lower].where}"
    if left_out:
        note += f"; of {counted(left_out, 'other')} the largest amplitude stands at the end of the sweep"
    return Card(size, f"smallest peak of {kind}", note)


def _whole(response: Response, case: ShownCase) -> str:
    """Return the absolute peak of a case whose response is divided by the force, as on the terminal."""
    return f", {amplitude(response.peak_response(case) * case.excitation, response.length)}"


def _shift_card(response: Response) -> Card | None:
    within = [c for c in response.peaked if response.resonates(c)]
    if len(within) < 2:
        return None
    first, last = within[0], within[-1]
    a, b = response.peak_hz(first), response.peak_hz(last)
    blades = [response.blade_at_peak(c) for c in (first, last)]
    note = f"from {number(a, 5)} Hz{blades[0]}{first.where} to {number(b, 5)} Hz{blades[1]}{last.where}"
    label = f"shift of the peak over the cases ({percent(100 * (b / a - 1))})"
    return Card(f"{number(b - a)} Hz", label, note)


def _damping_card(response: Response) -> Card | None:
    """Return quality factor and equivalent damping ratio of the case shown first, with the range of all cases."""
    ratios = {c: response.numbers_of[c.index].peak_damping for c in response.peaked}
    known = {c: z for c, z in ratios.items() if z > 0 and response.resonates(c)}
    shown = next((c for c in known if c.index == response.chosen), None)
    if shown is None:
        return None
    note = f"equivalent damping ratio {percent(100 * known[shown])}{shown.where}"
    if response.level(shown):
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


def _alert_cards(response: Response) -> list[Card]:
    """Return how often more harmonics were requested, and the error with few."""
    asked = response.alert
    if not asked.error.size:
        return []
    above, at = int(np.sum(asked.error > response.threshold)), int(np.argmax(asked.error))
    share = f"{number(100 * above / asked.error.size, 2)} %"
    note = f"{above} of {counted(asked.error.size, 'checked point')} above {percent(response.threshold)}"
    where = f"at {number(float(asked.hz[at]), 5)} Hz{response.cases[asked.case[at]].where}"
    worst = predicted(float(asked.error[at]))
    return [
        Card(share, "of points asked for more harmonics", note),
        Card(worst, f"worst predicted error with H = {response.low_name}", where),
    ]


def _work_cards(response: Response) -> list[Card]:
    """Return how often more harmonics were kept, if a strategy chose, and their cost."""
    n, found = int(response.converged.sum()), []
    if response.decides:
        more = int(np.sum(response.more & response.converged))
        note = f"{more} of {counted(n, 'accepted point')}, chosen by {response.selection}"
        label = f"of points keep other harmonics than H = {response.low_name}"
        found = [Card(f"{number(100 * more / n, 2)} %" if n else NONE, label, note)]
    work = sum(own.unknowns_solved for own in response.numbers_of)
    if work > 0:
        steps = sum(own.newton_steps for own in response.numbers_of)
        note = f"of all solutions together, in {counted(steps, 'Newton step')}"
        found.append(Card(number(work, 6), "unknowns solved", note))
    return found


def _verdict_card(response: Response) -> Card | None:
    """Return the number of trusted cases, or the verdict on a single case, and the number of points that are not trusted."""
    levels = [response.level(c) for c in response.cases]
    if not levels[0]:
        return None
    points = {level: int(np.sum(response.levels == k)) for k, level in enumerate(POINT_LEVELS) if k}
    off = [f"{n} {level}" for level, n in points.items() if n]
    note = f"of {counted(response.levels.size, 'point')} {', '.join(off) or 'none is doubtful'}"
    if len(levels) == 1:
        return Card(levels[0], "verdict on the case", note)
    cases = {level: levels.count(level) for level in LEVELS[1:]}
    others = [f"{n} {level}" for level, n in cases.items() if n]
    return Card(
        f"{levels.count('trusted')} of {len(levels)}",
        "cases to be trusted",
        "; ".join([*([", ".join(others)] if others else []), note]),
    )


def cards(response: Response) -> list[Card]:
    """Return the boxes at the head of the page."""
    first = (
        _peak_card(response),
        _damping_card(response),
        _blade_card(response),
        _verdict_card(response),
        _shift_card(response),
        _loss_card(response),
    )
    alert = response.is_error and response.decides and not response.auto
    rest = _alert_cards if alert else _work_cards
    return [card for card in first if card is not None] + rest(response)


def peaks(response: Response) -> Table:
    """Return a table with one row a case: peak, points, work."""
    cases = response.cases
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
        "at (Hz)",
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
    rows = [
        [
            case.short,
            *own,
            fixed(response.peak_hz(case), 2),
            damping,
            quality,
            response.level(case) or NONE,
            *_work(response.numbers_of[case.index]),
        ]
        for case, *own, damping, quality in zip(cases, forces, sizes, ratios, dampings, qualities, strict=True)
    ]
    told = [*_damping_sentence(zeta), *_work_sentence(response)]
    return response.table("", told, head, rows)


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
        Block("wheel", "Blades of the wheel", (blades, peaks_of_blades, wheel_at_peak, wheel_in_motion, statistics)),
        Block(
            "contact",
            "Contacts at the peak",
            (chosen_case, state_map, surface_map, hysteresis_t, hysteresis_w, energy, bodies),
        ),
        Block("cases", "Cases", (peaks,)),
        Block(
            "checks",
            "Checks",
            (
                stability,
                bifurcations,
                amplitudes_in_time,
                statistics_in_time,
                time_integration,
                retention,
            ),
        ),
        Block(
            "harmonics",
            "Harmonics: where more were needed, and what they cost",
            (choice, kept_harmonics, errors, error_scatter, low_order, more_harmonics, attempts),
            folded=True,
        ),
    ),
    cards=cards,
)
