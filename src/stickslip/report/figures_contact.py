"""Figures of the contact at the peak of each load case: loops, states, damper motion, energy."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.plot import (
    LEFT_SIDE,
    MUTED,
    RIGHT_SIDE,
    STATE_COLOURS,
    STATE_NAMES,
    Plot,
    absent,
    legend_above,
    log_ticks,
    styled,
)
from stickslip.report.quantities import counted, joined, number, percent, quantity, scale_for
from stickslip.report.result import RATIO, Case, Result

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
    if not area.any():
        return "No loop encloses an area: nothing is dissipated in this direction."
    widest = int(np.argmax(area))
    stroke = np.ptp(gap, axis=-1)
    return (
        f"The widest loop is that of {names[widest]} ({quantity(float(area[widest]), 'J')} a cycle), with a stroke "
        f"of {quantity(float(stroke[widest]), 'm')} and a force range of {quantity(float(np.ptp(force[widest])), 'N')}; "
        f"{int((area > 0.01 * area.max()).sum())} of {counted(len(names), 'point')} enclose more than a hundredth of "
        "its area."
    )  # fmt: skip


def hysteresis(result: Result, direction: str) -> Plot:
    """Loops of every contact point at the peak in one tangential direction (seed 1, fig. 5 and 11)."""
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


def damper_motion(result: Result, case: Case, samples: int = 128) -> tuple[FloatArray, FloatArray]:
    """Damper coordinates over one period at the peak.

    Returns
    -------
    mean
        (6,) static part: metres and radians in the order x, y, z, rx, ry, rz.
    motion
        (6, samples) motion about it.
    """
    labels = [str(v) for v in result.data["retained"].values]
    at = [labels.index(f"damper.{c}") for c in ("x", "y", "z", "rx", "ry", "rz")]
    values = result.data["retained_displacement"].isel(point=result.peak(case), retained=at)
    parts = np.asarray(values.transpose("harmonic", "retained", "part").values, dtype=np.float64)
    coefficients = np.nan_to_num(parts[..., 0] + 1j * parts[..., 1])
    harmonic = np.asarray(result.data["harmonic"].values, dtype=np.float64)[1:]
    phase = 2 * np.pi * np.arange(samples + 1) / samples
    wave = np.exp(1j * harmonic[:, None] * phase)
    return coefficients[0].real, np.real(coefficients[1:].T @ wave)


def _damper_caption(result: Result, case: Case) -> str:
    mean, motion = damper_motion(result, case)
    largest = np.ptp(motion, axis=1) / 2
    move, turn = int(np.argmax(largest[:3])), int(np.argmax(largest[3:]))
    return (
        f"Largest translation {quantity(float(largest[move]), 'm')} along {'xyz'[move]}, largest rotation "
        f"{quantity(float(largest[3 + turn]), 'rad')} about {'xyz'[turn]} (half of peak to peak). Mean position, taken "
        f"out of the curves: x {quantity(float(mean[0]), 'm')}, y {quantity(float(mean[1]), 'm')}, "
        f"z {quantity(float(mean[2]), 'm')}."
    )  # fmt: skip


def damper(result: Result) -> Plot:
    """Motion of the damper over one period at the peak and its orbit."""
    key, title = "damper", "Motion of the damper at the peak"
    labels = (
        [str(v) for v in result.data["retained"].values] if "retained" in result.data.coords else []
    )
    wanted = {f"damper.{c}" for c in ("x", "y", "z", "rx", "ry", "rz")}
    cases = result.peaked if result.has("retained_displacement") else ()
    if not cases or not wanted <= set(labels):
        return absent(key, title, "the damper's coordinates at a peak are not in this result")
    turns = np.concatenate([damper_motion(result, c)[1][3:].ravel() for c in cases])
    angle = scale_for(turns, "rad")
    figure = make_subplots(
        1,
        3,
        horizontal_spacing=0.1,
        subplot_titles=("translation", "rotation", "orbit in the x–z plane"),
    )
    styles = (("#0072b2", "solid"), ("#d55e00", "dash"), ("#009e73", "dot"))
    for case in cases:
        motion = damper_motion(result, case)[1]
        time = np.linspace(0, 1, motion.shape[1])
        for k, (colour, dash) in enumerate(styles):
            line = {"color": colour, "dash": dash, "width": 2}
            name = "xyz"[k]
            shared = {
                "line": line,
                "legendgroup": name,
                "meta": case.index,
                "mode": "lines",
                "name": name,
            }
            figure.add_scatter(x=time, y=motion[k] * 1e6, row=1, col=1, **shared)
            turn = motion[3 + k] * angle.factor
            figure.add_scatter(x=time, y=turn, row=1, col=2, **{**shared, "showlegend": False})
        orbit = {
            "mode": "lines",
            "line": {"color": case.colour, "width": 2},
            "showlegend": False,
            "name": "orbit",
        }
        figure.add_scatter(
            x=motion[0] * 1e6, y=motion[2] * 1e6, row=1, col=3, meta=case.index, **orbit
        )
    styled(figure, 380)
    legend_above(figure)
    for column, unit in ((1, "µm"), (2, angle.unit)):
        figure.update_xaxes(title_text="time / period", col=column)
        figure.update_yaxes(title_text=f"motion about the mean ({unit})", col=column)
    figure.update_xaxes(title_text="x (µm)", col=3)
    figure.update_yaxes(title_text="z (µm)", scaleanchor="x3", constrain="domain", col=3)
    caption = "Rigid-body motion of the damper's centre about its mean position: x along the row, y along its axis, z outward."
    return Plot(key, title, caption, figure, {c.index: _damper_caption(result, c) for c in cases})


def _side_colours(result: Result) -> list[str]:
    return [RIGHT_SIDE if right else LEFT_SIDE for right in right_side(result)]


def right_side(result: Result) -> list[bool]:
    """Say for every contact whether it lies on the right blade: its normal points towards +x."""
    names = result.labels("contact")
    if not result.has("contact_frame"):
        return [name.upper().startswith("R") for name in names]
    frame = result.data["contact_frame"].transpose("contact", "xyz", "direction").values
    return [bool(x > 0) for x in np.asarray(frame)[:, 0, 2]]


def _energy_caption(result: Result, case: Case) -> str:
    energy = result.floats("dissipated_energy")[result.peak(case)]
    names = result.labels("contact")
    total = float(np.nansum(energy))
    if total <= 0:
        return "At the peak nothing is dissipated: every point sticks."
    most = int(np.nanargmax(energy))
    right = np.array(right_side(result))
    share = 100 * float(np.nansum(energy[right])) / total
    return (
        f"At the peak {quantity(total, 'J')} are lost in a cycle, {percent(100 * float(energy[most]) / total)} of "
        f"it at {names[most]}; the right side takes {percent(share)}."
    )


def energy(result: Result) -> Plot:
    """Energy dissipated per cycle: by contact at the peak, in total against frequency."""
    key, title = "energy", "Energy dissipated in a cycle"
    if not result.has("dissipated_energy"):
        return absent(key, title, "the dissipated energy is not in this result")
    values = result.floats("dissipated_energy")
    total = np.where(result.converged, np.nansum(values, axis=1), np.nan)
    figure = make_subplots(
        1,
        2,
        horizontal_spacing=0.12,
        subplot_titles=("at the peak, by contact", "all contacts, against frequency"),
    )
    sums, bars = scale_for(total, "J"), scale_for(values, "J")
    for case in result.cases:
        peak, at = result.peak(case), result.points(case)
        if peak >= 0:
            figure.add_bar(
                x=result.labels("contact"), y=values[peak] * bars.factor, marker_color=_side_colours(result),
                meta=case.index, showlegend=False, row=1, col=1, hovertemplate=f"%{{x}}: %{{y:.3g}} {bars.unit}<extra></extra>",
            )  # fmt: skip
        y = np.where(total[at] > 0, total[at], np.nan) * sums.factor
        figure.add_scatter(
            x=result.floats("frequency_hz")[at], y=y, mode="lines", name=case.label, row=1, col=2,
            line={"color": case.colour, "width": 1.6},
        )  # fmt: skip
    styled(figure, 400, legend_title=f"load ratio {RATIO}")
    figure.update_yaxes(title_text=f"energy ({bars.unit})", rangemode="tozero", col=1)
    drawn = total[np.isfinite(total) & (total > 0)] * sums.factor
    if drawn.size:
        top = float(drawn.max())
        span = [np.log10(max(top * 1e-6, float(drawn.min()) / 1.5)), np.log10(1.6 * top)]
        figure.update_yaxes(type="log", range=span, **log_ticks(drawn, steps=(1,)), col=2)
    figure.update_yaxes(title_text=f"energy ({sums.unit})", col=2)
    figure.update_xaxes(title_text="frequency (Hz)", col=2)
    caption = (
        "Work of the friction forces in one cycle. Left: blue bars on the left blade, orange on the right one. "
        + _widest_range(result, total)
    )
    return Plot(
        key, title, caption, figure, {c.index: _energy_caption(result, c) for c in result.peaked}
    )


def _widest_range(result: Result, total: FloatArray) -> str:
    """Say in which load case friction dissipates over the widest range of frequency."""
    widths = []
    for case in result.cases:
        at = result.points(case)
        hz = result.floats("frequency_hz")[at]
        lossy = hz[np.nan_to_num(total[at]) > 0.01 * np.nanmax(np.append(total[at], 0.0))]
        widths.append(float(np.ptp(lossy)) if lossy.size else 0.0)
    if not any(widths):
        return "No point dissipates energy."
    widest = int(np.argmax(widths))
    return (
        f"Friction acts over the widest range, {number(widths[widest])} Hz with more than a hundredth of the case's "
        f"maximum, for {RATIO} = {result.cases[widest].label}."
    )
