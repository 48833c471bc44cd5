"""Contacts at the peak of each case: loops, states, T/N through a cycle, and surfaces seen along their normal."""

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from plotly.colors import sample_colorscale
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import MUTED, STATE_COLOURS, STATE_NAMES, STATE_SCALE, Plot, colour, legend_above, styled
from stickslip.report.quantities import counted, joined, number, percent, quantity
from stickslip.report.section import Chooser, chooser
from stickslip.report.tiles import outlines, patches
from stickslip.study.file.case_names import CASE

_ROUNDING = 1e-9  # area of a loop over the area of its bounding box, below which it is a line
SHOWN_LOOPS = 6  # panels shown, of the points that dissipate most; the others are folded away
_MOST_LOOPS = 24  # panels shown or folded away
_FAR = 3.0  # mean of a loop over its half range, above which the mean is removed so that ticks differ
_MOST_ROW = 4  # panels in a row, if contact lines have more points
_MOST_STATES = 40  # largest number of rows with names
_MOST_SAMPLES = 40_000  # samples of all loops of a figure, or of all rows of states
_FEWEST_SAMPLES = 32  # samples of a period


def chosen_case(response: Response) -> Chooser | None:
    """Return the buttons that choose the case of the figures below."""
    return chooser(CASE, response.peaked, response.chosen)


def contact_lines(response: Response) -> list[list[int]]:
    """Group the contact points of each contact by the part of their name before the last dot; one row of panels a group."""
    names = response.labels("contact")
    lines: dict[tuple[str, str], list[int]] = {}
    for group, members in response.groups.items():
        for index in members:
            lines.setdefault((group, names[index].rpartition(".")[0]), []).append(index)
    rows = list(lines.values())
    return rows if any(len(row) > 1 for row in rows) else [[row[0] for row in rows]]


