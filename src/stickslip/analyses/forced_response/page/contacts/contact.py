"""Figures of the contacts at the peak of each case: loops and states."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.report.cases import ShownCase
from stickslip.report.content import Chooser, chooser
from stickslip.report.plot import MUTED, STATE_COLOURS, STATE_NAMES, Plot, legend_above, styled
from stickslip.report.quantities import counted, joined, percent, quantity

_ROUNDING = 1e-9  # area of a loop over that of its bounding box, below which it is a line
_MOST_LOOPS = 24  # panels
_MOST_ROW = 4  # of them beside each other, where contact lines have more points
_MOST_STATES = 40  # rows with a name of their own
_MOST_SAMPLES = 40_000  # of all loops of a figure, and of all rows of states
_FEWEST_SAMPLES = 32  # of a period
_STATE_SCALE = [[a, colour] for k, colour in enumerate(STATE_COLOURS) for a in (k / 3, (k + 1) / 3)]


def chosen_case(response: Response) -> Chooser | None:
    """Return the buttons that choose the case of the figures below."""
    return chooser(response.varied, response.peaked, response.chosen)


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
    """(contact, tangent, sample) states of a case at its peak; 0 stick, 1 slip, 2 open."""
    return response.of_case("peak_state", case, "contact", "tangent", "sample").astype(np.int64)


def period(response: Response, case: ShownCase, name: str) -> FloatArray:
    """(contact, direction, sample) of ``peak_gap`` or ``peak_force`` of a case."""
    return response.of_case(name, case, "contact", "direction", "sample")


def _drawn(response: Response, *names: str) -> tuple[ShownCase, ...]:
    """Return the cases with a peak whose variables exist and are finite."""
    if not response.has(*names):
        return ()
    first = response.data[names[0]]
    return tuple(c for c in response.peaked if bool(np.isfinite(first.isel(case=c.index).values).any()))


def _state_keys() -> list[go.Scatter]:
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


def _drawn_samples(curves: int, samples: int) -> slice:
    """Return the samples of a period to draw: with many curves every second, fourth ... one, to keep the page small."""
    step = 2 if samples >= 2 * 64 else 1
    while curves * samples // step > _MOST_SAMPLES and samples // (2 * step) >= _FEWEST_SAMPLES:
        step *= 2
    return slice(None, None, step)


def _loop(gap: FloatArray, force: FloatArray, state: IntArray | None, name: str) -> go.Scatter:
    """One closed loop, its points coloured by state."""
    closed = np.append(np.arange(len(gap)), 0)
    colour: dict[str, object] = {"color": MUTED}
    if state is not None:
        colour = {"color": state[closed].astype(np.int8), "colorscale": _STATE_SCALE, "cmin": -0.5, "cmax": 2.5}
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
    gap, force = (period(response, case, name)[:, direction] for name in ("peak_gap", "peak_force"))
    work = 0.5 * (force + np.roll(force, -1, -1)) * (np.roll(gap, -1, -1) - gap)
    area = np.nan_to_num(np.abs(work.sum(axis=-1)))
    return np.where(area > _ROUNDING * np.ptp(gap, axis=-1) * np.ptp(force, axis=-1), area, 0.0)


def _loop_caption(response: Response, case: ShownCase, direction: int) -> str:
    area, names = _area(response, case, direction), response.labels("contact")
    if not area.any():
        return "No loop encloses an area: nothing is dissipated in this direction."
    widest = int(np.argmax(area))
    stroke, span = (float(np.ptp(period(response, case, n)[widest, direction])) for n in ("peak_gap", "peak_force"))
    return (
        f"The widest loop is that of {names[widest]} ({quantity(float(area[widest]), 'J')} a cycle), with a stroke "
        f"of {quantity(stroke, 'm')} and a force range of {quantity(span, 'N')}; "
        f"{int((area > 0.01 * area.max()).sum())} of {counted(len(names), 'point')} enclose more than a hundredth of "
        "its area."
    )


def _panels(response: Response, cases: tuple[ShownCase, ...], direction: int) -> list[list[int]]:
    """Return the contact points to draw, by row: those with a force; of many those with the largest dissipation in any case."""
    spans = [np.ptp(period(response, c, "peak_force")[:, direction], axis=-1) for c in cases]
    acting = np.flatnonzero(np.any(np.nan_to_num(spans) > 0, axis=0)).tolist()
    if len(acting) > _MOST_LOOPS:
        area = np.max([_area(response, c, direction) for c in cases], axis=0)
        most = _MOST_LOOPS if area.any() else _MOST_ROW  # straight lines are all alike
        acting = sorted(acting, key=lambda k: -area[k])[:most]
        return _wrapped([sorted(acting)])
    rows = [[k for k in row if k in acting] for row in contact_lines(response)]
    return _wrapped([row for row in rows if row])


def _hysteresis(response: Response, direction: str) -> Plot | None:
    """Loops of contact points at the peak in one tangential direction (Gastaldi and Berruti 2017, fig. 5 and 11)."""
    column = {"t": 0, "w": 1}[direction]
    cases = _drawn(response, "peak_gap", "peak_force")
    names, rows = response.labels("contact"), _panels(response, cases, column) if cases else []
    if not rows:
        return None
    width = max(len(r) for r in rows)
    titles = [names[r[k]] if k < len(r) else "" for r in rows for k in range(width)]
    space = {"horizontal_spacing": 0.21 / width, "vertical_spacing": 0.23 / len(rows)}
    figure = make_subplots(len(rows), width, subplot_titles=titles, **space)
    at = _drawn_samples(len(cases) * sum(map(len, rows)), response.data.sizes["sample"])
    for case in cases:
        gap, force = (period(response, case, f"peak_{n}")[..., at] for n in ("gap", "force"))
        state = states(response, case)[..., at] if response.has("peak_state") else None
        for i, row in enumerate(rows):
            for j, k in enumerate(row):
                known = state[k, column] if state is not None else None
                loop = _loop(gap[k, column] * 1e6, force[k, column], known, names[k])
                figure.add_trace(loop.update(meta=case.index), row=i + 1, col=j + 1)
    for trace in _state_keys() if response.has("peak_state") else []:
        figure.add_trace(trace, row=1, col=1)
    styled(figure, 130 + 215 * len(rows))
    legend_above(figure)
    figure.update_yaxes(nticks=6, title_text="force (N)", col=1)
    figure.update_xaxes(nticks=6)
    for j in range(width):
        last = max(i for i, row in enumerate(rows) if j < len(row))
        figure.update_xaxes(title_text="relative displacement (µm)", row=last + 1, col=j + 1)
    drawn = sum(map(len, rows))
    caption = (
        f"Tangential force on the contact points against their relative displacement along {direction}, one panel a "
        "point; axes differ between panels. The area of a loop is the energy lost in a cycle."
    )
    if drawn < len(names):
        caption += (
            f" {drawn} of {len(names)} points are drawn: those that carry a force along {direction} and lose most."
        )
    captions = {c.index: _loop_caption(response, c, column) for c in cases}
    title = f"Hysteresis loops at the peak, direction {direction}"
    return Plot(f"loops_{direction}", title, caption, figure, captions, response.chosen)


def hysteresis_t(response: Response) -> Plot | None:
    """Draw loops along the first tangent."""
    return _hysteresis(response, "t")


def hysteresis_w(response: Response) -> Plot | None:
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
    if not response.has("peak_force"):
        return np.ones(len(rows), dtype=bool)
    force = period(response, case, "peak_force")[:, : len(response.labels("tangent"))]
    rubs: BoolArray = np.any(force, axis=-1).reshape(-1)[rows]
    return rubs


def _state_rows(response: Response, cases: tuple[ShownCase, ...]) -> tuple[list[int], list[str]]:
    """Return the rows of (contact, tangent) that are drawn and their names: one for a point that has no tangential motion."""
    names, tangents = response.labels("contact"), response.labels("tangent")
    n, rows, labels = len(tangents), [], []
    moves = np.ones((len(names), n), dtype=bool)
    if response.has("peak_gap"):
        spans = [np.ptp(period(response, c, "peak_gap")[:, :n], axis=-1) for c in cases]
        moves = np.any(np.nan_to_num(spans) > 0, axis=0)
    for k, name in enumerate(names):
        acting = np.flatnonzero(moves[k]) if moves[k].any() else [0]
        rows += [k * n + int(t) for t in acting]
        labels += [f"{name} {tangents[t]} " if moves[k].any() else f"{name} " for t in acting]
    return rows, labels


def state_map(response: Response) -> Plot | None:
    """Draw stick, slip and open over one period for every contact point."""
    cases = _drawn(response, "peak_state")
    if not cases:
        return None
    rows, labels = _state_rows(response, cases)
    at = _drawn_samples(len(cases) * len(rows), response.data.sizes["sample"])
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
            colorscale=_STATE_SCALE,
            showscale=False,
            ygap=2 if len(rows) <= _MOST_STATES else 0,
            meta=case.index,
            hovertemplate="%{y} at %{x:.3f} T: %{z} (0 stick, 1 slip, 2 open)<extra></extra>",
        )
    figure.add_traces(_state_keys())
    styled(figure, 130 + min(21 * len(rows), 900))
    legend_above(figure)
    figure.update_xaxes(title_text="time / period", range=[0, 1], showgrid=False)
    figure.update_yaxes(autorange="reversed", showgrid=False, ticks="", tickfont={"size": 12})
    caption = "Each row is a contact point in one tangential direction; read from left to right through one cycle."
    captions = {c.index: _state_caption(response, c, rows) for c in cases}
    title = "Contact states over one period at the peak"
    return Plot("states", title, caption, figure, captions, response.chosen)
