"""Figures of the damper: its motion at the peak, and the energy its contacts dissipate."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.arrays import FloatArray
from stickslip.report.figures_contact import right_side
from stickslip.report.plot import (
    LEFT_SIDE,
    RIGHT_SIDE,
    Plot,
    absent,
    legend_above,
    log_ticks,
    styled,
)
from stickslip.report.quantities import Scale, number, percent, quantity, scale_for
from stickslip.report.result import RATIO, Case, Result

_COORDINATES = tuple(f"damper.{c}" for c in ("x", "y", "z", "rx", "ry", "rz"))
_NOTHING = 1e-12  # J a cycle: what rounding leaves of newtons times micrometres
_AXIS_LINES = (
    {"color": "#0072b2", "dash": "solid", "width": 2},
    {"color": "#d55e00", "dash": "dash", "width": 2},
    {"color": "#009e73", "dash": "dot", "width": 2},
)


def _retained(result: Result) -> list[str]:
    """Labels of the retained coordinates, as they are in the file."""
    known = "retained" in result.data.coords
    return [str(v) for v in result.data["retained"].values] if known else []


def damper_motion(result: Result, case: Case, samples: int = 128) -> tuple[FloatArray, FloatArray]:
    """Damper coordinates over one period at the peak.

    Returns
    -------
    mean
        (6,) static part: metres and radians in the order x, y, z, rx, ry, rz.
    motion
        (6, samples) motion about it.
    """
    labels = _retained(result)
    at = [labels.index(name) for name in _COORDINATES]
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


def _damper_traces(figure: go.Figure, result: Result, case: Case, angle: Scale) -> None:
    """Add translation, rotation and orbit of one load case."""
    motion = damper_motion(result, case)[1]
    time = np.linspace(0, 1, motion.shape[1])
    for name, line, move, turn in zip("xyz", _AXIS_LINES, motion[:3], motion[3:], strict=True):
        shared = {
            "line": line,
            "legendgroup": name,
            "meta": case.index,
            "mode": "lines",
            "name": name,
        }
        figure.add_scatter(x=time, y=move * 1e6, row=1, col=1, **shared)
        figure.add_scatter(x=time, y=turn * angle.factor, row=1, col=2, showlegend=False, **shared)
    orbit = {"mode": "lines", "line": {"color": case.colour, "width": 2}, "name": "orbit"}
    x, z = motion[0] * 1e6, motion[2] * 1e6
    figure.add_scatter(x=x, y=z, row=1, col=3, meta=case.index, showlegend=False, **orbit)


def damper(result: Result) -> Plot:
    """Motion of the damper over one period at the peak and its orbit."""
    key, title = "damper", "Motion of the damper at the peak"
    cases = result.peaked if result.has("retained_displacement") else ()
    if not cases or not set(_COORDINATES) <= set(_retained(result)):
        return absent(key, title, "the damper's coordinates at a peak are not in this result")
    turns = np.concatenate([damper_motion(result, c)[1][3:].ravel() for c in cases])
    angle = scale_for(turns, "rad")
    titles = ("translation", "rotation", "orbit in the x–z plane")
    figure = make_subplots(1, 3, horizontal_spacing=0.1, subplot_titles=titles)
    for case in cases:
        _damper_traces(figure, result, case, angle)
    styled(figure, 380)
    legend_above(figure)
    for column, unit in ((1, "µm"), (2, angle.unit)):
        figure.update_xaxes(title_text="time / period", col=column)
        figure.update_yaxes(title_text=f"motion about the mean ({unit})", col=column)
    figure.update_xaxes(title_text="x (µm)", col=3)
    figure.update_yaxes(title_text="z (µm)", scaleanchor="x3", constrain="domain", col=3)
    caption = (
        "Rigid-body motion of the damper's centre about its mean position: x along the row of blades, y along the "
        "damper's axis, z outward."
    )
    return Plot(key, title, caption, figure, {c.index: _damper_caption(result, c) for c in cases})


def _side_colours(result: Result) -> list[str]:
    return [RIGHT_SIDE if right else LEFT_SIDE for right in right_side(result)]


def _energy_caption(result: Result, case: Case) -> str:
    energy = result.floats("dissipated_energy")[result.peak(case)]
    names = result.labels("contact")
    total = float(np.nansum(energy))
    if total <= _NOTHING:
        return "At the peak nothing is dissipated: every point sticks."
    most = int(np.nanargmax(energy))
    right = np.array(right_side(result))
    share = 100 * float(np.nansum(energy[right])) / total
    return (
        f"At the peak {quantity(total, 'J')} are lost in a cycle, {percent(100 * float(energy[most]) / total)} of "
        f"it at {names[most]}; the right side takes {percent(share)}."
    )


def _energy_traces(
    figure: go.Figure, result: Result, values: FloatArray, total: FloatArray
) -> None:
    """Add bars at the peak (left) and curves against frequency (right) of all load cases."""
    for case in result.cases:
        peak, at = result.peak(case), result.points(case)
        if peak >= 0:
            figure.add_bar(
                x=result.labels("contact"), y=values[peak], marker_color=_side_colours(result), meta=case.index,
                showlegend=False, hovertemplate="%{x}: %{y:.3g}<extra></extra>", row=1, col=1,
            )  # fmt: skip
        hz, line = result.floats("frequency_hz")[at], {"color": case.colour, "width": 1.6}
        y = np.where(total[at] > 0, total[at], np.nan)
        figure.add_scatter(x=hz, y=y, mode="lines", name=case.label, line=line, row=1, col=2)


def energy(result: Result) -> Plot:
    """Energy dissipated per cycle: by contact at the peak, in total against frequency."""
    key, title = "energy", "Energy dissipated in a cycle"
    if not result.has("dissipated_energy"):
        return absent(key, title, "the dissipated energy is not in this result")
    values = result.floats("dissipated_energy")
    total = np.where(result.converged, np.nansum(values, axis=1), np.nan)
    total = np.where(total < _NOTHING, 0.0, total)
    bars, sums = scale_for(values, "J"), scale_for(total, "J")
    titles = ("at the peak, by contact", "all contacts, against frequency")
    figure = make_subplots(1, 2, horizontal_spacing=0.12, subplot_titles=titles)
    _energy_traces(figure, result, values * bars.factor, total * sums.factor)
    styled(figure, 400, legend_title=f"load ratio {RATIO}")
    figure.update_yaxes(title_text=f"energy ({bars.unit})", rangemode="tozero", col=1)
    drawn = total[np.isfinite(total) & (total > 0)] * sums.factor
    if drawn.size:
        top = float(drawn.max())
        span = [np.log10(max(top * 1e-6, float(drawn.min()) / 1.5)), np.log10(1.6 * top)]
        figure.update_yaxes(type="log", range=span, **log_ticks(drawn), col=2)
    figure.update_yaxes(title_text=f"energy ({sums.unit})", col=2)
    figure.update_xaxes(title_text="frequency (Hz)", col=2)
    caption = (
        "Work of the friction forces in one cycle. Left: blue bars on the left blade, orange on the right one. "
        + _widest_range(result, total)
    )
    captions = {c.index: _energy_caption(result, c) for c in result.peaked}
    return Plot(key, title, caption, figure, captions)


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