def _wrapped(rows: list[list[int]]) -> list[list[int]]:
    """Break long rows into parts of about equal length."""
    found = []
    for row in rows:
        width = -(-len(row) // max(1, -(-len(row) // _MOST_ROW)))
        found += [row[k : k + width] for k in range(0, len(row), width)]
    return found


def states(response: Response, case: ShownCase) -> IntArray:
    """Return the (contact, tangent, sample) states of a case at its peak: 0 stick, 1 slip, 2 open."""
    return response.periods[case.index].peak_state


def _stated(response: Response) -> tuple[ShownCase, ...]:
    """Return the cases with a peak whose states are known."""
    return tuple(c for c in response.peaked if np.any(states(response, c) >= 0))


def state_keys() -> list[go.Scatter]:
    """Return the legend entries of stick, slip and open."""
    return [
        go.Scatter(
            x=[None],
            y=[None],
            mode="markers",
            name=name,
            marker={"symbol": "square", "size": 11, "color": colour, "line": {"width": 1, "color": MUTED}},
        )
        for name, colour in zip(STATE_NAMES, STATE_COLOURS, strict=True)
    ]


def drawn_samples(curves: int, samples: int) -> slice:
    """Return the samples of a period to draw: every second, fourth ... one with many curves, to keep the page small."""
    step = 2 if samples >= 2 * 64 else 1
    while curves * samples // step > _MOST_SAMPLES and samples // (2 * step) >= _FEWEST_SAMPLES:
        step *= 2
    return slice(None, None, step)


def _loop(gap: FloatArray, force: FloatArray, state: IntArray | None, name: str) -> go.Scatter:
    """Return a closed loop, its points coloured by state."""
    closed = np.append(np.arange(len(gap)), 0)
    colour: dict[str, object] = {"color": MUTED}
    if state is not None:
        colour = {"color": state[closed].astype(np.int8), "colorscale": STATE_SCALE, "cmin": -0.5, "cmax": 2.5}
    return go.Scatter(
        x=gap[closed].astype(np.float32),
        y=force[closed].astype(np.float32),
        mode="lines+markers",
        line={"color": MUTED, "width": 1},
        marker={"size": 4, **colour},
        name=name,
        showlegend=False,
        hovertemplate=f"{name}<br>%{{x:.4g}} µm, %{{y:.4g}} N<extra></extra>",
    )


def _area(response: Response, case: ShownCase, direction: int) -> FloatArray:
    """Return (contact,) areas of the loops: energy dissipated in a cycle, J; zero for rounding."""
    own = response.periods[case.index]
    gap, force = own.peak_gap[:, direction], own.peak_force[:, direction]
    work = 0.5 * (force + np.roll(force, -1, -1)) * (np.roll(gap, -1, -1) - gap)
    area = np.nan_to_num(np.abs(work.sum(axis=-1)))
    return np.where(area > _ROUNDING * np.ptp(gap, axis=-1) * np.ptp(force, axis=-1), area, 0.0)


def _loop_caption(response: Response, case: ShownCase, direction: int) -> str:
    area, names = _area(response, case, direction), response.labels("contact")
    if not area.any():
        return "No loop encloses an area: nothing is dissipated in this direction."
    widest = int(np.argmax(area))
    own = response.periods[case.index]
    stroke, span = (float(np.ptp(of[widest, direction])) for of in (own.peak_gap, own.peak_force))
    return (
        f"The widest loop belongs to {names[widest]} ({quantity(float(area[widest]), 'J')} a cycle), with a stroke of {quantity(stroke, 'm')} and a force range of {quantity(span, 'N')}; "
        f"{int((area > 0.01 * area.max()).sum())} of {counted(len(names), 'point')} enclose more than a hundredth of "
        "its area."
    )


def _panels(response: Response, cases: tuple[ShownCase, ...], direction: int) -> tuple[list[int], list[int]]:
    """Return the contact points to draw, shown and folded away, by the most dissipation in any case; none without a force."""
    spans = [np.ptp(response.periods[c.index].peak_force[:, direction], axis=-1) for c in cases]
    acting = np.flatnonzero(np.any(np.nan_to_num(spans) > 0, axis=0))
    area = np.max([_area(response, c, direction) for c in cases], axis=0)
    order = acting[np.argsort(-area[acting], kind="stable")].tolist()
    loops = [k for k in order if area[k] > 0]
    most = _MOST_LOOPS if loops else _MOST_ROW  # without slip all loops are straight lines: a few suffice
    shown = loops[:SHOWN_LOOPS]
    return shown, order[len(shown) : most]


def _about_mean(values: list[FloatArray]) -> bool:
    """Whether the mean of a loop (..., sample) is so far from zero that it is removed from the figure."""
    every = np.nan_to_num(np.concatenate([v.reshape(-1, v.shape[-1]) for v in values]))
    return bool(np.any(np.abs(every.mean(axis=-1)) > _FAR * np.ptp(every, axis=-1) / 2))


def _hysteresis(response: Response, direction: str) -> list[Plot]:
    """Draw loops of contact points at the peak in one tangential direction (Gastaldi and Berruti 2017, fig. 5 and 11)."""
    column = {"t": 0, "w": 1}[direction]
    cases = tuple(c for c in response.peaked if np.isfinite(response.periods[c.index].peak_gap).any())
    shown, others = _panels(response, cases, column) if cases else ([], [])
    captions = {c.index: _loop_caption(response, c, column) for c in cases}
    title = f"Hysteresis loops at the peak, direction {direction}"
    acting = len(shown) + len(others)
    found = []
    if shown:
        figure, told = _loops(response, cases, column, shown)
        caption = f"Tangential force on the contact points against their relative displacement along {direction}, in one panel a point. Axes differ between panels. The area of a loop is the energy lost in a cycle.{told}"
        if acting > len(shown):
            caption += f" The {len(shown)} points that dissipate most, the largest first."
        found.append(Plot(f"loops_{direction}", title, caption, figure, captions, response.chosen))
    if others:
        figure, told = _loops(response, cases, column, others)
        caption = f"Tangential force against relative displacement along {direction}, of {counted(len(others), 'further point') if shown else counted(len(others), 'point')} with a force along {direction}.{told}"
        key, fold = (
            (f"loops_{direction}_others", "Loops of the other points") if shown else (f"loops_{direction}", title)
        )
        summary = f"{fold}, direction {direction}" if shown else f"{title}: straight lines"
        found.append(Plot(key, title, caption, figure, captions, response.chosen, folded=summary))
    return found


TITLED = 3  # panels in a row up to which the title of an axis has one line


def _loops(response: Response, cases: tuple[ShownCase, ...], column: int, points: list[int]) -> tuple[go.Figure, str]:
    """Return the panels of contact points in a tangential direction, and a sentence on removed means."""
    names, rows = response.labels("contact"), _wrapped([points])
    width = max(len(r) for r in rows)
    titles = [names[r[k]] if k < len(r) else "" for r in rows for k in range(width)]
    space = {"horizontal_spacing": 0.21 / width, "vertical_spacing": 0.23 / len(rows)}
    figure = make_subplots(len(rows), width, subplot_titles=titles, **space)
    own = {c.index: response.periods[c.index] for c in cases}
    gaps = {k: 1e6 * one.peak_gap[points, column] for k, one in own.items()}
    forces = {k: one.peak_force[points, column] for k, one in own.items()}
    moved, pulled = (_about_mean(list(of.values())) for of in (gaps, forces))
    at = drawn_samples(len(cases) * len(points), own[cases[0].index].peak_gap.shape[-1])
    stated, places = _stated(response), [(i, j) for i, row in enumerate(rows) for j in range(len(row))]
    for case in cases:
        state = own[case.index].peak_state[points, column][:, at] if case in stated else None
        gap, force = (
            of[case.index] - off * of[case.index].mean(axis=-1, keepdims=True)
            for of, off in ((gaps, moved), (forces, pulled))
        )
        for n, (i, j) in enumerate(places):
            known = state[n] if state is not None else None
            loop = _loop(gap[n, at], force[n, at], known, names[points[n]])
            figure.add_trace(loop.update(meta=case.index), row=i + 1, col=j + 1)
    for trace in state_keys() if stated else []:
        figure.add_trace(trace, row=1, col=1)
    styled(figure, 130 + 215 * len(rows))
    legend_above(figure)
    figure.update_yaxes(nticks=6, title_text=f"force{' about its mean' * pulled} (N)", col=1)
    figure.update_xaxes(nticks=6)
    for j in range(width):
        last = max(i for i, row in enumerate(rows) if j < len(row))
        figure.update_xaxes(
            title_text=f"relative{'<br>' if width > TITLED else ' '}displacement{'<br>about its mean' * moved} (µm)",
            row=last + 1,
            col=j + 1,
        )
    out = [word for word, off in (("displacements", moved), ("forces", pulled)) if off]
    return figure, f" The mean is taken out of the {joined(out)}." if out else ""


def hysteresis_t(response: Response) -> list[Plot]:
    """Draw loops along the first tangent."""
    return _hysteresis(response, "t")


def hysteresis_w(response: Response) -> list[Plot]:
    """Draw loops along the second tangent."""
    return _hysteresis(response, "w")


def _state_caption(response: Response, case: ShownCase, rows: list[int]) -> str:
    state, names = states(response, case), response.labels("contact")
    slipping, away = ((state == k).any(axis=(1, 2)) for k in (1, 2))
    apart = (state == 2).all(axis=(1, 2))
    text = f"{int(slipping.sum())} of {counted(len(names), 'point')} slip during the cycle and {int((away & ~apart).sum())} lift off."
    of_time = state.reshape(-1, state.shape[-1])[rows][_rubs(response, case, rows)]
    if of_time.size:
        stick, slip, open_ = (percent(100 * float((of_time == k).mean())) for k in range(3))
        text += f" Where there is friction, the contact sticks for {stick}, slips for {slip} and is open for {open_} of the time."
    for which, word in ((away & ~apart, "Lift-off at"), (apart, "Open all the time:")):
        told = [n for n, one in zip(names, which, strict=True) if one]
        if told:
            more = [f"{len(told) - 12} others"] if len(told) > 12 else []
            text += f" {word} {joined(told[:12] + more)}."
    return text


def _rubs(response: Response, case: ShownCase, rows: list[int]) -> BoolArray:
    """Return the rows (contact, tangent) with friction. A stop has no tangential force; its state is only closed or open."""
    force = response.periods[case.index].peak_force[:, : len(response.labels("tangent"))]
    if not force.size:
        return np.ones(len(rows), dtype=bool)
    rubs: BoolArray = np.any(force, axis=-1).reshape(-1)[rows]
    return rubs


def _state_rows(response: Response, cases: tuple[ShownCase, ...]) -> tuple[list[int], list[str]]:
    """Return the rows of (contact, tangent) to draw and their names; a point without tangential motion has one row."""
    names, tangents = response.labels("contact"), response.labels("tangent")
    n, rows, labels = len(tangents), [], []
    moves = np.ones((len(names), n), dtype=bool)
    gaps = [response.periods[c.index].peak_gap[:, :n] for c in cases]
    if np.isfinite(gaps).any():
        moves = np.any(np.nan_to_num([np.ptp(own, axis=-1) for own in gaps]) > 0, axis=0)
    for k, name in enumerate(names):
        acting = np.flatnonzero(moves[k]) if moves[k].any() else [0]
        rows += [k * n + int(t) for t in acting]
        labels += [f"{name} {tangents[t]} " if moves[k].any() else f"{name} " for t in acting]
    return rows, labels


def state_map(response: Response) -> Plot | None:
    """Draw stick, slip and open over one period for every contact point."""
    cases = _stated(response)
    if not cases:
        return None
    rows, labels = _state_rows(response, cases)
    at = drawn_samples(len(cases) * len(rows), states(response, cases[0]).shape[-1])
    figure = go.Figure()
    for case in cases:
        state = states(response, case)[..., at]
        values = state.reshape(-1, state.shape[-1])[rows]
        figure.add_heatmap(
            x=(np.arange(values.shape[1]) + 0.5) / values.shape[1],
            y=labels,
            z=values.astype(np.int8),
            zmin=-0.5,
            zmax=2.5,
            colorscale=STATE_SCALE,
            showscale=False,
            ygap=2 if len(rows) <= _MOST_STATES else 0,
            meta=case.index,
            hovertemplate="%{y} at %{x:.3f} T: %{z} (0 stick, 1 slip, 2 open)<extra></extra>",
        )
    figure.add_traces(state_keys())
    styled(figure, 130 + min(21 * len(rows), 900))
    legend_above(figure)
    figure.update_xaxes(title_text="time / period", range=[0, 1], showgrid=False)
    figure.update_yaxes(autorange="reversed", showgrid=False, ticks="", tickfont={"size": 12})
    caption = "Each row is a contact point in one tangential direction, through one cycle from left to right."
    captions = {c.index: _state_caption(response, c, rows) for c in cases}
    title = "Contact states over one period at the peak"
    still = not any(np.any(states(response, c).reshape(-1, states(response, c).shape[-1])[rows]) for c in cases)
    folded = "Contact states over one period at the peak: all stick" if still else ""
    return Plot("states", title, caption, figure, captions, response.chosen, folded=folded)


MIN_MAP_POINTS = 9  # least number of points for a map of a surface
THICK = 0.05  # second extent over the first, below which points stand in a line
MOST_BESIDE = 3  # maps beside each other
STEPS = 10  # colours of patches, from full stick to slip during the whole cycle
_SLIP_SCALE = [[0.0, STATE_COLOURS[0]], [0.5, "#f4efe6"], [1.0, STATE_COLOURS[1]]]  # from stick to slip


def surface_map(response: Response) -> Plot | None:
    """Draw the fraction of the cycle during which each point of a contact surface slips."""
    cases = _stated(response)
    surfaces = _surfaces(response) if cases else {}
    if not surfaces:
        return None
    width = min(len(surfaces), MOST_BESIDE)
    height = -(-len(surfaces) // width)
    figure = make_subplots(height, width, subplot_titles=list(surfaces), horizontal_spacing=0.1)
    names = np.array(response.labels("contact"))
    rims = {group: _rims(response, points) for group, (points, _) in surfaces.items()}
    for case in cases:
        slips, opens = _shares(response, case)
        for k, (group, (points, at)) in enumerate(surfaces.items()):
            filled = _patches(rims[group], slips)
            dots = _map(at, names[points], slips[points], opens[points], small=bool(filled))
            for trace in (*filled, dots):
                figure.add_trace(trace.update(meta=case.index), row=k // width + 1, col=k % width + 1)
    styled(figure, 90 + 330 * height)
    figure.update_xaxes(title_text="along t (mm)")
    figure.update_yaxes(title_text="along w (mm)", col=1)
    bar = {"title": {"text": "slips (%)"}, "len": 0.9, "thickness": 12, "outlinewidth": 0}
    figure.update_layout(
        showlegend=False, coloraxis={"colorscale": _SLIP_SCALE, "cmin": 0, "cmax": 100, "colorbar": bar}
    )
    patched = "with the areas they stand for, " if any(rims.values()) else ""
    caption = f"The figure shows the contact points, {patched}along the contact normal. Colours give the share of the cycle at the peak in which a point slips in either direction. A dark rim marks points that lift off."
    captions = {c.index: _surface_caption(response, c, surfaces) for c in cases}
    return Plot("surface", "Where the contacts slip", caption, figure, captions, response.chosen)


def _surfaces(response: Response) -> dict[str, tuple[IntArray, FloatArray]]:
    """Return the contacts whose points span a surface: their points, and positions (p, 2) along t and w from the centre, mm."""
    position, frame = response.model.contact_position, response.model.contact_frame
    found: dict[str, tuple[IntArray, FloatArray]] = {}
    if not position.size or not frame.size:
        return found
    for group, members in response.groups.items():
        points = np.array(members, dtype=np.int64)
        if points.size < MIN_MAP_POINTS or not np.isfinite(position[points]).all():
            continue
        arm = position[points] - position[points].mean(axis=0)
        extent = np.linalg.svd(arm, compute_uv=False)
        if extent[1] > THICK * extent[0]:
            # one frame for the map, although the frames of a curved surface turn
            found[group] = points, 1e3 * arm @ frame[points[0]][:, :2]
    return found


def _shares(response: Response, case: ShownCase) -> tuple[FloatArray, FloatArray]:
    """Return the percentage of the cycle during which each contact point slips and is open."""
    state = states(response, case)
    slips, opens = (100.0 * (state == k).any(axis=1).mean(axis=1) for k in (1, 2))
    return slips, opens


def _rims(response: Response, points: IntArray) -> dict[int, FloatArray]:
    """Return the corners (k, 2) of a contact's patches in the plane of `_surfaces`, mm; none without areas."""
    position, frame, area = response.model.contact_position, response.model.contact_frame, response.model.contact_area
    middle, plane = position[points].mean(axis=0), frame[points[0]][:, :2]
    found = patches(position, frame, area, points.tolist())
    return {k: 1e3 * (corners - middle) @ plane for k, corners in found.items()}


def _patches(rims: Mapping[int, FloatArray], slips: FloatArray) -> list[go.Scatter]:
    """Draw the patches of a contact, with one trace for patches of similar slip."""
    steps: dict[int, list[int]] = {}
    for k in rims:
        steps.setdefault(int(np.ceil(STEPS * slips[k] / 100.0)), []).append(k)
    drawn = []
    for step, own in sorted(steps.items()):
        x, y = outlines([rims[k] for k in own]).astype(np.float32).T
        (fill,) = sample_colorscale(_SLIP_SCALE, [step / STEPS])
        drawn.append(
            go.Scatter(
                x=x,
                y=y,
                mode="lines",
                fill="toself",
                fillcolor=fill,
                line={"width": 0.5, "color": MUTED},
                hoverinfo="skip",
                showlegend=False,
            )
        )
    return drawn


def _map(at: FloatArray, names: FloatArray, slips: FloatArray, opens: FloatArray, *, small: bool) -> go.Scatter:
    lifted = opens > 0
    return go.Scatter(
        x=at[:, 0].astype(np.float32),
        y=at[:, 1].astype(np.float32),
        mode="markers",
        showlegend=False,
        marker={
            "size": 5 if small else 7,
            "color": slips.astype(np.float32),
            "coloraxis": "coloraxis",
            "line": {"color": MUTED, "width": np.where(lifted, 1.8, 0.4)},
        },
        customdata=np.column_stack([names, slips.round(), opens.round()]),
        hovertemplate="%{customdata[0]}<br>slips %{customdata[1]} %, open %{customdata[2]} %<extra></extra>",
    )


def _surface_caption(response: Response, case: ShownCase, surfaces: dict[str, tuple[IntArray, FloatArray]]) -> str:
    slips, opens = _shares(response, case)
    said = []
    for group, (points, _) in surfaces.items():
        share, lifted = (percent(100.0 * float(np.mean(of[points] > 0))) for of in (slips, opens))
        lifts = f", {lifted} lift off" if opens[points].any() else ""
        said.append(f"{share} of the points of {group} slip{lifts}")
    return f"In the cycle {joined(said)}."


MOST_PANELS = 8  # contacts, one panel each
MOST_POINTS = 8  # curves in a panel
OPEN = 2  # index of the state open, which gives the colour
AT_LIMIT = 0.999  # share of the friction coefficient at which a point reaches its limit


def ratios(response: Response, case: ShownCase, direction: int) -> FloatArray:
    """Return (contact, sample) T/N at the peak of a case; NaN where a contact is open or its law has no normal force.

    T has the sign of the contact force in the tables and in the loops, N is positive in compression, and no mean is removed.
    """
    force = response.periods[case.index].peak_force
    if force.shape[1] != 3:  # the result lacks normal forces
        return np.full((len(force), force.shape[-1]), np.nan)
    along, pressed = force[:, direction], -force[:, 2]
    found: FloatArray = np.divide(along, pressed, out=np.full_like(along, np.nan), where=pressed > 0.0)
    return found


def friction(response: Response, case: ShownCase) -> FloatArray:
    """Return (contact,) friction coefficients; NaN for a law without one, and in early results."""
    own = response.periods[case.index].peak_friction
    return np.full(len(response.labels("contact")), np.nan) if own is None else own


def _panels_of_ratio(response: Response, cases: tuple[ShownCase, ...], direction: int) -> dict[str, list[int]]:
    """Return the points of each contact that come nearest to their limit in any case."""
    with np.errstate(invalid="ignore"):
        used = [np.nan_to_num(np.abs(ratios(response, c, direction))).max(axis=1) for c in cases]
    most = np.max(used, axis=0)
    found = {}
    for group, members in response.groups.items():
        acting = sorted((k for k in members if most[k] > 0.0), key=lambda k: -most[k])[:MOST_POINTS]
        if acting:
            found[group] = sorted(acting)
    kept = sorted(found, key=lambda group: -most[found[group]].max())[:MOST_PANELS]
    return {group: points for group, points in found.items() if group in kept}


def _ratio(response: Response, direction: str) -> Plot | None:
    column = {"t": 0, "w": 1}[direction]
    cases = tuple(c for c in response.peaked if np.isfinite(ratios(response, c, column)).any())
    panels = _panels_of_ratio(response, cases, column) if cases else {}
    if not panels:
        return None
    figure = make_subplots(
        len(panels), 1, subplot_titles=list(panels), shared_xaxes=True, vertical_spacing=0.24 / (len(panels) + 1)
    )
    curves = len(cases) * sum(map(len, panels.values()))
    at = drawn_samples(curves, response.periods[cases[0].index].peak_force.shape[-1])
    for case in cases:
        for row, points in enumerate(panels.values(), 1):
            for trace in _traces(response, case, column, points, at):
                figure.add_trace(trace.update(meta=case.index), row=row, col=1)
    figure.add_trace(_limit_key(), row=1, col=1)
    figure.add_trace(state_keys()[OPEN], row=1, col=1)
    styled(figure, 130 + 230 * len(panels))
    legend_above(figure)
    figure.update_yaxes(title_text=f"T<sub>{direction}</sub>/N", nticks=6)
    figure.update_xaxes(range=[0, 1])
    figure.update_xaxes(title_text="time / period", row=len(panels), col=1)
    caption = f"Friction force along {direction} over normal force through one cycle, in one panel a contact; N is positive in compression. Dashed lines stand at plus and minus the friction coefficient: a point that follows one slips. A curve ends where its point opens."
    drawn, every = sum(map(len, panels.values())), len(response.labels("contact"))
    if drawn < every:
        caption += f" {drawn} of {every} points are drawn, those that come nearest to slipping along {direction}."
    captions = {c.index: _caption(response, c, column) for c in cases}
    title = f"T/N over the cycle at the peak, direction {direction}"
    return Plot(f"friction_ratio_{direction}", title, caption, figure, captions, response.chosen)


def _traces(response: Response, case: ShownCase, direction: int, points: list[int], at: slice) -> list[go.Scatter]:
    """Return the curves of one panel, their limits, and the marks where points are open."""
    whole, names, mu = ratios(response, case, direction), response.labels("contact"), friction(response, case)
    samples = whole.shape[1]
    time = (np.arange(samples) / samples)[at].astype(np.float32)
    found = []
    for k in points:
        found.append(
            go.Scatter(
                x=np.append(time, np.float32(1.0)),
                y=np.append(whole[k, at], whole[k, 0]).astype(np.float32),
                mode="lines",
                line={"color": colour(k), "width": 1.8},
                name=names[k],
                hovertemplate=f"{names[k]}<br>%{{x:.3f}} T: T/N %{{y:.4g}}<extra></extra>",
            )
        )
        where = np.isnan(whole[k, at])
        if where.any():
            mark = {
                "symbol": "square",
                "size": 5,
                "color": STATE_COLOURS[OPEN],
                "line": {"width": 1, "color": colour(k)},
            }
            found.append(
                go.Scatter(
                    x=time[where],
                    y=np.zeros(int(where.sum()), dtype=np.float32),
                    mode="markers",
                    marker=mark,
                    name=f"{names[k]} open",
                    showlegend=False,
                    hovertemplate=f"{names[k]} open at %{{x:.3f}} T<extra></extra>",
                )
            )
    for limit in np.unique(mu[points][np.isfinite(mu[points])]):
        found += [_limit(sign * float(limit)) for sign in (1, -1)]
    return found


def _limit(value: float) -> go.Scatter:
    return go.Scatter(
        x=[0, 1],
        y=[value, value],
        mode="lines",
        line={"color": MUTED, "width": 1.2, "dash": "dash"},
        name=f"{value:+.3g}",
        showlegend=False,
        hovertemplate=f"{value:+.3g}<extra></extra>",
    )


def _limit_key() -> go.Scatter:
    line = {"color": MUTED, "width": 1.2, "dash": "dash"}
    return go.Scatter(x=[None], y=[None], mode="lines", line=line, name="friction coefficient")


def _caption(response: Response, case: ShownCase, direction: int) -> str:
    own, mu, names = ratios(response, case, direction), friction(response, case), response.labels("contact")
    with np.errstate(invalid="ignore"):
        largest = np.nan_to_num(np.abs(own)).max(axis=1)
        reach = largest >= AT_LIMIT * mu
    most = int(np.argmax(largest))
    limit = f", its friction coefficient is {number(float(mu[most]))}" if np.isfinite(mu[most]) else ""
    told = [f"The largest T/N is {number(float(largest[most]))} at {names[most]}{limit}."]
    known = int((np.isfinite(mu) & (largest > 0.0)).sum())
    if known:
        told.append(f"{int(reach.sum())} of {counted(known, 'point')} reach their friction coefficient.")
    opens = np.isnan(own).any(axis=1) & (largest > 0.0)
    if opens.any():
        told.append(
            f"Open during a part of the cycle: {joined([n for n, one in zip(names, opens, strict=True) if one][:12])}."
        )
    return " ".join(told)


def friction_ratio_t(response: Response) -> Plot | None:
    """Draw T/N along the first tangent."""
    return _ratio(response, "t")


def friction_ratio_w(response: Response) -> Plot | None:
    """Draw T/N along the second tangent."""
    return _ratio(response, "w")
