"""The run-up: a Campbell diagram with the response on it, amplitudes over speed, static forces."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from stickslip.arrays import BoolArray
from stickslip.report.content import Table
from stickslip.report.plot import INK, MUTED, Plot, colour, styled
from stickslip.report.quantities import counted, number, percent, quantity, scale_for
from stickslip.report.result import Node
from stickslip.report.section import Block, Card, Section

_DASHES = ("dash", "dot", "dashdot", "longdash")
_LARGEST, _SMALLEST = 26.0, 3.0  # markers of the largest and of no amplitude
_SCALE = [[0.0, "#dfe6ee"], [0.35, "#56b4e9"], [0.7, "#e69f00"], [1.0, "#c0262d"]]


@dataclass(frozen=True, eq=False)
class RunUpView(Node):
    """One case of a run-up."""

    @property
    def orders(self) -> list[int]:
        """Engine orders."""
        return [int(m) for m in self.integers("engine_orders")]

    @property
    def output(self) -> int:
        """Index of the output whose peak is resolved."""
        return int(self.scalar("report_output", 0))

    def own(self, order: int) -> BoolArray:
        """Return which points are those of an engine order."""
        return np.asarray(self.integers("points_order") == order)

    @property
    def output_name(self) -> str:
        """Name of that output."""
        return self.labels_of("output_label")[self.output]


def campbell_with_response(view: RunUpView) -> Plot:
    """Show the amplitudes on the lines of their engine orders, between natural frequencies with stuck and open contacts."""
    rpm, hz = view.floats("speed_rpm"), view.floats("frequency_hz")
    amplitude = view.values("amplitude", "point", "output")[:, view.output]
    scale = scale_for(amplitude, "m")
    top = float(np.nanmax(amplitude)) if np.isfinite(amplitude).any() else 1.0
    figure = go.Figure()
    speeds = view.floats("line_speed_rpm")
    span = [float(hz.min()), float(hz.max())]
    pad = 0.08 * (span[1] - span[0])
    for name, dash, title in (("stuck_hz", "solid", "stuck"), ("open_hz", "dot", "open")):
        found = view.values(name, "line", "line_speed", "mode")
        shown = {int(view.integers("wave_number")[i]): found[i] for i in reversed(range(len(found)))}
        for j, (wave, lines) in enumerate(sorted(shown.items())):
            for mode in range(lines.shape[1]):
                figure.add_scatter(
                    x=speeds,
                    y=lines[:, mode],
                    mode="lines",
                    name=f"wave {wave}, {title}",
                    legendgroup=f"{wave}{title}",
                    showlegend=mode == 0,
                    line={"color": colour(j), "width": 1.3, "dash": dash},
                    hovertemplate=f"wave {wave}, mode {mode + 1}, {title}: %{{y:.6g}} Hz at %{{x:.5g}} rpm<extra></extra>",
                )
    for i, order in enumerate(view.orders):
        own = view.own(order) & np.isfinite(amplitude)
        figure.add_scatter(
            x=speeds[[0, -1]],
            y=order * speeds[[0, -1]] / 60,
            mode="lines+text",
            text=["", f"EO {order}"],
            textposition="middle right",
            textfont={"size": 11, "color": MUTED},
            name="engine orders",
            legendgroup="orders",
            showlegend=i == 0,
            cliponaxis=False,
            hoverinfo="skip",
            line={"color": MUTED, "width": 1, "dash": "dash"},
        )
        figure.add_scatter(
            x=rpm[own],
            y=hz[own],
            mode="markers",
            name=f"EO {order}",
            showlegend=False,
            customdata=amplitude[own] * scale.factor,
            marker={
                "size": _SMALLEST + (_LARGEST - _SMALLEST) * np.sqrt(amplitude[own] / top),
                "color": amplitude[own] * scale.factor,
                "colorscale": _SCALE,
                "cmin": 0.0,
                "cmax": top * scale.factor,
                "showscale": i == 0,
                "opacity": 0.85,
                "line": {"width": 0.5, "color": INK},
                "colorbar": {
                    "title": {"text": scale.unit, "side": "right"},
                    "x": 1.0,
                    "y": 0.0,
                    "yanchor": "bottom",
                    "len": 0.5,
                },
            },
            hovertemplate=f"EO {order}: %{{customdata:.5g}} {scale.unit} at %{{x:.6g}} rpm, %{{y:.6g}} Hz<extra></extra>",
        )
    styled(figure, 640)
    width = float(np.ptp(speeds))
    figure.update_xaxes(
        title_text="speed (rpm)",
        range=[speeds[0] - 0.01 * width, speeds[-1] + 0.07 * width],
        exponentformat="none",
        separatethousands=True,
    )
    figure.update_yaxes(title_text="frequency (Hz), rotating frame", range=[max(span[0] - pad, 0.0), span[1] + pad])
    caption = (
        f"Amplitude of {view.output_name} along {counted(len(view.orders), 'engine order')}: size and colour of the circles, the largest "
        f"{quantity(top, 'm')}. Each point has the stiffness, the contact state and the static preload of its own speed. Lines: natural "
        "frequencies of the waves that the engine orders excite, with all contacts stuck (solid) and open (dotted)."
    )
    return Plot(f"run_up{view.key}", "Campbell diagram with the response", caption, figure)


def amplitudes(view: RunUpView) -> Plot:
    """Show the amplitude of each engine order over the speed."""
    rpm, shares = view.floats("speed_rpm"), view.floats("slipping")
    amplitude = view.values("amplitude", "point", "output")[:, view.output]
    scale = scale_for(amplitude, "m")
    figure = go.Figure()
    for i, order in enumerate(view.orders):
        own = view.own(order)
        figure.add_scatter(
            x=rpm[own],
            y=scale.factor * amplitude[own],
            mode="lines+markers",
            name=f"EO {order}",
            customdata=100 * shares[own],
            line={"color": colour(i), "width": 1.6},
            marker={"size": 4},
            hovertemplate=f"EO {order}: %{{y:.5g}} {scale.unit} at %{{x:.6g}} rpm, %{{customdata:.0f}} % of the contacts slip<extra></extra>",
        )
    styled(figure, 480)
    figure.update_xaxes(title_text="speed (rpm)", exponentformat="none", separatethousands=True)
    figure.update_yaxes(title_text=f"amplitude of {view.output_name} ({scale.unit})", rangemode="tozero")
    caption = "Amplitude over speed, a line an engine order; points without a solution are left out."
    return Plot(f"run_up_amplitude{view.key}", "Amplitude over speed", caption, figure)


def fast(view: RunUpView) -> Plot | None:
    """Show fast run-ups beside the steady response."""
    if not view.has("fast_speed_rpm", "fast_amplitude"):
        return None
    rpm, swept = view.floats("fast_speed_rpm"), view.floats("fast_amplitude")
    steady = view.values("amplitude", "point", "output")[:, view.output]
    scale = scale_for(steady, "m")
    figure = go.Figure()
    for i, order in enumerate(view.orders):
        own = view.own(order)
        figure.add_scatter(
            x=view.floats("speed_rpm")[own],
            y=scale.factor * steady[own],
            mode="lines",
            name=f"EO {order}, steady",
            line={"color": colour(i), "width": 2.2},
            hovertemplate=f"EO {order}, steady: %{{y:.5g}} {scale.unit} at %{{x:.6g}} rpm<extra></extra>",
        )
        for j, k in enumerate(np.flatnonzero(view.integers("fast_order") == order)):
            rate = float(view.floats("fast_rate_rpm_per_s")[k])
            figure.add_scatter(
                x=rpm[k],
                y=scale.factor * swept[k],
                mode="lines",
                name=f"EO {order}, {rate:g} rpm/s",
                line={"color": colour(i), "width": 1.2, "dash": _DASHES[j % len(_DASHES)]},
                hovertemplate=f"EO {order}, {rate:g} rpm/s: %{{y:.5g}} {scale.unit} at %{{x:.6g}} rpm<extra></extra>",
            )
    styled(figure, 480)
    figure.update_xaxes(title_text="speed (rpm)", exponentformat="none", separatethousands=True)
    figure.update_yaxes(title_text=f"amplitude of {view.output_name} ({scale.unit})", rangemode="tozero")
    ratios = view.floats("fast_ratio")
    known = ratios[np.isfinite(ratios)]
    told = f": the smallest peak is {number(100 * known.min(), 4)} % of the steady one" if known.size else ""
    caption = (
        f"Amplitude while the speed changes at a constant rate, beside that of the steady motion{told}. Contact forces are those of the "
        "momentary amplitude; beats behind a peak are less certain than the peak."
    )
    return Plot(f"run_up_fast{view.key}", "Fast run-up", caption, figure)


def fast_peaks(view: RunUpView) -> Table | None:
    """Return the peaks of fast run-ups as a table."""
    if not view.has("fast_speed_rpm"):
        return None
    rows = []
    for k in range(len(view.integers("fast_order"))):
        peak, rpm, ratio, shift, off = (
            float(view.floats(f"fast_{name}")[k])
            for name in ("peak_amplitude", "peak_speed_rpm", "ratio", "shift_rpm", "neglected")
        )
        rate = float(view.floats("fast_rate_rpm_per_s")[k])
        first = [str(view.integers("fast_order")[k]), number(rate, 6), quantity(peak, "m", 5)]
        later = [number(ratio, 4), number(rpm, 6), number(shift, 4), percent(100 * off)]
        rows.append([*first, *later])
    head = ["engine order", "rpm/s", "peak", "of the steady one", "at rpm", "shift in rpm", "left out"]
    return Table(head, rows, "Peaks of fast run-ups")


def static_forces(view: RunUpView) -> Plot:
    """Show how the static normal force of the contacts grows with the speed."""
    rpm, force = (view.floats("static_speed_rpm"), view.values("static_normal_n", "line", "static_speed")[0])
    figure = go.Figure(go.Scatter(x=rpm, y=force, mode="lines+markers", line={"color": colour(0)}, showlegend=False))
    styled(figure, 360)
    figure.update_xaxes(title_text="speed (rpm)", exponentformat="none", separatethousands=True)
    figure.update_yaxes(title_text="normal force of all contacts (N)")
    caption = (
        "Static normal force under the loads of each speed, summed over the contacts (of a wheel: of one sector), at the speeds at which the "
        "model was assembled."
    )
    return Plot(f"run_up_static{view.key}", "Static normal force over speed", caption, figure)


def peaks(view: RunUpView) -> Table:
    """Return the peaks as a table."""
    rows = []
    for i, order in enumerate(view.orders):
        top = int(view.integers("peak_point")[i])
        slip, power = (view.floats(name)[top] if top >= 0 else np.nan for name in ("slipping", "dissipated_w"))
        rows.append(
            [
                str(order),
                str(view.integers("wave_number")[i]),
                quantity(float(view.floats("peak_amplitude")[i]), "m", 5),
                number(float(view.floats("peak_speed_rpm")[i]), 6),
                number(float(view.floats("peak_frequency_hz")[i]), 6),
                percent(100 * float(slip)),
                quantity(float(power), "W"),
                str(view.integers("failed")[i]),
                "" if view.integers("peak_inside")[i] else "at an end of the range",
            ]
        )
    head = ["engine order", "wave", "peak", "rpm", "Hz", "contacts that slip", "dissipated", "failed points", ""]
    return Table(head, rows, "Peaks")


def _cards(view: RunUpView) -> list[Card]:
    peak = view.floats("peak_amplitude")
    if not np.isfinite(peak).any():
        return []
    i = int(np.nanargmax(peak))
    note = f"engine order {view.orders[i]} at {number(float(view.floats('peak_speed_rpm')[i]), 5)} rpm"
    return [Card(quantity(float(peak[i]), "m"), "largest amplitude of the run-up", note)]


_NEEDS = ("engine_orders", "speed_rpm", "amplitude", "stuck_hz")
_BLOCK = Block("run_up", "Run-up", (campbell_with_response, amplitudes, peaks, fast, fast_peaks, static_forces))
SECTION: Section = Section("run_up", _NEEDS, RunUpView, (_BLOCK,), by_case=True, cards=_cards)
