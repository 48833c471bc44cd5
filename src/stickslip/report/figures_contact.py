"""Figures of the contact at the peak of each load case: loops, states, damper motion, energy."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.plot import (
    MUTED,
    STATE_COLOURS,
    STATE_NAMES,
    Plot,
    absent,
    legend_above,
    styled,
)
from stickslip.report.quantities import counted, joined, percent, quantity
from stickslip.report.result import Case, Result

_ROUNDING = 1e-9  # area of a loop over that of its bounding box, below which it is a line
_STATE_SCALE = [[a, colour] for k, colour in enumerate(STATE_COLOURS) for a in (k / 3, (k + 1) / 3)]


def contact_lines(names: tuple[str, ...]) -> list[list[int]]:
    """Group contacts by what stands before the dot of their name: one row of panels a contact line."""
    rows: dict[str, list[int]] = {}
    for index, name in enumerate(names):
        rows.setdefault(name.partition(".")[0], []).append(index)
    groups = list(rows.values())
    if all(len(g) == 1 for g in groups):
        groups = [list(range(len(names)))[k : k + 3] for k in range(0, len(names), 3)]
    return groups


def states(result: Result, case: Case) -> IntArray:
    """(contact, tangent, sample) states of a case at its peak; 0 stick, 1 slip, 2 open."""
    values = result.data["peak_state"].isel(load_case=case.index)
    return np.asarray(values.transpose("contact", "tangent", "sample").values).astype(np.int64)


def period(result: Result, case: Case, name: str) -> FloatArray:
    """(contact, direction, sample) of ``peak_gap`` or ``peak_force`` of a case."""
    values = result.data[name].isel(load_case=case.index)
    return np.asarray(values.transpose("contact", "direction", "sample").values, dtype=np.float64)


def _drawn(result: Result, *names: str) -> tuple[Case, ...]:
    """Cases with a peak whose variables are there and finite."""
    if not result.has(*names):
        return ()
    first = result.data[names[0]]
    return tuple(
        c for c in result.peaked if bool(np.isfinite(first.isel(load_case=c.index).values).any())
    )


def _state_keys() -> list[go.Scatter]:
    return [
        go.Scatter(
            x=[None], y=[None], mode="markers", name=name,
            marker={"symbol": "square", "size": 11, "color": colour, "line": {"width": 1, "color": MUTED}},
        )
        for name, colour in zip(STATE_NAMES, STATE_COLOURS, strict=True)
    ]  # fmt: skip


def _loop(gap: FloatArray, force: FloatArray, state: IntArray | None, name: str) -> go.Scatter:
    """One closed loop, its points coloured by state."""
    closed = np.append(np.arange(len(gap)), 0)
    colour: dict[str, object] = {"color": MUTED}
    if state is not None:
        colour = {"color": state[closed], "colorscale": _STATE_SCALE, "cmin": -0.5, "cmax": 2.5}
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


def _loop_caption(result: Result, case: Case, direction: int) -> str:
    gap, force = (
        period(result, case, "peak_gap")[:, direction],
        period(result, case, "peak_force")[:, direction],
    )
    area = np.abs(
        np.sum(0.5 * (force + np.roll(force, -1, -1)) * (np.roll(gap, -1, -1) - gap), axis=-1)
    )
    names = result.labels("contact")
    stroke, span = np.ptp(gap, axis=-1), np.ptp(force, axis=-1)
    if not (area > _ROUNDING * stroke * span).any():
        return "No loop encloses an area: nothing is dissipated in this direction."
    widest = int(np.argmax(area))
    return (
        f"The widest loop is that of {names[widest]} ({quantity(float(area[widest]), 'J')} a cycle), with a stroke "
        f"of {quantity(float(stroke[widest]), 'm')} and a force range of {quantity(float(span[widest]), 'N')}; "
        f"{int((area > 0.01 * area.max()).sum())} of {counted(len(names), 'point')} enclose more than a hundredth of "
        "its area."
    )  # fmt: skip


def hysteresis(result: Result, direction: str) -> Plot:
    """Loops of every contact point at the peak in one tangential direction (Gastaldi and Berruti 2017, fig. 5 and 11)."""
    column = {"t": 0, "w": 1}[direction]
    place = {"t": "in the plane of the section", "w": "along the damper's axis"}[direction]
    key, title = f"loops-{direction}", f"Hysteresis loops at the peak, direction {direction}"
    cases = _drawn(result, "peak_gap", "peak_force")
    if not cases:
        return absent(key, title, "no load case has its peak reconstructed in time")
    names, rows = result.labels("contact"), contact_lines(result.labels("contact"))
    width = max(len(r) for r in rows)
    titles = [names[r[k]] if k < len(r) else "" for r in rows for k in range(width)]
    figure = make_subplots(
        len(rows),
        width,
        subplot_titles=titles,
        horizontal_spacing=0.07,
        vertical_spacing=0.23 / len(rows),
    )
    for case in cases:
        gap, force = period(result, case, "peak_gap"), period(result, case, "peak_force")
        state = states(result, case) if result.has("peak_state") else None
        for i, row in enumerate(rows):
            for j, contact in enumerate(row):
                known = state[contact, column] if state is not None else None
                loop = _loop(
                    gap[contact, column] * 1e6, force[contact, column], known, names[contact]
                )
                figure.add_trace(loop.update(meta=case.index), row=i + 1, col=j + 1)
    for trace in _state_keys() if result.has("peak_state") else []:
        figure.add_trace(trace, row=1, col=1)
    styled(figure, 130 + 215 * len(rows))
    legend_above(figure)
    figure.update_yaxes(nticks=6, title_text="force (N)", col=1)
    figure.update_xaxes(nticks=6, title_text="relative displacement (µm)", row=len(rows))
    caption = (
        f"Tangential force on the contact points against their relative displacement {place}, one panel a "
        "point, one row a contact line; axes differ between panels. The area of a loop is the energy lost in a cycle."
    )
    captions = {c.index: _loop_caption(result, c, column) for c in cases}
    return Plot(key, title, caption, figure, captions)


def _state_caption(result: Result, case: Case) -> str:
    state = states(result, case)
    slipping = (state == 1).any(axis=(1, 2))
    open_ = (state == 2).any(axis=(1, 2))
    share = [100 * float((state == k).mean()) for k in range(3)]
    names = result.labels("contact")
    text = (
        f"{int(slipping.sum())} of {counted(len(names), 'point')} slip during the cycle and {int(open_.sum())} "
        f"lift off; over all points and both directions the contact sticks for {percent(share[0])}, slips for "
        f"{percent(share[1])} and is open for {percent(share[2])} of the time."
    )
    if open_.any():
        text += f" Lift-off at {joined([n for n, o in zip(names, open_, strict=True) if o])}."
    return text


def state_map(result: Result) -> Plot:
    """Stick, slip and open over one period for every contact point."""
    key, title = "states", "Contact states over one period at the peak"
    cases = _drawn(result, "peak_state")
    if not cases:
        return absent(key, title, "no load case has its contact states reconstructed")
    names = result.labels("contact")
    tangents = result.labels("tangent")
    rows = [f"{name} {t} " for name in names for t in tangents]
    figure = go.Figure()
    for case in cases:
        state = states(result, case)
        values = state.reshape(-1, state.shape[-1])
        hover = np.array(STATE_NAMES, dtype=object)[values]
        figure.add_heatmap(
            x=(np.arange(values.shape[1]) + 0.5) / values.shape[1], y=rows, z=values.astype(np.int8),
            zmin=-0.5, zmax=2.5, colorscale=_STATE_SCALE, showscale=False, ygap=2, meta=case.index,
            customdata=hover, hovertemplate="%{y}: %{customdata} at %{x:.3f} T<extra></extra>",
        )  # fmt: skip
    figure.add_traces(_state_keys())
    styled(figure, 130 + 21 * len(rows))
    legend_above(figure)
    figure.update_xaxes(title_text="time / period", range=[0, 1], showgrid=False)
    figure.update_yaxes(autorange="reversed", showgrid=False, ticks="", tickfont={"size": 12})
    caption = "Each row is a contact point in one tangential direction; read from left to right through one cycle."
    return Plot(key, title, caption, figure, {c.index: _state_caption(result, c) for c in cases})


def right_side(result: Result) -> list[bool]:
    """Say for every contact whether it lies on the right blade: its normal points towards +x."""
    names = result.labels("contact")
    if not result.has("contact_frame"):
        return [name.upper().startswith("R") for name in names]
    frame = result.data["contact_frame"].transpose("contact", "xyz", "direction").values
    return [bool(x > 0) for x in np.asarray(frame)[:, 0, 2]]
