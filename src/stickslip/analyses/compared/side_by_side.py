"""The page of a comparison of designs: peaks, responses, optimisation curves, nonlinear modes, flutter margins, limit cycles, inputs."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.compared.designs import Design, MeasuredCurve, differences, per_force
from stickslip.analyses.forced_response.page.many_cases import FEW
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.verdicts.margin import utilisation_of
from stickslip.analyses.limit_cycle.page import SECTION as LIMIT_CYCLES
from stickslip.analyses.limit_cycle.page import cycle_table
from stickslip.analyses.nonlinear_mode.page import SECTION as MODES
from stickslip.analyses.nonlinear_mode.page import Modes
from stickslip.analyses.nonlinear_mode.page import table as mode_table
from stickslip.analyses.waves.page.flutter import SECTION as FLUTTER
from stickslip.analyses.waves.page.flutter import margins
from stickslip.analyses.waves.page.waves import Waves
from stickslip.analyses.waves.records import Flutter, hertz
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase, families_of, first_number
from stickslip.report.frame import Chapter, Conclusion, Placing, concluded, page_html
from stickslip.report.plot import BROKEN, COLOURS, DASHES, INK, MUTED, Plot, log_ticks, styled
from stickslip.report.quantities import (
    NONE,
    Scale,
    column,
    counted,
    fixed,
    joined,
    number,
    percent,
    quantity,
    scale_for,
)
from stickslip.report.result import Node, analysis
from stickslip.report.section import Card, Chooser, Content, Section, Table, Words, chooser
from stickslip.study.coordinates import naming_of
from stickslip.study.file.case_names import without_common_words
from stickslip.study.verdict import JOINT, POINT_LEVELS, UNSTABLE, conclusion, not_trusted, of_tree

View = TypeVar("View", bound=Node)


def told_by(designs: Sequence[Design], section: Section) -> list[tuple[Design, str, Any]]:
    """Return every case of the designs with the analysis of a section: design, label, view."""
    found = []
    for design in designs:
        if section.name in design.tree.children:
            data = analysis(design.tree, section.name)
            for k in range(data.sizes.get("case", 1)):
                view = section.view(data.isel(case=k) if "case" in data.dims else data)
                if view.has(*section.needs):
                    found.append((design, view.text("case_label"), view))
    return found


def stacked(views: Sequence[tuple[Design, str, View]], table: Callable[[View], Table | Words]) -> list[Content]:
    """Join the tables of all cases, with columns for design and case in front; texts of cases without a table follow as a list."""
    head: Sequence[str] = ()
    rows, words = [], []
    for design, label, view in views:
        own, said = table(view), f"**{design.name}**{f' ({label})' * bool(label)}: "
        if isinstance(own, Table):
            head = own.head
            rows += [[design.name, label or NONE, *row] for row in own.rows]
            words += [said + item for item in own.items]
        else:
            words += [said + item for item in own.told]
    found: list[Content] = [Table(["design", "case", *head], rows)] if rows else []
    return [*found, Words(items=words)] if words else found


def nonlinear_modes(designs: Sequence[Design]) -> list[Content]:
    """Return figure and table of the nonlinear modes: frequency and damping over the amplitude."""
    views: list[tuple[Design, str, Modes]] = told_by(designs, MODES)
    if not views:
        return []
    every = np.concatenate([branch.amplitude for _, _, v in views for branch in v.found.branches])
    scale = scale_for(np.array([np.nanmedian(every)]), "m")
    figure = make_subplots(1, 2, horizontal_spacing=0.12)
    for k, (design, label, view) in enumerate(views):
        before = sum(own is design for own, _, _ in views[:k])
        for i, branch in enumerate(view.found.branches):
            name = ", ".join(word for word in (design.name, label, branch.name) if word)
            dash = DASHES[(before + i) % len(DASHES)]
            amplitude = branch.amplitude[branch.known]
            for panel, y in enumerate((branch.frequency_hz, 100.0 * branch.damping_ratio), 1):
                figure.add_scatter(
                    x=scale.factor * amplitude,
                    y=y[branch.known],
                    mode="lines",
                    name=name,
                    legendgroup=name,
                    showlegend=panel == 1,
                    line={"color": design.colour, "width": 1.8, "dash": dash},
                    hovertemplate=f"%{{y:.6g}} at %{{x:.4g}} {scale.unit}<extra>{name}</extra>",
                    row=1,
                    col=panel,
                )
    styled(figure, 420)
    outputs = " or ".join(dict.fromkeys(v.found.output for _, _, v in views))
    figure.update_xaxes(type="log", title_text=f"amplitude of {outputs} ({scale.unit})")
    figure.update_yaxes(title_text="frequency (Hz)", col=1)
    figure.update_yaxes(title_text="damping ratio (%)", col=2)
    caption = "Frequency and damping ratio of the modes over their amplitude."
    plot = Plot("compared_nonlinear_modes", "Nonlinear modes over each other", caption, figure)
    return [plot, *stacked(views, mode_table)]


def flutter(designs: Sequence[Design]) -> list[Content]:
    """Return figure and table of the flutter margins: damping over the phase angle, and all waves."""
    views: list[tuple[Design, str, Waves[Flutter]]] = told_by(designs, FLUTTER)
    if not views:
        return []
    figure = go.Figure()
    for k, (design, label, view) in enumerate(views):
        before = sum(own is design for own, _, _ in views[:k])
        angle = np.array([w.phase_angle_deg for w in view.found.waves])
        order = np.argsort(angle, kind="stable")
        for m, own in enumerate(100.0 * view.found.damping.T):
            name = ", ".join(word for word in (design.name, label, f"mode {m + 1}") if word)
            figure.add_scatter(
                x=angle[order],
                y=own[order],
                mode="lines+markers",
                name=name,
                line={"color": design.colour, "width": 1.4, "dash": DASHES[(before + m) % len(DASHES)]},
                hovertemplate=f"%{{y:.4g}} % at %{{x:.0f}}°<extra>{name}</extra>",
            )
    figure.add_hline(y=0.0, line={"color": INK, "width": 1})
    styled(figure, 440)
    figure.update_xaxes(title_text="inter-blade phase angle (degrees)", dtick=45)
    figure.update_yaxes(title_text="damping ratio (%)")
    caption = "Total damping, of flow and structure, at the waves that the wheels have."
    plot = Plot("compared_flutter", "Flutter margins over each other", caption, figure)
    return [plot, *stacked(views, margins)]


def limit_cycles(designs: Sequence[Design]) -> list[Content]:
    """Return the limit cycles of all designs in one table."""
    return stacked(told_by(designs, LIMIT_CYCLES), cycle_table)


_BEST = "best of each"
_CHOICE = ("selection", "high_order", "passages")  # attributes that say how harmonics were chosen
_MOST_INPUTS = 400  # characters of a value that a cell shows
_SYMBOLS = {"trusted": "circle", "doubtful": "circle-open", "wrong": "x", UNSTABLE: "circle-open-dot"}


def amplitudes(design: Response, *, divided: bool) -> FloatArray:
    """Return (point,) amplitudes in m, or per newton; NaN at unconverged points."""
    whole = design.at_outputs(design.values("amplitude", "point", "output"))
    force = np.array([c.excitation for c in design.cases])[design.point_case]
    return np.where(design.converged, whole / force if divided else whole, np.nan)


def unit_of(designs: Sequence[Design], *, divided: bool) -> str:
    """Return the unit of `amplitudes`."""
    length = next((d.response.length for d in designs if d.response), "m")
    return f"{length}/N" if divided else length


def over_first(value: float, first: float) -> float:
    """Return the difference of a value from the first one in percent; NaN if the first is zero."""
    return 100.0 * (value / first - 1.0) if first else float("nan")


def choices(designs: Sequence[Design]) -> tuple[ShownCase, ...]:
    """Return the choices of the reader: best case of each design, then every case; none if each design has one case."""
    every = _every_case([d.response for d in designs if d.response and len(d.response.cases) > 1])
    names = [(_BEST, ()), *((c.label, c.assigned) for c in every)] if every else []
    return tuple(ShownCase(i, name, float("nan"), float("nan"), own, MUTED) for i, (name, own) in enumerate(names))


def _every_case(responses: Iterable[Response]) -> list[ShownCase]:
    """Return the cases of all responses, common ones once."""
    found: dict[frozenset[str], ShownCase] = {}
    for case in (c for response in responses for c in response.cases):
        found.setdefault(case.identity, case)
    return list(found.values())


def _case(design: Design, choice: ShownCase, *, divided: bool) -> ShownCase | None:
    cases = design.response.cases if design.response else ()
    if choice.index == 0:
        return design.best(divided=divided)
    return cases[0] if len(cases) == 1 else design.case(choice)


def opening(designs: Sequence[Design], offered: Sequence[ShownCase], *, divided: bool) -> ShownCase | None:
    """Return the initial choice: a case common to all designs, preferably the first design's best; else the best of each.

    The best cases of two designs may have different loads, and are then no comparison.
    """
    told = [d for d in designs if d.response is not None]
    common = [c for c in offered[1:] if all(_case(d, c, divided=divided) for d in told)]
    best = told[0].best(divided=divided) if told else None
    of_first = [c for c in common if best is not None and c.identity == best.identity]
    return next(iter([*of_first, *common, *offered]), None)


def responses(designs: Sequence[Design], curves: Sequence[MeasuredCurve]) -> Plot | None:
    """Draw the responses of all designs together, one case at a time."""
    told = [d for d in designs if d.response is not None]
    if not told:
        return None
    divided, figure, offered = per_force(designs, curves), go.Figure(), choices(designs)
    unit = unit_of(designs, divided=divided)
    every = [amplitudes(d.response, divided=divided) for d in told if d.response]
    scale = scale_for(np.concatenate([*every, *(c.amplitude for c in curves)]), unit)
    for design, own in zip(told, every, strict=True):
        response = design.response
        if response is None:
            continue
        pairs: list[tuple[int | None, ShownCase | None]]
        pairs = [(choice.index, _case(design, choice, divided=divided)) for choice in offered]
        if not offered or len(response.cases) == 1:
            pairs = [(None, response.cases[0])]
        for k, case in pairs:
            if case is not None:
                figure.add_trace(_line(design, response, case, own * scale.factor, scale).update(meta=k))
    for k, curve in enumerate(curves):
        figure.add_scatter(
            x=curve.hz,
            y=scale.factor * curve.amplitude,
            mode="lines+markers",
            name=curve.name,
            line={"color": INK, "width": 1.2, "dash": BROKEN[k % len(BROKEN)]},
            marker={"size": 4, "color": INK},
            hovertemplate=f"%{{y:.4g}} {scale.unit} at %{{x:.5g}} Hz<extra>{curve.name}</extra>",
        )
    styled(figure, 540)
    drawn = np.concatenate([np.asarray(t.y, dtype=float) for t in figure.data])
    over = " / force" if divided else ""
    figure.update_yaxes(title_text=f"amplitude{over} ({scale.unit})", type="log", **log_ticks(drawn))
    figure.update_xaxes(title_text="frequency (Hz)")
    caption = f"Amplitude of {_outputs(told)}. Open symbols are doubtful points, crosses wrong ones, open symbols with a dot unstable ones."
    captions = {c.index: _shown(told, c, divided=divided) for c in offered}
    first = opening(designs, offered, divided=divided)
    chosen = first.index if first else -1
    return Plot("compared_responses", "Responses over each other", caption, figure, captions, chosen)


def _outputs(designs: Sequence[Design]) -> str:
    """Name the compared outputs; equal names once."""
    names = {d.name: d.response.output_name for d in designs if d.response}
    if len({*names.values()}) == 1:
        return next(iter(names.values()))
    return joined([f"{output} ({name})" for name, output in names.items()])


def _shown(designs: Sequence[Design], choice: ShownCase, *, divided: bool) -> str:
    """Name the case drawn for each design, and the designs without one."""
    own = [(d, _case(d, choice, divided=divided)) for d in designs]
    there = [f"{d.name}: {c.label or 'its only case'}" for d, c in own if c is not None]
    without = [d.name for d, c in own if c is None]
    lacks = f" Without this case: {', '.join(without)}." if without else ""
    return f"Drawn: {'; '.join(there)}.{lacks}"


def _line(design: Design, response: Response, case: ShownCase, y: FloatArray, scale: Scale) -> go.Scatter:
    at = response.points(case)
    symbols = np.array([_SYMBOLS[level] for level in POINT_LEVELS])[response.levels[at]]
    return go.Scatter(
        x=response.hz[at],
        y=y[at],
        mode="lines+markers",
        name=design.name,
        line={"color": design.colour, "width": 1.8},
        marker={"symbol": symbols.tolist(), "size": 5, "color": design.colour, "line": {"width": 1}},
        hovertemplate=f"%{{y:.4g}} {scale.unit} at %{{x:.5g}} Hz{f'<br>{case.label}' * bool(case.label)}<extra>{design.name}</extra>",
    )


def optimisation(designs: Sequence[Design], *, divided: bool) -> Plot | None:
    """Draw the optimisation curves of all designs together, if at least two vary the same number."""
    numbered = [(d, d.response, first_number(d.response.data)[0]) for d in designs if d.response]
    keys = [key for _, _, key in numbered]
    key = max(keys, key=keys.count, default="")
    told = [(d, r) for d, r, own in numbered if own == key and len(r.peaked) > 1]
    if not key or len(told) < 2:
        return None
    if max(len(families_of(r.data, key, r.peaked)) for _, r in told) > FEW:
        return _differences_of_peaks(told, key, divided=divided)
    naming = naming_of(told[0][1].data, key)
    figure, heights = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.62, 0.38]), []
    curves = []
    for design, response in told:
        groups = families_of(response.data, key, response.peaked)
        for k, (others, cases) in enumerate(groups.items()):
            peak = np.array([_peak(response, c, divided=divided) for c in cases])
            heights.append(peak)
            name = ", ".join(filter(None, (design.name, others)))
            drawn_as = {"color": design.colour, "width": 1.8, "dash": DASHES[k % len(DASHES)]}
            values, hz = [naming.shown(c.value) for c in cases], [response.peak_hz(c) for c in cases]
            curves.append((name, drawn_as, values, peak, hz))
    unit_drawn = unit_of(designs, divided=divided)
    scale = scale_for(np.concatenate(heights), unit_drawn)
    for name, drawn_as, values, peak, hz in curves:
        for panel, (y, unit) in enumerate(((scale.factor * peak, scale.unit), (hz, "Hz")), 1):
            figure.add_scatter(
                x=values,
                y=y,
                mode="lines+markers",
                name=name,
                showlegend=panel == 1,
                legendgroup=name,
                line=drawn_as,
                hovertemplate=f"%{{y:.4g}} {unit} at %{{x:.4g}}<extra>{name}</extra>",
                row=panel,
                col=1,
            )
    styled(figure, 480)
    every = [value for _, _, own, _, _ in curves for value in own]
    wide = min(every) > 0 and max(every) > 5 * min(every)
    figure.update_xaxes(type="log" if wide else "linear")
    figure.update_xaxes(title_text=naming.title, row=2)
    drawn = scale.factor * np.concatenate(heights)
    over = " / force" if divided else ""
    figure.update_yaxes(title_text=f"peak amplitude{over} ({scale.unit})", type="log", **log_ticks(drawn), row=1)
    figure.update_yaxes(title_text="peak frequency (Hz)", row=2)
    lowest = min(((float(np.nanmin(p)), n, v[int(np.nanargmin(p))]) for n, _, v, p, _ in curves), key=lambda t: t[0])
    caption = (
        f"Peak and its frequency over {naming.title}. The smallest peak of all belongs to {lowest[1]}, {quantity(lowest[0], unit_drawn)} at {number(lowest[2], 4)} {naming.unit}".rstrip()
        + "."
    )
    return Plot("compared_optimisation", "Optimisation curves over each other", caption, figure)


def _differences_of_peaks(told: Sequence[tuple[Design, Response]], key: str, *, divided: bool) -> Plot | None:
    """Draw the relative difference of the peaks of each later design from the first design, one panel a design."""
    rows = [row for row in peak_rows([d for d, _ in told], divided=divided) if np.isfinite(row.off_percent)]
    families = {
        c.label: (name, c.value) for _, r in told for name, f in families_of(r.data, key, r.peaked).items() for c in f
    }
    later = [d.name for d, _ in told[1:] if any(row.design == d.name for row in rows)]
    if not later:
        return None
    names = list(dict.fromkeys(families[row.case][0] for row in rows))
    values = sorted({families[row.case][1] for row in rows})
    naming, (title, rows_of) = naming_of(told[0][1].data, key), without_common_words(names)
    figure = make_subplots(
        1,
        len(later),
        shared_yaxes=True,
        subplot_titles=[f"{name} against {told[0][0].name} (%)" for name in later],
        horizontal_spacing=0.03,
    )
    most = max(abs(row.off_percent) for row in rows) or 1.0
    for k, design in enumerate(later, 1):
        off = np.full((len(names), len(values)), np.nan)
        for row in rows:
            if row.design == design:
                off[names.index(families[row.case][0]), values.index(families[row.case][1])] = row.off_percent
        cells = go.Heatmap(
            x=[number(naming.shown(v), 4) for v in values],
            y=rows_of,
            z=off,
            text=[[number(v, 2) if np.isfinite(v) else "" for v in line] for line in off],
            texttemplate="%{text}",
            zmin=-most,
            zmax=most,
            colorscale=[[0.0, COLOURS[2]], [0.5, "#ffffff"], [1.0, COLOURS[1]]],
            showscale=False,
            hovertemplate=f"%{{y}}, %{{x}}<br>%{{z:.3g}} %<extra>{design}</extra>",
        )
        figure.add_trace(cells, 1, k)
    styled(figure, 170 + 26 * len(names))
    figure.update_xaxes(type="category", title_text=naming.title)
    figure.update_yaxes(type="category", autorange="reversed")
    figure.update_yaxes(title_text=title, col=1)
    worst, best = (pick(rows, key=lambda row: row.off_percent) for pick in (max, min))
    text = f"Peak of each case over the one of {told[0][0].name}, in percent: orange where it is larger, green where it is smaller. Largest: {number(worst.off_percent)} % ({worst.design}, {worst.case}); smallest: {number(best.off_percent)} % ({best.design}, {best.case})."
    return Plot("compared_optimisation", "Peaks against the first design", text, figure)


def _peak(response: Response, case: ShownCase, *, divided: bool) -> float:
    at = response.peak(case)
    return float(amplitudes(response, divided=divided)[at]) if at >= 0 else float("nan")


@dataclass(frozen=True)
class PeakRow:
    """The peak of a case of a design, in Hz and SI units, and its difference from the first design (NaN if it lacks the case).

    NaN as well is the utilisation of the fatigue limit at its worst place, where none is told.
    """

    case: str
    design: str
    hz: float
    height: float
    level: str
    off_percent: float
    shift_hz: float
    utilisation: float


def peak_rows(designs: Sequence[Design], *, divided: bool) -> list[PeakRow]:
    """Return one row for each case of each design, in the order of cases."""
    told = [(d, d.response) for d in designs if d.response is not None]
    found = []
    for like_case in _every_case(r for _, r in told):
        for design, response in told:
            case, (first, of_first) = design.case(like_case), told[0]
            if case is None:
                continue
            height, hz = _peak(response, case, divided=divided), response.peak_hz(case)
            like, off, shift = first.held_against(case, design), float("nan"), float("nan")
            if design is not first and like is not None and _same_load(case.excitation, like.excitation):
                off = over_first(height, _peak(of_first, like, divided=divided))
                shift = hz - of_first.peak_hz(like)
            used = utilisation_of(response.data, case.index)
            found.append(PeakRow(like_case.label, design.name, hz, height, response.level(case), off, shift, used))
    return found


def peaks(designs: Sequence[Design], *, divided: bool) -> Table | None:
    """Return a table with one row for each case of each design: the peak, and its difference from the first design."""
    found = peak_rows(designs, divided=divided)
    if not found:
        return None
    unit, cells = column(np.array([p.height for p in found]), unit_of(designs, divided=divided))
    head = ["case", "design", f"peak ({unit})", "at (Hz)", "verdict", "against the first (%)", "shift (Hz)"]
    stressed = any(not np.isnan(p.utilisation) for p in found)
    return Table(
        [*head, *["utilisation"] * stressed],
        [
            [
                p.case or NONE,
                p.design,
                cell,
                fixed(p.hz, 3),
                p.level or NONE,
                fixed(p.off_percent, 2),
                fixed(p.shift_hz, 3),
                *[number(p.utilisation, 3)] * stressed,
            ]
            for p, cell in zip(found, cells, strict=True)
        ],
    )


def against_curves(designs: Sequence[Design], curves: Sequence[MeasuredCurve]) -> Table | None:
    """Return a table of differences between each case of each design and each reference curve: at the peak, and along the curve."""
    if not curves:
        return None
    divided, rows = per_force(designs, curves), []
    for curve in curves:
        top = int(np.argmax(curve.amplitude))
        every = [(d, d.response, c) for d in designs if d.response for c in d.response.cases]
        for design, response, case in every:
            height, hz = _peak(response, case, divided=divided), response.peak_hz(case)
            off = percent(over_first(height, float(curve.amplitude[top])), 3)
            rows.append(
                [
                    curve.name,
                    design.name,
                    case.label or NONE,
                    off,
                    fixed(hz - float(curve.hz[top]), 3),
                    _along(response, case, curve, divided=divided),
                ]
            )
    head = ["curve", "design", "case", "peak off by", "frequency off by (Hz)", "largest difference along it"]
    told = "Along a curve: the difference of the amplitudes over the curve's peak, where frequencies of both overlap, with straight lines between the points of the design."
    return Table(head, rows, "Against other curves", (told,))


def _along(response: Response, case: ShownCase, curve: MeasuredCurve, *, divided: bool) -> str:
    at = response.points(case)
    own = amplitudes(response, divided=divided)[at]
    hz = response.hz[at]
    if np.any(np.diff(hz) < 0):
        return "the response folds"
    known = np.isfinite(own)
    if np.count_nonzero(known) < 2:
        return NONE
    inside = (curve.hz >= hz[known][0]) & (curve.hz <= hz[known][-1])
    if not np.any(inside):
        return "no common frequency"
    off = np.interp(curve.hz[inside], hz[known], own[known]) - curve.amplitude[inside]
    worst = int(np.argmax(np.abs(off)))
    return f"{percent(100 * float(off[worst]) / float(curve.amplitude.max()), 3)} at {number(float(curve.hz[inside][worst]), 5)} Hz"


def frequencies(designs: Sequence[Design]) -> Table | None:
    """Return a table of natural frequencies, wave by wave, compared with the first design."""
    told = [(d, d.modes) for d in designs if d.modes is not None]
    if len(told) < 2:
        return None
    known = [
        {(w, m): float(f) for w, row in zip(v.waves, hertz(v.found), strict=True) for m, f in enumerate(row)}
        for _, v in told
    ]
    rows = []
    for wave, mode in known[0]:
        if all((wave, mode) in each for each in known):
            own = [each[wave, mode] for each in known]
            rows.append(
                [
                    f"{wave}, mode {mode + 1}",
                    *(number(f, 7) for f in own),
                    *(percent(over_first(f, own[0]), 3) for f in own[1:]),
                ]
            )
    head = ["", *(f"{d.name} (Hz)" for d, _ in told), *(f"{d.name} off by" for d, _ in told[1:])]
    several = any(d.tree["modes"].sizes.get("case", 1) > 1 for d, _ in told)
    said = ("Of the first case of each design.",) if several else ()
    return Table(head, rows, "Natural frequencies", said) if rows else None


def inputs(designs: Sequence[Design]) -> Table | Words:
    """Return a table of the differences between the study files."""
    rows, title = differences(designs), "What differs between the study files"
    without = [d.name for d in designs if not d.inputs]
    told = [f"Made without a study file, inputs not known: {', '.join(without)}."] if without else []
    if not rows:
        return Words([*told, "Nothing differs that the results know of."])
    cells = [[c if len(c) <= _MOST_INPUTS else f"{c[:_MOST_INPUTS]} …" for c in row] for row in rows]
    return Table(["key", *(d.name for d in designs)], cells, "", [title + ".", *told], numeric=False)


def cards(designs: Sequence[Design], *, divided: bool) -> list[Card]:
    """Return the numbers at the head: the best case of each design, and the initial case of each if all designs have it."""
    offered = choices(designs)
    shown = opening(designs, offered, divided=divided)
    best = [(d, d.best(divided=divided)) for d in designs]
    unit = unit_of(designs, divided=divided)
    found = _held(best, "best peak of {}" if offered else "peak of {}", unit, divided=divided)
    if shown is None or shown.index == 0:
        return found
    alike = [(d, _case(d, shown, divided=divided)) for d in designs]
    if [c and c.identity for _, c in alike] == [c and c.identity for _, c in best]:
        return found
    return [*found, *_held(alike, f"peak of {{}} at {shown.label}", unit, divided=divided)]


def _held(pairs: Sequence[tuple[Design, ShownCase | None]], label: str, unit: str, *, divided: bool) -> list[Card]:
    """Return a card for each design at a case, compared with the first design, with its cost where harmonics are chosen differently."""
    found: list[Card] = []
    first, against, loaded = float("nan"), "", float("nan")
    reference: MeasuredCurve | None = None
    costed = len({tuple(str(d.response.data.attrs.get(k)) for k in _CHOICE) for d, _ in pairs if d.response}) > 1
    for design, case in pairs:
        response = design.response
        if case is None or response is None:
            continue
        height = _peak(response, case, divided=divided)
        note = f"at {number(response.peak_hz(case), 5)} Hz{case.where}; {response.level(case) or 'no verdict'}"
        if not found:
            first, against, loaded = height, label.format(design.name), case.excitation
            reference = _as_curve(response, case, divided=divided)
        elif not _same_load(case.excitation, loaded):
            note += f"; loaded by {quantity(case.excitation, 'N')}, {against} by {quantity(loaded, 'N')}: not compared"
        else:
            off = over_first(height, first)
            how = f"{percent(abs(off), 3)} {'more' if off > 0 else 'less'} than" if off else "equal to the"
            note += f"; {how} {against}"
            if costed and reference is not None:
                note += _farthest(response, case, reference, divided=divided)
        unknowns = dict(zip(response.cases, response.numbers_of, strict=True))[case].unknowns_solved
        if costed and unknowns >= 0:
            note += f"; {counted(unknowns, 'unknown')} solved"
        found.append(Card(quantity(height, unit), label.format(design.name), note))
    return found


def _as_curve(response: Response, case: ShownCase, *, divided: bool) -> MeasuredCurve | None:
    """Return the response of a case as a reference for others; None where it folds or hardly has a point."""
    at = response.points(case)
    own, hz = amplitudes(response, divided=divided)[at], response.hz[at]
    known = np.isfinite(own)
    if np.count_nonzero(known) < 2 or np.any(np.diff(hz) < 0):
        return None
    return MeasuredCurve("", hz[known], own[known], divided)


def _farthest(response: Response, case: ShownCase, reference: MeasuredCurve, *, divided: bool) -> str:
    """Return the clause on the largest difference along the curve, beside the cost; empty where curves cannot be compared."""
    told = _along(response, case, reference, divided=divided)
    return f"; along the curve up to {told} of its peak" if "%" in told else ""


def _same_load(one: float, other: float) -> bool:
    """Whether two excitations (N) agree to six digits, or neither is known."""
    return bool(np.isclose(one, other, rtol=1e-6, atol=0.0, equal_nan=True))


def contents(designs: Sequence[Design], curves: Sequence[MeasuredCurve]) -> list[tuple[str, str, list[Content]]]:
    """Return the chapters of a comparison: key, title, and contents.

    Raises
    ------
    InputError
        If curves and designs have different units.
    """
    divided, offered = per_force(designs, curves), choices(designs)
    first = opening(designs, offered, divided=divided)
    verdicts = Words(items=[f"**{d.name}**: {conclusion(d.tree)}" for d in designs])
    each: list[tuple[str, str, list[Content | None]]] = [
        ("verdicts", "Verdicts", [verdicts]),
        (
            "responses",
            "Forced response",
            [
                chooser("case", offered, first.index if first else -1),
                responses(designs, curves),
                against_curves(designs, curves),
            ],
        ),
        ("optimisation", "Optimisation curves", [optimisation(designs, divided=divided)]),
        ("peaks", "Peaks", [peaks(designs, divided=divided)]),
        ("modes", "Modes", [frequencies(designs)]),
        ("nonlinear_modes", "Nonlinear modes", [*nonlinear_modes(designs)]),
        ("flutter", "Flutter", [*flutter(designs)]),
        ("limit_cycles", "Limit cycles", [*limit_cycles(designs)]),
        ("inputs", "Inputs", [inputs(designs)]),
    ]
    kept = [(key, title, [c for c in own if c is not None]) for key, title, own in each]
    return [chapter for chapter in kept if chapter[2]]


def answer(designs: Sequence[Design], *, divided: bool) -> Card | None:
    """Return the design with the smallest best peak, held against the first design, or against the next one if it is the first.

    Designs under other loads than the first one are left out. None if fewer than two designs have a response.
    """
    told = [(d, d.response, c) for d in designs if d.response and (c := d.best(divided=divided))]
    if len(told) < 2:
        return None
    unit, first = unit_of(designs, divided=divided), told[0]
    height = {d.name: _peak(r, c, divided=divided) for d, r, c in told}
    alike = [own for own in told if _same_load(own[2].excitation, first[2].excitation)]
    rising = sorted(alike, key=lambda own: height[own[0].name])
    best = rising[0]
    other = next((own for own in (first, *rising) if own is not best), None)
    what = "best peak" if choices(designs) else "peak"
    value = f"{best[0].name}: {quantity(height[best[0].name], unit)}"
    if other is None:
        loads = joined([f"{quantity(c.excitation, 'N')} ({d.name})" for d, _, c in told])
        return Card(value, what, f"Not compared, as the loads differ: {loads}.")
    off = over_first(height[best[0].name], height[other[0].name])
    label = f"{what}, {percent(abs(off), 3)} below {other[0].name}" if off else f"{what}, equal to {other[0].name}"
    each = [
        f"{d.name}: {quantity(height[d.name], unit)} at {number(r.peak_hz(c), 5)} Hz{c.where}, {r.level(c) or 'no verdict'}"
        for d, r, c in (best, other)
    ]
    return Card(value, label, f"{'. '.join(each)}.")


def _concluded(designs: Sequence[Design]) -> Conclusion:
    """Return the verdicts of all designs for the head of the page, each with the name of its design."""
    lines = {d.name: conclusion(d.tree) for d in designs}
    same = len({*lines.values()}) == 1
    told = (
        f"In each design: {lines[designs[0].name]}" if same else " ".join(f"{n}: {line}" for n, line in lines.items())
    )
    every = [replace(v, case=JOINT.join(filter(None, (d.name, v.case)))) for d in designs for v in of_tree(d.tree)]
    return concluded(every, told, bad=any(not_trusted(d.tree) for d in designs))


def comparison_html(designs: Sequence[Design], curves: Sequence[MeasuredCurve] = ()) -> str:
    """Return the page of a comparison; an `InputError` if curves cannot be compared with the designs.

    The page begins with the verdicts, the answer and its figure. The figure shows the optimisation curves, or the responses where
    there are none.
    """
    placing, divided = Placing(), per_force(designs, curves)
    each = {key: (title, list(own)) for key, title, own in contents(designs, curves) if key != "verdicts"}
    tiles, best = cards(designs, divided=divided), answer(designs, divided=divided)
    above: list[Content] = []
    for key in ("optimisation", "responses"):
        if not above and best is not None and key in each:
            own = each[key][1]
            above = [part for part in own if isinstance(part, Plot | Chooser)]
            each[key] = (each[key][0], [part for part in own if part not in above])
    head = placing(above)
    chapters = [Chapter(key, title, placing(own)) for key, (title, own) in each.items() if own]
    names = [d.name for d in designs]
    made = f"{counted(len(designs), 'design')}" + (f" and {counted(len(curves), 'curve')}" if curves else "")
    return page_html(
        f"{joined(names)} compared",
        made,
        chapters,
        cards=tiles if best is None else [best, *tiles],
        answer=head,
        conclusion=_concluded(designs),
    )
